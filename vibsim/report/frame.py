"""What belongs within the frame of a figure, and what leaves it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vibsim.convergence.thresholds import ABOVE_ROUND_OFF
from vibsim.core.record import Record
from vibsim.core.vocabulary import TYPICAL_NORM
from vibsim.report.data import Floats, Member, at, floor_norm, known, largest, pick, whole

if TYPE_CHECKING:
    from matplotlib.axes import Axes

WILD = 1e6
"""What exceeds the size of the motion by this factor grows without bound, and gives no frame its range."""
BROKE_DOWN = "broke down"
GROWS = "grows without bound"
ROUND_OFF = "lost in round-off"
UNLIKE = "no longer proportional"
NO_VALUE = "no value"
ALIKE = 0.004
"""Curves that differ by less than this part of the frame's height look the same."""
LEAVING = "Triangles at an edge: values beyond the frame."
"""For captions."""


def sizes(record: Record, quantity: str) -> Floats:
    """Return the size of a quantity in the motion of every member, shape (case,); NaN where nothing tells it.

    It is that of the exact solution, else the smallest that any scheme gives on any level: the others may have grown.
    """
    count = len(record["case"])
    if f"{quantity}_exact" in record and "t" in record:
        variable = record.variable(f"{quantity}_exact")
        others = tuple(i for i, dim in enumerate(variable.dims) if dim != "case")
        exact = np.max(np.abs(np.asarray(variable.values, dtype=np.float64)), axis=others)
        return _positive(np.broadcast_to(exact, (count,)))
    if quantity.startswith("energy") and "energy_initial" in record:
        return _positive(_smallest(np.abs(known(record, "energy_initial", ("scheme", "case")))))
    if f"{quantity}_max" in record:
        dims = ("scheme", "case", "level")
        ends = [np.abs(known(record, f"{quantity}_{end}", dims)) for end in ("min", "max")]
        return _positive(_smallest(np.swapaxes(np.maximum(*ends), 1, 2).reshape(-1, count)))
    return np.full(count, np.nan)


def _smallest(values: Floats) -> Floats:
    return np.asarray(np.min(np.where(np.isfinite(values), values, np.inf), axis=0))


def _positive(values: Floats) -> Floats:
    return np.where(np.isfinite(values) & (values > 0.0), values, np.nan)


def is_bounded(values: Floats, size: Floats) -> NDArray[np.bool_]:
    """Say of every value whether it is finite and, where the size of the motion is known, not far beyond it."""
    with np.errstate(over="ignore"):
        return np.isfinite(values) & ~(np.abs(values) > WILD * size)


def why_lost(
    record: Record, quantity: str, member: Member, levels: list[int], values: Floats
) -> str:
    """Say why values of some positions of levels mean nothing: round-off only where they are near its floor."""
    status = np.asarray(pick(record, "status", scheme=member.scheme, case=member.case))
    if np.any(status[levels] != 0):
        return BROKE_DOWN
    size = float(sizes(record, quantity)[member.case])
    if math.isfinite(size) and largest(values) > WILD * size:
        return GROWS
    pairs = [i for i in levels if i < len(whole(record, "pair"))]
    if not pairs:
        return NO_VALUE
    norm = record.words("norm").index(TYPICAL_NORM)
    differences = at(record, f"{quantity}_difference_norm", member, norm=norm)[pairs[-1:]]
    floor = floor_norm(record, quantity, member, TYPICAL_NORM)
    if np.isnan(differences).any():
        return NO_VALUE
    near = differences <= ABOVE_ROUND_OFF * largest(floor[levels])
    return ROUND_OFF if near.all() else UNLIKE


def mark_leaving(ax: Axes, x: Floats, y: Floats, *, each: bool = False, **look: Any) -> bool:
    """Mark at the edges where values leave the frame (or, of points, each that is beyond); say whether any does."""
    low, high = ax.get_ylim()
    found = False
    for border, edge, marker in ((high, 1.0, "^"), (low, 0.0, "v")):
        beyond = y > border if edge else y < border
        there = beyond if each else beyond & ~np.concatenate([[False], beyond[:-1]])
        place = np.flatnonzero(there)
        if place.size == 0:
            continue
        found = True
        ax.plot(
            [x[i] if each else _crossing(ax, x, y, i, border) for i in place.tolist()],
            np.full(place.size, edge),
            transform=ax.get_xaxis_transform(),
            clip_on=False,
            linestyle="none",
            marker=marker,
            markersize=5,
            zorder=6,
            **look,
        )
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
    for i, curve in enumerate(curves):
        there = np.isfinite(curve)
        match = None
        for j in range(i):
            if found[j] is not None or curves[j].shape != curve.shape:
                continue
            both = there & np.isfinite(curves[j])
            together = both.sum() >= 2 and 2 * both.sum() >= max(
                there.sum(), np.isfinite(curves[j]).sum()
            )
            if together and np.max(np.abs(curve[both] - curves[j][both])) <= ALIKE * height:
                match = j
                break
        found.append(match)
    return found
