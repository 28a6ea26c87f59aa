"""From a comparison of levels to the numbers that a verdict rests on, and the verdict, for one norm."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vibsim.analysis.compare import Comparison
from vibsim.analysis.facts import Evidence
from vibsim.analysis.floor import SPACING_AT_ONE, norm_of_floor
from vibsim.analysis.part import plain_name
from vibsim.analysis.series import largest
from vibsim.analysis.verdict import Judgement, judge
from vibsim.models import ENERGIES
from vibsim.models.error_parts import is_error_part
from vibsim.vocabulary import TOLERANCE

if TYPE_CHECKING:
    from vibsim.spec.checks import ConvergesCheck

Floats = NDArray[np.float64]


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
    part, measured = q.part, q.in_norm(norm)
    grid, shape = part.grid, part.shape
    points = len(grid.t)
    size, exists = _size(q.values[-1])
    if plain_name(q.name) in ENERGIES or is_error_part(q.name):
        # what is left of an energy is known no better than the energy, and a part of an error no better than the motion
        size = q.scale

    def in_norm(noise: Floats) -> Floats:
        return norm_of_floor(noise, norm, points, grid.spacing)

    def by_level(noise: Floats) -> Floats:
        return np.moveaxis(in_norm(np.moveaxis(noise, -1, 0)), 0, -1)

    steps = np.array(grid.steps, dtype=np.float64)
    worst = SPACING_AT_ONE * steps**2 * (q.scale * part.magnified)[..., None]
    return Evidence(
        levels=grid.levels,
        difference=measured.difference,
        scatter=measured.scatter,
        floor=by_level(q.floor),
        ceiling=by_level(np.maximum(worst, q.floor)),
        blur=None if q.blur is None else by_level(q.blur),
        order=np.broadcast_to(order, shape),
        promised=np.broadcast_to(q.order, shape),
        tolerance=tolerance,
        error=measured.error,
        error_scatter=measured.error_scatter,
        numbers=q.are_numbers,
        size=in_norm(size),
        failed=part.failed,
        # where nothing oscillates, no order is promised of a part of an error
        applicable=(exists | np.any(part.failed, axis=-1))
        & ~part.adaptive[:, None]
        & ~np.isnan(order),
        omega_dt=np.broadcast_to(part.fastest, (*shape, len(grid.levels))),
        stability_limit=np.broadcast_to(part.stability_limit, shape),
        growth=part.growth,
        left_to_the_mesh=np.broadcast_to(part.left_to_the_mesh, shape),
        corner=part.corners.power,
        steps=float(grid.steps[0]),
        moved=_moved(q.values[-1]),
        span=np.broadcast_to(part.omega_dt[:, 0] * float(grid.steps[0]), shape),
        relative_floor=np.broadcast_to(part.relative_floor[..., 0], shape),
    )


def _moved(finest: Floats) -> Floats:
    """Return by how much a solution changes behind the start relative to its size, shape (scheme, case).

    The start is the same on every level: what lies still at all other common times shows nothing of a scheme.
    """
    later = finest[..., 1:]
    with np.errstate(all="ignore"):
        return np.asarray((np.max(later, axis=-1) - np.min(later, axis=-1)) / largest(finest))


def _size(finest: Floats) -> tuple[Floats, NDArray[np.bool_]]:
    """Return the largest value of the finest level, and whether it has a finite one, shape (scheme, case)."""
    size = largest(finest)
    if np.all(np.isfinite(size)):
        return size, np.ones(size.shape, dtype=bool)
    return largest(np.nan_to_num(finest)), np.any(np.isfinite(finest), axis=-1)
