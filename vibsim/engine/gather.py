"""What is gathered from every step without storing the steps: extrema, norms, peaks, turns, energy deviation.

The functions work on one member at a time, in ``+ - * /`` and comparisons only (see `vibsim.elementary`).
What changes at every step is a tuple of floats, which stays in registers; what changes at a peak or a turn stays in
the member's row of `stats` and `counts`.

A peak of the position is where the velocity falls through zero, found by linear interpolation of the velocity: at a
peak the third derivative of the position vanishes with the velocity, so the time has an error of dt^3 while the
scheme's own is dt^2. The time at grid points is the larger neighbour's, as in the vibration text (B), section 3.5.
"""

from __future__ import annotations

import math
from typing import Any

from vibsim.elementary.rounding import nearest_whole
from vibsim.engine.kernel_stubs import SERIES, called

OVERFLOW = 1e150
"""A member that grows beyond has failed: its energy could no longer be stored."""

FARTHEST = 1e12
"""An angle beyond does not resolve a turn to four digits; passes over the top are not noted there."""

Extrema = tuple[float, float, float, float, float, float, float, float, float]
"""Least and largest position, least and largest velocity, largest absolute energy deviation; sums of absolute values
and of squares of position and velocity."""
N_EXTREMA = 9
LARGEST_DEVIATION = 4

# Columns of `stats`.
POSITION_MIN = 0
POSITION_MAX = 1
VELOCITY_MIN = 2
VELOCITY_MAX = 3
DEVIATION = 4
POSITION_L1 = 5
POSITION_L2 = 6
VELOCITY_L1 = 7
VELOCITY_L2 = 8
DEVIATION_INTERIOR = 9
FIRST_PEAK_TIME = 10
LAST_PEAK_TIME = 11
FIRST_PEAK_TIME_GRID = 12
LAST_PEAK_TIME_GRID = 13
FIRST_PEAK = 14
LAST_PEAK = 15
LAST_TROUGH = 16
FIRST_TURN_TIME = 17
LAST_TURN_TIME = 18
DEVIATION_D2T = 19
N_STATS = 20

# Columns of `counts`.
PEAKS = 0
TURNS = 1
LAST_STEP = 2
N_COUNTS = 3


# Rows of `samples` behind position and velocity of one coordinate, where series are kept of more.
RUNNING_ROW = 2
VELOCITY_D2T_ROW = 3
RUNNING_D2T_ROW = 4
DISSIPATED_ROW = 5
DRIVEN_ROW = 6
LOST_ROW = 7


def sample_rows(coordinates: int) -> dict[str, int]:
    """Return the numbers of these rows, by their names here, behind all positions and all velocities."""
    running = 2 * coordinates
    names = ("RUNNING_D2T_ROW", "DISSIPATED_ROW", "DRIVEN_ROW", "LOST_ROW")
    behind = {name: running + 1 + coordinates + i for i, name in enumerate(names)}
    return {"RUNNING_ROW": running, "VELOCITY_D2T_ROW": running + 1, **behind}


def n_sample_rows(
    coordinates: int,
    *,
    with_series: bool,
    own_velocity: bool,
    with_work: bool,
    with_events: bool,
) -> int:
    """Return how many rows samples have; one that a scheme has no use for stays NaN where others stand behind it."""
    rows = sample_rows(coordinates)
    if not with_series:
        return rows["RUNNING_ROW"]
    if with_work:
        return rows["LOST_ROW" if with_events else "DRIVEN_ROW"] + 1
    return rows["RUNNING_D2T_ROW" if own_velocity else "RUNNING_ROW"] + 1


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
    """Return the larger one, and `largest` where `size` is NaN."""
    return size if size > largest else largest


@called
def note_d2t(stats: Any, samples: Any, case: int, good: int, every: int, largest: float) -> None:
    """Write the largest energy deviation by ``[D_2t u]`` of a member whose last sound point is number `good`.

    The centred difference has no value there: a sample that was taken of it is taken back. Nor has it at t = 0, so that
    a largest one takes two points more.
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


def note_extrema(
    stats: Any, case: int, first: int, extrema: Extrema, interior: float, dt: float
) -> None:
    """Write the extrema and norms of a member that has arrived, and its largest deviation without the last point.

    ``l1 = dt sum |u|``, ``l2 = sqrt(dt sum u^2)`` over every point from t = 0 on (B, section 4.4). Columns count from
    `first`: those of each further coordinate stand behind all of the one before.
    """
    u_min, u_max, v_min, v_max, largest, u_sum, u_squares, v_sum, v_squares = extrema
    stats[case, first + POSITION_MIN] = u_min
    stats[case, first + POSITION_MAX] = u_max
    stats[case, first + VELOCITY_MIN] = v_min
    stats[case, first + VELOCITY_MAX] = v_max
    stats[case, first + DEVIATION] = largest
    stats[case, first + DEVIATION_INTERIOR] = interior
    stats[case, first + POSITION_L1] = dt * u_sum
    stats[case, first + POSITION_L2] = math.sqrt(dt * u_squares)
    stats[case, first + VELOCITY_L1] = dt * v_sum
    stats[case, first + VELOCITY_L2] = math.sqrt(dt * v_squares)


def is_event(turn: float, bottom: float, v_before: float, u: float, v: float) -> bool:
    """Say whether `note_events` has something to write, without a branch."""
    falls = (v_before >= 0.0) & (v < 0.0)
    rises = (v_before <= 0.0) & (v > 0.0)
    turns = (turn > 0.0) & (abs(u - bottom) > 0.5 * turn) & (abs(u) < FARTHEST)
    return falls | rises | turns


@called
def note_events(
    stats: Any,
    counts: Any,
    case: int,
    t: float,
    dt: float,
    turn: float,
    bottom: float,
    u_before: float,
    v_before: float,
    u: float,
    v: float,
) -> float:
    """Write the peak, the trough or the turn between ``t - dt`` and `t`, if there is one; return the bottom."""
    if v_before >= 0.0 and v < 0.0:
        note_peak(stats, counts, case, t, dt, u_before, v_before, u, v)
    if v_before <= 0.0 and v > 0.0:
        note_trough(stats, case, dt, u_before, v_before, v)
    if turn > 0.0 and abs(u - bottom) > 0.5 * turn and abs(u) < FARTHEST:
        ahead = turn if u > bottom else -turn
        note_turn(stats, counts, case, t, dt, ahead, bottom, u_before, u)
        return bottom + ahead
    return bottom


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


def note_turning(
    stats: Any, counts: Any, case: int, t: float, grid: float, u: float, kind: float
) -> None:
    """Write the peak (`kind` > 0) or the trough that an event at time `t` is, before the grid point at `grid`."""
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
    """Return the multiple of `turn` nearest to `u`; 0 where there is no turn."""
    return turn * nearest_whole(u / turn) if turn > 0.0 else 0.0


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
