"""Events that a user writes as formulas (`vibsim.models.events.Crossings`): guards that change their signs.

Mode: 0 after the motion has ended; otherwise 1, plus 2**k for every guard k of n that is above 0, plus 2**(n + k) for
every coordinate that is in *contact* with the fixed stop whose guard is k. A guard is *watched* while it is on the side
from which a crossing counts. A crossing of a watched guard is an event; a crossing in the other direction only updates
the mode at the end of a smooth piece. After an event the guard that fired is 0 up to rounding, and its rate decides
which side the motion enters: after a bounce the guard is watched again, after a passage only once it has come back. A
jump of the state across another guard is no event of that guard.

Flights of a body that loses speed at a stop become ever shorter. When one is too short to be resolved, or there are too
many, the coordinate rests on the stop, while all others move on, until the force on it points away from the stop. There
is no such rest for guards that are not fixed stops: the member fails.

A kernel of such a model binds these functions; they reach the model through ``guards``, ``guard_rates``, ``crossed``
and ``is_end``. Loops over guards are unrolled.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

from vibsim.engine.kernel_stubs import P, unbound
from vibsim.engine.text import Module, collect
from vibsim.formula import Binary, Expression, Name, Number, derivative
from vibsim.models import Model
from vibsim.models.base import Formula, rate, tree
from vibsim.models.events import Crossing, Crossings

# bound by the kernel (`vibsim.engine.kernel_stubs`)
contact_with = contacts_after = contacts_of = crossed = energies = first_crossed = unbound
guard_curvatures = guard_rates = guards = is_end = is_ended_by = is_unresolved = least_pressure = (
    unbound
)
mode_of = nearest_watched = placed = sides_after = sides_followed = sides_of = unbound
size_of = stopped = unbound

AT_ONCE = 2.0**-50
"""Events closer than this, relative to the time, are simultaneous."""
LEAST_HEIGHT = 32.0
"""Twice the height of the lowest resolved flight over a guard, in units of the guard's rounding error."""
FREE = "_free_"
"""Prefix of the index of a coordinate, in the name of a number that is 0 while it rests on a stop and 1 otherwise."""


def accelerations(model: Model, events: Crossings) -> list[Expression]:
    """Return the accelerations, which vanish while a coordinate rests on a stop."""
    stopped = coordinates_with_stops(model, events.rows)
    formulas = [tree(model, formula) for formula in model.accelerations]
    return [
        Binary("*", formula, Name(f"{FREE}{i}")) if i in stopped else formula
        for i, formula in enumerate(formulas)
    ]


def formulas(model: Model, events: Crossings) -> dict[str, dict[str, Formula]]:
    """Return the formulas of the functions of the model, by function and result."""
    guards = [tree(model, row.guard) for row in events.rows]
    rates = [rate(model, guard) for guard in guards]
    functions: dict[str, dict[str, Formula]] = {
        "guards": {f"_guard_{k}": guard for k, guard in enumerate(guards)},
        "guard_rates": {f"_rate_{k}": slope for k, slope in enumerate(rates)},
        "guard_curvatures": {
            f"_curvature_{k}": bend for k, bend in enumerate(_curvatures(model, events, rates))
        },
    }
    for name, place in _places(model, events.rows).items():
        functions[name] = {"_place": place}
    for k, row in enumerate(events.rows):
        new = dict(row.then)
        functions[f"crossed_{k}"] = {
            f"_new_{state.name}": new.get(state.name, state.name) for state in model.states
        }
    return functions


def _curvatures(model: Model, events: Crossings, rates: Sequence[Expression]) -> list[Expression]:
    """Return the second time derivatives of the guards; for guards of stops, as if no coordinate rested on them.

    For a guard that depends on velocities it would need derivatives of the forces, and is set to 0.
    """
    held, stops = accelerations(model, events), fixed_stops(model, events.rows)
    curvatures: list[Expression] = []
    for k, (row, speed) in enumerate(zip(events.rows, rates, strict=True)):
        is_of_positions = not set(model.velocities) & set(tree(model, row.guard).names)
        curvature = rate(model, speed, None if k in stops else held)
        curvatures.append(curvature if is_of_positions else Number(0.0))
    return curvatures


