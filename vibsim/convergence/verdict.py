r"""The verdict: does a ladder of levels show the expected order?

A pure function of the data of a ladder, for any number of ladders at once. Leading dimensions ``...`` are ladders
(scheme, case); n is the number of levels.

The error model decides on the order (`vibsim.convergence.assessment`). Facts that levels cannot show precede it or
limit it. The first row that applies decides:

| condition | status and reason |
|---|---|
| the quantity does not exist, or the scheme has no levels | ``not_applicable`` |
| w dt exceeds the stability limit, or refinement does not remove growth | ``unstable`` |
| a level broke down | ``non_finite`` |
| fewer than three levels | ``too_few_levels`` |
| no level sees a pulse of the force, and no exact solution shows that it does not matter | ``non_smooth`` for a jump, \
else ``pre_asymptotic`` |
| nothing moves where levels are compared | ``not_applicable``; ``pre_asymptotic`` if the exact solution moves |
| a velocity decays within a step of every level, and the order is not the expected one | ``pre_asymptotic`` |
| all differences are round-off, but an ordinary error would show | ``exact``; ``wrong_limit`` away from the exact \
solution |
| exactness is promised, but a difference exceeds round-off | ``order_low`` |
| the finest differences may be round-off, and the error model decides no order | ``round_off`` |
| the error model finds alternating errors | ``oscillating`` |
| ... another limit than the exact solution | ``wrong_limit`` |
| ... the expected order, and it hides no promised power | ``asymptotic`` |
| ... a lower order that no corner of the force within a step explains | ``order_low`` |
| such a corner explains an order below the expected one, or one power less next to a point of all levels | \
``non_smooth`` |
| the error model finds a higher order, and it hides no promised power | ``order_high`` |
| events are left to the mesh, or a corner leaves less than the expected order | ``non_smooth`` |
| otherwise | ``pre_asymptotic`` |

If levels differ by more than the solution, the error model decides nothing. If events are left to the mesh, or corners
to a table, only the power that they leave counts.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from vibsim.convergence import thresholds as th
from vibsim.convergence.assessment import Decision, Question, decide
from vibsim.convergence.differences import local_orders, safe_ratio
from vibsim.convergence.error_model.posterior import Ladder
from vibsim.convergence.evidence import (
    Evidence,
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
from vibsim.convergence.hidden_order import is_promise_hidden
from vibsim.convergence.reasons import STATUS_OF, code, first_reason, is_one_of, is_open
from vibsim.core.array_types import Codes, Flags, Floats, Integers
from vibsim.core.vocabulary import LEVELS_OF_AN_ORDER
from vibsim.elementary import on_arrays


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


def judge(e: Evidence) -> Judgement:
    """Return the verdicts on ladders by the table in the docstring of this module."""
    shape, levels = e.difference.shape[:-1], np.array(e.levels, dtype=np.int64)
    orders = local_orders(safe_ratio(e.difference[..., :-1], e.difference[..., 1:]), e.levels)
    broken, beyond, growing = breakdown(e)
    culprits = broken | beyond
    fails = np.any(culprits, axis=-1)
    undefined = ~np.all(np.isfinite(e.difference), axis=-1)
    undefined |= ~np.all(np.isfinite(e.floor), axis=-1)
    cases = [
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
        decided, lower, noise = _cases(e, decision, orders)
        cases += decided
        # noise has no order
        stated = judged & ~noise & ~(np.isinf(e.order) & at_round_off(e))
        order, low, high = (
            np.where(stated, x, np.nan) for x in (decision.order, lower, decision.high)
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


def _decisions(e: Evidence, judged: Flags) -> Decision:
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
    keys = np.stack([np.isfinite(e.error), _expected(e), _is_theory(e)], axis=-1)
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


def _expected(e: Evidence) -> Floats:
    """Return the expected order; if exactness is expected, the order of an ordinary error."""
    return np.where(np.isinf(e.order), th.ORDINARY_ORDER, e.order)


def _is_theory(e: Evidence) -> Flags:
    """Say where theory promises the expected order, and no event or corner within a step leaves a lower one."""
    rough = np.fmin(e.left_to_the_mesh, e.corner) < e.order - e.tolerance
    return np.asarray((e.order == e.promised) & ~rough)


def _cases(
    e: Evidence, decision: Decision, orders: Floats
) -> tuple[list[tuple[Flags, str]], Floats, Flags]:
    """Return the cases of ladders with at least three levels, in the order of the table.

    Also return the lower end of the interval, extended to a promised power that may hide, and where all is noise.
    """
    has = partial(is_one_of, decision.reason)
    exact_promised, tol, p = np.isinf(e.order), e.tolerance, _expected(e)
    noise = has("exact") | (has("round_off", "pre_asymptotic") & is_noise(e))
    exact = (exact_promised | noise) & truly_exact(e)
    # levels that differ by more than the solution are not near it yet
    near = pick(e.difference, decision.last - 1) <= e.scale
    right, low, high, missed = (
        has(reason) & near for reason in ("asymptotic", "order_low", "order_high", "wrong_limit")
    )
    alternating = has("oscillating")
    # the levels show a higher order, but do not exclude the promised power
    may_hide = is_promise_hidden(e, np.where(noise, np.nan, decision.order), decision.last)
    lower = np.where(may_hide, np.minimum(decision.low, e.promised), decision.low)
    hidden = may_hide & (p >= e.promised - tol)
    # another power results by accident from where events or corners lie between grid points
    mesh_power, rough = e.left_to_the_mesh, ~np.isnan(e.left_to_the_mesh)
    regular = ~rough | (np.abs(decision.order - mesh_power) <= tol)
    # in these cases levels may be near each other and yet away from the exact solution
    missed &= ~(rough | ~np.isnan(e.corner) | may_hide) | errors_stay(e)
    # a corner leaves all powers below its own intact: a lower order has another cause
    below = (decision.order < p - tol) | np.any(orders[..., -2:] < (p - tol)[..., None], axis=-1)
    corner_explains = ~np.isnan(e.corner) & (p >= e.corner) & (below | alternating | noise)
    # three levels next to a corner may have any order: use the interval
    deeper = decision.high < e.corner - np.maximum(tol, th.HALF_SPACING)
    # next to a point of all levels a corner leaves one power less, until steps are shorter than its distance
    one_less = np.abs(decision.order - (e.corner - 1.0)) <= np.maximum(tol, th.HALF_SPACING)
    temporary = e.near_a_point & one_less & (e.promised >= e.corner)
    # finer levels would show the power of the corner, not p
    limited = e.corner < p - tol
    far = far_from_exact(e)
    still = at_rest(e) & (exact_promised | noise)
    # differences cannot show what no level sees; only an exact solution could show that it does not matter
    blind = e.unseen & (missed | ((exact | noise | exact_promised) & far) | np.isnan(e.error))
    # an implicit scheme with long steps keeps a velocity that has decayed, which is no fault of the scheme
    coarse = unresolved(e) & (exact | missed | low | high)
    return (
        [
            (blind & e.jumps, "non_smooth"),
            (blind, "pre_asymptotic"),
            # at rest on every level, but the exact solution moves: the steps are too long to see it
            (still & far, "pre_asymptotic"),
            (still, "not_applicable"),
            (coarse, "pre_asymptotic"),
            # levels may locate their events at the same wrong points
            (exact & far & rough, "non_smooth"),
            (exact & far, "wrong_limit"),
            (exact, "exact"),
            (exact_promised & ~at_round_off(e), "order_low"),
            (noise & (e.moved == 0.0) & far, "pre_asymptotic"),
            (
                exact_promised | (noise & (at_round_off(e) | ~(rough | corner_explains))),
                "round_off",
            ),
            (alternating & ~rough & ~corner_explains, "oscillating"),
            (missed, "wrong_limit"),
            (right & regular & ~hidden & ~temporary, "asymptotic"),
            (low & regular & (~corner_explains | deeper) & ~temporary, "order_low"),
            (corner_explains | temporary, "non_smooth"),
            (high & ~rough & ~hidden, "order_high"),
            (e.unseen & e.jumps, "non_smooth"),
            (e.unseen, "pre_asymptotic"),
            (rough | limited, "non_smooth"),
        ],
        lower,
        noise,
    )


def judge_together(rows: Sequence[Evidence]) -> list[Judgement]:
    """Judge several sets of ladders with the same shape, levels and tolerance at once; see `batches`."""
    fields = vars(judge(stacked(rows)))
    # copies, so that keeping one set does not keep all in memory
    parts = [{name: values[i].copy() for name, values in fields.items()} for i in range(len(rows))]
    return [Judgement(**part) for part in parts]
