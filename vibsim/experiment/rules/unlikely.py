"""Warnings about values that are valid but probably mistakes."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from decimal import Decimal
from typing import Any

import numpy as np

from vibsim.core.vocabulary import VECTORS, VELOCITY_VECTOR
from vibsim.experiment.faults import Report
from vibsim.experiment.rules.formulas import NAME
from vibsim.experiment.rules.members import MemberNumbers
from vibsim.experiment.schema.checks import AccurateCheck, Check, ConvergesCheck, ValueCheck
from vibsim.experiment.schema.fields import DECLARED
from vibsim.experiment.schema.sweep import swept_values
from vibsim.experiment.schema.unit_text import split
from vibsim.experiment.value_names import OF_THE_SAME_KIND, VALUES
from vibsim.experiment.yaml.parse import Path_
from vibsim.formula import (
    CONSTANTS,
    Binary,
    Call,
    Expression,
    Name,
    Negate,
    literal,
    parse,
    values_of,
    walk,
)
from vibsim.formula.algebra import terms_of
from vibsim.models import Model, tree
from vibsim.models.shared.coordinates import angles

TURN = 2.0 * math.pi
MEMBERS = 9  # number of members of a sweep whose laws are looked at
EXACT_DIGITS = 9  # from this number of digits on, a number is meant to be compared to 1e-9 relative


def note_unlikely(
    checks: Sequence[Check], levels: Sequence[int], members: MemberNumbers, report: Report
) -> None:
    """Warn about probable mistakes in a file without fault; `checks` are those that it gives."""
    model = members.model
    _warn_angles(model, report)
    _warn_phases(model, report)
    _warn_hertz(model, report)
    _warn_signs(members, report)
    _warn_repeated(report)
    _warn_set_and_swept(report)
    for i, check in enumerate(checks):
        inner = check.measured
        path: Path_ = ("checks", i) if inner is check else ("checks", i, "that")
        if inner.about in VECTORS:
            _warn_mixed(path, inner.about, model, report)
        match inner:
            case AccurateCheck(relative=float(bound)) if bound >= 1.0:
                rule = f"is {bound:g} times the size of {inner.accurate}, and nearly every error is below that"
                report.note((*path, "relative"), rule, f"{bound:g} percent are {bound / 100:g}")
            case ConvergesCheck(order=float(order)) if inner.tolerance >= order:
                rule = f"lets every order up to {order + inner.tolerance:g} pass"
                report.note((*path, "tolerance"), rule, "it is a distance of orders, such as 0.1")
            case ConvergesCheck() if len(levels) in (1, 2) and inner.expect.status == "PASS":
                rule = f"{len(levels)} of them decide no order"
                report.note(("levels",), rule, "three are needed, and four are better")
            case ValueCheck(rtol=float(part)) if part >= 1.0:
                rule = f"lets every number up to {1.0 + part:g} times the expected one pass"
                report.note((*path, "rtol"), rule, f"{part:g} percent are {part / 100:g}")
            case ValueCheck(equals=float(number), rtol=None, atol=None) if (
                inner.take in OF_THE_SAME_KIND
            ):
                _warn_digits((*path, "equals"), inner.value, number, report)


def _warn_angles(model: Model, report: Report) -> None:
    """Warn about angles of more than a turn without a unit: they are in rad, and degrees may be meant."""
    of_equation = set(angles(model)) if model.dimensionless else set()
    for state in model.states:
        if state.unit != "rad" and state.name not in of_equation:
            continue
        for path, values in _unitless_starts(report.source.data, state.name):
            _note_angle(path, max(map(abs, values), default=0.0), report)


def _warn_mixed(path: Path_, vector: str, model: Model, report: Report) -> None:
    """Warn about a vector of angles and other coordinates, if only the equation shows which are angles."""
    turning = set(angles(model)) & set(model.positions)
    others = [name for name in model.positions if name not in turning]
    if model.dimensionless and turning and others:
        rates = "the rates of " if vector == VELOCITY_VECTOR else ""
        rule = f"{vector} adds squares of {rates}{min(turning)}, an angle, and of {others[0]}"
        report.note(path, rule, "a sum means something only in one unit")


def _warn_phases(model: Model, report: Report) -> None:
    """Warn about phases of more than a turn without a unit: as 90 in ``cos(w*t + 90)``."""
    phases = {*_terms_of_waves(model)}
    for name, value in report.source.data["model"].get(DECLARED, {}).items():
        if Name(name) in phases and type(value) in (int, float):
            _note_angle(("model", DECLARED, name), abs(value), report)
    written = max((abs(literal(term) or 0.0) for term in phases), default=0.0)
    _note_angle(("model",), written, report)


def _note_angle(path: Path_, angle: float, report: Report) -> None:
    if angle > TURN:
        rule = f"{angle:g} rad are {angle / TURN:.2g} turns"
        formula = f"{angle:g}*pi/180"
        written = f"`{formula}`" if path == ("model",) else f"`{angle:g} degree`"
        report.note(path, rule, f"{angle:g} degrees are written {written}")


def _warn_hertz(model: Model, report: Report) -> None:
    """Warn about a declared frequency in hertz that is taken for an angular one: as `w` in ``cos(w*t)``."""
    declared = report.source.data["model"].get(DECLARED, {})
    for name in sorted(_rates(model) & set(declared)):
        text = declared[name]
        halves = split(text) if isinstance(text, str) else None
        if halves and halves[1].endswith(("Hz", "hertz")):
            rule = f"the formulas take it for an angular frequency, but {text} is a number of turns per second"
            report.note(("model", DECLARED, name), rule, f"write 2*pi*{name}*t there")


def _rates(model: Model) -> set[str]:
    """Return the names of the rates w in ``sin(w*t)`` and ``cos(w*t + ...)``."""
    factors = (
        set(turn.operands)
        for turn in _terms_of_waves(model)
        if isinstance(turn, Binary) and turn.operator == "*"
    )
    return {
        name.name
        for both in factors
        if Name("t") in both
        for name in both - {Name("t")}
        if isinstance(name, Name)
    }


def _terms_of_waves(model: Model) -> Iterator[Expression]:
    """Yield the terms of the arguments of sines and cosines in the equation, without a minus sign before them."""
    for node in (part for formula in model.accelerations for part in walk(tree(model, formula))):
        if isinstance(node, Call) and node.function in ("sin", "cos"):
            for term in terms_of(node.arguments[0]):
                yield term.operand if isinstance(term, Negate) else term


def _warn_signs(members: MemberNumbers, report: Report) -> None:
    """Warn about a damping that drives half of the time, as ``b*v**2``, and a spring that pushes, as ``-k*u``."""
    if members.model.kind != "oscillator":
        return
    for name, state in (("damping", "v"), ("spring", "u")):
        text = report.source.data["model"].get(name)
        names = {*(NAME.findall(text) if isinstance(text, str) else ())} - {*CONSTANTS}
        if state not in names:
            continue
        law, at = parse(str(text), names), {state: np.array([-1.0, 1.0, 2.0])}
        laws = [values_of([law], {**numbers, **at})[0] for numbers, _ in members.sampled(MEMBERS)]
        if name == "damping" and all(below == above != 0.0 for below, above, _ in laws):
            rule = "is the same for both signs of v, so it drives the motion half of the time"
            report.note(("model", name), rule, "v**2 that always brakes is abs(v)*v")
        elif name == "spring" and all(-a == b < 0.0 and c == 2.0 * b for a, b, c in laws):
            rule = "pushes away from u = 0"
            report.note(("model", name), rule, "a spring that pulls back is positive, as k*u")


def _warn_repeated(report: Report) -> None:
    """Warn about a repeated value in the list of a swept key: equal members, or a decimal comma."""
    section = report.source.data.get("sweep")
    if not isinstance(section, Mapping) or "follow" in section:
        return  # with `follow`, members with equal values differ in their start
    for key, values in section.items():
        listed = values if isinstance(values, list) else []
        numbers = Counter(x for x in listed if type(x) in (int, float))
        if twice := [x for x, count in numbers.items() if count > 1]:
            hint = "a number with a decimal comma becomes two: write 0.5"
            report.note(("sweep", key), f"has {twice[0]} more than once", hint)


def _warn_set_and_swept(report: Report) -> None:
    """Warn about a value of the command line without effect, because the file sweeps its key."""
    keys = {path[-1] for path, _ in swept_values(report.source.data.get("sweep"))}
    for text in report.source.settings:
        key = text.partition("=")[0].strip()
        if key in keys:
            hint = f"leave the sweep out by `--set sweep=`, or set `sweep.{key}`"
            report.note(tuple(key.split(".")), "has no effect, because it is swept", hint)


def _unitless_starts(data: Mapping[str, Any], name: str) -> Iterator[tuple[Path_, list[float]]]:
    """Yield the paths of an initial value, in its section and in the sweep, with the unitless numbers there."""
    start: tuple[Path_, Any] = ("initial", name), (data.get("initial") or {}).get(name)
    swept = (row for row in swept_values(data.get("sweep")) if row[0][-1] == f"initial.{name}")
    for path, value in (start, *swept):
        if isinstance(value, Mapping):
            # the first two numbers of a rule are values
            value = [x for rule in value.values() if isinstance(rule, list) for x in rule[:2]]
        entries = value if isinstance(value, list) else [value]
        if all(isinstance(x, int | float) and not isinstance(x, bool) for x in entries):
            yield path, [float(x) for x in entries]


def _warn_digits(path: Path_, name: str, number: float, report: Report) -> None:
    """Warn about an expected number of few digits without a tolerance."""
    place = report.source.place(path)
    if VALUES[name].measure == "count" or number == 0.0:
        return
    text = place.text if place and place.text else repr(number)
    try:
        digits = Decimal(text).as_tuple()
    except ArithmeticError:
        return  # a formula is exact
    assert isinstance(digits.exponent, int)
    if len(digits.digits) < EXACT_DIGITS:
        half = Decimal(5).scaleb(digits.exponent - 1)
        rule = "has no tolerance, and is compared to 1e-9 of it"
        report.note(path, rule, f"`atol: {float(half):g}` compares the digits that are written")
