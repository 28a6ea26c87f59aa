"""Statistics over all steps, without storing the steps: extrema, norms, peaks, turns, energy deviation.

The functions work on one member at a time, with ``+ - * /`` and comparisons only (see `vibsim.elementary`). Values that
change at every step form a tuple of floats, which stays in registers; values that change at a peak or a turn are in the
member's row of `stats` and `counts`.

A peak of the position is where the velocity falls through zero, located by linear interpolation of the velocity: the
third derivative of the position vanishes there with the velocity, so the time has an interpolation error of O(dt^3)
beside the O(dt^2) of the scheme. The time on the grid is that of the larger neighbour, as in text (B), section 3.5.
"""

from __future__ import annotations

import math
from typing import Any

from vibsim.elementary.doubled import nearest_whole
from vibsim.engine.kernel_stubs import called

SERIES = True  # bound by the kernel (`vibsim.engine.kernel_stubs`)

OVERFLOW = 1e150
"""A member that exceeds this size has failed: its energy would soon overflow."""
FARTHEST = 1e12
"""Largest angle at which turns are noted: beyond it, rounding leaves fewer than four digits of a turn."""

Extrema = tuple[float, float, float, float, float, float, float, float, float]
"""Least and largest position, least and largest velocity, largest absolute energy deviation; sums of absolute values
and of squares of position and velocity: the first columns of `stats`, in this order."""
N_EXTREMA = 9
LARGEST_DEVIATION = 4

# Columns of `stats`.
POSITION_MIN, POSITION_MAX, VELOCITY_MIN, VELOCITY_MAX, DEVIATION = range(5)
POSITION_SUM, POSITION_SQUARES, VELOCITY_SUM, VELOCITY_SQUARES = range(5, N_EXTREMA)
DEVIATION_INTERIOR, FIRST_PEAK_TIME, LAST_PEAK_TIME = range(9, 12)
FIRST_PEAK_TIME_GRID, LAST_PEAK_TIME_GRID, FIRST_PEAK, LAST_PEAK, LAST_TROUGH = range(12, 17)
FIRST_TURN_TIME, LAST_TURN_TIME, DEVIATION_D2T, N_STATS = range(17, 21)

# Columns of `counts`.
PEAKS, TURNS, LAST_STEP, N_COUNTS = range(4)

# Further rows of `samples`, after position and velocity of a single coordinate.
RUNNING_ROW, VELOCITY_D2T_ROW, RUNNING_D2T_ROW, DISSIPATED_ROW, DRIVEN_ROW, LOST_ROW = range(2, 8)


def sample_rows(coordinates: int) -> dict[str, int]:
    """Return the indices of these rows by name, after all positions and all velocities."""
    running = 2 * coordinates
    names = ("RUNNING_D2T_ROW", "DISSIPATED_ROW", "DRIVEN_ROW", "LOST_ROW")
    further = {name: running + 1 + coordinates + i for i, name in enumerate(names)}
    return {"RUNNING_ROW": running, "VELOCITY_D2T_ROW": running + 1, **further}


def end_velocity(end_rule: int, own: Any, v_before: Any, v_two_before: Any, backward: Any) -> Any:
    """Return the velocity at the last point by one of `vibsim.schemes.base.END_RULES`."""
    if end_rule == 1:
        return 2.0 * v_before - v_two_before
    if end_rule == 2:
        return backward
    return own


def centred_difference(ahead: Any, before: Any, rate: float) -> Any:
    """Return ``[D_2t u]``, with ``rate = 1/(2 dt)``."""
    return (ahead - before) * rate


def larger(size: float, largest: float) -> float:
    """Return the larger value, or `largest` if `size` is NaN."""
    return size if size > largest else largest


