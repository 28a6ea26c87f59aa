r"""The verdict: may the observed order of a ladder of levels be believed?

A pure function of the numbers of a ladder, for any number of ladders at once. Leading dimensions ``...`` are ladders
(scheme, case); n is the number of levels, a *pair* is two successive levels, a *triple* three.

The rules, in the order in which they apply (the first that applies decides):

1. a quantity that does not exist: ``not_applicable``; a level that broke down, or w dt beyond the stability limit, or
   growth that refinement does not remove: ``unstable``, else ``non_finite``; fewer than three levels:
   ``too_few_levels``;
2. round-off: `vibsim.convergence.roundoff_onset` says where it begins; finer triples are cut off. Nothing left:
   ``exact`` where the differences of an inexact scheme would have been seen, else ``round_off``. Where the promise is
   that a quantity is exact, this alone decides: a difference above ``ABOVE_ROUND_OFF * floor`` is ``order_low``;
3. one triple left: the two difference series over time are the evidence, and must be proportional; beside them the true
   errors, where they are known;
4. several left: the last two local orders or their limit, and what is left besides h^p, which must fade, or be too
   small for a tenth of a lower power (`vibsim.convergence.asymptotic_range`);
5. the order is stated with an interval where something is decided. PASS where it is within the tolerance, the series
   coincide, and it stands alone; ``order_low``, ``order_high`` where the interval excludes what is expected and holds
   an order that an expansion can have; else ``pre_asymptotic``, ``oscillating`` or ``round_off``;
6. where events are left to the mesh, or corners of a force from a table, an error has no expansion behind its first
   power, or the second: a ladder that does not show that power is ``non_smooth``. So is one that is lower than expected
   where the motion meets another corner of the force within a step (`vibsim.apriori.force_discontinuities`), but for
   one that settles below the power which that corner leaves. So is one that stays open although finer levels would show
   that power, not the expected one;
7. a settled ladder whose error against the exact solution is larger than its differences allow: ``wrong_limit``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from vibsim.convergence import true_errors as errors
from vibsim.convergence.asymptotic_range import trend
from vibsim.convergence.classify import rules
from vibsim.convergence.differences import order_of_ratio, safe_ratio
from vibsim.convergence.ladder_statistics import (
    Evidence,
    at_round_off,
    beside_each_other,
    breakdown,
)
from vibsim.core.array_types import Codes, Floats, Integers
from vibsim.core.vocabulary import REASON_NAMES, REASONS, STATUSES


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
    """Decide on every ladder; see the head of this module for the rules."""
    shape, levels = e.difference.shape[:-1], np.array(e.levels, dtype=np.int64)
    orders = local_orders(e.difference, e.levels)
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
    if len(e.levels) < 3:
        cases.append((np.ones(shape, dtype=bool), "too_few_levels"))
    else:
        of_errors, vouched = np.full(shape, np.nan), np.zeros(shape, dtype=bool)
        if len(e.levels) == 3:
            of_errors = e.error_orders[..., -1]
            vouched = errors.vouch(e, np.round(2.0 * orders[..., 0]) / 2)
        found = trend(e, orders, of_errors, vouched)
        read, lower = rules(e, found)
        cases += read
        # the order of noise is none
        stated = e.applicable & ~undefined & ~fails & ~growing
        stated &= (found.count > 0) & ~(np.isinf(e.order) & at_round_off(e))
        order, low, high = (np.where(stated, x, np.nan) for x in (found.order, lower, found.high))
        first, last = (np.where(stated, levels[x], -1) for x in (found.first, found.last + 2))
    # without a rule that applies it is not yet asymptotic
    codes = [REASON_NAMES.index(reason) for _, reason in cases]
    reason = np.select([mask for mask, _ in cases], codes, REASON_NAMES.index("pre_asymptotic"))
    of_reason = np.array([STATUSES.index(status) for status in REASONS.values()], dtype=np.int8)
    # a last estimate is no order of which one could say how surely it is known
    guess = of_reason[reason] == STATUSES.index("INCONCLUSIVE")
    return Judgement(
        status=of_reason[reason],
        reason=reason.astype(np.int8),
        order=order,
        low=np.where(guess, np.nan, low),
        high=np.where(guess, np.nan, high),
        first=first,
        last=last,
        culprit=np.where(fails, levels[np.argmax(culprits, axis=-1)], -1),
        orders=orders,
    )


def judge_together(rows: Sequence[Evidence]) -> list[Judgement]:
    """Decide on several sets of ladders at once, of the same shape, levels and tolerance; see `batches`."""
    found = vars(judge(beside_each_other(rows)))
    # what is kept of one does not keep the others
    parts = [{name: of[i].copy() for name, of in found.items()} for i in range(len(rows))]
    return [Judgement(**part) for part in parts]


def local_orders(difference: Floats, levels: tuple[int, ...]) -> Floats:
    """Return the local order of every triple, shape (..., n-2), from norms of differences (..., n-1)."""
    orders = [
        order_of_ratio(safe_ratio(difference[..., i], difference[..., i + 1]), levels[i : i + 3])
        for i in range(len(levels) - 2)
    ]
    return np.stack(orders, axis=-1) if orders else np.empty((*difference.shape[:-1], 0))
