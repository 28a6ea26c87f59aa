r"""Bounds of the rounding error of a trajectory: its distance from the exact discrete solution of ``u'' + w^2 u = 0``.

A step rounds each of its operations, coefficients included. Its functions run on unit vectors with numbers that carry a
bound of their rounding error (running error analysis). This gives a matrix E with
``|rounding of step n| <= E |state^n|`` in units of the round-off. Propagated by the following exact steps,
``|rounding at N| <= sum_n |matrix^(N-1-n)| E |state^n|``. The bound includes the growth of the scheme, the number of
steps and the way in which the scheme is written (the powers of the matrix of `three_term` are of size 1/p). It is a
worst-case bound, N eps where random rounding gives N^(1/2) eps; compensated sums are better than their bound.

Source: J. H. Wilkinson, Error analysis revisited, IMA Bulletin 22 (1986); N. J. Higham, Accuracy and Stability of
Numerical Algorithms, section 3.3.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from decimal import Decimal
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from vibsim.core.array_types import Floats, Integers
from vibsim.schemes.base import UNIT_ROUND_OFF, Stepper
from vibsim.schemes.step_numbers import Arithmetic
from vibsim.theory.basis import UnitSteps, decimal, unit_steps, where_it_ends
from vibsim.theory.discrete import Scaled, applied, first_state, position, scaled, transposed
from vibsim.theory.doubled import Doubled, doubled, product
from vibsim.theory.roots import amplification

SQUARE = 8.0
"""Rounding errors in ``w^2`` and ``dt``, which a model computes from its parameters, in units of the round-off."""
_POINTS = 24


@dataclass(frozen=True, eq=False, slots=True)
class Bounded(Arithmetic):
    """An array of numbers and bounds of their rounding errors, in units of the round-off."""

    nearest: Floats
    error: Floats

    __array_ufunc__ = None

    @staticmethod
    def lift(other: Any) -> Bounded:
        """Convert numbers, without a rounding error."""
        if isinstance(other, Bounded):
            return other
        number = np.asarray(other, dtype=float)
        return Bounded(number, np.zeros_like(number))

    def __add__(self, other: Any) -> Bounded:
        b = self.lift(other)
        value = self.nearest + b.nearest
        return Bounded(value, self.error + b.error + np.abs(value))

    def __neg__(self) -> Bounded:
        return Bounded(-self.nearest, self.error)

    def __mul__(self, other: Any) -> Bounded:
        b = self.lift(other)
        value = self.nearest * b.nearest
        error = np.abs(self.nearest) * b.error + np.abs(b.nearest) * self.error
        return Bounded(value, error + np.abs(value))

    def __truediv__(self, other: Any) -> Bounded:
        b = self.lift(other)
        value = self.nearest / b.nearest
        error = (self.error + np.abs(value) * b.error) / np.abs(b.nearest)
        return Bounded(value, error + np.abs(value))

    def __abs__(self) -> Bounded:
        return Bounded(np.abs(self.nearest), self.error)


def _coefficient(formula: str) -> Bounded:
    """Return the float of a formula with a bound of its error; several roundings may make two units."""
    value = float(decimal(formula))
    exact = Decimal(value) == decimal(formula)
    return Bounded(np.asarray(value), np.asarray(0.0 if exact else 2.0 * abs(value)))


def rounding_bound(
    stepper: Stepper, w: ArrayLike, dt: ArrayLike, u_0: ArrayLike, v_0: ArrayLike, steps: int
) -> tuple[Floats, Floats]:
    """Return bounds of ``|computed - discrete|`` for position and velocity over a run of `steps` steps.

    Shape (case,), or scalars if all arguments are (as for `discrete`); infinite if the solution overflows.
    """
    members = np.broadcast_arrays(*(np.asarray(x, dtype=float) for x in (w, dt, u_0, v_0)))
    shape = members[0].shape
    with np.errstate(all="ignore"):
        u, v = _bounds(stepper, *(np.atleast_1d(x) for x in members), steps=steps)
    return u.reshape(shape), v.reshape(shape)


def _bounds(
    stepper: Stepper, w: Floats, dt: Floats, u_0: Floats, v_0: Floats, *, steps: int
) -> tuple[Floats, Floats]:
    """Return the bounds for arrays of shape (case,): the largest term of the sum times the number of terms.

    The largest is that of the powers at `_points`.
    """
    p = product(w, dt)
    exact = amplification(stepper, p)
    step, reading, start = _roundings(stepper, p.rounded)
    points = _points(steps)
    first = scaled(first_state(exact, dt, u_0, v_0), 1)
    sizes = _sizes(applied(exact.matrix, first, points))
    at_start = np.einsum("csi,ci->cs", start, np.abs(np.stack([u_0, v_0 * dt], axis=-1)))
    in_steps = np.einsum("csj,ckj->cks", step, sizes)
    is_before_end = points[:, None] + points <= steps

    def reached(row: Doubled) -> Floats:
        reach = _sizes(applied(transposed(exact.matrix), scaled(row, 1), points))
        once = np.einsum("cds,cs->cd", reach, at_start).max(axis=1)
        each = np.einsum("cds,cks->cdk", reach, in_steps)
        largest = np.where(is_before_end, _or_infinite(each), 0.0).max(axis=(1, 2))
        return np.asarray(_or_infinite(once) + steps * largest)

    of_reading = np.einsum("cks,cs->ck", sizes, reading).max(axis=1)
    velocity = reached(exact.velocity) + of_reading
    if exact.backward is not None:
        velocity = np.maximum(velocity, reached(exact.backward) + 2.0 * sizes[..., 0].max(axis=1))
    if stepper.end == "extrapolate":
        # 2 v^(N-1) - v^(N-2)
        velocity = 3.0 * velocity + 4.0 * of_reading
    return UNIT_ROUND_OFF * reached(position(exact)), UNIT_ROUND_OFF * _or_infinite(velocity) / dt


def _or_infinite(size: Floats) -> Floats:
    """Replace NaN, 0 times infinity, by infinity."""
    return np.where(np.isnan(size), np.inf, size)


def _points(steps: int) -> Integers:
    """Return integers from 0 to `steps` - 1 at which powers are sampled, close together at first."""
    last = max(steps - 1, 0)
    close = np.geomspace(1, last, _POINTS) if last else [0]
    both = np.concatenate([np.linspace(0, last, _POINTS), close])
    return np.unique(np.round(both).astype(np.int64))


def _sizes(states: Scaled) -> Floats:
    return np.abs(np.ldexp(states.number.rounded, states.exponent[..., None]))


def _roundings(stepper: Stepper, p: Floats) -> tuple[Floats, Floats, Floats]:
    """Return bounds of the rounding errors of a step, a velocity and a start, in the shapes of `Amplification`."""
    zero = Bounded.lift(np.zeros_like(p))

    def run(p: Doubled, most: int) -> UnitSteps:
        w_dt = p.high
        square = Bounded(w_dt * w_dt, SQUARE * w_dt * w_dt)
        number = Bounded(w_dt, w_dt)
        return unit_steps(stepper, number, zero, _coefficient, square=square, most=most)

    units = where_it_ends(run, stepper, doubled(p))

    def errors(numbers: Sequence[Any]) -> Floats:
        parts = [np.broadcast_to(Bounded.lift(number).error, p.shape) for number in numbers]
        return np.stack(parts, axis=-1)

    step, start = (
        np.stack([errors(c) for c in columns], axis=-1) for columns in (units.step, units.start)
    )
    return step, errors(units.velocity), start
