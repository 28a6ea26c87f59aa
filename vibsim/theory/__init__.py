"""What theory predicts of a scheme from its own step, by one piece of code for every scheme.

On the linear problem ``u'' + w^2 u = 0``, `vibsim.theory.basis` lets its functions run on unit vectors, and all else
follows from the matrix that comes out; with a linear damping, `vibsim.theory.modes` does the same with exact series in
the step. On polynomials, `vibsim.theory.polynomial` lets them run on such series.
"""

from vibsim.theory.amplification import Amplification, amplification
from vibsim.theory.degrees import Miss, Residual, exact_degree, fitted_force, miss, reproduces
from vibsim.theory.discrete import discrete
from vibsim.theory.phase_amplitude import part_orders
from vibsim.theory.roots import (
    Roots,
    dominant,
    frequency_ratio,
    growth,
    growth_per_period,
    log_growth,
    numerical_frequency,
    phase_error_per_period,
    roots,
    spectral_radius,
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
    "frequency_ratio",
    "growth",
    "growth_per_period",
    "log_growth",
    "miss",
    "numerical_frequency",
    "part_orders",
    "phase_error_per_period",
    "reproduces",
    "roots",
    "rounding_bound",
    "spectral_radius",
    "stability_limit",
]
