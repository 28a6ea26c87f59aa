"""How large ``w dt`` may be before the amplitude of a scheme grows on ``u'' + w^2 u = 0``.

Source: vibration text (B), section 4.5, equation (23), for the centred scheme.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache, partial

import numpy as np

from vibsim.core.array_types import Flags, Floats
from vibsim.schemes.base import Options, Scheme, Stepper
from vibsim.theory.roots import GRID, roots

_PARTS = 65
_ROUNDS = 9
_FAR = np.geomspace(GRID[-1], 1e8, 101)[1:]
"""Where implicit schemes are looked at beyond `GRID`: the limit of Newmark's scheme goes to infinity as beta to 1/4."""
_PARASITIC = 1e-9
"""Growth of a parasitic root that is no rounding."""
_BESIDE = 1e-6
"""Part of a limit within which the growth changes its sign, where the root crosses the unit circle."""
_CROSSED = 1e-8
"""Growth or decay at the ends of that which makes it a crossing, and no root that stays on the circle."""


def stability_limit(scheme: Scheme, options: Options) -> float:
    """Return the largest stable ``w dt``: infinite for none, 0 where every step grows.

    Below the limit no root is beyond the unit circle. At the limit itself the amplitude may grow linearly, where two
    roots meet. Of a scheme that is stable again farther on, it is the end of the first interval. An adaptive scheme has
    none: it chooses its own steps.
    """
    if scheme.adaptive:
        return float(np.inf)
    return _limit(scheme.stepper(options))


@lru_cache(maxsize=1024)
def _limit(stepper: Stepper) -> float:
    grid = np.concatenate([GRID, _FAR])
    growing = np.flatnonzero(_grows(stepper, grid))
    if not len(growing):
        return float(np.inf)
    if growing[0] == 0:
        return 0.0
    limit = _first(partial(_grows, stepper), grid[growing[0] - 1], grid[growing[0]])
    low, high = limit * (1.0 - _BESIDE), limit * (1.0 + _BESIDE)
    below, above = _largest(stepper, np.array([low, high]))
    if not (below < -_CROSSED and above > _CROSSED):
        return limit
    return _first(lambda p: ~(_largest(stepper, p) <= 0.0), low, high)


def _first(grows: Callable[[Floats], Flags], low: float, high: float) -> float:
    """Return the last point before growth begins, between one without and one with growth."""
    for _ in range(_ROUNDS):
        points = np.linspace(low, high, _PARTS)
        first = int(np.argmax(grows(points)[1:])) + 1
        low, high = points[first - 1], points[first]
    return float(low)


def _largest(stepper: Stepper, p: Floats) -> Floats:
    """Return the logarithm of the largest root: it crosses 0 where `_grows` allows for rounding."""
    found = roots(stepper, p)
    with np.errstate(divide="ignore"):
        return np.maximum(found.log_growth, np.log(found.parasitic))


def _grows(stepper: Stepper, p: Floats) -> Flags:
    """Say where a root is beyond the unit circle by more than rounding in twice the precision."""
    found = roots(stepper, p)
    rounding = 1e-28 * (1.0 + p * p)
    # where the two roots meet, rounding enters with its square root
    rounding = np.where(found.is_complex, rounding, np.sqrt(rounding))
    is_principal = ~(found.log_growth <= rounding)
    return is_principal | ~(found.parasitic <= 1.0 + _PARASITIC)
