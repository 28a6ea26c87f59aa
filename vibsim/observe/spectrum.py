r"""The frequencies in a stored series: amplitudes of its lines, and the frequency of the highest one.

With Hann's window ``h_j = 1 - cos(2 pi j/n)`` on n samples in the time T, less their mean,

    X_k = (2/n) sum h_j (u_j - mean) exp(-2 pi i j k/n),    line k at the angular frequency 2 pi k/T,

a cosine of amplitude A on line k has ``|X_k| = A``.

**Frequency.** A cosine that is steady or decays, ``u = exp(-d t) cos(w t + phase)``, obeys for every shift s

    u(t + s) + q u(t - s) = p u(t),    q = exp(-2 d s),    p = 2 exp(-d s) cos(w s),

and so do the lines of three windows that are shifted by s: ``X+ + q X- = p X`` on line k is two real equations for p
and q, exact for one cosine, its negative frequency and its decay included. A constant has no part in the lines from 2
on. In place of line k, ``2 X_k - X_(k-1) - X_(k+1)`` is taken, the line of the window ``h^2``.

**What other lines do to it.** A line that holds parts B of another cosine and A of its own gives the mean of both
frequencies, so weighted: it moves by ``D B/A``, with D the distance of the two in lines. Of a cosine of the relative
size a that is far off, B/A is of the size a/D^3 with the window h, a/D^5 with h^2. On the lines beside the highest one
A is half as large, or less, with the other sign. So the frequencies of the lines k - 1, k and k + 1 with the window h
are further from the one reported than that is from the true one; their largest distance is the bound. Where D < 1,
both cosines have the same shape: all lines move alike, by up to a D, and apart by about a D^2/2 only. So the bound
there is the root of the distance. By how much less the lines differ with the window h^2 tells one from the other:
D^2/5 times less of a line far off, hardly less where D < 1.

Every level has its own samples. What is faster than half their frequency appears at another one (aliasing).

Source: F. J. Harris, On the use of windows for harmonic analysis, Proc. IEEE 66 (1978) 51-83; F. B. Hildebrand,
Introduction to Numerical Analysis (McGraw-Hill, 1956), section 9.4, for the equation of the shifts (Prony's method).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vibsim.core.array_types import Flags, Floats, Integers
from vibsim.elementary import on_arrays
from vibsim.observe.common_grid import take_all
from vibsim.observe.member_block import MemberBlock

OF_UNRESOLVED = 3.0
"""Lines that differ so many times less with the window h^2 are told apart. [measured: 1 to 3 times less where two
cosines are nearer than one line]"""
FIRST_LINE = 3
"""The lowest line whose frequency is reported: what is left of the mean reaches up to the one before its neighbour."""
BESIDE = 2
"""So many lines on either side of the highest one are used."""


def lines(series: Floats) -> Floats:
    """Return the amplitude of every line of series of shape (..., t), whose last sample is left out; (..., line)."""
    own = np.ascontiguousarray(series, dtype=np.float64)[..., :-1]
    return np.asarray(on_arrays.hypot(*_parts(own, np.mean(own, axis=-1, keepdims=True))))


def _parts(own: Floats, mean: Floats) -> Floats:
    """Return the real and the imaginary parts of the lines of series less a mean, shape (2, ..., line)."""
    n = own.shape[-1]
    window = 1.0 - on_arrays.cos(2.0 * np.pi / n * np.arange(n))
    found = np.fft.rfft(window * (own - mean), axis=-1)
    return np.asarray(2.0 / n * np.stack([found.real, found.imag]))


def highest(series: Floats) -> tuple[Floats, Floats]:
    """Return the number of the highest line of series, with its part between two lines, and how far it may be off.

    Both in lines, without the last axis. The number is NaN where there is no such line; how far it may be off is
    infinite where the lines around it are not those of a cosine.
    """
    whole = np.ascontiguousarray(series, dtype=np.float64)
    rows = whole.reshape(-1, whole.shape[-1])
    n, place, error = rows.shape[-1] - 1, np.full(len(rows), np.nan), np.full(len(rows), np.inf)
    found = lines(rows)
    known: Flags = np.asarray(np.isfinite(found).all(axis=-1))
    top = np.argmax(np.where(known[:, None], found, 0.0), axis=-1)
    known &= (top >= FIRST_LINE) & (top < found.shape[-1] - 1)
    # the largest power of two within a quarter of a period: the same part of the run on every level
    shifts = np.ldexp(1.0, np.frexp(np.maximum(n // (4 * np.maximum(top, 1)), 1))[1] - 1).astype(
        int
    )
    for shift in np.unique(shifts[known]).tolist():
        own = known & (shifts == shift)
        place[own], error[own] = _of_one_shift(rows[own], shift, top[own])
    shape = whole.shape[:-1]
    return place.reshape(shape), error.reshape(shape)


def _of_one_shift(rows: Floats, shift: int, top: Integers) -> tuple[Floats, Floats]:
    """Return what `highest` does, of rows whose highest lines are known, shape (row,)."""
    n = rows.shape[-1] - 1
    size = n - 2 * shift
    mean = np.mean(rows, axis=-1, keepdims=True)
    shifted = [_parts(rows[:, i : i + size], mean) for i in (0, shift, 2 * shift)]
    count = shifted[1].shape[-1]
    if count < FIRST_LINE + BESIDE + 1:
        return np.full(len(rows), np.nan), np.full(len(rows), np.inf)
    # in the shorter time of a window the highest line is the same one or the one before
    pair = np.clip(top[:, None] - np.array([1, 0]), FIRST_LINE, count - 1 - BESIDE)
    is_same = np.diff(np.take_along_axis(_square(shifted[1]), pair, axis=-1), axis=-1) > 0.0
    near = np.where(is_same, pair[:, 1:], pair[:, :1]) + np.arange(-BESIDE, BESIDE + 1)
    narrow = [np.take_along_axis(parts, near[None], axis=-1) for parts in shifted]
    wide = [2.0 * x[..., 1:-1] - x[..., :-2] - x[..., 2:] for x in narrow]
    unit = n / (2.0 * np.pi * shift)
    own, of_wide = (unit * _angle(parts) for parts in ([x[..., 1:-1] for x in narrow], wide))
    place = of_wide[:, 1]
    apart, apart_wide = (
        np.max(np.abs(found - place[:, None]), axis=-1) for found in (own, of_wide)
    )
    with np.errstate(divide="ignore", invalid="ignore"):
        root = np.sqrt(apart)
        unresolved = np.where(apart > 0.0, OF_UNRESOLVED * apart_wide / root, 0.0)
    error = np.maximum(apart, np.minimum(root, unresolved))
    known = np.where(np.isfinite(error), error, np.inf)
    return np.where(np.isfinite(place), place, top), known


def _angle(shifted: Sequence[Floats]) -> Floats:
    """Return by which angle the cosine of each line goes on in one shift, from lines of three windows; NaN for none."""
    before, at, after = shifted
    with np.errstate(all="ignore"):
        decay = -_cross(after, at) / _cross(before, at)
        turn = (_dot(after, at) + decay * _dot(before, at)) / _square(at)
        return np.asarray(on_arrays.acos(0.5 * turn / np.sqrt(decay)))


def _square(x: Floats) -> Floats:
    return _dot(x, x)


def _dot(x: Floats, y: Floats) -> Floats:
    """Return the real part of x times the conjugate of y, each in two parts."""
    return np.asarray(x[0] * y[0] + x[1] * y[1])


def _cross(x: Floats, y: Floats) -> Floats:
    """Return the imaginary part of the same."""
    return np.asarray(x[1] * y[0] - x[0] * y[1])


def peak_frequency(block: MemberBlock, level: int, quantity: str) -> Floats:
    """Return the angular frequency of the highest line of a quantity [rad per unit of time], shape (scheme, case)."""
    return _of_highest(block, level, quantity)[0]


def error_by_other_lines(block: MemberBlock, level: int, quantity: str) -> Floats:
    """Return how far `peak_frequency` may be off on every level alike, for what other lines do, (scheme, case)."""
    return _of_highest(block, level, quantity)[1]


def _of_highest(block: MemberBlock, level: int, quantity: str) -> tuple[Floats, Floats]:
    record = block.records[level]
    if quantity not in record:
        return np.full(block.shape, np.nan), np.full(block.shape, np.inf)
    duration = block.grid.spacing * (len(block.grid.t) - 1)
    unit = 2.0 * np.pi / duration
    place, error = highest(take_all(block.grid, record, quantity))
    return np.asarray(place * unit), np.asarray(error * unit)
