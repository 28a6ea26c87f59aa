r"""The exact motion of the pendulum by Jacobi's elliptic functions.

With ``w = sqrt(g/L)`` and ``k^2 = sin^2(theta_0/2) + (omega_0/(2 w))^2`` (the energy in units of 2 m g L):

- libration, k < 1: ``sin(theta/2) = k sn(u, k)``, ``omega = 2 w k cn(u, k)``, period ``4 K(k)/w``;
- rotation, k > 1: ``theta/2 = +-am(k u, 1/k)``, ``omega = +-2 w k dn(k u, 1/k)``, time of a turn ``2 K(1/k)/(w k)``;
- separatrix, k = 1: ``sin(theta/2) = tanh u``, infinite period.

Everything is computed from the *complementary* parameter ``1 - k^2 = cos^2(theta_0/2) - (omega_0/(2 w))^2``, so no
digits are lost near the separatrix. A library routine that takes the parameter m = k^2 itself loses them (measured at
1 - m = 1e-12, u = 20: wrong in the ninth digit, and 3e30 at u = 100).

Source: pendulum lecture (A), section 1.2, which mentions the closed form; Abramowitz and Stegun, chapters 16 and 17;
R. Bulirsch, Numerische Mathematik 7 (1965) 78-90 (sn, cn, dn);
B. C. Carlson, Numerical Algorithms 10 (1995) 13-26 (R_F).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from vibsim.core.array_types import Flags, Floats
from vibsim.elementary import on_arrays
from vibsim.models.base import Numbers

_MEANS = ((0.1, 5), (1e-5, 6), (1e-11, 7), (1e-30, 8), (0.0, 12))
"""Pairs (bound, steps): iterations of the arithmetic-geometric mean of 1 and sqrt(x) to the last digit for x >= bound.

The number depends on x alone, not on what is computed together, so that each member has the same bits in any batch.
"""
_DUPLICATIONS = 12
"""Duplications that make the arguments of R_F equal to 1 % even for ratios of 1e-300; the series omits sixth powers."""


def _classes(complement: Floats) -> Iterator[tuple[Flags | slice, int]]:
    """Yield masks of entries with the number of steps of the mean that they need; zeros are in no mask."""
    below = np.inf
    for bound, steps in _MEANS:
        mask = (complement >= bound) & (complement < below) & (complement > 0.0)
        below = bound
        if mask.all():
            yield slice(None), steps
        elif mask.any():
            yield mask, steps


def agm_quarter_period(complement: Floats) -> Floats:
    """Return the complete elliptic integral K of the first kind from ``1 - m`` of any shape; infinite at 0."""
    flat = np.ravel(complement)
    quarter = np.where(np.isnan(flat), np.nan, np.inf)
    for chosen, steps in _classes(flat):
        b = np.sqrt(flat[chosen])
        a = np.ones_like(b)
        for _ in range(steps):
            a, b = 0.5 * (a + b), np.sqrt(a * b)
        quarter[chosen] = 0.5 * np.pi / a
    return quarter.reshape(np.shape(complement))


def carlson_rf(x: Floats, y: Floats, z: Floats) -> Floats:
    """Return Carlson's symmetric integral R_F(x, y, z) of arguments >= 0, at most one of them 0.

    Duplication, then the series to the fifth power of the remaining differences.
    """
    for _ in range(_DUPLICATIONS):
        rx, ry, rz = np.sqrt(x), np.sqrt(y), np.sqrt(z)
        step = rx * ry + ry * rz + rz * rx
        x, y, z = 0.25 * (x + step), 0.25 * (y + step), 0.25 * (z + step)
    mean = (x + y + z) / 3.0
    dx, dy = 1.0 - x / mean, 1.0 - y / mean
    dz = -(dx + dy)
    e2, e3 = dx * dy - dz * dz, dx * dy * dz
    series = 1.0 - e2 / 10.0 + e3 / 14.0 + e2 * e2 / 24.0 - 3.0 * e2 * e3 / 44.0
    return np.asarray(series / np.sqrt(mean))


def _incomplete(sin: Floats, cos: Floats, complement: Floats) -> Floats:
    """Return F(phi) for the angle phi in [-pi, pi] that has this sine and cosine."""
    # for angles beyond +-pi/2, measured from +-pi
    with np.errstate(divide="ignore", invalid="ignore"):
        inner = sin * carlson_rf(cos * cos, cos * cos + complement * sin * sin, np.ones_like(sin))
        outer = np.copysign(2.0 * agm_quarter_period(complement), sin) - inner
    return np.asarray(np.where(cos >= 0.0, inner, outer))


def jacobi(u: Floats, complement: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Return sn, cn, dn and the amplitude am of `u`, from `complement` ``1 - m`` that broadcasts against it."""
    u = np.asarray(u, dtype=float)
    each = np.broadcast_to(complement, u.shape)
    sn, cn, dn, turns = (x.reshape(u.shape) for x in _reduced(u.reshape(-1, 1), each.reshape(-1)))
    sign = _sign(turns)
    return sign * sn, sign * cn, dn, on_arrays.atan2(sn, cn) + np.pi * turns


