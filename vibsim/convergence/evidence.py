"""The numbers of ladders that a verdict rests on, and what they say before any order is read.

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
class Evidence:
    """The numbers of ladders; of shape (...) where no other is given. Norms are all of one kind."""

    levels: tuple[int, ...]  # the n levels, strictly increasing
    order: Floats  # the order p that is expected, infinite for what is to be exact
    tolerance: float  # how far from p an order may be
    difference: Floats  # norms of the differences, shape (..., n-1)
    # cosines of the angles between the differences, and the finest level less the exact solution; shape (..., n, n)
    cosines: Floats
    floor: Floats  # predicted round-off at every level, shape (..., n)
    ceiling: Floats  # the most that round-off can be at the finest level in any arithmetic
    relative_floor: Floats  # predicted round-off over the solution at the coarsest level
    size: Floats  # norm of the solution
    scale: Floats  # the same of the whole that a quantity is a part of, such as the energy
    error: Floats  # norm of the true error of the finest level; NaN where it is not known
    blur: Floats  # how well the quantity is measured at every level, rounding apart, shape (..., n)
    promised: Floats  # the order of the scheme, infinite or NaN where it promises none
    special: Floats  # the highest order of the scheme in a special case
    combined: Callable[[Flags, int, Floats], Floats]  # norms of weighted sums of differences
    numbers: Flags  # whether the series are single numbers: no more than two points count
    failed: Flags  # whether a member broke down, shape (..., n)
    applicable: Flags  # whether the quantity exists
    omega_dt: Floats  # w dt, shape (..., n)
    stability_limit: Floats  # largest stable w dt, infinite for none
    span: Floats  # w T, the length of the run in units of the inverse frequency
    steps: float  # number of steps at the coarsest level
    moved: Floats  # which part of its size the solution changes by behind the start; NaN if it is 0
    straight: Flags  # whether along a straight line, as what creeps does, whatever its frequency
    # the one power of an error without an expansion, where events or corners of the force are left to the mesh, or NaN
    left_to_the_mesh: Floats
    corner: Floats  # the highest power that a corner of the force within a step leaves; else NaN
    near_a_point: Flags  # whether that lies within a step of the finest level beside a point that all levels share
    missed: Flags  # whether the force has a pulse, or a corner in the last step, that no level sees
    jumps: Flags  # whether it jumps there
    decay: Floats  # the largest rate at which damping takes a velocity away, times the finest step
    growth: Floats  # largest position over the largest exact one, shape (..., n); NaN if not known


def beside_each_other(rows: Sequence[Evidence]) -> Evidence:
    """Return several sets of ladders as one, along a new first axis.

    They have the same shape, levels and tolerance. No number depends on it: every ladder stands for itself.
    """
    first = rows[0]

    def combined(which: Flags, pair: int, weights: Floats) -> Floats:
        chosen = zip(rows, which, strict=True)
        found = [e.combined(part, pair, weights) for e, part in chosen if np.any(part)]
        return np.concatenate(found) if found else np.empty(0)

    together: dict[str, Any] = {
        one.name: np.stack([getattr(row, one.name) for row in rows])
        for one in fields(first)
        if isinstance(getattr(first, one.name), np.ndarray)
    }
    return replace(first, **together, combined=combined)


def breakdown(e: Evidence) -> tuple[Flags, Flags, Flags]:
    """Say of every level whether it broke down or is beyond the limit, and of every ladder whether it grows."""
    # at the limit itself a scheme may still be stable, and w dt carries rounding
    beyond = e.omega_dt > e.stability_limit[..., None] * (1.0 + th.LIMIT_ROUNDING)
    last, before = e.growth[..., -1], e.growth[..., -2:][..., 0]
    growing = (last > th.BLOWN_UP) & ~(last < 0.5 * before)
    # long steps go on with a velocity that has gone, and with its rounding: as far as that on every level
    growing &= ~(unresolved(e) & (last <= th.BLOWN_UP * before))
    # levels that see a pulse differ from those that do not; a step that sees a jump sees it for its whole length
    growing &= ~e.missed & ~((e.corner == 1.0) & (before <= th.BLOWN_UP))
    return e.failed, beyond, growing


def floor_of_pairs(e: Evidence) -> Floats:
    """Return the predicted round-off of the differences, shape (..., n-1)."""
    return np.asarray(e.floor[..., :-1] + e.floor[..., 1:])


def at_round_off(e: Evidence) -> Flags:
    """Say where all differences may be round-off."""
    return np.asarray(np.all(e.difference <= th.ABOVE_ROUND_OFF * floor_of_pairs(e), axis=-1))


def is_noise(e: Evidence) -> Flags:
    """Say where the finest differences may be noise: round-off of the predicted size, or what does not fall."""
    last, before = e.difference[..., -1], e.difference[..., -2:][..., 0]
    small = last <= th.ABOVE_ROUND_OFF * floor_of_pairs(e)[..., -1]
    return np.asarray(small | ((last > th.FLOOR_DECLINE * before) & (last <= e.ceiling)))


def errors_stay(e: Evidence) -> Flags:
    """Say where the error of the finest level is hardly smaller than that of the coarsest one.

    Errors that one step may make stay where an event or a corner lies beside a point that all levels share.
    """
    sizes = np.concatenate([e.difference, e.error[..., None]], axis=-1)
    # the error of the coarsest level is the sum of all rows
    with np.errstate(over="ignore", invalid="ignore"):
        square = np.sum(e.cosines * sizes[..., :, None] * sizes[..., None, :], axis=(-2, -1))
        steps = e.steps * 2.0 ** (e.levels[-1] - e.levels[0])
        step = np.where(np.isfinite(e.omega_dt[..., -1]), e.omega_dt[..., -1], 1.0 / steps)
        beside_a_point = e.size * on_arrays.power(step, np.fmin(e.corner, e.left_to_the_mesh))
        stays = e.error > th.ERROR_STAYED * np.sqrt(square)
        return np.asarray(stays & ~(e.error <= beside_a_point))


def truly_exact(e: Evidence) -> Flags:
    """Say where all differences are round-off, tiny beside the solution, although an ordinary error would be seen."""
    of_pairs = th.MEASUREMENT_FACTOR * (e.blur[..., :-1] + e.blur[..., 1:])
    tiny = np.all(e.difference <= th.EXACT_DIFFERENCE * e.size[..., None] + of_pairs, axis=-1)
    return np.asarray(at_round_off(e) & tiny & _would_show(e, _motion(e)))


def at_rest(e: Evidence) -> Flags:
    """Say where all differences are round-off and nothing moves by so much that an error of a scheme would show."""
    moved = _motion(e)
    hidden = _would_show(e, np.ones(moved.shape)) & ~_would_show(e, moved)
    return np.asarray(at_round_off(e) & (hidden | (moved == 0.0)))


def _motion(e: Evidence) -> Floats:
    return np.asarray(np.minimum(np.nan_to_num(e.moved, nan=0.0), 1.0))


def _would_show(e: Evidence, moved: Floats) -> Flags:
    """Say where an ordinary error of a solution that moves by so much of its size would have been seen."""
    power = np.where(np.isinf(e.order), th.ORDINARY_ORDER, e.order)
    # what a scheme of higher order leaves is smaller than an error of the order that is asked for
    power = np.where(np.isinf(e.promised), power, np.fmax(power, e.promised))
    p = e.omega_dt[..., 0]
    oscillates = np.isfinite(p) & (p > 0.0)
    # without oscillations the run itself is the time in which something happens
    rate = np.minimum(np.where(oscillates, p, 1.0 / e.steps), 1.0)
    # what creeps does so at a rate of its own
    rate = rate * np.where(e.straight, moved, 1.0)
    # what a short run has accumulated is smaller by (w T)^2
    short = np.where(oscillates, np.minimum(e.span, 1.0) ** 2, 1.0)
    ordinary = np.minimum(moved, short) * on_arrays.power(rate, power)
    # of what grew without bound nothing is said
    with np.errstate(invalid="ignore"):
        visible = ordinary * e.size >= th.VISIBLE_ERROR * e.blur[..., 0]
    is_large = ordinary >= th.VISIBLE_ERROR * th.ABOVE_ROUND_OFF * e.relative_floor
    return np.asarray(is_large & visible)


def unresolved(e: Evidence) -> Flags:
    """Say where a velocity is gone within one step of the finest level, so that no level shows how."""
    return np.asarray(e.decay > th.RESOLVED_DECAY)


def far_from_exact(e: Evidence) -> Flags:
    """Say where the finest level is further from the exact solution than that is known."""
    known_to = th.ABOVE_ROUND_OFF * e.floor[..., -1] + th.EXACT_ACCURACY * e.size
    return np.asarray(np.nan_to_num(e.error, nan=0.0) > known_to)


def pick(values: Floats, index: Integers) -> Floats:
    """Return one entry of the last axis for each ladder; the first one for a negative index."""
    return np.take_along_axis(values, np.maximum(index, 0)[..., None], axis=-1)[..., 0]
