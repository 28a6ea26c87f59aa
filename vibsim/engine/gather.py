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

# Columns of `stats`.
POSITION_MIN = 0
POSITION_MAX = 1
VELOCITY_MIN = 2
VELOCITY_MAX = 3
DEVIATION = 4
DEVIATION_INTERIOR = 5
FIRST_PEAK_TIME = 6
LAST_PEAK_TIME = 7
FIRST_PEAK_TIME_GRID = 8
LAST_PEAK_TIME_GRID = 9
FIRST_PEAK = 10
LAST_PEAK = 11
LAST_TROUGH = 12
FIRST_TURN_TIME = 13
LAST_TURN_TIME = 14
N_STATS = 15

# Columns of `counts`.
PEAKS = 0
TURNS = 1
LAST_STEP = 2
N_COUNTS = 3

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
    u_min, u_max, v_min, v_max, largest = extrema
    stats[case, POSITION_MIN] = u_min
    stats[case, POSITION_MAX] = u_max
    stats[case, VELOCITY_MIN] = v_min
    stats[case, VELOCITY_MAX] = v_max
    stats[case, DEVIATION] = largest
    stats[case, DEVIATION_INTERIOR] = interior


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
    stats[case, LAST_PEAK_TIME] = t + (share - 1.0) * dt
    stats[case, LAST_PEAK_TIME_GRID] = t - dt if u_before >= u else t
    stats[case, LAST_PEAK] = u_before + 0.5 * (share * dt) * v_before
    if counts[case, PEAKS] == 0:
        stats[case, FIRST_PEAK_TIME] = stats[case, LAST_PEAK_TIME]
        stats[case, FIRST_PEAK_TIME_GRID] = stats[case, LAST_PEAK_TIME_GRID]
        stats[case, FIRST_PEAK] = stats[case, LAST_PEAK]
    counts[case, PEAKS] += 1


def note_trough(
    stats: Any, case: int, dt: float, u_before: float, v_before: float, v: float
) -> None:
    """Write the height of the trough between ``t - dt`` and `t`, where the velocity rose through zero."""
    stats[case, LAST_TROUGH] = u_before + 0.5 * (v_before / (v_before - v) * dt) * v_before


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
    stats[case, LAST_TURN_TIME] = (
        t + ((bottom + 0.5 * ahead - u_before) / (u - u_before) - 1.0) * dt
    )
    if counts[case, TURNS] == 0:
        stats[case, FIRST_TURN_TIME] = stats[case, LAST_TURN_TIME]
    counts[case, TURNS] += 1
