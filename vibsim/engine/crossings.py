"""The events that a user writes as formulas (`vibsim.models.events.Crossings`): guards that change their signs.

Modes: 0 where the motion has ended; else 1 and, for every guard k that is above 0, 2**k more. An event is *watched*
while the guard is on the side from which its crossing counts. It goes over to the other side by a crossing, which is an
event where it is watched; else that is noted where a smooth piece ends. Behind an event the guard that has fired is 0
but for rounding, and its rate tells the side into which the motion goes: a body that bounces off is watched again, one
that goes through is not before it has come back. A guard that a jump of the state steps over has no event.

A kernel of such a model binds these functions; they know the model by ``guards``, ``guard_rates``, ``crossed`` and
``is_end``, and a loop over the guards is written out.
"""

from __future__ import annotations

import math
from typing import Any

from vibsim.engine.kernel_stubs import P, unbound
from vibsim.engine.text import Module, collect
from vibsim.models.events import Crossings

# bound by the kernel (`vibsim.engine.kernel_stubs`)
crossed = energies = first_crossed = guard_rates = guards = is_end = is_ended_by = mode_of = unbound
nearest_watched = sides_behind = sides_followed = sides_of = unbound

AT_ONCE = 2.0**-50
"""Within this part of the time two events are at the same time."""


def put_rows(module: Module, events: Crossings, *, is_located: bool) -> None:
    """Write what goes through all guards, and what tells one event from another.

    On the mesh a guard that is noticed late may have turned back: an event happens where it still goes its way, and the
    motion ends whatever it does.
    """
    for text in (side_of, is_watched, nearer, free_side, has_just_left, side_behind, on_its_side):
        collect(module, text, text.__name__, {})
    rows = [(k, row, f"{2.0**k}", f"{float(row.direction)}") for k, row in enumerate(events.rows)]

    def total(line: str) -> str:
        return "return 1.0 + " + " + ".join(
            line.format(k=k, place=place, direction=direction) for k, _, place, direction in rows
        )

    module.define("sides_of(g, r)", total("{place} * free_side(g[{k}], r[{k}], 1.0, {direction})"))
    module.define(
        "nearest_watched(mode, g)",
        "least = math.inf",
        *(f"least = nearer(least, side_of(mode, {s}), g[{k}], {d})" for k, _, s, d in rows),
        "return least",
    )
    fires = "side_of(mode, {s}) * g[{k}] < 0.0 and is_watched(side_of(mode, {s}), {d})"
    goes_on = "" if is_located else " and side_of(mode, {s}) * r[{k}] < 0.0"
    module.define(
        "first_crossed(mode, g, r)",
        *(
            line
            for k, row, s, d in rows
            for line in (
                f"if {(fires + ('' if row.ends else goes_on)).format(k=k, s=s, d=d)}:",
                f"    return {float(k)}",
            )
        ),
        "return -1.0",
    )
    module.define(
        "sides_behind(mode, fired, g, b, h, r, t)",
        total(
            "{place} * side_behind(side_of(mode, {place}), fired == {k}.0 or "
            "has_just_left(side_of(mode, {place}), g[{k}], b[{k}], t), g[{k}], h[{k}], r[{k}], {direction})"
        ),
    )
    module.define(
        "sides_followed(mode, g)",
        total("{place} * on_its_side(side_of(mode, {place}), g[{k}], {direction})"),
    )
    ends = [f"k == {k}.0" for k, row, *_ in rows if row.ends]
    module.define("is_end(k)", f"return {' or '.join(ends) or 'k != k'}")
    jumped = [f"(h[{k}] < 0.0 and h[{k}] != g[{k}])" for k, row, *_ in rows if row.ends]
    module.define("is_ended_by(g, h)", f"return {' or '.join(jumped) or 'False'}")
    module.define(
        "crossed(k, u, v, t, p)",
        *(
            line
            for k, *_ in rows[:-1]
            for line in (f"if k == {k}.0:", f"    return crossed_{k}(u, v, t, p)")
        ),
        f"return crossed_{rows[-1][0]}(u, v, t, p)",
    )


def side_of(mode: float, place: float) -> float:
    """Return 1 for a guard above 0, -1 for one below, from its `place` in the mode, a power of 2."""
    return 1.0 if math.floor((mode - 1.0) / place) % 2 == 1 else -1.0


def is_watched(side: float, direction: float) -> bool:
    """Tell whether a crossing from a side is an event."""
    return side * direction <= 0.0


def nearer(least: float, side: float, value: float, direction: float) -> float:
    """Return the smaller one of a guard and the least one so far, positive before its event."""
    ahead = side * value
    return ahead if is_watched(side, direction) and ahead < least else least


