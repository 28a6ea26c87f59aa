"""Local extrema of the position: on the grid as the vibration text has them, and on the parabola through three points.

A peak is a point with ``u^(n-1) < u^n > u^(n+1)``, a trough one with ``u^(n-1) > u^n < u^(n+1)``, n = 1, ..., N-1:
vibration text (B), section 3.5, equations (14) and (15). Neither the first nor the last point is one. Where successive
points are equal, B finds none; here a plateau with lower ground on both sides is one peak, at the first of its points.

The parabola through the three points has its top ``(left - right)/(2 (left + right)) dt`` behind the middle one, with
``left = u^n - u^(n-1)`` and ``right = u^n - u^(n+1)``. Where ``u'''`` vanishes at the peak, as in every motion that no
force drives or damps, its time is off by O(dt^3) and its height by O(dt^4); elsewhere by O(dt^2) and O(dt^3). Of two
equal points it finds the middle; of a longer plateau, which resolves nothing, the middle is taken as well.

Point n - 1 is judged at step n, when both of its neighbours are known to be sound.
"""

from __future__ import annotations

from typing import Any

from vibsim.engine.kernel_stubs import called

# Rows of `kept` for peaks; those of troughs follow in the same order.
TIME = 0
HEIGHT = 1
TIME_GRID = 2
HEIGHT_GRID = 3
OF_A_KIND = 4
N_KEPT = 8

# Columns of `counts`, behind those of `vibsim.engine.gather`.
PEAK_COUNT = 3
TROUGH_COUNT = 4
PLATEAU_STEP = 5
PLATEAU_SIDE = 6
N_COUNTS_KEPT = 7


def is_turned(behind: float, middle: float, ahead: float) -> bool:
    """Say whether `note_turned` has something to write, without a branch: an extremum, or either end of a plateau."""
    tops = (behind < middle) & (ahead <= middle)
    bottoms = (behind > middle) & (ahead >= middle)
    leaves = (behind == middle) & (ahead != middle)
    return tops | bottoms | leaves


@called
def note_turned(
    kept: Any,
    counts: Any,
    case: int,
    n: int,
    dt: float,
    behind: float,
    middle: float,
    ahead: float,
) -> None:
    """Write the extremum at step `n`, if there is one, or where a plateau begins there.

    Parameters
    ----------
    kept
        Shape (`N_KEPT`, case, extremum): the first of every kind, as many as there is room for.
    counts
        Shape (case, `N_COUNTS_KEPT`): all of them.
    behind, middle, ahead
        Positions at steps n - 1, n and n + 1.
    """
    if behind == middle:
        side = counts[case, PLATEAU_SIDE]
        first = counts[case, PLATEAU_STEP]
        counts[case, PLATEAU_SIDE] = 0
        if side > 0 and ahead < middle:
            note_level(kept, counts, case, PEAK_COUNT, 0, first, n, dt, middle, ahead)
        if side < 0 and ahead > middle:
            note_level(kept, counts, case, TROUGH_COUNT, OF_A_KIND, first, n, dt, middle, ahead)
    elif ahead == middle:
        counts[case, PLATEAU_STEP] = n
        counts[case, PLATEAU_SIDE] = 1 if behind < middle else -1
    else:
        left, right = middle - behind, middle - ahead
        share = 0.5 * ((left - right) / (left + right))
        time, height = (n + share) * dt, middle + 0.25 * (left - right) * share
        if left > 0.0:
            keep(kept, counts, case, PEAK_COUNT, 0, time, height, n * dt, middle)
        else:
            keep(kept, counts, case, TROUGH_COUNT, OF_A_KIND, time, height, n * dt, middle)


def note_level(
    kept: Any,
    counts: Any,
    case: int,
    count: int,
    row: int,
    first: int,
    last: int,
    dt: float,
    middle: float,
    ahead: float,
) -> None:
    """Write the extremum of a plateau from step `first` to step `last`; of two points the parabola has a height."""
    rise = 0.125 * (middle - ahead) if last - first == 1 else 0.0
    time = 0.5 * (first + last) * dt
    keep(kept, counts, case, count, row, time, middle + rise, first * dt, middle)


def keep(
    kept: Any,
    counts: Any,
    case: int,
    count: int,
    row: int,
    time: float,
    height: float,
    time_grid: float,
    height_grid: float,
) -> None:
    """Count an extremum, and write it where there is room."""
    place = counts[case, count]
    if place < kept.shape[2]:
        kept[row + TIME, case, place] = time
        kept[row + HEIGHT, case, place] = height
        kept[row + TIME_GRID, case, place] = time_grid
        kept[row + HEIGHT_GRID, case, place] = height_grid
    counts[case, count] += 1
