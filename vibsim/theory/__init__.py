"""What theory predicts of a scheme from its own step, by one piece of code for every scheme.

On the linear problem ``u'' + g w u' + w^2 u = 0``, `vibsim.theory.basis` lets its functions run on unit vectors, and
all else follows from the matrix that comes out. On polynomials, `vibsim.theory.polynomial` lets them run on
exact series.
"""

from vibsim.theory.degrees import Miss, Residual, exact_degree, fitted_force, miss, reproduces
from vibsim.theory.discrete import discrete
from vibsim.theory.phase_amplitude import part_orders
from vibsim.theory.roots import (
    Amplification,
    Roots,
    amplification,
    dominant,
    phase_error_per_period,
    roots,
)
from vibsim.theory.rounding import rounding_bound
from vibsim.theory.stability import stability_limit

__all__ = [
    "Amplification",
    "Miss",
    "Residual",
    "Roots",
    "amplification",
    "discrete",
    "dominant",
    "exact_degree",
    "fitted_force",
    "miss",
    "part_orders",
    "phase_error_per_period",
    "reproduces",
    "roots",
    "rounding_bound",
    "stability_limit",
]
