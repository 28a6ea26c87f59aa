"""What must hold for every member: its tables are long enough, what its equation differentiates does not jump, and it
begins outside of its stop, with masses that are positive there.

A derivative of what jumps would leave out an impulse without a word. A voltage that is switched on is the most common
case: V' vanishes before and behind it, and the current would stay 0.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from vibsim.core.array_types import Flags, Floats
from vibsim.experiment.data import AnyExperiment, TimeSpec
from vibsim.experiment.faults import Report
from vibsim.experiment.schema.fields import TABLE, FrozenDict
from vibsim.experiment.schema.sweep import Axis
from vibsim.experiment.sweep_columns import columns_of
from vibsim.experiment.yaml.parse import Path_
from vibsim.formula import (
    Expression,
    derivative,
    first_jump,
    parse,
    parts_of,
    put,
    values,
    values_of,
)
from vibsim.models import FormulaField, Model, tree
from vibsim.models.base import rate
from vibsim.models.events import Crossings
from vibsim.models.shared.crossings import STOP
from vibsim.models.shared.inertia import MASS, inertia
from vibsim.models.table import Lookup

CHUNK = 2**16
"""Members that are looked at together."""
SLACK = 1e-6
"""What is no difference between two places, in spacings of the table or in steps: rounding."""
MOST_NAMED = 3
"""Most swept numbers of a member that a message names."""
SAMPLED_MEMBERS = 64
"""Members of a sweep that are looked at for jumps, evenly spread: a jump is hardly ever there for single ones."""
WORK = 2**10
"""Operations of all these members together: of a long formula, fewer members are looked at."""
WORDS = {1: "derivative", 2: "second derivative"}
HINTS = {
    "voltage": "write a steep ramp, V0*(1 + tanh((t - t1)/0.001))/2 say, or begin behind the jump, "
    "with di_dt larger by it over L",
    "road": "round it off, or give it as a table, whose spacing does that",
}
OTHERS = "write a solution whose value and slope have no jumps"


@dataclass(frozen=True)
class MemberNumbers:
    """The numbers of all members."""

    model: Model
    parameters: Mapping[str, float]
    initial: Mapping[str, float]
    time: TimeSpec
    axes: Sequence[Axis]

    def members(self) -> Iterator[tuple[dict[str, Any], Floats]]:
        """Yield parts of the members that differ in what matters: their swept numbers, and their ends."""
        for start, stop in _chunks(self.count):
            yield self._part(start, stop)

    def some(self, most: int) -> Iterator[tuple[dict[str, float], float]]:
        """Yield the parameters by name and the ends of at most so many of these members, evenly spread over them."""
        count = self.count
        for i in sorted({k * (count - 1) // max(most - 1, 1) for k in range(most)}):
            found, end = self._part(i, i + 1)
            numbers = self._by_name(found)
            yield {name: float(np.ravel(x)[0]) for name, x in numbers.items()}, float(end[0])

    def starts(self) -> Iterator[tuple[int, dict[str, Any], dict[str, Any]]]:
        """Yield the number of some members, what formulas name of them at t = 0, and their swept values, for all."""
        for start, stop in _chunks(math.prod(axis.count for axis in self.axes)):
            swept = columns_of(self.axes, start, stop)
            begins = self.model.start(self._parameters(swept)) if self.model.start else self.initial
            numbers: dict[str, Any] = {"t": 0.0, **self._by_name(swept)}
            for state in self.model.states:
                value = begins.get(state.name, 0.0)
                numbers[state.name] = swept.get(f"initial.{state.name}", value)
            yield stop - start, numbers, swept

    def _axes(self) -> list[Axis]:
        return [axis for axis in self.axes if any(map(_matters, axis.keys))]

    @property
    def count(self) -> int:
        """Number of members that differ in what matters."""
        return math.prod(axis.count for axis in self._axes())

    def _part(self, start: int, stop: int) -> tuple[dict[str, Any], Floats]:
        found = {k: v for k, v in columns_of(self._axes(), start, stop).items() if _matters(k)}
        end = found.get("time.end", np.full(stop - start, self.time.end))
        if self.time.is_of_model:
            with np.errstate(divide="ignore"):
                own = self.time.end_of(self.model, self._parameters(found))
            end = np.broadcast_to(own, end.shape)
        return found, end

    @property
    def lookup(self) -> Lookup:
        """The table of the model."""
        assert self.model.lookup is not None
        return self.model.lookup

    def place(self, found: Mapping[str, Any], t: Floats) -> Floats:
        """Return the places at times t, of members with some numbers swept."""
        formula = tree(self.model, self.lookup.place)
        return np.broadcast_to(values(formula, {**self._by_name(found), "t": t}), t.shape)

    def _parameters(self, found: Mapping[str, Any]) -> dict[str, Any]:
        return {key: found.get(f"model.{key}", x) for key, x in self.parameters.items()}

    def _by_name(self, found: Mapping[str, Any]) -> dict[str, Any]:
        given = self._parameters(found)
        return {row.name: given[row.key] for row in self.model.parameters}


def _chunks(count: int) -> Iterator[tuple[int, int]]:
    yield from ((start, min(start + CHUNK, count)) for start in range(0, count, CHUNK))


def _matters(key: str) -> bool:
    return key.startswith("model.") or key == "time.end"


def check_ends(numbers: MemberNumbers, report: Report) -> None:
    """Refuse an end that follows from the model where it has none for some member."""
    if not numbers.time.is_of_model:
        return
    for found, end in numbers.members():
        has_none = ~(np.isfinite(end) & (end > 0.0))
        if has_none.any():
            who = named(found, int(np.argmax(has_none)))
            if numbers.time.frequency is not None:
                key, rule = "frequency", "must be an angular frequency greater than 0"
            elif numbers.time.periods is not None:
                key, rule = "periods", "the model has no natural period"
            else:
                key, rule = "steps_per_point", "the vehicle never comes to the end of the table"
            report.add(("time", key), f"{rule} where {who}", "leave that member out, or give end")
            return


def named(swept: Mapping[str, Any], i: int) -> str:
    """Name a member by its swept numbers."""
    numbers = (f"{key} = {x[i]:.10g}" for key, x in swept.items() if x.dtype.kind != "U")
    return ", ".join(list(numbers)[:MOST_NAMED])


def check_length(numbers: MemberNumbers, name: str, report: Report) -> None:
    """Refuse a table that ends before a member does."""
    table = numbers.lookup.table
    most, who = -np.inf, ""
    for found, end in numbers.members():
        places = numbers.place(found, end)
        i = int(np.argmax(places))
        if places[i] > most:
            most = float(places[i])
            who = named(found, i)
    if most > table.last + SLACK * table.spacing:
        count = int(np.ceil((most - table.first) / table.spacing - SLACK)) + 1
        unit = "" if numbers.model.dimensionless else " m"
        rule = (
            f"the table ends at {table.last:.10g}{unit}, but the motion comes to {most:.10g}{unit}"
        )
        hint = f"it must have at least {count} points, not {table.points}"
        report.add(("model", name, TABLE), f"{rule}{f' ({who})' if who else ''}", hint)


def _is_met(numbers: MemberNumbers, level: int) -> bool:
    """Tell whether a step of every member ends at every point of the table, at every level from the coarsest one on.

    It does where the way of a step at the coarsest level is a whole part of the spacing, and the table has a point at
    the start.
    """
    table, steps = numbers.lookup.table, numbers.time.base_steps << level
    for found, end in numbers.members():
        way = numbers.place(found, end / steps)
        with np.errstate(divide="ignore", invalid="ignore"):
            per_spacing, start = table.spacing / way, table.first / way
            rest = table.points * np.abs(per_spacing - np.round(per_spacing))
            misses = ~(rest <= SLACK) | ~(np.abs(start - np.round(start)) <= SLACK)
        # who does not move meets no corner
        if np.any((misses | (per_spacing < 0.5)) & (way != 0.0)):
            return False
    return True


def update_tables(experiment: AnyExperiment) -> AnyExperiment:
    """Return `experiment` with what its tables say of its steps, whose members or levels were others before."""
    model = experiment.model
    if not model.tables:
        return experiment
    axes = experiment.sweep.axes if experiment.sweep else ()
    own, initial = model.parameters, experiment.initial
    numbers = MemberNumbers(model.definition, own, initial, experiment.time, axes)
    met = {"is_met": _is_met(numbers, experiment.levels[0] if experiment.levels else 0)}
    tables = {name: spec.model_copy(update=met) for name, spec in model.tables.items()}
    model = model.model_copy(update={"tables": FrozenDict(tables)})
    return experiment.model_copy(update={"model": model})


def check_jumps(members: MemberNumbers, formulas: Mapping[str, str], report: Report) -> None:
    """Refuse formulas that jump, or whose slope does, where the equation has their derivatives."""
    for row in members.model.formulas:
        for key, text in formulas.items() if row.derivatives else ():
            if key.partition(".")[0] == row.name:
                _check_jumps(row, key, text, members, report)


def _check_jumps(
    row: FormulaField, key: str, text: str, members: MemberNumbers, report: Report
) -> None:
    (name,) = row.names
    known = [own.name for own in members.model.parameters]
    formula, along = parse(text, (name, *known)), parse(row.along, ("t", *known))
    for order in range(row.derivatives):
        at = _jump(put(formula, name, along), members, along)
        if at is not None:
            what = "jumps" if order == 0 else "its slope jumps"
            rule = (
                f"{what} near {name} = {at:.6g}, and the equation has its {WORDS[row.derivatives]}"
            )
            report.add(("model", *key.split(".")), rule, HINTS.get(row.name, OTHERS), text)
            return
        formula = derivative(formula, name)


def _jump(formula: Expression, members: MemberNumbers, along: Expression) -> float | None:
    """Return the place of a jump of some member; None where none is found."""
    most = max(1, min(SAMPLED_MEMBERS, WORK // len(parts_of(formula))))
    for numbers, end in members.some(most):
        at = first_jump(formula, numbers, end)
        if at is not None:
            # halving ends beside 0, not at it
            at = at if at > 1e-9 * end else 0.0
            return float(values(along, {**numbers, "t": at}))
    return None


def check_starts(members: MemberNumbers, formulas: Mapping[str, str], report: Report) -> None:
    """Refuse a stop that holds at t = 0 already, and a matrix of masses that is not positive definite there."""
    model = members.model

    def refuse(
        is_wrong: Callable[[Mapping[str, Any]], Flags], path: Path_, rule: str, hint: str
    ) -> None:
        """Refuse the first member of which something is wrong; `rule` has a place for its name."""
        for count, numbers, swept in members.starts():
            wrong = np.broadcast_to(is_wrong(numbers), (count,))
            if wrong.any():
                who = named(swept, int(np.argmax(wrong)))
                report.add(path, rule.format(f" (where {who})" if who else ""), hint)
                return

    rows = model.events.rows if isinstance(model.events, Crossings) else ()
    for guard in (tree(model, row.guard) for row in rows if row.ends):
        slope = rate(model, guard)

        def holds(numbers: Mapping[str, Any], guard: Any = guard, slope: Any = slope) -> Flags:
            # at the border the motion may go in
            now, ahead = values(guard, numbers), values(slope, numbers)
            return np.asarray((now < 0.0) | ((now == 0.0) & (ahead < 0.0)))

        rule = "holds at the start already{}: nothing would move"
        refuse(holds, ("model", STOP), rule, "begin outside of it")
    if any(key.split(".")[0] == MASS for key in formulas) and model.formulas:
        known = tuple(row.name for row in model.parameters)
        masses = inertia(formulas, model.positions, model.velocities, known)

        def is_light(numbers: Mapping[str, Any]) -> Flags:
            pivots = np.broadcast_arrays(*values_of(masses.pivots, numbers))
            return np.asarray(~np.all(np.stack(pivots) > 0.0, axis=0))

        rule = "must be positive definite, and is not at the start{}"
        hint = "every motion must have a positive kinetic energy"
        refuse(is_light, ("model", MASS), rule, hint)
