"""Local extrema of the position: on the grid as the vibration text has them, and on the parabola through three points.

A peak is a point with ``u^(n-1) < u^n > u^(n+1)``, a trough one with ``u^(n-1) > u^n < u^(n+1)``, n = 1, ..., N-1:
vibration text (B), section 3.5, equations (14) and (15). Neither the first nor the last point is one. Where successive
points are equal, B finds none; here a plateau with lower ground on both sides is one peak, at the first of its points.

The parabola through the three points has its top ``(left - right)/(2 (left + right)) dt`` behind the middle one, with
``left = u^n - u^(n-1)`` and ``right = u^n - u^(n+1)``. Where ``u'''`` vanishes at the peak, as in every motion that no
force drives or damps, its time is off by O(dt^3) and its height by O(dt^4); elsewhere by O(dt^2) and O(dt^3). Of two
equal points it finds the middle; of a longer plateau, which resolves nothing, the middle is taken as well.

A turn that is a located event has the time and the height of that (`vibsim.engine.events.put_turned`).

Point n - 1 is judged at step n, when both of its neighbours are known to be sound.
"""

from __future__ import annotations

from typing import Any

from vibsim.engine.kernel_stubs import called

# Rows of `kept` for peaks; those of troughs follow in the same order.
TIME, HEIGHT, TIME_GRID, HEIGHT_GRID, OF_A_KIND = range(5)
N_KEPT = 2 * OF_A_KIND

# Columns of `counts`, behind those of `vibsim.engine.gather`; troughs are counted behind peaks.
PEAK_COUNT, TROUGH_COUNT, PLATEAU_STEP, PLATEAU_SIDE, N_COUNTS_KEPT = range(3, 8)


def is_turned(behind: float, middle: float, ahead: float) -> bool:
    """Say whether `note_turned` has something to write, without a branch: an extremum, or either end of a plateau."""
    tops = (behind < middle) & (ahead <= middle)
    bottoms = (behind > middle) & (ahead >= middle)
    leaves = (behind == middle) & (ahead != middle)
    return tops | bottoms | leaves


@called
def note_turned(
    kept: Any, counts: Any, case: int, n: int, dt: float, behind: float, middle: float, ahead: float
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
        if (side > 0 and ahead < middle) or (side < 0 and ahead > middle):
            # of two points the parabola has a height
            height = middle + (0.125 * (middle - ahead) if n - first == 1 else 0.0)
            kind = 0 if side > 0 else 1
            keep(kept, counts, case, kind, 0.5 * (first + n) * dt, height, first * dt, middle)
    elif ahead == middle:
        counts[case, PLATEAU_STEP] = n
        counts[case, PLATEAU_SIDE] = 1 if behind < middle else -1
    else:
        left, right = middle - behind, middle - ahead
        share = 0.5 * ((left - right) / (left + right))
        time, height = (n + share) * dt, middle + 0.25 * (left - right) * share
        keep(kept, counts, case, 0 if left > 0.0 else 1, time, height, n * dt, middle)


def keep(
    kept: Any, counts: Any, case: int, kind: int, t: float, u: float, t_grid: float, u_grid: float
) -> None:
    """Count a peak (`kind` 0) or a trough (1), and write it where there is room."""
    place = counts[case, PEAK_COUNT + kind]
    if place < kept.shape[2]:
        row = OF_A_KIND * kind
        kept[row + TIME, case, place] = t
        kept[row + HEIGHT, case, place] = u
        kept[row + TIME_GRID, case, place] = t_grid
        kept[row + HEIGHT_GRID, case, place] = u_grid
    counts[case, PEAK_COUNT + kind] += 1
