"""Ralston's method: the explicit Runge-Kutta method of order 2 with two stages and the least bound of its local error.

Source: A. Ralston, Runge-Kutta methods with minimum error bounds, Mathematics of Computation 16 (1962) 431-437.
"""

from __future__ import annotations

from vibsim.schemes import Scheme
from vibsim.schemes.orders import same_orders
from vibsim.schemes.runge_kutta import Tableau, from_tableau

TABLEAU = Tableau(a=(("2/3",),), b=("1/4", "3/4"))
"""Entries are formulas, so that the theory is exact."""
ORDERS = same_orders(2, energy_linear=3, energy_d2t_linear=3)
"""As of every method of this kind: on ``u'' + w^2 u = 0`` a step multiplies the energy by ``1 + (w dt)^4/4``."""

RALSTON = Scheme(
    kind="ralston",
    title="Ralston's method (Runge-Kutta, order 2)",
    source="Ralston 1962",
    family="Runge-Kutta",
    stepper=lambda options: from_tableau(TABLEAU),
    orders=lambda options: ORDERS,
)
