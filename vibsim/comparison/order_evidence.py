"""From a comparison of levels to the numbers that a verdict rests on, and the verdict, for one norm."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from vibsim.apriori.roundoff_floor import SPACING_AT_ONE, norm_of_floor
from vibsim.comparison.quantity_comparison import Comparison
from vibsim.comparison.thresholds import STRAIGHT
from vibsim.convergence.differences import largest
from vibsim.convergence.ladder_statistics import Evidence
from vibsim.convergence.verdict import Judgement, judge
from vibsim.core.array_types import Flags, Floats
from vibsim.core.vocabulary import TOLERANCE
from vibsim.models import ENERGIES
from vibsim.models.shared.phase_amplitude_names import is_error_part
from vibsim.observe.member_block import plain_name

if TYPE_CHECKING:
    from vibsim.experiment.schema.checks import ConvergesCheck


def judgement(q: Comparison, norm: str) -> Judgement:
    """Judge a quantity by the order that its scheme promises."""
    key = norm, "scheme", TOLERANCE
    if key not in q.judged:
        q.judged[key] = judge(evidence(q, norm, q.order, TOLERANCE))
    return q.judged[key]


def judge_check(q: Comparison, check: ConvergesCheck) -> Judgement:
    """Judge a quantity as a check asks for it."""
    if check.order == "scheme" and check.tolerance == TOLERANCE:
        return judgement(q, check.norm)
    return judge(evidence(q, check.norm, order_of(q, check), check.tolerance))


def order_of(q: Comparison, check: ConvergesCheck) -> Floats:
    """Return the order that a check expects of a quantity, which broadcasts against (scheme, case)."""
    return q.order if check.order == "scheme" else np.full((1, 1), float(check.order))


def evidence(q: Comparison, norm: str, order: Floats, tolerance: float) -> Evidence:
    """Collect the evidence on a quantity in a norm.

    Parameters
    ----------
    q
        The quantity, compared between levels.
    norm
        One of `vocabulary.NORMS`.
    order
        The order that is expected, shape (scheme, 1 or case).
    tolerance
        How far from it an order may be.

    Returns
    -------
    Evidence
        Arrays of shape (scheme, case, ...).
    """
    block, measured = q.block, q.in_norm(norm)
    grid, shape = block.grid, block.shape
    points = len(grid.t)
    size, exists = _size(q.values[-1])
    if plain_name(q.name) in ENERGIES or is_error_part(q.name):
        # what is left of an energy is known no better than the energy, and a part of an error no better than the motion
        size = q.scale

    def in_norm(noise: Floats) -> Floats:
        return norm_of_floor(noise, norm, points, grid.spacing)

    def by_level(noise: Floats) -> Floats:
        return np.moveaxis(in_norm(np.moveaxis(noise, -1, 0)), 0, -1)

    def all_cases(values: Floats) -> Floats:
        return np.broadcast_to(values, shape)

    moved, straight = _motion(q, order, size)
    steps = np.array(grid.steps, dtype=np.float64)
    worst = SPACING_AT_ONE * steps**2 * (q.scale * block.magnified)[..., None]
    # where nothing oscillates, no order is promised of a part of an error
    promised = ~block.adaptive[:, None] & ~np.isnan(order)
    return Evidence(
        levels=grid.levels,
        order=all_cases(order),
        tolerance=tolerance,
        difference=measured.difference,
        scatter=measured.scatter,
        floor=by_level(q.floor),
        ceiling=by_level(np.maximum(worst, q.floor)),
        relative_floor=all_cases(block.relative_floor[..., 0]),
        size=in_norm(size),
        error=measured.error,
        error_scatter=measured.error_scatter,
        blur=by_level(q.blur),
        promised=all_cases(q.order),
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
        missed=np.broadcast_to(np.isfinite(block.missed.time), shape),
        jumps=np.broadcast_to(block.missed.jumps, shape),
        decay=block.decay * block.group.end / grid.steps[-1],
        growth=block.growth,
    )


def _motion(q: Comparison, order: Floats, size: Floats) -> tuple[Floats, Flags]:
    """Return by how much a quantity moves, and whether along a straight line, each of shape (scheme, case).

    What is promised to stay as it is, or is a part of an error, shows a scheme where the positions move.
    """
    moved, straight = _moved(q.values[-1], size)
    block = q.block
    whole = [name for name in block.model.positions if f"{name}_max" in block.finest]
    if not whole:
        return moved, straight
    ends = [[block.finest[f"{name}_{end}"] for end in ("min", "max")] for name in whole]
    with np.errstate(all="ignore"):
        of_states = [(high - low) / np.maximum(np.abs(low), np.abs(high)) for low, high in ends]
    exactly = np.broadcast_to(np.isinf(order) | is_error_part(q.name), block.shape)
    return np.where(exactly, np.fmax.reduce(of_states), moved), straight & ~exactly


def _moved(finest: Floats, size: Floats) -> tuple[Floats, Flags]:
    """Return by which part of its size a solution changes behind the start, and whether in a straight line.

    The start is the same on every level: what lies still at all other common times shows nothing of a scheme.
    """
    later = finest[..., 1:]
    with np.errstate(all="ignore"):
        change = np.asarray(np.max(later, axis=-1) - np.min(later, axis=-1))
        bend = np.max(np.abs(np.diff(later, 2, axis=-1)), axis=-1, initial=0.0)
        return change / size, np.asarray(bend <= STRAIGHT * change)


def _size(finest: Floats) -> tuple[Floats, Flags]:
    """Return the largest value of the finest level, and whether it has a finite one, shape (scheme, case)."""
    size = largest(finest)
    if np.all(np.isfinite(size)):
        return size, np.ones(size.shape, dtype=bool)
    return largest(np.nan_to_num(finest)), np.any(np.isfinite(finest), axis=-1)
