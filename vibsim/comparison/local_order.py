r"""The order of convergence as a function of time, from the differences of three successive levels.

The ratio of two differences at one time is meaningless where they change sign, as those of an oscillation do twice per
period. So the order at t is that of their norms in a window around t, half a period long, which always holds a hump:

    p(t) = log2 R(t),     R(t) = ||d_k|| / ||d_(k+1)||,     ||d||^2 = sum of d^2 over the window

(for successive levels; `differences.order_of_ratio` in general). Its interval is given by ``R (1 - e)`` and
``R/(1 - e)`` with

    e = || d_k/||d_k|| - d_(k+1)/||d_(k+1)|| ||  +  noise_k/rms_k  +  noise_(k+1)/rms_(k+1)

This is how far the two curves are from having one shape in the window, plus how much of them may be round-off (ten
times the predicted floor). Where the order changes, or two powers of dt have similar size, the curves differ in shape
and the interval is wide; it is unbounded if e is 1 or more. The interval tells how well this ratio is known, not what
finer levels would show.

Some schemes compute the last point of a run differently (a one-sided velocity). It is compared alone, not in windows.

Source: pendulum lecture, section 2.5 (ratios of differences); the windows are our own.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vibsim.comparison.thresholds import LAST_POINT_ALONE, LEAST_WINDOW
from vibsim.convergence.differences import largest, order_of_ratio, safe_ratio
from vibsim.convergence.thresholds import ROUND_OFF_SAFETY
from vibsim.core.array_types import Floats, Integers


def window_points(width: Floats, spacing: Floats, points: int) -> Integers:
    """Return the odd number of points of a window with this width in time, shape (case,)."""
    half = np.rint(0.5 * width / spacing)
    most = max((points - 1) // 2, LEAST_WINDOW // 2)
    return np.asarray(2 * np.clip(half, LEAST_WINDOW // 2, most).astype(np.int64) + 1)


def local_order(
    first: Floats,
    second: Floats,
    levels: Sequence[int],
    floors: tuple[Floats, Floats],
    counts: Integers,
    end_included: bool = True,
) -> tuple[Floats, Floats, Floats]:
    """Return the order at each time, and the ends of its interval.

    Parameters
    ----------
    first, second
        Differences of the coarser and the finer pair of three levels, shape (scheme, case, t).
    floors
        Predicted round-off of the two differences at one point, shape (scheme, case).
    counts
        Number of points of the window, odd, shape (case,).
    end_included
        Whether the last point is the end of the run.

    Returns
    -------
    tuple of array
        Order, lower end, upper end, shape (scheme, case, t); an end is infinite where the interval is unbounded. All
        are NaN where the finer difference may be round-off throughout the window, or a difference vanishes.
    """
    inner = slice(None, -1) if end_included and first.shape[-1] > LEAST_WINDOW else slice(None)
    scale = _scale(first)
    scaled = first * scale, second * scale
    sums = _window_means([d[..., inner] for d in scaled], counts)
    noise = tuple(ROUND_OFF_SAFETY * floor[..., None] * scale for floor in floors)
    ratio, error = _ratio_and_error(sums, noise)
    if inner.stop is not None:
        ratio, error = _append_end(ratio, error, scaled, sums, noise)
    return _interval(ratio, error, levels)


def _scale(series: Floats) -> Floats:
    """Return a power of two that scales a series to about 1, so that squares do not overflow."""
    size = largest(np.nan_to_num(series, posinf=0.0, neginf=0.0))[..., None]
    return np.ldexp(1.0, -np.frexp(np.where(size > 0, size, 1.0))[1])


def _window_means(pair: list[Floats], counts: Integers) -> Floats:
    """Return means of d_k^2, d_(k+1)^2 and d_k d_(k+1) over the window, shape (3, scheme, case, t)."""
    first, second = pair
    means = np.empty((3, *first.shape))
    for count in np.unique(counts).tolist():
        members = counts == count
        a, b = first[:, members], second[:, members]
        points = box_sum(np.ones(a.shape[-1]), count)
        with np.errstate(over="ignore", invalid="ignore"):
            for row, product in enumerate((a * a, b * b, a * b)):
                means[row][:, members] = box_sum(product, count) / points
    return means


def box_sum(values: Floats, count: int) -> Floats:
    """Return the sum over a window of `count` points, an odd number, around each point; the padding is 0.

    Sums of 2, 4, 8, ... points are combined, so that no sum is the small difference of two large ones.
    """
    edge = [(0, 0)] * (values.ndim - 1) + [(count // 2, count // 2)]
    power, size, offset = np.pad(values, edge), 1, 0
    length = values.shape[-1]
    total = np.zeros(values.shape)
    while count:
        if count & 1:
            total = total + power[..., offset : offset + length]
            offset += size
        count >>= 1
        if count:
            power = power[..., :-size] + power[..., size:]
            size *= 2
    return total


def _ratio_and_error(sums: Floats, noise: Sequence[Floats]) -> tuple[Floats, Floats]:
    """Return the ratio of the norms and its relative error e; NaN where there is nothing to compare."""
    with np.errstate(divide="ignore", invalid="ignore"):
        first, second = np.sqrt(sums[0]), np.sqrt(sums[1])
        cosine = np.clip(sums[2] / (first * second), -1.0, 1.0)
        error = np.sqrt(2.0 - 2.0 * cosine) + noise[0] / first + noise[1] / second
        usable = (first > 0) & (second > noise[1])
    return np.where(usable, safe_ratio(first, second), np.nan), np.where(usable, error, np.nan)


def _append_end(
    ratio: Floats,
    error: Floats,
    pair: tuple[Floats, Floats],
    sums: Floats,
    noise: Sequence[Floats],
) -> tuple[Floats, Floats]:
    """Append the last point: compared alone, or, near a zero crossing, with the values of the last window."""
    ends = [np.abs(series[..., -1:]) for series in pair]
    alone = np.ones(ends[0].shape, dtype=bool)
    for end, square in zip(ends, sums, strict=False):
        alone &= end > LAST_POINT_ALONE * np.sqrt(square[..., -1:])
    signs = np.sign(pair[0][..., -1:]) * np.sign(pair[1][..., -1:])
    one_point = np.stack([ends[0] ** 2, ends[1] ** 2, signs * ends[0] * ends[1]])
    at_end = _ratio_and_error(one_point, noise)
    last = [np.where(alone, x, y[..., -1:]) for x, y in zip(at_end, (ratio, error), strict=True)]
    joined = [np.concatenate(rows, axis=-1) for rows in ((ratio, last[0]), (error, last[1]))]
    return joined[0], joined[1]


def _interval(ratio: Floats, error: Floats, levels: Sequence[int]) -> tuple[Floats, Floats, Floats]:
    order = order_of_ratio(ratio, levels)
    bounded = error < 1.0
    factor = np.where(bounded, 1.0 - error, 1.0)
    ends = []
    for end, unbounded in ((ratio * factor, -np.inf), (ratio / factor, np.inf)):
        order_at_end = order_of_ratio(end, levels)
        # an end beyond the largest order is unbounded, too
        order_at_end = np.where(bounded & np.isfinite(order_at_end), order_at_end, unbounded)
        ends.append(np.where(np.isfinite(order), order_at_end, np.nan))
    return order, ends[0], ends[1]
