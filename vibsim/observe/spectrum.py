r"""The frequencies in a stored series: amplitudes of its lines, and the frequency of the highest one.

With Hann's window ``h_j = 1 - cos(2 pi j/n)`` on n samples in the time T, less their mean,

    X_k = (2/n) sum h_j (u_j - mean) exp(-2 pi i j k/n),    line k at the angular frequency 2 pi k/T,

a cosine of amplitude A on line k has ``|X_k| = A``. Between two lines k and k + 1 its frequency follows from the larger
two, exactly but for what its negative frequency leaves there, of the size 1/k^3:

    r = |X_(k+1)|/|X_k|,    w = 2 pi/T (k + (2 r - 1)/(r + 1)).

Every level has its own samples. What is faster than half their frequency appears at another one (aliasing).

Source: F. J. Harris, On the use of windows for harmonic analysis, Proc. IEEE 66 (1978) 51-83; T. Grandke, Interpolation
algorithms for discrete Fourier transforms of weighted signals, IEEE Trans. Instrum. Meas. 32 (1983) 350-355.
"""

from __future__ import annotations

import numpy as np

from vibsim.core.array_types import Flags, Floats
from vibsim.elementary import on_arrays
from vibsim.observe.common_grid import take_all
from vibsim.observe.member_block import MemberBlock

OF_NEGATIVE = 0.1
"""What the negative frequency of a cosine on line k moves its frequency by at most, in lines, times k^3. [measured:
0.08 on line 3, 0.07 from line 10 on]"""
FIRST_LINE = 3
"""The lowest line whose frequency is reported: below it, a negative frequency is too near."""


def lines(series: Floats) -> Floats:
    """Return the amplitude of every line of series of shape (..., t), whose last sample is left out; (..., line)."""
    own = np.asarray(series, dtype=np.float64)[..., :-1]
    n = own.shape[-1]
    window = 1.0 - on_arrays.cos(2.0 * np.pi / n * np.arange(n))
    centred = own - np.mean(own, axis=-1, keepdims=True)
    return np.asarray(2.0 / n * np.abs(np.fft.rfft(window * centred, axis=-1)))


def highest(series: Floats) -> Floats:
    """Return the number of the highest line, with its part between two lines; NaN where it is no such line."""
    found = lines(series)
    if found.shape[-1] < FIRST_LINE + 2:
        return np.full(found.shape[:-1], np.nan)
    known: Flags = np.asarray(np.isfinite(found).all(axis=-1))
    k = np.argmax(np.where(known[..., None], found, 0.0), axis=-1)
    inner = np.clip(k, 1, found.shape[-1] - 2)
    below, at, above = (
        np.take_along_axis(found, (inner + shift)[..., None], axis=-1)[..., 0]
        for shift in (-1, 0, 1)
    )
    side = np.where(above >= below, 1.0, -1.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.maximum(above, below) / at
    place = inner + side * (2.0 * ratio - 1.0) / (ratio + 1.0)
    return np.where(known & (k == inner) & (k >= FIRST_LINE), place, np.nan)


def peak_frequency(block: MemberBlock, level: int, quantity: str) -> Floats:
    """Return the angular frequency of the highest line of a quantity [rad per unit of time], shape (scheme, case)."""
    record = block.records[level]
    if quantity not in record:
        return np.full(block.shape, np.nan)
    return highest(take_all(block.grid, record, quantity)) * _between_lines(block)


def off(block: MemberBlock, level: int, quantity: str) -> Floats:
    """Return how far `peak_frequency` may be off on every level alike, for its negative frequency, (scheme, case)."""
    unit = _between_lines(block)
    return np.asarray(
        OF_NEGATIVE * unit * on_arrays.power(unit / peak_frequency(block, level, quantity), 3.0)
    )


def _between_lines(block: MemberBlock) -> Floats:
    """Return the distance of two lines [rad per unit of time], shape (case,) or (1,)."""
    duration = block.grid.spacing * (len(block.grid.t) - 1)
    return np.asarray(2.0 * np.pi / duration)
