r"""The exact solution of the discrete equations on ``u'' + w^2 u = 0``: what a scheme would give without rounding.

``state^n = matrix^(n-1) state^1``. The power is taken by repeated squaring in twice the precision, never through
eigenvectors: it does not matter whether the matrix has any (at w dt = 2 the centred scheme has one too few), nor
whether the solution grows. The error is about n 1e-32, so that a result is rounded once for every n that a run can
reach. Powers of two are kept beside the matrices, and nothing overflows but the result.

Source: vibration text (B), section 4.2, equation (20); section 5.6, equations (43)-(44); exercises 10 and 17.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vibsim.schemes.base import Stepper
from vibsim.theory.amplification import Matrices, matrices
from vibsim.theory.doubled import Doubled, doubled, matmul, product

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

_BITS = 5
"""Bits of n that one multiplication works off where there are many n."""
_AT_ONCE = 2**15
"""States that are worked out at a time."""


@dataclass(frozen=True)
class Scaled:
    """Numbers ``2^exponent number``: one exponent for each matrix or vector."""

    number: Doubled
    exponent: Integers
    """The shape of the number without the axes of its matrix or vector."""


def discrete(
    stepper: Stepper,
    w: ArrayLike,
    dt: ArrayLike,
    u_0: ArrayLike,
    v_0: ArrayLike,
    n: ArrayLike,
    steps: int | None = None,
) -> tuple[Floats, Floats]:
    """Return position and velocity at step n of the exact discrete solution, every number rounded once.

    Parameters
    ----------
    w, dt, u_0, v_0
        Frequency, step and initial values; numbers, or arrays of shape (case,).
    n
        Whole numbers from 0; a number, or an array of shape (k,).
    steps
        Number of steps of the run, at whose end the velocity is that of `Stepper.end`; None: no run ends.

    Returns
    -------
    u, v
        Shape (case, k) without the axes of what was given as a number. The velocity is the scheme's own, at n = 0 the
        initial one. What is too large for a float is infinite.
    """
    members = np.broadcast_arrays(*(np.asarray(x, dtype=float) for x in (w, dt, u_0, v_0)))
    shape = members[0].shape + np.shape(n)
    flat = np.atleast_1d(np.asarray(n, dtype=np.int64))
    run = _Run(stepper, *(np.atleast_1d(x) for x in members))
    with np.errstate(all="ignore"):
        u, v = run.at(flat)
        if steps is not None and stepper.end != "own":
            v[:, flat == steps] = run.end_velocity(steps)[:, None]
    return u.reshape(shape), v.reshape(shape)


class _Run:
    """Members with their matrices."""

    def __init__(self, stepper: Stepper, w: Floats, dt: Floats, u_0: Floats, v_0: Floats) -> None:
        self.stepper, self.dt, self.u_0, self.v_0 = stepper, dt, u_0, v_0
        self.parts: Matrices = matrices(stepper, product(w, dt))
        push = product(v_0, dt)
        start = self.parts.start
        first = start[..., 0] * u_0[:, None] + start[..., 1] * push[:, None]
        self.first = scaled(first, 1)
        position = np.zeros(first.shape)
        position[:, 0] = 1.0
        self.position = doubled(position)

    def at(self, n: Integers) -> tuple[Floats, Floats]:
        """Return positions and velocities at steps n, shape (case, k)."""
        later = np.maximum(n, 1)
        u, v = self.read(later, self.position, self.parts.velocity)
        v = v / self.dt[:, None]
        u[:, n == 0], v[:, n == 0] = self.u_0[:, None], self.v_0[:, None]
        return u, v

    def read(self, n: Integers, *rows: Doubled) -> list[Floats]:
        """Return ``row . state`` at steps n >= 1, shape (case, k), for each row of shape (case, s).

        With ``n - 1 = 2^h a + b`` it is ``(row matrix^(2^h a)) . (matrix^b state^1)``: few powers serve many n.
        """
        half = (int(n.max()) - 1).bit_length() // 2
        highs, high = np.unique((n - 1) >> half, return_inverse=True)
        lows, low = np.unique((n - 1) & (2**half - 1), return_inverse=True)
        matrix = self.parts.matrix
        behind = applied(matrix, self.first, lows)
        turned = matrix.swapped()
        ahead = [applied(turned, scaled(row, 1), highs << half) for row in rows]
        found = [np.empty((len(self.dt), len(n))) for _ in rows]
        width = max(1, _AT_ONCE // len(self.dt))
        for k in range(0, len(n), width):
            part = slice(k, k + width)
            i, j = high[part], low[part]
            for values, row in zip(found, ahead, strict=True):
                total = row.number[:, i, 0] * behind.number[:, j, 0]
                for entry in range(1, matrix.shape[-1]):
                    total = total + row.number[:, i, entry] * behind.number[:, j, entry]
                exponent = row.exponent[:, i] + behind.exponent[:, j]
                values[:, part] = np.ldexp(total.rounded, exponent)
        return found

    def end_velocity(self, steps: int) -> Floats:
        """Return the velocity at the last point by the rule of the scheme, shape (case,)."""
        if self.parts.backward is not None:
            (found,) = self.read(np.array([steps]), self.parts.backward)
            return found[:, 0] / self.dt
        _, v = self.at(np.maximum([steps - 1, steps - 2], 0))
        return np.asarray(2.0 * v[:, 0] - v[:, 1])


def scaled(number: Doubled, axes: int, exponent: Integers | int = 0) -> Scaled:
    """Return a number with its largest entry near 1; the last `axes` axes share an exponent."""
    over = tuple(range(-axes, 0))
    _, shift = np.frexp(np.max(np.abs(number.high), axis=over))
    back = -np.expand_dims(shift, over)
    smaller = Doubled(np.ldexp(number.high, back), np.ldexp(number.low, back))
    return Scaled(smaller, np.asarray(exponent + shift, dtype=np.int64))


def applied(matrix: Doubled, vector: Scaled, times: Integers) -> Scaled:
    """Return ``matrix^times vector``, shape (case, k, s), for one vector and matrix per member, k numbers `times`."""
    bits = _BITS if len(times) > 2**_BITS else 1
    count, size = len(times), matrix.shape[-1]
    shape = (matrix.shape[0], count, size)
    state = Scaled(
        Doubled(*(np.broadcast_to(x[:, None], shape) for x in _pair(vector.number))),
        np.broadcast_to(vector.exponent[:, None], shape[:2]),
    )
    factor, left = scaled(matrix, 2), times
    while left.any():
        table = [factor]
        for _ in range(2**bits - 2):
            table.append(_times(table[-1], factor))
        digits = left & (2**bits - 1)
        state = _multiplied(table, digits, state)
        left = left >> bits
        factor = _times(table[-1], factor)
    return state


def _pair(number: Doubled) -> tuple[Floats, Floats]:
    return number.high, number.low


def _times(a: Scaled, b: Scaled) -> Scaled:
    """Return the product of matrices."""
    return scaled(matmul(a.number, b.number), 2, a.exponent + b.exponent)


def _multiplied(table: list[Scaled], digits: Integers, state: Scaled) -> Scaled:
    """Return the states times the power in the table that their digit names; digit 0 leaves a state as it is."""
    rows = np.flatnonzero(digits)
    if not len(rows):
        return state
    chosen = digits[rows] - 1
    power = Doubled(
        *(
            np.stack(parts, axis=1)[:, chosen]
            for parts in zip(*(_pair(x.number) for x in table), strict=True)
        )
    )
    exponent = np.stack([x.exponent for x in table], axis=1)[:, chosen]
    ahead = matmul(power, state.number[:, rows][..., None])[..., 0]
    new = scaled(ahead, 1, exponent + state.exponent[:, rows])
    high, low = np.array(state.number.high), np.array(state.number.low)
    exponents = np.array(state.exponent)
    high[:, rows], low[:, rows], exponents[:, rows] = *_pair(new.number), new.exponent
    return Scaled(Doubled(high, low), exponents)
