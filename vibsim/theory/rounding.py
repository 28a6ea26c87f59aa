r"""How far rounding can take a computed trajectory from the exact discrete solution on ``u'' + w^2 u = 0``.

One step rounds each of its operations, coefficients included. The functions of the scheme run on unit vectors with
numbers that carry a bound of their rounding (running error analysis), which gives a matrix E with
``|rounding of step n| <= E |state^n|`` in units of the round-off. Carried on by the exact steps behind it, it reaches
``|rounding at N| <= sum_n |matrix^(N-1-n)| E |state^n|``: the growth of the scheme, the number of steps and the
round-off of its way of writing all are in it (`three_term` has powers of its matrix that are 1/p large). It is a
bound for rounding at its worst, N eps where chance gives N^(1/2) eps; compensated sums do better than it says.

Source: J. H. Wilkinson, Error analysis revisited, IMA Bulletin 22 (1986); N. J. Higham, Accuracy and Stability of
Numerical Algorithms, section 3.3.
"""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Decimal
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vibsim.schemes.base import UNIT_ROUND_OFF, Stepper
from vibsim.theory.amplification import matrices
from vibsim.theory.basis import decimal, unit_steps
from vibsim.theory.discrete import Scaled, applied, scaled
from vibsim.theory.doubled import Doubled, doubled, product

Floats = NDArray[np.float64]

SQUARE = 8.0
"""Roundings in ``w^2`` and ``dt``, which a model works out from parameters of its own."""
_POINTS = 24


@dataclass(frozen=True, eq=False, slots=True)
class Bounded:
    """An array of numbers and bounds of their rounding errors, in units of the round-off.

    Comparisons answer for the array as a whole, as those of `vibsim.theory.doubled.Doubled`.
    """

    value: Floats
    error: Floats

    __array_ufunc__ = None

    def __add__(self, other: Any) -> Bounded:
        b = _bounded(other)
        value = self.value + b.value
        return Bounded(value, self.error + b.error + np.abs(value))

    def __neg__(self) -> Bounded:
        return Bounded(-self.value, self.error)

    def __pos__(self) -> Bounded:
        return self

    def __sub__(self, other: Any) -> Bounded:
        return self + -_bounded(other)

    def __rsub__(self, other: Any) -> Bounded:
        return _bounded(other) + -self

    def __mul__(self, other: Any) -> Bounded:
        b = _bounded(other)
        value = self.value * b.value
        error = np.abs(self.value) * b.error + np.abs(b.value) * self.error
        return Bounded(value, error + np.abs(value))

    def __truediv__(self, other: Any) -> Bounded:
        b = _bounded(other)
        value = self.value / b.value
        error = (self.error + np.abs(value) * b.error) / np.abs(b.value)
        return Bounded(value, error + np.abs(value))

    def __rtruediv__(self, other: Any) -> Bounded:
        return _bounded(other) / self

    __radd__ = __add__
    __rmul__ = __mul__

    def __abs__(self) -> Bounded:
        return Bounded(np.abs(self.value), self.error)

    def __gt__(self, other: Any) -> bool:
        return bool(np.any(self.value > _bounded(other).value))

    def __ge__(self, other: Any) -> bool:
        return bool(np.any(self.value >= _bounded(other).value))

    def __lt__(self, other: Any) -> bool:
        return bool(np.all(self.value < _bounded(other).value))

    def __le__(self, other: Any) -> bool:
        return bool(np.all(self.value <= _bounded(other).value))


def _bounded(value: Any) -> Bounded:
    if isinstance(value, Bounded):
        return value
    number = np.asarray(value, dtype=float)
    return Bounded(number, np.zeros_like(number))


def _coefficient(formula: str) -> Bounded:
    """Return the float of a formula with what it was rounded by; a formula of several roundings may be off by two."""
    value = float(decimal(formula))
    exact = Decimal(value) == decimal(formula)
    return Bounded(np.asarray(value), np.asarray(0.0 if exact else 2.0 * abs(value)))


