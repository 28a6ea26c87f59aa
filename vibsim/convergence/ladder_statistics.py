"""The numbers of ladders that a verdict rests on, and what they say before any order is read.

Leading dimensions ``...`` are ladders (scheme, case); n is the number of levels.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from vibsim.convergence.differences import safe_ratio
from vibsim.convergence.thresholds import (
    ABOVE_ROUND_OFF,
    BLOWN_UP,
    EXACT_ACCURACY,
    EXACT_DIFFERENCE,
    MEASUREMENT_FACTOR,
    ORDINARY_ORDER,
    RESOLVED_DECAY,
    VISIBLE_ERROR,
)
from vibsim.core.array_types import Flags, Floats, Integers
from vibsim.core.vocabulary import TOLERANCE


@dataclass(frozen=True)
class Evidence:
    """The numbers of ladders that a verdict rests on."""

    levels: tuple[int, ...]
    """The n levels, strictly increasing."""
    difference: Floats
    """Norms of the differences, shape (..., n-1)."""
    scatter: Floats
    """Signed scatter of the triples in the same norm (`differences.scatter`), shape (..., n-2)."""
    floor: Floats
    """Predicted round-off at every level in the same norm, shape (..., n)."""
    order: Floats
    """The order p that is expected, infinite for what is to be exact, shape (...)."""
    omega_dt: Floats
    """w dt, shape (..., n)."""
    size: Floats
    """Norm of the solution, shape (...)."""
    relative_floor: Floats
    """Predicted round-off relative to the solution at the coarsest level, shape (...)."""
    tolerance: float = TOLERANCE
    """How far from p an order may be."""
    error: Floats | None = None
    """Norms of the true errors, shape (..., n); NaN where the exact solution is not known."""
    failed: Flags | None = None
    """Whether a member broke down, shape (..., n)."""
    applicable: Flags | None = None
    """Whether the quantity exists, shape (...)."""
    stability_limit: Floats | None = None
    """Largest stable w dt, infinite where there is no limit, shape (...)."""
    span: Floats | None = None
    """w T, the length of the run in units of the inverse frequency, shape (...); None counts as long."""
    steps: float = math.nan
    """Number of steps at the coarsest level."""
    moved: Floats | None = None
    """By which part of its size the solution changes behind the start, shape (...); NaN of one that vanishes."""
    straight: Flags | None = None
    """Whether it changes along a straight line there, as what creeps does, whatever its frequency, shape (...)."""
    left_to_the_mesh: Floats | None = None
    """The one power of an error that has no expansion beyond it, since events or corners of the force are left to the
    mesh, shape (...); NaN where the error has an expansion."""
    corner: Floats | None = None
    """The highest power of an error that stays regular where a step has a corner of the force inside, shape (...); NaN
    where none has."""
    missed: Flags | None = None
    """Whether the force has a pulse that no level sees, shape (...)."""
    jumps: Flags | None = None
    """Whether it jumps there, shape (...)."""
    decay: Floats | None = None
    """The largest rate at which damping takes a velocity away, times the step of the finest level, shape (...)."""
    growth: Floats | None = None
    """Largest position over the largest exact position, shape (..., n); NaN where not known."""
    ceiling: Floats | None = None
    """The most that round-off can be in any arithmetic, at every level in the same norm, shape (..., n)."""
    numbers: Flags | None = None
    """Whether the series are single numbers: no more than two points count, shape (...)."""
    promised: Floats | None = None
    """The order that the scheme promises, infinite or NaN where it promises none, shape (...); None for the expected
    one."""
    special: Floats | None = None
    """The highest order that the scheme has in a special case; None for none but the promised one, shape (...)."""
    combined: Callable[[Flags, int, Floats], Floats] | None = None
    """Norms of weighted sums of differences: of ladders, from a pair on, with weights; None without series."""
    error_scatter: Floats | None = None
    """Signed scatter of the errors of successive levels, shape (..., n-1), of three levels; NaN where not known."""
    blur: Floats | None = None
    """How well the quantity itself is measured at every level, rounding apart, in the same norm, shape (..., n)."""


def breakdown(e: Evidence, shape: tuple[int, ...]) -> tuple[Flags, Flags, Flags]:
    """Say of every level whether it broke down or is beyond the limit, and of every ladder whether it grows."""
    none = np.zeros((*shape, len(e.levels)), dtype=bool)
    broken = none if e.failed is None else none | e.failed
    beyond = none
    if e.stability_limit is not None:
        # at the limit itself a scheme may still be stable, and w dt carries rounding
        beyond = none | (e.omega_dt > e.stability_limit[..., None] * (1 + 1e-9))
    if e.growth is None:
        return broken, beyond, np.zeros(shape, dtype=bool)
    last = e.growth[..., -1]
    before = e.growth[..., -2] if len(e.levels) > 1 else last
    growing = (last > BLOWN_UP) & ~(last < 0.5 * before)
    # long steps go on with a velocity that has gone, and with its rounding: as far as that on every level
    growing &= ~(unresolved(e) & (last <= BLOWN_UP * before))
    if e.missed is not None:
        # levels that see a pulse differ from those that do not
        growing &= ~e.missed
    if e.corner is not None:
        # a step that sees a jump at all sees it for its whole length
        growing &= ~((e.corner == 1.0) & (before <= BLOWN_UP))
    return broken, beyond, growing


def error_orders(e: Evidence) -> Floats:
    """Return the order of the true errors of every pair, shape (..., n-1); NaN where they are not known."""
    if e.error is None:
        return np.full(e.difference.shape, np.nan)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(
            np.log2(safe_ratio(e.error[..., :-1], e.error[..., 1:])) / np.diff(np.array(e.levels))
        )


def floor_of_pairs(e: Evidence) -> Floats:
    """Return the predicted round-off of the differences, shape (..., n-1)."""
    return np.asarray(e.floor[..., :-1] + e.floor[..., 1:])


def at_round_off(e: Evidence) -> Flags:
    """Say where all differences may be round-off."""
    return np.asarray(np.all(e.difference <= ABOVE_ROUND_OFF * floor_of_pairs(e), axis=-1))


def truly_exact(e: Evidence) -> Flags:
    """Say where all differences are round-off although an ordinary error would have been seen."""
    return np.asarray(_agrees(e) & _would_show(e, _motion(e)))


def at_rest(e: Evidence) -> Flags:
    """Say where all differences are round-off and nothing moves by so much that an error of a scheme would show."""
    moved = _motion(e)
    hidden = _would_show(e, np.ones(moved.shape)) & ~_would_show(e, moved)
    return np.asarray(at_round_off(e) & (hidden | (moved == 0.0)))


def _motion(e: Evidence) -> Floats:
    """Return by which part of its size a solution moves, at most 1, shape (...)."""
    if e.moved is None:
        return np.ones(e.order.shape)
    return np.asarray(np.minimum(np.nan_to_num(e.moved, nan=0.0), 1.0))


def _agrees(e: Evidence) -> Flags:
    """Say where the differences are round-off, and tiny beside the solution."""
    blur = _blur(e)
    of_pairs = MEASUREMENT_FACTOR * (blur[..., :-1] + blur[..., 1:])
    tiny = np.all(e.difference <= EXACT_DIFFERENCE * e.size[..., None] + of_pairs, axis=-1)
    return np.asarray(at_round_off(e) & tiny)


def _would_show(e: Evidence, moved: Floats) -> Flags:
    """Say where an ordinary error of a solution that moves by so much of its size would have been seen."""
    # what a short run has accumulated is smaller by (w T)^2
    power = np.where(np.isinf(e.order), ORDINARY_ORDER, e.order)
    if e.promised is not None:
        # what a scheme of higher order leaves is smaller than an error of the order that is asked for
        power = np.where(np.isinf(e.promised), power, np.fmax(power, e.promised))
    p = e.omega_dt[..., 0]
    oscillates = np.isfinite(p) & (p > 0.0)
    # without oscillations the run itself is the time in which something happens
    rate = np.minimum(np.where(oscillates, p, 1.0 / e.steps), 1.0)
    if e.straight is not None:
        # what creeps does so at a rate of its own
        rate = rate * np.where(e.straight, moved, 1.0)
    share = moved
    if e.span is not None:
        short = np.where(oscillates, np.minimum(e.span, 1.0) ** 2, 1.0)
        share = np.minimum(moved, short)
    ordinary = share * rate**power
    # of what grew without bound nothing is said
    with np.errstate(invalid="ignore"):
        visible = ordinary * e.size >= VISIBLE_ERROR * _blur(e)[..., 0]
    return np.asarray((ordinary >= VISIBLE_ERROR * ABOVE_ROUND_OFF * e.relative_floor) & visible)


def _blur(e: Evidence) -> Floats:
    """Return how well a quantity itself is measured, shape (..., n)."""
    return np.zeros((*e.order.shape, len(e.levels))) if e.blur is None else e.blur


def unresolved(e: Evidence) -> Flags:
    """Say where a velocity is gone within one step of the finest level, so that no level shows how."""
    if e.decay is None:
        return np.zeros(e.order.shape, dtype=bool)
    return np.asarray(e.decay > RESOLVED_DECAY)


def accuracy(e: Evidence) -> Floats:
    """Return how well the finest error is known, shape (...)."""
    return np.asarray(ABOVE_ROUND_OFF * e.floor[..., -1] + EXACT_ACCURACY * e.size)


def far_from_exact(e: Evidence) -> Flags:
    """Say where the finest level is further from the exact solution than that is known."""
    if e.error is None:
        return np.zeros(e.order.shape, dtype=bool)
    return np.asarray(np.nan_to_num(e.error[..., -1], nan=0.0) > accuracy(e))


def pick(values: Floats, index: Integers) -> Floats:
    """Return one entry of the last axis for each ladder; the first one for a negative index."""
    return np.take_along_axis(values, np.maximum(index, 0)[..., None], axis=-1)[..., 0]
