"""Rewrite alternative notations of a file to the standard one, after `vibsim.experiment.repeat`:

- ``equation: u'' + (u**2 - 1)*u' + u = 0`` becomes the acceleration of a system of one coordinate;
- ``coordinates`` with their formulas, ``{x: {mass: 2, force: -x}}``, become a list and the formulas by name;
- ``stop`` and ``events`` outside of the section ``model`` move into it;
- ``M``, ``C`` and ``K`` of a structure become ``mass``, ``damping`` and ``stiffness``;
- ``over: cases`` of a check becomes the only swept key, if only one varies, and ``take: where`` becomes
  ``where_largest``.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
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
from vibsim.models.shared.coordinates import velocities_of
from vibsim.models.shared.written_system import INPUT

EQUATION = "equation"
BESIDE_MODEL = "stop", "events"
OF_COORDINATE = "acceleration", "mass", "force"
LETTERS = {"M": "mass", "C": "damping", "K": "stiffness"}
_SECOND = "_second_derivative"
_DERIVATIVE = re.compile(r"([A-Za-z_]\w*)('{1,2})(?!')")


def write_usual_form(report: Report) -> None:
    """Rewrite the content of `report` in the standard notation, and report faults."""
    data = report.source.data
    if not isinstance(data, Mapping) or not isinstance(section := data.get("model"), Mapping):
        return
    writer = _Writer(report)
    model = writer.of_structure(section) if section.get("kind") == "structure" else dict(section)
    if section.get("kind") == "system":
        model = writer.of_equation(writer.of_coordinates(model))
    content = {key: value for key, value in data.items() if key not in BESIDE_MODEL}
    if isinstance(checks := data.get("checks"), list | tuple):
        content["checks"] = [_with_swept_key(check, data.get("sweep")) for check in checks]
    known = report.kinds.model(section.get("kind"))
    for key in (key for key in BESIDE_MODEL if key in data):
        if known is None or known.takes_events:
            model = writer.moved(model, key, data[key], (key,))
        else:
            rule = f"the model {known.kind} takes none"
            report.add_malformed((key,), rule, "`kind: system` does", at_key=True)
    report.rewrite({**content, "model": model}, writer.origins)


class _Writer:
    """Rewrites a section ``model``, and records the paths of its values in the file."""

    def __init__(self, report: Report) -> None:
        self.report = report
        self.origins: dict[Path_, Path_] = {}

    def moved(self, model: dict[str, Any], key: str, value: Any, path: Path_) -> dict[str, Any]:
        """Return a section with the value from `path` added under `key`; report a fault if the key exists."""
        if key in model:
            self.report.add_malformed(path, f"is also given under `model: {key}`", at_key=True)
            return model
        self.origins["model", key] = path
        return {**model, key: value}

    def of_structure(self, section: Mapping[str, Any]) -> dict[str, Any]:
        """Return a structure with names in place of the letters of its matrices."""
        model = {key: value for key, value in section.items() if key not in LETTERS}
        for letter in section.keys() & LETTERS.keys():
            model = self.moved(model, LETTERS[letter], section[letter], ("model", letter))
        return model

    def of_coordinates(self, model: dict[str, Any]) -> dict[str, Any]:
        """Return a system with the formulas of its coordinates by name.

        If one coordinate has a force, all need one: an acceleration becomes the force on mass 1.
        """
        coordinates = model.get("coordinates")
        if not isinstance(coordinates, Mapping) or not all(
            map(_has_formulas, coordinates.values())
        ):
            return model
        known = {"coordinates", *OF_COORDINATE}
        for key in (key for key in OF_COORDINATE if key in model):
            rule = "is also given at the coordinates"
            self.report.add_malformed(("model", key), rule, at_key=True)
        by_force = any("force" in entry or "mass" in entry for entry in coordinates.values())
        formulas: dict[str, dict[str, Any]] = {}
        for i, (name, entry) in enumerate(coordinates.items()):
            path: Path_ = ("model", "coordinates", name)
            self.origins["model", "coordinates", i] = path
            for key, value in entry.items():
                if key not in OF_COORDINATE:
                    rule = f"is not a formula of a coordinate: {', '.join(OF_COORDINATE)}"
                    self.report.add_malformed((*path, key), rule, at_key=True)
                    continue
                is_plain_acceleration = key == "acceleration" and by_force and len(entry) == 1
                if is_plain_acceleration:
                    formulas.setdefault("mass", {})[name] = 1
                target = "force" if is_plain_acceleration else key
                formulas.setdefault(target, {})[name] = value
                self.origins["model", target, name] = (*path, key)
        return {
            **{key: value for key, value in model.items() if key not in known},
            "coordinates": list(coordinates),
            **formulas,
        }

    def of_equation(self, model: dict[str, Any]) -> dict[str, Any]:
        """Return a system with its equation solved for the acceleration of the only coordinate."""
        path: Path_ = ("model", EQUATION)
        equation = model.get(EQUATION)
        if isinstance(equation, Mapping):
            rule = "must be the equation of one coordinate"
            hint = "of several give each its `acceleration`, or `force` and `mass`"
            self.report.add_malformed(path, rule, hint)
            others = {key: value for key, value in model.items() if key != EQUATION}
            return {**others, "acceleration": dict.fromkeys(map(str, equation), "0")}
        if not isinstance(equation, str):
            return model
        try:
            parameters = model.get("parameters")
            known = [*parameters] if isinstance(parameters, Mapping) else []
            name, acceleration = solved(equation, ["t", INPUT, *map(str, known)])
        except ExpressionError as error:
            self.report.add_malformed(path, error.rule, error.hint, equation)
            acceleration, name = "0", "u"
        others = {key: value for key, value in model.items() if key != EQUATION}
        # u is the default coordinate, with velocity v
        system = others if name == "u" else {"coordinates": [name], **others}
        return self.moved(system, "acceleration", acceleration, path)


def _with_swept_key(check: Any, sweep: Any) -> Any:
    """Return a check with ``over: cases`` replaced by the only swept key, and ``take: where`` written out."""
    if not isinstance(check, Mapping):
        return check
    if "that" in check:
        return {**check, "that": _with_swept_key(check["that"], sweep)}
    result = dict(check)
    if check.get("take") == "where":
        result["take"] = "where_largest"
    if check.get("over") == "cases" and isinstance(sweep, Mapping):
        fixed = check["at"] if isinstance(check.get("at"), Mapping) else {}
        zipped, sample = sweep.get("zip"), sweep.get("sample")
        keys = [key for key in sweep if "." in str(key) and key not in fixed]
        if isinstance(sample, Mapping) and isinstance(sample.get("over"), Mapping):
            keys += list(sample["over"])
        if isinstance(zipped, Mapping) and not zipped.keys() & fixed.keys():
            # keys that vary together count as one
            keys += list(zipped)[:1]
        if len(keys) == 1 and not str(keys[0]).startswith("schemes."):
            result["over"] = keys[0]
    return result


def _has_formulas(entry: Any) -> bool:
    return isinstance(entry, Mapping) and not entry.keys().isdisjoint(OF_COORDINATE)


def solved(equation: str, others: Sequence[str]) -> tuple[str, str]:
    """Return the coordinate of an equation such as ``m*u'' + k*u = F``, and its acceleration as a formula.

    Raises `ExpressionError` if it is not an equation of one coordinate that is linear in the second derivative, or if
    it contains names other than the coordinate, its derivatives and `others`.
    """
    sides = equation.split("=")
    if len(sides) != 2:
        raise ExpressionError(equation, 0, "must have one =", "e.g. u'' + u = 0")
    if "'''" in equation:
        rule = "a derivative above the second is not allowed"
        hint = "give `acceleration` of several coordinates: a velocity may be the unknown of first order"
        raise ExpressionError(equation, equation.index("'''"), rule, hint)
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
            raise ExpressionError(equation, 0, f"'{match[0]}' is not a derivative of {name}")
        return _SECOND if match[2] == "''" else velocity

    texts = [_DERIVATIVE.sub(named, side) for side in sides]
    words = {*re.findall(r"[A-Za-z_]\w*", " ".join(texts))} - {*FUNCTIONS, *CONSTANTS} | {*others}
    left, right = (parse(text, words) for text in texts)
    for other in (*left.names, *right.names):
        if other not in (name, velocity, _SECOND, *others):
            hint = likely(other, others) or "give its value in `parameters`"
            raise ExpressionError(equation, 0, f"unknown name '{other}'", hint)
    factor, rhs = ZERO, ZERO
    for term in (*_terms(left), *_terms(Negate(right))):
        slope = derivative(term, _SECOND)
        if _SECOND in slope.names:
            raise ExpressionError(equation, 0, f"must be linear in {name}''")
        remainder = tidied(put(term, _SECOND, ZERO))
        factor = factor + slope
        rhs = rhs + remainder.operand if isinstance(remainder, Negate) else rhs - remainder
    factor = tidied(factor)
    if is_zero(factor):
        raise ExpressionError(equation, 0, f"has no {name}'' but in what vanishes")
    if isinstance(factor, Negate):
        factor, rhs = factor.operand, Negate(rhs)
    return name, to_formula(tidied(rhs / factor))


def _terms(node: Expression, *, is_minus: bool = False) -> Iterator[Expression]:
    """Yield the terms of a sum, with their signs."""
    match node:
        case Binary("+" | "-" as sign, left, right):
            yield from _terms(left, is_minus=is_minus)
            yield from _terms(right, is_minus=is_minus != (sign == "-"))
        case Negate(operand):
            yield from _terms(operand, is_minus=not is_minus)
        case _:
            yield Negate(node) if is_minus else node
