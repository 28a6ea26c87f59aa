r"""A promised power that levels do not show yet: how large a part of the error it can be at the finest of them.

A motion near a special case, in which a scheme has a higher order (a start nearly at rest, a weak damping, a small
swing), has the promised power h^r with a small coefficient, behind a higher one h^p: levels then show p, and finer ones
r. So p is believed only where the data leave no room for h^r, not by the ratios, which a small part does not move.

Differences ``d_k = b h_k^r + a h_k^p + c h_k^q + ...`` are combined so that h^p and as many of the further powers as
there are differences vanish, and h^r keeps the size that it has in the last one. What is left is b, and powers behind:
its norm bounds b, but for cancellation. Of all such combinations the least one counts, with p + 1, p + 2, ... or
p + 2, p + 4, ... as further powers, and what rounding makes of it.
"""

from __future__ import annotations

import numpy as np

from vibsim.convergence.evidence import Evidence, floor_of_pairs, pick
from vibsim.convergence.thresholds import HALF_SPACING, HIDDEN_SHARE, HIGHER_POWERS
from vibsim.core.array_types import Flags, Floats, Integers
from vibsim.elementary import on_arrays


def is_promise_hidden(e: Evidence, order: Floats, last: Integers) -> Flags:
    """Say where levels show a higher order than the promised one, which may be there with a small coefficient.

    Parameters
    ----------
    e
        The evidence on ladders.
    order
        The order that each shows, NaN for none, shape (...).
    last
        Position of the finest level that it rests on.
    """
    with np.errstate(invalid="ignore"):
        shown = np.round(2.0 * order) / 2
        maybe = np.isfinite(shown) & (shown > e.promised + HALF_SPACING)
        maybe &= e.special > e.promised + HALF_SPACING
    hidden = maybe.copy()
    groups = np.stack([last - 1, shown, e.promised], axis=-1)
    for pair, p, r in np.unique(groups[maybe], axis=0):
        rows = maybe & np.all(groups == (pair, p, r), axis=-1)
        hidden[rows] = ~(_most(e, rows, int(pair), float(p), float(r)) <= HIDDEN_SHARE)
    return hidden


def _most(e: Evidence, rows: Flags, last: int, p: float, r: float) -> Floats:
    """Return the largest part of an error of h^p at a pair of levels that h^r can be, shape (rows,)."""
    size = pick(e.difference[rows], np.full(np.count_nonzero(rows), last))
    noise = floor_of_pairs(e)[rows]
    # the differences of h^p are steeper than those of h^r
    steeper = on_arrays.expm1(p * on_arrays.LN_2) / on_arrays.expm1(r * on_arrays.LN_2)
    least = np.full(size.shape, np.inf)
    for step in (1.0, 2.0):
        for count in range(1, min(last, HIGHER_POWERS) + 1):
            powers = np.array([r, *(p + step * k for k in range(count))])
            weights = _weights(e.levels, last, powers)
            first = last + 1 - len(weights)
            left = e.combined(rows, first, weights) + noise[:, first : last + 1] @ np.abs(weights)
            with np.errstate(divide="ignore", invalid="ignore"):
                least = np.fmin(least, steeper * left / size)
    return least


def _weights(levels: tuple[int, ...], last: int, powers: Floats) -> Floats:
    """Return weights of the differences up to `last` that keep the first power in that one, and no other power."""
    depth = np.array(levels[last - len(powers) + 1 : last + 2], dtype=np.float64)
    sizes = on_arrays.power(2.0, -powers[:, None] * (depth - depth[-1]))
    falls = sizes[:, :-1] - sizes[:, 1:]
    return np.asarray(np.linalg.solve(falls / falls[:, -1:], np.eye(len(powers))[0]))
