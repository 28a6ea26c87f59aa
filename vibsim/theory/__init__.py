"""What theory predicts of a scheme, from its own step on the linear problem ``u'' + w^2 u = 0``.

One piece of code for every scheme: `vibsim.theory.units` lets its functions run on unit vectors, and all else follows
from the matrix that comes out.
"""

from vibsim.theory.amplification import Amplification, amplification
from vibsim.theory.discrete import discrete
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
    "Roots",
    "amplification",
    "discrete",
    "dominant",
    "frequency_ratio",
    "growth",
    "growth_per_period",
    "log_growth",
    "numerical_frequency",
    "phase_error_per_period",
    "roots",
    "rounding_bound",
    "spectral_radius",
    "stability_limit",
]
