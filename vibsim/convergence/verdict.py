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
   small for a tenth of a lower power (`vibsim.convergence.settled_orders`);
5. the order is stated with an interval where something is decided. PASS where it is within the tolerance, the series
   coincide, and it stands alone; ``order_low``, ``order_high`` where the interval excludes what is expected and holds
   an order that an expansion can have; else ``pre_asymptotic``, ``oscillating`` or ``round_off``;
6. where events are left to the mesh, or corners of a force from a table, an error has no expansion behind its first
   power, or the second: a ladder that does not show that power is ``non_smooth``. So is one that is lower than expected
   where the motion meets another corner of the force within a step (`vibsim.apriori.force_discontinuities`), but for
   one that settles below the power which that corner leaves;
7. a settled ladder whose error against the exact solution is larger than its differences allow: ``wrong_limit``.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from vibsim.convergence.asymptotic_range import trend
from vibsim.convergence.classify import rules
from vibsim.convergence.differences import order_of_ratio, safe_ratio
from vibsim.convergence.ladder_statistics import Evidence, at_round_off, breakdown, error_orders
from vibsim.convergence.true_errors import errors_vouch
from vibsim.core.array_types import Codes, Flags, Floats, Integers
from vibsim.core.vocabulary import REASON_NAMES, REASONS, STATUSES


@dataclass(frozen=True)
class Judgement:
    """What was decided of every ladder; arrays of shape (...)."""

    status: Codes
    """Index into `vocabulary.STATUSES`."""
    reason: Codes
    """Index into `vocabulary.REASON_NAMES`."""
    order: Floats
    """The stated order; NaN where none is."""
    low: Floats
    """Lower end of its interval; NaN where nothing is decided."""
    high: Floats
    """Upper end of its interval."""
    first: Integers
    """Coarsest level that the order rests on; -1 where there is no order."""
    last: Integers
    """Finest level that the order rests on; -1 where there is no order."""
    culprit: Integers
    """The coarsest level that failed, or whose w dt is beyond the limit; -1 where there is none."""
    orders: Floats = field(repr=False)
    """Local order of every triple, shape (..., n-2)."""


def judge(evidence: Evidence) -> Judgement:
    """Decide on every ladder; see the head of this module for the rules."""
    e = evidence
    shape = e.difference.shape[:-1]
    levels = np.array(e.levels, dtype=np.int64)
    orders = local_orders(e.difference, e.levels)
    broken, beyond, growing = breakdown(e, shape)
    culprit = np.where(
        np.any(broken | beyond, axis=-1), levels[np.argmax(broken | beyond, axis=-1)], -1
    )
    undefined = ~np.all(np.isfinite(e.difference), axis=-1)
    undefined |= ~np.all(np.isfinite(e.floor), axis=-1)
    exists = np.ones(shape, dtype=bool) if e.applicable is None else e.applicable
    sound = exists & ~undefined & ~np.any(broken | beyond, axis=-1) & ~growing
    cases = [
        (~exists, "not_applicable"),
        (np.any(beyond, axis=-1) | growing, "unstable"),
        (np.any(broken, axis=-1) | undefined, "non_finite"),
    ]
    if len(e.levels) < 3:
        cases.append((np.ones(shape, dtype=bool), "too_few_levels"))
        nothing = np.full(shape, -1)
        nan = np.full(shape, np.nan)
        return _decide(cases, culprit, orders, nan, nan, nan, nothing, nothing)
    of_errors, vouched = None, None
    if len(e.levels) == 3:
        of_errors = error_orders(e)[..., -1]
        vouched = errors_vouch(e, np.round(2.0 * orders[..., 0]) / 2)
    found = trend(
        orders,
        e.scatter,
        e.difference,
        e.floor,
        e.tolerance,
        ceiling=e.ceiling,
        of_errors=of_errors,
        vouched=vouched,
        numbers=e.numbers,
    )
    read, lower = rules(e, found)
    cases += read
    found = replace(found, low=lower)
    # the order of noise is none
    stated = sound & (found.count > 0) & ~(np.isinf(e.order) & at_round_off(e))
    order, low, high = (np.where(stated, x, np.nan) for x in (found.order, found.low, found.high))
    judged = _decide(
        cases,
        culprit,
        orders,
        order,
        low,
        high,
        np.where(stated, levels[found.first], -1),
        np.where(stated, levels[found.last + 2], -1),
    )
    # a last estimate is no order of which one could say how surely it is known
    guess = judged.status == STATUSES.index("INCONCLUSIVE")
    return replace(judged, low=np.where(guess, np.nan, low), high=np.where(guess, np.nan, high))


def local_orders(difference: Floats, levels: tuple[int, ...]) -> Floats:
    """Return the local order of every triple, shape (..., n-2), from norms of differences (..., n-1)."""
    orders = [
        order_of_ratio(safe_ratio(difference[..., i], difference[..., i + 1]), levels[i : i + 3])
        for i in range(len(levels) - 2)
    ]
    return np.stack(orders, axis=-1) if orders else np.empty((*difference.shape[:-1], 0))


def _decide(
    cases: list[tuple[Flags, str]],
    culprit: Integers,
    orders: Floats,
    order: Floats,
    low: Floats,
    high: Floats,
    first: Integers,
    last: Integers,
) -> Judgement:
    """Take the first rule that applies to each ladder; without one it is not yet asymptotic."""
    codes = [REASON_NAMES.index(reason) for _, reason in cases]
    reason = np.select([mask for mask, _ in cases], codes, REASON_NAMES.index("pre_asymptotic"))
    of_reason = np.array([STATUSES.index(status) for status in REASONS.values()], dtype=np.int8)
    return Judgement(
        of_reason[reason], reason.astype(np.int8), order, low, high, first, last, culprit, orders
    )
