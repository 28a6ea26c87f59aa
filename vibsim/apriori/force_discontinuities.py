"""Find the roughest corner of the force inside a step, and the highest power of dt that errors keep there.

Where the force changes by d^k at a distance d behind a point, a step across that point has an error of order dt^(k+1)
that depends on the position of the point within the step, which differs between levels. So no order above k + 1 is
regular once the motion meets it: k + 1 is 1 for a jump of the force, 2 for ``abs(u)``, 2.5 for ``max(u, 0)**1.5``, and
3 for quadratic damping ``abs(v) v`` where the velocity vanishes. At a grid point most corners do not matter, since each
step is on one side of it, where the force is smooth. But a jump of the force itself does, because the steps before and
after the point evaluate the same one of its two values, and so does a broken power such as ``max(u, 0)**1.5``, which is
not smooth up to the corner. Switches
(`vibsim.formula.jumps`) are followed along the samples of the finest level, and k follows from the difference of the
two formulas on either side. The corners of tables are known in advance (`vibsim.apriori.table_corners`).
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Collection, Mapping, Sequence
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
from vibsim.models.base import Model, by_name
from vibsim.simulation.members import Members
from vibsim.simulation.reference.one_sided_forces import TABLE, Sides, sides

DISTANCES = (1.0 / 16.0, 1.0 / 128.0, 1.0 / 1024.0)
"""Distances from the corner at which both formulas are compared, over the largest switch quantity. [convention]"""
DIGITS_LEFT = 3.5
"""Power below which the difference at the least distance has enough digits to measure a power. [derived]"""
WHOLE = 0.1
"""Distance from a whole power within which a measured one counts as whole. [convention]"""
HALVINGS = 40
"""Number of bisections that locate a corner within a step. [convention]"""
ROUGH = 2.0
"""Largest power k + 1 that counts as rough: that of a jump (1) or a kink (2) of the force itself. [convention]"""
TURN_ERROR = 0.5
"""Error of an extrapolation where the slope of a table changes by s, as a multiple of ``s dt^2``. [convention]"""
MOST_SMOOTH = 8
"""Jumps of this derivative and of higher ones are ignored. [convention]"""
AROUND = (0.5, 1.5, 2.5)
EVEN, ODD = (2.0, -3.0, 1.0), (10.0, -5.0, 1.0)
"""Places around a corner, and weights of sums and differences of the force there, which are of order 4 and 5 where it
is smooth. [derived]"""
LEFT_BY_SMOOTH = 4.0
"""Powers from this one on are not told from what a smooth force leaves of these. [derived]"""
ROUNDED = 1e-13
"""Part of the force below which these are rounding. [derived]"""


Matters = Callable[[Floats], Flags]
"""Tells of powers k + 1 whether a corner of this power lowers the order."""


@dataclass(frozen=True)
class Corners:
    """The roughest corner of the force of every scheme and member, where the motion first meets it; (scheme, case).

    Corners of tables are separate from those of formulas: their times are the same for every scheme, shape (case,).
    """

    power: Floats
    """The highest regular power of dt, k + 1; NaN without a corner."""
    time: Floats
    """Time of the corner [s]."""
    switch: Integers
    """Index into `switches_of`, -1 for none."""
    least: Floats
    """The lowest power among the corners inside steps, without jumps at grid points."""
    least_time: Floats
    """Time of that corner [s]."""
    near_a_point: Flags
    """Whether the roughest corner is less than one step of the finest level from a point that all levels share."""
    table_time: Floats
    """Time of the first corner of a table inside a step of the coarsest level [s]; NaN without one."""
    table_turns: Floats
    """Sum of all changes of slope in tables over the largest change."""
    table_rate: Floats
    """Sum of all changes of slope in tables over the largest force [1/s]."""

    @property
    def of_tables(self) -> Flags:
        """Which members have corners of tables inside steps, shape (case,)."""
        return np.isfinite(self.table_time)

    def unseen(self, end: Floats, steps: Sequence[int], omega_dt: Floats) -> Floats:
        """Return the relative error at jumps and corners of the force that no level may show, shape (scheme, case).

        Close to a point that all levels share, all levels have the same error, which their differences do not show.
        Within a step of the finest level it is at most ``(w dt)^(k+1)``, with dt over the time since the corner for
        w dt if larger. For a table, an error J of the impulse gives an error J/w of the position, whose size is p/w^2
        or s/w^3, whichever is smaller, for a force of size p whose slope changes by s.

        Parameters
        ----------
        end, omega_dt
            End time of every member, and w dt of the finest level, shape (case,).
        steps
            Number of steps of every level, the finest last.
        """
        dt = end / steps[-1]
        with np.errstate(invalid="ignore", divide="ignore"):
            formulas = np.minimum(np.fmax(omega_dt, dt / (end - self.least_time)), 1.0)
            formulas = np.where(self.least <= ROUGH, on_arrays.power(formulas, self.least), 0.0)
            angle = np.fmax(omega_dt, dt / (end - self.table_time))
            tables = TURN_ERROR * angle * np.fmax(angle * self.table_turns, dt * self.table_rate)
        return formulas + np.where(self.of_tables, tables, 0.0)


@cache
def switches_of(model: Model) -> tuple[Switch, ...]:
    """Return the switches of a model's force, except the one of its table."""
    return tuple(row for row in sides(model, {}).switches if row.mode != TABLE)


