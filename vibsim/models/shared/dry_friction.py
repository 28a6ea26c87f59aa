r"""The free oscillation with Coulomb friction, ``u'' + w^2 u + w^2 c sign(u') = 0``, exactly.

While it slides in the direction s = 1 or -1 it is a harmonic oscillation about ``-s c``. The first piece ends at the
first zero of the velocity; from there every piece takes half a period, ``pi/w``, and the size of the turning point
falls by 2 c, until one is within c of the origin: there the body sticks for ever.

Source: vibration text (B), section 10.3, equation (86) with s(u) = k u; c = mu m g/k.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from vibsim.models.base import Floats


class Swings(NamedTuple):
    """The pieces of a motion; arrays that broadcast against the times."""

    direction: Any
    """Of the first piece: 1 or -1, 0 where the body sticks from the beginning."""
    radius: Any
    """Of the first piece."""
    angle: Any
    """``w t`` at the end of the first piece."""
    turn: Any
    """Position there."""
    count: Any
    """Number of half periods behind it; infinite without friction."""


def swings(w: Any, c: Any, u_0: Any, v_0: Any) -> Swings:
    """Return the pieces of the motion from initial values, all arrays broadcast."""
    sticks = np.abs(u_0) <= c
    direction = np.where(v_0 == 0, np.where(sticks, 0.0, -np.sign(u_0)), np.sign(v_0))
    away = u_0 + direction * c
    radius = np.where(direction == 0, 0.0, np.hypot(away, v_0 / w))
    # the velocity vanishes where the oscillation is at its end on the side of `direction`
    start = np.arctan2(np.abs(v_0) / w, direction * away)
    turn = np.where(direction == 0, u_0, direction * (radius - c))
    with np.errstate(divide="ignore", invalid="ignore"):
        count = np.ceil((np.abs(turn) - c) / (2.0 * c))
    count = np.where(np.abs(turn) <= c, 0.0, count)
    return Swings(direction, radius, np.where(direction == 0, 0.0, start), turn, count)


def friction_motion(t: Floats, w: Any, c: Any, u_0: Any, v_0: Any) -> tuple[Floats, Floats]:
    """Return position and velocity at times `t`, shape (..., n_t), from numbers of shape (..., 1) or ().

    Parameters
    ----------
    w, c
        Angular frequency without friction, and the largest distance at which the body sticks.
    u_0, v_0
        Initial position and velocity.
    """
    s = swings(w, c, u_0, v_0)
    phase = w * t
    with np.errstate(invalid="ignore"):
        done = np.clip(np.floor((phase - s.angle) / np.pi), 0.0, s.count)
        size = np.abs(s.turn) - 2.0 * c * done
        side = np.sign(s.turn) * np.where(done % 2 == 0, 1.0, -1.0)
        # a piece that begins at rest at x slides towards the origin, about -s c = sign(x) c
        late = phase - s.angle - np.pi * done
        u = side * (c + (size - c) * np.cos(late))
        v = -side * (size - c) * w * np.sin(late)
        first = phase < s.angle
        early = phase - s.angle
        u = np.where(first, s.direction * (s.radius * np.cos(early) - c), u)
        v = np.where(first, -s.direction * s.radius * w * np.sin(early), v)
        rests = ~first & (done >= s.count)
        u = np.where(rests, side * size, u)
        u = np.where(s.direction == 0, u_0, u)
        v = np.where(rests | (s.direction == 0), 0.0, v)
    return np.asarray(u), np.asarray(v)


def sticking_time(w: Any, c: Any, u_0: Any, v_0: Any) -> Any:
    """Return the time from which the body sticks; infinite without friction, but for a body at rest at the origin."""
    s = swings(w, c, u_0, v_0)
    return np.where(s.direction == 0, 0.0, (s.angle + np.pi * s.count) / w)
