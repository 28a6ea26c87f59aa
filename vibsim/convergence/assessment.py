"""The verdict on any ladder of levels, from the probabilities of the error model.

A power *dominates* where no other one has more than a tenth of it. The table of decisions, first to last:

| what is found | status and reason |
|---|---|
| a value that is not finite | FAIL ``non_finite`` |
| fewer than three levels | INCONCLUSIVE ``too_few_levels`` |
| all differences are noise as expected, but not the distance from the exact solution | FAIL ``wrong_limit`` |
| they fall like the lowest power at least, far from the exact solution (`_is_far_from_exact`) | FAIL ``wrong_limit`` |
| the levels surely show an expansion with another limit than the exact solution (`is_missed`) | FAIL ``wrong_limit`` |
| all differences are noise as expected | PASS ``exact`` |
| a power within the tolerance of the expected one dominates, surely, and was measured | PASS ``asymptotic`` |
| others dominate, surely, the expected one does not, and one is definite | FAIL ``order_low``, ``order_high`` |
| noise is more probable than errors that alternate, and than all else | INCONCLUSIVE ``round_off`` |
| errors that change their sign from level to level are | INCONCLUSIVE ``oscillating`` |
| anything else | INCONCLUSIVE ``pre_asymptotic`` |

Nothing is decided on an order where the measured one is below half of the least of an expansion, and none where levels
behind the window contradict it (`_is_contradicted`).

*Surely* is a probability above ``1 - RISK``. Where it rests on three levels and coarser ones do not fit them, it is one
above ``1 - RISK_OF_THREE`` for a FAIL, and for a PASS that no exact solution confirms: three levels may fall like a
power by accident. *Was measured*: the order of the finest levels is nearer to the expected one than to the next order
of an expansion. Levels may fit two powers by accident whose weaker one moves the measured order by more than that.

Noise that is predicted to grow may not do so. Where it ends the window, and the finest differences show that it may be
far less, the ladder is judged with less noise as well (`_with_less_noise`). Then a verdict is sure that is sure with
one of the two, while it has at least the probability `RISK` with the other.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import partial

import numpy as np

from vibsim.convergence.best_value import best_value, is_missed, norm
from vibsim.convergence.error_model.hypotheses import Promise
from vibsim.convergence.error_model.posterior import LEFT_OUT, Ladder, Posterior, posterior
from vibsim.convergence.error_model.priors import GROWTHS
from vibsim.convergence.ladder_blocks import in_blocks
from vibsim.convergence.likely_powers import (
    OUTSIDE,
    finest_order,
    interval,
    likely_window,
    most_near_a_power,
    rests_on_three,
    sides,
    tails,
)
from vibsim.convergence.reasons import code, first_reason, is_one_of
from vibsim.convergence.thresholds import (
    ABOVE_ROUND_OFF,
    DEFINITE,
    FURTHER_APART,
    HALF_SPACING,
    LEAST_CANDIDATE,
    LEAST_WITH_LIMIT,
    LEVELS_OF_A_FALL,
    MISSED_FAR,
    NOISE_FACTOR,
    RISK,
    RISK_OF_THREE,
    STATED_LIMIT_FACTOR,
    STATED_NOISE_FACTOR,
)
from vibsim.core.array_types import Codes, Flags, Floats, Integers
from vibsim.core.vocabulary import ORDER_TOLERANCE
from vibsim.elementary import on_arrays

DECIDED = "asymptotic", "order_low", "order_high"
"""Reasons of verdicts on an order."""
ROUGHLY = 1e-3
"""Part of all evidence that may be left out where only the verdict is asked, if that part cannot change it."""
NEAR = 0.1
"""Distance of an extrapolation from the exact solution, over the error of the finest level, that surely is no miss."""


@dataclass(frozen=True)
class Question:
    """What is asked of ladders. Without an order that is expected any one will do that can be believed."""

    expected: float | None = None
    """The order that is expected."""
    at_least: float | None = None
    """The least order that is expected."""
    tolerance: float = ORDER_TOLERANCE
    """How far from `expected`, or below `at_least`, an order may be."""
    noise_factor: float = NOISE_FACTOR
    """Noise may be so many times `Ladder.floor` where levels are said to differ by nothing else."""
    limit_factor: float | None = None
    """The same of the finest level and the exact solution, if it is another number."""
    by_theory: bool = False
    """Whether theory promises the order that is expected."""

    def is_met_by(self, order: Floats) -> Flags:
        """Say which measured orders are nearer to the expected one than to the next order of an expansion.

        Orders of expansions are 0.5 apart, and those of a scheme by its theory 1.
        """
        margin = max(self.tolerance, (2.0 if self.by_theory else 1.0) * HALF_SPACING)
        if self.expected is not None:
            return np.asarray(~(np.abs(order - self.expected) > margin))
        return np.asarray(~(order < (self.at_least or -np.inf) - margin))

    @property
    def with_stated_noise(self) -> Question:
        """What is asked where the noise of levels is known, and no prediction."""
        return replace(self, noise_factor=STATED_NOISE_FACTOR, limit_factor=STATED_LIMIT_FACTOR)

    @property
    def promise(self) -> Promise | None:
        """The order that has a prior of its own."""
        return None if self.expected is None else Promise(self.expected, self.by_theory)


@dataclass(frozen=True)
class Decision:
    """What was decided of ladders; arrays of shape (ladder,)."""

    reason: Codes  # index into `vocabulary.REASON_NAMES`
    order: Floats  # the order of the finest three levels that the verdict rests on; NaN where there is none
    low: Floats  # lower end of the interval of the order
    high: Floats  # upper end
    first: Integers  # coarsest level that the verdict rests on, as a position
    last: Integers  # finest one
    contradicted: Flags  # whether finer levels than those contradict the order


@dataclass(frozen=True)
class Assessment(Decision):
    """What was decided of ladders, and their best values; arrays of shape (ladder,) where no other is given."""

    # of levels without a settled order that hardly approach each other, or not at all, these are NaN
    error: Floats  # norm of the error of the finest level, estimated where the exact solution is not known
    error_bound: Floats  # what it is at most
    weights: Floats  # the best value is the sum of these times the values of the levels, shape (ladder, level)
    best_bound: Floats  # how far the limit is from the best value, at most


def assess(ladder: Ladder, question: Question) -> Assessment:
    """Decide whether ladders, any number of them with the same step sizes, converge as expected."""
    found = in_blocks(ladder, partial(_assess_block, question=question))
    return Assessment(**{field.name: found[field.name] for field in fields(Assessment)})


def decide(ladder: Ladder, question: Question) -> Decision:
    """Decide whether ladders converge as expected; the same as `assess`, at a fraction of its cost.

    Most ladders are so clear that a rough posterior has the same verdict (see `_is_sure`).
    """
    found = in_blocks(ladder, partial(_decide_block, question=question))
    rest = np.flatnonzero(~found["sure"])
    if len(rest):
        assessed = in_blocks(ladder.some(rest), partial(_assess_block, question=question))
        for field in fields(Decision):
            found[field.name][rest] = assessed[field.name]
    return Decision(**{field.name: found[field.name] for field in fields(Decision)})


@dataclass(frozen=True)
class _Evaluation:
    """What the posterior of ladders leads to, but for an exact solution that is missed."""

    question: Question
    posterior: Posterior
    sides: Floats  # probabilities of a lower, an expected and a higher power, shape (3, ladder)
    exact: Flags
    away: Flags  # surely not the exact solution, whatever the order is
    is_confirmed: bool  # whether an exact solution is known
    cut_short: Flags  # whether noise that may be far less than predicted ends the window: nothing is decided
    contradicted: Flags  # whether levels behind the window contradict it: nothing is decided

    @property
    def by_three(self) -> Flags:
        """Whether three levels decide behind others that do not fit."""
        return rests_on_three(self.posterior)

    @property
    def order(self) -> Floats:
        """The order of the finest levels of the most probable window."""
        return finest_order(self.posterior.orders, likely_window(self.posterior)[1])

    def some(self, rows: Integers) -> _Evaluation:
        """Return what was found of some of the ladders."""
        flags = "exact", "away", "cut_short", "contradicted"
        parts = {name: getattr(self, name)[rows] for name in flags}
        posterior, of_sides = self.posterior.some(rows), self.sides[:, rows]
        return replace(self, posterior=posterior, sides=of_sides, **parts)

    def replace(self, ladders: Integers, other: _Evaluation, rows: Flags) -> None:
        """Take what was found of some ladders from some rows of another one."""
        self.posterior.replace(ladders, other.posterior, rows)
        self.sides[:, ladders] = other.sides[:, rows]
        self.contradicted[ladders] = other.contradicted[rows]


def _assess_block(ladder: Ladder, factors: Floats, question: Question) -> dict[str, np.ndarray]:
    """Return what an `Assessment` holds, of ladders of three levels and more."""
    found = _with_less_noise(ladder, _evaluate(ladder, question, LEFT_OUT), question)
    of_limit, missed = found.posterior, found.away
    if ladder.exact_known:
        # what the levels say of the limit without the exact solution
        of_limit = posterior(ladder.without_exact(), question.promise)
        risk = np.where(rests_on_three(of_limit), RISK_OF_THREE, RISK)
        order = finest_order(of_limit.orders, likely_window(of_limit)[1])
        approaches = (of_limit.expansion > 1.0 - risk) & ~(order < LEAST_WITH_LIMIT)
        missed = missed | (approaches & is_missed(ladder, of_limit))
    numbers = _numbers(ladder, found, of_limit, missed)
    values = best_value(ladder, of_limit, found.exact, factors)
    if not ladder.exact_known:
        is_open = is_one_of(numbers["reason"], "pre_asymptotic")
        for row in values.values():
            row[is_open & (numbers["order"] < LEAST_WITH_LIMIT)] = np.nan
    return numbers | values


def _decide_block(ladder: Ladder, factors: Floats, question: Question) -> dict[str, np.ndarray]:
    """Return what a `Decision` holds, of ladders of three levels and more, and whether it is sure."""
    del factors
    found = _evaluate(ladder, question, ROUGHLY)
    numbers = _numbers(ladder, found, found.posterior, found.away)
    return numbers | {"sure": _is_sure(ladder, found, question)}


def _evaluate(ladder: Ladder, question: Question, left_out: float) -> _Evaluation:
    believed = posterior(ladder, question.promise, left_out=left_out)
    of_sides = np.stack(sides(believed, question.expected, question.at_least, question.tolerance))
    exact = _is_only_noise(ladder, question)
    away = np.zeros_like(exact)
    if ladder.exact_known:
        factor = question.noise_factor if question.limit_factor is None else question.limit_factor
        away = np.sqrt(ladder.gram[:, -1, -1]) > factor * ladder.floor[:, -1]
        away &= exact | _is_far_from_exact(ladder)
    return _Evaluation(
        question,
        believed,
        of_sides,
        exact,
        away,
        is_confirmed=ladder.exact_known,
        cut_short=_is_cut_short(ladder, believed),
        contradicted=_is_contradicted(ladder, believed, question),
    )


def _is_sure(ladder: Ladder, found: _Evaluation, question: Question) -> Flags:
    """Say where the same is decided whatever the hypotheses are like that were left out.

    Then no probability is nearer than `ROUGHLY` to what it is compared with. And either the extrapolation by the order
    of the finest levels is so near the exact solution that no other one misses it, or the levels show no order.
    """
    p, (lower, right, higher) = found.posterior, found.sides
    rest, fails = 1.0 - p.noise - p.alternating, lower + higher > 0.5
    definite = np.zeros_like(right)
    definite[fails] = most_near_a_power(p)[fails]
    margins = [
        right - (1.0 - RISK),
        right - RISK,
        lower + higher - (1.0 - RISK),
        np.where(fails, lower - higher, 1.0),
        definite - DEFINITE,
        p.noise - np.maximum(rest, p.alternating),
        p.alternating - rest,
        *(np.min(np.abs(tail - OUTSIDE), axis=-1) * p.expansion for tail in tails(p)),
    ]
    window = np.sort(p.window, axis=-1)
    if window.shape[1] > 1:
        margins.append(window[:, -1] - window[:, -2])
    sure: Flags = np.all(np.abs(margins) > ROUGHLY, axis=0) & ~found.cut_short
    sure &= ~(found.by_three & (fails | (not found.is_confirmed)))
    if ladder.exact_known:
        open_still = np.flatnonzero(sure & ~_meets(ladder, p))
        if len(open_still):
            levels = ladder.some(open_still).without_exact()
            of_limit = posterior(levels, question.promise, left_out=ROUGHLY)
            sure[open_still] = of_limit.expansion < 1.0 - RISK - ROUGHLY
    return sure


def _meets(ladder: Ladder, p: Posterior) -> Flags:
    """Say where the extrapolation by the order of the finest levels is almost the exact solution."""
    order, ratio = p.orders[:, -1], ladder.h[-2] / ladder.h[-1]
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
        step = 1.0 / (on_arrays.power(ratio, order) - 1.0)
        distance = norm(np.stack([-step, np.ones_like(step)], axis=-1), ladder.gram[:, -2:, -2:])
        near = distance <= NEAR * step * np.sqrt(ladder.gram[:, -2, -2])
    ends = np.array(p.windows)[np.argmax(p.window, axis=-1), 1]
    return np.asarray((order > 0.0) & near & (ends == len(ladder.h) - 1))


def _is_cut_short(ladder: Ladder, believed: Posterior) -> Flags:
    """Say where noise that may be far less than predicted ends the most probable window."""
    every, last = np.arange(len(ladder.gram)), likely_window(believed)[1]
    least = _least_noise(ladder)[every, last]
    return np.asarray(NOISE_FACTOR * least < ladder.floor[every, last])


def _with_less_noise(ladder: Ladder, found: _Evaluation, question: Question) -> _Evaluation:
    """Return what is found of ladders whose window is cut short by noise, with that noise and with less.

    What is sure with one of the two counts, where it has at least the probability `RISK` with the other; else nothing.
    """
    rows = np.flatnonzero(found.cut_short & ~found.exact)
    if not len(rows):
        return found
    none = np.zeros(len(rows), dtype=bool)
    first = replace(found.some(rows), cut_short=none)
    less = replace(ladder.some(rows), floor=_least_noise(ladder)[rows])
    other = replace(_evaluate(less, question, LEFT_OUT), cut_short=none)
    own = _reasons(first, none)
    others = _reasons(other, none)
    excluded = _probability(own, other) < RISK
    added = ~is_one_of(own, *DECIDED) & is_one_of(others, *DECIDED)
    added &= _probability(others, first) >= RISK
    chosen = excluded | added
    found.replace(rows[chosen], other, chosen)
    found.cut_short[rows] = excluded & ~added
    return found


def _probability(codes: Codes, found: _Evaluation) -> Floats:
    """Return the probability of what is decided, 1 where nothing is."""
    lower, right, higher = found.sides
    right = np.where(codes == code("asymptotic"), right, lower + higher)
    return np.where(is_one_of(codes, *DECIDED), right, 1.0)


def _is_far_from_exact(ladder: Ladder) -> Flags:
    """Say where differences fall at least like the lowest power of an expansion, and the exact solution is far away.

    They must be no round-off. Then less is to come than that power leaves, and both together are much less than the
    distance.
    """
    n = len(ladder.h)
    if n < LEVELS_OF_A_FALL:
        return np.zeros(len(ladder.gram), dtype=bool)
    sizes = np.sqrt(np.diagonal(ladder.gram, axis1=1, axis2=2))
    powers = on_arrays.power(ladder.h, LEAST_CANDIDATE)
    rates = sizes[:, : n - 1] / (powers[:-1] - powers[1:])
    to_come = rates[:, -1] * powers[-1]
    moved = np.sum(sizes[:, : n - 1], axis=1)
    round_off = ladder.floor[:, :-1] + ladder.floor[:, 1:]
    falls = np.all(rates[:, 1:] <= rates[:, :-1], axis=1)
    falls &= np.all(sizes[:, : n - 1] > ABOVE_ROUND_OFF * round_off, axis=1)
    return np.asarray(falls & (sizes[:, -1] > MISSED_FAR * (moved + to_come)))


def _is_contradicted(ladder: Ladder, believed: Posterior, question: Question) -> Flags:
    """Say where levels behind the most probable window differ by more than those at its end, and than predicted noise.

    What a window leaves out behind it is noise. Noise that begins with more than the last difference in the window, or
    that grows faster than round-off, would be seen there: a level behind it is wrong, or those before it are.
    """
    sizes = np.sqrt(np.diagonal(ladder.gram, axis1=1, axis2=2))[:, : len(ladder.h) - 1]
    last = likely_window(believed)[1]
    at_end = np.take_along_axis(sizes, last[:, None] - 1, axis=1)
    is_behind = np.arange(sizes.shape[1]) >= last[:, None]
    finer = np.where(
        is_behind, ladder.h[np.minimum(last + 1, len(ladder.h) - 1)][:, None] / ladder.h[1:], 1.0
    )
    at_most = at_end * on_arrays.power(finer, GROWTHS[-1])
    noise = question.noise_factor * (ladder.floor[:, :-1] + ladder.floor[:, 1:])
    return np.asarray(np.any(is_behind & (sizes > np.maximum(at_most, noise)), axis=1))


def _reasons(found: _Evaluation, missed: Flags) -> Codes:
    """Return the reasons of the verdicts, as positions in `REASON_NAMES`; see the head of this module."""
    p, (lower, right, higher) = found.posterior, found.sides
    risk = np.where(found.by_three, RISK_OF_THREE, RISK)
    # expansions begin with the order 1/2, whatever two powers fit levels that do not approach each other
    may_decide = ~(found.cut_short | found.contradicted | (found.order < LEAST_WITH_LIMIT))
    another = (lower + higher > 1.0 - risk) & (right < risk) & may_decide
    if np.any(another):
        another &= most_near_a_power(p) > DEFINITE
    cases = [
        (missed, "wrong_limit"),
        (found.exact, "exact"),
        (
            (right > 1.0 - (RISK if found.is_confirmed else risk))
            & found.question.is_met_by(found.order)
            & may_decide,
            "asymptotic",
        ),
        (another & (lower > higher), "order_low"),
        (another, "order_high"),
        (p.noise > np.maximum(1.0 - p.noise - p.alternating, p.alternating), "round_off"),
        (p.alternating > 1.0 - p.noise - p.alternating, "oscillating"),
    ]
    return first_reason(cases, "pre_asymptotic")


def _numbers(
    ladder: Ladder, found: _Evaluation, of_limit: Posterior, missed: Flags
) -> dict[str, np.ndarray]:
    """Return what a `Decision` holds beside the status, for ladders of three levels and more."""
    n, believed, exact = len(ladder.h), found.posterior, found.exact
    first, last = likely_window(believed)
    order = np.where(exact, np.nan, found.order)
    low, high = interval(believed, order)
    if np.any(missed):
        # where the exact solution is missed, the levels alone have an order
        ends = zip(interval(of_limit, order), (low, high), strict=True)
        low, high = (np.where(missed, a, b) for a, b in ends)
    return {
        "reason": _reasons(found, missed),
        "order": order,
        "low": np.where(exact, np.nan, low),
        "high": np.where(exact, np.nan, high),
        "first": np.where(exact, 0, first),
        "last": np.where(exact, n - 1, last),
        "contradicted": found.contradicted,
    }


def _is_only_noise(ladder: Ladder, question: Question) -> Flags:
    """Say where all levels differ by no more than the noise that is expected of them.

    Noise that is stated has its size, and none of two levels more: many small steps would add up to anything. Over many
    points its mean is known better than that of a number.
    """
    n, factor = len(ladder.h), np.full(len(ladder.gram), question.noise_factor)
    furthest = 1
    if question.limit_factor is not None:
        factor = 1.0 + (factor - 1.0) / np.sqrt(ladder.points)
        furthest = n - 1
    found = np.ones(len(ladder.gram), dtype=bool)
    for gap in range(1, furthest + 1):
        for i in range(n - gap):
            square = np.sum(ladder.gram[:, i : i + gap, i : i + gap], axis=(1, 2))
            between = np.sqrt(np.maximum(square, 0.0))
            noise = ladder.floor[:, i] + ladder.floor[:, i + gap]
            found &= between <= factor * noise * (FURTHER_APART if gap > 1 else 1.0)
    return found


def _least_noise(ladder: Ladder) -> Floats:
    """Return the noise of every level if it grows no more than the finest differences show, shape (ladder, n).

    At the coarsest level it is as predicted, since storing numbers makes noise even where differences are 0.
    """
    finest = np.sqrt(np.max(np.diagonal(ladder.gram, axis1=1, axis2=2)[:, -2:], axis=-1))
    least = np.maximum(ladder.floor[:, :1], NOISE_FACTOR * finest[:, None])
    return np.asarray(np.minimum(ladder.floor, least))
