r"""Inverse hyperbolic functions, from the logarithm in two doubles.

``asinh y = log(y + sqrt(1 + y^2))`` and ``acosh y = log(y + sqrt((y - 1)(y + 1)))`` with the sum in two parts, whose
distance from 1 is known to 2^-75 of it at the least; beyond 1e10 both are ``log 2y``. ``2 atanh y`` is
``log((1 + y)/(1 - y))``: with the quotient ``2^k m``, m in [sqrt(1/2), sqrt(2)), it is ``k log 2 + 2 artanh s``,
``s = ((1 + y) - 2^k (1 - y))/((1 + y) + 2^k (1 - y))``, which is y itself where k = 0.

Source: J.-M. Muller, Elementary Functions, 3rd ed. (2016), section 10.3.
"""

from __future__ import annotations

import math

from vibsim.elementary.doubled import (
    fast_two_sum,
    quotient_parts,
    root_parts,
    two_product,
    two_sum,
)
from vibsim.elementary.logarithm import halves, log_from, log_of_sum
from vibsim.elementary.primitives import two_to

_LARGEST_DOUBLE = 1.7976931348623157e308
_SINGLE_CUBIC = 1.0e-8
_SIXTH = 1.0 / 6.0
_ROOT_IS_ARGUMENT = 1.0e10


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
    """Return the logarithm of ``w + root + behind``, or of 2y where y is above w."""
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