def _sign(half_turns: Floats) -> Floats:
    """Return 1 for an even number and -1 for an odd one."""
    return np.asarray(1.0 - 2.0 * (half_turns - 2.0 * np.floor(0.5 * half_turns)))


def _reduced(u: Floats, complement: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Return sn, cn, dn of `u` reduced by a multiple of the half period 2 K, and that multiple.

    The shape of `u` is (rows, n), that of `complement` (rows,), so that the means are computed once per row.
    """
    result = np.full((4, *u.shape), np.nan)
    for chosen, steps in _classes(complement):
        result[:, chosen] = _general(u[chosen], complement[chosen], steps)
    separatrix = complement == 0.0
    if separatrix.any():
        # K is infinite: nothing to reduce
        x = u[separatrix]
        sech = 1.0 / on_arrays.cosh(np.clip(x, -700.0, 700.0))
        result[:, separatrix] = on_arrays.tanh(x), sech, sech, np.zeros_like(x)
    sn, cn, dn, turns = result
    return sn, cn, dn, turns


def _general(u: Floats, complement: Floats, steps: int) -> tuple[Floats, ...]:
    """Return sn, cn, dn by descending Landen transformations (Bulirsch 1965), and the number of half periods."""
    a, emc, means = np.ones_like(complement), complement, []
    for _ in range(steps):
        root = np.sqrt(emc)
        means.append((a[:, None], root[:, None]))
        a, emc = 0.5 * (a + root), a * root
    period = (np.pi / a)[:, None]
    half_turns = np.rint(u / period)
    u = u - period * half_turns
    angle = u * a[:, None]
    sin, cos = on_arrays.sin(angle), on_arrays.cos(angle)
    small = np.abs(sin) < 1e-100  # sn u = u to the last digit, and 1/u would soon overflow
    ratio = cos / np.where(small, 1.0, sin)
    c, dn = a[:, None] * ratio, np.ones_like(u)
    for mean, root in reversed(means):
        ratio, c = ratio * c, c * dn
        dn = (root + ratio) / (mean + ratio)
        ratio = c / mean
    sn = np.copysign(1.0 / np.sqrt(c * c + 1.0), sin)
    result = [sn, c * sn, dn]
    if small.any():
        one = np.ones_like(u)
        result = [np.where(small, x, y) for x, y in zip((u, one, one), result, strict=True)]
    return (*result, half_turns)


def _energy(initial: Numbers, parameters: Numbers) -> tuple[Floats, ...]:
    """Return w, the full turns in theta_0, sin(theta_0/2), cos(theta_0/2), omega_0/(2 w) and ``1 - k^2``."""
    w, theta, omega = np.broadcast_arrays(
        np.sqrt(np.divide(parameters["g"], parameters["L"])), initial["theta"], initial["omega"]
    )
    turns = np.rint(theta / (2.0 * np.pi))
    half = 0.5 * (theta - 2.0 * np.pi * turns)
    speed = omega / (2.0 * w)
    cosine = on_arrays.cos(half)
    return w, turns, on_arrays.sin(half), cosine, speed, (cosine - speed) * (cosine + speed)


def pendulum_motion(t: Floats, initial: Numbers, parameters: Numbers) -> dict[str, Floats]:
    """Return the exact theta [rad] and omega [rad per unit of time] at times `t`, shape (..., n_t).

    ``theta`` and ``omega`` at t = 0, ``g`` and ``L`` have the shape (..., 1) or (). The rounding error is about
    ``(1 + w t)`` units in the last place, times the sensitivity to the initial values.
    """
    start = _energy(initial, parameters)
    t = np.asarray(t, dtype=float)
    shape = np.broadcast_shapes(t.shape, start[0].shape)
    rows = (*shape[:-1], 1)
    w, turns, sine, cosine, speed, complement = (np.broadcast_to(x, rows).ravel() for x in start)
    t = np.broadcast_to(t, shape).reshape(-1, shape[-1])
    k = on_arrays.hypot(sine, speed)
    theta, omega = np.empty_like(t, order="C"), np.empty_like(t, order="C")
    swings = complement >= 0.0
    for move, mask in ((_libration, swings), (_rotation, ~swings)):
        if mask.any():
            chosen = slice(None) if mask.all() else mask
            columns = (x[chosen] for x in (w, k, sine, cosine, speed, complement))
            theta[chosen], omega[chosen] = move(t[chosen], *columns)
    theta += (2.0 * np.pi * turns)[:, None]
    return {"theta": theta.reshape(shape), "omega": omega.reshape(shape)}


def _libration(t: Floats, *start: Floats) -> tuple[Floats, Floats]:
    """Return theta and omega, shape (rows, n), of oscillating rows."""
    w, k, sine, _, speed, complement = start
    size = np.where(k == 0.0, 1.0, k)
    phase = _incomplete(sine / size, speed / size, complement)
    sn, cn, dn, half = _reduced(w[:, None] * t + phase[:, None], complement)
    sign = _sign(half)
    return 2.0 * on_arrays.atan2(k[:, None] * (sign * sn), dn), (2.0 * w * k)[:, None] * (sign * cn)


def _rotation(t: Floats, *start: Floats) -> tuple[Floats, Floats]:
    """Return theta and omega, shape (rows, n), of rotating rows."""
    w, k, sine, cosine, speed, complement = start
    sign = np.copysign(1.0, speed)
    inverse = -complement / (k * k)  # 1 - 1/k^2
    phase = _incomplete(sign * sine, cosine, inverse)
    sn, cn, dn, half = _reduced((w * k)[:, None] * t + phase[:, None], inverse)
    amplitude = on_arrays.atan2(sn, cn) + np.pi * half
    return (2.0 * sign)[:, None] * amplitude, (2.0 * sign * w * k)[:, None] * dn


def pendulum_period(initial: Numbers, parameters: Numbers) -> Any:
    """Return the exact period of an oscillation, or the time of one turn if the pendulum rotates.

    Infinite on the separatrix; NaN at rest. In the unit of time of the parameters, in the shape of the arguments.
    """
    w, _, sine, _, speed, complement = _energy(initial, parameters)
    k = on_arrays.hypot(sine, speed)
    swings = complement >= 0.0
    with np.errstate(invalid="ignore", over="ignore"):
        quarter = agm_quarter_period(
            np.where(swings, complement, -complement / np.where(swings, 1.0, k * k))
        )
        period = np.where(swings, 4.0 * quarter / w, 2.0 * quarter / (w * np.where(swings, 1.0, k)))
    return np.where(k == 0.0, np.nan, period)