def rounding_bound(
    stepper: Stepper, w: ArrayLike, dt: ArrayLike, u_0: ArrayLike, v_0: ArrayLike, steps: int
) -> tuple[Floats, Floats]:
    """Return bounds of ``|computed - discrete|`` for position and velocity over a run of `steps` steps.

    Parameters
    ----------
    w, dt, u_0, v_0
        As `vibsim.theory.discrete.discrete` takes them.

    Returns
    -------
    Shape (case,), or numbers where all were numbers; infinite where the solution overflows.
    """
    members = np.broadcast_arrays(*(np.asarray(x, dtype=float) for x in (w, dt, u_0, v_0)))
    shape = members[0].shape
    with np.errstate(all="ignore"):
        u, v = _bounds(stepper, *(np.atleast_1d(x) for x in members), steps=steps)
    return u.reshape(shape), v.reshape(shape)


def _bounds(
    stepper: Stepper, w: Floats, dt: Floats, u_0: Floats, v_0: Floats, *, steps: int
) -> tuple[Floats, Floats]:
    """Return the bounds for arrays of shape (case,): the largest of the terms of the sum, as often as it has terms."""
    p = product(w, dt)
    exact, rounded = matrices(stepper, p), _roundings(stepper, p.rounded)
    initial = np.abs(np.stack([u_0, v_0 * dt], axis=-1))
    begin = exact.start[..., 0] * u_0[:, None] + exact.start[..., 1] * product(v_0, dt)[:, None]
    points = _points(steps)
    sizes = _sizes(applied(exact.matrix, scaled(begin, 1), points))
    at_start = np.einsum("csi,ci->cs", rounded.start, initial)
    in_steps = np.einsum("csj,ckj->cks", rounded.step, sizes)
    is_before_end = points[:, None] + points <= steps
    turned = exact.matrix.swapped()

    def reached(row: Doubled) -> Floats:
        reach = _sizes(applied(turned, scaled(row, 1), points))
        once = np.einsum("cds,cs->cd", reach, at_start).max(axis=1)
        each = np.einsum("cds,cks->cdk", reach, in_steps)
        largest = np.where(is_before_end, _or_infinite(each), 0.0).max(axis=(1, 2))
        return np.asarray(_or_infinite(once) + steps * largest)

    position = np.zeros(exact.velocity.shape)
    position[:, 0] = 1.0
    reading = np.einsum("cks,cs->ck", sizes, rounded.velocity).max(axis=1)
    velocity = reached(exact.velocity) + reading
    if exact.backward is not None:
        velocity = np.maximum(velocity, reached(exact.backward) + 2.0 * sizes[..., 0].max(axis=1))
    if stepper.end == "extrapolate":
        # 2 v^(N-1) - v^(N-2)
        velocity = 3.0 * velocity + 4.0 * reading
    return UNIT_ROUND_OFF * reached(doubled(position)), UNIT_ROUND_OFF * velocity / dt


def _or_infinite(size: Floats) -> Floats:
    """Return sizes with infinity for what is unknown, nothing times infinity."""
    return np.where(np.isnan(size), np.inf, size)


def _points(steps: int) -> NDArray[np.int64]:
    """Return numbers from 0 to `steps` - 1 at which powers are looked at, close together at first."""
    last = max(steps - 1, 0)
    evenly = np.linspace(0, last, _POINTS)
    close = np.geomspace(1, last, _POINTS) if last else [0]
    return np.unique(np.round(np.concatenate([evenly, close])).astype(np.int64))


def _sizes(states: Scaled) -> Floats:
    return np.abs(np.ldexp(states.number.rounded, states.exponent[..., None]))


@dataclass(frozen=True)
class _Roundings:
    """Bounds of what is rounded in making unit vectors a state, a velocity and a start; the shapes of `Matrices`."""

    step: Floats
    velocity: Floats
    start: Floats


def _roundings(stepper: Stepper, p: Floats) -> _Roundings:
    zero = Bounded(np.zeros_like(p), np.zeros_like(p))
    square = Bounded(p * p, SQUARE * p * p)
    units = unit_steps(stepper, Bounded(p, p), zero, _coefficient, square)

    def errors(numbers: Any) -> Floats:
        parts = [np.broadcast_to(_bounded(number).error, p.shape) for number in numbers]
        return np.stack(parts, axis=-1)

    def matrix(columns: Any) -> Floats:
        return np.stack([errors(column) for column in columns], axis=-1)

    return _Roundings(matrix(units.step), errors(units.velocity), matrix(units.start))
