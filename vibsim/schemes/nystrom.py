r"""Runge-Kutta-Nystroem methods for ``u'' = a(u, t)``; each is its tableau.

``A_i = a(u + c_i dt v + dt^2 sum_j a_ij A_j, t + c_i dt)``, then ``u = u + dt v + dt^2 sum_i p_i A_i`` and
``v = v + dt sum_i q_i A_i``. What a Runge-Kutta method spends on velocities between the points is saved: order 4 with
three evaluations of the force where `rk4` has four. Neither symplectic nor symmetric.

Source: E. J. Nystroem 1925; E. Hairer, S. P. Norsett and G. Wanner, Solving Ordinary Differential Equations I, section
II.14, table 14.2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

from vibsim.schemes.base import Options, Scheme, Stepper
from vibsim.schemes.code_generation import weighted, written
from vibsim.schemes.one_step import self_starting
from vibsim.schemes.orders import Orders


@dataclass(frozen=True)
class NystromTableau:
    """Tableau of an explicit method; entries are formulas."""

    c: tuple[str, ...]
    """Places of the accelerations behind the first one, as parts of the step."""
    a: tuple[tuple[str, ...], ...]
    """Their rows; each has the entries below the diagonal."""
    position: tuple[str, ...]
    velocity: tuple[str, ...]


@cache
def from_tableau(tableau: NystromTableau) -> Stepper:
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


CLASSICAL = NystromTableau(
    c=("1/2", "1"),
    a=(("1/8",), ("0", "1/2")),
    position=("1/6", "1/3", "0"),
    velocity=("1/6", "2/3", "1/6"),
)

_ORDERS = Orders(position=4, velocity=4, energy=4, energy_linear=4)


def _stepper(options: Options) -> Stepper:
    return from_tableau(CLASSICAL)


RKN4 = Scheme(
    kind="rkn4",
    title="Nystroem's method (order 4)",
    source="Nystroem 1925; Hairer, Norsett and Wanner I, section II.14",
    family="Runge-Kutta-Nystroem",
    stepper=_stepper,
    orders=lambda options: _ORDERS,
    force_evaluations=len(CLASSICAL.velocity),
    start="none: a one-step method",
    velocity_forces=False,
)
