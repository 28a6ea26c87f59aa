"""Events of Coulomb friction (`vibsim.models.events.Friction`): a body stops, sticks, turns and slides again.

Modes: 1 and -1 for the direction in which the body slides, 0 while it sticks. A kernel of a model with friction binds
these functions; they reach the model through ``drive`` and ``limit``.
"""

from __future__ import annotations

from typing import Any

from vibsim.engine.kernel_stubs import P, unbound
from vibsim.formula import Binary, Name
from vibsim.models import Model
from vibsim.models.base import Formula, tree
from vibsim.models.events import Friction

# bound by the kernel (`vibsim.engine.kernel_stubs`)
drive = limit = mode_of = unbound

MODE = "_mode"
"""Name of the mode in formulas, which no parameter can have."""


def accelerations(model: Model, events: Friction) -> list[Formula]:
    """Return the acceleration of a body that slides in the direction of the mode."""
    held = Binary("*", Name(MODE), tree(model, events.limit))
    return [Binary("-", tree(model, events.drive), held)]


def formulas(model: Model, events: Friction) -> dict[str, dict[str, Formula]]:
    """Return the formulas of the functions of the model, by function and result."""
    return {"drive": {"_drive": events.drive}, "limit": {"_limit": events.limit}}


def slip(u: float, t: float, p: P) -> float:
    """Return the direction in which a body at rest starts to slide; 0 if it sticks."""
    force = drive(u, 0.0, t, p)
    if abs(force) <= limit(u, 0.0, t, p):
        return 0.0
    return 1.0 if force > 0.0 else -1.0


def first_mode(u: float, v: float, t: float, p: P) -> float:
    """Return the initial mode."""
    if v == 0.0:
        return slip(u, t, p)
    return 1.0 if v > 0.0 else -1.0


def guard(u: float, v: float, t: float, p: P) -> float:
    """Return the guard, which falls below 0 at the event: the speed, or what friction can still hold."""
    mode = mode_of(p)
    if mode == 0.0:
        return limit(u, 0.0, t, p) - abs(drive(u, 0.0, t, p))
    return mode * v


def guard_on_mesh(u: float, v: float, t: float, p: P) -> float:
    """Return the guard on the mesh: the same as `guard`."""
    return guard(u, v, t, p)


def followed(u: float, v: float, t: float, p: P) -> float:
    """Return the mode at the end of a smooth piece without an event: unchanged."""
    return mode_of(p)


def held(v: float) -> float:
    """Return the velocity of a body at rest."""
    return 0.0


def landed(u: float, v: float) -> tuple[float, float]:
    """Return position and velocity at a located event, where the body is at rest."""
    return u, 0.0


def settled(
    u: float, v: float, t: float, before: float, is_last: bool, p: P
) -> tuple[float, float, float]:
    """Return position, velocity and mode after an event; on the mesh the velocity may already have changed its sign."""
    if is_last:
        return u, 0.0, 0.0
    direction = slip(u, t, p)
    if direction == 0.0 or v == 0.0:
        return u, 0.0, direction
    return u, v, 1.0 if v > 0.0 else -1.0


def counts_as_event(before: float, after: float, came: Any, goes: Any) -> bool:
    """Tell whether a change of the mode counts as an event: always."""
    return True


def is_at_rest(mode: float) -> bool:
    """Tell whether the body sticks."""
    return mode == 0.0


def spent(u: float, ahead: float) -> float:
    """Return the length of the path between two positions, without a turn in between."""
    return abs(ahead - u)


def lost(came: Any, goes: Any, t: float, p: P) -> float:
    """Return the cost of an event in addition to the path: 0."""
    return 0.0


def turning(before: float, after: float, v: float, own: float) -> float:
    """Return 1 for a peak between two modes, -1 for a trough, 0 for neither."""
    if before * after < 0.0:
        return before
    return 0.0
