r"""Orders of the phase and of the amplitude of a scheme's error on ``u'' + g u' + u = 0``, from its step and its start.

Time is measured in units of ``1/w``, so that ``h = w dt`` and ``g = c/w`` for a damping rate c. The functions of the
scheme itself run on series in h with exact coefficients (`vibsim.theory.laurent`). Two of the eigenvalues of its step
tend to ``exp(lambda h)``, ``lambda = -g/2 +- i w_d``; they are the roots of ``x^2 - T x + D``. The component of the
start in their plane, the principal part y, is the solution after parasitic parts have decayed:

    y(t) = Re(B~ exp(lambda~ t)),      lambda~ = s~ +- i w~,   D = exp(2 s~ h),   T = 2 exp(s~ h) cos(w~ h)

The exact motion is ``Re(B exp(lambda t))``, so that

    L(t)  =  (lambda~ - lambda) t + log(B~/B),      phi  =  Im L/w_d,      alpha  =  Re L + (g/2) phi

are the time by which it is early and the logarithm of its amplitude factor, both linear in t:
``u_h = exp(alpha(t)) U(t + phi(t))``. The growth with t depends on the step alone; the constant part, ``B~/B``, on the
start and the initial values. The parasitic part of the position at t = 0 affects one sample, and is an error of both.
The order of phase or amplitude is the lowest of these three. If all known powers of h vanish (twice as many as any
scheme has), the part is exact: its order is infinite.

The order holds for the given initial values: it is the first power of h whose coefficient is not 0 for them.

Source: vibration text (B), sections 4.1-4.4, 5.6 and 7.1 with `errata`; exercises 10 and 17.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property, lru_cache
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vibsim.core.array_types import Floats
from vibsim.schemes.base import Stepper
from vibsim.theory.arithmetic import bairstow, by_quadratic, characteristic
from vibsim.theory.basis import NoSeriesError, require_formula, unit_steps
from vibsim.theory.laurent import (
    HALF,
    ROUNDED,
    SUBSTITUTES,
    Field,
    Laurent,
    coefficients,
    in_reals,
)

CRITICAL = 2.0
"""Critical damping rate over w: from here on nothing oscillates."""
KNOWN_POWERS = 14
"""Power of h at which series are truncated; division by powers of h loses some of them."""
_FEW = 64
"""Largest number of starts whose results are cached: every sentence on a result needs its order again."""

Pair = NDArray[Any]
"""Two series: the coefficients of ``u_0`` and V in an expression that is linear in the initial values."""


@dataclass(frozen=True, eq=False)
class Principal:
    """A step, and the quadratic factor of its characteristic polynomial with the principal roots, as series in h."""

    matrix: NDArray[Any]
    """Shape (s, s)."""
    starts: NDArray[Any]
    """State at step 1 from the initial position 1, and from the initial velocity 1 (in units of w), shape (2, s)."""
    polynomial: list[Laurent]
    """The characteristic polynomial, the highest power first, without roots that are 0 for every h."""
    trace: Laurent
    determinant: Laurent

    @cached_property
    def square(self) -> Laurent:
        """The square of ``w~ h``."""
        return (self.trace * HALF * self.determinant**-HALF).square_of_angle()


def principal(stepper: Stepper, damping: float, known: int) -> Principal:
    """Return a step on ``u'' + g u' + u = 0`` in series that are truncated at the power `known` of h.

    They are exact, or real numbers where only the rounding of the scheme's coefficients lies between ``w~`` and ``w_d``
    at h = 0. Raises `NoSeriesError` if more lies between them, or if the step compares numbers.
    """
    require_formula(stepper)
    exact = coefficients(stepper)
    half = Fraction(repr(damping)) / 2
    for domain, elements in (exact, in_reals(*exact)):
        with suppress(ValueError, ZeroDivisionError):
            step = _principal(stepper, damping, Field(domain, known), elements)
            if (step.square.shifted(-2) - (1 - half * half)).vanishes:
                return step
    raise NoSeriesError("the numerical frequency does not tend to w as dt tends to 0")


def _principal(
    stepper: Stepper, damping: float, field: Field, elements: Mapping[str, Any]
) -> Principal:
    """Return a step in series with coefficients in a field; `elements` has those of the scheme.

    The quadratic factor is ``(x - 1)^2`` at h = 0, where the quotient has no root 1 if the scheme converges. So it
    exists and is unique (Hensel's lemma), and Bairstow's method doubles the number of correct powers. Raises ValueError
    if there is none, as with rounded coefficients in exact numbers, and ZeroDivisionError if there are several.
    """
    zero, h = field.constant(0.0), field.series(field.domain.one, 1)
    units = unit_steps(
        stepper,
        h,
        zero,
        lambda formula: field.series(elements[formula]),
        damping=field.constant(damping),
        substitutes=SUBSTITUTES,
    )
    matrix = np.array([[zero + x for x in column] for column in units.step], dtype=object).T
    polynomial = [c[0] for c in characteristic(matrix[None])]
    while len(polynomial) > 3 and polynomial[-1].leading is None:
        polynomial.pop()
    trace, determinant = field.constant(2.0), field.constant(1.0)
    for _ in range(field.known.bit_length() + 2):
        up, down = bairstow(polynomial, trace, determinant)
        if not up.vanishes or not down.vanishes:
            break
        trace, determinant = trace + up, determinant - down
    if up.leading is not None or down.leading is not None:
        raise ValueError("the characteristic polynomial has no factor (x - 1)^2 at dt = 0")
    # a velocity of 1 is h in a step
    starts = [[(zero + x).shifted(k) for x in state] for k, state in enumerate(units.start)]
    return Principal(matrix, np.array(starts, dtype=object), polynomial, trace, determinant)


@dataclass(frozen=True, eq=False)
class Mode:
    """The principal mode of a scheme, and how the start excites it, as series in h."""

    rate: Laurent
    """``s~``, the rate of growth."""
    frequency: Laurent
    """``w~/w_d``."""
    position: Pair
    """``y(0)`` for the initial position 1, and for the initial velocity 1 (in units of w)."""
    slope: Pair
    """``y'(0) - s~ y(0)`` for both."""


@lru_cache(maxsize=1024)
def principal_mode(stepper: Stepper, damping: float) -> Mode:
    """Return the principal mode of the arithmetic of a scheme on a linear model (`Scheme.stepper_for`), g below 2."""
    step = principal(stepper, damping, KNOWN_POWERS)
    square, decay = step.square, step.determinant**-HALF
    cosine = step.trace * HALF * decay
    sinc, power = square.lift(1.0), square
    for k in range(1, KNOWN_POWERS // 2 + 1):
        sinc, power = sinc + power * Fraction((-1) ** k, math.factorial(2 * k + 1)), power * square
    firsts = [_first_two(step, start) for start in step.starts]
    # y_1 without growth and minus the cosine part, over sin(w~ h)/(w~ h) h
    slopes = [((one * decay - nought * cosine) / sinc).shifted(-1) for nought, one in firsts]
    half = Fraction(repr(damping)) / 2
    return Mode(
        (step.determinant.logarithm() * HALF).shifted(-1),
        (square.shifted(-2) / (1 - half * half)) ** HALF,
        np.array([nought for nought, _ in firsts], dtype=object),
        np.array(slopes, dtype=object),
    )


def _first_two(step: Principal, start: NDArray[Any]) -> tuple[Laurent, Laurent]:
    """Return ``y_0`` and ``y_1``, the positions of the principal part of a solution at the first two steps.

    With the characteristic polynomial ``(x^2 - T x + D) q(x)``, q of the matrix maps a state into the plane of the
    principal roots. The inverse of q modulo the quadratic, a linear polynomial, then gives the projection.
    """
    t, d = step.trace, step.determinant
    quotient = by_quadratic(step.polynomial, t, d)[:-2]
    state = start * quotient[0]
    for coefficient in quotient[1:]:
        state = step.matrix @ state + start * coefficient
    # q modulo the quadratic is by_x x + constant
    *_, by_x, last = by_quadratic([t.lift(0.0), *quotient], t, d)
    constant = last - t * by_x
    turned = by_x * t + constant
    denominator = constant * turned + by_x * by_x * d
    images = [state]
    for _ in range(2):
        images.append(step.matrix @ images[-1])
    y_1, y_2 = ((turned * a[0] - by_x * b[0]) / denominator for a, b in pairwise(images))
    return (t * y_1 - y_2) / d, y_1


def part_orders(
    stepper: Stepper, damping: float, u: ArrayLike, v: ArrayLike
) -> tuple[Floats, Floats]:
    """Return the orders of phase and amplitude; infinite if a part is exact, NaN if nothing oscillates.

    The stepper is that on a linear model without forces in time (`Scheme.stepper_for`), the damping is ``c/w``. u and v
    are the initial position relative to the equilibrium, and the initial velocity over w, in the same unit; they
    broadcast against each other. The arrays are read-only.
    """
    start = np.stack(np.broadcast_arrays(*(np.asarray(x, dtype=float) for x in (u, v))))
    function = _cached_orders if start[0].size <= _FEW else _orders
    phase, amplitude = function(stepper, damping, start.shape, start.tobytes())
    return phase, amplitude


def _orders(
    stepper: Stepper, damping: float, shape: tuple[int, ...], start: bytes
) -> tuple[Floats, Floats]:
    """Return `part_orders` for the floats in `start`, of shape (2, ...)."""
    result = _part_orders(stepper, damping, np.frombuffer(start).reshape(shape))
    for orders in result:
        orders.flags.writeable = False
    return result


_cached_orders = lru_cache(maxsize=4096)(_orders)


def _part_orders(stepper: Stepper, damping: float, start: Floats) -> tuple[Floats, Floats]:
    with np.errstate(all="ignore"):
        start = start / np.max(np.abs(start), axis=0)
    moving = np.isfinite(start).all(axis=0)
    if not abs(damping) < CRITICAL:
        missing = np.full(moving.shape, np.nan)
        return missing, missing
    terms = _terms(stepper, float(damping))
    at_start = _at_start(terms, damping, np.where(moving, start, 1.0))
    parasitic = _order(np.tensordot(start, terms.parasitic, axes=(0, 0)))
    rates = (terms.phase_rate[0], terms.amplitude_rate[0])
    phase, amplitude = (
        np.where(moving, np.minimum(np.minimum(_order(rate), parasitic), initial), np.nan)
        for rate, initial in zip(rates, at_start, strict=True)
    )
    return phase, amplitude


def _order(coefficients: Floats) -> Floats:
    """Return the first power whose coefficient exceeds rounding, infinite if none; powers are along the last axis."""
    is_term = np.abs(coefficients) > ROUNDED
    return np.where(is_term.any(axis=-1), np.argmax(is_term, axis=-1), np.inf)


@dataclass(frozen=True, eq=False)
class _Terms:
    """Coefficients of h^k; three rows are a quadratic form in ``u_0^2``, ``u_0 V`` and ``V^2``."""

    phase_rate: Floats
    """``(w~ - w_d)/w_d``, shape (1, k)."""
    amplitude_rate: Floats
    """``s~ - s + (g/2) (w~ - w_d)/w_d``, shape (1, k)."""
    turned: Floats
    """``w_d Im(B~ B*)``, shape (3, k)."""
    along: Floats
    """``Re(B~ B*)``, shape (3, k)."""
    grown: Floats
    """``|B~|^2 - |B|^2``, shape (3, k)."""
    size: Floats
    """``|B|^2``, shape (3, k)."""
    parasitic: Floats
    """The position at t = 0 minus ``y(0)``, for ``u_0`` and V, shape (2, k)."""


@lru_cache(maxsize=1024)
def _terms(stepper: Stepper, damping: float) -> _Terms:
    """Compute the coefficients in exact arithmetic, and round them once."""
    mode = principal_mode(stepper, damping)
    half = Fraction(repr(damping)) / 2
    w_d_squared = 1 - half * half
    one, zero = mode.rate.lift(1.0), mode.rate.lift(0.0)
    # B = u_0 - i G/w_d with G = V + (g/2) u_0, and B~ = y(0) - i G~/w~
    position, slope = (np.array(pair, dtype=object) for pair in ((one, zero), (one * half, one)))
    slopes = mode.slope / mode.frequency
    later = _form(mode.position, mode.position) + _form(slopes / w_d_squared, slopes)
    size = _form(position, position) + _form(slope / w_d_squared, slope)
    faster = mode.frequency - 1.0
    rows = {
        "phase_rate": [faster],
        "amplitude_rate": [mode.rate + faster * half + half],
        "turned": _form(mode.position, slope) - _form(slopes, position),
        "along": _form(mode.position, position) + _form(slopes / w_d_squared, slope),
        "grown": later - size,
        "size": size,
        "parasitic": position - mode.position,
    }
    known = min(series.end for row in rows.values() for series in row)
    floats = {
        name: np.array([[x.field.value(x.at(k)) for k in range(known)] for x in row])
        for name, row in rows.items()
    }
    return _Terms(**floats)


def _form(a: Pair, b: Pair) -> NDArray[Any]:
    """Return the product of two expressions that are linear in the initial values, as a quadratic form."""
    return np.array([a[0] * b[0], a[0] * b[1] + a[1] * b[0], a[1] * b[1]], dtype=object)


def _at_start(terms: _Terms, damping: float, start: Floats) -> tuple[Floats, Floats]:
    """Return the orders of ``phi(0)`` and ``alpha(0)``, for initial values of shape (2, ...)."""
    u, v = start
    forms = np.stack([u * u, u * v, v * v], axis=-1)
    size = (forms @ terms.size)[..., :1]
    turned, along, grown = (
        forms @ rows / size for rows in (terms.turned, terms.along, terms.grown)
    )
    w_d_squared = 1.0 - 0.25 * damping * damping
    ratio = np.zeros_like(turned)
    for k in range(ratio.shape[-1]):
        known = np.sum(ratio[..., :k] * along[..., k:0:-1], axis=-1)
        ratio[..., k] = (turned[..., k] - known) / along[..., 0]
    # phi = atan(x/w_d)/w_d with x the ratio, and alpha = log(1 + y)/2 + (g/2) phi
    phase = _summed(ratio, lambda k: (-1.0) ** (k // 2) / (k * w_d_squared ** ((k + 1) // 2)), 2)
    growth = _summed(grown, lambda k: 0.5 * (-1.0) ** (k - 1) / k, 1)
    return _order(phase), _order(growth + 0.5 * damping * phase)


def _summed(x: Floats, factor: Callable[[int], float], stride: int) -> Floats:
    """Return ``sum factor(k) x^k`` over k = 1, 1 + stride, ... of a series x that begins with h, powers last."""

    def times(a: Floats, b: Floats) -> Floats:
        columns = [np.sum(a[..., : k + 1] * b[..., k::-1], axis=-1) for k in range(x.shape[-1])]
        return np.stack(columns, axis=-1)

    total, power = np.zeros_like(x), x
    for k in range(1, x.shape[-1], stride):
        total = total + factor(k) * power
        for _ in range(stride):
            power = times(power, x)
    return total
