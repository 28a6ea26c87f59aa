"""What a posterior says of powers: which dominate, the interval of the order, and the window that it rests on."""

from __future__ import annotations

import numpy as np

from vibsim.convergence.error_model.posterior import Posterior
from vibsim.convergence.thresholds import ORDER_INTERVAL
from vibsim.core.array_types import Flags, Floats, Integers
from vibsim.core.vocabulary import ORDER_TOLERANCE

OUTSIDE = 0.5 * (1.0 - ORDER_INTERVAL)
"""Probability of what is below the interval of an order, and of what is above."""


def sides(
    believed: Posterior, expected: float | None, at_least: float | None, tolerance: float
) -> tuple[Floats, Floats, Floats]:
    """Return the probabilities that a lower power dominates, one that is expected, and a higher one."""
    powers, alone, mixed = believed.powers, believed.alone, believed.of_pairs
    margin = tolerance + 1e-9
    if expected is not None:
        least, most = expected - margin, expected + margin
    elif at_least is not None:
        least, most = at_least - margin, np.inf
    else:
        # the neighbourhood that holds most
        right = np.max(_sums_near(alone, believed, margin), axis=-1)
        return np.zeros(len(alone)), right, np.zeros(len(alone))
    sums = _sums_up(alone)
    low, high = np.searchsorted(powers, least), np.searchsorted(powers, most, side="right")
    lower, right, higher = sums[:, low], sums[:, high] - sums[:, low], sums[:, -1] - sums[:, high]
    # two powers of one size are no order, but tell of one that both are below, or above
    first, second = believed.pairs.T
    lower = lower + np.sum(mixed[:, second < least], axis=-1)
    higher = higher + np.sum(mixed[:, first > most], axis=-1)
    if expected is None:
        right = right + np.sum(mixed[:, first >= least], axis=-1)
    return lower, right, higher


def rests_on_three(p: Posterior) -> Flags:
    """Say where windows of three levels behind others that do not fit have most of the probability."""
    three = [start > 0 and end - start == 2 for start, end in p.windows]
    return np.asarray(np.sum(p.window[:, three], axis=-1) > 0.5)


def most_near_a_power(p: Posterior) -> Floats:
    """Return the most probability that a power, within the usual tolerance, dominates or is one of two of a size."""
    # two powers of one size are further from each other than the tolerance
    present = p.lowest + p.highest - p.alone
    near = _sums_near(present, p, ORDER_TOLERANCE + 1e-9)
    return np.asarray(np.max(near, axis=-1))


def _sums_near(values: Floats, p: Posterior, margin: float) -> Floats:
    """Return sums of the values of all powers so near each power of the grid, shape (ladder, power)."""
    sums = _sums_up(values)
    start = np.searchsorted(p.powers, p.grid - margin)
    return np.asarray(
        sums[:, np.searchsorted(p.powers, p.grid + margin, side="right")] - sums[:, start]
    )


def _sums_up(values: Floats) -> Floats:
    """Return the sums of the first 0, 1, ... values along the last axis; further zeros change no bit of them."""
    sums = np.zeros((len(values), values.shape[1] + 1))
    np.cumsum(values, axis=-1, out=sums[:, 1:])
    return sums


def likely_window(believed: Posterior) -> tuple[Integers, Integers]:
    """Return the coarsest and the finest level of the most probable window of each ladder."""
    first, last = np.array(believed.windows)[np.argmax(believed.window, axis=-1)].T
    return first, last


def finest_order(orders: Floats, last: Integers) -> Floats:
    """Return the order of the finest three levels up to `last` that have one."""
    index = np.arange(orders.shape[-1])
    usable = np.isfinite(orders) & (index <= last[:, None] - 2)
    usable = np.where(np.any(usable, axis=-1, keepdims=True), usable, np.isfinite(orders))
    finest = np.max(np.where(usable, index, -1), axis=-1)
    picked = np.take_along_axis(orders, np.maximum(finest, 0)[:, None], axis=-1)[:, 0]
    return np.where(finest >= 0, picked, np.nan)


def interval(believed: Posterior, order: Floats) -> tuple[Floats, Floats]:
    """Return the range of powers that holds `ORDER_INTERVAL` of what is believed, and the measured order."""
    below, above = tails(believed)
    least, most = believed.reach
    low = least[np.argmax(below > OUTSIDE, axis=-1)]
    high = most[::-1][np.argmax(above > OUTSIDE, axis=-1)]
    return np.fmin(low, order), np.fmax(high, order)


def tails(believed: Posterior) -> tuple[Floats, Floats]:
    """Return the parts of the expansions up to each power, and from each power on, the highest first."""
    whole = np.maximum(believed.expansion, 1e-300)[:, None]
    below = np.cumsum(believed.lowest, axis=-1) / whole
    above = np.cumsum(believed.highest[:, ::-1], axis=-1) / whole
    return below, above
