"""Rules for every member of a sweep.

Its tables are long enough, functions that its equation differentiates do not jump, and it starts outside its stop with
a positive definite mass matrix. The derivative of a jump would silently drop an impulse. The most common case is a
voltage that is switched on: V' is 0 on both sides, and the current would stay 0.
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
from vibsim.experiment.sweep_columns import grid_columns
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
from vibsim.models.base import by_name, rate
from vibsim.models.shared.crossings import STOP
from vibsim.models.shared.inertia import MASS, inertia
from vibsim.models.table import Lookup

CHUNK = 2**16  # members per block
SLACK = 1e-6  # tolerance for rounding of compared abscissae, in spacings of the table or steps
MOST_NAMED = 3  # largest number of swept values that identify a member in a message
SAMPLED_MEMBERS = 64  # evenly spaced members that are checked for jumps: seldom do only a few jump
WORK = 2**10  # bound on operations times members in that check: long formulas have fewer members
WORDS = {1: "derivative", 2: "second derivative"}
HINTS = {
    "voltage": "write a steep ramp, V0*(1 + tanh((t - t1)/0.001))/2 say, or begin behind the jump, "
    "with di_dt larger by it over L",
    "road": "round it off, or give it as a table, whose spacing does that",
}
OTHERS = "write a solution whose value and slope have no jumps"


@dataclass(frozen=True)
class MemberNumbers:
    """The parameters, initial values and end times of all members of a sweep."""

    model: Model
    parameters: Mapping[str, float]
    initial: Mapping[str, float]
    time: TimeSpec
    axes: Sequence[Axis]

    def blocks(self) -> Iterator[tuple[dict[str, Any], Floats]]:
        """Yield blocks of the distinct members (see `count`): their swept values, and their end times."""
        for start, stop in _chunks(self.count):
            yield self._block(start, stop)

    def sampled(self, most: int) -> Iterator[tuple[dict[str, float], float]]:
        """Yield parameters by name and end time of at most `most` distinct members, evenly spaced."""
        count = self.count
        for i in sorted({k * (count - 1) // max(most - 1, 1) for k in range(most)}):
            swept, end = self._block(i, i + 1)
            numbers = self._by_name(swept)
            yield {name: float(np.ravel(x)[0]) for name, x in numbers.items()}, float(end[0])

    def starts(self) -> Iterator[tuple[int, dict[str, Any], dict[str, Any]]]:
        """Yield blocks of all members: their number, their variables at t = 0 by name, and their swept values."""
        for start, stop in _chunks(math.prod(axis.count for axis in self.axes)):
            swept = grid_columns(self.axes, start, stop)
            initial = (
                self.model.start(self._parameters(swept)) if self.model.start else self.initial
            )
            numbers: dict[str, Any] = {"t": 0.0, **self._by_name(swept)}
            for state in self.model.states:
                value = initial.get(state.name, 0.0)
                numbers[state.name] = swept.get(f"initial.{state.name}", value)
            yield stop - start, numbers, swept

    def _distinct_axes(self) -> list[Axis]:
        return [axis for axis in self.axes if any(map(_is_relevant, axis.keys))]

    @property
    def count(self) -> int:
        """Number of members that differ in a model parameter or the end time."""
        return math.prod(axis.count for axis in self._distinct_axes())

    def _block(self, start: int, stop: int) -> tuple[dict[str, Any], Floats]:
        columns = grid_columns(self._distinct_axes(), start, stop)
        swept = {key: column for key, column in columns.items() if _is_relevant(key)}
        end = swept.get("time.end", np.full(stop - start, self.time.end))
        if self.time.is_of_model:
            with np.errstate(divide="ignore"):
                end_of_model = self.time.end_of(self.model, self._parameters(swept))
            end = np.broadcast_to(end_of_model, end.shape)
        return swept, end

    @property
    def lookup(self) -> Lookup:
        """The table of the model and the formula of its abscissa."""
        assert self.model.lookup is not None
        return self.model.lookup

    def place(self, swept: Mapping[str, Any], t: Floats) -> Floats:
        """Return the abscissae in the table at times `t` of members with these swept values."""
        formula = tree(self.model, self.lookup.place)
        return np.broadcast_to(values(formula, {**self._by_name(swept), "t": t}), t.shape)

    def _parameters(self, swept: Mapping[str, Any]) -> dict[str, Any]:
        return {key: swept.get(f"model.{key}", x) for key, x in self.parameters.items()}

    def _by_name(self, swept: Mapping[str, Any]) -> dict[str, Any]:
        return by_name(self.model.parameters, self._parameters(swept))


def _chunks(count: int) -> Iterator[tuple[int, int]]:
    yield from ((start, min(start + CHUNK, count)) for start in range(0, count, CHUNK))


def _is_relevant(key: str) -> bool:
    return key.startswith("model.") or key == "time.end"


def check_ends(numbers: MemberNumbers, report: Report) -> None:
    """Refuse an end time derived from the model that is not positive and finite for some member."""
    if not numbers.time.is_of_model:
        return
    for swept, end in numbers.blocks():
        is_invalid = ~(np.isfinite(end) & (end > 0.0))
        if is_invalid.any():
            who = member_name(swept, int(np.argmax(is_invalid)))
            if numbers.time.frequency is not None:
                key, rule = "frequency", "must be an angular frequency greater than 0"
            elif numbers.time.periods is not None:
                key, rule = "periods", "the model has no natural period"
            else:
                key, rule = "steps_per_point", "the vehicle never reaches the end of the table"
            report.add(("time", key), f"{rule} where {who}", "leave that member out, or give end")
            return


def member_name(swept: Mapping[str, Any], i: int) -> str:
    """Identify member `i` in a message by its swept numbers."""
    numbers = (f"{key} = {x[i]:.10g}" for key, x in swept.items() if x.dtype.kind != "U")
    return ", ".join(list(numbers)[:MOST_NAMED])


def check_table_length(numbers: MemberNumbers, name: str, report: Report) -> None:
    """Refuse a table that ends before the motion of some member."""
    table = numbers.lookup.table
    furthest, who = -np.inf, ""
    for swept, end in numbers.blocks():
        places = numbers.place(swept, end)
        i = int(np.argmax(places))
        if places[i] > furthest:
            furthest = float(places[i])
            who = member_name(swept, i)
    if furthest > table.last + SLACK * table.spacing:
        count = int(np.ceil((furthest - table.first) / table.spacing - SLACK)) + 1
        unit = "" if numbers.model.dimensionless else " m"
        rule = f"the table ends at {table.last:.10g}{unit}, but the motion comes to {furthest:.10g}{unit}"
        hint = f"it must have at least {count} points, not {table.points}"
        report.add(("model", name, TABLE), f"{rule}{f' ({who})' if who else ''}", hint)


def _is_met(numbers: MemberNumbers, level: int) -> bool:
    """Tell whether the steps of every member hit every point of the table, at `level` and all finer ones.

    They do if the spacing is a whole multiple of the advance per step at `level`, and so is the first abscissa.
    """
    table, steps = numbers.lookup.table, numbers.time.base_steps << level
    for swept, end in numbers.blocks():
        advance = numbers.place(swept, end / steps)
        with np.errstate(divide="ignore", invalid="ignore"):
            per_spacing, first = table.spacing / advance, table.first / advance
            deviation = table.points * np.abs(per_spacing - np.round(per_spacing))
            misses = ~(deviation <= SLACK) | ~(np.abs(first - np.round(first)) <= SLACK)
        # a member at rest passes no point
        if np.any((misses | (per_spacing < 0.5)) & (advance != 0.0)):
            return False
    return True


def update_tables(experiment: AnyExperiment) -> AnyExperiment:
    """Return `experiment` with `TableSpec.is_met` recomputed for its members and levels."""
    model = experiment.model
    if not model.tables:
        return experiment
    axes = experiment.sweep.axes if experiment.sweep else ()
    parameters, initial = model.parameters, experiment.initial
    numbers = MemberNumbers(model.definition, parameters, initial, experiment.time, axes)
    met = {"is_met": _is_met(numbers, experiment.levels[0] if experiment.levels else 0)}
    tables = {name: spec.model_copy(update=met) for name, spec in model.tables.items()}
    model = model.model_copy(update={"tables": FrozenDict(tables)})
    return experiment.model_copy(update={"model": model})


def check_jumps(members: MemberNumbers, formulas: Mapping[str, str], report: Report) -> None:
    """Refuse jumps in a formula or its slope if the equation contains higher derivatives of it."""
    for row in members.model.formulas:
        for key, text in formulas.items() if row.derivatives else ():
            if key.partition(".")[0] == row.name:
                _check_jumps(row, key, text, members, report)


def _check_jumps(
    row: FormulaField, key: str, text: str, members: MemberNumbers, report: Report
) -> None:
    (name,) = row.names
    known = [row_.name for row_ in members.model.parameters]
    formula, along = parse(text, (name, *known)), parse(row.along, ("t", *known))
    for order in range(row.derivatives):
        place = _jump(put(formula, name, along), members, along)
        if place is not None:
            what = "jumps" if order == 0 else "its slope jumps"
            rule = f"{what} near {name} = {place:.6g}, and the equation has its {WORDS[row.derivatives]}"
            report.add(("model", *key.split(".")), rule, HINTS.get(row.name, OTHERS), text)
            return
        formula = derivative(formula, name)


def _jump(formula: Expression, members: MemberNumbers, along: Expression) -> float | None:
    """Return the value of `along` at a jump of some member; None if no jump is found."""
    most = max(1, min(SAMPLED_MEMBERS, WORK // len(parts_of(formula))))
    for numbers, end in members.sampled(most):
        t = first_jump(formula, numbers, end)
        if t is not None:
            t = t if t > 1e-9 * end else 0.0  # bisection ends next to 0, not at it
            return float(values(along, {**numbers, "t": t}))
    return None


def check_starts(members: MemberNumbers, formulas: Mapping[str, str], report: Report) -> None:
    """Refuse a stop condition that holds at t = 0, and a mass matrix that is not positive definite there."""
    model = members.model

    def refuse(
        is_wrong: Callable[[Mapping[str, Any]], Flags], path: Path_, rule: str, hint: str
    ) -> None:
        """Report a fault for the first member for which `is_wrong`; `rule` has a placeholder for its name."""
        for count, numbers, swept in members.starts():
            wrong = np.broadcast_to(is_wrong(numbers), (count,))
            if wrong.any():
                who = member_name(swept, int(np.argmax(wrong)))
                report.add(path, rule.format(f" (where {who})" if who else ""), hint)
                return

    rows = model.events.rows if model.events else ()
    for guard in (tree(model, row.guard) for row in rows if row.ends):
        slope = rate(model, guard)

        def holds(numbers: Mapping[str, Any], guard: Any = guard, slope: Any = slope) -> Flags:
            # on the boundary, the motion may move into the allowed region
            now, rate_now = values(guard, numbers), values(slope, numbers)
            return np.asarray((now < 0.0) | ((now == 0.0) & (rate_now < 0.0)))

        rule = "already holds at the start{}: nothing would move"
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