@cache
def fixed_stops(model: Model, rows: tuple[Crossing, ...]) -> dict[int, int]:
    """Return rows that are fixed stops, with their coordinates: the guard is a place, only the velocity changes."""
    stops, moving = {}, {*model.positions, *model.velocities, "t"}
    for k, row in enumerate(rows):
        used = moving & set(tree(model, row.guard).names)
        for i, names in enumerate(zip(model.positions, model.velocities, strict=True)):
            if (used, [name for name, _ in row.then]) == ({names[0]}, [names[1]]):
                stops[k] = i
    return stops


def coordinates_with_stops(model: Model, rows: tuple[Crossing, ...]) -> list[int]:
    """Return the coordinates that may rest on a fixed stop."""
    return sorted(set(fixed_stops(model, rows).values()))


def put_free(module: Module, model: Model, rows: tuple[Crossing, ...]) -> None:
    """Write for each coordinate with stops a function that returns 0 while it rests on one, otherwise 1."""
    stops, count = fixed_stops(model, rows), len(rows)
    collect(module, is_in_contact, is_in_contact.__name__, {})
    for i in coordinates_with_stops(model, rows):
        touching = [f"is_in_contact(mode, {_contact(k, count)})" for k in stops if stops[k] == i]
        module.define(f"free_{i}(mode)", f"return 0.0 if {' or '.join(touching)} else 1.0")


def _places(model: Model, rows: tuple[Crossing, ...]) -> dict[str, Expression]:
    """Return formulas of the places of rest on fixed stops, reflected to the side from which the body came."""
    formulas: dict[str, Expression] = {}
    for k, i in fixed_stops(model, rows).items():
        guard, name = tree(model, rows[k].guard), model.positions[i]
        overshoot = Binary("/", guard, derivative(guard, name))
        formulas[f"place_{k}"] = Binary("-", Name(name), Binary("*", Number(2.0), overshoot))
    return formulas


def _components(name: str, model: Model) -> list[str]:
    """Return the texts of all components of positions or velocities."""
    return [f"{name}[{i}]" for i in range(model.coordinates)] if model.coordinates > 1 else [name]


def _joined(components: Sequence[str]) -> str:
    """Return the text of positions or velocities with these components."""
    return f"vector({', '.join(components)})" if len(components) > 1 else components[0]


def _contact(k: int, count: int) -> float:
    """Return the bit of the mode for a contact with stop k, of `count` rows."""
    return 2.0 ** (count + k)


