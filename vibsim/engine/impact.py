"""Events of a bouncing body (`vibsim.models.events.Impact`): impacts on the ground, and rest.

Modes: 1 in flight, 0 at rest on the ground, for ever. A kernel of such a model binds these functions; they reach the
model through ``impact_of``.
"""

from __future__ import annotations

from typing import Any

from vibsim.engine.kernel_stubs import P, unbound
from vibsim.models import Model
from vibsim.models.base import Formula
from vibsim.models.events import Impact

# bound by the kernel (`vibsim.engine.kernel_stubs`)
impact_of = mode_of = unbound


def accelerations(model: Model, events: Impact) -> tuple[Formula, ...]:
    """Return the acceleration in flight."""
    return model.accelerations


def formulas(model: Model, events: Impact) -> dict[str, dict[str, Formula]]:
    """Return the formulas of the functions of the model, by function and result."""
    names = {"_restitution": events.restitution, "_near": events.near, "_slow": events.slow}
    return {"impact_of": names}


def first_mode(u: float, v: float, t: float, p: P) -> float:
    """Return the initial mode: at rest if the body is slow and on the ground."""
    return 0.0 if u <= 0.0 and abs(v) <= impact_of(u, v, t, p)[2] else 1.0


def guard(u: float, v: float, t: float, p: P) -> float:
    """Return the guard, which falls below 0 at an impact: the height."""
    return 1.0 if mode_of(p) == 0.0 else u


def guard_on_mesh(u: float, v: float, t: float, p: P) -> float:
    """Return the guard, below 0 at a grid point where the body falls and is near the ground (text, section 10.9)."""
    return 1.0 if mode_of(p) == 0.0 or v > 0.0 else u - impact_of(u, v, t, p)[1]


def followed(u: float, v: float, t: float, p: P) -> float:
    """Return the mode at the end of a smooth piece without an event: unchanged."""
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
    """Return position, velocity and mode after an impact.

    On the mesh a falling body is already below the ground. It rises from there, because lifting it to the ground would
    add energy and make it bounce for ever. It also comes to rest if it had not left the ground at the previous point:
    two consecutive impacts mean that the motion has stopped (text, exercise 20).
    """
    restitution, near, slow = impact_of(u, v, t, p)
    speed = restitution * abs(v)
    if is_last or not speed > slow or before < near:
        return 0.0, 0.0, 0.0
    return u, speed, 1.0


def counts_as_event(before: float, after: float, came: Any, goes: Any) -> bool:
    """Tell whether a change of the mode counts as an event: always."""
    return True


def is_at_rest(mode: float) -> bool:
    """Tell whether the body lies on the ground."""
    return mode == 0.0


def spent(u: float, ahead: float) -> float:
    """Return the cost of a flight: 0."""
    return 0.0


def lost(came: Any, goes: Any, t: float, p: P) -> float:
    """Return the decrease of ``v^2/2``."""
    before, after = came[1], goes[1]
    return 0.5 * (before * before - after * after)


def turning(before: float, after: float, v: float, own: float) -> float:
    """Return -1 for a bounce, which is a trough, and 0 if the body stays."""
    return -1.0 if after != 0.0 else 0.0
