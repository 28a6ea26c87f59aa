r"""Exact motions of one coordinate: free, damped, driven by exponentials, or with dry friction.

Source: vibration text (B), sections 1, 8 and 10.3, exercise 11.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from vibsim.core.array_types import Complexes, Floats
from vibsim.elementary import on_arrays
from vibsim.elementary.on_arrays import complex_exp, complex_expm1, complex_product, complex_size
from vibsim.formula import Binary, Call, Expression, Negate, derivative, literal, values
from vibsim.models.base import Numbers, State

Term = tuple[Any, Any]
"""C and s of ``C exp(s t)``, complex numbers or arrays."""

MOST_TERMS = 64
MOST_POWER = 8
NEAR = 0.5
"""Largest distance of points at which a divided difference is computed as a series."""
SERIES_TERMS = 20


def harmonic(states: tuple[State, State], frequency: Callable[[Numbers], Any]) -> dict[str, Any]:
    """Return fields of `Model` for ``u'' = -w^2 u``: frequency, exact motion and period; `frequency` returns w."""
    u, v = (state.name for state in states)

    def exact(t: Floats, initial: Numbers, parameters: Numbers) -> dict[str, Floats]:
        return dict(
            zip((u, v), motion(t, frequency(parameters), initial[u], initial[v]), strict=True)
        )

    return {
        "natural_frequency": frequency,
        "exact": exact,
        "exact_period": lambda initial, p: period(frequency(p), initial[u], initial[v]),
    }


def motion(t: Floats, w: Any, u_0: Any, v_0: Any) -> tuple[Floats, Floats]:
    """Return position and velocity at times `t`: vibration text (B), equation (2), for any initial velocity."""
    cos, sin = on_arrays.cos(w * t), on_arrays.sin(w * t)
    return u_0 * cos + v_0 / w * sin, v_0 * cos - u_0 * w * sin


def period(w: Any, u_0: Any, v_0: Any) -> Any:
    """Return ``2 pi/w``, for any amplitude; NaN at rest."""
    rest = (np.asarray(u_0) == 0) & (np.asarray(v_0) == 0)
    return np.where(rest, np.nan, 2 * np.pi / w)


def damped_motion(
    t: Floats, stiffness: Any, half: Any, u_0: Any, v_0: Any
) -> tuple[Floats, Floats]:
    """Return position and velocity of ``u'' + 2 half u' + stiffness u = 0`` at times `t`, in every regime.

    Source: vibration text (B), section 8 and exercise 11; with ``q = sqrt(|stiffness - half^2|)`` the solution is
    ``exp(-half t) (u_0 C + (v_0 + half u_0) S)``, with ``C = cos(q t)``, ``S = sin(q t)/q`` below critical damping,
    1 and t at it, and the hyperbolic functions above it, which are combined with the exponential. The velocity is
    ``exp(-half t) (v_0 (C - half S) - stiffness u_0 S)``.
    """
    with np.errstate(all="ignore"):
        square = stiffness - half * half
        q = np.sqrt(np.abs(square))
        decay = on_arrays.exp(-half * t)
        # half - q and half + q: the smaller from their product, without cancellation
        large = half + np.copysign(q, half)
        small_rate = stiffness / large
        least, most = np.minimum(large, small_rate), np.maximum(large, small_rate)
        fast, slow = on_arrays.exp(-most * t), on_arrays.exp(-least * t)
        angle = q * t
        # at critical damping sin(x)/x and sinh(x)/x are 1
        small = np.abs(angle) < 1e-8
        even, wave = (
            decay * on_arrays.cos(angle),
            np.where(small, decay * t, decay * on_arrays.sin(angle) / q),
        )
        loss = on_arrays.expm1(-2.0 * angle)
        rise = np.where(small, decay * t, -0.5 * slow * loss / q)
        # C + half S and C - half S: above critical damping one of the sums cancels
        is_near, width = 2.0 * angle < 1.0, 2.0 * q
        plus = np.where(is_near, slow * (1.0 - least * loss / width), most * slow - least * fast)
        minus = np.where(is_near, slow * (1.0 + most * loss / width), most * fast - least * slow)
        plus, minus = (np.where(is_near, part, part / width) for part in (plus, minus))
        is_wave = (square >= 0.0) | small
        odd = np.where(square >= 0.0, wave, rise)
        plus = np.where(is_wave, even + half * odd, plus)
        minus = np.where(is_wave, even - half * odd, minus)
    return np.asarray(u_0 * plus + v_0 * odd), np.asarray(v_0 * minus - stiffness * u_0 * odd)


def exponentials(node: Expression, numbers: Mapping[str, Any]) -> list[Term]:
    """Return the terms (C, s) of a formula in t that is a sum of exponentials; `numbers` gives all other names.

    Raises ValueError if the formula is not such a sum (see `is_sum_of_exponentials`).
    """
    if "t" not in node.names:
        return [(values(node, numbers) + 0j, 0j)]
    match node:
        case Negate(operand):
            return [(-c, s) for c, s in exponentials(operand, numbers)]
        case Binary("+" | "-" as sign, left, right):
            signed = [(c if sign == "+" else -c, s) for c, s in exponentials(right, numbers)]
            return [*exponentials(left, numbers), *signed]
        case Binary("*", left, right):
            return _product(exponentials(left, numbers), exponentials(right, numbers))
        case Binary("/", left, right) if "t" not in right.names:
            divisor = values(right, numbers)
            return [(c / divisor, s) for c, s in exponentials(left, numbers)]
        case Binary("**", base, exponent) if _is_small_power(exponent):
            factor, terms = exponentials(base, numbers), [(1.0 + 0j, 0j)]
            for _ in range(int(literal(exponent) or 0)):
                terms = _product(terms, factor)
            return terms
        case Call("sin" | "cos" | "exp" | "sinh" | "cosh" as function, (argument,)):
            return _of_function(function, argument, numbers)
    raise ValueError("no sum of exponentials")


def _is_small_power(exponent: Expression) -> bool:
    power = literal(exponent)
    return power is not None and power.is_integer() and 0 <= power <= MOST_POWER


def _product(left: list[Term], right: list[Term]) -> list[Term]:
    if len(left) * len(right) > MOST_TERMS:
        raise ValueError("too many exponentials")
    return [(complex_product(a, b), p + q) for a, p in left for b, q in right]


def _of_function(function: str, argument: Expression, numbers: Mapping[str, Any]) -> list[Term]:
    speed = derivative(argument, "t")
    if "t" in speed.names:
        raise ValueError("no sum of exponentials")
    start = values(argument, {**numbers, "t": 0.0})
    rate = values(speed, numbers)
    if function == "exp":
        return [(on_arrays.exp(start) + 0j, rate + 0j)]
    if function in ("sinh", "cosh"):
        sign = 0.5 if function == "cosh" else -0.5
        return [
            (0.5 * on_arrays.exp(start) + 0j, rate + 0j),
            (sign * on_arrays.exp(-start) + 0j, -rate + 0j),
        ]
    # a complex conjugate pair
    turned = complex_product(complex_exp(1j * start), 1.0 if function == "cos" else -1j)
    return [(0.5 * turned, 1j * rate), (0.5 * np.conj(turned), -1j * rate)]


def is_sum_of_exponentials(node: Expression) -> bool:
    """Tell whether a formula is a sum of exponentials in t, for any values of its other names."""
    others = {name: 0.5 for name in node.names if name != "t"}
    try:
        exponentials(node, others)
    except ValueError:
        return False
    return True


def forced_motion(
    t: Floats, stiffness: Any, half: Any, u_0: Any, v_0: Any, terms: list[Term]
) -> tuple[Floats, Floats]:
    """Return position and velocity of ``u'' + 2 half u' + stiffness u = sum C exp(s t)`` at times `t`.

    With the roots l1, l2 of the characteristic polynomial, the response to ``C exp(s t)`` from rest is
    ``C t^2 [l1 t, l2 t, s t] exp``, a divided difference of the exponential. This formula covers every damping and
    frequency, including resonance and critical damping, without cancellation near them. All numbers broadcast against
    `t`.

    Parameters
    ----------
    terms
        The force over the mass, from `exponentials`; its imaginary part is 0.
    """
    u, v = damped_motion(t, stiffness, half, u_0, v_0)
    root = np.sqrt(np.asarray(half * half - stiffness, dtype=complex))
    # the root of larger modulus, and the other from their product, without cancellation
    large = np.where(np.real(half) >= 0.0, -half - root, -half + root)
    small = np.where(large == 0.0, 0.0, stiffness / np.where(large == 0.0, 1.0, large))
    small = np.where(np.imag(root) != 0.0, -half + root, small)
    large = np.where(np.imag(root) != 0.0, -half - root, large)
    with np.errstate(all="ignore"):
        for c, s in terms:
            a, b, e = large * t, small * t, s * t
            u = u + np.real(complex_product(c * t * t, divided_twice(a, b, e)))
            # u' - l u solves a first-order equation; the smaller root l cancels less
            response = divided(a, e) + complex_product(b, divided_twice(a, b, e))
            v = v + np.real(complex_product(c * t, response))
    return np.asarray(u), np.asarray(v)


def divided(a: Any, b: Any) -> Complexes:
    """Return the divided difference ``(exp b - exp a)/(b - a)`` of complex numbers, which may coincide."""
    # relative to the larger exponential: the other can underflow, but nothing overflows
    is_first = np.real(a) > np.real(b)
    larger, gap = np.where(is_first, a, b), np.where(is_first, a - b, b - a)
    is_zero = gap == 0.0
    safe = np.where(is_zero, 1.0, gap)
    quotient = np.where(is_zero, 1.0, -complex_expm1(-safe) / safe)
    return np.asarray(complex_product(complex_exp(larger), quotient))


def divided_twice(a: Any, b: Any, c: Any) -> Complexes:
    """Return the second divided difference of the exponential at three complex numbers, which may coincide."""
    a, b, c = np.broadcast_arrays(a, b, c)
    ab, bc, ca = complex_size(a - b), complex_size(b - c), complex_size(c - a)
    # divide by the largest distance, so that the difference of the quotients loses no digits
    order = [(ab >= bc) & (ab >= ca), bc >= ca]
    first, last, middle = (
        np.select(order, row[:2], row[2]) for row in ((a, b, c), (b, c, a), (c, a, b))
    )
    far = np.maximum(np.maximum(ab, bc), ca)
    gap = np.where(far > NEAR, last - first, 1.0)
    second = (divided(middle, last) - divided(first, middle)) / gap
    return np.asarray(np.where(far > NEAR, second, _close(a, b, c)))


def _close(a: Complexes, b: Complexes, c: Complexes) -> Complexes:
    """Return the second divided difference of the exponential at close points, by its Taylor series about their mean.

    ``[a, b, c] x^(k+2)`` is the complete symmetric polynomial h_k, from the recursion of its generating function.
    """
    mean = (a + b + c) / 3.0
    x, y, z = a - mean, b - mean, c - mean
    # 1 - e1 X + e2 X^2 - e3 X^3 generates 1/sum h_k X^k, with e1 = 0
    xy = complex_product(x, y)
    e2, e3 = xy + complex_product(y + x, z), complex_product(xy, z)
    h = [np.ones_like(mean), np.zeros_like(mean), -e2]
    total = h[0] / 2.0 + h[2] / 24.0
    factorial = 24.0
    for k in range(3, SERIES_TERMS):
        h.append(complex_product(e3, h[k - 3]) - complex_product(e2, h[k - 2]))
        factorial *= k + 2
        total = total + h[k] / factorial
    return np.asarray(complex_product(complex_exp(mean), total))


class Swings(NamedTuple):
    """The pieces of a motion with dry friction; arrays that broadcast against the times."""

    direction: Any
    """Direction of the first piece: 1 or -1, 0 if the body sticks from the beginning."""
    radius: Any
    """Amplitude of the first piece."""
    angle: Any
    """``w t`` at the end of the first piece."""
    turn: Any
    """Position at the end of the first piece."""
    count: Any
    """Number of half periods after the first piece; infinite without friction."""


def swings(w: Any, c: Any, u_0: Any, v_0: Any) -> Swings:
    """Return the pieces of the motion from initial values; all arguments broadcast."""
    sticks = np.abs(u_0) <= c
    direction = np.where(v_0 == 0, np.where(sticks, 0.0, -np.sign(u_0)), np.sign(v_0))
    offset = u_0 + direction * c
    radius = np.where(direction == 0, 0.0, on_arrays.hypot(offset, v_0 / w))
    # the first piece ends at the turning point on the side of `direction`
    start = on_arrays.atan2(np.abs(v_0) / w, direction * offset)
    turn = np.where(direction == 0, u_0, direction * (radius - c))
    with np.errstate(divide="ignore", invalid="ignore"):
        count = np.ceil((np.abs(turn) - c) / (2.0 * c))
    count = np.where(np.abs(turn) <= c, 0.0, count)
    return Swings(direction, radius, np.where(direction == 0, 0.0, start), turn, count)


def friction_motion(t: Floats, w: Any, c: Any, u_0: Any, v_0: Any) -> tuple[Floats, Floats]:
    """Return position and velocity of ``u'' + w^2 u + w^2 c sign(u') = 0`` at times `t`: B, (86) with c = mu m g/k.

    While the body slides in the direction s = 1 or -1, it oscillates harmonically about ``-s c``. The first piece ends
    at the first zero of the velocity. Every further piece takes half a period, ``pi/w``, and the distance of the
    turning point from the origin decreases by 2 c, until it is at most c: there the body sticks for ever.
    """
    s = swings(w, c, u_0, v_0)
    phase = w * t
    with np.errstate(invalid="ignore"):
        done = np.clip(np.floor((phase - s.angle) / np.pi), 0.0, s.count)
        size = np.abs(s.turn) - 2.0 * c * done
        side = np.sign(s.turn) * np.where(done % 2 == 0, 1.0, -1.0)
        # a piece that begins at rest at x slides towards the origin and oscillates about -s c = sign(x) c
        late = phase - s.angle - np.pi * done
        u = side * (c + (size - c) * on_arrays.cos(late))
        v = -side * (size - c) * w * on_arrays.sin(late)
        first = phase < s.angle
        early = phase - s.angle
        u = np.where(first, s.direction * (s.radius * on_arrays.cos(early) - c), u)
        v = np.where(first, -s.direction * s.radius * w * on_arrays.sin(early), v)
        rests = ~first & (done >= s.count)
        u = np.where(rests, side * size, u)
        u = np.where(s.direction == 0, u_0, u)
        v = np.where(rests | (s.direction == 0), 0.0, v)
    return np.asarray(u), np.asarray(v)
