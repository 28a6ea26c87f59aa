"""Theory of schemes, derived from the functions of their steps by one code for every scheme.

On the linear problem ``u'' + g w u' + w^2 u = 0``, `vibsim.theory.basis` runs these functions on unit vectors, and
everything else follows from the resulting matrix. On polynomials, `vibsim.theory.polynomial` runs them on exact series.
"""

from vibsim.theory.basis import NoSeriesError
from vibsim.theory.degrees import Miss, Residual, exact_degree, fitted_force, miss, reproduces
from vibsim.theory.discrete import discrete, orders
from vibsim.theory.phase_amplitude import part_orders
from vibsim.theory.roots import (
    Amplification,
    Roots,
    amplification,
    dominant,
    is_zero_stable,
    phase_error_per_period,
    roots,
    stability_limit,
)
from vibsim.theory.rounding import rounding_bound

__all__ = [
    "Amplification",
    "Miss",
    "NoSeriesError",
    "Residual",
    "Roots",
    "amplification",
    "discrete",
    "dominant",
    "exact_degree",
    "fitted_force",
    "is_zero_stable",
    "miss",
    "orders",
    "part_orders",
    "phase_error_per_period",
    "reproduces",
    "roots",
    "rounding_bound",
    "stability_limit",
]
