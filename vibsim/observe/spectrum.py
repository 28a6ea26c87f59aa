r"""The spectrum of a stored series: amplitudes of its lines, and the frequency of the highest line.

With the Hann window ``h_j = 1 - cos(2 pi j/n)`` on n samples in the time T, minus their mean,

    X_k = (2/n) sum h_j (u_j - mean) exp(-2 pi i j k/n),    line k at the angular frequency 2 pi k/T,

a cosine of amplitude A on line k has ``|X_k| = A``.

**Frequency.** A steady or decaying cosine, ``u = exp(-d t) cos(w t + phase)``, satisfies for every shift s

    u(t + s) + q u(t - s) = p u(t),    q = exp(-2 d s),    p = 2 exp(-d s) cos(w s),

and so do the lines of three windows that are shifted by s: ``X+ + q X- = p X`` on line k is two real equations for p
and q, exact for one cosine, including its negative frequency and its decay. A constant contributes only to lines 0 and
1. Line k is replaced by ``2 X_k - X_(k-1) - X_(k+1)``, the line of the window ``h^2``.

**Influence of other lines.** If a line has contributions A of its own cosine and B of another, its frequency is their
weighted mean: it is shifted by ``D B/A``, with D the distance of the two in lines. For a distant cosine of relative
size a, B/A is of the size a/D^3 with the window h and a/D^5 with h^2. On the neighbours of the highest line, A is at
most half as large, with the opposite sign. So the frequencies of the lines k - 1, k and k + 1 with the window h are
further from the reported one than that is from the true one; their largest distance is the bound. If D < 1, both
cosines have the same shape: all lines are shifted together by up to a D, and differ only by about a D^2/2. So there the
bound is the square root of the distance. The two cases are told apart by how much less the lines differ with the window
h^2: by a factor of D^2/5 for a distant line, hardly at all if D < 1.

Every level uses its own samples. Frequencies above half the sampling frequency appear at lower ones (aliasing).

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
"""Ratio of the differences with the windows h and h^2 above which lines count as resolved. [measured: 1 to 3 for two
cosines closer than one line]"""
FIRST_LINE = 3
"""The lowest line whose frequency is reported: remains of the mean reach line 1."""
BESIDE = 2
"""Number of lines used on either side of the highest."""


def lines(series: Floats) -> Floats:
    """Return the amplitude of every line, shape (..., line), of series of shape (..., t) without the last sample."""
    samples = np.ascontiguousarray(series, dtype=np.float64)[..., :-1]
    return np.asarray(on_arrays.hypot(*_parts(samples, np.mean(samples, axis=-1, keepdims=True))))


def _parts(samples: Floats, mean: Floats) -> Floats:
    """Return the real and imaginary parts of the lines of series minus a mean, shape (2, ..., line)."""
    n = samples.shape[-1]
    window = 1.0 - on_arrays.cos(2.0 * np.pi / n * np.arange(n))
    spectrum = np.fft.rfft(window * (samples - mean), axis=-1)
    return np.asarray(2.0 / n * np.stack([spectrum.real, spectrum.imag]))


def highest(series: Floats) -> tuple[Floats, Floats]:
    """Return the frequency of the highest line of series and a bound of its error, both in units of lines.

    The frequency is NaN if there is no such line; the bound is infinite if the lines around it are not those of a
    cosine.
    """
    whole = np.ascontiguousarray(series, dtype=np.float64)
    rows = whole.reshape(-1, whole.shape[-1])
    n, place, error = rows.shape[-1] - 1, np.full(len(rows), np.nan), np.full(len(rows), np.inf)
    amplitudes = lines(rows)
    known: Flags = np.asarray(np.isfinite(amplitudes).all(axis=-1))
    top = np.argmax(np.where(known[:, None], amplitudes, 0.0), axis=-1)
    known &= (top >= FIRST_LINE) & (top < amplitudes.shape[-1] - 1)
    # the largest power of two within a quarter of a period: the same fraction of the run on every level
    shifts = np.ldexp(1.0, np.frexp(np.maximum(n // (4 * np.maximum(top, 1)), 1))[1] - 1).astype(
        int
    )
    for shift in np.unique(shifts[known]).tolist():
        mask = known & (shifts == shift)
        place[mask], error[mask] = _with_shift(rows[mask], shift, top[mask])
    shape = whole.shape[:-1]
    return place.reshape(shape), error.reshape(shape)


def _with_shift(rows: Floats, shift: int, top: Integers) -> tuple[Floats, Floats]:
    """Return the results of `highest`, shape (row,), for rows with known highest lines `top` and a common shift."""
    n = rows.shape[-1] - 1
    size = n - 2 * shift
    mean = np.mean(rows, axis=-1, keepdims=True)
    shifted = [_parts(rows[:, i : i + size], mean) for i in (0, shift, 2 * shift)]
    count = shifted[1].shape[-1]
    if count < FIRST_LINE + BESIDE + 1:
        return np.full(len(rows), np.nan), np.full(len(rows), np.inf)
    # in the shorter window the highest line has the same number or one less
    pair = np.clip(top[:, None] - np.array([1, 0]), FIRST_LINE, count - 1 - BESIDE)
    is_same = np.diff(np.take_along_axis(_square(shifted[1]), pair, axis=-1), axis=-1) > 0.0
    near = np.where(is_same, pair[:, 1:], pair[:, :1]) + np.arange(-BESIDE, BESIDE + 1)
    narrow = [np.take_along_axis(parts, near[None], axis=-1) for parts in shifted]
    wide = [2.0 * x[..., 1:-1] - x[..., :-2] - x[..., 2:] for x in narrow]
    unit = n / (2.0 * np.pi * shift)
    of_narrow, of_wide = (unit * _angle(parts) for parts in ([x[..., 1:-1] for x in narrow], wide))
    place = of_wide[:, 1]
    apart, apart_wide = (
        np.max(np.abs(places - place[:, None]), axis=-1) for places in (of_narrow, of_wide)
    )
    with np.errstate(divide="ignore", invalid="ignore"):
        root = np.sqrt(apart)
        unresolved = np.where(apart > 0.0, OF_UNRESOLVED * apart_wide / root, 0.0)
    error = np.maximum(apart, np.minimum(root, unresolved))
    bound = np.where(np.isfinite(error), error, np.inf)
    return np.where(np.isfinite(place), place, top), bound


def _angle(shifted: Sequence[Floats]) -> Floats:
    """Return the phase advance of each line's cosine in one shift, from lines of three windows; NaN if undefined."""
    before, at, after = shifted
    with np.errstate(all="ignore"):
        decay = -_cross(after, at) / _cross(before, at)
        turn = (_dot(after, at) + decay * _dot(before, at)) / _square(at)
        return np.asarray(on_arrays.acos(0.5 * turn / np.sqrt(decay)))


