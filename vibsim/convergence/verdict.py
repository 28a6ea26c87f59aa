r"""The verdict: may the observed order of a ladder of levels be believed?

A pure function of the numbers of a ladder, for any number of ladders at once. Leading dimensions ``...`` are ladders
(scheme, case); n is the number of levels.

The error model decides on the order (`vibsim.convergence.assessment`). Facts that no ladder shows come first, or set
limits to it. The first line that applies decides:

| what is known | status and reason |
|---|---|
| the quantity does not exist, or the scheme has no levels | ``not_applicable`` |
| w dt beyond the stability limit, or growth that refinement does not remove | ``unstable`` |
| a level that broke down | ``non_finite`` |
| fewer than three levels | ``too_few_levels`` |
| a pulse of the force that no level sees, and no exact solution that says it does not matter | ``non_smooth`` for a \
jump, else ``pre_asymptotic`` |
| nothing moves wherever levels are compared | ``not_applicable``; ``pre_asymptotic`` where the exact solution moves |
| a velocity that is gone within a step of every level, and no order that is expected | ``pre_asymptotic`` |
| all differences are round-off, and an ordinary error would show | ``exact``; ``wrong_limit`` away from the exact \
solution |
| exactness is promised, and a difference is none of round-off | ``order_low`` |
| the finest differences may be round-off, and the error model believes no order | ``round_off`` |
| the error model finds alternating errors | ``oscillating`` |
| ... another limit than the exact solution | ``wrong_limit`` |
| ... the expected order, and no promised power may hide behind it | ``asymptotic`` |
| ... a lower order, which no corner of the force within a step explains | ``order_low`` |
| such a corner explains an order below the expected one, or one power less beside a point of all levels | \
``non_smooth`` |
| the error model finds a higher order, and no promised power may hide behind it | ``order_high`` |
| events are left to the mesh, or a corner leaves less than the expected order | ``non_smooth`` |
| anything else | ``pre_asymptotic`` |

Where levels differ by more than the solution, the error model decides nothing. Where events are left to the mesh, or
corners to a table, only the power that they leave is regular.
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
    beside_each_other,
    breakdown,
    errors_stay,
    far_from_exact,
    is_noise,
    pick,
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
    """What was decided of every ladder; arrays of shape (...)."""

    status: Codes  # index into `vocabulary.STATUSES`
    reason: Codes  # index into `vocabulary.REASON_NAMES`
    order: Floats  # the stated order; NaN where none is
    low: Floats  # lower end of its interval; NaN where nothing is decided
    high: Floats  # upper end of its interval
    first: Integers  # coarsest level that the order rests on; -1 where there is no order
    last: Integers  # finest level that the order rests on; -1 where there is no order
    culprit: Integers  # the coarsest level that failed, or is beyond the limit; -1 for none
    orders: Floats = field(repr=False)  # local order of every triple, shape (..., n-2)


def judge(e: Evidence) -> Judgement:
    """Decide on every ladder; see the head of this module."""
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
        believed = _believed(e, judged)
        read, lower, noise = _cases(e, believed, orders)
        cases += read
        # the order of noise is none
        stated = judged & ~noise & ~(np.isinf(e.order) & at_round_off(e))
        order, low, high = (
            np.where(stated, x, np.nan) for x in (believed.order, lower, believed.high)
        )
        first, last = (np.where(stated, levels[x], -1) for x in (believed.first, believed.last))
    # without a case that applies it is not yet asymptotic
    reason = first_reason(cases, "pre_asymptotic")
    # a last estimate is no order of which one could say how surely it is known
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


def _believed(e: Evidence, judged: Flags) -> Decision:
    """Return what the error model says of the ladders that it is asked about, and of all others that they are noise."""
    shape, n = judged.shape, len(e.levels)
    found = Decision(
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
    # differences that all vanish have no size
    judged = judged & np.any(e.difference > 0.0, axis=-1)
    for key in np.unique(keys[judged].astype(np.float64), axis=0):
        chosen = judged & np.all(keys == key, axis=-1)
        exact_known, expected, by_theory = key.tolist()
        count = n if exact_known else n - 1
        sizes = rows[chosen][:, :count]
        unit = np.max(sizes, axis=-1, keepdims=True)
        sizes = sizes / unit
        ladder = Ladder(
            h=on_arrays.power(2.0, -np.array(e.levels, dtype=np.float64)),
            gram=e.cosines[chosen][:, :count, :count] * sizes[:, :, None] * sizes[:, None, :],
            floor=e.floor[chosen] / unit,
            numbers=e.numbers[chosen],
            exact_known=bool(exact_known),
        )
        # what is exact is recognised by the predicted round-off of the scheme
        question = Question(
            expected=expected,
            tolerance=e.tolerance,
            noise_factor=0.0,
            by_theory=bool(by_theory),
        )
        a = decide(ladder, question)
        for name, values in vars(found).items():
            values[chosen] = getattr(a, name)
    return found


def _expected(e: Evidence) -> Floats:
    """Return the order that is expected; where it is exactness, the order that an ordinary error has."""
    return np.where(np.isinf(e.order), th.ORDINARY_ORDER, e.order)


def _is_theory(e: Evidence) -> Flags:
    """Say where theory promises the expected order, and no event or corner within a step leaves a lower one."""
    rough = np.fmin(e.left_to_the_mesh, e.corner) < e.order - e.tolerance
    return np.asarray((e.order == e.promised) & ~rough)


def _cases(
    e: Evidence, b: Decision, orders: Floats
) -> tuple[list[tuple[Flags, str]], Floats, Flags]:
    """Return the cases of ladders of three levels and more, first to last.

    With them the lower end of the interval, which reaches to a promised power that may hide, and where all is noise.
    """
    says = partial(is_one_of, b.reason)
    exactly, tol, p = np.isinf(e.order), e.tolerance, _expected(e)
    noise = says("exact") | (says("round_off", "pre_asymptotic") & is_noise(e))
    exact = (exactly | noise) & truly_exact(e)
    # levels that differ by more than the solution have nothing to do with it yet
    near = pick(e.difference, b.last - 1) <= e.scale
    right, low, high, missed = (
        says(reason) & near for reason in ("asymptotic", "order_low", "order_high", "wrong_limit")
    )
    alternating = says("oscillating")
    # neither the higher order nor a failure of the promised one, until the levels exclude this or show it
    hides = is_promise_hidden(e, np.where(noise, np.nan, b.order), b.last)
    lower = np.where(hides, np.minimum(b.low, e.promised), b.low)
    hidden = hides & (p >= e.promised - tol)
    # any other power is the accident of where events or corners lie between grid points
    left, rough = e.left_to_the_mesh, ~np.isnan(e.left_to_the_mesh)
    regular = ~rough | (np.abs(b.order - left) <= tol)
    # two levels may then be near each other, and both be away from the exact solution; so may those be that show only
    # the higher power
    missed &= ~(rough | ~np.isnan(e.corner) | hides) | errors_stay(e)
    # a corner leaves all powers up to its own: a ladder that settles lower has another cause
    below = (b.order < p - tol) | np.any(orders[..., -2:] < (p - tol)[..., None], axis=-1)
    kinked = ~np.isnan(e.corner) & (p >= e.corner) & (below | alternating | noise)
    # three levels beside a corner may have any order: the powers that are believed tell
    deeper = b.high < e.corner - np.maximum(tol, th.HALF_SPACING)
    # beside a point that all levels share a corner leaves one power less, until steps are shorter than that distance
    one_less = np.abs(b.order - (e.corner - 1.0)) <= np.maximum(tol, th.HALF_SPACING)
    for_now = e.near_a_point & one_less & (e.promised >= e.corner)
    # finer levels show the power of the corner, not p: those that do not yet are no reason to add some
    limited = e.corner < p - tol
    far = far_from_exact(e)
    still = at_rest(e) & (exactly | noise)
    # what no level sees, no difference tells of: an exact solution alone would say that it does not matter
    blind = e.missed & (missed | ((exact | noise | exactly) & far) | np.isnan(e.error))
    # an implicit scheme with long steps goes on with a velocity that has gone, and that is no fault of it
    coarse = unresolved(e) & (exact | missed | low | high)
    return (
        [
            (blind & e.jumps, "non_smooth"),
            (blind, "pre_asymptotic"),
            # at rest on every level, and away from a motion: steps as long as that see nothing of it
            (still & far, "pre_asymptotic"),
            (still, "not_applicable"),
            (coarse, "pre_asymptotic"),
            # levels that notice their events at the same points are no closer to the exact solution for that
            (exact & far & rough, "non_smooth"),
            (exact & far, "wrong_limit"),
            (exact, "exact"),
            (exactly & ~at_round_off(e), "order_low"),
            (noise & (e.moved == 0.0) & far, "pre_asymptotic"),
            (exactly | (noise & (at_round_off(e) | ~(rough | kinked))), "round_off"),
            (alternating & ~rough & ~kinked, "oscillating"),
            (missed, "wrong_limit"),
            (right & regular & ~hidden & ~for_now, "asymptotic"),
            (low & regular & (~kinked | deeper) & ~for_now, "order_low"),
            (kinked | for_now, "non_smooth"),
            (high & ~rough & ~hidden, "order_high"),
            (e.missed & e.jumps, "non_smooth"),
            (e.missed, "pre_asymptotic"),
            (rough | limited, "non_smooth"),
        ],
        lower,
        noise,
    )


def judge_together(rows: Sequence[Evidence]) -> list[Judgement]:
    """Decide on several sets of ladders at once, of the same shape, levels and tolerance; see `batches`."""
    found = vars(judge(beside_each_other(rows)))
    # what is kept of one does not keep the others
    parts = [{name: of[i].copy() for name, of in found.items()} for i in range(len(rows))]
    return [Judgement(**part) for part in parts]
