"""The verdict on any ladder of levels, from the probabilities of the error model.

A power *dominates* if no other one has more than a tenth of it. The first row that applies decides:

| condition | status and reason |
|---|---|
| a value is not finite | FAIL ``non_finite`` |
| fewer than three levels | INCONCLUSIVE ``too_few_levels`` |
| all differences are noise as expected, but the exact solution is further away | FAIL ``wrong_limit`` |
| they fall at least like the lowest power, far from the exact solution (`_is_far_from_exact`) | FAIL ``wrong_limit`` |
| the levels surely show an expansion with another limit than the exact solution (`is_missed`) | FAIL ``wrong_limit`` |
| all differences are noise as expected | PASS ``exact`` |
| a power within the tolerance of the expected one surely dominates and was measured | PASS ``asymptotic`` |
| others surely dominate, the expected one does not, and one is definite | FAIL ``order_low``, ``order_high`` |
| noise is more probable than alternating errors and than everything else | INCONCLUSIVE ``round_off`` |
| alternating errors are more probable than everything else | INCONCLUSIVE ``oscillating`` |
| otherwise | INCONCLUSIVE ``pre_asymptotic`` |

No order is decided if none is measured, if the measured one is below half of the lowest order of an expansion, or if
levels finer than the window contradict it (`_is_contradicted`).

*Surely* means with a probability above ``1 - RISK``. If the order rests on three levels that coarser ones do not fit,
the probability must exceed ``1 - RISK_OF_THREE`` for a FAIL, and for a PASS that no exact solution confirms: three
levels may fall like a power by accident. *Measured* means that the order of the finest levels is nearer to the expected
one than to the next order of an expansion: levels may by accident fit two powers, the weaker of which shifts the
measured order by more than that. If no order is expected, it must be that near to the most probable power.

Noise that is predicted to grow may not do so. If predicted noise ends the window, and the finest differences show that
it may be far smaller, the ladder is also judged with less noise (`_with_less_noise`). A verdict is then sure if it is
sure with one of the two predictions and has at least the probability `RISK` with the other.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import partial

import numpy as np

from vibsim.convergence.best_value import best_value, is_missed, norm
from vibsim.convergence.error_model.hypotheses import ExpectedOrder
from vibsim.convergence.error_model.posterior import LEFT_OUT, Ladder, Posterior, posterior
from vibsim.convergence.error_model.priors import GROWTHS
from vibsim.convergence.ladder_blocks import in_blocks
from vibsim.convergence.likely_powers import (
    OUTSIDE,
    finest_order,
    interval,
    likely_power,
    likely_window,
    most_near_a_power,
    rests_on_three,
    sides,
    tails,
    windows_of_three,
)
from vibsim.convergence.reasons import code, first_reason, is_one_of
from vibsim.convergence.thresholds import (
    ABOVE_ROUND_OFF,
    DEFINITE,
    HALF_SPACING,
    LEAST_WITH_LIMIT,
    LOWEST_ORDER,
    MISSED_FAR,
    MISSED_FAR_LEVELS,
    NOISE_FACTOR,
    NON_ADJACENT_FACTOR,
    RISK,
    RISK_OF_THREE,
    STATED_LIMIT_FACTOR,
    STATED_NOISE_FACTOR,
    THREE_DECIDE,
)
from vibsim.core.array_types import Codes, Flags, Floats, Integers
from vibsim.core.vocabulary import ORDER_TOLERANCE
from vibsim.elementary import on_arrays

DECIDED = "asymptotic", "order_low", "order_high"
"""Reasons that state an order."""
ROUGH_LEFT_OUT = 1e-3
"""Largest part of all evidence that `decide` may skip, if that cannot change the verdict."""
MEETS_WITHIN = 0.1
"""An extrapolation this near the exact solution, relative to the error of the finest level, surely does not miss it."""


@dataclass(frozen=True)
class Question:
    """The order that ladders are judged by; without an expected one, any order that is certain enough passes."""

    expected: float | None = None
    """Expected order."""
    at_least: float | None = None
    """Least expected order."""
    tolerance: float = ORDER_TOLERANCE
    """Largest distance of an order from `expected`, or below `at_least`."""
    noise_factor: float = NOISE_FACTOR
    """Largest ratio of actual noise to `Ladder.floor` for which levels count as equal."""
    limit_factor: float | None = None
    """The same for the finest level and the exact solution; `noise_factor` by default."""
    by_theory: bool = False
    """Whether theory promises the expected order."""
    may_be_exact: bool = True
    """Whether levels that differ by noise only are exact; otherwise the caller decides that."""

    def is_met_by(self, order: Floats, likely: Floats) -> Flags:
        """Say which measured orders are nearer to the expected one than to the next order of an expansion.

        Orders of expansions are 0.5 apart, those that theory promises are 1 apart. Where any order will do, the most
        probable power, `likely`, counts as the expected one.
        """
        margin = max(self.tolerance, (2.0 if self.by_theory else 1.0) * HALF_SPACING)
        if self.expected is None and self.at_least is not None:
            return np.asarray(order >= self.at_least - margin)
        target = likely if self.expected is None else self.expected
        return np.asarray(np.abs(order - target) <= margin)

    @property
    def with_stated_noise(self) -> Question:
        """The same question for levels whose noise the user states."""
        return replace(self, noise_factor=STATED_NOISE_FACTOR, limit_factor=STATED_LIMIT_FACTOR)

    @property
    def expected_order(self) -> ExpectedOrder | None:
        """The expected order, which has a prior of its own."""
        return None if self.expected is None else ExpectedOrder(self.expected, self.by_theory)


@dataclass(frozen=True)
class Decision:
    """The verdicts on ladders; arrays of shape (ladder,)."""

    reason: Codes  # index into `vocabulary.REASON_NAMES`
    order: Floats  # order of the finest three levels of the verdict; NaN if there is none
    low: Floats  # lower end of the interval of the order
    high: Floats  # upper end
    first: Integers  # index of the coarsest level that the verdict rests on
    last: Integers  # index of the finest one
    contradicted: Flags  # whether finer levels contradict the order


@dataclass(frozen=True)
class Assessment(Decision):
    """The verdicts on ladders, and their best values; arrays of shape (ladder,) unless another shape is given."""

    # NaN if the levels show no limit: an undecided order below 1/4, or three levels without an order
    error: Floats  # norm of the error of the finest level, estimated if the exact solution is not known
    error_bound: Floats  # upper bound of that norm
    weights: Floats  # weights of the levels in the best value, shape (ladder, level)
    best_bound: Floats  # upper bound of the distance from the best value to the limit


def assess(ladder: Ladder, question: Question) -> Assessment:
    """Decide whether ladders with the same step sizes converge as expected."""
    result = in_blocks(ladder, partial(_assess_block, question=question))
    return Assessment(**{field.name: result[field.name] for field in fields(Assessment)})


def decide(ladder: Ladder, question: Question) -> Decision:
    """Return the same verdicts as `assess`, without best values and at a fraction of the cost.

    Most ladders are so clear that an approximate posterior gives the same verdict (see `_is_sure`).
    """
    result = in_blocks(ladder, partial(_decide_block, question=question))
    unsure = np.flatnonzero(~result["sure"])
    if len(unsure):
        assessed = in_blocks(ladder.some(unsure), partial(_assess_block, question=question))
        for field in fields(Decision):
            result[field.name][unsure] = assessed[field.name]
    return Decision(**{field.name: result[field.name] for field in fields(Decision)})


@dataclass(frozen=True)
class _Evaluation:
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

    def some(self, subset: Integers) -> _Evaluation:
        """Return the results of a subset of the ladders."""
        flags = "only_noise", "misses_exact", "cut_short", "contradicted"
        parts = {name: getattr(self, name)[subset] for name in flags}
        posterior, sides = self.posterior.some(subset), self.sides[:, subset]
        return replace(self, posterior=posterior, sides=sides, **parts)

    def update(self, ladders: Integers, source: _Evaluation, rows: Flags) -> None:
        """Overwrite some ladders with rows of another evaluation."""
        self.posterior.update(ladders, source.posterior, rows)
        self.sides[:, ladders] = source.sides[:, rows]
        self.contradicted[ladders] = source.contradicted[rows]


def _assess_block(ladder: Ladder, factors: Floats, question: Question) -> dict[str, np.ndarray]:
    """Return the fields of an `Assessment` of ladders with at least three levels."""
    evaluation = _with_less_noise(ladder, _evaluate(ladder, question, LEFT_OUT), question)
    levels_only, missed = evaluation.posterior, evaluation.misses_exact
    if ladder.exact_known:
        # estimate the limit without the exact solution, and compare
        levels_only = posterior(ladder.without_exact(), question.expected_order)
        risk = np.where(rests_on_three(levels_only), RISK_OF_THREE, RISK)
        order = finest_order(levels_only.orders, likely_window(levels_only)[1])
        approaches = (levels_only.expansion > 1.0 - risk) & ~(order < LEAST_WITH_LIMIT)
        missed = missed | (approaches & is_missed(ladder, levels_only))
    numbers = _numbers(ladder, evaluation, levels_only, missed)
    values = best_value(ladder, levels_only, evaluation.only_noise, factors)
    if not ladder.exact_known:
        is_open = is_one_of(numbers["reason"], "pre_asymptotic")
        for row in values.values():
            row[is_open & (numbers["order"] < LEAST_WITH_LIMIT)] = np.nan
    return numbers | values


def _decide_block(ladder: Ladder, factors: Floats, question: Question) -> dict[str, np.ndarray]:
    """Return the fields of a `Decision` of ladders with at least three levels, and whether it is `sure`."""
    del factors
    evaluation = _evaluate(ladder, question, ROUGH_LEFT_OUT)
    numbers = _numbers(ladder, evaluation, evaluation.posterior, evaluation.misses_exact)
    return numbers | {"sure": _is_sure(ladder, evaluation, question)}


def _evaluate(ladder: Ladder, question: Question, left_out: float) -> _Evaluation:
    p = posterior(ladder, question.expected_order, left_out=left_out)
    probabilities = np.stack(sides(p, question.expected, question.at_least, question.tolerance))
    only_noise = _is_only_noise(ladder, question)
    misses_exact = np.zeros_like(only_noise)
    if ladder.exact_known:
        factor = question.noise_factor if question.limit_factor is None else question.limit_factor
        misses_exact = np.sqrt(ladder.gram[:, -1, -1]) > factor * ladder.floor[:, -1]
        misses_exact &= only_noise | _is_far_from_exact(ladder)
    return _Evaluation(
        question,
        p,
        probabilities,
        only_noise,
        misses_exact,
        exact_known=ladder.exact_known,
        cut_short=_is_cut_short(ladder, p),
        contradicted=_is_contradicted(ladder, p, question),
    )


def _is_sure(ladder: Ladder, evaluation: _Evaluation, question: Question) -> Flags:
    """Say where the skipped hypotheses cannot change the verdict.

    Then no probability is within `ROUGH_LEFT_OUT` of its threshold. Also, either the extrapolation by the order of the
    finest levels is so near the exact solution that no other one misses it, or the levels show no order.
    """
    p, (lower, right, higher) = evaluation.posterior, evaluation.sides
    remaining, fails = 1.0 - p.noise - p.alternating, lower + higher > 0.5
    definite = np.zeros_like(right)
    definite[fails] = most_near_a_power(p)[fails]
    margins = [
        right - (1.0 - RISK),
        right - RISK,
        lower + higher - (1.0 - RISK),
        np.where(fails, lower - higher, 1.0),
        definite - DEFINITE,
        p.noise - np.maximum(remaining, p.alternating),
        p.alternating - remaining,
        *(np.min(np.abs(tail - OUTSIDE), axis=-1) * p.expansion for tail in tails(p)),
    ]
    window = np.sort(p.window, axis=-1)
    if window.shape[1] > 1:
        margins += [window[:, -1] - window[:, -2], windows_of_three(p) - THREE_DECIDE]
    sure: Flags = np.all(np.abs(margins) > ROUGH_LEFT_OUT, axis=0) & ~evaluation.cut_short
    sure &= ~(evaluation.rests_on_three & (fails | (not evaluation.exact_known)))
    if ladder.exact_known:
        unclear = np.flatnonzero(sure & ~_meets(ladder, p))
        if len(unclear):
            levels = ladder.some(unclear).without_exact()
            levels_only = posterior(levels, question.expected_order, left_out=ROUGH_LEFT_OUT)
            sure[unclear] = levels_only.expansion < 1.0 - RISK - ROUGH_LEFT_OUT
    return sure


def _meets(ladder: Ladder, p: Posterior) -> Flags:
    """Say where the extrapolation by the order of the finest levels almost equals the exact solution."""
    order, ratio = p.orders[:, -1], ladder.h[-2] / ladder.h[-1]
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
        gain = 1.0 / (on_arrays.power(ratio, order) - 1.0)
        distance = norm(np.stack([-gain, np.ones_like(gain)], axis=-1), ladder.gram[:, -2:, -2:])
        near = distance <= MEETS_WITHIN * gain * np.sqrt(ladder.gram[:, -2, -2])
    ends = np.array(p.windows)[np.argmax(p.window, axis=-1), 1]
    return np.asarray((order > 0.0) & near & (ends == len(ladder.h) - 1))


def _is_cut_short(ladder: Ladder, p: Posterior) -> Flags:
    """Say where the predicted noise that ends the most probable window may be far too large."""
    index, last = np.arange(len(ladder.gram)), likely_window(p)[1]
    least_noise = _least_noise(ladder)[index, last]
    return np.asarray(NOISE_FACTOR * least_noise < ladder.floor[index, last])


def _with_less_noise(ladder: Ladder, evaluation: _Evaluation, question: Question) -> _Evaluation:
    """Judge ladders that are cut short by predicted noise once more, with less noise.

    A verdict that is sure with one of the two counts if it has at least the probability `RISK` with the other.
    """
    rows = np.flatnonzero(evaluation.cut_short & ~evaluation.only_noise)
    if not len(rows):
        return evaluation
    no_flags = np.zeros(len(rows), dtype=bool)
    usual = replace(evaluation.some(rows), cut_short=no_flags)
    quiet_ladder = replace(ladder.some(rows), floor=_least_noise(ladder)[rows])
    quiet = replace(_evaluate(quiet_ladder, question, LEFT_OUT), cut_short=no_flags)
    reasons = _reasons(usual, no_flags)
    quiet_reasons = _reasons(quiet, no_flags)
    excluded = _probability(reasons, quiet) < RISK
    added = ~is_one_of(reasons, *DECIDED) & is_one_of(quiet_reasons, *DECIDED)
    added &= _probability(quiet_reasons, usual) >= RISK
    chosen = excluded | added
    evaluation.update(rows[chosen], quiet, chosen)
    evaluation.cut_short[rows] = excluded & ~added
    return evaluation


def _probability(reasons: Codes, evaluation: _Evaluation) -> Floats:
    """Return the probability of the decided order, 1 where none is decided."""
    lower, right, higher = evaluation.sides
    right = np.where(reasons == code("asymptotic"), right, lower + higher)
    return np.where(is_one_of(reasons, *DECIDED), right, 1.0)


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
    predicted noise. Then either a finer level or the levels of the window are wrong.
    """
    sizes = np.sqrt(np.diagonal(ladder.gram, axis1=1, axis2=2))[:, : len(ladder.h) - 1]
    last = likely_window(p)[1]
    last_difference = np.take_along_axis(sizes, last[:, None] - 1, axis=1)
    is_finer = np.arange(sizes.shape[1]) >= last[:, None]
    refinement = np.where(
        is_finer, ladder.h[np.minimum(last + 1, len(ladder.h) - 1)][:, None] / ladder.h[1:], 1.0
    )
    largest = last_difference * on_arrays.power(refinement, GROWTHS[-1])
    noise = question.noise_factor * (ladder.floor[:, :-1] + ladder.floor[:, 1:])
    return np.asarray(np.any(is_finer & (sizes > np.maximum(largest, noise)), axis=1))


