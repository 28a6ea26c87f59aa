r"""Large arguments of the circular functions: x modulo pi/2 in whole numbers.

``x = M 2^E`` with a whole M below 2^53. Of 1/pi only the digits matter that do not become multiples of whole turns by
the multiplication, and are not too small to count: seven digits of 30 bits, whose products are exact in 64 bits. They
leave an error of 2^-127 of half a turn. No double is nearer to a multiple of pi/2 than about 2^-62, so that the
remainder has 64 right bits or more.

Source: M. Payne and R. Hanek, Radian reduction for trigonometric functions, SIGNUM Newsletter 18 (1983);
J.-M. Muller, Elementary Functions, 3rd ed. (2016), section 11.4.
"""

from __future__ import annotations

from vibsim.elementary.doubled import fast_two_sum, two_product
from vibsim.elementary.primitives import exponent_of, mantissa_of, two_to

# 1/pi in digits of 30 bits, two zeros first so that every argument begins behind its first digit
_INVERSE_PI_DIGITS = (
    0, 0,
    341782637, 846340265, 335040175, 687512174, 941321298, 751428124, 545520802, 836104029,
    950810340, 594661906, 463847436, 613905668, 976372639, 820992229, 575884925, 876681978,
    634874000, 659350401, 224968444, 547145963, 120613479, 262464546, 1058503666, 337481724,
    318766016, 750813049, 505616052, 87461814, 651155940, 1045974458, 512523981, 254801174,
    782563160, 1063202699, 913968755, 1002776905, 491618155, 1032387690, 974171142,
)  # fmt: skip
_DIGIT = 1073741823  # 2^30 - 1
_SMALL = 2.0**-30
HALF_PI = float.fromhex("0x1.921fb54442d18p+0")
HALF_PI_REST = float.fromhex("0x1.1a62633145c07p-54")
"""The second part of pi/2."""


def quarter_turns(y: float) -> tuple[int, float, float]:
    r"""Return q in 0 ... 3, r and a rest with ``y = (q + 4 n) pi/2 + r + rest``, \|r\| <= pi/4.

    For finite y >= 1; error below 2^-64 of r.
    """
    exponent = int(exponent_of(y)) + 8
    first = (exponent - 1) // 30
    shift = 30 * (first + 1) - exponent
    whole = int(mantissa_of(y) * 4503599627370496.0)
    high, low = whole >> 30, whole & _DIGIT
    # the digits of M/pi, last one first: schoolbook multiplication
    behind = carry = 0
    d_6 = d_5 = d_4 = d_3 = d_2 = d_1 = 0
    for j in range(first + 6, first - 1, -1):
        digit = _INVERSE_PI_DIGITS[j]
        carry += low * digit + high * behind
        d_1, d_2, d_3, d_4, d_5, d_6 = d_2, d_3, d_4, d_5, d_6, carry & _DIGIT
        carry >>= 30
        behind = digit
    unit = 1 << (29 + shift)
    leading = ((d_6 & ((2 << shift) - 1)) << 30) + d_5
    q = (leading + (unit >> 1)) // unit
    leading -= q * unit
    sign = 1.0
    if leading < 0:
        sign = -1.0
        leading = -1 - leading
        d_4, d_3, d_2, d_1 = _DIGIT - d_4, _DIGIT - d_3, _DIGIT - d_2, _DIGIT - d_1
    f, g = sum_of_digits(leading, d_4, d_3, d_2, d_1)
    scale = sign * two_to(-29.0 - shift)
    r, rest = two_product(f * scale, HALF_PI)
    return q & 3, r, rest + scale * (f * HALF_PI_REST + g * HALF_PI)


def sum_of_digits(leading: int, d_4: int, d_3: int, d_2: int, d_1: int) -> tuple[float, float]:
    """Return ``leading + d_4 2^-30 + d_3 2^-60 + ...`` in two parts, for leading in 0 ... 2^60."""
    f, e_1 = fast_two_sum(float(leading >> 30) / _SMALL, float(leading & _DIGIT))
    f, e_2 = fast_two_sum(f, float(d_4) * _SMALL)
    f, e_3 = fast_two_sum(f, float(d_3) * _SMALL * _SMALL)
    f, e_4 = fast_two_sum(f, float(d_2) * _SMALL * _SMALL * _SMALL)
    f, e_5 = fast_two_sum(f, float(d_1) * _SMALL * _SMALL * _SMALL * _SMALL)
    return fast_two_sum(f, e_1 + (e_2 + (e_3 + (e_4 + e_5))))
