"""Selection, sign, rounding to integers, remainder and square root: exact or correctly rounded.

Unlike Python's `min` and `max`, these functions return NaN for NaN in any argument that decides: NaN marks a missing
value of a fast function, which a comparison would hide.

Doubles of at least 2^52 are integers; smaller ones are rounded by adding and subtracting 2^52. The remainder
``a - q b`` of positive numbers is exactly a double: it is computed with a product in two parts while q fits into a
double, otherwise in integer arithmetic, ten bits of the quotient at a time.
"""

from __future__ import annotations

import math
from typing import Any

from vibsim.elementary.doubled import nearest_whole, two_product
from vibsim.elementary.exponential import scaled
from vibsim.elementary.primitives import exponent_of, mantissa_of

_TWO_52 = 4503599627370496.0
_SMALLEST_NORMAL = 2.2250738585072014e-308
_LARGEST_DOUBLE = 1.7976931348623157e308
_TO_NORMAL = 18014398509481984.0  # 2^54
_LARGEST_QUOTIENT = 1.0e15
_SMALLEST_DIVISOR = 1.0e-270
_LARGEST_DIVISOR = 1.0e270
_QUOTIENT_BITS = 10


def absolute(x: float) -> float:
    """Return the absolute value of `x`."""
    return math.fabs(x)


def sqrt(x: float) -> float:
    """Return the square root, correctly rounded; NaN below zero."""
    # plain Python refuses negative arguments
    return math.sqrt(x if x >= 0.0 else math.nan)


def sign(x: float) -> float:
    """Return -1, 0 or 1; NaN for NaN."""
    side = 1.0 if x > 0.0 else -1.0
    side = 0.0 if x == 0.0 else side
    return side if x == x else x


def heaviside(x: float) -> float:
    """Return Heaviside's step function: 0 below 0, 1/2 at 0, 1 above; NaN for NaN."""
    value = 1.0 if x > 0.0 else 0.0
    value = 0.5 if x == 0.0 else value
    return value if x == x else x


def smaller(a: float, b: float) -> float:
    """Return the smaller argument, `a` if they are equal; NaN if one is NaN."""
    least = b if b < a else a
    return least if b == b else b


def larger(a: float, b: float) -> float:
    """Return the larger argument, `a` if they are equal; NaN if one is NaN."""
    most = b if b > a else a
    return most if b == b else b


def where(condition: float, yes: float, no: float) -> float:
    """Return `yes` if the condition is not zero, otherwise `no`; NaN if the condition is NaN."""
    chosen = yes if condition != 0.0 else no
    return chosen if condition == condition else math.nan


def nearest(x: float) -> float:
    """Return the integer nearest to `x`, ties to even, for every double."""
    value = math.copysign((abs(x) + _TWO_52) - _TWO_52, x)
    return value if abs(x) < _TWO_52 else x


def floor(x: float) -> float:
    """Return the largest integer that is not above `x`."""
    return rounded_down(x)


def ceil(x: float) -> float:
    """Return the smallest integer that is not below `x`."""
    return -rounded_down(-x)


def rounded_down(x: float) -> float:
    """Return the same as `floor`: a kernel may compile a function that formulas call separately."""
    value = nearest(x)
    return value - 1.0 if value > x else value


def mod(x: float, y: float) -> float:
    """Return ``x - floor(x/y) y``, correctly rounded: between 0 and y, with the sign of y, as Python's ``%``.

    NaN for an infinite x and for y = 0, where Python raises.
    """
    a, b = abs(x), abs(y)
    if x != x or y != y or a > _LARGEST_DOUBLE or b == 0.0:
        return math.nan
    if a < b:
        return signed(a, b, x, y)
    if _SMALLEST_DIVISOR <= b <= _LARGEST_DIVISOR and a <= _LARGEST_QUOTIENT * b:
        return signed(remainder_near(a, b), b, x, y)
    return signed(remainder_far(a, b), b, x, y)


def mod_fast(x: float, y: float) -> float:
    r"""Return `mod` for \|y\| in 1e-270 ... 1e270 and \|x\| <= 1e15 \|y\|; otherwise NaN."""
    a, b = abs(x), abs(y)
    usual = (b >= _SMALLEST_DIVISOR) & (b <= _LARGEST_DIVISOR) & (a <= _LARGEST_QUOTIENT * b)
    b = b if usual else 1.0
    value = signed(remainder_near(a if usual else 0.0, b), b, x, y)
    return value if usual else math.nan


def signed(rest: float, b: float, x: float, y: float) -> float:
    """Return the remainder of x and y from that of their absolute values; b is the absolute value of y."""
    size = rest if (x < 0.0) == (y < 0.0) else b - rest
    return math.copysign(0.0 if rest == 0.0 else size, y)


def remainder_near(a: float, b: float) -> float:
    """Return the remainder of ``0 <= a <= 1e15 b``."""
    q = nearest_whole(a / b)
    p, error = two_product(q, b)
    rest = (a - p) - error
    return rest + b if rest < 0.0 else rest


def remainder_far(a: float, b: float) -> float:
    """Return the remainder of finite ``a >= b > 0``, in integer arithmetic."""
    rest, exponent_a = whole_and_exponent(a)
    divisor, exponent_b = whole_and_exponent(b)
    rest %= divisor
    left = exponent_a - exponent_b
    while left > 0:
        step = left if left < _QUOTIENT_BITS else _QUOTIENT_BITS
        rest = (rest << step) % divisor
        left -= step
    return scaled(float(rest), float(exponent_b))


def whole_and_exponent(x: float) -> tuple[int, int]:
    """Return integers M < 2^53 and E with ``x = M 2^E``, for finite x > 0."""
    tiny = x < _SMALLEST_NORMAL
    normal = x * _TO_NORMAL if tiny else x
    exponent = int(exponent_of(normal)) - (106 if tiny else 52)
    return int(mantissa_of(normal) * _TWO_52), exponent


def whole_power(base: Any, exponent: int) -> Any:
    """Return an integer power of a float or an array by multiplication, with the bits of kernels."""
    if exponent == 0:
        return 1.0
    result = base
    for bit in bin(abs(exponent))[3:]:
        result = result * result
        if bit == "1":
            result = result * base
    return result if exponent > 0 else 1.0 / result
