"""Validate the keys `events` and `stop` of the section ``model``."""

from __future__ import annotations

import math
from collections.abc import Collection
from typing import Any

from vibsim.core.errors import nearest
from vibsim.experiment.faults import Report
from vibsim.formula import Call, Compare, Expression, ExpressionError, bounds
from vibsim.formula.tree import STEPS
from vibsim.models import Model
from vibsim.models.shared.crossings import STOP, guard_name, guard_of, is_constant


def read_crossings(
    section: Any, model: Model, known: Collection[str], report: Report
) -> dict[str, str]:
    """Return the formulas of events and stop of a section ``model`` by name, and report their faults.

    `known` holds the names of all its parameters.
    """
    states = tuple(state.name for state in model.states)
    names = (*states, "t", *known)
    texts: dict[str, str] = {}
    for i, event in enumerate(section.events):
        path = "model", "events", i
        if event is None or _never_happens(event, path, report):
            continue
        guard = report.formula((*path, "when"), event.when, names)
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
        elif guard is not None and _has_one_sign(guard, names):
            rule = "never crosses 0: it has one sign throughout, or touches 0 and turns back"
            report.add((*path, "when"), rule, "write u, not abs(u) or u**2", event.when)
        name = guard_name(i + 1, bool(event.falling), bool(event.rising))
        texts[name] = event.when.strip()
        for state, text in event.then.items():
            if state not in states:
                positions = states[: len(states) // 2]
                hint = nearest(state, states)
                if state[-1:] == "'" and state[:-1] in positions:
                    hint = f"write {states[len(positions) + positions.index(state[:-1])]}"
                report.add((*path, "then", state), "unknown state", hint, at_key=True)
            elif report.formula((*path, "then", state), text, names) is not None:
                texts[f"{name.rpartition('.')[0]}.then.{state}"] = text.strip()
    if section.stop is not None:
        texts[STOP] = section.stop.strip()
        condition = report.formula(("model", STOP), section.stop, names)
        try:
            if condition is not None and is_constant(guard_of(condition), states):
                rule = "never changes: it names neither t nor a state"
                report.add(("model", STOP), rule, value=section.stop)
        except ExpressionError as error:
            report.add(("model", STOP), error.rule, error.hint, section.stop)
    return texts


def _has_one_sign(guard: Expression, names: Collection[str]) -> bool:
    """Tell whether a formula has one sign for all values of its names."""
    low, high = bounds(guard, dict.fromkeys(names, (-math.inf, math.inf)))
    return bool(low >= 0.0 or high <= 0.0)


def _jumps(node: Expression) -> str:
    """Name a discontinuous part of a formula; empty if none is found. The condition of a `where` does not count."""
    operands = node.operands
    match node:
        case Compare(symbol):
            return f"a comparison by {symbol}"
        case Call(function) if function in STEPS or function == "mod":
            return function
        case Call("where"):
            operands = operands[1:]
    return next(filter(None, map(_jumps, operands)), "")


def _never_happens(event: Any, path: tuple[str, str, int], report: Report) -> bool:
    """Tell whether an event is switched off for both crossing directions, and report that."""
    directions = [name for name in ("falling", "rising") if getattr(event, name) is not None]
    if not directions or event.falling or event.rising:
        return False
    rule = "must be true for falling or for rising: the event would never happen"
    report.add((*path, directions[0]), rule, "leave both out for both ways", False, at_key=True)
    return True
