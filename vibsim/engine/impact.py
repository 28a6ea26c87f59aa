"""The events of a body that bounces (`vibsim.models.events.Impact`): impacts on the ground, and rest.

Modes: 1 in flight, 0 at rest on the ground, for ever. A kernel of such a model binds these functions; they know the
model by ``impact_of``.
"""

from __future__ import annotations

from typing import Any

from vibsim.engine.kernel_stubs import P, unbound

# bound by the kernel (`vibsim.engine.kernel_stubs`)
impact_of = mode_of = unbound


def first_mode(u: float, v: float, t: float, p: P) -> float:
    """Return the mode at the beginning: rest for a body that is slow and on the ground."""
    return 0.0 if u <= 0.0 and abs(v) <= impact_of(u, v, t, p)[2] else 1.0


def guard(u: float, v: float, t: float, p: P) -> float:
    """Return a number that falls below 0 at an impact: the height."""
    return 1.0 if mode_of(p) == 0.0 else u


def guard_on_mesh(u: float, v: float, t: float, p: P) -> float:
    """Return a number below 0 at a grid point where the body falls and is near the ground (text, section 10.9)."""
    return 1.0 if mode_of(p) == 0.0 or v > 0.0 else u - impact_of(u, v, t, p)[1]


def followed(u: float, v: float, t: float, p: P) -> float:
    """Return the mode at the end of a smooth piece, without an event: the same."""
    return mode_of(p)


def held(v: float) -> float:
    """Return the velocity of a body at rest."""
    return 0.0


def landed(u: float, v: float) -> tuple[float, float]:
    """Return position and velocity at an impact."""
    return 0.0, v


def settled(
    u: float, v: float, t: float, before: float, is_last: bool, p: P
) -> tuple[float, float, float]:
    """Return position, velocity and mode behind an impact.

    On the mesh a body that falls is below the ground already. It stays there and rises from there, since a body that
    were lifted would win energy and bounce for ever. It also comes to rest where it has not left the ground at the
    point before: two impacts on end mean that the motion has stopped (text, exercise 20).
    """
    restitution, near, slow = impact_of(u, v, t, p)
    speed = restitution * abs(v)
    if is_last or not speed > slow or before < near:
        return 0.0, 0.0, 0.0
    return u, speed, 1.0


def counts_as_event(before: float, after: float, came: Any, goes: Any) -> bool:
    """Tell whether a change of the mode is an event: each is."""
    return True


def is_at_rest(mode: float) -> bool:
    """Tell whether the body lies on the ground."""
    return mode == 0.0


def spent(u: float, ahead: float) -> float:
    """Return what a flight costs: nothing."""
    return 0.0


def lost(came: Any, goes: Any, t: float, p: P) -> float:
    """Return half of what the square of the velocity has lost."""
    before, after = came[1], goes[1]
    return 0.5 * (before * before - after * after)


def turning(before: float, after: float, v: float, own: float) -> float:
    """Return -1 where the body bounces, which is a trough, and 0 where it stays."""
    return -1.0 if after != 0.0 else 0.0
