"""How large ``w dt`` may be before the amplitude of a scheme grows on ``u'' + w^2 u = 0``.

Source: vibration text (B), section 4.5, equation (23), for the centred scheme.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from vibsim.schemes.base import Options, Scheme, Stepper
from vibsim.theory.roots import GRID, roots

_PARTS = 65
_ROUNDS = 9
_PARASITIC = 1e-9
"""Growth of a parasitic root that is no rounding."""


def stability_limit(scheme: Scheme, options: Options) -> float:
    """Return the largest stable ``w dt``: infinite for none, 0 where every step grows.

    Below the limit no root is beyond the unit circle. At the limit itself the amplitude may grow linearly, where two
    roots meet. Of a scheme that is stable again farther on, it is the end of the first interval. An adaptive scheme has
    none: it chooses its own steps.
    """
    if scheme.adaptive:
        return float(np.inf)
    return _limit(scheme.stepper(options))


@lru_cache(maxsize=256)
def _limit(stepper: Stepper) -> float:
    growing = np.flatnonzero(_grows(stepper, GRID))
    if not len(growing):
        return float(np.inf)
    if growing[0] == 0:
        return 0.0
    low, high = GRID[growing[0] - 1], GRID[growing[0]]
    for _ in range(_ROUNDS):
        points = np.linspace(low, high, _PARTS)
        first = int(np.argmax(_grows(stepper, points)[1:])) + 1
        low, high = points[first - 1], points[first]
    return float(low)


def _grows(stepper: Stepper, p: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Say where a root is beyond the unit circle by more than rounding in twice the precision."""
    found = roots(stepper, p)
    rounding = 1e-24 * (1.0 + p**4)
    # where the two roots meet, rounding enters with its square root
    rounding = np.where(found.is_complex, rounding, np.sqrt(rounding))
    is_principal = ~(found.log_growth <= rounding)
    return is_principal | ~(found.parasitic <= 1.0 + _PARASITIC)
