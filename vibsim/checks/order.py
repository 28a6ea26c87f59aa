r"""The check ``converges``: what it measures of the order of convergence, and whether that is as expected.

What would settle a verdict that is open: how many finer levels, or which levels and which arithmetic.

**Too coarse.** With ``d_k = a h^p + b h^q`` the local orders approach the order p of the scheme, or the expected one
where they are nearer to that, like ``p_k - p = C r^k``, ``r = 2^-(q-p)`` per level. So the last order and the factor r,
as it was seen or as the powers of the scheme give it, say at which level the order is within the tolerance; one more
confirms it. An order far above p is that of levels which have nothing to do with the solution, and tells nothing.

**Round-off.** Differences fall like h^p from the finest clean one on, the predicted round-off of an arithmetic grows
with the number of steps. An order can be read from three levels as long as the finer of their two differences is
`ORDER_ABOVE_ROUND_OFF` times the round-off of its levels.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from vibsim.apriori.formal_orders import even_powers, orders_in, relative_floors
from vibsim.checks.accurate import ERROR, MOST, known_error
from vibsim.checks.fields import REASON, STATUS, Field, Measured
from vibsim.checks.outcome import Judged, as_expected
from vibsim.comparison.order_evidence import (
    CAUSES,
    causes,
    evidence,
    judge_check,
    judgement,
    order_of,
)
from vibsim.comparison.parting import parting
from vibsim.comparison.quantity_comparison import Compared, Comparison
from vibsim.convergence.differences import largest, safe_ratio
from vibsim.convergence.evidence import pick
from vibsim.convergence.reasons import code
from vibsim.convergence.thresholds import (
    HALF_SPACING,
    LOWEST_ORDER,
    ORDER_ABOVE_ROUND_OFF,
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
BESIDE = {
    "expected": Field("order that is expected; none where the quantity is to be exact"),
    "best": Field("the number extrapolated over the levels; none of a series"),
    "best_bound": Field("bound of its error"),
}
"""Facts that are not measured by the check."""

UNKNOWN = -1
SLOWEST = 0.9
"""Orders that approach by a larger factor do not tell where they go."""
FINEST = 40
"""No finer level is looked at."""


def measure(block: MemberBlock, compared: Compared, check: ConvergesCheck) -> Measured:
    """Return what a check measures, with what would settle a verdict that is open, or explain it."""
    quantity, norm = compared[check.converges], check.norm
    judged, order = judge_check(quantity, check), order_of(quantity, check.order)
    is_state = check.converges in (state.name for state in block.model.states)
    parts = parting(quantity, is_state & (judged.reason == code("pre_asymptotic")))
    return {
        "status": judged.status,
        "reason": judged.reason,
        "order": judged.order,
        "order_low": judged.low,
        "order_high": judged.high,
        "levels": np.stack([judged.first, judged.last], axis=-1),
        "failed_level": judged.culprit,
        "levels_needed": _more_levels(quantity, judged, order, check.tolerance),
        "readable_level": _finest_readable(quantity, judged, norm, order),
        "readable_level_compensated": _finest_readable(
            quantity, judged, norm, order, "compensated"
        ),
        "cause": causes(quantity, compared, judged, norm, order, check.tolerance),
        "parting_time": parts[..., 0],
        "parting_rate": parts[..., 1],
        **known_error(quantity),
    }


def judge(experiment: Experiment, record: Record, check: ConvergesCheck, found: Measured) -> Judged:
    """Compare the verdict on a quantity, of every scheme and member, with the expected one."""
    reason, order = found["reason"], expected_order(experiment, record, check)
    none = np.full((1, 1), np.nan)
    beside: dict[str, Floats] = {"expected": order, "best": none, "best_bound": none}
    return Judged(
        reason,
        # what is exact has no order that could be hard to reach
        away=np.where(reason == code("exact"), 0.0, np.abs(found["order"] - order)),
        compared=as_expected(check.expect, reason),
        facts={
            name: (BESIDE[name], np.broadcast_to(values, reason.shape))
            for name, values in beside.items()
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


def _more_levels(q: Comparison, judged: Judgement, order: Floats, tolerance: float) -> Codes:
    """Return how many finer levels a ladder that is too coarse probably needs, shape (scheme, case).

    At least 1; `UNKNOWN` where nothing is known, or the verdict is another one.
    """
    shape, orders = judged.reason.shape, judged.orders
    needed = np.full(shape, UNKNOWN, dtype=np.int8)
    early = judged.reason == code("pre_asymptotic")
    if not np.any(early) or not orders.shape[-1]:
        return needed
    last, has = orders[..., -1], np.broadcast_to(q.order, shape)
    with np.errstate(all="ignore"):
        aim = np.where(np.abs(last - has) < np.abs(last - order), has, order)
        away = np.abs(orders - aim[..., None])
        promised = np.where(even_powers(q.block.experiment, q.name, q.block.columns), 0.25, 0.5)
        observed = away[..., -1] / away[..., -2] if orders.shape[-1] > 1 else promised
        # what was seen once may be an accident; no power falls faster than the next one
        factor = np.maximum(observed, promised)
        steps = np.ceil(on_arrays.log(tolerance / away[..., -1]) / on_arrays.log(factor)) + 1
        # an error that falls faster than the powers do is none of them
        known = early & np.isfinite(steps) & (last <= aim + SUPERCONVERGENCE)
        # how small the promised power still is, behind a higher one, is not in the orders
        known &= ~((last > q.order + HALF_SPACING) & (q.special > q.order + HALF_SPACING))
    known &= (factor <= SLOWEST) & (steps <= MOST)
    needed[known] = np.maximum(steps[known], 1).astype(np.int8)
    return needed


def _finest_readable(
    q: Comparison, judged: Judgement, norm: str, order: Floats, arithmetic: str | None = None
) -> Codes:
    """Return the finest level at which an order can still be read, in the arithmetic of the schemes or another one.

    `UNKNOWN` where the verdict is not ``round_off``, or no three levels show an order; shape (scheme, case).
    """
    found = np.full(judged.reason.shape, UNKNOWN, dtype=np.int8)
    with np.errstate(invalid="ignore"):
        p = np.where(judged.order >= LOWEST_ORDER, judged.order, order)
    lost = (judged.reason == code("round_off")) & np.isfinite(p)
    if not np.any(lost):
        return found
    size, at = _clean_difference(q, norm, p)
    noise = _noise(q, norm, arithmetic)
    with np.errstate(all="ignore"):
        for level in range(FINEST - 1):
            left = size * on_arrays.power(2.0, p * (at - level - 1))
            floor = noise(level + 1) + noise(level + 2)
            clean = (size > 0.0) & (left >= ORDER_ABOVE_ROUND_OFF * floor)
            found[lost & clean] = level + 2
    return found


def _clean_difference(q: Comparison, norm: str, p: Floats) -> tuple[Floats, Floats]:
    """Return the finest difference above round-off, as that of neighbouring levels, and its coarser level.

    Where none is above it, the coarsest difference is taken, which is noise: what can be read is then too much.
    """
    levels = np.array(q.block.grid.levels)
    e = evidence(q, norm, q.order, ORDINARY_ORDER)
    clean = e.difference >= ORDER_ABOVE_ROUND_OFF * (e.floor[..., :-1] + e.floor[..., 1:])
    place = np.max(np.where(clean, np.arange(len(levels) - 1), 0), axis=-1)
    size = pick(e.difference, place)
    gap = np.diff(levels)[place]
    whole = np.where(
        gap > 1,
        on_arrays.expm1(-p * on_arrays.LN_2) / on_arrays.expm1(-p * gap * on_arrays.LN_2),
        1.0,
    )
    return size * whole, levels.astype(np.float64)[place]


def _noise(q: Comparison, norm: str, arithmetic: str | None) -> Callable[[int], Floats]:
    """Return what gives the predicted round-off of a level in a norm, shape (scheme, case)."""
    block, floor = q.block, evidence(q, norm, q.order, ORDINARY_ORDER).floor[..., -1]
    if block.stored_floor[-1] > 0.0:
        # what storing leaves is the same at every level, in any arithmetic
        return lambda level: floor
    base = floor / block.relative_floor[..., -1]

    def at(level: int) -> Floats:
        steps = (block.experiment.steps(level),)
        floors = relative_floors(block.experiment, steps, block.columns, arithmetic)
        return np.asarray(base * floors[..., 0])

    return at