def free_side(value: float, rate: float, side: float, direction: float) -> float:
    """Return 1 for a guard above 0, else 0.

    On 0 its rate tells; where that vanishes too, the guard is on the side that is watched, or keeps `side`.
    """
    if value == 0.0:
        if rate == 0.0:
            return 0.5 - 0.5 * direction if direction != 0.0 else 0.5 + 0.5 * side
        return 1.0 if rate > 0.0 else 0.0
    return 1.0 if value > 0.0 else 0.0


def has_just_left(side: float, value: float, rate: float, t: float) -> bool:
    """Tell whether a guard was 0 at the same time: its own event was the one before."""
    return side * rate > 0.0 and side * value >= 0.0 and abs(value) <= AT_ONCE * (abs(rate) * t)


def side_behind(
    side: float, fired: bool, value: float, ahead: float, rate: float, direction: float
) -> float:
    """Return 1 for a guard that is above 0 behind an event, else 0.

    Parameters
    ----------
    side
        The one before.
    fired
        Whether the event is its own, or its own was at the same time.
    value, ahead, rate
        The guard before the event; the guard and its rate behind it.
    """
    if fired and abs(ahead) <= abs(value):
        return free_side(0.0, rate, side, direction)
    if ahead == value and is_watched(side, direction):
        # it may have crossed at the same time: its event comes next
        return 0.5 + 0.5 * side
    return free_side(ahead, rate, side, direction)


def on_its_side(side: float, value: float, direction: float) -> float:
    """Return 1 for a guard that is above 0 where a smooth piece ends, else 0; one that is watched has not crossed."""
    if side * value < 0.0 and not is_watched(side, direction):
        return 0.5 - 0.5 * side
    return 0.5 + 0.5 * side


def first_mode(u: float, v: float, t: float, p: P) -> float:
    """Return the mode at the beginning."""
    return sides_of(guards(u, v, t, p), guard_rates(u, v, t, p))


def guard(u: float, v: float, t: float, p: P) -> float:
    """Return a number that falls below 0 where the first guard that is watched crosses 0."""
    mode = mode_of(p)
    return 1.0 if mode == 0.0 else nearest_watched(mode, guards(u, v, t, p))


def guard_on_mesh(u: float, v: float, t: float, p: P) -> float:
    """Return a number below 0 at a grid point where an event happens, or the motion ends."""
    mode = mode_of(p)
    if mode == 0.0:
        return 1.0
    fired = first_crossed(mode, guards(u, v, t, p), guard_rates(u, v, t, p))
    return -1.0 if fired >= 0.0 else 1.0


def followed(u: float, v: float, t: float, p: P) -> float:
    """Return the mode at the end of a smooth piece: guards that are not watched may have crossed 0."""
    mode = mode_of(p)
    return 0.0 if mode == 0.0 else sides_followed(mode, guards(u, v, t, p))


def held(v: float) -> float:
    """Return the velocity of a motion that has ended: the one that it had."""
    return v


def landed(u: float, v: float) -> tuple[float, float]:
    """Return position and velocity at a located event."""
    return u, v


def settled(u: float, v: float, t: float, before: float, p: P) -> tuple[float, float, float]:
    """Return position, velocity and mode behind an event."""
    mode = mode_of(p)
    g = guards(u, v, t, p)
    b = guard_rates(u, v, t, p)
    fired = first_crossed(mode, g, b)
    if is_end(fired):
        return u, v, 0.0
    ahead, own = crossed(fired, u, v, t, p)
    h, r = guards(ahead, own, t, p), guard_rates(ahead, own, t, p)
    if is_ended_by(g, h):
        return ahead, own, 0.0
    return ahead, own, sides_behind(mode, fired, g, b, h, r, t)


def spent(u: float, ahead: float) -> float:
    """Return what a smooth piece costs: nothing."""
    return 0.0


def lost(came: Any, goes: Any, t: float, p: P) -> float:
    """Return the energy that goes at an event, below 0 where the event adds some."""
    kinetic, potential = energies(came[0], came[1], t, p)
    kinetic_behind, potential_behind = energies(goes[0], goes[1], t, p)
    return (kinetic + potential) - (kinetic_behind + potential_behind)


def turning(before: float, after: float, v: float, own: float) -> float:
    """Return 1 where the velocity becomes negative at an event, which is a peak, -1 for a trough, 0 for neither."""
    if after == 0.0 or not v * own < 0.0:
        return 0.0
    return 1.0 if v > 0.0 else -1.0