@called
def note_d2t(stats: Any, samples: Any, case: int, good: int, every: int, largest: float) -> None:
    """Write the largest energy deviation by ``[D_2t u]`` of a member whose last finite point is number `good`.

    The centred difference is undefined at that point, so its sample there is reset to NaN. It is also undefined at
    t = 0, so a largest deviation requires ``good > 1``.
    """
    value = largest if good > 1 else math.nan
    stats[case, DEVIATION_D2T] = value
    if SERIES:  # noqa: SIM102
        if good % every == 0:
            for row in range(VELOCITY_D2T_ROW, RUNNING_D2T_ROW):
                samples[row, case, good // every] = math.nan
            samples[RUNNING_D2T_ROW, case, good // every] = value


def first_extrema(u: float, v: float) -> Extrema:
    """Return the extrema and sums of the first point."""
    return u, u, v, v, 0.0, abs(u), u * u, abs(v), v * v


def next_extrema(extrema: Extrema, u: float, v: float, deviation: float) -> Extrema:
    """Return the extrema and sums after one more point."""
    u_min, u_max, v_min, v_max, largest, u_sum, u_squares, v_sum, v_squares = extrema
    size = abs(deviation)
    return (
        u if u < u_min else u_min,
        u if u > u_max else u_max,
        v if v < v_min else v_min,
        v if v > v_max else v_max,
        size if size > largest else largest,
        u_sum + abs(u),
        u_squares + u * u,
        v_sum + abs(v),
        v_squares + v * v,
    )


def note_extrema(stats: Any, case: int, first: int, extrema: Extrema, interior: float) -> None:
    """Write the extrema and sums of a finished member, and its largest deviation without the last point.

    Columns begin at `first`; each coordinate has `N_STATS` columns.
    """
    for i in range(N_EXTREMA):
        stats[case, first + i] = extrema[i]
    stats[case, first + DEVIATION_INTERIOR] = interior


def is_event(turn: float, bottom: float, v_before: float, u: float, v: float) -> bool:
    """Tell, without a branch, whether `note_events` has something to write."""
    falls = (v_before >= 0.0) & (v < 0.0)
    rises = (v_before <= 0.0) & (v > 0.0)
    turns = (turn > 0.0) & (abs(u - bottom) > 0.5 * turn) & (abs(u) < FARTHEST)
    return falls | rises | turns


@called
def note_events(
    stats: Any, counts: Any, case: int, turn: float, bottom: float, step: tuple[float, ...]
) -> float:
    """Write the peak, the trough or the turn in a step, if there is one; return the new bottom.

    At the top, half a turn from the bottom, the acceleration vanishes, so the linear interpolation of the position has
    an error of O(dt^3) as well. A step of more than one turn counts once; such a member is far from resolved.

    Parameters
    ----------
    step
        Time at its end, its length, position and velocity at its beginning, position and velocity at its end.
    """
    t, dt, u_before, v_before, u, v = step
    if (v_before >= 0.0 and v < 0.0) or (v_before <= 0.0 and v > 0.0):
        share = v_before / (v_before - v)
        grid = t - dt if u_before >= u else t
        height = u_before + 0.5 * (share * dt) * v_before
        note_turning(stats, counts, case, t + (share - 1.0) * dt, grid, height, -v)
    if turn > 0.0 and abs(u - bottom) > 0.5 * turn and abs(u) < FARTHEST:
        ahead = turn if u > bottom else -turn
        top = bottom + 0.5 * ahead
        stats[case, LAST_TURN_TIME] = t + ((top - u_before) / (u - u_before) - 1.0) * dt
        if counts[case, TURNS] == 0:
            stats[case, FIRST_TURN_TIME] = stats[case, LAST_TURN_TIME]
        counts[case, TURNS] += 1
        return bottom + ahead
    return bottom


def note_turning(
    stats: Any, counts: Any, case: int, t: float, grid: float, u: float, kind: float
) -> None:
    """Write the peak (`kind` > 0) at time `t`, on the grid at `grid`; of a trough, only its height."""
    if kind > 0.0:
        stats[case, LAST_PEAK_TIME] = t
        stats[case, LAST_PEAK_TIME_GRID] = grid
        stats[case, LAST_PEAK] = u
        if counts[case, PEAKS] == 0:
            stats[case, FIRST_PEAK_TIME] = t
            stats[case, FIRST_PEAK_TIME_GRID] = grid
            stats[case, FIRST_PEAK] = u
        counts[case, PEAKS] += 1
    else:
        stats[case, LAST_TROUGH] = u


def bottom_of(u: float, turn: float) -> float:
    """Return the multiple of `turn` nearest to `u`; 0 if `turn` is 0."""
    return turn * nearest_whole(u / turn) if turn > 0.0 else 0.0
