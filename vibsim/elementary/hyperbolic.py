r"""Hyperbolic sine, cosine and tangent, and their inverses from the logarithm in two doubles.

``e^y = 2^k (a + b)`` for y = \|x\|; then ``2 cosh y = 2^k (a + b) + 2^-k/(a + b)``, and ``2 sinh y`` is the difference.
Below 1 the difference would cancel, and is replaced by ``sinh y = y + y^3 P(y^2)``, P of degree 6 (Remez with rounded
coefficients, relative error 3e-19).

``asinh y = log(y + sqrt(1 + y^2))`` and ``acosh y = log(y + sqrt((y - 1)(y + 1)))`` with the sum in two parts, whose
distance from 1 has a relative error of at most 2^-75; beyond 1e10 both are ``log 2y``. ``2 atanh y`` is
``log((1 + y)/(1 - y))``: with the quotient ``2^k m``, m in [sqrt(1/2), sqrt(2)), it is ``k log 2 + 2 artanh s``,
``s = ((1 + y) - 2^k (1 - y))/((1 + y) + 2^k (1 - y))``, which is y itself if k = 0.

Source: J.-M. Muller, Elementary Functions, 3rd ed. (2016), section 10.3.
"""

from __future__ import annotations

import math

from vibsim.elementary.doubled import (
    fast_two_sum,
    quotient,
    quotient_parts,
    root_parts,
    two_product,
    two_sum,
)
from vibsim.elementary.exponential import exp_parts, halves, log_from, log_of_sum, scaled
from vibsim.elementary.primitives import two_to

_H3, _H5, _H7, _H9, _H11, _H13, _H15 = (
    0.16666666666666669, 0.008333333333332915, 0.00019841269841589247, 2.7557319108485124e-06,
    2.5052130675237315e-08, 1.6056687167095068e-10, 7.77568811199942e-13,
)  # fmt: skip
_LARGEST_DOUBLE = 1.7976931348623157e308
_SINGLE_CUBIC = 1.0e-8
_SIXTH = 1.0 / 6.0
_ROOT_IS_ARGUMENT = 1.0e10


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
    # an inverse that is too small to matter need not be accurate
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


def asinh(x: float) -> float:
    """Return the inverse hyperbolic sine for every double, error below 1 unit in the last place."""
    y = abs(x)
    far = y > _ROOT_IS_ARGUMENT
    w = _ROOT_IS_ARGUMENT if far else y
    p, error = two_product(w, w)
    h, cut = two_sum(1.0, p)
    root, behind = root_parts(h, cut + error)
    value = log_of_argument_and_root(y, w, root, behind)
    value = y - y * y * y * _SIXTH if y < _SINGLE_CUBIC else value
    value = value if x > 0.0 else -value
    return value if (y > 0.0) & (y <= _LARGEST_DOUBLE) else x


def acosh(x: float) -> float:
    """Return the inverse hyperbolic cosine, error below 1 unit in the last place; NaN below 1."""
    y = x if (x >= 1.0) & (x <= _LARGEST_DOUBLE) else 1.0
    w = _ROOT_IS_ARGUMENT if y > _ROOT_IS_ARGUMENT else y
    less = w - 1.0
    more, cut = two_sum(w, 1.0)
    p, error = two_product(less, more)
    root, behind = root_parts(p, error + less * cut)
    value = log_of_argument_and_root(y, w, root, behind)
    value = math.inf if x > _LARGEST_DOUBLE else value
    return value if x >= 1.0 else math.nan


def log_of_argument_and_root(y: float, w: float, root: float, behind: float) -> float:
    """Return the logarithm of ``w + root + behind``, or of 2y if y exceeds w."""
    u, cut = two_sum(w, root)
    u, rest = fast_two_sum(u, cut + behind)
    far = y > w
    value, below = log_of_sum(y if far else u, 0.0 if far else rest, 1.0 if far else 0.0)
    return value + below


def atanh(x: float) -> float:
    """Return the inverse hyperbolic tangent, error below 1 unit in the last place; NaN beyond -1 ... 1."""
    y = abs(x)
    w = y if y < 1.0 else 0.0
    more, more_behind = fast_two_sum(1.0, w)
    less, less_behind = fast_two_sum(1.0, -w)
    k, _ = halves(more / less)
    scale = two_to(k)
    less, less_behind = scale * less, scale * less_behind
    top, top_cut = two_sum(more, -less)
    bottom, bottom_cut = two_sum(more, less)
    top_cut += more_behind - less_behind
    s, s_behind = quotient_parts(top, top_cut, bottom, bottom_cut + (more_behind + less_behind))
    one = k == 0.0
    value, behind = log_from(k, w if one else s, 0.0 if one else s_behind)
    value = 0.5 * (value + behind)
    value = math.inf if y == 1.0 else value
    value = value if x > 0.0 else -value
    value = value if y > 0.0 else x
    return value if y <= 1.0 else math.nan
