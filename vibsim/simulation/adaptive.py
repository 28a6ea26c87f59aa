"""Members integrated by SciPy, once per member and tolerance, and sampled at the points of a level.

The solver chooses its steps independently of the level. A level uses its dense output at N + 1 points: the engine's
loop gathers extrema, periods, norms and energies over these points, so that a number means the same as for other
schemes. Radau's dense output is a polynomial of degree 3, less accurate between its steps than at them.

A step is accepted when its error estimate is below ``rtol |y| + atol``, for position and velocity, with ``rtol`` the
tolerance (SciPy takes 2.2e-14 at least) and ``atol`` the tolerance times the size of the problem:
``max(|u_0|, |v_0|/w)`` for the position, w times that for the velocity, w the natural frequency; 1 if both vanish.

The forces are those of the engine's plain lane. The implicit methods get the exact Jacobian. The last bits depend on
SciPy's version and on the machine, but not on the level, the shard or the number of cores.

Source: vibration text (B), exercise 4.
"""

from __future__ import annotations

import math
import warnings
from collections import OrderedDict
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np

from vibsim.core.array_types import Floats, Integers
from vibsim.engine import Trajectories, lane_for
from vibsim.engine import integrate as integrate_steps
from vibsim.engine.gather import OVERFLOW
from vibsim.engine.kernel import kernel
from vibsim.models import Model
from vibsim.schemes.base import Options, Scheme, Stepper
from vibsim.schemes.code_generation import self_starting, written

MOST_STEPS = 2**20
"""Steps after which a run counts as failed: some minutes of work."""
CACHED_STEPS = 140_000
"""Total number of steps of all runs that are cached in the process for the other levels of a job."""
POINTS_AT_A_TIME = 2**20
"""Number of points that are evaluated at a time."""

CLASSES = {"dop853": "DOP853", "lsoda": "LSODA", "radau": "Radau"}
"""SciPy's name of each scheme."""


@dataclass(frozen=True)
class Problem:
    """One member with its integration method; equal problems share a run."""

    model: Model
    kind: str
    tolerance: float
    parameters: tuple[float, ...]
    initial: tuple[float, ...]
    """All positions and then all velocities."""
    end: float

    @property
    def scale(self) -> tuple[float, ...]:
        """Sizes of positions and velocities; absolute tolerances are relative to them."""
        count = self.model.coordinates
        named = {row.key: x for row, x in zip(self.model.parameters, self.parameters, strict=True)}
        w = float(self.model.natural_frequency(named))
        if not (w > 0.0 and math.isfinite(w)):
            w = 2.0 * math.pi / self.end
        places = (abs(u) for u in self.initial[:count])
        speeds = (abs(v) / w for v in self.initial[count:])
        size = max(*places, *speeds) or 1.0
        return (size,) * count + (w * size,) * count


@dataclass(frozen=True)
class Run:
    """The integration of a problem by SciPy."""

    times: list[float]
    """Time 0 and the ends of the accepted steps."""
    pieces: list[Any]
    """The dense output of every step: SciPy's functions of time."""
    force_evaluations: int
    """Evaluations of the acceleration, including those for error estimates and dense output."""
    states: int = 2

    def at(self, t: Floats) -> Floats:
        """Return the states at ascending times, shape (state, n_t); NaN after the last step."""
        states = np.full((self.states, len(t)), np.nan)
        step = np.searchsorted(self.times, t, side="left") - 1
        first = np.searchsorted(step, np.arange(len(self.pieces) + 1))
        for piece, start, stop in zip(self.pieces, first[:-1], first[1:], strict=True):
            if start < stop:
                states[:, start:stop] = piece(t[start:stop])
        return states


@cache
def along_a_table(coordinates: int) -> Stepper:
    """Return a stepper that reads known points from a table, which follows the parameters and has one surplus point.

    A point has all positions and then all velocities. A step returns the next point and the current velocity.
    """
    place = ", ".join(f"float(p[-1][first + {k}])" for k in range(coordinates))
    speed = ", ".join(f"float(p[-1][first + {k}])" for k in range(coordinates, 2 * coordinates))
    if coordinates > 1:
        place, speed = f"vector({place})", f"vector({speed})"
    following = place.replace("first", f"first + {2 * coordinates}")
    start = (
        "def start_tabulated(variant, u, v, dt, p, acceleration):\n"
        f"    first = {2 * coordinates}\n"
        f"    return {place}, 1.0\n"
    )
    step = (
        "def step_tabulated(state, t, dt, p, acceleration):\n"
        f"    first = {2 * coordinates} * int(state[1])\n"
        f"    return ({following}, state[1] + 1.0), {speed}\n"
    )
    return Stepper(
        start=written(start),
        step=written(step),
        own_velocity=False,
        tabulated=True,
    )


def gather_over(
    model: Model,
    scheme: Scheme,
    options: Options,
    parameters: Floats,
    table: Floats,
    initial: Floats,
    dt: Floats,
    steps: int,
    every: int,
    **more: Any,
) -> Trajectories:
    """Run the loop of `vibsim.engine.integrate` over a table of points, shape (case, steps + 2, state).

    See `along_a_table`.
    """
    members = len(dt)
    return integrate_steps(
        model,
        replace(scheme, stepper=lambda options: along_a_table(model.coordinates), damped=()),
        options,
        np.concatenate([parameters, table.reshape(members, -1)], axis=1),
        initial,
        dt,
        steps,
        every,
        lane=lane_for(members, steps, alone=True),
        **more,
    )


