r"""The exact motion of the pendulum by Jacobi's elliptic functions.

With ``w = sqrt(g/L)`` and ``k^2 = sin^2(theta_0/2) + (omega_0/(2 w))^2`` (the energy in units of 2 m g L):

- libration, k < 1: ``sin(theta/2) = k sn(u, k)``, ``omega = 2 w k cn(u, k)``, period ``4 K(k)/w``;
- rotation, k > 1: ``theta/2 = +-am(k u, 1/k)``, ``omega = +-2 w k dn(k u, 1/k)``, time of a turn ``2 K(1/k)/(w k)``;
- separatrix, k = 1: ``sin(theta/2) = tanh u``, infinite period.

Everything is computed from the *complementary* parameter ``1 - k^2 = cos^2(theta_0/2) - (omega_0/(2 w))^2``, so that
nothing is lost near the separatrix; a library routine that takes the parameter itself has lost it before it starts
(measured at 1 - m = 1e-12, u = 20: wrong in the ninth digit, and 3e30 at u = 100).

Source: pendulum lecture (A), section 1.2, which mentions the closed form; Abramowitz and Stegun, chapters 16 and 17;
R. Bulirsch, Numerische Mathematik 7 (1965) 78-90 (sn, cn, dn);
B. C. Carlson, Numerical Algorithms 10 (1995) 13-26 (R_F).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from vibsim.models.base import Floats, Numbers

_ITERATIONS = 24  # the mean of 1 and 1e-160 needs 16; each further step squares the defect


def agm_quarter_period(complement: Floats) -> Floats:
    """Return the complete elliptic integral K of the first kind.

    Parameters
    ----------
    complement
        ``1 - m``, from 0 to 1, any shape; K is infinite at 0.
    """
    a, b = np.ones_like(complement), np.sqrt(complement)
    for _ in range(_ITERATIONS):
        a, b = 0.5 * (a + b), np.sqrt(a * b)
    with np.errstate(divide="ignore"):
        return np.asarray(np.where(complement > 0, 0.5 * np.pi / a, np.inf))


def carlson_rf(x: Floats, y: Floats, z: Floats) -> Floats:
    """Return Carlson's symmetric integral R_F(x, y, z) of arguments >= 0, at most one of them 0."""
    for _ in range(_ITERATIONS):
        rx, ry, rz = np.sqrt(x), np.sqrt(y), np.sqrt(z)
        step = rx * ry + ry * rz + rz * rx
        x, y, z = 0.25 * (x + step), 0.25 * (y + step), 0.25 * (z + step)
    return np.asarray(1.0 / np.sqrt((x + y + z) / 3.0))


def _incomplete(sin: Floats, cos: Floats, complement: Floats) -> Floats:
    """Return F(phi) for the angle phi in [-pi, pi] that has this sine and cosine."""
    # an angle behind +-pi/2 is reached from the nearest multiple of pi
    with np.errstate(divide="ignore", invalid="ignore"):
        inner = sin * carlson_rf(cos * cos, cos * cos + complement * sin * sin, np.ones_like(sin))
        outer = np.copysign(2.0 * agm_quarter_period(complement), sin) - inner
    return np.asarray(np.where(cos >= 0.0, inner, outer))


