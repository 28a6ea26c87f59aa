r"""A promised power that levels do not show yet: the largest part of the error that it can be at the finest level.

Near a special case in which a scheme has a higher order (a start nearly at rest, weak damping, a small swing), the
promised power h^r has a small coefficient and hides behind a higher power h^p: the levels show p, and finer ones would
show r. So p is accepted only if the data exclude h^r. Ratios cannot: a small part does not change them.

Differences ``d_k = b h_k^r + a h_k^p + c h_k^q + ...`` are combined so that h^p and as many further powers as possible
cancel, while h^r keeps its size in the last difference. Except for cancellation, the norm of the combination, plus its
round-off, is an upper bound of that part. The least bound counts, with further powers p + 1, p + 2, ... or p + 2,
p + 4, ...
"""

from __future__ import annotations

import numpy as np

from vibsim.convergence.differences import total
from vibsim.convergence.ladder_facts import LadderFacts, floor_of_pairs, pick
from vibsim.convergence.thresholds import HALF_SPACING, HIDDEN_SHARE, HIGHER_POWERS
from vibsim.core.array_types import Flags, Floats, Integers
from vibsim.elementary import on_arrays


def is_promise_hidden(e: LadderFacts, order: Floats, last: Integers) -> Flags:
    """Say where levels show a higher order than the promised one, which may be present with a small coefficient.

    Parameters
    ----------
    order
        Measured order, NaN for none, shape (...).
    last
        Index of the finest level that it rests on.
    """
    with np.errstate(invalid="ignore"):
        measured = np.round(2.0 * order) / 2
        possible = np.isfinite(measured) & (measured > e.promised + HALF_SPACING)
        possible &= e.special > e.promised + HALF_SPACING
    hidden = possible.copy()
    groups = np.stack([last - 1, measured, e.promised], axis=-1)
    for pair, p, r in np.unique(groups[possible], axis=0):
        rows = possible & np.all(groups == (pair, p, r), axis=-1)
        hidden[rows] = ~(_largest_share(e, rows, int(pair), float(p), float(r)) <= HIDDEN_SHARE)
    return hidden


def _largest_share(e: LadderFacts, rows: Flags, last: int, p: float, r: float) -> Floats:
    """Return an upper bound of the part of h^r in an error of h^p at the finer level of difference `last`."""
    difference = pick(e.difference[rows], np.full(np.count_nonzero(rows), last))
    floor = floor_of_pairs(e)[rows]
    # from parts of differences to parts of errors
    log_ratio = on_arrays.LN_2 * (e.levels[last + 1] - e.levels[last])
    steeper = on_arrays.expm1(p * log_ratio) / on_arrays.expm1(r * log_ratio)
    share = np.full(difference.shape, np.inf)
    for step in (1.0, 2.0):
        for count in range(1, min(last, HIGHER_POWERS) + 1):
            powers = np.array([r, *(p + step * k for k in range(count))])
            weights = _weights(e.levels, last, powers)
            first = last + 1 - len(weights)
            left = e.combined(rows, first, weights) + total(
                floor[:, first : last + 1] * np.abs(weights)
            )
            with np.errstate(divide="ignore", invalid="ignore"):
                share = np.fmin(share, steeper * left / difference)
    return share


def _weights(levels: tuple[int, ...], last: int, powers: Floats) -> Floats:
    """Return weights of the differences up to `last` that keep the first power of that one and cancel the others."""
    depth = np.array(levels[last - len(powers) + 1 : last + 2], dtype=np.float64)
    sizes = on_arrays.power(2.0, -powers[:, None] * (depth - depth[-1]))
    differences = sizes[:, :-1] - sizes[:, 1:]
    kept, *cancelled = differences / differences[:, -1:]
    rows = np.eye(len(powers))
    for parts in cancelled:
        left = total(rows * parts)
        rows = rows[1:] - (left[1:] / left[:-1])[:, None] * rows[:-1]
    (weights,) = rows
    return weights / total(weights * kept)