def pieces(where: Integers, steps: int) -> Iterator[Integers]:
    """Yield members in groups whose points `integrate` can hold in memory."""
    size = max(POINTS_AT_A_TIME // (steps + 1), 1)
    for first in range(0, len(where), size):
        yield where[first : first + size]


def integrate(
    model: Model,
    scheme: Scheme,
    options: Options,
    parameters: Floats,
    initial: Floats,
    dt: Floats,
    steps: int,
    every: int,
    **more: Any,
) -> Trajectories:
    """Integrate every member, and gather over the points of a level; see `vibsim.engine.integrate`.

    A member whose integration fails or overflows ends there; the others go on.
    """
    members = len(dt)
    states = len(model.states)
    table = np.zeros((members, steps + 2, states))
    counts = np.empty((2, members))
    for i in range(members):
        problem = Problem(
            model=model,
            kind=scheme.kind,
            tolerance=float(options["tolerance"]),
            parameters=tuple(parameters[i].tolist()),
            initial=tuple(initial[i].tolist()),
            end=steps * float(dt[i]),
        )
        run = solved(problem)
        # the first point is the initial state
        for first in range(1, steps + 1, POINTS_AT_A_TIME):
            n = np.arange(first, min(first + POINTS_AT_A_TIME, steps + 1))
            table[i, n] = run.at(n * dt[i]).T
        counts[:, i] = len(run.pieces), run.force_evaluations
    result = gather_over(
        model, scheme, options, parameters, table, initial, dt, steps, every, **more
    )
    assert result.gathered is not None
    gathered = replace(result.gathered, accepted_steps=counts[0], force_evaluations=counts[1])
    return replace(result, gathered=gathered)


_cache: OrderedDict[Problem, Run] = OrderedDict()


def solved(problem: Problem) -> Run:
    """Return the run of a problem, from the cache if another level has left it there."""
    run = _cache.pop(problem, None) or solve(problem)
    _cache[problem] = run
    total = sum(len(other.pieces) for other in _cache.values())
    while total > CACHED_STEPS and len(_cache) > 1:
        total -= len(_cache.popitem(last=False)[1].pieces)
    return run


def solve(problem: Problem) -> Run:
    """Integrate a problem to its end, or until the solver fails or the solution overflows."""
    from scipy import integrate as scipy_integrate

    right, jacobian = _right_hand_side(problem)
    more = {} if problem.kind == "dop853" else {"jac": jacobian}
    times: list[float] = [0.0]
    pieces: list[Any] = []
    # no warnings: overflow and NaN are results; LSODA warns when it stops, all solvers warn of small tolerances
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        solver = getattr(scipy_integrate, CLASSES[problem.kind])(
            right,
            0.0,
            problem.initial,
            problem.end,
            # below its smallest tolerance SciPy uses that, and warns
            rtol=problem.tolerance,
            atol=problem.tolerance * np.array(problem.scale),
            **more,
        )
        # a first step of NaN would be tried for ever
        going = math.isfinite(getattr(solver, "h_abs", 0.0))
        while going and solver.status == "running" and len(pieces) < MOST_STEPS:
            solver.step()
            # written so that NaN ends it as well
            going = solver.t > times[-1] and bool(np.abs(solver.y).sum() < OVERFLOW)
            if going and solver.status != "failed":
                pieces.append(solver.dense_output())
                times.append(float(solver.t))
    return Run(times, pieces, solver.nfev, len(problem.initial))


def _right_hand_side(problem: Problem) -> tuple[Callable[..., Any], Callable[..., Any]]:
    """Return the right-hand side for the state (u, v), and its Jacobian."""
    acceleration, slopes = _forces(problem.model)
    half, lookup = problem.model.coordinates, problem.model.lookup
    # the table follows the parameters (`vibsim.engine.formulas`)
    p: tuple[Any, ...] = (*problem.parameters, *([lookup.table.rows] if lookup else []))

    def halves(y: Floats) -> tuple[Any, Any]:
        numbers = tuple(y.tolist())
        return (numbers[0], numbers[1]) if half == 1 else (numbers[:half], numbers[half:])

    def right(t: float, y: Floats) -> tuple[float, ...]:
        u, v = halves(y)
        a: Any = acceleration(u, v, float(t), p)
        return (v, a) if half == 1 else (*v, *a)

    def jacobian(t: float, y: Floats) -> Floats:
        u, v = halves(y)
        by_u, by_v = np.reshape(slopes(u, v, float(t), p), (2, half, half))
        return np.block([[np.zeros((half, half)), np.eye(half)], [by_u, by_v]])

    return right, jacobian


def _at_rest(state: Any, t: float, dt: float, p: Any, acceleration: Any, slopes: Any) -> Any:
    """Take a step in which nothing moves, for a kernel that has the acceleration and its slopes."""
    return state, state[1]


@cache
def _forces(model: Model) -> tuple[Callable[..., float], Callable[..., tuple[float, float]]]:
    """Return the acceleration of a model and its slopes, as Python functions of (u, v, t, p)."""
    plain: Any = kernel(model, self_starting(_at_rest), "plain", False)
    return plain.__globals__["acceleration"], plain.__globals__["slopes"]
