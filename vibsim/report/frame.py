"""Which values belong in the frame of a figure, and how those that leave it are marked."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from vibsim.convergence.thresholds import ABOVE_ROUND_OFF
from vibsim.core.array_types import Flags, Floats
from vibsim.core.vocabulary import MEMBER, OF_LEVEL, TYPICAL_NORM
from vibsim.report import data
from vibsim.report.data import Ladder, Results
from vibsim.report.style import positive
from vibsim.report.types import Axes

UNBOUNDED = 1e6
"""Values beyond this multiple of the size of the motion grow without bound; no axis is scaled to them."""
BROKE_DOWN = "broke down"
GROWS = "grows without bound"
ROUND_OFF = "lost in round-off"
UNLIKE = "no longer proportional"
NO_VALUE = "no value"
LOOKS_ALIKE = 0.004  # curves closer than this fraction of the frame's height look the same
LEAVING = "Triangles at an edge: values beyond the frame."  # for captions


def sizes(record: Results, quantity: str) -> Floats:
    """Return the size of a quantity in the motion of every member, shape (case,); NaN if unknown.

    It is the size of the exact solution, else the smallest over all schemes and levels: the others may have grown.
    """
    count = record.count
    if f"{quantity}_exact" in record and "t" in record:
        variable = record.variable(f"{quantity}_exact")
        others = tuple(i for i, dim in enumerate(variable.dims) if dim != "case")
        exact = np.max(np.abs(np.asarray(variable.values, dtype=np.float64)), axis=others)
        return positive(np.broadcast_to(exact, (count,)))
    if quantity.startswith("energy") and "energy_initial" in record:
        size = np.abs(record.optional("energy_initial", MEMBER))
    elif f"{quantity}_max" in record:
        ends = [np.abs(record.optional(f"{quantity}_{end}", OF_LEVEL)) for end in ("min", "max")]
        size = np.swapaxes(np.maximum(*ends), 1, 2).reshape(-1, count)
    else:
        return np.full(count, np.nan)
    return positive(np.asarray(np.min(np.where(np.isfinite(size), size, np.inf), axis=0)))


def is_bounded(values: Floats, size: Floats) -> Flags:
    """Return for every value whether it is finite and not far beyond the size of the motion, if that is known."""
    with np.errstate(over="ignore"):
        return np.isfinite(values) & ~(np.abs(values) > UNBOUNDED * size)


def why_lost(ladder: Ladder, levels: list[int], values: Floats) -> str:
    """Say why values that come from `levels` (positions) mean nothing; round-off only if they are near its floor."""
    status = np.asarray(ladder.record.pick("status", scheme=ladder.scheme, case=ladder.case))
    if np.any(status[levels] != 0):
        return BROKE_DOWN
    size = float(sizes(ladder.record, ladder.quantity)[ladder.case])
    if math.isfinite(size) and data.largest(values) > UNBOUNDED * size:
        return GROWS
    pairs = [i for i in levels if i < len(ladder.record.pairs)]
    if not pairs:
        return NO_VALUE
    difference = float(ladder.at("difference_norm")[pairs[-1]])
    floor = ladder.floor(TYPICAL_NORM)
    if math.isnan(difference):
        return NO_VALUE
    return ROUND_OFF if difference <= ABOVE_ROUND_OFF * data.largest(floor[levels]) else UNLIKE


def mark_leaving(ax: Axes, x: Floats, y: Floats, *, each: bool = False, **look: Any) -> bool:
    """Mark at the edges where a curve leaves the frame, or `each` point outside it; return whether there is any."""
    low, high = ax.get_ylim()
    leaves = False
    for border, edge, marker in ((high, 1.0, "^"), (low, 0.0, "v")):
        outside = y > border if edge else y < border
        is_marked = outside if each else outside & ~np.concatenate([[False], outside[:-1]])
        marked = np.flatnonzero(is_marked)
        if marked.size:
            leaves = True
            across = [x[i] if each else _crossing(ax, x, y, i, border) for i in marked.tolist()]
            mark: Any = {"linestyle": "none", "marker": marker, "markersize": 5, "zorder": 6}
            where: Any = {"transform": ax.get_xaxis_transform(), "clip_on": False}
            ax.plot(across, np.full(marked.size, edge), **where, **mark, **look)
    return leaves


def _crossing(ax: Axes, x: Floats, y: Floats, i: int, border: float) -> float:
    """Return where the segment to the i-th point, straight on the scales of the axes, leaves the frame."""
    if i == 0 or not np.isfinite([y[i - 1], y[i]]).all():
        return float(x[i])
    scale = ax.transScale
    (x0, y0), (x1, y1) = scale.transform([(x[i - 1], y[i - 1]), (x[i], y[i])])
    height = scale.transform((float(x[i]), border))[1]
    fraction = (height - y0) / (y1 - y0) if y1 != y0 else 1.0
    return float(scale.inverted().transform((x0 + fraction * (x1 - x0), y1))[0])


def same_as(curves: list[Floats], height: float) -> list[int | None]:
    """Return for every curve the first earlier one that looks the same in a frame of that height, or None."""
    same: list[int | None] = []

    def is_alike(a: Floats, b: Floats) -> bool:
        if a.shape != b.shape:
            return False
        in_a, in_b = np.isfinite(a), np.isfinite(b)
        both = in_a & in_b
        if both.sum() < 2 or 2 * both.sum() < max(in_a.sum(), in_b.sum()):
            return False
        return bool(np.max(np.abs(a[both] - b[both])) <= LOOKS_ALIKE * height)

    for i, curve in enumerate(curves):
        earlier = (j for j in range(i) if same[j] is None and is_alike(curve, curves[j]))
        same.append(next(earlier, None))
    return same
