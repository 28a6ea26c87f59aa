"""Levels that agree for a while and then part: the difference of the finest two grows exponentially with time.

In a chaotic motion every error grows like that, whatever its cause. A finer level of order p delays the parting by
``p ln(2)/rate``, and rounding errors grow alike. Source: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary
Differential Equations I, sections I.10 and I.16.
"""

from __future__ import annotations

import math

import numpy as np

from vibsim.comparison.quantity_comparison import Comparison
from vibsim.convergence.differences import largest
from vibsim.core.array_types import Flags, Floats
from vibsim.elementary import on_arrays
from vibsim.schemes.base import UNIT_ROUND_OFF

FAR = 0.01
"""Levels have parted if they differ by this part of the quantity. [convention]"""
HIGHEST_POWER = 8.0
"""Growth faster than this power of the time counts as exponential. [convention]"""


def parting(q: Comparison, asked: Flags) -> Floats:
    """Return the time until which the finest two levels of a quantity agree, and the rate at which they part.

    The rate is that of the logarithm of their difference in the second half of that time.

    Returns
    -------
    numpy.ndarray
        Shape (scheme, case, 2); NaN where not `asked`, and where levels agree to the end, differ from the start, or
        part like a power of the time.
    """
    result = np.full((*asked.shape, 2), np.nan)
    if not np.any(asked) or not q.differences:
        return result
    fractions = np.asarray(q.block.grid.t) / q.block.grid.t[-1]
    size = largest(q.values[-1])
    for scheme, case in zip(*np.nonzero(asked), strict=True):
        rows = np.abs(q.differences[-1][scheme, case]).reshape(-1, q.width)
        distance = np.maximum.accumulate(np.max(rows, axis=-1))
        far = np.flatnonzero(distance >= FAR * size[scheme, case])
        if not len(far):
            continue
        half = distance[np.searchsorted(fractions, fractions[far[0]] / 2.0)]
        time = fractions[far[0]] * np.ravel(q.block.group.end)[case]
        growth = on_arrays.log(distance[far[0]] / half) if 0.0 < half < math.inf else 0.0
        if growth > HIGHEST_POWER * on_arrays.LN_2:
            result[scheme, case] = time, 2.0 * growth / time
    return result


def levels_to_the_end(time: float, rate: float, end: float, order: float) -> float:
    """Return the number of additional levels needed to agree to the end; infinite if rounding makes all levels part."""
    if rate * end > on_arrays.log(FAR / UNIT_ROUND_OFF):
        return math.inf
    return math.ceil(rate * (end - time) / (order * on_arrays.LN_2))
