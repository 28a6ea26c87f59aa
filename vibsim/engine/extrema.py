"""Local extrema of the position: on the grid as in the vibration text, and on the parabola through three points.

A peak is a point with ``u^(n-1) < u^n > u^(n+1)``, a trough one with ``u^(n-1) > u^n < u^(n+1)``, n = 1, ..., N-1:
vibration text (B), section 3.5, equations (14) and (15). The first and the last point never count. Between equal points
B finds no extremum; here a plateau that is higher than both sides is one peak, at the first of its points.

The vertex of the parabola through the three points is ``(left - right)/(2 (left + right)) dt`` after the middle point,
with ``left = u^n - u^(n-1)`` and ``right = u^n - u^(n+1)``. If ``u'''`` vanishes at the peak, as in every undriven,
undamped motion, the error of its time is O(dt^3) and that of its height O(dt^4); otherwise O(dt^2) and O(dt^3).
Between two equal points the vertex is their middle; a longer plateau resolves nothing, and its middle is taken as well.

An extremum that is a located event gets the time and the height of the event (`vibsim.engine.events.put_turned`).

Point n - 1 is examined at step n, when both of its neighbours are known to be finite.
"""

from __future__ import annotations

from typing import Any

from vibsim.engine.kernel_stubs import called

# Rows of `kept` for peaks; those of troughs follow in the same order.
TIME, HEIGHT, TIME_GRID, HEIGHT_GRID, OF_A_KIND = range(5)
N_KEPT = 2 * OF_A_KIND

# Columns of `counts`, after those of `vibsim.engine.gather`.
PEAK_COUNT, TROUGH_COUNT, PLATEAU_STEP, PLATEAU_SIDE, N_COUNTS_KEPT = range(3, 8)


def is_turned(before: float, middle: float, ahead: float) -> bool:
    """Tell, without a branch, whether `note_turned` has something to write: an extremum, or either end of a plateau."""
    tops = (before < middle) & (ahead <= middle)
    bottoms = (before > middle) & (ahead >= middle)
    leaves = (before == middle) & (ahead != middle)
    return tops | bottoms | leaves


@called
def note_turned(
    kept: Any, counts: Any, case: int, n: int, dt: float, before: float, middle: float, ahead: float
) -> None:
    """Write the extremum at step `n`, if there is one, or note that a plateau begins there.

    Parameters
    ----------
    kept
        Shape (`N_KEPT`, case, extremum): the first extrema of each kind, as many as fit.
    counts
        Shape (case, `N_COUNTS_KEPT`): the numbers of all extrema, and the current plateau.
    before, middle, ahead
        Positions at steps n - 1, n and n + 1.
    """
    if before == middle:
        side = counts[case, PLATEAU_SIDE]
        first = counts[case, PLATEAU_STEP]
        counts[case, PLATEAU_SIDE] = 0
        if (side > 0 and ahead < middle) or (side < 0 and ahead > middle):
            # only a plateau of two points has a parabola above it
            height = middle + (0.125 * (middle - ahead) if n - first == 1 else 0.0)
            kind = 0 if side > 0 else 1
            keep(kept, counts, case, kind, 0.5 * (first + n) * dt, height, first * dt, middle)
    elif ahead == middle:
        counts[case, PLATEAU_STEP] = n
        counts[case, PLATEAU_SIDE] = 1 if before < middle else -1
    else:
        left, right = middle - before, middle - ahead
        share = 0.5 * ((left - right) / (left + right))
        time, height = (n + share) * dt, middle + 0.25 * (left - right) * share
        keep(kept, counts, case, 0 if left > 0.0 else 1, time, height, n * dt, middle)


def keep(
    kept: Any, counts: Any, case: int, kind: int, t: float, u: float, t_grid: float, u_grid: float
) -> None:
    """Count a peak (`kind` 0) or a trough (1), and write it if it fits."""
    place = counts[case, PEAK_COUNT + kind]
    if place < kept.shape[2]:
        row = OF_A_KIND * kind
        kept[row + TIME, case, place] = t
        kept[row + HEIGHT, case, place] = u
        kept[row + TIME_GRID, case, place] = t_grid
        kept[row + HEIGHT_GRID, case, place] = u_grid
    counts[case, PEAK_COUNT + kind] += 1
