r"""The exact solution of the discrete equations on ``u'' + w^2 u = 0``: the result of a scheme without rounding.

``state^n = matrix^(n-1) state^1``. The power is computed by repeated squaring in double-double precision, not from
eigenvectors: the matrix may be defective (that of the centred scheme at w dt = 2), and the solution may grow. The error
is about n 1e-32, so results are correctly rounded for every n that a run can reach. Matrices carry separate exponents,
so that only results can overflow.

Source: vibration text (B), section 4.2, equation (20); section 5.6, equations (43)-(44); exercises 10 and 17.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from vibsim.core.array_types import Floats, Integers
from vibsim.elementary import on_arrays
from vibsim.schemes.base import Stepper
from vibsim.theory.doubled import Doubled, doubled, product
from vibsim.theory.roots import Amplification, amplification

HALVINGS = 4, 25
"""Numbers of halvings of the time 1 that give the steps of `orders`. [convention]"""
START, END = (1.0, 0.3), np.ones(1)
"""Position and velocity at t = 0 for `orders`, and the time of their errors. [convention]"""
LEAST_ERROR = 1e-13
"""Smaller errors may be rounding of the coefficients of a scheme. [convention]"""
NEARLY = 0.1
"""An order this close below a whole number is that number. [convention]"""
_BITS = 5
"""Bits of n per multiplication if there are many n."""
_AT_ONCE = 2**15
"""Number of states that are computed at a time."""


@dataclass(frozen=True)
class Scaled:
    """Matrices or vectors ``2^exponent number``, each with its own exponent."""

    number: Doubled
    exponent: Integers
    """In the shape of `number` without the axes of the matrix or vector."""


def discrete(
    stepper: Stepper,
    w: ArrayLike,
    dt: ArrayLike,
    u_0: ArrayLike,
    v_0: ArrayLike,
    n: ArrayLike,
    steps: int | None = None,
) -> tuple[Floats, Floats]:
    """Return position and velocity at step n of the exact discrete solution, correctly rounded.

    Frequency, step and initial values are numbers, or arrays of shape (case,); n >= 0 is an integer or an array of
    shape (k,). A run ends at `steps`, with the velocity of `Stepper.end`; None for no end. The result has shape
    (case, k) without the axes of scalar arguments. The velocity is the scheme's own, at n = 0 the initial one. Overflow
    gives infinity.
    """
    members = np.broadcast_arrays(*(np.asarray(x, dtype=float) for x in (w, dt, u_0, v_0)))
    flat = np.atleast_1d(np.asarray(n, dtype=np.int64))
    w, dt, u_0, v_0 = (np.atleast_1d(x) for x in members)
    with np.errstate(all="ignore"):
        parts = amplification(stepper, product(w, dt))
        first = scaled(first_state(parts, dt, u_0, v_0), 1)

        def at(n: Integers) -> list[Floats]:
            rows = [position(parts), parts.velocity]
            u, v = _read(parts.matrix, first, np.maximum(n, 1), rows)
            v = v / dt[:, None]
            u[:, n == 0], v[:, n == 0] = u_0[:, None], v_0[:, None]
            return [u, v]

        u, v = at(flat)
        if steps is not None and stepper.end != "own":
            if parts.backward is not None:
                (backward,) = _read(parts.matrix, first, np.array([steps]), [parts.backward])
                end = backward[:, 0] / dt
            else:
                _, last = at(np.maximum([steps - 1, steps - 2], 0))
                end = 2.0 * last[:, 0] - last[:, 1]
            v[:, flat == steps] = end[:, None]
    shape = members[0].shape + np.shape(n)
    return u.reshape(shape), v.reshape(shape)


@lru_cache(maxsize=1024)
def orders(stepper: Stepper) -> tuple[float, float]:
    """Return the orders of position and velocity on ``u'' + u = 0``, whole numbers; infinite where nothing is wrong.

    They are read where steps are as short as errors above rounding allow, for a start that is no special one. An order
    is 0 if the scheme does not converge, and NaN where its solutions overflow.
    """
    halvings = np.arange(*HALVINGS)
    found = discrete(stepper, 1.0, 2.0**-halvings, *START, 2**halvings)
    cosine, sine = on_arrays.cos(END), on_arrays.sin(END)
    exact = START[0] * cosine + START[1] * sine, START[1] * cosine - START[0] * sine
    position, velocity = (_order(np.diagonal(x) - y) for x, y in zip(found, exact, strict=True))
    return position, velocity


def _order(errors: Floats) -> float:
    """Return the order of errors that halved steps leave, from the last two before they come down to rounding."""
    sizes = np.abs(errors)
    end = np.append(np.flatnonzero(~(sizes > LEAST_ERROR)), len(sizes))[0]
    if end < 2:
        return math.inf
    with np.errstate(invalid="ignore"):  # a solution that overflows has no order
        order = on_arrays.log2(sizes[end - 2 : end - 1] / sizes[end - 1])
    return float(np.maximum(np.floor(order + NEARLY), 0.0)[0])


def first_state(parts: Amplification, dt: Floats, u_0: Floats, v_0: Floats) -> Doubled:
    """Return the state at step 1, shape (case, s)."""
    return parts.start[..., 0] * u_0[:, None] + parts.start[..., 1] * product(v_0, dt)[:, None]


def position(parts: Amplification) -> Doubled:
    """Return the row that reads the position from a state, shape (case, s)."""
    row = np.zeros(parts.velocity.shape)
    row[:, 0] = 1.0
    return doubled(row)


def _read(matrix: Doubled, first: Scaled, n: Integers, rows: list[Doubled]) -> list[Floats]:
    """Return ``row . state`` at steps n >= 1, shape (case, k), for each row of shape (case, s).

    With ``n - 1 = 2^h a + b`` it is ``(row matrix^(2^h a)) . (matrix^b state^1)``: few powers serve many n.
    """
    half = (int(n.max()) - 1).bit_length() // 2
    highs, high = np.unique((n - 1) >> half, return_inverse=True)
    lows, low = np.unique((n - 1) & (2**half - 1), return_inverse=True)
    states = applied(matrix, first, lows)
    powers = [applied(transposed(matrix), scaled(row, 1), highs << half) for row in rows]
    cases = matrix.shape[0]
    result = [np.empty((cases, len(n))) for _ in rows]
    width = max(1, _AT_ONCE // cases)
    for k in range(0, len(n), width):
        part = slice(k, k + width)
        i, j = high[part], low[part]
        for values, row in zip(result, powers, strict=True):
            total = row.number[:, i, 0] * states.number[:, j, 0]
            for entry in range(1, matrix.shape[-1]):
                total = total + row.number[:, i, entry] * states.number[:, j, entry]
            exponent = row.exponent[:, i] + states.exponent[:, j]
            values[:, part] = np.ldexp(total.rounded, exponent)
    return result


def transposed(matrix: Doubled) -> Doubled:
    """Return an array of transposed matrices."""
    return matrix.mapped(lambda x: np.swapaxes(x, -1, -2))


def scaled(number: Doubled, axes: int, exponent: Integers | int = 0) -> Scaled:
    """Return ``2^exponent number``, with largest entries near 1; the last `axes` axes share an exponent."""
    over = tuple(range(-axes, 0))
    _, shift = np.frexp(np.max(np.abs(number.high), axis=over))
    back = -np.expand_dims(shift, over)
    return Scaled(
        number.mapped(lambda x: np.ldexp(x, back)), np.asarray(exponent + shift, dtype=np.int64)
    )


def applied(matrix: Doubled, vector: Scaled, times: Integers) -> Scaled:
    """Return ``matrix^times vector``, shape (case, k, s), for a matrix and vector per member and k integers `times`."""
    bits = _BITS if len(times) > 2**_BITS else 1
    shape = (matrix.shape[0], len(times), matrix.shape[-1])
    state = vector.number.mapped(lambda x: np.array(np.broadcast_to(x[:, None], shape)))
    exponent = np.array(np.broadcast_to(vector.exponent[:, None], shape[:2]))
    factor, remaining = scaled(matrix[:, None], 2), times
    while remaining.any():
        # powers 1 to 2^bits of the factor
        powers = factor
        for _ in range(bits):
            powers = _joined(powers, _times(powers, _last(powers)))
        digits = remaining & (2**bits - 1)
        rows = np.flatnonzero(digits)
        if len(rows):
            # digit 0 leaves a state unchanged
            chosen = digits[rows] - 1
            moved = (powers.number[:, chosen] @ state[:, rows][..., None])[..., 0]
            new = scaled(moved, 1, powers.exponent[:, chosen] + exponent[:, rows])
            state.high[:, rows], state.low[:, rows] = new.number.high, new.number.low
            exponent[:, rows] = new.exponent
        remaining = remaining >> bits
        factor = _last(powers)
    return Scaled(state, exponent)


def _last(powers: Scaled) -> Scaled:
    return Scaled(powers.number[:, -1:], powers.exponent[:, -1:])


def _joined(a: Scaled, b: Scaled) -> Scaled:
    """Return the matrices of `a` and then those of `b`, along the second axis."""
    high = np.concatenate([a.number.high, b.number.high], axis=1)
    low = np.concatenate([a.number.low, b.number.low], axis=1)
    return Scaled(Doubled(high, low), np.concatenate([a.exponent, b.exponent], axis=1))


def _times(a: Scaled, b: Scaled) -> Scaled:
    return scaled(a.number @ b.number, 2, a.exponent + b.exponent)
