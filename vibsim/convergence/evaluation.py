"""What decides a verdict: the posterior of ladders, and what differences, noise and exact solutions show beside it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from vibsim.convergence.error_model.ladder import Ladder
from vibsim.convergence.error_model.posterior import Posterior, posterior
from vibsim.convergence.error_model.priors import GROWTHS
from vibsim.convergence.likely_powers import finest_order, likely_window, rests_on_three, sides
from vibsim.convergence.question import Question
from vibsim.convergence.thresholds import (
    ABOVE_ROUND_OFF,
    LOWEST_ORDER,
    MISSED_FAR,
    MISSED_FAR_LEVELS,
    NOISE_FACTOR,
    NON_ADJACENT_FACTOR,
)
from vibsim.core.array_types import Flags, Floats, Integers
from vibsim.elementary import on_arrays


@dataclass(frozen=True)
class Evaluation:
    """The results of a posterior that decide a verdict, except for a missed exact solution."""

    question: Question
    posterior: Posterior
    sides: Floats  # probabilities of a lower, an expected and a higher power, shape (3, ladder)
    only_noise: Flags  # levels differ by noise alone
    misses_exact: Flags  # the exact solution is missed, whatever the order is
    exact_known: bool
    cut_short: Flags  # predicted noise, perhaps too large, ends the window: no order is decided
    contradicted: Flags  # levels finer than the window contradict it: no order is decided

    @property
    def rests_on_three(self) -> Flags:
        """Whether the order rests on three levels that coarser ones do not fit."""
        return rests_on_three(self.posterior)

    @property
    def order(self) -> Floats:
        """The order of the finest levels of the most probable window."""
        return finest_order(self.posterior.orders, likely_window(self.posterior)[1])

    def some(self, subset: Integers) -> Evaluation:
        """Return the results of a subset of the ladders."""
        flags = "only_noise", "misses_exact", "cut_short", "contradicted"
        parts = {name: getattr(self, name)[subset] for name in flags}
        posterior, sides = self.posterior.some(subset), self.sides[:, subset]
        return replace(self, posterior=posterior, sides=sides, **parts)

    def update(self, ladders: Integers, source: Evaluation, rows: Flags) -> None:
        """Overwrite some ladders with rows of another evaluation."""
        self.posterior.update(ladders, source.posterior, rows)
        self.sides[:, ladders] = source.sides[:, rows]
        self.contradicted[ladders] = source.contradicted[rows]


def evaluate(ladder: Ladder, question: Question, left_out: float) -> Evaluation:
    """Evaluate ladders with at least three levels; `left_out` is that of `posterior`."""
    p = posterior(ladder, question.expected_order, left_out=left_out)
    only_noise = _is_only_noise(ladder, question)
    misses_exact = np.zeros_like(only_noise)
    if ladder.exact_known:
        error = np.sqrt(ladder.gram[:, -1, -1])
        misses_exact = error > question.limit_factor * ladder.floor[:, -1]
        misses_exact &= only_noise | _is_far_from_exact(ladder)
    return Evaluation(
        question=question,
        posterior=p,
        sides=np.stack(sides(p, question)),
        only_noise=only_noise,
        misses_exact=misses_exact,
        exact_known=ladder.exact_known,
        cut_short=_is_cut_short(ladder, p),
        contradicted=_is_contradicted(ladder, p, question),
    )


def _is_cut_short(ladder: Ladder, p: Posterior) -> Flags:
    """Say where the predicted noise that ends the most probable window may be far too large."""
    index, last = np.arange(len(ladder.gram)), likely_window(p)[1]
    least = least_noise(ladder)[index, last]
    return np.asarray(NOISE_FACTOR * least < ladder.floor[index, last])


def _is_only_noise(ladder: Ladder, question: Question) -> Flags:
    """Say where all levels differ by no more than their expected noise.

    Stated noise limits the distance of any two levels, since many small steps could add up. Averaged over many points
    it is also known better than that of a single number.
    """
    n, factor = len(ladder.h), np.full(len(ladder.gram), question.noise_factor)
    furthest = 1
    if question.is_noise_stated:
        factor = 1.0 + (factor - 1.0) / np.sqrt(ladder.points)
        furthest = n - 1
    result = np.full(len(ladder.gram), question.may_be_exact)
    for gap in range(1, furthest + 1):
        for i in range(n - gap):
            square = np.sum(ladder.gram[:, i : i + gap, i : i + gap], axis=(1, 2))
            distance = np.sqrt(np.maximum(square, 0.0))
            noise = ladder.floor[:, i] + ladder.floor[:, i + gap]
            result &= distance <= factor * noise * (NON_ADJACENT_FACTOR if gap > 1 else 1.0)
    return result


def least_noise(ladder: Ladder) -> Floats:
    """Return the least noise of each level that the larger one of the two finest rows allows, shape (ladder, n).

    With an exact solution these rows are the finest difference and the error: both hold the noise of the finest level.
    It is never less than predicted for the coarsest level: storing numbers makes noise even if differences are 0.
    """
    finest = np.sqrt(np.max(np.diagonal(ladder.gram, axis1=1, axis2=2)[:, -2:], axis=-1))
    least = np.maximum(ladder.floor[:, :1], NOISE_FACTOR * finest[:, None])
    return np.asarray(np.minimum(ladder.floor, least))


def _is_far_from_exact(ladder: Ladder) -> Flags:
    """Say where differences fall at least like the lowest power of an expansion, and the exact solution is far away.

    If the differences exceed round-off, the levels will move no further than that power lets them. All they have moved
    and will move must be much less than the distance.
    """
    n = len(ladder.h)
    if n < MISSED_FAR_LEVELS:
        return np.zeros(len(ladder.gram), dtype=bool)
    sizes = np.sqrt(np.diagonal(ladder.gram, axis1=1, axis2=2))
    powers = on_arrays.power(ladder.h, LOWEST_ORDER)
    rates = sizes[:, : n - 1] / (powers[:-1] - powers[1:])
    to_come = rates[:, -1] * powers[-1]
    moved = np.sum(sizes[:, : n - 1], axis=1)
    round_off = ladder.floor[:, :-1] + ladder.floor[:, 1:]
    falls = np.all(rates[:, 1:] <= rates[:, :-1], axis=1)
    falls &= np.all(sizes[:, : n - 1] > ABOVE_ROUND_OFF * round_off, axis=1)
    return np.asarray(falls & (sizes[:, -1] > MISSED_FAR * (moved + to_come)))


def _is_contradicted(ladder: Ladder, p: Posterior, question: Question) -> Flags:
    """Say where levels finer than the most probable window differ too much to be noise.

    That is by more than the last difference in the window, grown as fast as round-off can, and by more than the
    predicted noise; or their true errors exceed that of the finest level in the window in this way. Then either a finer
    level or the levels of the window are wrong.
    """
    sizes = np.sqrt(np.diagonal(ladder.gram, axis1=1, axis2=2))[:, : len(ladder.h) - 1]
    last, n = likely_window(p)[1], len(ladder.h)
    last_difference = np.take_along_axis(sizes, last[:, None] - 1, axis=1)
    first_finer = np.minimum(last + 1, n - 1)[:, None]
    is_finer = np.arange(1, n) > last[:, None]
    largest = last_difference * _growth(ladder.h[first_finer], ladder.h[1:])
    noise = question.noise_factor * (ladder.floor[:, :-1] + ladder.floor[:, 1:])
    result = np.any(is_finer & (sizes > np.maximum(largest, noise)), axis=1)
    if ladder.exact_known:
        squares = [np.sum(ladder.gram[:, k:, k:], axis=(1, 2)) for k in range(n)]
        errors = np.sqrt(np.maximum(np.stack(squares, axis=1), 0.0))
        largest = np.take_along_axis(errors, last[:, None], axis=1)
        largest = largest * _growth(ladder.h[last][:, None], ladder.h[1:])
        noise = question.noise_factor * ladder.floor[:, 1:]
        result |= np.any(is_finer & (errors[:, 1:] > np.maximum(largest, noise)), axis=1)
    return np.asarray(result)


def _growth(coarse: Floats, fine: Floats) -> Floats:
    """Return the factor by which round-off grows at most from one step size to smaller ones; 1 to larger ones."""
    return np.asarray(on_arrays.power(np.maximum(coarse / fine, 1.0), GROWTHS[-1]))