def may_have_corners(model: Model) -> bool:
    """Tell whether corners of the force may lie inside steps: those of its formulas, or of its tables."""
    return bool(switches_of(model)) or has_tables(model)


def _is_inside_steps(model: Model, switch: Switch) -> bool:
    """Tell whether steps cross a switch: not the reversal of friction, which is an event (`Model.events`)."""
    reverses = model.events is not None and model.events.reverses
    is_event = reverses and switch.quantity == Name(model.velocity)
    return switch.mode != TABLE and not is_event


def words_of(model: Model, index: int) -> str:
    """Return in words what happens at a corner: which quantity passes which value."""
    switch = switches_of(model)[index]
    if any(name.startswith("_") for name in switch.quantity.names):
        return "a condition in the formula of the force changes"
    if switch.quantity == Name(model.velocity):
        return f"the velocity {model.velocity} passes zero"
    value = "a whole number" if switch.whole else "zero"
    return f"{to_formula(switch.quantity)} passes {value}"


def corners_of(model: Model, finest: Record, group: Members, dt: Floats) -> Corners:
    """Find the roughest corner inside a step, or jump of the force in time at a grid point.

    `finest` is the Record of the finest level with the members `group`; `dt` is the step of the coarsest level, shape
    (case,), which is a multiple of every other step.
    """
    states = np.stack([np.asarray(finest[state.name], dtype=float) for state in model.states])
    _, schemes, cases, samples = states.shape
    numbers = by_name(model.parameters, group.parameters)
    tables = table_corners(model, numbers, group.end, dt)
    none = np.full((schemes, cases), np.nan)
    if not switches_of(model) or samples < 2:
        nowhere = np.zeros(none.shape, dtype=bool)
        return Corners(none, none, np.full(none.shape, -1), none, none, nowhere, *tables)
    dt_finest = group.end / finest.whole("steps")
    t = np.arange(samples) * finest.whole("every") * dt_finest[:, None]
    law = sides(model, {name: np.repeat(x, samples) for name, x in numbers.items()})
    with np.errstate(all="ignore"):
        changed = _has_event(finest, t, schemes)
        rows = [_of_scheme(law, states[:, k], t, numbers, dt, changed[k]) for k in range(schemes)]
    power, time, switch, least, least_time = (
        np.stack(column) for column in zip(*rows, strict=True)
    )
    distance = np.abs(time - np.round(time / dt) * dt)
    near = distance < dt_finest
    return Corners(power, time, switch, least, least_time, near, *tables)


def _has_event(finest: Record, t: Floats, schemes: int) -> Flags:
    """Tell between which samples an event changed the state, so that no switch passed: shape (scheme, case, sample)."""
    cases, samples = t.shape
    has_event = np.zeros((schemes, cases, samples - 1), dtype=bool)
    if "event_time" not in finest:
        return has_event
    times = np.asarray(finest["event_time"], dtype=float)
    happens = np.isfinite(times)
    for k, case in np.argwhere(happens.any(axis=-1)):
        place = np.searchsorted(t[case], times[k, case, happens[k, case]]) - 1
        has_event[k, case, np.clip(place, 0, samples - 2)] = True
    return has_event


