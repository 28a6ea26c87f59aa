"""Where the force of a model has its roughest corner within a step, and which power of dt that leaves of errors.

A step across a jump of the k-th derivative of the force has an error of dt^(k+1) that depends on where in the step the
jump lies: another place at each level. So no order above k + 1 is regular, wherever the motion meets such a place: 1
for a jump of the force, 2 for ``abs(u)``, 3 for quadratic damping ``abs(v) v`` where the velocity vanishes. At a grid
point only a jump of the force matters: of its two values a step that begins there and one that ends there take the
same. Switches
(`vibsim.formula.jumps`) are followed along the samples of the finest level; k is read off the difference of the
two formulas on either side. The corners of tables are known beforehand (`vibsim.apriori.table_corners`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibsim.apriori.table_corners import has_tables, is_on_a_point, table_corners
from vibsim.core.array_types import Flags, Floats, Integers
from vibsim.core.record import Record, Variable
from vibsim.core.vocabulary import MEMBER
from vibsim.elementary import on_arrays
from vibsim.formula import Name, Switch, to_formula
from vibsim.models import Model
from vibsim.models.events import Friction
from vibsim.simulation.members import Members
from vibsim.simulation.reference.one_sided_forces import TABLE, Sides, sides

FAR, NEAR = 1.0 / 16.0, 1.0 / 128.0
"""Distances from the corner at which both formulas are compared, over the largest value of the quantity.
[convention]"""
HALVINGS = 40
"""Halvings of a step that find the place of a corner. [convention]"""
ROUGH = 2.0
"""Power that a corner of the force itself leaves: one of its slope leaves less than most schemes do. [convention]"""
OF_A_STEP = 0.5
"""Part of ``s dt^2`` that an extrapolation over levels may be off by where the slope turns by s. [convention]"""
MOST_SMOOTH = 8
"""A jump of a higher derivative than this one is none. [convention]"""


@dataclass(frozen=True)
class Corners:
    """The roughest corner that steps feel of every scheme and member, at its first passage; shape (scheme, case).

    Those of tables are apart from those of formulas: they are at the same times for every scheme, shape (case,).
    """

    power: Floats
    """The highest power of dt that stays regular, k + 1; NaN where there is no corner."""
    time: Floats
    switch: Integers
    """Index into `switches_of`, -1 for none."""
    least: Floats
    """The lowest power that any corner within a step leaves, at its first passage."""
    least_time: Floats
    near_a_point: Flags
    """Whether the roughest corner lies within a step of the finest level beside a point that all levels share."""
    table_time: Floats
    """The first corner of a table within a step of the coarsest level; NaN where there is none."""
    table_turns: Floats
    """All changes of the slope of tables together over the largest change."""
    table_rate: Floats
    """The same over the largest force, 1/s."""

    @property
    def of_tables(self) -> Flags:
        """Which members have corners of tables within steps, shape (case,)."""
        return np.isfinite(self.table_time)

    def unseen(self, end: Floats, steps: Sequence[int], omega_dt: Floats) -> Floats:
        """Return which part of its size a quantity may be off by at a jump or corner of the force, (scheme, case).

        Beside a point that all levels share they make the same error there, which no level shows. Within a step of the
        finest level it is ``(w dt)^(k+1)`` at most, or that part of the time since, where that is shorter. Of a table,
        an impulse J makes the velocity wrong by J and the position by J/w. A force of size p which turns by s moves
        them by p/w^2, and s/w^2, at least.

        Parameters
        ----------
        end, omega_dt
            The end of every member, and w dt of the finest level, shape (case,).
        steps
            Of every level, the finest last.
        """
        dt = end / steps[-1]
        with np.errstate(invalid="ignore", divide="ignore"):
            part = np.minimum(np.fmax(omega_dt, dt / (end - self.least_time)), 1.0)
            part = np.where(self.least <= ROUGH, on_arrays.power(part, self.least), 0.0)
            angle = np.fmax(omega_dt, dt / (end - self.table_time))
            turned = OF_A_STEP * angle * np.fmax(angle * self.table_turns, dt * self.table_rate)
        return part + np.where(self.of_tables, turned, 0.0)


@cache
def switches_of(model: Model) -> tuple[Switch, ...]:
    """Return the switches of a model's force but for that of its table."""
    return tuple(row for row in sides(model, {}).switches if row.mode != TABLE)


def may_have_corners(model: Model) -> bool:
    """Tell whether steps may have corners of the force inside: of its formulas, or of its tables."""
    return bool(switches_of(model)) or has_tables(model)


def _is_left_to_steps(model: Model, switch: Switch) -> bool:
    """Tell whether steps go across a switch: not where friction turns, as that is an event (`Model.events`)."""
    turns = isinstance(model.events, Friction) and switch.quantity == Name(model.velocity)
    return switch.mode != TABLE and not turns