def _reasons(e: _Evaluation, missed: Flags) -> Codes:
    """Return the reasons of the verdicts by the table in the docstring of this module."""
    p, (lower, right, higher) = e.posterior, e.sides
    risk = np.where(e.rests_on_three, RISK_OF_THREE, RISK)
    # powers may fit levels that do not approach each other or whose differences change sign, but expansions begin with
    # order 1/2
    decidable = (e.order >= LEAST_WITH_LIMIT) & ~(e.cut_short | e.contradicted)
    other_order = (lower + higher > 1.0 - risk) & (right < risk) & decidable
    if np.any(other_order):
        other_order &= most_near_a_power(p) > DEFINITE
    cases = [
        (missed, "wrong_limit"),
        (e.only_noise, "exact"),
        (
            (right > 1.0 - (RISK if e.exact_known else risk))
            & e.question.is_met_by(e.order, likely_power(p))
            & decidable,
            "asymptotic",
        ),
        (other_order & (lower > higher), "order_low"),
        (other_order, "order_high"),
        (p.noise > np.maximum(1.0 - p.noise - p.alternating, p.alternating), "round_off"),
        (p.alternating > 1.0 - p.noise - p.alternating, "oscillating"),
    ]
    return first_reason(cases, "pre_asymptotic")


def _numbers(
    ladder: Ladder, evaluation: _Evaluation, levels_only: Posterior, missed: Flags
) -> dict[str, np.ndarray]:
    """Return the fields of a `Decision`."""
    n, p, only_noise = len(ladder.h), evaluation.posterior, evaluation.only_noise
    first, last = likely_window(p)
    order = np.where(only_noise, np.nan, evaluation.order)
    low, high = interval(p, order)
    if np.any(missed):
        # if the exact solution is missed, only the differences of the levels have an order
        ends = zip(interval(levels_only, order), (low, high), strict=True)
        low, high = (np.where(missed, a, b) for a, b in ends)
    return {
        "reason": _reasons(evaluation, missed),
        "order": order,
        "low": np.where(only_noise, np.nan, low),
        "high": np.where(only_noise, np.nan, high),
        "first": np.where(only_noise, 0, first),
        "last": np.where(only_noise, n - 1, last),
        "contradicted": evaluation.contradicted,
    }


def _is_only_noise(ladder: Ladder, question: Question) -> Flags:
    """Say where all levels differ by no more than their expected noise.

    Stated noise limits the distance of any two levels, since many small steps could add up. Averaged over many points
    it is also known better than that of a single number.
    """
    n, factor = len(ladder.h), np.full(len(ladder.gram), question.noise_factor)
    furthest = 1
    if question.limit_factor is not None:
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


def _least_noise(ladder: Ladder) -> Floats:
    """Return the least noise of each level that the larger one of the two finest rows allows, shape (ladder, n).

    With an exact solution these rows are the finest difference and the error: both hold the noise of the finest level.
    It is never less than predicted for the coarsest level: storing numbers makes noise even if differences are 0.
    """
    finest = np.sqrt(np.max(np.diagonal(ladder.gram, axis1=1, axis2=2)[:, -2:], axis=-1))
    least = np.maximum(ladder.floor[:, :1], NOISE_FACTOR * finest[:, None])
    return np.asarray(np.minimum(ladder.floor, least))
