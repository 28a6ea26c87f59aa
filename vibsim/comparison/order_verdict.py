"""The facts that a verdict on an order rests on, the verdict, and why the order differs from the expected one.

If the order is too low: is it at one time (the last point, which may have a special formula), in one quantity, or
everywhere? If it is too high: is it that of the whole solution, or is the leading error hidden, at times where it
vanishes by symmetry, in one quantity, or in one norm? An error that cancels is neither a fault nor a higher order.

Most of the error of an oscillation is a shift in time, ``e(t) = -s(t) u'(t)``, which vanishes wherever u' does. So
common times that all lie at turning points (Dt = pi/w after a release from rest) show only the next power.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from functools import partial

import numpy as np

from vibsim.apriori.roundoff_floor import SPACING_AT_ONE, norm_of_floor
from vibsim.comparison.batches import batches
from vibsim.comparison.parting import FAR
from vibsim.comparison.quantity_comparison import Compared, Comparison
from vibsim.comparison.thresholds import STRAIGHT, THEORY_ROUNDING, VANISHING_RATE
from vibsim.convergence.differences import largest, safe_ratio
from vibsim.convergence.ladder_facts import (
    LadderFacts,
    at_rest,
    floor_of_pairs,
    pick,
    unresolved,
)
from vibsim.convergence.reasons import is_one_of
from vibsim.convergence.thresholds import ABOVE_ROUND_OFF, HALF_SPACING, ROUND_OFF_SAFETY
from vibsim.convergence.verdict import Judgement, judge, judge_together
from vibsim.core.array_types import Codes, Flags, Floats
from vibsim.core.vocabulary import NORMS, ORDER_TOLERANCE, TYPICAL_NORM, is_error_part, plain_name
from vibsim.elementary import on_arrays
from vibsim.experiment.schema.checks import ConvergesCheck
from vibsim.models import ENERGIES
from vibsim.observe import predicted_oscillation
from vibsim.observe.member_block import stored_or_nan

CAUSES = (
    *("none", "last_point", "one_quantity", "everything", "special_times", "one_norm", "theory"),
    *("stored", "still", "pulse", "noise", "decay", "parted", "zero"),
)
"""Causes of an order; files store an index into this tuple."""
NONE, LAST_POINT, ONE_QUANTITY, EVERYTHING, SPECIAL_TIMES, ONE_NORM, THEORY = range(7)
STORED, STILL, PULSE, NOISE, DECAY, PARTED, ZERO = range(7, len(CAUSES))

UNSEEN = ("pre_asymptotic", "not_applicable")
"""Reasons for a motion that is at rest where levels are compared."""
ROUGH = ("pre_asymptotic", "non_smooth")
"""Reasons if the force has a pulse that no level sees."""


def judge_orders(
    quantities: Compared, names: Iterable[str], checks: Iterable[ConvergesCheck]
) -> None:
    """Judge the named quantities by the orders that their schemes promise, and all by those that checks expect.

    The results are cached for `judgement` and `judge_check`.
    """
    due: list[tuple[str, float | str, str]] = [(name, "scheme", TYPICAL_NORM) for name in names]
    due += [
        (check.converges, _expected(quantities[check.converges], check), check.norm)
        for check in checks
        if _is_usual(check)
    ]
    due = list(dict.fromkeys(due))
    ladders = math.prod(quantities[due[0][0]].block.shape) if due else 0
    for batch in batches(due, ladders):
        rows = [
            facts_of(quantities[name], norm, order_of(quantities[name], order), ORDER_TOLERANCE)
            for name, order, norm in batch
        ]
        for (name, order, norm), judged in zip(batch, judge_together(rows), strict=True):
            quantities[name].judged[norm, order] = judged


def judgement(q: Comparison, norm: str, order: float | str = "scheme") -> Judgement:
    """Judge a quantity by the order that its scheme promises, or by another one."""
    if (norm, order) not in q.judged:
        judged = judge(facts_of(q, norm, order_of(q, order), ORDER_TOLERANCE))
        q.judged[norm, order] = judged
    return q.judged[norm, order]


def judge_check(q: Comparison, check: ConvergesCheck) -> Judgement:
    """Judge a quantity by the order that a check expects."""
    if not _is_usual(check):
        return judge(facts_of(q, check.norm, order_of(q, check.order), check.tolerance))
    return judgement(q, check.norm, _expected(q, check))


def order_in(q: Comparison, norm: str) -> Floats:
    """Return the order of a quantity in a norm, shape (scheme, case).

    In a norm that is not judged, it is the local order of the levels that the verdict in the typical norm rests on.
    """
    if (norm, "scheme") in q.judged:
        return q.judged[norm, "scheme"].order
    typical, orders = judgement(q, TYPICAL_NORM), q.observed_orders(norm)
    if not orders.shape[-1]:
        return typical.order
    # the finest three levels of the window
    triple = np.searchsorted(q.block.grid.levels, typical.last) - 2
    orders_there = pick(orders, triple)
    return np.where(np.isnan(typical.order), np.nan, orders_there)


def _is_usual(check: ConvergesCheck) -> bool:
    return check.tolerance == ORDER_TOLERANCE


def _expected(q: Comparison, check: ConvergesCheck) -> float | str:
    """Return the order that a check expects: "scheme" if all schemes and members promise it."""
    promised = check.order == "scheme" or bool(np.all(order_of(q, check.order) == q.order))
    return "scheme" if promised else check.order


def order_of(q: Comparison, order: float | str) -> Floats:
    """Return the order that a check expects of a quantity; it broadcasts against (scheme, case)."""
    return q.order if order == "scheme" else np.full((1, 1), float(order))


def facts_of(q: Comparison, norm: str, order: Floats, tolerance: float) -> LadderFacts:
    """Return the facts about a quantity in a norm for the expected order, shape (scheme, 1 or case)."""
    block = q.block
    grid, shape = block.grid, block.shape
    size, exists = largest(q.values[-1]), np.ones(shape, dtype=bool)
    if not np.all(np.isfinite(size)):
        # use the finite values of a member that broke down
        finest = q.values[-1]
        size, exists = largest(np.nan_to_num(finest)), np.any(np.isfinite(finest), axis=-1)
    if plain_name(q.name) in ENERGIES or is_error_part(q.name):
        # an energy deviation is known no better than the energy, and a part of an error no better than the motion
        size = q.scale

    def all_cases(values: Floats) -> Floats:
        return np.broadcast_to(values, shape)

    ceiling = SPACING_AT_ONE * grid.steps[-1] ** 2 * q.scale * block.magnified
    moved, straight = _motion(q, order, size)
    # a scheme that evaluates the force only at the start of a step misses a corner in the last step of each level
    with np.errstate(invalid="ignore"):
        in_last_step = block.corners.time > block.group.end * (1.0 - 1.0 / grid.steps[-1])
    # without oscillations no order is promised for a part of an error
    promised = ~block.adaptive[:, None] & ~np.isnan(order)
    measured, cosines = q.in_norm(norm), q.cosines(norm)
    # an unknown error has no row
    unknown_rows = len(grid.levels) - cosines.shape[-1]
    # norm of noise of size 1 at each point
    weight = norm_of_floor(np.ones(1), norm, q.points, grid.spacing)
    return LadderFacts(
        levels=grid.levels,
        expected=all_cases(order),
        tolerance=tolerance,
        difference=measured.difference,
        cosines=np.pad(cosines, [(0, 0), (0, 0), (0, unknown_rows), (0, unknown_rows)]),
        error=measured.error[..., -1],
        floor=q.floor * weight[:, None],
        ceiling=np.maximum(ceiling, q.floor[..., -1]) * weight,
        relative_floor=all_cases(block.relative_floor[..., 0]),
        size=size * weight,
        scale=q.scale * weight,
        blur=q.blur * weight[:, None],
        promised=all_cases(q.lowest),
        special=all_cases(q.special),
        combined=partial(q.combined, norm),
        numbers=q.are_numbers,
        failed=block.failed,
        applicable=(exists | np.any(block.failed, axis=-1)) & promised,
        omega_dt=np.broadcast_to(block.fastest, (*shape, len(grid.levels))),
        stability_limit=all_cases(block.stability_limit),
        span=all_cases(block.omega_dt[:, 0] * float(grid.steps[0])),
        steps=float(grid.steps[0]),
        moved=moved,
        straight=straight,
        left_to_the_mesh=all_cases(block.left_to_the_mesh),
        corner=block.corners.power,
        near_a_point=block.corners.near_a_point,
        unseen=np.isfinite(block.missed.time) | in_last_step,
        jumps=block.missed.jumps | in_last_step,
        decay=block.decay * block.group.end / grid.steps[-1],
        growth=block.growth,
    )


def _motion(q: Comparison, order: Floats, size: Floats) -> tuple[Floats, Flags]:
    """Return the relative change of a quantity, and whether it is along a straight line, each of shape (scheme, case).

    For a quantity that is promised to be exact, or a part of an error, the change is that of the positions.
    """
    # all levels share the start: a quantity at rest at all other common times shows nothing about a scheme
    block, rows = q.block, [part.values[-1][..., 1:] for part in q.parts or (q,)]
    with np.errstate(all="ignore"):
        change = np.max([np.max(later, axis=-1) - np.min(later, axis=-1) for later in rows], axis=0)
        bends = [np.max(np.abs(np.diff(x, 2, axis=-1)), axis=-1, initial=0.0) for x in rows]
        bend = np.max(bends, axis=0)
        moved, straight = change / size, np.asarray(bend <= STRAIGHT * change)
    positions = [name for name in block.model.positions if f"{name}_max" in block.finest]
    if not positions:
        return moved, straight
    ends = [[block.finest[f"{name}_{end}"] for end in ("min", "max")] for name in positions]
    with np.errstate(all="ignore"):
        changes = [(high - low) / np.maximum(np.abs(low), np.abs(high)) for low, high in ends]
    by_motion = np.broadcast_to(np.isinf(order) | is_error_part(q.name), block.shape)
    return np.where(by_motion, np.fmax.reduce(changes), moved), straight & ~by_motion


def causes(
    q: Comparison, others: Compared, judged: Judgement, norm: str, order: Floats, tolerance: float
) -> Codes:
    """Return why orders are too low, too high, or not visible, as indices into `CAUSES`, shape (scheme, case).

    Parameters
    ----------
    q, others
        The quantity and the other quantities, compared between levels.
    judged
        The verdict on the quantity.
    norm, order, tolerance
        The norm, the expected order (which broadcasts against (scheme, case)) and its tolerance.
    """
    result, shape = _causes_unseen(q, judged, norm, order, tolerance), judged.reason.shape
    low, high = (is_one_of(judged.reason, reason) for reason in ("order_low", "order_high"))
    if not np.any(low | high):
        return result
    expected, model = np.broadcast_to(order, shape), q.block.model
    states = [state.name for state in model.states if state.name != q.name and state.name in others]
    # that one state has the expected order does not make the sum of all have it
    any_states = [] if q.parts else states

    def has_order(quantity: Comparison, in_norm: str, order: Floats) -> Flags:
        with np.errstate(invalid="ignore"):
            return np.asarray(np.abs(order_in(quantity, in_norm) - order) <= tolerance)

    def any_expected(names: Iterable[str]) -> Flags:
        """Say where any of these states has the expected order."""
        masks = [has_order(others[name], norm, expected) for name in names]
        return np.asarray(np.any(masks, axis=0))

    def all_same() -> Flags:
        """Say where all other states have the order of the quantity; an unknown order does not count as the same."""
        masks = [has_order(others[name], norm, judged.order) for name in states]
        return np.asarray(np.all(masks, axis=0))

    if np.any(low):
        inside = has_order(q, "linf_interior", expected) & (norm != "linf_interior")
        kinds = [(inside, LAST_POINT), (any_expected(any_states), ONE_QUANTITY)]
        kinds.append((all_same(), EVERYTHING))
        result = np.where(low, _first(kinds, shape), result)
    if np.any(high):
        # frequency and growth are those of the position: if that has the expected order, they are not the cause
        positions = [name for name in states if name in model.positions]
        in_other_norm = [has_order(q, other, expected) for other in NORMS if other != norm]
        same_in_all_norms = np.all([has_order(q, other, judged.order) for other in NORMS], axis=0)
        kinds = [
            (_at_rest(q, others), SPECIAL_TIMES),
            (_in_theory(q, judged) & ~any_expected(positions), THEORY),
            (np.any(in_other_norm, axis=0), ONE_NORM),
            (any_expected(any_states), ONE_QUANTITY),
            (all_same() & same_in_all_norms, EVERYTHING),
        ]
        result = np.where(high, _first(kinds, shape), result)
    return result.astype(np.int8)


def _causes_unseen(
    q: Comparison, judged: Judgement, norm: str, order: Floats, tolerance: float
) -> Codes:
    """Return why no order is visible, as indices into `CAUSES`; arguments as for `causes`."""
    result = np.full(judged.reason.shape, NONE, dtype=np.int8)
    has = partial(is_one_of, judged.reason)
    lost, is_still, is_coarse = has("round_off"), has(*UNSEEN), has("pre_asymptotic")
    if q.differences and np.any(lost | is_still | is_coarse):
        e = facts_of(q, norm, order, tolerance)
        noisy = e.difference[..., -1] > ABOVE_ROUND_OFF * floor_of_pairs(e)[..., -1]
        result[lost & noisy] = NOISE
        if q.block.stored_floor[-1] > 0.0:
            result[lost] = STORED
        if q.is_motion:
            result[lost & (e.difference[..., -1] >= FAR * e.size)] = PARTED
            result[lost & (e.size <= ROUND_OFF_SAFETY * e.relative_floor * e.scale)] = ZERO
        result[is_still & at_rest(e)] = STILL
        result[is_coarse & unresolved(e) & (result == NONE)] = DECAY
    result[has(*ROUGH) & np.isfinite(q.block.missed.time)] = PULSE
    return result


def _first(kinds: list[tuple[Flags, int]], shape: tuple[int, ...]) -> Codes:
    """Return the first cause that applies, or `NONE`."""
    masks = [np.broadcast_to(mask, shape) for mask, _ in kinds]
    return np.asarray(np.select(masks, [code for _, code in kinds], NONE), dtype=np.int8)


def _at_rest(q: Comparison, others: Compared) -> Flags:
    """Say where the rate of change of a state vanishes at every common time, but not between them."""
    block, model = q.block, q.block.model
    name = ""
    if q.name in model.positions:
        name = model.velocities[model.positions.index(q.name)]
    elif q.name in model.velocities and model.linear and model.conservative:
        # u'' = -w^2 u
        name = model.positions[model.velocities.index(q.name)]
    if name not in others:
        return np.zeros(block.shape, dtype=bool)
    rate = others[name].exact
    if rate is None:
        rate = others[name].extrapolation[0]
    # gathered over all steps; NaN in data of other programs
    low, high = (
        stored_or_nan(block.finest, f"{name}_{end}", block.shape) for end in ("min", "max")
    )
    largest_rate = np.maximum(np.abs(low), np.abs(high))
    with np.errstate(invalid="ignore"):
        return np.asarray((largest_rate > 0) & (largest(rate) <= VANISHING_RATE * largest_rate))


def _in_theory(q: Comparison, judged: Judgement) -> Flags:
    """Say where frequency and growth in the theory of the scheme have the measured order, too."""
    block, theory = q.block, predicted_oscillation
    if not theory.is_simple(block) or len(block.grid.levels) < 2:
        return np.zeros(block.shape, dtype=bool)
    coarse, fine = block.grid.levels[-2:]
    # phase errors in units of 1/w, to be independent of the unit of time
    w = theory.natural_frequency(block)
    phases = [theory.phase_error(block, level) * w for level in (coarse, fine)]
    growths = [theory.growth_per_period(block, level) - 1.0 for level in (coarse, fine)]
    orders = []
    for values in (phases, growths):
        errors = np.abs(values)
        with np.errstate(divide="ignore", invalid="ignore"):
            fall = on_arrays.log2(safe_ratio(errors[0], errors[1])) / (fine - coarse)
        exact = np.all(errors <= THEORY_ROUNDING, axis=0)
        orders.append(np.where(exact, np.inf, fall))
    with np.errstate(invalid="ignore"):
        return np.asarray(np.abs(np.minimum(*orders) - judged.order) <= HALF_SPACING)