def words_of(model: Model, index: int) -> str:
    """Say what happens at a corner: which quantity passes which value."""
    switch = switches_of(model)[index]
    if any(name.startswith("_") for name in switch.quantity.names):
        return "a condition in the formula of the force changes"
    if switch.quantity == Name(model.velocity):
        return f"the velocity {model.velocity} passes zero"
    passed = "a whole number" if switch.whole else "zero"
    return f"{to_formula(switch.quantity)} passes {passed}"


def corners_of(model: Model, finest: Record, group: Members, dt: Floats) -> Corners:
    """Find the roughest corner that lies within a step, or jump of the force in time that lies at a grid point.

    In the Record of the finest level with its members; dt is the step of the coarsest one, of which every other one is
    a part, shape (case,).
    """
    states = np.stack([np.asarray(finest[state.name], dtype=float) for state in model.states])
    _, schemes, cases, samples = states.shape
    numbers = {row.name: group.parameters[row.key] for row in model.parameters}
    tables = table_corners(model, numbers, group.end, dt)
    none = np.full((schemes, cases), np.nan)
    if not switches_of(model) or samples < 2:
        nowhere = np.zeros(none.shape, dtype=bool)
        return Corners(none, none, np.full(none.shape, -1), none, none, nowhere, *tables)
    number = np.arange(samples) * int(np.asarray(finest.attrs["every"]).item())
    t = number * (group.end / int(np.asarray(finest.attrs["steps"]).item()))[:, None]
    held = sides(model, {name: np.repeat(x, samples) for name, x in numbers.items()})
    with np.errstate(all="ignore"):
        changed = _has_event(finest, t, schemes)
        rows = [_of_scheme(held, states[:, k], t, numbers, dt, changed[k]) for k in range(schemes)]
    power, time, switch, least, least_time = (
        np.stack(column) for column in zip(*rows, strict=True)
    )
    away = np.abs(time - np.round(time / dt) * dt)
    near = away < group.end / int(np.asarray(finest.attrs["steps"]).item())
    return Corners(power, time, switch, least, least_time, near, *tables)


def _has_event(finest: Record, t: Floats, schemes: int) -> Flags:
    """Say between which samples an event changed the state, which passed nothing then: (scheme, case, sample)."""
    cases, samples = t.shape
    found = np.zeros((schemes, cases, samples - 1), dtype=bool)
    if "event_time" not in finest:
        return found
    times = np.asarray(finest["event_time"], dtype=float)
    happens = np.isfinite(times)
    for k, case in np.argwhere(happens.any(axis=-1)):
        place = np.searchsorted(t[case], times[k, case, happens[k, case]]) - 1
        found[k, case, np.clip(place, 0, samples - 2)] = True
    return found


def _of_scheme(
    held: Sides,
    states: Floats,
    t: Floats,
    numbers: Mapping[str, Floats],
    dt: Floats,
    has_event: Flags,
) -> tuple[Floats, Floats, Integers, Floats, Floats]:
    """Return what `Corners` holds of every member, each of shape (case,)."""
    cases, samples = t.shape
    u, v = np.split(states.reshape(len(states), -1), 2)
    q, modes = held.modes(u, v, t.ravel())
    q, modes = (row.reshape(len(q), cases, samples) for row in (q, modes))
    edge = np.maximum(modes[..., :-1], modes[..., 1:])
    edge = np.where(held.whole[:, None, None], edge, 0.0)
    part = (edge - q[..., :-1]) / (q[..., 1:] - q[..., :-1])
    at = t[:, :-1] + part * np.diff(t)
    of_time = np.array(_of_time(held))[:, None, None]
    passed = (np.diff(modes) != 0.0) & (of_time | ~has_event)
    passed &= np.array([_is_left_to_steps(held.model, row) for row in held.switches])[:, None, None]
    is_within = ~is_on_a_point(at, dt[:, None])

    def first(when: Floats) -> tuple[Floats, Floats, Integers]:
        """Return the first corner of those whose times are given, infinite elsewhere, shape (switch, case, sample)."""
        own = np.arange(cases)
        sample = np.argmin(np.min(when, axis=0), axis=-1)
        switch = np.argmin(when[:, own, sample], axis=0)
        before, behind = modes[:, own, sample], modes[:, own, sample].copy()
        # what else changes between these two samples is another corner
        behind[switch, own] = modes[switch, own, sample + 1]
        path = _Path(
            Sides(held.model, held.formulas, held.switches, numbers),
            switch,
            np.stack([states[:, own, sample], states[:, own, sample + 1]]),
            np.stack([t[own, sample], t[own, sample + 1]]),
            (before, behind),
        )
        size = np.nanmax(np.abs(q), axis=-1)[switch, own]
        exists = np.isfinite(when[switch, own, sample])
        power = np.where(exists, path.power(edge[switch, own, sample], size), np.nan)
        exists &= np.isfinite(power)
        return (
            power,
            np.where(exists, when[switch, own, sample], np.nan),
            np.where(exists, switch - len(held.switches) + len(switches_of(held.model)), -1),
        )

    jump = first(np.where(passed & of_time & ~is_within, at, np.inf))
    # of every switch, its first passage within a step
    single = np.eye(len(q), dtype=bool)[:, :, None, None]
    each = [first(np.where(passed & is_within & one, at, np.inf)) for one in single]
    powers, times, switches = (np.stack(column) for column in zip(*each, strict=True))
    own = np.arange(cases)
    # the roughest one, of several the first
    which = np.lexsort((times, powers), axis=0)[0]
    least, least_time, switch = powers[which, own], times[which, own], switches[which, own]
    is_jump = (jump[0] == 1.0) & ~((least <= 1.0) & (least_time <= jump[1]))
    power, time, switch = (
        np.where(is_jump, *pair) for pair in zip(jump, (least, least_time, switch), strict=True)
    )
    return power, time, np.asarray(switch, dtype=np.int64), least, least_time


