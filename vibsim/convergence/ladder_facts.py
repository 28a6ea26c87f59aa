"""The facts about a ladder that a verdict rests on, and what they show before any order is measured.

Leading dimensions ``...`` are ladders (scheme, case); n is the number of levels.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from vibsim.convergence import thresholds as th
from vibsim.core.array_types import Flags, Floats, Integers
from vibsim.elementary import on_arrays


@dataclass(frozen=True)
class LadderFacts:
    """Facts about ladders, of shape (...) unless another shape is given. All norms are of one kind."""

    levels: tuple[int, ...]  # the n levels, strictly increasing
    expected: Floats  # expected order; infinite if exactness is expected
    tolerance: float  # largest distance of an order from the expected one
    difference: Floats  # norms of the differences, shape (..., n-1)
    # cosines of the angles between the differences, and the finest level minus the exact solution; shape (..., n, n)
    cosines: Floats
    floor: Floats  # predicted round-off of each level, shape (..., n)
    ceiling: Floats  # upper bound of round-off at the finest level, in any arithmetic
    relative_floor: Floats  # predicted round-off at the coarsest level, relative to the solution
    size: Floats  # norm of the solution
    scale: Floats  # norm of the whole that the quantity is a part of, such as the energy
    error: Floats  # norm of the true error of the finest level; NaN if unknown
    blur: Floats  # measurement error of each level, without rounding, shape (..., n)
    # Order that the scheme promises, or a lower one that theory finds; infinite for exactness, NaN for none.
    promised: Floats
    special: Floats  # highest order of the scheme in a special case
    combined: Callable[[Flags, int, Floats], Floats]  # norms of weighted sums of differences
    numbers: Flags  # whether the series are single numbers, of at most two points
    failed: Flags  # whether a member broke down, shape (..., n)
    applicable: Flags  # whether the quantity exists
    omega_dt: Floats  # w dt, shape (..., n)
    stability_limit: Floats  # largest stable w dt, infinite for none
    span: Floats  # w T, the length of the run in units of the inverse frequency
    steps: float  # number of steps at the coarsest level
    moved: Floats  # relative change of the solution after the start; NaN if its size is 0
    straight: Flags  # whether it moves along a straight line, as creep does
    # the only power of an error without an expansion, if events or corners of the force lie between grid points; or NaN
    left_to_the_mesh: Floats
    corner: Floats  # highest power that a corner of the force within a step leaves, or NaN
    near_a_point: Flags  # whether that corner lies within a finest step of a point of all levels
    unseen: Flags  # whether the force has a pulse, or a corner in the last step, that no level sees
    jumps: Flags  # whether the force jumps there
    decay: Floats  # largest decay rate of a velocity times the finest step
    growth: Floats  # largest position over the largest exact one, shape (..., n); NaN if unknown


def stacked(rows: Sequence[LadderFacts]) -> LadderFacts:
    """Stack sets of ladders with the same shape, levels and tolerance along a new first axis.

    No number depends on it: each ladder is judged independently.
    """
    template = rows[0]

    def combined(subsets: Flags, pair: int, weights: Floats) -> Floats:
        pairs = zip(rows, subsets, strict=True)
        norms = [e.combined(subset, pair, weights) for e, subset in pairs if np.any(subset)]
        return np.concatenate(norms) if norms else np.empty(0)

    arrays: dict[str, Any] = {
        field.name: np.stack([getattr(row, field.name) for row in rows])
        for field in fields(template)
        if isinstance(getattr(template, field.name), np.ndarray)
    }
    return replace(template, **arrays, combined=combined)


def breakdown(e: LadderFacts) -> tuple[Flags, Flags, Flags]:
    """Return which levels broke down, which exceed the stability limit, and which ladders grow without bound."""
    # a scheme may be stable at the limit itself, and w dt is rounded
    beyond = e.omega_dt > e.stability_limit[..., None] * (1.0 + th.LIMIT_ROUNDING)
    last, previous = e.growth[..., -1], e.growth[..., -2:][..., 0]
    growing = (last > th.BLOWN_UP) & ~(last < th.GROWTH_REMOVED * previous)
    # long steps keep a velocity that has decayed, and its rounding: then every level moves as far
    growing &= ~(unresolved(e) & (last <= th.BLOWN_UP * previous))
    # some levels may see a pulse that others miss; a step that sees a jump applies it over its whole length
    growing &= ~e.unseen & ~((e.corner == 1.0) & (previous <= th.BLOWN_UP))
    return e.failed, beyond, growing


def floor_of_pairs(e: LadderFacts) -> Floats:
    """Return the predicted round-off of each difference, shape (..., n-1)."""
    return np.asarray(e.floor[..., :-1] + e.floor[..., 1:])


def at_round_off(e: LadderFacts) -> Flags:
    """Say where all differences may be round-off."""
    return np.asarray(np.all(e.difference <= th.ABOVE_ROUND_OFF * floor_of_pairs(e), axis=-1))


def is_noise(e: LadderFacts) -> Flags:
    """Say where the finest differences may be noise: near the predicted round-off, or not falling below the ceiling."""
    last, previous = e.difference[..., -1], e.difference[..., -2:][..., 0]
    small = last <= th.ABOVE_ROUND_OFF * floor_of_pairs(e)[..., -1]
    return np.asarray(small | ((last > th.FLOOR_DECLINE * previous) & (last <= e.ceiling)))


def errors_stay(e: LadderFacts) -> Flags:
    """Say where the error of the finest level is hardly smaller than that of the coarsest one.

    Errors that a single step can make do not count: they stay if an event or a corner is next to a point of all levels.
    """
    sizes = np.concatenate([e.difference, e.error[..., None]], axis=-1)
    # the error of the coarsest level is the sum of all differences and of the error of the finest level
    with np.errstate(over="ignore", invalid="ignore"):
        square = np.sum(e.cosines * sizes[..., :, None] * sizes[..., None, :], axis=(-2, -1))
        steps = e.steps * 2.0 ** (e.levels[-1] - e.levels[0])
        step = np.where(np.isfinite(e.omega_dt[..., -1]), e.omega_dt[..., -1], 1.0 / steps)
        one_step_error = e.size * on_arrays.power(step, np.fmin(e.corner, e.left_to_the_mesh))
        stays = e.error > th.ERROR_STAYED * np.sqrt(square)
        return np.asarray(stays & ~(e.error <= one_step_error))


def truly_exact(e: LadderFacts) -> Flags:
    """Say where all differences are round-off and tiny, although an ordinary error would be visible."""
    measurement = th.MEASUREMENT_FACTOR * (e.blur[..., :-1] + e.blur[..., 1:])
    tiny = np.all(e.difference <= th.EXACT_DIFFERENCE * e.size[..., None] + measurement, axis=-1)
    return np.asarray(at_round_off(e) & tiny & _would_show(e, _motion(e)))


def at_rest(e: LadderFacts) -> Flags:
    """Say where all differences are round-off, and the solution moves too little for an error to be visible."""
    moved = _motion(e)
    hidden = (moved < th.STILL) & _would_show(e, np.ones(moved.shape)) & ~_would_show(e, moved)
    return np.asarray(at_round_off(e) & (hidden | (moved == 0.0)))


def _motion(e: LadderFacts) -> Floats:
    return np.asarray(np.minimum(np.nan_to_num(e.moved, nan=0.0), 1.0))


def _would_show(e: LadderFacts, moved: Floats) -> Flags:
    """Say where an ordinary error would be visible if the solution changes by `moved`, relative to its size."""
    exponent = np.where(np.isinf(e.expected), th.ORDINARY_ORDER, e.expected)
    # a scheme of higher order than expected has smaller errors
    exponent = np.where(np.isinf(e.promised), exponent, np.fmax(exponent, e.promised))
    w_dt = e.omega_dt[..., 0]
    oscillates = np.isfinite(w_dt) & (w_dt > 0.0)
    # without oscillations the time scale is the length of the run
    rate = np.minimum(np.where(oscillates, w_dt, 1.0 / e.steps), 1.0)
    # creep has a rate of its own
    rate = rate * np.where(e.straight, moved, 1.0)
    # a short run accumulates less by (w T)^2
    short = np.where(oscillates, np.minimum(e.span, 1.0) ** 2, 1.0)
    ordinary = np.minimum(moved, short) * on_arrays.power(rate, exponent)
    # sizes that grew without bound are infinite
    with np.errstate(invalid="ignore"):
        visible = ordinary * e.size >= th.VISIBLE_ERROR * e.blur[..., 0]
    is_large = ordinary >= th.VISIBLE_ERROR * th.ABOVE_ROUND_OFF * e.relative_floor
    return np.asarray(is_large & visible)


def unresolved(e: LadderFacts) -> Flags:
    """Say where a velocity decays within one step of the finest level, so that no level resolves it."""
    return np.asarray(e.decay > th.RESOLVED_DECAY)


def far_from_exact(e: LadderFacts) -> Flags:
    """Say where the finest level differs from the exact solution by more than the accuracy of both."""
    accuracy = th.ABOVE_ROUND_OFF * e.floor[..., -1] + th.EXACT_ACCURACY * e.size
    return np.asarray(np.nan_to_num(e.error, nan=0.0) > accuracy)


def pick(values: Floats, index: Integers) -> Floats:
    """Return one entry of the last axis for each ladder; negative indices count as 0."""
    return np.take_along_axis(values, np.maximum(index, 0)[..., None], axis=-1)[..., 0]
