"""Other ways to write a model, brought to the one that everything else reads.

That happens to the content of a file behind `vibsim.experiment.repeat`:

- ``equation: u'' + (u**2 - 1)*u' + u = 0`` becomes the acceleration of a system of one coordinate;
- ``coordinates`` with formulas of each, ``{x: {mass: 2, force: -x}}``, become a list and the formulas by name;
- ``stop`` and ``events`` beside the section ``model`` become part of it;
- the letters ``M``, ``C`` and ``K`` of a structure become ``mass``, ``damping`` and ``stiffness``;
- ``over: cases`` of a check becomes the only swept key, and ``take: where`` is ``where_largest``.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from vibsim.core.errors import likely
from vibsim.experiment.faults import Report
from vibsim.experiment.yaml.parse import Path_
from vibsim.formula import (
    CONSTANTS,
    FUNCTIONS,
    ZERO,
    Binary,
    Expression,
    ExpressionError,
    Negate,
    derivative,
    is_zero,
    parse,
    put,
    tidied,
    to_formula,
)
from vibsim.models.system import INPUT, velocities_of

EQUATION = "equation"
BESIDE_MODEL = "stop", "events"
OF_COORDINATE = "acceleration", "mass", "force"
LETTERS = {"M": "mass", "C": "damping", "K": "stiffness"}
_SECOND = "_second_derivative"
_DERIVATIVE = re.compile(r"([A-Za-z_]\w*)('{1,2})(?!')")


def write_usual_form(report: Report) -> None:
    """Bring the model in the content that `report` speaks of to its usual form; faults are noted."""
    source, data = report.source, report.source.data
    if not isinstance(data, Mapping) or not isinstance(section := data.get("model"), Mapping):
        return
    writer = _Writer(report)
    model = writer.of_structure(section) if section.get("kind") == "structure" else dict(section)
    if section.get("kind") == "system":
        model = writer.of_equation(writer.of_coordinates(model))
    rest = {key: value for key, value in data.items() if key not in BESIDE_MODEL}
    if isinstance(checks := data.get("checks"), list | tuple):
        rest["checks"] = [_over_a_key(check, data.get("sweep")) for check in checks]
    known = report.kinds.model(section.get("kind"))
    for key in (key for key in BESIDE_MODEL if key in data):
        if known is None or known.takes_events:
            model = writer.moved(model, key, data[key], (key,))
        else:
            rule = f"the model {known.kind} takes none"
            report.add_malformed((key,), rule, "`kind: system` does", at_key=True)
    origins = {**source.origins, **writer.origins}
    report.source = replace(source, data={**rest, "model": model}, origins=origins)


class _Writer:
    """Writes a section ``model`` anew, and remembers where its parts stand in the file."""

    def __init__(self, report: Report) -> None:
        self.source, self.report = report.source, report
        self.origins: dict[Path_, Path_] = {}

    def moved(self, model: dict[str, Any], key: str, value: Any, path: Path_) -> dict[str, Any]:
        """Return a section with the value at `path` under a key, unless that is there already."""
        if key in model:
            self.report.add_malformed(path, f"stands under `model: {key}`, too", at_key=True)
            return model
        self._came_from(("model", key), path)
        return {**model, key: value}

    def _came_from(self, path: Path_, written: Path_) -> None:
        self.origins[path] = self.source.origin(written) or written

    def of_structure(self, section: Mapping[str, Any]) -> dict[str, Any]:
        """Return a structure with words for the letters of its matrices."""
        model = {key: value for key, value in section.items() if key not in LETTERS}
        for letter in section.keys() & LETTERS.keys():
            model = self.moved(model, LETTERS[letter], section[letter], ("model", letter))
        return model

    def of_coordinates(self, model: dict[str, Any]) -> dict[str, Any]:
        """Return a system with the formulas of its coordinates by name.

        Where one coordinate has a force, all have: an acceleration is the force on the mass 1.
        """
        each = model.get("coordinates")
        if not isinstance(each, Mapping) or not all(map(_has_formulas, each.values())):
            return model
        known = {"coordinates", *OF_COORDINATE}
        for key in (key for key in OF_COORDINATE if key in model):
            rule = "stands at the coordinates, too"
            self.report.add_malformed(("model", key), rule, at_key=True)
        by_force = any("force" in own or "mass" in own for own in each.values())
        found: dict[str, dict[str, Any]] = {}
        for i, (name, own) in enumerate(each.items()):
            path: Path_ = ("model", "coordinates", name)
            self._came_from(("model", "coordinates", i), path)
            for key, value in own.items():
                if key not in OF_COORDINATE:
                    rule = f"is no formula of a coordinate: {', '.join(OF_COORDINATE)}"
                    self.report.add_malformed((*path, key), rule, at_key=True)
                    continue
                is_alone = key == "acceleration" and by_force and len(own) == 1
                if is_alone:
                    found.setdefault("mass", {})[name] = 1
                new = "force" if is_alone else key
                found.setdefault(new, {})[name] = value
                self._came_from(("model", new, name), (*path, key))
        return {
            **{key: value for key, value in model.items() if key not in known},
            "coordinates": list(each),
            **found,
        }

    def of_equation(self, model: dict[str, Any]) -> dict[str, Any]:
        """Return a system with the acceleration of its only coordinate in place of an equation."""
        path: Path_ = ("model", EQUATION)
        written = model.get(EQUATION)
        if isinstance(written, Mapping):
            rule = "must be the equation of one coordinate"
            hint = "of several give each its `acceleration`, or `force` and `mass`"
            self.report.add_malformed(path, rule, hint)
            rest = {key: value for key, value in model.items() if key != EQUATION}
            return {**rest, "acceleration": dict.fromkeys(map(str, written), "0")}
        if not isinstance(written, str):
            return model
        try:
            parameters = model.get("parameters")
            known = [*parameters] if isinstance(parameters, Mapping) else []
            name, acceleration = solved(written, ["t", INPUT, *map(str, known)])
        except ExpressionError as error:
            self.report.add_malformed(path, error.rule, error.hint, written)
            acceleration, name = "0", "u"
        rest = {key: value for key, value in model.items() if key != EQUATION}
        # the velocity of u alone is v
        found = rest if name == "u" else {"coordinates": [name], **rest}
        return self.moved(found, "acceleration", acceleration, path)


def _over_a_key(check: Any, sweep: Any) -> Any:
    """Return a check of all cases as one over the swept key, if there is one only."""
    if not isinstance(check, Mapping):
        return check
    if "that" in check:
        return {**check, "that": _over_a_key(check["that"], sweep)}
    found = dict(check)
    if check.get("take") == "where":
        found["take"] = "where_largest"
    if check.get("over") == "cases" and isinstance(sweep, Mapping):
        fixed = check["at"] if isinstance(check.get("at"), Mapping) else {}
        together = sweep.get("zip")
        own = [key for key in sweep if "." in str(key) and key not in fixed]
        if isinstance(together, Mapping) and not together.keys() & fixed.keys():
            # those that vary together are one
            own += list(together)[:1]
        if len(own) == 1:
            found["over"] = own[0]
    return found


def _has_formulas(own: Any) -> bool:
    return isinstance(own, Mapping) and not own.keys().isdisjoint(OF_COORDINATE)


def solved(equation: str, others: Sequence[str]) -> tuple[str, str]:
    """Return the coordinate of an equation such as ``m*u'' + k*u = F``, and its acceleration as a formula.

    ExpressionError where it is no equation of one coordinate, linear in the second derivative, or names something else
    than the coordinate, its derivatives and `others`.
    """
    sides = equation.split("=")
    if len(sides) != 2:
        raise ExpressionError(equation, 0, "must have one =", "e.g. u'' + u = 0")
    names = {name for name, mark in _DERIVATIVE.findall(equation) if mark == "''"}
    if len(names) != 1:
        rule = "must have the second derivative of one coordinate"
        raise ExpressionError(
            equation, 0, rule, "e.g. u'' + u = 0; of several give each its acceleration"
        )
    (name,) = names
    (velocity,) = velocities_of((name,))

    def named(match: re.Match[str]) -> str:
        if match[1] != name:
            raise ExpressionError(equation, 0, f"'{match[0]}' is no derivative of {name}")
        return _SECOND if match[2] == "''" else velocity

    texts = [_DERIVATIVE.sub(named, side) for side in sides]
    words = set(re.findall(r"[A-Za-z_]\w*", " ".join(texts))) - {*FUNCTIONS, *CONSTANTS}
    left, right = (parse(text, words) for text in texts)
    for other in (*left.names, *right.names):
        if other not in (name, velocity, _SECOND, *others):
            hint = likely(other, others) or "give its value in `parameters`"
            raise ExpressionError(equation, 0, f"unknown name '{other}'", hint)
    factor, rest = ZERO, ZERO
    for term in (*_terms(left), *_terms(Negate(right))):
        slope = derivative(term, _SECOND)
        if _SECOND in slope.names:
            raise ExpressionError(equation, 0, f"must be linear in {name}''")
        without = tidied(put(term, _SECOND, ZERO))
        factor = factor + slope
        rest = rest + without.operand if isinstance(without, Negate) else rest - without
    factor = tidied(factor)
    if is_zero(factor):
        raise ExpressionError(equation, 0, f"has no {name}'' but in what vanishes")
    if isinstance(factor, Negate):
        factor, rest = factor.operand, Negate(rest)
    return name, to_formula(tidied(rest / factor))


def _terms(node: Expression, *, is_minus: bool = False) -> Iterator[Expression]:
    """Yield the terms of a sum."""
    match node:
        case Binary("+" | "-" as sign, left, right):
            yield from _terms(left, is_minus=is_minus)
            yield from _terms(right, is_minus=is_minus != (sign == "-"))
        case Negate(operand):
            yield from _terms(operand, is_minus=not is_minus)
        case _:
            yield Negate(node) if is_minus else node
