"""What is gathered from every step without storing the steps: extrema, peaks, turns, the largest energy deviation.

The functions work on one member at a time, in ``+ - * /`` and comparisons only (see `vibsim.engine.elementary`).
What changes at every step is a tuple of floats, which stays in registers; what changes at a peak or a turn stays in
the member's row of `stats` and `counts`.

A peak of the position is where the velocity falls through zero, found by linear interpolation of the velocity: at a
peak the third derivative of the position vanishes with the velocity, so the time has an error of dt^3 while the
scheme's own is dt^2. The time at grid points is the larger neighbour's, as in the vibration text (B), section 3.5.
"""

from __future__ import annotations

from typing import Any

Extrema = tuple[float, float, float, float, float]
"""Least and largest position, least and largest velocity, largest absolute energy deviation."""

STATS = (
    "position_min",
    "position_max",
    "velocity_min",
    "velocity_max",
    "deviation",
    "deviation_interior",
    "first_peak_time",
    "last_peak_time",
    "first_peak_time_grid",
    "last_peak_time_grid",
    "first_peak",
    "last_peak",
    "last_trough",
    "first_turn_time",
    "last_turn_time",
)
"""Columns of `stats`."""

COUNTS = ("peaks", "turns", "last_step")
"""Columns of `counts`."""

_ROUND = (
    6755399441055744.0  # 1.5 * 2^52: adding and subtracting it rounds to the nearest whole number
)


def next_extrema(extrema: Extrema, u: float, v: float, deviation: float) -> Extrema:
    """Return the extrema after one more point."""
    u_min, u_max, v_min, v_max, largest = extrema
    size = abs(deviation)
    return (
        u if u < u_min else u_min,
        u if u > u_max else u_max,
        v if v < v_min else v_min,
        v if v > v_max else v_max,
        size if size > largest else largest,
    )


def note_extrema(stats: Any, case: int, extrema: Extrema, interior: float) -> None:
    """Write the extrema of a member that has arrived, and its largest energy deviation without the last point."""
    stats[case, 0], stats[case, 1], stats[case, 2], stats[case, 3], stats[case, 4] = extrema
    stats[case, 5] = interior


def note_peak(
    stats: Any,
    counts: Any,
    case: int,
    t: float,
    dt: float,
    u_before: float,
    v_before: float,
    u: float,
    v: float,
) -> None:
    """Write the peak between ``t - dt`` and `t`, where the velocity fell through zero."""
    share = v_before / (v_before - v)
    stats[case, 7] = t + (share - 1.0) * dt
    stats[case, 9] = t - dt if u_before >= u else t
    stats[case, 11] = u_before + 0.5 * (share * dt) * v_before
    if counts[case, 0] == 0:
        stats[case, 6] = stats[case, 7]
        stats[case, 8] = stats[case, 9]
        stats[case, 10] = stats[case, 11]
    counts[case, 0] += 1


def note_trough(
    stats: Any, case: int, dt: float, u_before: float, v_before: float, v: float
) -> None:
    """Write the height of the trough between ``t - dt`` and `t`, where the velocity rose through zero."""
    stats[case, 12] = u_before + 0.5 * (v_before / (v_before - v) * dt) * v_before


def bottom_of(u: float, turn: float) -> float:
    """Return the multiple of `turn` nearest to `u`."""
    return turn * ((u / turn + _ROUND) - _ROUND)


def note_turn(
    stats: Any,
    counts: Any,
    case: int,
    t: float,
    dt: float,
    ahead: float,
    bottom: float,
    u_before: float,
    u: float,
) -> None:
    """Write the pass over the top, half a turn `ahead` of the bottom, between ``t - dt`` and `t`.

    There the acceleration vanishes, so that the linear interpolation of the position has an error of dt^3 as well. A
    step of more than a turn counts once; such a member is far from resolved.
    """
    stats[case, 14] = t + ((bottom + 0.5 * ahead - u_before) / (u - u_before) - 1.0) * dt
    if counts[case, 1] == 0:
        stats[case, 13] = stats[case, 14]
    counts[case, 1] += 1
