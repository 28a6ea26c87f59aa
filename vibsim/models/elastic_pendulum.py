r"""The elastic pendulum: a body on an elastic wire, in the plane; dimensionless.

``x'' = -beta T x/L``, ``y'' = beta (T (1 - y)/L - 1)``, minus the drag ``(gamma/beta) |v| v``, with the length of the
wire ``L = sqrt(x^2 + (1 - y)^2)`` and its pull over the weight, ``T = (L - beta)/(1 - beta)``. The equilibrium is the
origin, where L = T = 1; the pivot is at (0, 1). Lengths are scaled by that of the wire in equilibrium, ``L_0 + m g/k``,
time by ``sqrt(L_0/g)``; ``beta = L_0/(L_0 + m g/k)``, and ``gamma = rho C_D A L_0/(2 m)`` for a drag
``rho C_D A |v| v/2``.

The body starts from rest, with the wire at the angle Theta and longer by epsilon than in equilibrium:
``x = (1 + epsilon) sin Theta``, ``y = 1 - (1 + epsilon) cos Theta``. Small swings have the frequency ``sqrt(beta)``
(not 1: `errata`), stretching has ``sqrt(beta/(1 - beta))``: as beta tends to 1, steps must resolve the latter, which is
much faster than a swing.

With ``L - 1 = (x^2 + y (y - 2))/(L + 1)``, which has no cancellation, ``T = 1 + (L - 1)/(1 - beta)`` keeps its digits
for beta near 1, and the equilibrium is exact. The limit 1/L that the text proposes there is wrong: L depends on beta
(`errata`).

The forces of a manufactured solution (exercise 23 asks for a test of the drag) are those with which ``exact_x`` and
``exact_y``, formulas in t, solve the equations.

With Theta = 0 and no drag the motion is vertical: ``y = -epsilon cos(sqrt(beta/(1 - beta)) t)`` exactly, because for
``|epsilon| < 1`` the wire acts as a linear spring.

Source: vibration text (B), section 10.7, equations (106)-(112), and exercises 22 and 23.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache, partial
from typing import Any

import numpy as np

from vibsim.core.array_types import Floats
from vibsim.elementary import on_arrays
from vibsim.formula import Name, parse
from vibsim.models.base import (
    Damping,
    FormulaField,
    Model,
    Numbers,
    Output,
    Parameter,
    State,
    declared_parameters,
)
from vibsim.models.shared.linear_motion import motion
from vibsim.models.shared.manufactured import Manufactured

STATES = (
    State("x", "1", "horizontal position"),
    State("y", "1", "height above the place of rest"),
    State("vx", "1", "horizontal velocity"),
    State("vy", "1", "vertical velocity"),
)
BETA = Parameter(
    "beta",
    0.9,
    "1",
    "length of the wire without load over that at rest; towards 1 the wire is stiff",
    minimum=0.0,
    exclusive=True,
    maximum=0.999999,
)
LONGER = "initial stretch of the wire beyond its length at rest"
START = (
    Parameter("Theta", 30.0, "degree", "initial angle of the wire", -180.0, maximum=180.0),
    Parameter("epsilon", 0.0, "1", LONGER, minimum=-1.0, exclusive=True),
)
DRAG = Parameter("gamma", 0.0, "1", "coefficient of the drag", minimum=0.0)
EXACT = "exact solution x(t), from which forces then follow; the motion starts on it, without Theta and epsilon"
FORMULAS = (
    FormulaField("exact_x", ("t",), "0", EXACT, derivatives=2),
    FormulaField("exact_y", ("t",), "0", "exact solution y(t) beside exact_x", derivatives=2),
)

LENGTH = "sqrt(x**2 + (1.0 - y)**2)"
BEYOND = f"((x**2 + y*(y - 2.0))/({LENGTH} + 1.0))"
PULL = f"(1.0 + {BEYOND}/(1.0 - beta))"
SPEED = "hypot(vx, vy)"
ACROSS = f"-beta*{PULL}*x/{LENGTH}"
UPWARD = f"beta*({PULL}*(1.0 - y)/{LENGTH} - 1.0)"
OUTPUTS = (
    Output("angle", "degree", "angle of the wire with the vertical", "180.0/pi*atan2(x, 1.0 - y)"),
    Output("wire_length", "1", "length of the wire over that at rest", LENGTH),
    Output("wire_force", "1", "pull of the wire over the weight", PULL),
)
AIR = Output("drag_force", "1", "drag over the weight", f"(gamma/beta**2)*{SPEED}**2")
EQUATION = "x'' = -beta T x/L{}, y'' = beta (T (1 - y)/L - 1){}, T = (L - beta)/(1 - beta), L = sqrt(x^2 + (1 - y)^2)"


def highest_frequency(parameters: Numbers) -> Any:
    """Return the angular frequency of stretching, ``sqrt(beta/(1 - beta))``, which exceeds that of small swings."""
    beta = parameters["beta"]
    return np.sqrt(beta / (1.0 - beta))


def start(parameters: Numbers) -> dict[str, Any]:
    """Return the initial position, B (109) and (111), and velocity 0."""
    angle, length = np.deg2rad(parameters["Theta"]), 1.0 + np.asarray(parameters["epsilon"])
    zero = np.zeros(np.broadcast_shapes(np.shape(angle), np.shape(length)))
    # 1 - (1 + epsilon) cos(Theta), without the rounding of 1 + epsilon where Theta is 0
    lifted = 2.0 * length * on_arrays.sin(0.5 * angle) ** 2 - parameters["epsilon"]
    return {"x": length * on_arrays.sin(angle), "y": lifted + zero, "vx": zero, "vy": zero}


def vertical_motion(t: Floats, initial: Numbers, parameters: Numbers) -> dict[str, Floats]:
    """Return the exact vertical motion without drag (exercise 22c); NaN for other motions or if it meets the pivot."""
    w = highest_frequency(parameters)
    y, vy = motion(t, w, initial["y"], initial["vy"])
    is_vertical = (np.asarray(initial["x"]) == 0.0) & (np.asarray(initial["vx"]) == 0.0)
    stays_below = on_arrays.hypot(initial["y"], initial["vy"] / w) < 1.0
    zero = np.where(is_vertical & stays_below, 0.0, np.nan) + 0.0 * y
    return {"x": zero, "y": y + zero, "vx": zero, "vy": vy + zero}


def written(formulas: Mapping[str, str], declared: tuple[str, ...]) -> Model:
    """Return the elastic pendulum that hangs vertically, or that follows a manufactured solution.

    Raises ExpressionError if a formula uses a name that its field does not allow.
    """
    return elastic_pendulum(tuple(sorted(formulas.items())), declared, frozenset())


@cache
def elastic_pendulum(
    texts: tuple[tuple[str, str], ...], declared: tuple[str, ...], terms: frozenset[str]
) -> Model:
    """Return the elastic pendulum, with drag if `terms` contains ``gamma``, off the vertical if it has ``Theta``."""
    is_dragged, formulas = "gamma" in terms, dict(texts)
    fixed = (BETA, DRAG) if formulas else (BETA, *START, DRAG)
    parameters = (*fixed, *declared_parameters(declared))
    known = tuple(row.name for row in parameters)
    states = tuple(state.name for state in STATES)
    drags = [f" - (gamma/beta)*{SPEED}*{name}" if is_dragged else "" for name in ("vx", "vy")]
    forces = [
        parse(text + drag, (*states, *known))
        for text, drag in zip((ACROSS, UPWARD), drags, strict=True)
    ]
    more: dict[str, Any] = {"start": start}
    if formulas:
        motions = (formulas.get(field.name, field.default) for field in FORMULAS)
        positions = tuple(parse(text, ("t", *known)) for text in motions)
        followed = Manufactured(positions, tuple(formulas.values()), states, parameters)
        pushes = followed.forces(forces)
        forces = [force + push for force, push in zip(forces, pushes, strict=True)]
        along_x, along_y = (push * Name(v) for push, v in zip(pushes, ("vx", "vy"), strict=True))
        more = {"exact": followed.exact, "start": followed.start, "driving": along_x + along_y}
    elif not terms:
        more["exact"] = vertical_motion
    if is_dragged:
        more["damping"] = Damping("quadratic", "gamma/beta")
        more["dissipation"] = f"(gamma/beta)*{SPEED}**3"
    return Model(
        kind="elastic_pendulum",
        title="Elastic pendulum",
        source="vibration text, section 10.7, equations (106)-(112), and exercises 22 and 23",
        equation=_equation(is_dragged, formulas),
        states=STATES,
        parameters=parameters,
        acceleration=forces[0],
        further_accelerations=(forces[1],),
        kinetic_energy="0.5*(vx**2 + vy**2)",
        potential_energy=f"beta*({BEYOND}*(1.0 + 0.5*{BEYOND}/(1.0 - beta)) + y)",
        energy_unit="1",
        linear=False,
        conservative=not is_dragged and not formulas,
        natural_frequency=lambda parameters: np.sqrt(parameters["beta"]),
        highest_frequency=highest_frequency,
        outputs=(*OUTPUTS, AIR) if is_dragged else OUTPUTS,
        formulas=FORMULAS,
        written=written,
        optional=("gamma",) if formulas else ("Theta", "gamma"),
        variant=partial(elastic_pendulum, texts, declared),
        **more,
    )


def _equation(is_dragged: bool, formulas: Mapping[str, str]) -> str:
    drags = [f" - (gamma/beta) |v| {name}'" if is_dragged else "" for name in ("x", "y")]
    pushes = (" + F_x(t)", " + F_y(t)") if formulas else ("", "")
    equations = EQUATION.format(*(drag + push for drag, push in zip(drags, pushes, strict=True)))
    motions = (f"{name.removeprefix('exact_')} = {text}" for name, text in formulas.items())
    return f"{equations}, with F such that {', '.join(motions)}" if formulas else equations


ELASTIC_PENDULUM = replace(written({}, ()), equation=_equation(is_dragged=True, formulas={}))
"""The pendulum that hangs vertically, shown with the general equation."""
