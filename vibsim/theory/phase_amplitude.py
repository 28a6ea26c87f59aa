r"""Orders of the phase and of the amplitude of a scheme's error on ``u'' + g u' + u = 0``, from its step and its start.

The exact motion is ``Re(B exp(lambda t))``, what is computed ``Re(B~ exp(lambda~ t))`` (`vibsim.theory.modes`), so that

    L(t)  =  (lambda~ - lambda) t + log(B~/B),      phi  =  Im L/w_d,      alpha  =  Re L + (g/2) phi

are the time by which it is early and the logarithm of the factor of its amplitude, both linear in t:
``u_h = exp(alpha(t)) U(t + phi(t))``. What grows with t is of the step alone; what is there from the first step on,
``B~/B``, is of the start, and depends on the initial values. What parasitic roots take away of the position at t = 0 is
there for one sample, and is an error of both. The order of a part is the lowest of the three. A part that vanishes in
every power of h that is known (twice as many as any scheme has) is exact: its order is infinite.

Initial values count as what they are: the first power of h whose coefficient is not 0 *for them* is the order.

Source: vibration text (B), sections 4.4, 5.6 and 7.1 with `errata`; exercises 10 and 17.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vibsim.schemes.base import Stepper
from vibsim.theory import series
from vibsim.theory.degrees import ROUNDED
from vibsim.theory.modes import Mode, principal_mode
from vibsim.theory.series import Series

Floats = NDArray[np.float64]

CRITICAL = 2.0
"""The damping rate over w from which on nothing oscillates."""


@dataclass(frozen=True, eq=False)
class Terms:
    """Coefficients of h^k; those of quadratic forms belong to ``u_0^2``, ``u_0 V`` and ``V^2``."""

    phase_rate: Floats
    """Of ``(w~ - w_d)/w_d``, shape (k,)."""
    amplitude_rate: Floats
    """Of ``s~ - s + (g/2) (w~ - w_d)/w_d``, shape (k,)."""
    turned: Floats
    """Of ``w_d Im(B~ B*)``, shape (3, k)."""
    along: Floats
    """Of ``Re(B~ B*)``, shape (3, k)."""
    grown: Floats
    """Of ``|B~|^2 - |B|^2``, shape (3, k)."""
    size: Floats
    """``|B|^2``, shape (3,)."""
    gone: Floats
    """Of the position at t = 0 less ``y(0)``, for ``u_0`` and V, shape (2, k)."""


def part_orders(
    stepper: Stepper, damping: float, u: ArrayLike, v: ArrayLike
) -> tuple[Floats, Floats]:
    """Return the orders of phase and amplitude; infinite where a part is exact, NaN where nothing oscillates.

    Parameters
    ----------
    stepper
        The arithmetic of the scheme on a linear model without forces in time (`Scheme.stepper_for`).
    damping
        The damping rate over the frequency, ``c/w``.
    u, v
        Initial position, measured from rest, and initial velocity over w, in the same unit; of any one shape.
    """
    start = np.stack(np.broadcast_arrays(*(np.asarray(x, dtype=float) for x in (u, v))))
    with np.errstate(all="ignore"):
        start = start / np.max(np.abs(start), axis=0)
    moving = np.isfinite(start).all(axis=0)
    if not abs(damping) < CRITICAL:
        nothing = np.full(moving.shape, np.nan)
        return nothing, nothing
    terms = _terms(stepper, float(damping))
    at_start = _at_start(terms, damping, np.where(moving, start, 1.0))
    gone = _order(np.tensordot(start, terms.gone, axes=(0, 0)))
    rates = (terms.phase_rate, terms.amplitude_rate)
    phase, amplitude = (
        np.where(moving, np.minimum(np.minimum(_order(rate), gone), own), np.nan)
        for rate, own in zip(rates, at_start, strict=True)
    )
    return phase, amplitude


def _order(coefficients: Floats) -> Floats:
    """Return the first power whose coefficient is no rounding, infinite for none; powers lie along the last axis."""
    found = np.abs(coefficients) > ROUNDED
    return np.where(found.any(axis=-1), np.argmax(found, axis=-1), np.inf)


def _at_start(terms: Terms, damping: float, start: Floats) -> tuple[Floats, Floats]:
    """Return the orders of ``phi(0)`` and ``alpha(0)``, for initial values of shape (2, ...)."""
    u, v = start
    forms = np.stack([u * u, u * v, v * v], axis=-1)
    size = (forms @ terms.size)[..., None]
    turned, along, grown = (
        list(np.moveaxis(forms @ rows / size, -1, 0))
        for rows in (terms.turned, terms.along, terms.grown)
    )
    frequency = 1.0 - 0.25 * damping * damping
    ratio = series.over(turned, along)
    # phi = atan(x/w_d)/w_d with x the ratio, and alpha = log(1 + y)/2 + (g/2) phi
    phase = _summed(ratio, lambda k: (-1.0) ** (k // 2) / (k * frequency ** ((k + 1) // 2)), 2)
    growth = _summed(grown, lambda k: 0.5 * (-1.0) ** (k - 1) / k, 1)
    amplitude = [a + 0.5 * damping * b for a, b in zip(growth, phase, strict=True)]
    return _order(np.stack(phase, axis=-1)), _order(np.stack(amplitude, axis=-1))


def _summed(x: Series, factor: Any, stride: int) -> Series:
    """Return ``sum factor(k) x^k`` over k = 1, 1 + stride, ... of a series x that begins with h."""
    total = [value * 0.0 for value in x]
    power, step = x, x
    for _ in range(1, stride):
        step = series.times(step, x)
    for k in range(1, len(x), stride):
        total = [a + factor(k) * b for a, b in zip(total, power, strict=True)]
        power = series.times(power, step)
    return total


@lru_cache(maxsize=1024)
def _terms(stepper: Stepper, damping: float) -> Terms:
    """Work the coefficients out in exact numbers, and round them once."""
    mode = principal_mode(stepper, damping)
    number = mode.field.number
    half = number(Fraction(repr(damping))) * number(Fraction(1, 2))
    right = number(Fraction(1)) - half * half
    nothing = [mode.field.zero] * len(mode.rate)
    one = [number(Fraction(1)), *nothing[1:]]
    # B = u_0 - i G/w_d with G = V + (g/2) u_0, and B~ = y(0) - i G~/w~
    exact = [one, nothing], [[value * half for value in one], one]
    slower = series.over(one, mode.frequency)
    slopes = [series.times(row, slower) for row in mode.slope]
    over = [[x / right for x in row] for row in slopes]
    turned = _minus(_form(mode.position, exact[1]), _form(slopes, exact[0]))
    along = _plus(_form(mode.position, exact[0]), _form(over, exact[1]))
    later = _plus(_form(mode.position, mode.position), _form(over, slopes))
    size = _plus(
        _form(exact[0], exact[0]), _form([[x / right for x in row] for row in exact[1]], exact[1])
    )
    faster = [a - b for a, b in zip(mode.frequency, one, strict=True)]
    rate = [a + b * half for a, b in zip(mode.rate, faster, strict=True)]
    rate[0] = rate[0] + half
    gone = [_less(a, b) for a, b in zip(exact[0], mode.position, strict=True)]
    return Terms(
        phase_rate=_floats(mode, faster),
        amplitude_rate=_floats(mode, rate),
        turned=_rows(mode, turned),
        along=_rows(mode, along),
        grown=_rows(mode, _minus(later, size)),
        size=_rows(mode, size)[:, 0],
        gone=_rows(mode, gone),
    )


Pair = Sequence[Series]
"""Coefficients of ``u_0`` and V in something linear in the initial values."""


def _form(a: Pair, b: Pair) -> list[Series]:
    """Return the product of two numbers that are linear in the initial values, as a quadratic form."""
    mixed = zip(series.times(a[0], b[1]), series.times(a[1], b[0]), strict=True)
    return [series.times(a[0], b[0]), [x + y for x, y in mixed], series.times(a[1], b[1])]


def _less(a: Series, b: Series) -> Series:
    return [x - y for x, y in zip(a, b, strict=True)]


def _minus(a: Sequence[Series], b: Sequence[Series]) -> list[Series]:
    return [_less(x, y) for x, y in zip(a, b, strict=True)]


def _plus(a: Sequence[Series], b: Sequence[Series]) -> list[Series]:
    return [[x + y for x, y in zip(p, q, strict=True)] for p, q in zip(a, b, strict=True)]


def _floats(mode: Mode, row: Series) -> Floats:
    return np.array([mode.field.value(x) for x in row])


def _rows(mode: Mode, rows: Sequence[Series]) -> Floats:
    return np.array([_floats(mode, row) for row in rows])
