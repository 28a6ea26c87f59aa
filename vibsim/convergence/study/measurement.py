"""Inner products, norms and noise of values at common points: the input of the assessment."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from decimal import Decimal

import numpy as np

from vibsim.convergence.error_model.ladder import Ladder
from vibsim.core.array_types import Flags, Floats

SINGLE = float(np.finfo(np.float32).eps)
"""Relative spacing of single precision."""
LARGEST = 1e150
"""Upper limit of scaled values, so that their squares do not overflow."""
FURTHEST = 1e100
"""Upper limit of the distance from the exact solution and of the noise, relative to the size of the values."""
FEW_DIGITS = 11
"""Values with at most this number of decimal digits were rounded: calculated ones have 15 and more."""
BINARY = 2.0**20
"""Multiples of 1/`BINARY`, such as 0.125, 3 or 65, have few digits anyway and may not be rounded."""
COUNTED = 100.0
"""From this size on, whole numbers are assumed to be rounded."""
IN_STEPS = 4
"""Number of finest levels that show whether values come in steps; coarser ones may agree because all blew up."""
SINGLE_DIGITS = 7
"""Least number of printed digits that indicates single precision."""
SAMPLED = 64
"""Number of values of a level whose digits are counted."""


@dataclass(frozen=True)
class Measurement:
    """The measurements of the ladders of all members."""

    ladder: Ladder
    """In units of `scale`, with the leading dimension member."""
    scale: Floats
    """A power of two for each member, so that squares neither overflow nor vanish, shape (member,)."""
    norms: Floats
    """Root mean square of the values of each level, shape (member, n)."""
    epsilon: Floats
    """Relative spacing of the precision of the finest level, shape (member,)."""


def scale_of(values: Floats) -> Floats:
    """Return a power of two near the size of the finest level of each member, shape (member,).

    It is larger if a coarse level has blown up, whose square would overflow. `values`: shape (member, n, points).
    """
    sizes = np.max(np.abs(values), axis=2)
    size = np.maximum(sizes[:, -1], np.max(sizes, axis=1) / LARGEST)
    return np.asarray(np.ldexp(1.0, np.frexp(np.where(size > 0.0, size, 1.0))[1] - 1))


def half_last_digits(
    values: Floats,
    few: int = FEW_DIGITS,
    *,
    of_binary: bool = False,
    written: Sequence[Decimal] | None = None,
) -> Floats:
    """Return half a unit of the last decimal digit of the values of each level, shape (n,).

    It is the largest rounding error of values that were printed or stored with at most `few` digits, and 0 for others.
    The values may share the number of decimal places or the number of digits; the larger unit counts. Finite `values`
    have the shape (n, points).

    Binary fractions have few digits anyway: without `of_binary` they count as exact. If the levels are numbers as
    `written`, zeros at the end count as digits.
    """
    if written is not None and any(map(_is_padded, written)):
        return _half_units(written)
    none, sampled = np.zeros(len(values)), values[:, :: -(-values.shape[1] // SAMPLED)]
    largest, digits = float(np.max(np.abs(sampled))), 1
    size = last = Decimal(repr(largest)).adjusted()
    for value in sampled[::-1].flat:
        number = Decimal(repr(float(value))).normalize()
        if number:
            last = min(last, int(number.as_tuple().exponent))
            digits = max(digits, len(number.as_tuple().digits))
        if size - last >= few:
            return none
    is_binary, is_whole = are_binary(sampled), np.all(sampled == np.rint(sampled))
    if np.all(is_binary) and not (largest >= COUNTED if is_whole else of_binary):
        return none
    units = np.full(len(values), min(last, 0) if is_whole else last)
    if not is_whole:
        # 0.5 or 1 may be exact
        own = np.max(np.where(is_binary, 0.0, np.abs(sampled)), axis=1)
        sizes = [Decimal(repr(x)).adjusted() if x else last for x in own.tolist()]
        units = np.maximum(units, np.array(sizes) - digits + 1)
    return np.array([_half_unit(unit) for unit in units.tolist()])


def are_binary(values: Floats) -> Flags:
    """Say which values are multiples of 1/`BINARY`, such as 0.125 or 3, which may be exact."""
    with np.errstate(over="ignore"):
        return np.asarray(values * BINARY == np.rint(values * BINARY))


def _half_unit(exponent: int) -> float:
    """Return half a unit of the digit with this power of ten."""
    return float(Decimal(5).scaleb(exponent - 1))


def _is_padded(number: Decimal) -> bool:
    """Say whether a number is written with zeros that show its precision: 1.20, but not 120 or 1.0."""
    _, digits, last = number.as_tuple()
    return last not in (-1, 0) and isinstance(last, int) and digits[-1] == 0


def _half_units(written: Sequence[Decimal]) -> Floats:
    """Return half a unit of the last digit of numbers that share the number of decimal places or of digits."""
    last = min(int(number.as_tuple().exponent) for number in written)
    digits = max(len(number.as_tuple().digits) for number in written)
    units = (max(last, number.adjusted() - digits + 1) if number else last for number in written)
    return np.array([_half_unit(unit) for unit in units])


def half_written(number: Decimal) -> float:
    """Return half a unit of the last digit of a finite number as written; zeros at its end count."""
    last = number.as_tuple().exponent
    return _half_unit(last) if isinstance(last, int) else 0.0


def rounding_of_sizes(h: Floats) -> Floats:
    """Return half a unit of the last digit of step sizes that may be rounded, else 0; shape (n,).

    Sizes with a constant ratio count as exact: rounding would change the ratio.
    """
    ratios = h[1:] / h[:-1]
    numbers = [Decimal(repr(float(size))).normalize() for size in h]
    digits = max(len(number.as_tuple().digits) for number in numbers)
    if digits >= FEW_DIGITS or np.ptp(ratios) <= SINGLE * np.max(ratios):
        return np.zeros_like(h)
    return np.array([_half_unit(x.adjusted() - digits + 1) for x in numbers])


def step_of_values(values: Floats) -> float:
    """Return the least difference of levels if values come in steps, such as a largest value over grid points; else 0.

    They do if some of the finest `IN_STEPS` levels are equal to the last bit and others differ by more than round-off.
    Coarser levels count only if all of these are equal. The values are off by about one step. They have the shape
    (n, points).
    """
    sizes = np.max(np.abs(np.diff(values, axis=0)), axis=1)
    finest = sizes[1 - IN_STEPS :]
    if np.all(finest > 0.0):
        return 0.0
    steps = sizes > np.finfo(np.float64).eps * np.max(np.abs(values))
    among = finest[steps[1 - IN_STEPS :]] if np.any(finest) else sizes[steps]
    return float(np.min(among, initial=np.inf)) if len(among) else 0.0


def is_single(values: Floats) -> bool:
    """Say whether finite values, shape (n, points), have single precision, stored or printed."""
    sampled = values[:, :: -(-values.shape[1] // SAMPLED)].ravel()
    with np.errstate(over="ignore"):
        single = sampled.astype(np.float32)
    if np.all(single == sampled):
        # a value with few bits may be exact
        bits = np.frexp(sampled)[0] * BINARY
        return bool(np.any(bits != np.rint(bits)))
    digits = 0
    for value, near in zip(sampled.tolist(), single, strict=True):
        if float(str(near)) != value:
            return False
        digits = max(digits, len(Decimal(repr(value)).normalize().as_tuple().digits))
    return digits >= SINGLE_DIGITS


def measurement(
    values: Floats, h: Floats, epsilon: Floats, noise: float | None, exact: Floats | None
) -> Measurement:
    """Return the ladder of finite values.

    Parameters
    ----------
    values
        Shape (member, n, points), the coarsest level first.
    h
        Step sizes, strictly decreasing, shape (n,).
    epsilon
        Relative spacing of the precision of every level, shape (n,).
    noise
        Root mean square of the noise of each level, as stated by the user; None for round-off alone.
    exact
        Exact values, shape (member, points); None if unknown.
    """
    scale = scale_of(values)
    scaled = values / scale[:, None, None]
    points = values.shape[2]
    norms = np.sqrt(np.mean(scaled * scaled, axis=-1))
    rows = scaled[:, :-1] - scaled[:, 1:]
    if exact is not None:
        with np.errstate(over="ignore"):
            true_error = scaled[:, -1] - exact / scale[:, None]
        # the square of a larger distance would overflow
        true_error = np.clip(true_error, -FURTHEST, FURTHEST)
        rows = np.concatenate([rows, true_error[:, None]], axis=1)
    with np.errstate(over="ignore"):
        gram = np.matmul(rows, np.swapaxes(rows, 1, 2)) / points
    single = np.array([is_single(rows) for rows in values])[:, None]
    epsilon = np.where(single, np.maximum(epsilon, SINGLE), np.broadcast_to(epsilon, norms.shape))
    floor = 0.5 * epsilon * norms
    if noise is not None:
        # the square of larger noise would overflow
        with np.errstate(over="ignore"):
            floor = np.maximum(floor, np.minimum(noise / scale[:, None], FURTHEST))
    ladder = Ladder(
        h=h,
        gram=gram,
        floor=floor,
        numbers=np.full(len(values), points == 1),
        exact_known=exact is not None,
    )
    return Measurement(ladder, scale, norms * scale[:, None], epsilon[:, -1])
