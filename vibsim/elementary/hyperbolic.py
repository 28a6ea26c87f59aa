r"""Hyperbolic sine, cosine and tangent.

``e^y = 2^k (a + b)`` for y = \|x\|; with the inverse of it ``2 cosh y = 2^k (a + b) + 2^-k/(a + b)``, ``2 sinh y`` the
difference. Below 1 the difference would cancel, and ``sinh y = y + y^3 P(y^2)`` takes its place, P of degree 6 (Remez
with rounded coefficients, relative error 3e-19).

Source: J.-M. Muller, Elementary Functions, 3rd ed. (2016), section 10.3.
"""

from __future__ import annotations

from vibsim.elementary.doubled import fast_two_sum, quotient
from vibsim.elementary.exponential import exp_parts, scaled
from vibsim.elementary.primitives import two_to

_H3 = 0.16666666666666669
_H5 = 0.008333333333332915
_H7 = 0.00019841269841589247
_H9 = 2.7557319108485124e-06
_H11 = 2.5052130675237315e-08
_H13 = 1.6056687167095068e-10
_H15 = 7.77568811199942e-13


def sinh(x: float) -> float:
    """Return the hyperbolic sine for every double, error below 1 unit in the last place."""
    k, value, behind, _, _ = hyperbolic_parts(abs(x))
    value = scaled(value + behind, k - 1.0)
    value = value if x > 0.0 else -value
    return value if abs(x) > 0.0 else x


def cosh(x: float) -> float:
    """Return the hyperbolic cosine for every double, error below 1 unit in the last place."""
    k, _, _, value, behind = hyperbolic_parts(abs(x))
    return scaled(value + behind, k - 1.0)


def tanh(x: float) -> float:
    """Return the hyperbolic tangent for every double, error below 1 unit in the last place."""
    # from 22 on it rounds to 1
    y = 22.0 if abs(x) > 22.0 else abs(x)
    _, s, s_behind, c, c_behind = hyperbolic_parts(y)
    value = quotient(s, s_behind, c, c_behind)
    value = value if x > 0.0 else -value
    return value if abs(x) > 0.0 else x


def hyperbolic_parts(y: float) -> tuple[float, float, float, float, float]:
    """Return k, ``2^(1-k) sinh y`` and ``2^(1-k) cosh y``, both in two parts, for ``y >= 0``; NaN for NaN."""
    k, a, b = exp_parts(711.0 if y > 711.0 else y, 0.0)
    a, b = fast_two_sum(a, b)
    # where the inverse is too small to count it need not be right
    near = 100.0 if k > 100.0 else k
    inverse = two_to(-2.0 * near) / a
    inverse_behind = -b * inverse / a
    c, cut = fast_two_sum(a, inverse)
    c_behind = cut + (b + inverse_behind)
    s, cut = fast_two_sum(a, -inverse)
    s_behind = cut + (b - inverse_behind)
    scale = two_to(1.0 - near)
    small = y < 1.0
    s = scale * y if small else s
    s_behind = scale * beyond_linear(y) if small else s_behind
    return k, s, s_behind, c, c_behind


def beyond_linear(y: float) -> float:
    """Return ``sinh y - y`` for y in 0 ... 1."""
    z = y * y
    z2 = z * z
    p = (_H3 + z * _H5) + z2 * (_H7 + z * _H9) + (z2 * z2) * ((_H11 + z * _H13) + z2 * _H15)
    return y * z * p
