r"""Error function and its complement.

Below 0.65 ``erf x = x + x P(x^2)``, P of degree 10 (relative error 1e-17). Above,
``erfc x = e^(-x^2) G(q)/(x + 5/8)`` with ``q = (x - 17/4)/(x + 17/4)`` in -0.74 ... 0.74. There
``(x + 5/8) e^(x^2) erfc x`` is between 0.56 and 0.71 and flat at the lower end, so that the rounding of q does not
matter: G of degree 21 (relative error 2e-18), its first coefficient and x^2 in two parts. P and G are weighted
least-squares fits at Chebyshev points with rounded coefficients.

Source: the variable q after M. M. Shepherd and J. G. Laframboise, Chebyshev approximation of (1 + 2x) exp(x^2) erfc x
in 0 <= x < oo, Mathematics of Computation 36 (1981).
"""

from __future__ import annotations

from vibsim.elementary.doubled import fast_two_sum, quotient_parts, two_product, two_sum
from vibsim.elementary.exponential import exp_parts, scaled
from vibsim.elementary.primitives import two_to

_SERIES_BELOW = 0.65
_COMPLEMENT_VANISHES = 27.3
_COMPLEMENT_IS_LOST = 6.5
_CENTRE = 4.25
_SHIFT = 0.625

_F1 = 0.1283791670955126  # 2/sqrt(pi) - 1
_F3, _F5, _F7, _F9, _F11, _F13, _F15, _F17, _F19, _F21 = (
    -0.376126389031843, 0.11283791670995949, -0.02686617065718638, 0.005223977807471603,
    -0.0008548342864536081, 0.00012056173594357075, -1.495326349848587e-05,
    1.7009213320098417e-06, -2.232363695384683e-07, 4.1442178108618865e-08,
)  # fmt: skip

_G0 = 0.630558214581691
_G0_BEHIND = float.fromhex("0x1.22c51429a8acdp-55")
_G1, _G2, _G3, _G4, _G5, _G6, _G7, _G8, _G9, _G10, _G11 = (
    -0.0999458973122256, 0.03902818213243377, 0.007086412811151526, -0.032014073199172724,
    0.037656563263372356, -0.031112606764255212, 0.020274846162066148, -0.010634160064335652,
    0.004380433376163261, -0.0012908367267030277, 0.00017857764730382826,
)  # fmt: skip
_G12, _G13, _G14, _G15, _G16, _G17, _G18, _G19, _G20, _G21 = (
    5.4739379287759646e-05, -3.8672663689257684e-05, 6.625453534349238e-06,
    2.5427197667612824e-06, -1.459766331995438e-06, 1.2089407360219562e-08,
    1.8227974949760044e-07, -3.065309104965274e-08, -1.5566244078222325e-08,
    4.3416820962169115e-09,
)  # fmt: skip


def erf(x: float) -> float:
    """Return ``2/sqrt(pi)`` times the integral of ``e^(-t^2)`` from 0, error below 1 unit in the last place."""
    y = abs(x)
    k, rest, behind = complement_parts(_COMPLEMENT_IS_LOST if y > _COMPLEMENT_IS_LOST else y)
    scale = two_to(k)
    value, cut = fast_two_sum(1.0, -scale * rest)
    value = value + (cut - scale * behind)
    value = value if x > 0.0 else -value
    return x + beyond_argument(x) if y < _SERIES_BELOW else value


def erfc(x: float) -> float:
    """Return ``1 - erf x``, error below 1 unit in the last place; a subnormal result is rounded twice."""
    y = abs(x)
    k, rest, behind = complement_parts(_COMPLEMENT_VANISHES if y > _COMPLEMENT_VANISHES else y)
    value = scaled(rest + behind, k)
    value = value if x > 0.0 else 2.0 - value
    near, cut = fast_two_sum(1.0, -x)
    return near + (cut - beyond_argument(x)) if y < _SERIES_BELOW else value


def beyond_argument(x: float) -> float:
    r"""Return ``erf x - x`` for \|x\| < 0.65."""
    z = x * x
    z2 = z * z
    low = (_F1 + z * _F3) + z2 * (_F5 + z * _F7)
    z4 = z2 * z2
    high = (_F9 + z * _F11) + z2 * (_F13 + z * _F15) + z4 * ((_F17 + z * _F19) + z2 * _F21)
    return x * (low + z4 * high)


def complement_parts(y: float) -> tuple[float, float, float]:
    """Return k, a and b with ``erfc y = 2^k (a + b)``, for y in 0.65 ... 27.3."""
    q = (y - _CENTRE) / (y + _CENTRE)
    q2 = q * q
    q4 = q2 * q2
    q8 = q4 * q4
    low = ((_G1 + q * _G2) + q2 * (_G3 + q * _G4)) + q4 * ((_G5 + q * _G6) + q2 * (_G7 + q * _G8))
    middle = (_G9 + q * _G10) + q2 * (_G11 + q * _G12)
    middle = middle + q4 * ((_G13 + q * _G14) + q2 * (_G15 + q * _G16))
    high = ((_G17 + q * _G18) + q2 * (_G19 + q * _G20)) + q4 * _G21
    g, g_behind = fast_two_sum(_G0, q * (low + q8 * (middle + q8 * high)))
    bottom, bottom_behind = two_sum(y, _SHIFT)
    g, g_behind = quotient_parts(g, g_behind + _G0_BEHIND, bottom, bottom_behind)
    square, error = two_product(y, y)
    k, a, b = exp_parts(-square, -error)
    value, behind = two_product(a, g)
    return k, value, behind + (a * g_behind + b * g)
