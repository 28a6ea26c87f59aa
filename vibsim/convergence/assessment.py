"""Whether a ladder of levels converges, from its Gram matrix alone: status, order, error and extrapolation.

Provisional: it decides by the local orders of successive levels.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vibsim.convergence.step_orders import order_of_ratio
from vibsim.core.array_types import Codes, Flags, Floats, Integers
from vibsim.core.vocabulary import REASON_NAMES, REASONS, STATUSES

_CLEAR = 10.0
"""A difference is above the noise where it exceeds it by this factor."""
_COHERENT = 0.9
_MISSED = 3.0


@dataclass(frozen=True)
class Ladder:
    """What is known of ladders of n levels; leading dimensions ``...`` are ladders.

    The inner product is a mean over points, so that its square root is a root mean square.
    """

    h: Floats
    """Step sizes, strictly decreasing, shape (n,)."""
    gram: Floats
    """Inner products of the rows, shape (..., m, m): the n-1 differences ``u_k - u_(k+1)``, coarse to fine, and where
    the exact values are known one row more, the finest level minus them."""
    floor: Floats
    """Expected noise of every level in the same norm, shape (..., n)."""
    size: Floats
    """Norm of the values of the finest level, shape (...)."""
    numbers: Flags
    """Whether the values are single numbers, shape (...)."""
    exact_known: bool
    """Whether there is a row of true errors."""


@dataclass(frozen=True)
class Assessment:
    """What was decided of ladders; arrays of shape (...)."""

    status: Codes
    reason: Codes
    """Positions in `vocabulary.STATUSES` and `vocabulary.REASON_NAMES`."""
    order: Floats
    low: Floats
    high: Floats
    """Observed order with its 95 % interval; NaN where there is none."""
    first: Integers
    last: Integers
    """Positions of the coarsest and the finest level that the order rests on."""
    error: Floats
    error_bound: Floats
    """Estimated norm of the error of the finest level, and its 95 % bound; NaN where nothing can be said."""
    weights: Floats
    """Shape (..., n): the best value is the sum of ``weights_k u_k``; NaN where there is none."""


def assess(
    ladder: Ladder,
    *,
    expected: float | None,
    at_least: float | None,
    tolerance: float = 0.1,
) -> Assessment:
    """Decide on ladders of three levels and more."""
    shape, n = ladder.gram.shape[:-2], len(ladder.h)
    count = int(np.prod(shape, dtype=np.int64))
    gram = ladder.gram.reshape(count, *ladder.gram.shape[-2:])
    floor = ladder.floor.reshape(count, n)
    rows = [_one(gram[i], floor[i], ladder, expected, at_least, tolerance) for i in range(count)]
    columns = [np.array(column).reshape(shape) for column in list(zip(*rows, strict=True))[:-1]]
    reason, order, low, high, first, last, error, bound = columns
    of_reason = np.array([STATUSES.index(status) for status in REASONS.values()], dtype=np.int8)
    codes = reason.astype(np.int8)
    weights = np.array([row[-1] for row in rows]).reshape(*shape, n)
    return Assessment(of_reason[codes], codes, order, low, high, first, last, error, bound, weights)


def _one(
    gram: Floats,
    floor: Floats,
    ladder: Ladder,
    expected: float | None,
    at_least: float | None,
    tolerance: float,
) -> tuple[int, float, float, float, int, int, float, float, Floats]:
    h, n, nan = ladder.h, len(ladder.h), float("nan")
    size = np.sqrt(np.diagonal(gram)[: n - 1])
    noise = np.hypot(floor[:-1], floor[1:])
    nothing = np.full(n, nan)
    if np.all(size <= 2.0 * noise):
        found = (nan, nan, nan, 0, n - 1, float(size[-1]), float(size[-1] + noise[-1]))
        return REASON_NAMES.index("exact"), *found, np.eye(n)[-1]
    clear = size > _CLEAR * noise
    triples = [k for k in range(n - 2) if clear[k] and clear[k + 1]]
    if not triples:
        return REASON_NAMES.index("round_off"), nan, nan, nan, 0, n - 1, nan, nan, nothing
    orders = []
    for k in triples:
        cosine = gram[k, k + 1] / (size[k] * size[k + 1])
        ratio = np.sign(cosine) * size[k] / size[k + 1]
        orders.append((float(order_of_ratio(np.array(ratio), h[k : k + 3])), float(cosine)))
    k, (order, cosine) = triples[-1], orders[-1]
    if np.isnan(order) or order <= 0.0:
        word = "oscillating" if cosine < 0 else "pre_asymptotic"
        return REASON_NAMES.index(word), order, nan, nan, k, k + 2, nan, nan, nothing
    change = abs(order - orders[-2][0]) if len(orders) > 1 else nan
    width = max(0.02, 1.5 * (1 - cosine), change if change == change else 0.05)
    settled = width <= 2.0 * tolerance and cosine >= _COHERENT
    part = h[k + 2] ** order / (h[k + 1] ** order - h[k + 2] ** order)
    weights = np.zeros(n)
    weights[k + 1], weights[k + 2] = -part, 1.0 + part
    to_finest = (h[-1] / h[k + 2]) ** order
    error = float(part * size[k + 1] * to_finest)
    bound = error * (1.0 + min(width, 2.0)) + float(floor[-1])
    near = expected is not None and abs(order - expected) <= tolerance
    enough = at_least is not None and order >= at_least - tolerance
    if not settled:
        word = "pre_asymptotic" if k == n - 3 else "round_off"
    elif ladder.exact_known and np.sqrt(gram[-1, -1]) > _MISSED * bound + _CLEAR * floor[-1]:
        word = "wrong_limit"
    elif near or enough or (expected is None and at_least is None):
        word = "asymptotic"
    else:
        word = "order_low" if order < (expected or at_least or 0.0) else "order_high"
    low, high = max(order - width, 0.0), order + width
    return REASON_NAMES.index(word), order, low, high, triples[0], k + 2, error, bound, weights