def _square(x: Floats) -> Floats:
    return _dot(x, x)


def _dot(x: Floats, y: Floats) -> Floats:
    """Return the real part of x times the conjugate of y."""
    return np.asarray(x[0] * y[0] + x[1] * y[1])


def _cross(x: Floats, y: Floats) -> Floats:
    """Return the imaginary part of x times the conjugate of y."""
    return np.asarray(x[1] * y[0] - x[0] * y[1])


def peak_frequency(block: MemberBlock, level: int, quantity: str) -> Floats:
    """Return the angular frequency of the highest line of a quantity [rad per unit of time], shape (scheme, case)."""
    return _of_highest(block, level, quantity)[0]


def error_by_other_lines(block: MemberBlock, level: int, quantity: str) -> Floats:
    """Return a bound of the error of `peak_frequency` due to other lines, common to all levels, (scheme, case)."""
    return _of_highest(block, level, quantity)[1]


def _of_highest(block: MemberBlock, level: int, quantity: str) -> tuple[Floats, Floats]:
    record = block.records[level]
    if quantity not in record:
        return np.full(block.shape, np.nan), np.full(block.shape, np.inf)
    duration = block.grid.spacing * (len(block.grid.t) - 1)
    unit = 2.0 * np.pi / duration
    place, error = highest(take_all(block.grid, record, quantity))
    return np.asarray(place * unit), np.asarray(error * unit)
