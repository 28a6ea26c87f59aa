r"""Explicit Runge-Kutta and Runge-Kutta-Nystroem methods, given by their tableaux.

**Runge-Kutta**, for ``u' = v``, ``v' = a(u, v, t)``:
``U_i = u + dt sum_j a_ij V_j``, ``V_i = v + dt sum_j a_ij A_j``, ``A_i = a(U_i, V_i, t + c_i dt)``, and the same sums
with b_i give the next point. These one-step methods are self-starting and take any force.

On ``u'' + w^2 u = 0`` a step multiplies the energy by ``|R(i w dt)|^2``, R the truncated exponential: ``1 + p^2`` for
Forward Euler, ``1 + p^4/4`` at order 2, ``1 - p^4/12 + ...`` at order 3, ``1 - p^6/72 + ...`` at order 4, so the energy
is of order 1, 3, 3 and 5 there (`errata`: the vibration text finds dt^2 for RK4, an artefact of ``[D_2t u]``).

**Runge-Kutta-Nystroem**, for ``u'' = a(u, t)``: ``A_i = a(u + c_i dt v + dt^2 sum_j a_ij A_j, t + c_i dt)``, then
``u = u + dt v + dt^2 sum_i p_i A_i`` and ``v = v + dt sum_i q_i A_i``. No velocities are needed at the stages: order 4
takes three evaluations of the force instead of the four of `rk4`. Neither symplectic nor symmetric.

Source: vibration text (B), sections 5.1 (Forward Euler) and 5.5; E. Hairer, S. P. Norsett and G. Wanner, Solving
Ordinary Differential Equations I, section II.1 (Kutta's third and fourth order methods, Heun, the midpoint rule) and
section II.14, table 14.2 (E. J. Nystroem 1925).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

from vibsim.schemes.base import Scheme, Stepper
from vibsim.schemes.code_generation import self_starting, weighted, written
from vibsim.schemes.orders import Orders, same_orders


@dataclass(frozen=True)
class Tableau:
    """Butcher's tableau of an explicit method; entries are formulas."""

    a: tuple[tuple[str, ...], ...]
    """The rows after the first; each has the entries below the diagonal."""
    b: tuple[str, ...]


@cache
def from_tableau(tableau: Tableau) -> Stepper:
    """Return the arithmetic of an explicit method."""
    formulas: dict[str, str] = {}

    lines = ["u, v = state", "a_1 = acceleration(u, v, t, p)"]
    velocities, accelerations = ["v"], ["a_1"]
    for i, row in enumerate(tableau.a, 2):
        formulas[f"C_{i}"] = " + ".join(f"({entry})" for entry in row)
        drift = weighted(f"A_{i}", row, velocities, formulas)
        kick = weighted(f"A_{i}", row, accelerations, formulas)
        lines += [
            f"v_{i} = v + dt * ({kick})",
            f"a_{i} = acceleration(u + dt * ({drift}), v_{i}, t + C_{i} * dt, p)",
        ]
        velocities.append(f"v_{i}")
        accelerations.append(f"a_{i}")
    drift = weighted("B", tableau.b, velocities, formulas)
    kick = weighted("B", tableau.b, accelerations, formulas)
    lines.append(f"return (u + dt * ({drift}), v + dt * ({kick})), v")
    body = "\n    ".join(lines)
    text = f"def step_runge_kutta(state, t, dt, p, acceleration):\n    {body}\n"
    return self_starting(written(text, formulas))


def _scheme(kind: str, title: str, source: str, tableau: Tableau, orders: Orders) -> Scheme:
    return Scheme(
        kind=kind,
        title=title,
        source=source,
        family="Runge-Kutta",
        stepper=lambda options: from_tableau(tableau),
        orders=lambda options: orders,
    )


FORWARD_EULER = _scheme(
    "forward_euler",
    "Forward Euler",
    "vibration text, sections 5.1 and 5.6",
    Tableau((), ("1",)),
    same_orders(1),
)
RK2 = _scheme(
    "rk2",
    "Explicit midpoint rule (Runge-Kutta, order 2)",
    "vibration text, section 5.5; Hairer, Norsett and Wanner I, section II.1",
    Tableau((("1/2",),), ("0", "1")),
    same_orders(2, energy_linear=3, energy_d2t_linear=3),
)
HEUN = _scheme(
    "heun",
    "Heun's method (explicit trapezoidal rule)",
    "Hairer, Norsett and Wanner I, section II.1",
    Tableau((("1",),), ("1/2", "1/2")),
    same_orders(2, energy_linear=3, energy_d2t_linear=3),
)
RK3 = _scheme(
    "rk3",
    "Kutta's third-order method",
    "vibration text, exercise 12; Hairer, Norsett and Wanner I, section II.1",
    Tableau((("1/2",), ("-1", "2")), ("1/6", "2/3", "1/6")),
    same_orders(3),
)
RK4 = _scheme(
    "rk4",
    "Classical Runge-Kutta method (order 4)",
    "vibration text, section 5.5; Hairer, Norsett and Wanner I, section II.1",
    Tableau((("1/2",), ("0", "1/2"), ("0", "0", "1")), ("1/6", "1/3", "1/3", "1/6")),
    same_orders(4, energy_linear=5),
)


@dataclass(frozen=True)
class NystromTableau:
    """Tableau of an explicit method; entries are formulas."""

    c: tuple[str, ...]
    """Nodes of the stages after the first, as fractions of the step."""
    a: tuple[tuple[str, ...], ...]
    """Rows of these stages; each has the entries below the diagonal."""
    position: tuple[str, ...]
    velocity: tuple[str, ...]


@cache
def _nystrom(tableau: NystromTableau) -> Stepper:
    """Return the arithmetic of a method."""
    formulas: dict[str, str] = {}
    names = ["a_1"]

    def total(prefix: str, row: Sequence[str]) -> str:
        return weighted(prefix, row, names, formulas)

    lines = ["u, v = state", "a_1 = acceleration(u, v, t, p)"]
    for i, (c, row) in enumerate(zip(tableau.c, tableau.a, strict=True), 2):
        drift = weighted(f"C_{i}", (c,), ("v",), formulas)
        ahead = "dt" if c == "1" else f"C_{i}_1 * dt"
        lines += [
            f"u_{i} = u + dt * ({drift} + dt * ({total(f'A_{i}', row)}))",
            f"a_{i} = acceleration(u_{i}, v, t + {ahead}, p)",
        ]
        names.append(f"a_{i}")
    position, velocity = total("P", tableau.position), total("Q", tableau.velocity)
    lines.append(f"return (u + dt * (v + dt * ({position})), v + dt * ({velocity})), v")
    body = "\n    ".join(lines)
    text = f"def step_nystrom(state, t, dt, p, acceleration):\n    {body}\n"
    return self_starting(written(text, formulas))


_CLASSICAL = NystromTableau(
    c=("1/2", "1"),
    a=(("1/8",), ("0", "1/2")),
    position=("1/6", "1/3", "0"),
    velocity=("1/6", "2/3", "1/6"),
)

RKN4 = Scheme(
    kind="rkn4",
    title="Nystroem's method (order 4)",
    source="Nystroem 1925; Hairer, Norsett and Wanner I, section II.14",
    family="Runge-Kutta-Nystroem",
    stepper=lambda options: _nystrom(_CLASSICAL),
    orders=lambda options: same_orders(4),
    velocity_forces=False,
)

RUNGE_KUTTA = (FORWARD_EULER, RK2, HEUN, RK3, RK4)
