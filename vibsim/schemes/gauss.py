r"""The Gauss method with two stages: implicit, order 4, symplectic and symmetric.

``V_i = v + dt sum_j a_ij A_j`` and ``U_i = u + dt sum_j a_ij V_j`` with ``A_i = a(U_i, V_i, t + c_i dt)``. Together
``U_i = u + c_i dt v + dt^2 sum_j (a^2)_ij A_j``: the two stage accelerations are the unknowns of each step, found by
Newton's method to round-off. On ``u'' + w^2 u = 0`` a step is ``(1 + z/2 + z^2/12)/(1 - z/2 + z^2/12)``, the Pade
approximation of ``exp z`` at z = i w dt, of modulus 1: the energy is kept exactly and no step is too large.

Source: E. Hairer, C. Lubich and G. Wanner, Geometric Numerical Integration, sections II.1.3 and IV.2.1; E. Hairer,
S. P. Norsett and G. Wanner, Solving Ordinary Differential Equations I, table II.7.3 (Hammer and Hollingsworth).
"""

from __future__ import annotations

import math

from vibsim.schemes.base import Options, Scheme, Stepper, always
from vibsim.schemes.code_generation import written
from vibsim.schemes.newton import solved_together
from vibsim.schemes.one_step import self_starting
from vibsim.schemes.orders import Orders

_FORMULAS = {
    "C_1": "1/2 - sqrt(3)/6",
    "C_2": "1/2 + sqrt(3)/6",
    # the matrix a, its square S, and D = b^T a; b is (1/2, 1/2)
    "A_11": "1/4",
    "A_12": "1/4 - sqrt(3)/6",
    "A_21": "1/4 + sqrt(3)/6",
    "A_22": "1/4",
    "S_11": "1/24",
    "S_12": "1/8 - sqrt(3)/12",
    "S_21": "1/8 + sqrt(3)/12",
    "S_22": "1/24",
    "D_1": "1/4 + sqrt(3)/12",
    "D_2": "1/4 - sqrt(3)/12",
}

_STEP = """\
def step_gauss(state, t, dt, p, acceleration, slopes):
    u, v = state
    now = acceleration(u, v, t, p)
    square = dt * dt
    a_1, a_2 = solved_together(
        now, now,
        (u + C_1 * dt * v, u + C_2 * dt * v),
        (S_11 * square, S_12 * square, S_21 * square, S_22 * square),
        (v, v), (A_11 * dt, A_12 * dt, A_21 * dt, A_22 * dt),
        (t + C_1 * dt, t + C_2 * dt), p, acceleration, slopes,
    )
    return (u + dt * (v + dt * (D_1 * a_1 + D_2 * a_2)), v + dt * (0.5 * (a_1 + a_2))), v
"""

_STEPPER = self_starting(
    written(_STEP, _FORMULAS, {"solved_together": solved_together}), implicit=True
)


def _gauss(options: Options) -> Stepper:
    return _STEPPER


GAUSS4 = Scheme(
    kind="gauss4",
    title="Gauss method with two stages (order 4)",
    source="Hairer, Lubich and Wanner, sections II.1.3 and IV.2.1",
    family="implicit Runge-Kutta",
    stepper=_gauss,
    orders=lambda options: Orders(
        position=4, velocity=4, energy=4, energy_linear=math.inf, energy_d2t_linear=2
    ),
    even_powers=always,
    force_evaluations=2,
    start="none: a one-step method",
    explicit=False,
    symplectic=True,
    symmetric=True,
)