def put_rows(module: Module, model: Model, events: Crossings, *, is_located: bool) -> None:
    """Write the functions that evaluate all guards and select an event.

    On the mesh a guard that is noticed late may already go back: it is then no event, unless it ends the motion. There
    are no contacts on the mesh.
    """
    for text in (
        *(side_of, is_watched, nearer, free_side, has_just_left, side_after, on_its_side),
        *(is_in_contact, rests, is_too_short),
    ):
        collect(module, text, text.__name__, {})
    rows = [(k, row, f"{2.0**k}", f"{float(row.direction)}") for k, row in enumerate(events.rows)]
    stops = fixed_stops(model, events.rows) if is_located else {}
    _put_contacts(module, model, events, stops)
    apart = {k: f"not is_in_contact(mode, {_contact(k, len(rows))})" for k in stops}

    def total(line: str) -> str:
        return "return 1.0 + " + " + ".join(
            line.format(k=k, place=place, direction=direction) for k, _, place, direction in rows
        )

    module.define("sides_of(g, r)", total("{place} * free_side(g[{k}], r[{k}], 1.0, {direction})"))
    module.define(
        "nearest_watched(mode, g)",
        "least = math.inf",
        *(
            line
            for k, _, s, d in rows
            for line in (
                f"if {apart.get(k, 'True')}:",
                f"    least = nearer(least, side_of(mode, {s}), g[{k}], {d})",
            )
        ),
        "return least",
    )
    fires = "{apart} and side_of(mode, {s}) * g[{k}] < 0.0 and is_watched(side_of(mode, {s}), {d})"
    goes_on = " and side_of(mode, {s}) * r[{k}] < 0.0"
    # guards that go on come first: one that is beyond 0 by rounding and goes back did not fire first
    tests = [(guard, fires + ("" if guard[1].ends else goes_on)) for guard in rows]
    tests += [(guard, fires) for guard in rows] if is_located else []
    module.define(
        "first_crossed(mode, g, r)",
        *(
            line
            for (k, _, s, d), test in tests
            for line in (
                f"if {test.format(k=k, s=s, d=d, apart=apart.get(k, 'True'))}:",
                f"    return {float(k)}",
            )
        ),
        "return -1.0",
    )
    module.define(
        "sides_after(mode, fired, g, b, h, r, q, t)",
        total(
            "{place} * side_after(side_of(mode, {place}), fired == {k}.0 or "
            "has_just_left(side_of(mode, {place}), g[{k}], b[{k}], t), g[{k}], h[{k}], r[{k}], "
            "q[{k}], {direction})"
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
    states = [f"crossed_{k}(u, v, t, p)" for k, *_ in rows]
    _put_choice(module, "crossed(k, u, v, t, p)", dict(enumerate(states[:-1])), states[-1])


def _put_contacts(
    module: Module, model: Model, events: Crossings, stops: Mapping[int, int]
) -> None:
    """Write the functions that begin, keep and end contacts of coordinates with these stops."""
    count = len(events.rows)
    no_contact = 2.0**count
    line = f"return {no_contact} * math.floor((mode - 1.0) / {no_contact})"
    module.define("contacts_of(mode)", line)
    rows = [
        (k, f"side_of(mode, {2.0**k})", f"is_in_contact(mode, {_contact(k, count)})") for k in stops
    ]
    pressed = [
        line
        for k, side, touching in rows
        for line in (
            f"    if {touching} and not -{side} * q[{k}] > least:",
            f"        least = -{side} * q[{k}]",
        )
    ]
    module.define(
        "least_pressure(mode, u, v, t, p)",
        "least = math.inf",
        *(
            (f"if mode > {no_contact}:", "    q = guard_curvatures(u, v, t, p)", *pressed)
            if rows
            else ()
        ),
        "return least",
    )
    terms = [
        f"{_contact(k, count)} * rests(fired == {float(k)} or h[{k}] == 0.0 or {touching} and h[{k}] == g[{k}], "
        f"{side}, r[{k}], q[{k}], {float(events.rows[k].direction)})"
        for k, side, touching in rows
    ]
    module.define(
        "contacts_after(mode, fired, g, h, r, q)", f"return {' + '.join(['0.0', *terms])}"
    )
    short = {
        k: f"is_too_short(side_of(mode, {2.0**k}), g[{k}], b[{k}], q[{k}])" for k in range(count)
    }
    _put_choice(module, "is_unresolved(k, mode, g, b, q)", short, "False")
    _put_choice(module, "contact_with(k)", {k: f"{_contact(k, count)}" for k in stops}, "0.0")
    still = _components("v", model)
    on_stop = {}
    for k, i in stops.items():
        still[i] = f"{_components('v', model)[i]} * free_{i}(mode)"
        on_stop[k] = _components("u", model)
        on_stop[k][i] = f"place_{k}(u, v, t, p)"
    module.define("stopped(v, mode)", f"return {_joined(still)}")
    places_of = {k: _joined(components) for k, components in on_stop.items()}
    _put_choice(module, "placed(k, u, v, t, p)", places_of, "u")
    held = [f"free_{i}(mode) == 0.0" for i in range(model.coordinates)]
    is_every = len(set(stops.values())) == model.coordinates
    module.define(
        "is_at_rest(mode)",
        "return mode == 0.0" + (f" or ({' and '.join(held)})" if is_every else ""),
    )


def _put_choice(module: Module, head: str, results: Mapping[int, str], otherwise: str) -> None:
    """Write a function that selects its result by the row number k."""
    cases = (f"if k == {float(k)}: return {result}" for k, result in results.items())
    module.define(head, *cases, f"return {otherwise}")


def side_of(mode: float, place: float) -> float:
    """Return 1 for a guard above 0, -1 for one below, from its bit `place` in the mode, a power of 2."""
    return 1.0 if math.floor((mode - 1.0) / place) % 2 == 1 else -1.0


def is_watched(side: float, direction: float) -> bool:
    """Tell whether a crossing from a side is an event."""
    return side * direction <= 0.0


def nearer(least: float, side: float, value: float, direction: float) -> float:
    """Return the smaller of `least` and a watched guard, with the sign that is positive before its event."""
    ahead = side * value
    return ahead if is_watched(side, direction) and ahead < least else least


def free_side(value: float, rate: float, side: float, direction: float) -> float:
    """Return 1 for a guard above 0, otherwise 0.

    At 0 its rate decides; if that vanishes too, the guard is on its watched side, or keeps `side` if both are watched.
    """
    if value == 0.0:
        if rate == 0.0:
            return 0.5 - 0.5 * direction if direction != 0.0 else 0.5 + 0.5 * side
        return 1.0 if rate > 0.0 else 0.0
    return 1.0 if value > 0.0 else 0.0


def has_just_left(side: float, value: float, rate: float, t: float) -> bool:
    """Tell whether a guard was 0 at the same time, because its own event was the previous one."""
    return side * rate > 0.0 and side * value >= 0.0 and abs(value) <= AT_ONCE * (abs(rate) * t)


def side_after(
    side: float,
    fired: bool,
    value: float,
    ahead: float,
    rate: float,
    curvature: float,
    direction: float,
) -> float:
    """Return 1 for a guard that is above 0 after an event, otherwise 0.

    Parameters
    ----------
    side
        The side before the event.
    fired
        Whether the event is its own, or simultaneous with its own.
    value, ahead, rate, curvature
        The guard before the event; the guard and its derivatives after it.
    """
    if fired and abs(ahead) <= abs(value):
        if rate == 0.0 and side * curvature >= 0.0:
            # it stays at 0 or goes back: an excess by rounding is no crossing
            return 0.5 - 0.5 * side
        return free_side(0.0, rate, side, direction)
    if ahead == value and is_watched(side, direction):
        # it may have crossed at the same time: its event comes next
        return 0.5 + 0.5 * side
    return free_side(ahead, rate, side, direction)


def on_its_side(side: float, value: float, direction: float) -> float:
    """Return 1 for a guard above 0 at the end of a smooth piece, otherwise 0; a watched guard has not crossed."""
    if side * value < 0.0 and not is_watched(side, direction):
        return 0.5 - 0.5 * side
    return 0.5 + 0.5 * side


def is_in_contact(mode: float, place: float) -> bool:
    """Tell whether a coordinate is in contact with a stop, from its bit `place` in the mode."""
    return math.floor((mode - 1.0) / place) % 2 == 1


def rests(is_there: bool, side: float, rate: float, curvature: float, direction: float) -> float:
    """Return 1 if a coordinate rests on the stop of a guard and is pressed against it, otherwise 0.

    Parameters
    ----------
    is_there
        Whether the guard is 0.
    rate, curvature
        Its first time derivative, and its second without the stop.
    """
    stays = is_there and rate == 0.0 and side * curvature < 0.0 and is_watched(side, direction)
    return 1.0 if stays else 0.0


def is_too_short(side: float, value: float, rate: float, curvature: float) -> bool:
    """Tell whether the flight between two events of a guard is too short to be resolved.

    The guard is beyond 0 by rounding, but already on its way back. ``rate^2/(2 curvature)`` is the height that it would
    reach.
    """
    return side * rate > 0.0 and rate * rate <= LEAST_HEIGHT * abs(curvature * value)


def first_mode(u: float, v: float, t: float, p: P) -> float:
    """Return the initial mode."""
    g, r = guards(u, v, t, p), guard_rates(u, v, t, p)
    mode = sides_of(g, r)
    return mode + contacts_after(mode, -1.0, g, g, r, guard_curvatures(u, v, t, p))


def guard(u: float, v: float, t: float, p: P) -> float:
    """Return a number that falls below 0 when a watched guard crosses 0 or a coordinate leaves its stop."""
    mode = mode_of(p)
    if mode == 0.0:
        return 1.0
    least = nearest_watched(mode, guards(u, v, t, p))
    pressure = least_pressure(mode, u, v, t, p)
    return pressure if pressure < least else least


def guard_on_mesh(u: float, v: float, t: float, p: P) -> float:
    """Return a number below 0 at a grid point where an event happens or the motion ends."""
    mode = mode_of(p)
    if mode == 0.0:
        return 1.0
    fired = first_crossed(mode, guards(u, v, t, p), guard_rates(u, v, t, p))
    return -1.0 if fired >= 0.0 else 1.0


def followed(u: float, v: float, t: float, p: P) -> float:
    """Return the mode at the end of a smooth piece, in which guards that are not watched may have crossed 0."""
    mode = mode_of(p)
    return 0.0 if mode == 0.0 else sides_followed(mode, guards(u, v, t, p)) + contacts_of(mode)


def held(v: float) -> float:
    """Return the velocity of a motion that has ended: unchanged."""
    return v


def landed(u: float, v: float) -> tuple[float, float]:
    """Return position and velocity at a located event."""
    return u, v


def settled(
    u: float, v: float, t: float, before: float, is_last: bool, p: P
) -> tuple[float, float, float]:
    """Return position, velocity and mode after an event."""
    mode = mode_of(p)
    g, b, q = guards(u, v, t, p), guard_rates(u, v, t, p), guard_curvatures(u, v, t, p)
    fired = first_crossed(mode, g, b)
    if fired < 0.0:
        return u, v, sides_followed(mode, g) + contacts_after(mode, fired, g, g, b, q)
    if is_end(fired):
        return u, v, 0.0
    if is_last or is_unresolved(fired, mode, g, b, q):
        contact = contact_with(fired)
        if contact == 0.0:
            return u * math.nan, v * math.nan, mode
        return placed(fired, u, v, t, p), stopped(v, mode + contact), mode + contact
    ahead, own = crossed(fired, u, v, t, p)
    h, r = guards(ahead, own, t, p), guard_rates(ahead, own, t, p)
    if is_ended_by(g, h):
        return ahead, own, 0.0
    curvatures = guard_curvatures(ahead, own, t, p)
    contacts = contacts_after(mode, fired, g, h, r, curvatures)
    if contacts > contacts_of(mode):
        ahead = placed(fired, ahead, own, t, p)
    return ahead, own, sides_after(mode, fired, g, b, h, r, curvatures, t) + contacts


def counts_as_event(before: float, after: float, came: Any, goes: Any) -> bool:
    """Tell whether a change counts as an event; a coordinate that merely leaves its stop does not."""
    changed = size_of(goes[0] - came[0], goes[1] - came[1])
    return after == 0.0 or changed > 0.0 or not contacts_of(after) < contacts_of(before)


def spent(u: float, ahead: float) -> float:
    """Return the cost of a smooth piece: 0."""
    return 0.0


def lost(came: Any, goes: Any, t: float, p: P) -> float:
    """Return the energy lost at an event; negative if the event adds energy."""
    kinetic, potential = energies(came[0], came[1], t, p)
    kinetic_after, potential_after = energies(goes[0], goes[1], t, p)
    return (kinetic + potential) - (kinetic_after + potential_after)


def turning(before: float, after: float, v: float, own: float) -> float:
    """Return 1 if the velocity becomes negative at an event, which is a peak, -1 for a trough, 0 for neither."""
    if after == 0.0 or not v * own < 0.0:
        return 0.0
    return 1.0 if v > 0.0 else -1.0
