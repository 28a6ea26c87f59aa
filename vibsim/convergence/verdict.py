"""The verdict: does a ladder of levels show the expected order?

A pure function of the facts about a ladder, for any number of ladders at once. Leading dimensions ``...`` are ladders
(scheme, case); n is the number of levels.

The error model decides on the order (`vibsim.convergence.assessment`). Facts that levels cannot show precede it or
limit it. The first case that applies decides: those of `judge` for any ladder, then those of `_cases`; without any it
is ``pre_asymptotic``. ``docs/method.md`` has them as a table.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import NamedTuple

import numpy as np

from vibsim.convergence.assessment import Decision, decide
from vibsim.convergence.differences import local_orders, safe_ratio
from vibsim.convergence.error_model.ladder import Ladder
from vibsim.convergence.hidden_order import is_promise_hidden
from vibsim.convergence.ladder_facts import (
    LadderFacts,
    at_rest,
    at_round_off,
    breakdown,
    errors_stay,
    far_from_exact,
    is_noise,
    pick,
    stacked,
    truly_exact,
    unresolved,
)
from vibsim.convergence.question import Question
from vibsim.convergence.reasons import STATUS_OF, code, first_reason, is_one_of, is_open
from vibsim.convergence.thresholds import HALF_SPACING, ORDINARY_ORDER
from vibsim.core.array_types import Codes, Flags, Floats, Integers
from vibsim.core.vocabulary import LEVELS_OF_AN_ORDER
from vibsim.elementary import on_arrays

Cases = list[tuple[Flags, str]]


@dataclass(frozen=True)
class Judgement:
    """The verdicts on ladders; arrays of shape (...)."""

    status: Codes  # index into `vocabulary.STATUSES`
    reason: Codes  # index into `vocabulary.REASON_NAMES`
    order: Floats  # measured order; NaN if there is none
    low: Floats  # lower end of its interval; NaN for INCONCLUSIVE
    high: Floats  # upper end of its interval
    first: Integers  # coarsest level that the order rests on; -1 without an order
    last: Integers  # finest level that the order rests on; -1 without an order
    culprit: Integers  # coarsest level that failed or exceeds the stability limit; -1 for none
    orders: Floats = field(repr=False)  # local order of each triple, shape (..., n-2)


class _Found(NamedTuple):
    """What the error model finds, as far as facts from outside the ladder permit; flags of shape (...)."""

    noise: Flags  # the finest differences may be noise, and no order is decided
    exact: Flags  # all differences are round-off, though an ordinary error would show
    right: Flags  # the expected order
    low: Flags  # a lower order
    high: Flags  # a higher order
    missed: Flags  # another limit than the exact solution
    alternating: Flags  # errors that alternate from level to level
    hides_promise: Flags  # an order behind which the promised one may hide


class _Rough(NamedTuple):
    """What events and corners of the force that lie between grid points do to an order; flags of shape (...)."""

    on_mesh: Flags  # events are left to the mesh, or corners to a table
    is_regular: Flags  # the order is the one that these leave, if there are any
    explained: Flags  # a corner explains that the expected order does not show
    too_low: Flags  # the order is lower than the corner leaves
    one_less: Flags  # the corner is near a point of all levels, and takes one power more until steps are as short
    limited: Flags  # finer levels will show the power of the corner, not the expected one


def judge(e: LadderFacts) -> Judgement:
    """Return the verdicts on ladders."""
    shape, levels = e.difference.shape[:-1], np.array(e.levels, dtype=np.int64)
    orders = local_orders(safe_ratio(e.difference[..., :-1], e.difference[..., 1:]), e.levels)
    broken, beyond, growing = breakdown(e)
    culprits = broken | beyond
    fails = np.any(culprits, axis=-1)
    undefined = ~np.all(np.isfinite(e.difference), axis=-1)
    undefined |= ~np.all(np.isfinite(e.floor), axis=-1)
    cases: Cases = [
        (~e.applicable, "not_applicable"),
        (np.any(beyond, axis=-1) | growing, "unstable"),
        (np.any(broken, axis=-1) | undefined, "non_finite"),
    ]
    order, low, high = (np.full(shape, np.nan) for _ in range(3))
    first, last = (np.full(shape, -1) for _ in range(2))
    if len(e.levels) < LEVELS_OF_AN_ORDER:
        cases.append((np.ones(shape, dtype=bool), "too_few_levels"))
    else:
        judged = e.applicable & ~undefined & ~fails & ~growing
        decision = _decisions(e, judged)
        found = _found(e, decision)
        cases += _cases(e, found, _rough(e, decision, found, orders))
        # noise has no order
        stated = judged & ~found.noise & ~(np.isinf(e.expected) & at_round_off(e))
        # the interval extends to a promised power that may hide
        lowest = np.where(found.hides_promise, np.minimum(decision.low, e.promised), decision.low)
        order, low, high = (
            np.where(stated, x, np.nan) for x in (decision.order, lowest, decision.high)
        )
        first, last = (np.where(stated, levels[x], -1) for x in (decision.first, decision.last))
    reason = first_reason(cases, "pre_asymptotic")
    # an undecided order is a mere estimate, without an interval
    guess = is_open(reason)
    return Judgement(
        status=STATUS_OF[reason],
        reason=reason.astype(np.int8),
        order=order,
        low=np.where(guess, np.nan, low),
        high=np.where(guess, np.nan, high),
        first=first,
        last=last,
        culprit=np.where(fails, levels[np.argmax(culprits, axis=-1)], -1),
        orders=orders,
    )


def _decisions(e: LadderFacts, judged: Flags) -> Decision:
    """Return the decisions of the error model on the ladders to be judged; all others count as noise."""
    shape, n = judged.shape, len(e.levels)
    decision = Decision(
        reason=np.full(shape, code("round_off"), dtype=np.int8),
        order=np.full(shape, np.nan),
        low=np.full(shape, np.nan),
        high=np.full(shape, np.nan),
        first=np.zeros(shape, dtype=np.int64),
        last=np.full(shape, n - 1),
        contradicted=np.zeros(shape, dtype=bool),
    )
    rows = np.concatenate([e.difference, e.error[..., None]], axis=-1)
    keys = np.stack([np.isfinite(e.error), _finite_order(e), _is_theory(e)], axis=-1)
    # differences that all vanish have no scale
    judged = judged & np.any(e.difference > 0.0, axis=-1)
    for key in np.unique(keys[judged].astype(np.float64), axis=0):
        members = judged & np.all(keys == key, axis=-1)
        exact_known, expected, by_theory = key.tolist()
        count = n if exact_known else n - 1
        sizes = rows[members][:, :count]
        scale = np.max(sizes, axis=-1, keepdims=True)
        sizes = sizes / scale
        ladder = Ladder(
            h=on_arrays.power(2.0, -np.array(e.levels, dtype=np.float64)),
            gram=e.cosines[members][:, :count, :count] * sizes[:, :, None] * sizes[:, None, :],
            floor=e.floor[members] / scale,
            numbers=e.numbers[members],
            exact_known=bool(exact_known),
        )
        # exactness is decided by `truly_exact`, from the predicted round-off of the scheme
        question = Question(
            expected=expected,
            tolerance=e.tolerance,
            by_theory=bool(by_theory),
            may_be_exact=False,
        )
        answer = decide(ladder, question)
        for name, values in vars(decision).items():
            values[members] = getattr(answer, name)
    return decision


def _finite_order(e: LadderFacts) -> Floats:
    """Return the expected order; if exactness is expected, the order of an ordinary error."""
    return np.where(np.isinf(e.expected), ORDINARY_ORDER, e.expected)


def _is_theory(e: LadderFacts) -> Flags:
    """Say where theory promises the expected order, and no event or corner within a step leaves a lower one."""
    rough = np.fmin(e.left_to_the_mesh, e.corner) < e.expected - e.tolerance
    return np.asarray((e.expected == e.promised) & ~rough)


def _found(e: LadderFacts, decision: Decision) -> _Found:
    """Return what the error model finds on ladders with at least three levels."""
    has = partial(is_one_of, decision.reason)
    noise = has("round_off", "pre_asymptotic") & is_noise(e)
    # levels that differ by more than the solution are not near it yet
    near = pick(e.difference, decision.last - 1) <= e.scale
    # the levels show a higher order, but do not exclude the promised power
    hides_promise = is_promise_hidden(e, np.where(noise, np.nan, decision.order), decision.last)
    # in these cases levels may be near each other and yet away from the exact solution
    by_accident = ~np.isnan(e.left_to_the_mesh) | ~np.isnan(e.corner) | hides_promise
    return _Found(
        noise=noise,
        exact=(np.isinf(e.expected) | noise) & truly_exact(e),
        right=has("asymptotic") & near,
        low=has("order_low") & near,
        high=has("order_high") & near,
        missed=has("wrong_limit") & near & (~by_accident | errors_stay(e)),
        alternating=has("oscillating"),
        hides_promise=hides_promise,
    )


def _rough(e: LadderFacts, decision: Decision, found: _Found, orders: Floats) -> _Rough:
    """Return what events and corners between grid points explain; `orders` are the local ones, shape (..., n-2)."""
    p, order, tolerance = _finite_order(e), decision.order, e.tolerance
    apart = np.maximum(tolerance, HALF_SPACING)
    on_mesh, has_corner = ~np.isnan(e.left_to_the_mesh), ~np.isnan(e.corner)
    # a corner leaves all powers below its own intact: a lower order has another cause
    below = order < p - tolerance
    below |= np.any(orders[..., -2:] < (p - tolerance)[..., None], axis=-1)
    return _Rough(
        on_mesh=on_mesh,
        # another power results by accident from where events or corners lie between grid points
        is_regular=~on_mesh | (np.abs(order - e.left_to_the_mesh) <= tolerance),
        explained=has_corner & (p >= e.corner) & (below | found.alternating | found.noise),
        # three levels next to a corner may have any order: use the interval
        too_low=decision.high < e.corner - apart,
        one_less=(
            e.near_a_point & (np.abs(order - (e.corner - 1.0)) <= apart) & (e.promised >= e.corner)
        ),
        limited=e.corner < p - tolerance,
    )


def _cases(e: LadderFacts, found: _Found, rough: _Rough) -> Cases:
    """Return the cases of ladders with at least three levels; the first that applies decides."""
    noise, exact, right, low, high, missed, alternating, hides_promise = found
    on_mesh, regular, explained, too_low, one_less, limited = rough
    exact_promised, far = np.isinf(e.expected), far_from_exact(e)
    hidden = hides_promise & (_finite_order(e) >= e.promised - e.tolerance)
    still = at_rest(e) & (exact_promised | noise)
    # differences cannot show what no level sees; only an exact solution could show that it does not matter
    blind = e.unseen & (missed | ((exact | noise | exact_promised) & far) | np.isnan(e.error))
    return [
        (blind & e.jumps, "non_smooth"),
        (blind, "pre_asymptotic"),
        # at rest on every level, but the exact solution moves: the steps are too long to see it
        (still & far, "pre_asymptotic"),
        (still, "not_applicable"),
        # an implicit scheme with long steps keeps a velocity that has decayed, which is no fault of the scheme
        (unresolved(e) & (exact | missed | low | high), "pre_asymptotic"),
        # levels may locate their events at the same wrong points
        (exact & far & on_mesh, "non_smooth"),
        (exact & far, "wrong_limit"),
        (exact, "exact"),
        (exact_promised & ~at_round_off(e), "order_low"),
        (noise & (e.moved == 0.0) & far, "pre_asymptotic"),
        (exact_promised | (noise & (at_round_off(e) | ~(on_mesh | explained))), "round_off"),
        (alternating & ~on_mesh & ~explained, "oscillating"),
        (missed, "wrong_limit"),
        (right & regular & ~hidden & ~one_less, "asymptotic"),
        (low & regular & (~explained | too_low) & ~one_less, "order_low"),
        (explained | one_less, "non_smooth"),
        (high & ~on_mesh & ~hidden, "order_high"),
        (e.unseen & e.jumps, "non_smooth"),
        (e.unseen, "pre_asymptotic"),
        (on_mesh | limited, "non_smooth"),
    ]


def judge_together(rows: Sequence[LadderFacts]) -> list[Judgement]:
    """Judge several sets of ladders with the same shape, levels and tolerance at once."""
    fields = vars(judge(stacked(rows)))
    # copies, so that keeping one set does not keep all in memory
    parts = [{name: values[i].copy() for name, values in fields.items()} for i in range(len(rows))]
    return [Judgement(**part) for part in parts]
