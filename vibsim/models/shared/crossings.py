"""Events and a stop that a user writes as formulas: from text to `vibsim.models.events.Crossings`.

Among the formulas of a user (`Model.formulas`) they have these names: ``stop`` is a condition, ``events.2.falling`` (or
``rising``, or ``when`` for both) the guard of event 2, counted from 1, and ``events.2.then.v`` the value of the state v
after it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from vibsim.formula import (
    Binary,
    Call,
    Compare,
    Expression,
    ExpressionError,
    parse,
    to_formula,
)
from vibsim.models.events import Crossing, Crossings

MOST_EVENTS = 8
"""Largest number of events of a model, beside its stop."""
STOP = "stop"
DIRECTIONS: Mapping[str, int] = {"falling": -1, "when": 0, "rising": 1}
"""The last word in the name of a guard."""


def is_crossing(name: str) -> bool:
    """Tell whether a formula is part of an event or a stop."""
    return name == STOP or name.startswith("events.")


def guard_name(number: int, falling: bool, rising: bool) -> str:
    """Return the name of the guard of an event that happens where the guard falls, rises, or does either."""
    word = "when" if falling == rising else "falling" if falling else "rising"
    return f"events.{number}.{word}"


def guard_of(condition: Expression) -> Expression:
    """Return a formula that falls below 0 where a condition begins to hold.

    Raises ExpressionError if the condition is not a comparison by < or >, or several joined by and, or.
    """
    match condition:
        case Compare("<" | "<=", left, right):
            return left - right
        case Compare(">" | ">=", left, right):
            return right - left
        case Compare():
            rule = "must not compare by == or !=: a motion meets no value exactly"
            raise ExpressionError("", 0, rule, "write < or >")
        case Binary("*", left, right):
            return Call("max", (guard_of(left), guard_of(right)))
        case Call("max", (left, right)):
            return Call("min", (guard_of(left), guard_of(right)))
    raise ExpressionError("", 0, "must be a comparison", "write u < 0, say")


def crossings(texts: Mapping[str, str], names: tuple[str, ...]) -> Crossings | None:
    """Return the events of a user's formulas, in which `names` are allowed; the stop is the last. None without events.

    Raises ExpressionError if a formula cannot be parsed.
    """
    rows = []
    for number in range(1, MOST_EVENTS + 1):
        head = f"events.{number}."
        for word, direction in DIRECTIONS.items():
            if head + word in texts:
                new = {key: text for key, text in texts.items() if key.startswith(f"{head}then.")}
                then = tuple((key.split(".")[-1], parse(text, names)) for key, text in new.items())
                rows.append(Crossing(parse(texts[head + word], names), direction, then))
    if STOP in texts:
        rows.append(Crossing(guard_of(parse(texts[STOP], names)), -1, ends=True))
    return Crossings(tuple(rows)) if rows else None


def described(events: Crossings, texts: Mapping[str, str]) -> str:
    """Return the text of events that follows an equation, each after a comma."""
    words = {-1: " falls to 0", 0: " = 0", 1: " rises to 0"}
    parts = []
    for row in events.rows:
        if row.ends:
            parts.append(f"end where {texts[STOP]}")
            continue
        changes = [f"{name} -> {_text(value)}" for name, value in row.then]
        guard = _text(row.guard)
        parts.append(f"{', '.join(changes) or 'event'} where {guard}{words[row.direction]}")
    return "".join(f", {part}" for part in parts)


def _text(formula: str | Expression) -> str:
    return formula if isinstance(formula, str) else to_formula(formula)


def written(texts: Mapping[str, str]) -> dict[str, Any]:
    """Return events and stop in the form of an experiment file."""
    events = []
    for name, guard in sorted(texts.items()):
        head, _, word = name.rpartition(".")
        if name.startswith("events.") and word in DIRECTIONS and not head.endswith(".then"):
            event: dict[str, Any] = {"when": guard}
            event |= {word: True} if DIRECTIONS[word] else {}
            then = f"{head}.then."
            changes = {
                key.removeprefix(then): x for key, x in texts.items() if key.startswith(then)
            }
            events.append(event | ({"then": changes} if changes else {}))
    sections: dict[str, Any] = {"events": events} if events else {}
    return sections | ({STOP: texts[STOP]} if STOP in texts else {})


def is_constant(guard: Expression, states: tuple[str, ...]) -> bool:
    """Tell whether a guard depends neither on states nor on time."""
    return set(guard.names).isdisjoint((*states, "t"))
