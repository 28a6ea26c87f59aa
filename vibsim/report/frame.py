"""What belongs within the frame of a figure, and what leaves it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from vibsim.convergence.thresholds import ABOVE_ROUND_OFF
from vibsim.core.array_types import Flags, Floats
from vibsim.core.record import Record
from vibsim.core.vocabulary import MEMBER, OF_LEVEL, TYPICAL_NORM
from vibsim.report import data
from vibsim.report.data import Member, known
from vibsim.report.style import positive
from vibsim.report.types import Axes

UNBOUNDED = 1e6
"""What exceeds the size of the motion by this factor grows without bound, and gives no frame its range."""
BROKE_DOWN = "broke down"
GROWS = "grows without bound"
ROUND_OFF = "lost in round-off"
UNLIKE = "no longer proportional"
NO_VALUE = "no value"
LOOKS_ALIKE = 0.004  # curves that differ by less than this part of the frame's height look the same
LEAVING = "Triangles at an edge: values beyond the frame."  # for captions


def sizes(record: Record, quantity: str) -> Floats:
    """Return the size of a quantity in the motion of every member, shape (case,); NaN where nothing tells it.

    It is that of the exact solution, else the smallest that any scheme gives on any level: the others may have grown.
    """
    count = len(record["case"])
    if f"{quantity}_exact" in record and "t" in record:
        variable = record.variable(f"{quantity}_exact")
        others = tuple(i for i, dim in enumerate(variable.dims) if dim != "case")
        exact = np.max(np.abs(np.asarray(variable.values, dtype=np.float64)), axis=others)
        return positive(np.broadcast_to(exact, (count,)))
    if quantity.startswith("energy") and "energy_initial" in record:
        found = np.abs(known(record, "energy_initial", MEMBER))
    elif f"{quantity}_max" in record:
        ends = [np.abs(known(record, f"{quantity}_{end}", OF_LEVEL)) for end in ("min", "max")]
        found = np.swapaxes(np.maximum(*ends), 1, 2).reshape(-1, count)
    else:
        return np.full(count, np.nan)
    return positive(np.asarray(np.min(np.where(np.isfinite(found), found, np.inf), axis=0)))


def is_bounded(values: Floats, size: Floats) -> Flags:
    """Say of every value whether it is finite and, where the size of the motion is known, not far beyond it."""
    with np.errstate(over="ignore"):
        return np.isfinite(values) & ~(np.abs(values) > UNBOUNDED * size)


def why_lost(
    record: Record, quantity: str, member: Member, levels: list[int], values: Floats
) -> str:
    """Say why values of some positions of levels mean nothing: round-off only where they are near its floor."""
    status = np.asarray(data.pick(record, "status", scheme=member.scheme, case=member.case))
    if np.any(status[levels] != 0):
        return BROKE_DOWN
    size = float(sizes(record, quantity)[member.case])
    if math.isfinite(size) and data.largest(values) > UNBOUNDED * size:
        return GROWS
    pairs = [i for i in levels if i < len(data.whole(record, "pair"))]
    if not pairs:
        return NO_VALUE
    name = f"{quantity}_difference_norm"
    difference = float(data.at(record, name, member, norm=data.norm_index(record))[pairs[-1]])
    floor = data.floor_norm(record, quantity, member, TYPICAL_NORM)
    if math.isnan(difference):
        return NO_VALUE
    return ROUND_OFF if difference <= ABOVE_ROUND_OFF * data.largest(floor[levels]) else UNLIKE


def mark_leaving(ax: Axes, x: Floats, y: Floats, *, each: bool = False, **look: Any) -> bool:
    """Mark at the edges where values leave the frame (or, of points, each that is beyond); say whether any does."""
    low, high = ax.get_ylim()
    found = False
    for border, edge, marker in ((high, 1.0, "^"), (low, 0.0, "v")):
        beyond = y > border if edge else y < border
        there = beyond if each else beyond & ~np.concatenate([[False], beyond[:-1]])
        place = np.flatnonzero(there)
        if place.size:
            found = True
            across = [x[i] if each else _crossing(ax, x, y, i, border) for i in place.tolist()]
            mark: Any = {"linestyle": "none", "marker": marker, "markersize": 5, "zorder": 6}
            where: Any = {"transform": ax.get_xaxis_transform(), "clip_on": False}
            ax.plot(across, np.full(place.size, edge), **where, **mark, **look)
    return found


def _crossing(ax: Axes, x: Floats, y: Floats, i: int, border: float) -> float:
    """Return where the line to the i-th point leaves the frame, straight on the scales of the axes."""
    if i == 0 or not np.isfinite([y[i - 1], y[i]]).all():
        return float(x[i])
    turn = ax.transScale
    (x0, y0), (x1, y1) = turn.transform([(x[i - 1], y[i - 1]), (x[i], y[i])])
    level = turn.transform((float(x[i]), border))[1]
    share = (level - y0) / (y1 - y0) if y1 != y0 else 1.0
    return float(turn.inverted().transform((x0 + share * (x1 - x0), y1))[0])


def same_as(curves: list[Floats], height: float) -> list[int | None]:
    """Return for every curve the first earlier one that it cannot be told from in a frame of that height."""
    found: list[int | None] = []

    def is_alike(a: Floats, b: Floats) -> bool:
        if a.shape != b.shape:
            return False
        in_a, in_b = np.isfinite(a), np.isfinite(b)
        both = in_a & in_b
        if both.sum() < 2 or 2 * both.sum() < max(in_a.sum(), in_b.sum()):
            return False
        return bool(np.max(np.abs(a[both] - b[both])) <= LOOKS_ALIKE * height)

    for i, curve in enumerate(curves):
        firsts = (j for j in range(i) if found[j] is None and is_alike(curve, curves[j]))
        found.append(next(firsts, None))
    return found