def _of_scheme(
    law: Sides,
    states: Floats,
    t: Floats,
    numbers: Mapping[str, Floats],
    dt: Floats,
    has_event: Flags,
) -> tuple[Floats, Floats, Integers, Floats, Floats]:
    """Return power, time, switch, least and least_time of `Corners` for one scheme, each of shape (case,)."""
    cases, samples = t.shape
    u, v = np.split(states.reshape(len(states), -1), 2)
    q, modes = law.modes(u, v, t.ravel())
    q, modes = (row.reshape(len(q), cases, samples) for row in (q, modes))
    # a quantity that falls from zero at t = 0 passes it there
    starts = np.zeros(q[..., 1:].shape, dtype=bool)
    starts[..., 0] = (q[..., 0] == 0.0) & (q[..., 1] < 0.0) & ~law.whole[:, None]
    modes[..., :-1][starts] = 0.0
    edge = np.maximum(modes[..., :-1], modes[..., 1:])
    edge = np.where(law.whole[:, None, None], edge, 0.0)
    fraction = (edge - q[..., :-1]) / (q[..., 1:] - q[..., :-1])
    at = t[:, :-1] + fraction * np.diff(t)
    in_time = _independent_of(law, [state.name for state in law.model.states])
    crossed = np.diff(modes) != 0.0
    crossed &= np.array([_is_inside_steps(law.model, row) for row in law.switches])[:, None, None]
    passed = crossed & (in_time | ~has_event)
    # what an event leaves as it is passes there, perhaps at the event itself
    at_event = crossed & ~passed & _independent_of(law, _changed_at_events(law.model))
    is_within = ~is_on_a_point(at, dt[:, None])
    every = np.arange(cases)

    def first(when: Floats, matters: Matters = np.isfinite) -> tuple[Floats, Floats, Integers]:
        """Return the earliest corner, or nothing if its power does not matter.

        `when` has the times of corners, infinite elsewhere, shape (switch, case, sample).
        """
        sample = np.argmin(np.min(when, axis=0), axis=-1)
        switch = np.argmin(when[:, every, sample], axis=0)
        before, after = modes[:, every, sample], modes[:, every, sample].copy()
        # other switches that change between these two samples are other corners
        after[switch, every] = modes[switch, every, sample + 1]
        path = _Path(
            Sides(law.model, law.formulas, law.switches, numbers),
            switch,
            np.stack([states[:, every, sample], states[:, every, sample + 1]]),
            np.stack([t[every, sample], t[every, sample + 1]]),
            (before, after),
        )
        size = np.nanmax(np.abs(q), axis=-1)[switch, every]
        exists = np.isfinite(when[switch, every, sample])
        power = np.where(exists, path.power(edge[switch, every, sample], size), np.nan)
        exists &= matters(power)
        return (
            np.where(exists, power, np.nan),
            np.where(exists, when[switch, every, sample], np.nan),
            np.where(exists, switch - len(law.switches) + len(switches_of(law.model)), -1),
        )

    def firsts(where: Flags, matters: Matters = np.isfinite) -> list[Any]:
        """Return the earliest corner of each switch."""
        masks = np.eye(len(q), dtype=bool)[:, :, None, None]
        return [first(np.where(where & mask, at, np.inf), matters) for mask in masks]

    def roughest(corners: list[Any]) -> list[Any]:
        """Return the roughest of several corners, and the earliest if several are equally rough."""
        powers, times, switches = (np.stack(column) for column in zip(*corners, strict=True))
        which = np.lexsort((times, powers), axis=0)[0]
        return [column[which, every] for column in (powers, times, switches)]

    inside = firsts(passed & is_within)
    if at_event.any():
        inside += firsts(at_event, lambda power: _jumps(power) | _is_broken(power))
    on_points, is_on_point = [], passed & ~is_within
    if is_on_point.any():
        # the force at t = 0 is that behind its jump there
        jumps = is_on_point & in_time & ~starts
        on_points = [first(np.where(jumps, at, np.inf), _jumps)]
        on_points += firsts(is_on_point, _is_broken)
    power, time, switch = roughest([*inside, *on_points])
    least, least_time, _ = roughest(inside)
    return power, time, np.asarray(switch, dtype=np.int64), least, least_time


def _jumps(power: Floats) -> Flags:
    return np.asarray(power == 1.0)


def _is_broken(power: Floats) -> Flags:
    return np.asarray(np.isfinite(power) & (power % 1.0 != 0.0))


def _changed_at_events(model: Model) -> Collection[str]:
    return () if model.events is None else model.events.changed(model.velocities)


def _independent_of(law: Sides, states: Collection[str]) -> Flags:
    """Tell for every switch whether it depends on none of these states, shape (switch, 1, 1)."""
    names = {*states}
    independent = []
    for row in law.switches:
        independent.append(names.isdisjoint(row.quantity.names))
        if not independent[-1]:
            names.add(row.mode)
    return np.array(independent)[:, None, None]