def jacobi(u: Floats, complement: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Return sn, cn, dn and the amplitude am of `u`.

    Parameters
    ----------
    u
        Argument, any shape.
    complement
        ``1 - m``, from 0 to 1, of a shape that broadcasts against `u`.
    """
    complement = np.broadcast_to(complement, np.shape(u))
    quarter = agm_quarter_period(complement)
    finite = np.isfinite(quarter)
    half_turns = np.rint(u / np.where(finite, 2.0 * quarter, np.inf))
    reduced = u - np.where(finite, 2.0 * quarter, 0.0) * half_turns
    sn, cn, dn = _bulirsch(reduced, np.where(finite, complement, 1.0))
    sech = 1.0 / np.cosh(np.clip(reduced, -700.0, 700.0))
    sn, cn, dn = (
        np.where(finite, general, limit)
        for general, limit in ((sn, np.tanh(reduced)), (cn, sech), (dn, sech))
    )
    amplitude = np.arctan2(sn, cn) + np.pi * half_turns
    sign = 1.0 - 2.0 * np.abs(np.fmod(half_turns, 2.0))
    return sign * sn, sign * cn, dn, amplitude


def _bulirsch(u: Floats, complement: Floats) -> tuple[Floats, Floats, Floats]:
    """Return sn, cn, dn for -K <= u <= K by descending Landen transformations (Bulirsch 1965)."""
    a, emc, means = np.ones_like(u), complement, []
    for _ in range(_ITERATIONS):
        root = np.sqrt(emc)
        means.append((a, root))
        a, emc = 0.5 * (a + root), a * root
    sin, cos = np.sin(u * a), np.cos(u * a)
    small = np.abs(sin) < 1e-100  # sn u = u to the last digit, and 1/u would soon overflow
    ratio = cos / np.where(small, 1.0, sin)
    c, dn = a * ratio, np.ones_like(u)
    for mean, root in reversed(means):
        ratio, c = ratio * c, c * dn
        dn = (root + ratio) / (mean + ratio)
        ratio = c / mean
    sn = np.copysign(1.0 / np.hypot(c, 1.0), sin)
    return np.where(small, u, sn), np.where(small, 1.0, c * sn), np.where(small, 1.0, dn)


def _energy(initial: Numbers, parameters: Numbers) -> tuple[Floats, ...]:
    """Return w, the turns before theta_0, sin(theta_0/2), cos(theta_0/2), omega_0/(2 w) and ``1 - k^2``."""
    w, theta, omega = np.broadcast_arrays(
        np.sqrt(np.divide(parameters["g"], parameters["L"])), initial["theta"], initial["omega"]
    )
    turns = np.rint(theta / (2.0 * np.pi))
    half = 0.5 * (theta - 2.0 * np.pi * turns)
    speed = omega / (2.0 * w)
    cosine = np.cos(half)
    return w, turns, np.sin(half), cosine, speed, (cosine - speed) * (cosine + speed)


def pendulum_motion(t: Floats, initial: Numbers, parameters: Numbers) -> dict[str, Floats]:
    """Return the exact theta [rad] and omega [rad per unit of time] of the pendulum.

    Parameters
    ----------
    t
        Times, shape (..., n_t).
    initial
        ``theta`` and ``omega`` at t = 0, shape (..., 1) or ().
    parameters
        ``g`` and ``L``, shape (..., 1) or ().

    Notes
    -----
    The rounding error is about ``(1 + w t)`` units in the last place, times the sensitivity to the initial values.
    """
    w, turns, sine, cosine, speed, complement = _energy(initial, parameters)
    t = np.asarray(t, dtype=float)
    k = np.hypot(sine, speed)
    swings = complement >= 0.0
    swing = _libration(t, w, k, sine, speed, np.where(swings, complement, 1.0))
    spin = _rotation(
        t, w, np.where(swings, 1.0, k), sine, cosine, speed, np.where(swings, 0.0, complement)
    )
    theta, omega = (np.where(swings, a, b) for a, b in zip(swing, spin, strict=True))
    return {"theta": theta + 2.0 * np.pi * turns, "omega": omega}


def _libration(
    t: Floats, w: Floats, k: Floats, sine: Floats, speed: Floats, complement: Floats
) -> tuple[Floats, Floats]:
    at_rest = k == 0.0
    size = np.where(at_rest, 1.0, k)
    start = _incomplete(sine / size, speed / size, complement)
    sn, cn, dn, _ = jacobi(w * t + start, complement)
    return 2.0 * np.arctan2(k * sn, dn), 2.0 * w * k * cn


def _rotation(
    t: Floats,
    w: Floats,
    k: Floats,
    sine: Floats,
    cosine: Floats,
    speed: Floats,
    complement: Floats,
) -> tuple[Floats, Floats]:
    sign = np.copysign(1.0, speed)
    inverse = -complement / (k * k)  # 1 - 1/k^2
    start = _incomplete(sign * sine, cosine, inverse)
    _, _, dn, amplitude = jacobi(w * k * t + start, inverse)
    return 2.0 * sign * amplitude, 2.0 * sign * w * k * dn


def pendulum_period(initial: Numbers, parameters: Numbers) -> Any:
    """Return the exact period: of an oscillation, or of one turn when the pendulum goes over the top.

    Infinite on the separatrix; NaN at rest. Units of time of the parameters; the shape of the arguments.
    """
    w, _, sine, _, speed, complement = _energy(initial, parameters)
    k = np.hypot(sine, speed)
    swings = complement >= 0.0
    with np.errstate(invalid="ignore"):
        quarter = agm_quarter_period(
            np.where(swings, complement, -complement / np.where(swings, 1.0, k * k))
        )
        period = np.where(swings, 4.0 * quarter / w, 2.0 * quarter / (w * np.where(swings, 1.0, k)))
    return np.where(k == 0.0, np.nan, period)
