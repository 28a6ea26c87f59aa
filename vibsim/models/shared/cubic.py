r"""The exact motion of ``u'' + alpha u + beta u^3 = 0`` by Jacobi's elliptic functions.

With the energy ``E = v^2/2 + alpha u^2/2 + beta u^4/4`` and ``S = sqrt(alpha^2 + 4 beta E)``:

- beta > 0, E > 0 or alpha >= 0: ``u = A cn``, with ``A^2 = (S - alpha)/beta``, rate ``sqrt S`` and
  1 - m = (S + alpha)/(2 S);
- beta > 0 > alpha, E < 0 (one of two wells): ``u = +-A dn``, with ``A^2 = (S - alpha)/beta``, rate
  ``sqrt((S - alpha)/2)`` and 1 - m = (-alpha - S)/(S - alpha);
- beta < 0 < alpha, within the well: ``u = A sn``, with ``A^2 = 4 E/(S + alpha)``, rate ``sqrt((S + alpha)/2)`` and
  1 - m = 2 S/(S + alpha).

The initial phase enters by the addition theorems, so no function is inverted. All other motions are linear (beta = 0),
or escape to infinity in finite time, for which the result is NaN.

Source: Abramowitz and Stegun, chapter 16 (16.17 for the addition theorems).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from vibsim.core.array_types import Floats
from vibsim.elementary import on_arrays
from vibsim.models.shared.elliptic import agm_quarter_period, jacobi
from vibsim.models.shared.linear_motion import damped_motion

CN, DN, SN, LINEAR, ESCAPES, REST = range(6)


def _orbit(alpha: Any, beta: Any, u: Any, v: Any) -> tuple[Floats, ...]:
    """Return kind of orbit, amplitude, rate, ``1 - m`` and the four arguments, all broadcast to one shape."""
    alpha, beta, u, v = (np.asarray(x, dtype=float) for x in np.broadcast_arrays(alpha, beta, u, v))
    with np.errstate(all="ignore"):
        energy = 0.5 * v * v + u * u * (0.5 * alpha + 0.25 * beta * u * u)
        # S^2 = alpha^2 + 4 beta E is (alpha + beta u^2)^2 + 2 beta v^2, without cancellation as a sum or a product
        slope, swing = alpha + beta * u * u, np.sqrt(2.0 * np.abs(beta)) * np.abs(v)
        square = np.where(
            beta > 0.0, slope * slope + swing * swing, (slope - swing) * (slope + swing)
        )
        s = np.sqrt(np.maximum(square, 0.0))
        is_cn = (beta > 0.0) & ((energy > 0.0) | (alpha >= 0.0))
        is_dn = (beta > 0.0) & ~is_cn
        is_sn = (beta < 0.0) & (alpha > 0.0) & (square >= 0.0) & (-beta * u * u <= alpha)
        # S - alpha and S + alpha: the smaller from their product 4 beta E, without cancellation
        sum_ = np.where(alpha < 0.0, 4.0 * beta * energy / (s - alpha), s + alpha)
        gap = np.where(alpha > 0.0, 4.0 * beta * energy / (s + alpha), s - alpha)
        amplitude = np.sqrt(np.where(is_sn, 4.0 * energy / (s + alpha), gap / beta))
        rate = np.sqrt(np.where(is_cn, s, np.where(is_dn, 0.5 * gap, 0.5 * (s + alpha))))
        complement = np.where(
            is_cn, 0.5 * sum_ / s, np.where(is_dn, -sum_ / gap, 2.0 * s / (s + alpha))
        )
    kind = np.select(
        [(v == 0.0) & (u * slope == 0.0), beta == 0.0, is_cn, is_dn, is_sn],
        [REST, LINEAR, CN, DN, SN],
        ESCAPES,
    )
    return kind, amplitude, rate, np.clip(complement, 0.0, 1.0), alpha, beta, u, v


def motion(t: Any, alpha: Any, beta: Any, u_0: Any, v_0: Any) -> tuple[Floats, Floats]:
    """Return u and v at times `t`, shape (..., n_t); the other arguments have the shape (..., 1) or ()."""
    t = np.asarray(t, dtype=float)
    orbit = _orbit(alpha, beta, u_0, v_0)
    shape = np.broadcast_shapes(t.shape, orbit[0].shape)
    rows = (*shape[:-1], 1)
    kind, size, rate, complement, alpha, beta, u, v = (
        np.broadcast_to(x, rows).reshape(-1) for x in orbit
    )
    t = np.broadcast_to(t, shape).reshape(-1, shape[-1])
    states = np.full((2, *t.shape), np.nan)
    at_rest, linear = kind == REST, kind == LINEAR
    states[:, at_rest] = np.stack([u[at_rest], v[at_rest]])[:, :, None]
    if linear.any():
        starts = (x[linear, None] for x in (alpha, np.zeros_like(alpha), u, v))
        states[:, linear] = damped_motion(t[linear], *starts)
    columns = (size, rate, complement, u, v)
    # for initial values beyond 1e77 the energy overflows, and the result is NaN
    with np.errstate(all="ignore"):
        well = (*columns, alpha + beta * u * u, beta)
        for code, move, numbers in ((CN, _cn, columns), (DN, _dn, well), (SN, _sn, columns)):
            mask = kind == code
            if mask.any():
                states[:, mask] = move(t[mask], *(x[mask] for x in numbers))
    return states[0].reshape(shape), states[1].reshape(shape)


def _added(
    t: Floats, rate: Floats, complement: Floats, s: Floats, c: Floats, d: Floats
) -> tuple[Floats, Floats, Floats]:
    """Return sn, cn and dn at ``phase + rate t``, with values s, c and d at the phase; shape (rows, n)."""
    sn, cn, dn, _ = jacobi(rate[:, None] * t, complement[:, None])
    m = (1.0 - complement)[:, None]
    # 1 - m s^2 sn^2, as a sum of nonnegative terms
    scale = complement[:, None] + m * (c * c + (s * cn) ** 2)
    sine, cosine = s * cn * dn + sn * c * d, c * cn - s * sn * d * dn
    return sine / scale, cosine / scale, (d * dn - m * s * sn * c * cn) / scale


def _cn(
    t: Floats, size: Floats, rate: Floats, complement: Floats, u: Floats, v: Floats
) -> tuple[Floats, Floats]:
    c = np.clip(u / size, -1.0, 1.0)[:, None]
    d = np.sqrt(complement[:, None] + (1.0 - complement)[:, None] * c * c)
    s = -(v / (size * rate))[:, None] / d
    sine, cosine, delta = _added(t, rate, complement, s, c, d)
    return size[:, None] * cosine, -(size * rate)[:, None] * sine * delta


def _dn(
    t: Floats,
    size: Floats,
    rate: Floats,
    complement: Floats,
    u: Floats,
    v: Floats,
    slope: Floats,
    beta: Floats,
) -> tuple[Floats, Floats]:
    side = np.copysign(size, u)[:, None]
    d = np.clip(u[:, None] / side, 0.0, 1.0)
    # with sn = sin(phi): slope = S cos(2 phi) and sqrt(2 beta) |v| = S sin(2 phi); from d = u/A alone, sn near the
    # outer turning point and cn near the inner one would lose all digits
    swing = np.sqrt(2.0 * beta) * np.abs(v)
    both = on_arrays.hypot(slope, swing)  # S
    large = np.sqrt(0.5 + 0.5 * np.abs(slope) / both)
    small = 0.5 * swing / (both * large)
    s = np.where(slope > 0.0, small, large)[:, None]
    c = np.copysign(np.where(slope > 0.0, large, small), -v * u)[:, None]
    sine, cosine, delta = _added(t, rate, complement, s, c, d)
    return side * delta, -side * rate[:, None] * (1.0 - complement)[:, None] * sine * cosine


def _sn(
    t: Floats, size: Floats, rate: Floats, complement: Floats, u: Floats, v: Floats
) -> tuple[Floats, Floats]:
    s = np.clip(u / size, -1.0, 1.0)[:, None]
    d = np.sqrt(complement[:, None] + (1.0 - complement)[:, None] * (1.0 - s) * (1.0 + s))
    c = (v / (size * rate))[:, None] / d
    sine, cosine, delta = _added(t, rate, complement, s, c, d)
    return size[:, None] * sine, (size * rate)[:, None] * cosine * delta


def period(alpha: Any, beta: Any, u_0: Any, v_0: Any) -> Floats:
    """Return the period; NaN at rest and for motions that are not periodic, infinite on a separatrix."""
    kind, _, rate, complement, alpha, *_ = _orbit(alpha, beta, u_0, v_0)
    quarter = agm_quarter_period(complement).reshape(kind.shape)
    with np.errstate(all="ignore"):
        elliptic = np.where(kind == DN, 2.0, 4.0) * quarter / rate
        harmonic = 2.0 * np.pi / np.sqrt(alpha)
    is_elliptic = (kind == CN) | (kind == DN) | (kind == SN)
    repeats = (kind == LINEAR) & (alpha > 0.0)
    return np.where(is_elliptic, elliptic, np.where(repeats, harmonic, np.nan))