@dataclass(frozen=True)
class _Path:
    """The straight path between the samples before and after a corner, for n members."""

    law: Sides
    switch: Integers
    """Index of the switch, shape (n,)."""
    states: Floats
    """Shape (2 samples, state, n)."""
    times: Floats
    """Shape (2 samples, n)."""
    modes: tuple[Floats, Floats]
    """Modes of all switches before and after the corner, each of shape (switch, n)."""

    def at(self, s: Floats) -> tuple[Floats, Floats, Floats]:
        """Return positions, velocities and times at the fraction `s` of the path."""
        u, v = np.split(self.states[0] + s * (self.states[1] - self.states[0]), 2)
        return u, v, self.times[0] + s * (self.times[1] - self.times[0])

    def quantity(self, s: Floats) -> Floats:
        """Return the value of the switch quantity at the fraction `s` of the path."""
        return self.law.quantities(self.modes[0], *self.at(s))[self.switch, np.arange(len(s))]

    def crossing(self, edge: Floats) -> Floats:
        """Return the fraction of the path at which the switch quantity is `edge`, by bisection."""
        low = np.zeros(len(edge))
        start = self.quantity(low) > edge
        high = np.where(self.quantity(low) == edge, 0.0, 1.0)
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            is_before = (self.quantity(middle) > edge) == start
            low, high = np.where(is_before, middle, low), np.where(is_before, high, middle)
        return 0.5 * (low + high)

    def power(self, edge: Floats, size: Floats) -> Floats:
        """Return k + 1, shape (n,): both formulas differ as distance^k near the corner; NaN where they agree.

        The power between two distances d has an error in proportion to d.
        """
        s = self.crossing(edge)
        slope = self.quantity(np.ones(len(s))) - self.quantity(np.zeros(len(s)))
        distances = [distance * size / slope for distance in DISTANCES]
        gaps = [self._gap(s, distance) for distance in distances]
        # of a power such as abs(u)**1.5 no formula goes on behind the corner
        most = np.where(np.isnan(gaps[0]), LEFT_BY_SMOOTH, MOST_SMOOTH)
        if np.isnan(gaps[0]).any():
            gaps = [
                np.where(np.isnan(gap), self._broken_part(s, distance), gap)
                for gap, distance in zip(gaps, distances, strict=True)
            ]
        fall = DISTANCES[0] / DISTANCES[1]
        far, near = (
            on_arrays.log(a / b) / on_arrays.log(fall) for a, b in itertools.pairwise(gaps)
        )
        k = np.where(far < DIGITS_LEFT, (fall * near - far) / (fall - 1.0), far)
        whole = np.round(k)
        k = np.where((np.abs(k - whole) <= WHOLE) | (far >= DIGITS_LEFT), whole, np.round(k, 2))
        exists = (gaps[0] > 0.0) & (k < most)
        return np.where(exists, np.maximum(k, 0.0) + 1.0, np.nan)

    def _gap(self, s: Floats, distance: Floats) -> Floats:
        """Return the mean difference of both formulas on the two sides of a fraction `s`, or that where both exist."""
        sides = []
        for place in (self.at(s + distance), self.at(s - distance)):
            before, after = (self.law.force(modes)(*place) for modes in self.modes)
            sides.append(np.max(np.abs(after - before), axis=0))
        there, back = sides
        mean = 0.5 * (there + back)
        return np.asarray(np.where(np.isnan(mean), np.fmax(there, back), mean))

    def _broken_part(self, s: Floats, distance: Floats) -> Floats:
        """Return what the forces around a fraction `s`, each by its own formula, have beside smooth parts."""
        before, after = (self.law.force(modes) for modes in self.modes)
        parts: list[Floats] = [np.zeros(1)] * 3
        for place, even, odd in zip(AROUND, EVEN, ODD, strict=True):
            reach = place * np.abs(distance)
            behind, beyond = before(*self.at(s - reach)), after(*self.at(s + reach))
            sizes = np.abs(behind) + np.abs(beyond)
            rows = even * (beyond + behind), odd * (beyond - behind), abs(odd) * sizes
            parts = [part + row for part, row in zip(parts, rows, strict=True)]
        left = np.maximum(np.abs(parts[0]), np.abs(parts[1]))
        return np.asarray(np.max(np.where(left > ROUNDED * parts[2], left, 0.0), axis=0))


def corner_variables(model: Model, corners: Corners) -> dict[str, Variable]:
    """Return the corners as variables of the convergence Record; none if the force cannot have any."""
    variables: dict[str, Variable] = {}
    if switches_of(model):
        rows: dict[str, tuple[NDArray[Any], str, str]] = {
            "time": (corners.time, "first time at which the force has a corner within a step", "s"),
            "power": (corners.power, "power of dt that this corner leaves of errors", "1"),
            "switch": (corners.switch.astype(np.int16), "number of its condition, or -1", "1"),
        }
        variables |= {
            f"corner_{name}": Variable.of(MEMBER, values, words, unit)
            for name, (values, words, unit) in rows.items()
        }
    if has_tables(model):
        words = "first time at which a table of the force has a corner within a step"
        variables["table_corner_time"] = Variable.of(("case",), corners.table_time, words, "s")
    return variables
