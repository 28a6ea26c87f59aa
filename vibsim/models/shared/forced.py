r"""Linear oscillators under forces made of exponentials, ``u'' + 2 half u' + stiffness u = sum C exp(s t)``.

Source: vibration text (B), exercise 11, and any textbook on vibrations. With the roots l1, l2 of the characteristic
polynomial, the answer to ``C exp(s t)`` from rest is ``C t^2 [l1 t, l2 t, s t] exp``, a divided difference of the
exponential: one formula for every damping and every frequency, resonance and critical damping among them, where
textbooks have a case of its own for each and cancellation in between.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibsim.formula import Binary, Call, Expression, Negate, derivative, literal, names_in, values
from vibsim.models.base import Floats
from vibsim.models.shared.harmonic import damped_motion

Complex = NDArray[np.complex128]
Term = tuple[Any, Any]
"""C and s of ``C exp(s t)``, complex numbers or arrays."""

MOST_TERMS = 64
MOST_POWER = 8
NEAR = 0.5
"""Points of a divided difference that lie closer than this are worked out by a series."""
SERIES_TERMS = 20


def exponentials(node: Expression, numbers: Mapping[str, Any], time: str = "t") -> list[Term]:
    """Write a formula in the time as a sum of exponentials.

    Parameters
    ----------
    numbers
        Values of all other names.

    Returns
    -------
    list
        Pairs of C and s, empty for 0.

    Raises
    ------
    ValueError
        Where the formula is no such sum (see `is_sum_of_exponentials`).
    """
    if time not in names_in(node):
        return [(values(node, numbers) + 0j, 0j)]
    match node:
        case Negate(operand):
            return [(-c, s) for c, s in exponentials(operand, numbers, time)]
        case Binary("+" | "-" as sign, left, right):
            rest = [(c if sign == "+" else -c, s) for c, s in exponentials(right, numbers, time)]
            return [*exponentials(left, numbers, time), *rest]
        case Binary("*", left, right):
            one, other = exponentials(left, numbers, time), exponentials(right, numbers, time)
            return _few([(a * b, p + q) for a, p in one for b, q in other])
        case Binary("/", left, right) if time not in names_in(right):
            divisor = values(right, numbers)
            return [(c / divisor, s) for c, s in exponentials(left, numbers, time)]
        case Binary("**", base, exponent) if _is_small_power(exponent):
            found: list[Term] = [(1.0 + 0j, 0j)]
            factor = exponentials(base, numbers, time)
            for _ in range(int(literal(exponent) or 0)):
                found = _few([(a * b, p + q) for a, p in found for b, q in factor])
            return found
        case Call("sin" | "cos" | "exp" | "sinh" | "cosh" as function, (argument,)):
            return _of_function(function, argument, numbers, time)
    raise ValueError("no sum of exponentials")


def _is_small_power(exponent: Expression) -> bool:
    power = literal(exponent)
    return power is not None and power.is_integer() and 0 <= power <= MOST_POWER


def _few(terms: list[Term]) -> list[Term]:
    if len(terms) > MOST_TERMS:
        raise ValueError("too many exponentials")
    return terms


def _of_function(
    function: str, argument: Expression, numbers: Mapping[str, Any], time: str
) -> list[Term]:
    speed = derivative(argument, time)
    if time in names_in(speed):
        raise ValueError("no sum of exponentials")
    start = values(argument, {**numbers, time: 0.0})
    rate = values(speed, numbers)
    if function == "exp":
        return [(np.exp(start) + 0j, rate + 0j)]
    if function in ("sinh", "cosh"):
        sign = 1.0 if function == "cosh" else -1.0
        return [
            (0.5 * np.exp(start) + 0j, rate + 0j),
            (sign * 0.5 * np.exp(-start) + 0j, -rate + 0j),
        ]
    # of a pair of conjugates one does: only the real part of the answer is taken
    turned = np.exp(1j * start) * (1.0 if function == "cos" else -1j)
    return [(0.5 * turned, 1j * rate), (0.5 * np.conj(turned), -1j * rate)]


def is_sum_of_exponentials(node: Expression, time: str = "t") -> bool:
    """Tell whether `exponentials` can write a formula, whatever the values of its other names."""
    others = {name: 0.5 for name in names_in(node) if name != time}
    try:
        exponentials(node, others, time)
    except ValueError:
        return False
    return True


def forced_motion(
    t: Floats, stiffness: Any, half: Any, u_0: Any, v_0: Any, terms: list[Term]
) -> tuple[Floats, Floats]:
    """Return position and velocity at times `t`, which broadcast against everything else.

    Parameters
    ----------
    stiffness, half
        The coefficients of ``u'' + 2 half u' + stiffness u``.
    u_0, v_0
        Initial position and velocity.
    terms
        The force over the mass, `exponentials`; its imaginary part is 0.
    """
    u, v = damped_motion(t, stiffness, half, u_0, v_0)
    root = np.sqrt(np.asarray(half * half - stiffness, dtype=complex))
    # the root that is larger in size, and the other one from their product, without cancellation
    large = np.where(np.real(half) >= 0.0, -half - root, -half + root)
    small = np.where(large == 0.0, 0.0, stiffness / np.where(large == 0.0, 1.0, large))
    small = np.where(np.imag(root) != 0.0, -half + root, small)
    large = np.where(np.imag(root) != 0.0, -half - root, large)
    with np.errstate(all="ignore"):
        for c, s in terms:
            a, b, e = large * t, small * t, s * t
            u = u + np.real(c * t * t * divided_twice(a, b, e))
            # u' - l u is the answer of the first-order equation that is left; the smaller root cancels less
            v = v + np.real(c * t * (divided(a, e) + b * divided_twice(a, b, e)))
    return np.asarray(u), np.asarray(v)


def divided(a: Any, b: Any) -> Complex:
    """Return the divided difference ``(exp b - exp a)/(b - a)`` of complex numbers, also where they coincide."""
    # from the one that grows more: the other exponential can then only vanish
    is_first = np.real(a) > np.real(b)
    most, gap = np.where(is_first, a, b), np.where(is_first, a - b, b - a)
    is_zero = gap == 0.0
    safe = np.where(is_zero, 1.0, gap)
    return np.asarray(np.exp(most) * np.where(is_zero, 1.0, -np.expm1(-safe) / safe))


def divided_twice(a: Any, b: Any, c: Any) -> Complex:
    """Return the second divided difference of the exponential at three complex numbers, which may coincide."""
    a, b, c = np.broadcast_arrays(a, b, c)
    ab, bc, ca = np.abs(a - b), np.abs(b - c), np.abs(c - a)
    # the two that are farthest apart: the difference of their quotients loses no digits
    first = np.where((ab >= bc) & (ab >= ca), a, np.where(bc >= ca, b, c))
    last = np.where((ab >= bc) & (ab >= ca), b, np.where(bc >= ca, c, a))
    middle = np.where((ab >= bc) & (ab >= ca), c, np.where(bc >= ca, a, b))
    far = np.maximum(np.maximum(ab, bc), ca)
    gap = np.where(far > NEAR, last - first, 1.0)
    apart = (divided(middle, last) - divided(first, middle)) / gap
    return np.asarray(np.where(far > NEAR, apart, _close(a, b, c)))


def _close(a: Complex, b: Complex, c: Complex) -> Complex:
    """Return the second divided difference at points that lie close, by Taylor's series around their mean.

    ``[a, b, c] x^(k+2)`` is the complete symmetric polynomial h_k, by the recursion of its generating function.
    """
    mean = (a + b + c) / 3.0
    x, y, z = a - mean, b - mean, c - mean
    # 1 - e1 X + e2 X^2 - e3 X^3 generates 1/sum h_k X^k, with e1 = 0
    e2, e3 = x * y + y * z + z * x, x * y * z
    h = [np.ones_like(mean), np.zeros_like(mean), -e2]
    total = h[0] / 2.0 + h[2] / 24.0
    factorial = 24.0
    for k in range(3, SERIES_TERMS):
        h.append(-e2 * h[k - 2] + e3 * h[k - 3])
        factorial *= k + 2
        total = total + h[k] / factorial
    return np.asarray(np.exp(mean) * total)
