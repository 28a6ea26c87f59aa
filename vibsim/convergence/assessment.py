"""The verdict on any ladder of levels, from the probabilities of the error model.

The first case of `_reasons` that applies decides; ``docs/method.md`` has them as a table. A power *dominates* if no
other one has more than a tenth of it. *Surely* means with a probability above ``1 - RISK``. If the order rests on three
levels that coarser ones do not fit, the probability must exceed ``1 - RISK_OF_THREE`` for a FAIL, and for a PASS that
no exact solution confirms: three levels may fall like a power by accident.

In the order of reading: `question` is what is asked, `evaluation` what the posterior, the differences and the noise
say, `likely_powers` sums the posterior over powers, and `best_value` is the limit. `ladder_blocks` and `clear_ladders`
only save memory and time.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import partial

import numpy as np

from vibsim.convergence.best_value import best_value, is_missed
from vibsim.convergence.clear_ladders import ROUGH_LEFT_OUT, is_sure
from vibsim.convergence.error_model.ladder import Ladder
from vibsim.convergence.error_model.posterior import LEFT_OUT, Posterior, posterior
from vibsim.convergence.evaluation import Evaluation, evaluate, least_noise
from vibsim.convergence.ladder_blocks import in_blocks
from vibsim.convergence.likely_powers import (
    finest_order,
    interval,
    likely_power,
    likely_window,
    logarithmic_power,
    most_near_a_power,
    rests_on_three,
)
from vibsim.convergence.question import Question
from vibsim.convergence.reasons import code, first_reason, is_one_of
from vibsim.convergence.thresholds import DEFINITE, LEAST_WITH_LIMIT, RISK, RISK_OF_THREE
from vibsim.core.array_types import Codes, Flags, Floats, Integers

DECIDED = "asymptotic", "order_low", "order_high"
"""Reasons that state an order."""


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
    logarithm: Floats  # power that a logarithm multiplies; NaN if the levels do not show one


def assess(ladder: Ladder, question: Question) -> Assessment:
    """Decide whether ladders with the same step sizes converge as expected."""
    result = in_blocks(ladder, partial(_assess_block, question=question))
    return Assessment(**{field.name: result[field.name] for field in fields(Assessment)})


def decide(ladder: Ladder, question: Question) -> Decision:
    """Return the same verdicts as `assess`, without best values and at a fraction of the cost.

    Most ladders are so clear that an approximate posterior gives the same verdict (see `clear_ladders`).
    """
    result = in_blocks(ladder, partial(_decide_block, question=question))
    unsure = np.flatnonzero(~result["sure"])
    if len(unsure):
        assessed = in_blocks(ladder.some(unsure), partial(_assess_block, question=question))
        for field in fields(Decision):
            result[field.name][unsure] = assessed[field.name]
    return Decision(**{field.name: result[field.name] for field in fields(Decision)})


def _assess_block(ladder: Ladder, factors: Floats, question: Question) -> dict[str, np.ndarray]:
    """Return the fields of an `Assessment` of ladders with at least three levels."""
    evaluation = _with_less_noise(ladder, evaluate(ladder, question, LEFT_OUT), question)
    levels_only, missed = evaluation.posterior, evaluation.misses_exact
    if ladder.exact_known:
        # estimate the limit without the exact solution, and compare
        levels_only = posterior(ladder.without_exact(), question.expected_order)
        missed = missed | (_approach_a_limit(levels_only) & is_missed(ladder, levels_only))
    numbers = _numbers(ladder, evaluation, levels_only, missed)
    values = best_value(ladder, levels_only, evaluation.only_noise, factors)
    values["logarithm"] = logarithmic_power(evaluation.posterior)
    if not ladder.exact_known:
        is_open = is_one_of(numbers["reason"], "pre_asymptotic")
        for row in values.values():
            row[is_open & (numbers["order"] < LEAST_WITH_LIMIT)] = np.nan
    return numbers | values


def _decide_block(ladder: Ladder, factors: Floats, question: Question) -> dict[str, np.ndarray]:
    """Return the fields of a `Decision` of ladders with at least three levels, and whether it is `sure`."""
    del factors
    evaluation = evaluate(ladder, question, ROUGH_LEFT_OUT)
    numbers = _numbers(ladder, evaluation, evaluation.posterior, evaluation.misses_exact)
    return numbers | {"sure": is_sure(ladder, evaluation, question)}


def _approach_a_limit(p: Posterior) -> Flags:
    """Say where levels surely show an expansion, of any order from `LEAST_WITH_LIMIT` on."""
    risk = np.where(rests_on_three(p), RISK_OF_THREE, RISK)
    order = finest_order(p.orders, likely_window(p)[1])
    return np.asarray((p.expansion > 1.0 - risk) & ~(order < LEAST_WITH_LIMIT))


def _with_less_noise(ladder: Ladder, evaluation: Evaluation, question: Question) -> Evaluation:
    """Judge ladders that are cut short by predicted noise once more, with less noise, which need not grow as predicted.

    A verdict that is sure with one of the two counts if it has at least the probability `RISK` with the other.
    Otherwise the ladder stays `cut_short`, and no order is decided.
    """
    rows = np.flatnonzero(evaluation.cut_short & ~evaluation.only_noise)
    if not len(rows):
        return evaluation
    no_flags = np.zeros(len(rows), dtype=bool)
    usual = replace(evaluation.some(rows), cut_short=no_flags)
    quiet_ladder = replace(ladder.some(rows), floor=least_noise(ladder)[rows])
    quiet = replace(evaluate(quiet_ladder, question, LEFT_OUT), cut_short=no_flags)
    reasons, quiet_reasons = _reasons(usual, no_flags), _reasons(quiet, no_flags)
    excluded = _probability(reasons, quiet) < RISK
    added = ~is_one_of(reasons, *DECIDED) & is_one_of(quiet_reasons, *DECIDED)
    added &= _probability(quiet_reasons, usual) >= RISK
    chosen = excluded | added
    evaluation.update(rows[chosen], quiet, chosen)
    evaluation.cut_short[rows] = excluded & ~added
    return evaluation


def _probability(reasons: Codes, evaluation: Evaluation) -> Floats:
    """Return the probability of the decided order, 1 where none is decided."""
    lower, right, higher = evaluation.sides
    right = np.where(reasons == code("asymptotic"), right, lower + higher)
    return np.where(is_one_of(reasons, *DECIDED), right, 1.0)


def _reasons(e: Evaluation, missed: Flags) -> Codes:
    """Return the reasons of the verdicts; `missed` says where the exact solution is."""
    p, (lower, right, higher) = e.posterior, e.sides
    risk = np.where(e.rests_on_three, RISK_OF_THREE, RISK)
    # powers may fit levels that do not approach each other or whose differences change sign, but expansions begin with
    # order 1/2
    decidable = (e.order >= LEAST_WITH_LIMIT) & ~(e.cut_short | e.contradicted)
    # levels may by accident fit two powers, the weaker of which moves the measured order
    is_met = e.question.is_met_by(e.order, likely_power(p))
    is_met &= right > 1.0 - (RISK if e.exact_known else risk)
    other_order = (lower + higher > 1.0 - risk) & decidable
    if np.any(other_order):
        other_order &= most_near_a_power(p) > DEFINITE
    elsewhere = 1.0 - p.noise - p.alternating
    cases = [
        (missed, "wrong_limit"),
        (e.only_noise, "exact"),
        (is_met & decidable, "asymptotic"),
        (other_order & (lower > higher), "order_low"),
        (other_order, "order_high"),
        (p.noise > np.maximum(elsewhere, p.alternating), "round_off"),
        (p.alternating > elsewhere, "oscillating"),
    ]
    return first_reason(cases, "pre_asymptotic")


def _numbers(
    ladder: Ladder, evaluation: Evaluation, levels_only: Posterior, missed: Flags
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