def _of_time(held: Sides) -> list[bool]:
    """Tell of every switch whether time alone moves it."""
    moved = {state.name for state in held.model.states}
    found = []
    for row in held.switches:
        found.append(moved.isdisjoint(row.quantity.names))
        if not found[-1]:
            moved.add(row.mode)
    return found


@dataclass(frozen=True)
class _Path:
    """The samples around a corner of n members; the straight line through them is the path."""

    held: Sides
    switch: Integers
    """Shape (n,)."""
    states: Floats
    """Shape (2 samples, state, n)."""
    times: Floats
    """Shape (2, n)."""
    modes: tuple[Floats, Floats]
    """Before and behind, each of shape (switch, n)."""

    def at(self, s: Floats) -> tuple[Floats, Floats, Floats]:
        """Return positions, velocities and times after a part s of the way."""
        u, v = np.split(self.states[0] + s * (self.states[1] - self.states[0]), 2)
        return u, v, self.times[0] + s * (self.times[1] - self.times[0])

    def quantity(self, s: Floats) -> Floats:
        """Return what the switch looks at there."""
        return self.held.quantities(self.modes[0], *self.at(s))[self.switch, np.arange(len(s))]

    def crossing(self, edge: Floats) -> Floats:
        """Return after which part of the way a switch has the value `edge`, by bisection."""
        low, high = np.zeros(len(edge)), np.ones(len(edge))
        start = self.quantity(low) > edge
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            is_before = (self.quantity(middle) > edge) == start
            low, high = np.where(is_before, middle, low), np.where(is_before, high, middle)
        return 0.5 * (low + high)

    def power(self, edge: Floats, size: Floats) -> Floats:
        """Return the power of dt that a corner leaves, shape (n,); NaN where both formulas are the same."""
        s = self.crossing(edge)
        slope = self.quantity(np.ones(len(s))) - self.quantity(np.zeros(len(s)))
        gaps = []
        for distance in (FAR, NEAR):
            place = self.at(s + distance * size / slope)
            before, behind = (self.held.force(modes)(*place) for modes in self.modes)
            gaps.append(np.max(np.abs(behind - before), axis=0))
        k = np.round(on_arrays.log(gaps[0] / gaps[1]) / on_arrays.log(FAR / NEAR))
        exists = (gaps[0] > 0.0) & (k < MOST_SMOOTH)
        return np.where(exists, np.maximum(k, 0.0) + 1.0, np.nan)


def corner_variables(model: Model, corners: Corners) -> dict[str, Variable]:
    """Return the corners as variables of the convergence Record; none where the force cannot have any."""
    found: dict[str, Variable] = {}
    if switches_of(model):
        rows: dict[str, tuple[NDArray[Any], str, str]] = {
            "time": (corners.time, "first time at which the force has a corner within a step", "s"),
            "power": (corners.power, "power of dt that this corner leaves of errors", "1"),
            "switch": (corners.switch.astype(np.int16), "number of its condition, or -1", "1"),
        }
        found |= {
            f"corner_{name}": Variable.of(MEMBER, values, words, unit)
            for name, (values, words, unit) in rows.items()
        }
    if has_tables(model):
        words = "first time at which a table of the force has a corner within a step"
        found["table_corner_time"] = Variable.of(("case",), corners.table_time, words, "s")
    return found
