"""The harmonic oscillation ``u'' = -w^2 u``, which the linear models share."""

from __future__ import annotations

from typing import Any

import numpy as np

from vibsim.models.base import Floats


def motion(t: Floats, w: Any, u_0: Any, v_0: Any) -> tuple[Floats, Floats]:
    """Return position and velocity at times `t`: vibration text (B), equation (2), for any initial velocity."""
    cos, sin = np.cos(w * t), np.sin(w * t)
    return u_0 * cos + v_0 / w * sin, v_0 * cos - u_0 * w * sin


def damped_motion(
    t: Floats, stiffness: Any, half: Any, u_0: Any, v_0: Any
) -> tuple[Floats, Floats]:
    """Return position and velocity of ``u'' + 2 half u' + stiffness u = 0`` at times `t`, in every regime.

    Source: vibration text (B), section 8 and exercise 11; with ``q = sqrt(|stiffness - half^2|)`` the solution is
    ``exp(-half t) (u_0 C + (v_0 + half u_0) S)``, with ``C = cos(q t)``, ``S = sin(q t)/q`` below critical damping,
    1 and t at it, and the hyperbolic functions above, which are taken together with the exponential. Its velocity is
    ``exp(-half t) (v_0 (C - half S) - stiffness u_0 S)``.
    """
    with np.errstate(all="ignore"):
        square = stiffness - half * half
        q = np.sqrt(np.abs(square))
        decay = np.exp(-half * t)
        # half - q and half + q: the smaller one from their product, without cancellation
        large = half + np.copysign(q, half)
        small_rate = stiffness / large
        least, most = np.minimum(large, small_rate), np.maximum(large, small_rate)
        fast, slow = np.exp(-most * t), np.exp(-least * t)
        angle = q * t
        # sin(x)/x and its hyperbolic twin are 1 where the damping is critical
        small = np.abs(angle) < 1e-8
        even, wave = decay * np.cos(angle), np.where(small, decay * t, decay * np.sin(angle) / q)
        loss = np.expm1(-2.0 * angle)
        rise = np.where(small, decay * t, -0.5 * slow * loss / q)
        # C + half S and C - half S: above critical damping one of them cancels as a sum
        is_near, width = 2.0 * angle < 1.0, 2.0 * q
        rest = np.where(is_near, slow * (1.0 - least * loss / width), most * slow - least * fast)
        kick = np.where(is_near, slow * (1.0 + most * loss / width), most * fast - least * slow)
        rest, kick = (np.where(is_near, part, part / width) for part in (rest, kick))
        is_wave = (square >= 0.0) | small
        odd = np.where(square >= 0.0, wave, rise)
        rest = np.where(is_wave, even + half * odd, rest)
        kick = np.where(is_wave, even - half * odd, kick)
    return np.asarray(u_0 * rest + v_0 * odd), np.asarray(v_0 * kick - stiffness * u_0 * odd)


def period(w: Any, u_0: Any, v_0: Any) -> Any:
    """Return ``2 pi/w``, whatever the amplitude; NaN at rest."""
    rest = (np.asarray(u_0) == 0) & (np.asarray(v_0) == 0)
    return np.where(rest, np.nan, 2 * np.pi / w)
