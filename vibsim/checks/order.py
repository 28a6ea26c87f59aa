r"""The check ``converges``: measures the order of convergence and compares it with the expected one.

It also estimates what would settle an open verdict: how many finer levels, or which levels and which arithmetic.

**Too coarse.** With ``d_k = a h^p + b h^q`` the local orders approach the order p of the scheme (or the expected one,
if that is nearer) like ``p_k - p = C r^k`` with ``r = 2^-(q-p)`` per level. So the last order and the factor r, as
observed or as the powers of the scheme give it, predict the level at which the order is within the tolerance; one more
level confirms it. An order far above p belongs to levels that are unrelated to the solution, and predicts nothing.

**Round-off.** From the finest clean difference on, differences fall like h^p, while the predicted round-off of an
arithmetic grows with the number of steps. Three levels show an order as long as the finer of their two differences is
`ORDER_ABOVE_ROUND_OFF` times the round-off of its levels.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from vibsim.apriori.formal_orders import even_powers, orders_in
from vibsim.apriori.roundoff_floor import relative_floors
from vibsim.checks.accurate import ERROR, known_error
from vibsim.checks.fields import REASON, STATUS, Field, Measured
from vibsim.checks.outcome import Judged, as_expected
from vibsim.checks.sentences import MOST_FINER
from vibsim.comparison.order_verdict import (
    CAUSES,
    causes,
    facts_of,
    judge_check,
    judgement,
    order_of,
)
from vibsim.comparison.parting import parting
from vibsim.comparison.quantity_comparison import Compared, Comparison
from vibsim.convergence.differences import largest, safe_ratio
from vibsim.convergence.extrapolation.thresholds import ORDER_ABOVE_ROUND_OFF
from vibsim.convergence.ladder_facts import floor_of_pairs, pick
from vibsim.convergence.reasons import code
from vibsim.convergence.thresholds import (
    HALF_SPACING,
    LOWEST_ORDER,
    ORDINARY_ORDER,
    SUPERCONVERGENCE,
)
from vibsim.convergence.verdict import Judgement
from vibsim.core.array_types import Codes, Floats
from vibsim.core.record import Record, Variable
from vibsim.core.vocabulary import AMPLITUDE, MEMBER, PHASE, TYPICAL_NORM
from vibsim.elementary import on_arrays
from vibsim.experiment import Experiment
from vibsim.experiment.schema.checks import ConvergesCheck
from vibsim.observe.member_block import MemberBlock

FIELDS = {
    "status": STATUS,
    "reason": REASON,
    "order": Field("observed order"),
    "order_low": Field("lower end of the interval of the order"),
    "order_high": Field("upper end of the interval of the order"),
    "levels": Field(
        "first and last level that the order rests on, -1 for none",
        np.int16,
        none=-1,
        dims=("scheme", "case", "end"),
    ),
    "failed_level": Field("coarsest level that broke down, -1 for none", np.int16, none=-1),
    "levels_needed": Field("finer levels that are probably needed, -1 unknown", np.int8, none=-1),
    "readable_level": Field(
        "finest level at which the order can be read, -1 unknown", np.int8, none=-1
    ),
    "readable_level_compensated": Field(
        "finest level at which the order can be read in compensated arithmetic, -1 unknown",
        np.int8,
        none=-1,
    ),
    "cause": Field("why the order is another one, as far as it is known", np.int8, CAUSES),
    "parting_time": Field("up to when the finest two levels of a chaotic motion agree"),
    "parting_rate": Field("rate at which they part"),
    **ERROR,
}
OTHER_FACTS = {
    "promised": Field("order that is expected; none where the quantity is to be exact"),
    "best": Field("the number extrapolated over the levels; none of a series"),
    "best_bound": Field("bound of its error"),
}
"""Facts of a result that are not measured."""

UNKNOWN = -1
SLOWEST_APPROACH = 0.9
"""Orders that approach their limit by a larger factor per level predict nothing."""
FINEST_LEVEL = 40
"""Finest level considered."""


def measure(block: MemberBlock, compared: Compared, check: ConvergesCheck) -> Measured:
    """Return the measured fields of a check, with those that would settle or explain the verdict."""
    quantity, norm = compared[check.converges], check.norm
    judged, order = judge_check(quantity, check), order_of(quantity, check.order)
    agreement = parting(quantity, quantity.is_motion & (judged.reason == code("pre_asymptotic")))
    return {
        "status": judged.status,
        "reason": judged.reason,
        "order": judged.order,
        "order_low": judged.low,
        "order_high": judged.high,
        "levels": np.stack([judged.first, judged.last], axis=-1),
        "failed_level": judged.culprit,
        "levels_needed": _levels_needed(quantity, judged, order, check.tolerance),
        "readable_level": _finest_readable(quantity, judged, norm, order),
        "readable_level_compensated": _finest_readable(
            quantity, judged, norm, order, "compensated"
        ),
        "cause": causes(quantity, compared, judged, norm, order, check.tolerance),
        "parting_time": agreement[..., 0],
        "parting_rate": agreement[..., 1],
        **known_error(quantity),
    }


def judge(experiment: Experiment, record: Record, check: ConvergesCheck, facts: Measured) -> Judged:
    """Compare the verdict on a quantity with the expected verdict, for each scheme and member."""
    reason, order = facts["reason"], expected_order(experiment, record, check)
    unknown = np.full((1, 1), np.nan)
    others: dict[str, Floats] = {"promised": order, "best": unknown, "best_bound": unknown}
    return Judged(
        reason,
        # an exact quantity has no distance from an order
        away=np.where(reason == code("exact"), 0.0, np.abs(facts["order"] - order)),
        compared=as_expected(check.expect, reason),
        facts={
            name: (OTHER_FACTS[name], np.broadcast_to(values, reason.shape))
            for name, values in others.items()
        },
    )


def expected_order(experiment: Experiment, record: Record, check: ConvergesCheck) -> Floats:
    """Return the order that a check expects, shape (scheme, 1 or case)."""
    if check.order == "scheme":
        return orders_in(experiment, record, check.converges)
    return np.full((len(experiment.schemes), 1), float(check.order))


def phase_at_start(q: Comparison) -> dict[str, Variable]:
    """Return the part of a phase error that is there from the first step on; nothing of any other quantity."""
    if not q.name.endswith(PHASE) or not q.differences:
        return {}
    first = judgement(q, TYPICAL_NORM).first
    levels = np.array(q.block.grid.levels[:-1])
    # of the coarsest pair that the order rests on: furthest from round-off
    pair = np.where(first < 0, len(levels) - 1, np.searchsorted(levels, first))
    share = np.stack([safe_ratio(np.abs(d[..., 0]), largest(d)) for d in q.differences], axis=-1)
    chosen = pick(share, pair)
    words = f"{q.long_name}: what is there from the start over the largest"
    return {f"{q.name}_at_start": Variable.of(MEMBER, chosen, words)}


def is_of_parts(name: str) -> bool:
    """Tell whether a variable of the convergence Record is one that `phase_amplitude_text` reads."""
    numbers = tuple(f"{end}_{what}" for end in (PHASE, AMPLITUDE) for what in ("order", "status"))
    return name.endswith((*numbers, f"{PHASE}_at_start"))


def _levels_needed(q: Comparison, judged: Judgement, order: Floats, tolerance: float) -> Codes:
    """Return how many finer levels a ladder that is too coarse probably needs, shape (scheme, case).

    It is at least 1, or `UNKNOWN`, also for all verdicts other than ``pre_asymptotic``.
    """
    shape, orders = judged.reason.shape, judged.orders
    needed = np.full(shape, UNKNOWN, dtype=np.int8)
    is_coarse = judged.reason == code("pre_asymptotic")
    if not np.any(is_coarse) or not orders.shape[-1]:
        return needed
    last, own = orders[..., -1], np.broadcast_to(q.order, shape)
    with np.errstate(all="ignore"):
        target = np.where(np.abs(last - own) < np.abs(last - order), own, order)
        distance = np.abs(orders - target[..., None])
        promised = np.where(even_powers(q.block.experiment, q.name, q.block.columns), 0.25, 0.5)
        observed = distance[..., -1] / distance[..., -2] if orders.shape[-1] > 1 else promised
        # a single observation may be accidental; orders approach no faster than by the next power
        factor = np.maximum(observed, promised)
        steps = np.ceil(on_arrays.log(tolerance / distance[..., -1]) / on_arrays.log(factor)) + 1
        # an error that falls faster than all powers follows none of them
        is_known = is_coarse & np.isfinite(steps) & (last <= target + SUPERCONVERGENCE)
        # orders do not show how small a promised power is that a higher one hides
        is_known &= ~((last > q.order + HALF_SPACING) & (q.special > q.order + HALF_SPACING))
    is_known &= (factor <= SLOWEST_APPROACH) & (steps <= MOST_FINER)
    needed[is_known] = np.maximum(steps[is_known], 1).astype(np.int8)
    return needed


def _finest_readable(
    q: Comparison, judged: Judgement, norm: str, order: Floats, arithmetic: str | None = None
) -> Codes:
    """Return the finest level that shows an order, in the arithmetic of the schemes or another one, (scheme, case).

    It is `UNKNOWN` if the verdict is not ``round_off``, or no three levels show an order.
    """
    result = np.full(judged.reason.shape, UNKNOWN, dtype=np.int8)
    with np.errstate(invalid="ignore"):
        p = np.where(judged.order >= LOWEST_ORDER, judged.order, order)
    is_round_off = (judged.reason == code("round_off")) & np.isfinite(p)
    if not np.any(is_round_off):
        return result
    size, level_of_difference = _clean_difference(q, norm, p)
    noise = _noise(q, norm, arithmetic)
    with np.errstate(all="ignore"):
        for level in range(FINEST_LEVEL - 1):
            remaining = size * on_arrays.power(2.0, p * (level_of_difference - level - 1))
            floor = noise(level + 1) + noise(level + 2)
            clean = (size > 0.0) & (remaining >= ORDER_ABOVE_ROUND_OFF * floor)
            result[is_round_off & clean] = level + 2
    return result


def _clean_difference(q: Comparison, norm: str, p: Floats) -> tuple[Floats, Floats]:
    """Return the finest difference above round-off, converted to successive levels, and its coarser level.

    If none is above round-off, the coarsest difference is used, which is noise; the result is then too optimistic.
    """
    levels = np.array(q.block.grid.levels)
    e = facts_of(q, norm, q.order, ORDINARY_ORDER)
    clean = e.difference >= ORDER_ABOVE_ROUND_OFF * floor_of_pairs(e)
    index = np.max(np.where(clean, np.arange(len(levels) - 1), 0), axis=-1)
    size = pick(e.difference, index)
    gap = np.diff(levels)[index]
    per_level = np.where(
        gap > 1,
        on_arrays.expm1(-p * on_arrays.LN_2) / on_arrays.expm1(-p * gap * on_arrays.LN_2),
        1.0,
    )
    return size * per_level, levels.astype(np.float64)[index]


def _noise(q: Comparison, norm: str, arithmetic: str | None) -> Callable[[int], Floats]:
    """Return a function that predicts the round-off of a level in a norm, shape (scheme, case)."""
    block, floor = q.block, facts_of(q, norm, q.order, ORDINARY_ORDER).floor[..., -1]
    if block.stored_floor[-1] > 0.0:
        # the rounding of stored values is the same at all levels, in any arithmetic
        return lambda level: floor
    base = floor / block.relative_floor[..., -1]

    def round_off(level: int) -> Floats:
        steps = (block.experiment.steps(level),)
        floors = relative_floors(block.experiment, steps, block.columns, arithmetic)
        return np.asarray(base * floors[..., 0])

    return round_off
