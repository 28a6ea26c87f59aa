"""Summaries of a posterior: which powers dominate, the interval of the order, and the window that it rests on."""

from __future__ import annotations

import numpy as np

from vibsim.convergence.error_model.posterior import Posterior
from vibsim.convergence.question import Question
from vibsim.convergence.thresholds import DEFINITE, LOWEST_ORDER, ORDER_INTERVAL, THREE_DECIDE
from vibsim.core.array_types import Flags, Floats, Integers
from vibsim.core.vocabulary import ORDER_TOLERANCE

OUTSIDE = 0.5 * (1.0 - ORDER_INTERVAL)
"""Probability that the order lies below its interval, and that it lies above."""
ROUNDED = 1e-9
"""A power is within a tolerance if it exceeds it by no more than this, which is more than its rounding."""


def sides(p: Posterior, question: Question) -> tuple[Floats, Floats, Floats]:
    """Return the probabilities that a lower, an expected and a higher power dominates."""
    margin = question.tolerance + ROUNDED
    if question.expected is not None:
        least, most = question.expected - margin, question.expected + margin
    elif question.at_least is not None:
        least, most = question.at_least - margin, np.inf
    else:
        # any order will do: take the most probable neighbourhood
        right = np.max(_sums_near(p.dominant, p, margin), axis=-1)
        return np.zeros(len(right)), right, np.zeros(len(right))
    sums = _cumulative(p.dominant)
    low, high = np.searchsorted(p.powers, least), np.searchsorted(p.powers, most, side="right")
    lower, right, higher = sums[:, low], sums[:, high] - sums[:, low], sums[:, -1] - sums[:, high]
    # mixed powers have no order, but it is lower if both powers are lower, and higher if both are higher
    first, second = p.pairs.T
    # a power times a logarithm lies between it and the next lower one
    first = np.where(first == second, first - LOWEST_ORDER, first)
    lower = lower + np.sum(p.mixed[:, second < least], axis=-1)
    higher = higher + np.sum(p.mixed[:, first > most], axis=-1)
    if question.expected is None:
        right = right + np.sum(p.mixed[:, first >= least], axis=-1)
    return lower, right, higher


def rests_on_three(p: Posterior) -> Flags:
    """Say where most of the probability is on windows of three levels that exclude coarser ones."""
    return np.asarray(windows_of_three(p) > THREE_DECIDE)


def windows_of_three(p: Posterior) -> Floats:
    """Return the probability of windows of three levels that exclude coarser ones."""
    three = [start > 0 and end - start == 2 for start, end in p.windows]
    return np.asarray(np.sum(p.window[:, three], axis=-1))


def most_near_a_power(p: Posterior) -> Floats:
    """Return the probability that the most probable power, within the usual tolerance, dominates or is one of two."""
    # mixed powers are further apart than the tolerance, or the same
    present = p.lowest + p.highest - p.dominant - p.with_logarithm
    near = _sums_near(present, p, ORDER_TOLERANCE + ROUNDED)
    return np.asarray(np.max(near, axis=-1))


def _sums_near(values: Floats, p: Posterior, margin: float) -> Floats:
    """Return the sum of values over all powers within `margin` of each power of the grid, shape (ladder, power)."""
    sums = _cumulative(values)
    start = np.searchsorted(p.powers, p.grid - margin)
    return np.asarray(
        sums[:, np.searchsorted(p.powers, p.grid + margin, side="right")] - sums[:, start]
    )


def _cumulative(values: Floats) -> Floats:
    """Return the sums of the first 0, 1, ... values along the last axis; inserted zeros do not change their bits."""
    sums = np.zeros((len(values), values.shape[1] + 1))
    np.cumsum(values, axis=-1, out=sums[:, 1:])
    return sums


def likely_power(p: Posterior) -> Floats:
    """Return the power that most probably dominates each ladder."""
    return np.asarray(p.powers[np.argmax(p.dominant, axis=-1)])


def logarithmic_power(p: Posterior) -> Floats:
    """Return the power that a logarithm multiplies, NaN unless that is as probable as `DEFINITE`."""
    probability = p.with_logarithm
    power = p.powers[np.argmax(probability, axis=-1)]
    return np.where(np.max(probability, axis=-1) > DEFINITE, power, np.nan)


def likely_window(p: Posterior) -> tuple[Integers, Integers]:
    """Return the coarsest and the finest level of the most probable window of each ladder."""
    first, last = np.array(p.windows)[np.argmax(p.window, axis=-1)].T
    return first, last


def finest_order(orders: Floats, last: Integers) -> Floats:
    """Return the finite order of the finest three levels up to level `last`; of any three levels if there is none."""
    index = np.arange(orders.shape[-1])
    usable = np.isfinite(orders) & (index <= last[:, None] - 2)
    usable = np.where(np.any(usable, axis=-1, keepdims=True), usable, np.isfinite(orders))
    finest = np.max(np.where(usable, index, -1), axis=-1)
    order = np.take_along_axis(orders, np.maximum(finest, 0)[:, None], axis=-1)[:, 0]
    return np.where(finest >= 0, order, np.nan)


def interval(p: Posterior, order: Floats) -> tuple[Floats, Floats]:
    """Return the interval of powers with the probability `ORDER_INTERVAL`, extended to the measured order."""
    below, above = tails(p)
    least, most = p.reach
    low = least[np.argmax(below > OUTSIDE, axis=-1)]
    high = most[::-1][np.argmax(above > OUTSIDE, axis=-1)]
    return np.fmin(low, order), np.fmax(high, order)


def tails(p: Posterior) -> tuple[Floats, Floats]:
    """Return, given an expansion, P(lowest power <= p) of each p, and P(highest power >= p), largest p first."""
    expansion = np.maximum(p.expansion, 1e-300)[:, None]
    below = np.cumsum(p.lowest, axis=-1) / expansion
    above = np.cumsum(p.highest[:, ::-1], axis=-1) / expansion
    return below, above
