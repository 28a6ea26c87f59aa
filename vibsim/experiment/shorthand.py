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
from vibsim.experiment.schema.sweep import swept_values
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
    is_structure, is_system = (section.get("kind") == kind for kind in ("structure", "system"))
    model = _with_words(section, report) if is_structure else dict(section)
    if is_system:
        model = _with_acceleration(_with_formulas(model, report), report)
    content = {key: value for key, value in data.items() if key not in BESIDE_MODEL}
    if isinstance(checks := data.get("checks"), list | tuple):
        content["checks"] = [_with_swept_key(check, data.get("sweep")) for check in checks]
    known = report.kinds.model(section.get("kind"))
    for key in (key for key in BESIDE_MODEL if key in data):
        if known is None or known.takes_events:
            model = _with_moved(model, key, data[key], (key,), report)
        else:
            rule = f"the model {known.kind} takes none"
            report.add_malformed((key,), rule, "`kind: system` does", at_key=True)
    report.rewrite({**content, "model": model})


def _with_moved(
    model: dict[str, Any], key: str, value: Any, path: Path_, report: Report
) -> dict[str, Any]:
    """Return a section ``model`` with the value from `path` under `key`; report a fault if the key exists."""
    if key in model:
        report.add_malformed(path, f"is also given under `model: {key}`", at_key=True)
        return model
    report.move(path, ("model", key))
    return {**model, key: value}


def _with_words(section: Mapping[str, Any], report: Report) -> dict[str, Any]:
    """Return a structure with names in place of the letters of its matrices."""
    model = {key: value for key, value in section.items() if key not in LETTERS}
    for letter in section.keys() & LETTERS.keys():
        model = _with_moved(model, LETTERS[letter], section[letter], ("model", letter), report)
    return model


def _with_formulas(model: dict[str, Any], report: Report) -> dict[str, Any]:
    """Return a system with the formulas of its coordinates by name.

    If one coordinate has a force, all need one: an acceleration becomes the force on mass 1.
    """
    coordinates = model.get("coordinates")
    if not isinstance(coordinates, Mapping) or not all(map(_has_formulas, coordinates.values())):
        return model
    known = {"coordinates", *OF_COORDINATE}
    for key in (key for key in OF_COORDINATE if key in model):
        report.add_malformed(("model", key), "is also given at the coordinates", at_key=True)
    by_force = any("force" in entry or "mass" in entry for entry in coordinates.values())
    formulas: dict[str, dict[str, Any]] = {}
    for i, (name, entry) in enumerate(coordinates.items()):
        path: Path_ = ("model", "coordinates", name)
        report.move(path, ("model", "coordinates", i))
        for key, value in entry.items():
            if key not in OF_COORDINATE:
                rule = f"is not a formula of a coordinate: {', '.join(OF_COORDINATE)}"
                report.add_malformed((*path, key), rule, at_key=True)
                continue
            is_plain_acceleration = key == "acceleration" and by_force and len(entry) == 1
            if is_plain_acceleration:
                formulas.setdefault("mass", {})[name] = 1
            target = "force" if is_plain_acceleration else key
            formulas.setdefault(target, {})[name] = value
            report.move((*path, key), ("model", target, name))
    others = {key: value for key, value in model.items() if key not in known}
    return {**others, "coordinates": list(coordinates), **formulas}


def _with_acceleration(model: dict[str, Any], report: Report) -> dict[str, Any]:
    """Return a system with its equation solved for the acceleration of the only coordinate."""
    path: Path_ = ("model", EQUATION)
    equation = model.get(EQUATION)
    others = {key: value for key, value in model.items() if key != EQUATION}
    if isinstance(equation, Mapping):
        rule = "must be the equation of one coordinate"
        hint = "of several give each its `acceleration`, or `force` and `mass`"
        report.add_malformed(path, rule, hint)
        return {**others, "acceleration": dict.fromkeys(map(str, equation), "0")}
    if not isinstance(equation, str):
        return model
    parameters = model.get("parameters")
    known = map(str, parameters if isinstance(parameters, Mapping) else ())
    try:
        name, acceleration = solved(equation, ["t", INPUT, *known])
    except ExpressionError as error:
        report.add_malformed(path, error.rule, error.hint, equation)
        acceleration, name = "0", "u"
    # u is the default coordinate, with velocity v
    system = others if name == "u" else {"coordinates": [name], **others}
    return _with_moved(system, "acceleration", acceleration, path, report)


def _with_swept_key(check: Any, sweep: Any) -> Any:
    """Return a check with ``over: cases`` replaced by the only swept key, and ``take: where`` written out."""
    if not isinstance(check, Mapping):
        return check
    if "that" in check:
        return {**check, "that": _with_swept_key(check["that"], sweep)}
    result = dict(check)
    if check.get("take") == "where":
        result["take"] = "where_largest"
    if check.get("over") == "cases":
        fixed = check["at"] if isinstance(check.get("at"), Mapping) else {}
        axes: dict[Path_, list[str]] = {}  # keys that vary together count as one
        for path, _ in swept_values(sweep):
            axes.setdefault(path[:-1] if path[1] == "zip" else path, []).append(str(path[-1]))
        keys = [axis[0] for axis in axes.values() if fixed.keys().isdisjoint(axis)]
        keys = [key for key in keys if "." in key]
        if len(keys) == 1 and not keys[0].startswith("schemes."):
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
