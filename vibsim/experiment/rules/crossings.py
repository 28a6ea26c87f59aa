"""The keys `events` and `stop` of the section ``model``: what they may say, and where a motion may begin."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np

from vibsim.core.errors import nearest
from vibsim.experiment.faults import Report
from vibsim.experiment.schema.sweep import Axis
from vibsim.experiment.sweep_columns import columns_of
from vibsim.formula import (
    MAX_CHARACTERS,
    Call,
    Compare,
    Expression,
    ExpressionError,
    parse,
    values,
)
from vibsim.formula.tree import STEPS, children
from vibsim.models import Model, tree
from vibsim.models.base import rate
from vibsim.models.events import Crossings
from vibsim.models.shared.crossings import STOP, guard_name, guard_of, is_constant

CHUNK = 2**16
"""Members that are looked at together."""
MOST_NAMED = 3
"""Most swept numbers of a member that a message names."""


def read_crossings(
    section: Any, model: Model, known: Collection[str], report: Report
) -> dict[str, str]:
    """Return the formulas of events and stop by their names, and note what is wrong with them.

    Parameters
    ----------
    section
        The section ``model``.
    known
        Names of all parameters.
    """
    states = tuple(state.name for state in model.states)
    names = (*states, "t", *known)
    texts: dict[str, str] = {}
    for i, event in enumerate(section.events):
        path = "model", "events", i
        if event is None or _is_without_way(event, path, report):
            continue
        guard = _read(event.when, names, (*path, "when"), report)
        if isinstance(guard, Compare):
            rule = "must be a formula that crosses 0, and no comparison"
            hint = "write u - gap and rising: true for u > gap"
            report.add((*path, "when"), rule, hint, event.when)
        elif guard is not None and (jumps := _jumps(guard)):
            rule = f"must not jump, as {jumps} does: it must cross 0"
            hint = "for kicks with the period T write sin(pi*t/T)"
            report.add((*path, "when"), rule, hint, event.when)
        elif guard is not None and is_constant(guard, states):
            rule = "never changes: it names neither t nor a state"
            report.add((*path, "when"), rule, value=event.when)
        name = guard_name(i + 1, bool(event.falling), bool(event.rising))
        texts[name] = event.when.strip()
        for state, text in event.then.items():
            if state not in states:
                rule = "unknown state"
                report.add((*path, "then", state), rule, nearest(state, states), at_key=True)
            elif _read(text, names, (*path, "then", state), report) is not None:
                texts[f"{name.rpartition('.')[0]}.then.{state}"] = text.strip()
    if section.stop is not None:
        texts[STOP] = section.stop.strip()
        condition = _read(section.stop, names, ("model", STOP), report)
        try:
            if condition is not None and is_constant(guard_of(condition), states):
                rule = "never changes: it names neither t nor a state"
                report.add(("model", STOP), rule, value=section.stop)
        except ExpressionError as error:
            report.add(("model", STOP), error.rule, error.hint, section.stop)
    return texts


def _jumps(node: Expression) -> str:
    """Name what in a formula jumps; nothing where it does not, as a comparison within `where` need not."""
    parts = children(node)
    match node:
        case Compare(symbol):
            return f"a comparison by {symbol}"
        case Call(function) if function in STEPS or function == "mod":
            return function
        case Call("where"):
            parts = parts[1:]
    return next(filter(None, map(_jumps, parts)), "")


def _is_without_way(event: Any, path: tuple[str, str, int], report: Report) -> bool:
    """Tell whether an event is switched off both where its formula falls and where it rises."""
    given = [name for name in ("falling", "rising") if getattr(event, name) is not None]
    if not given or event.falling or event.rising:
        return False
    rule = "must be true for falling or for rising: the event would never happen"
    report.add((*path, given[0]), rule, "leave both out for both ways", False, at_key=True)
    return True


def _read(
    text: str, names: tuple[str, ...], path: tuple[str | int, ...], report: Report
) -> Expression | None:
    """Return a formula; None where it cannot be read, which is noted."""
    try:
        return parse(text, names)
    except ExpressionError as error:
        place = f" at character {error.position + 1}" if error.position < MAX_CHARACTERS else ""
        report.add(path, f"{error.rule}{place}", error.hint, text)
        return None


def check_stop(
    model: Model,
    parameters: Mapping[str, float],
    initial: Mapping[str, float],
    axes: Sequence[Axis],
    report: Report,
) -> None:
    """Refuse a stop that holds at t = 0 already, for some member."""
    rows = model.events.rows if isinstance(model.events, Crossings) else ()
    guards = [tree(model, row.guard) for row in rows if row.ends]
    rates = [rate(model, guard) for guard in guards]
    count = math.prod(axis.count for axis in axes)
    for start in range(0, count if guards else 0, CHUNK):
        stop = min(start + CHUNK, count)
        found = columns_of(axes, start, stop)
        numbers: dict[str, Any] = {"t": 0.0}
        for row in model.parameters:
            numbers[row.name] = found.get(f"model.{row.key}", parameters[row.key])
        for state in model.states:
            given = initial.get(state.name, 0.0)
            numbers[state.name] = found.get(f"initial.{state.name}", given)
        # at the border the motion may go in
        now, ahead = (values(formula, numbers) for formula in (guards[0], rates[0]))
        holds = np.broadcast_to((now < 0.0) | ((now == 0.0) & (ahead < 0.0)), (stop - start,))
        if holds.any():
            i = int(np.argmax(holds))
            named = [
                f"{key} = {column[i]:.10g}" for key, column in found.items() if _is_number(column)
            ]
            who = f" (where {', '.join(named[:MOST_NAMED])})" if named else ""
            rule = f"holds at the start already{who}: nothing would move"
            report.add(("model", STOP), rule, "begin outside of it")
            return


def _is_number(column: Any) -> bool:
    return bool(np.issubdtype(np.asarray(column).dtype, np.number))
