"""Values that are allowed, and that hardly anybody means: each gets a note, and the experiment goes on."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from decimal import Decimal
from typing import Any

from vibsim.experiment.faults import Report
from vibsim.experiment.rules.size_limits import Setting
from vibsim.experiment.schema.checks import AccurateCheck, Check, ConvergesCheck, ValueCheck
from vibsim.experiment.value_names import OF_THE_SAME_KIND, VALUES
from vibsim.experiment.yaml.parse import Path_
from vibsim.formula import Binary, Call, Name, walk
from vibsim.models import Model, tree

TURN = 2.0 * math.pi
EXACT_DIGITS = 9
"""Numbers that are written with so many digits are meant to be compared to 1e-9 of them."""


def note_unlikely(checks: Sequence[Check | None], setting: Setting, report: Report) -> None:
    """Note what a file says and probably does not mean; `checks` as written, None for a malformed one."""
    _angles(setting, report)
    _repeated(report)
    _set_and_swept(report)
    for i, check in enumerate(checks):
        if check is None:
            continue
        inner = check.measured
        path: Path_ = ("checks", i) if inner is check else ("checks", i, "that")
        match inner:
            case AccurateCheck(relative=float(part)) if part >= 1.0:
                rule = f"is {part:g} times the size of {inner.accurate}, which nearly everything is below"
                report.note((*path, "relative"), rule, f"{part:g} percent are {part / 100:g}")
            case ConvergesCheck(order=float(order)) if inner.tolerance >= order:
                rule = f"lets every order up to {order + inner.tolerance:g} pass"
                report.note((*path, "tolerance"), rule, "it is a distance of orders, such as 0.1")
            case ConvergesCheck() if (
                len(setting.levels) in (1, 2) and inner.expect.status == "PASS"
            ):
                rule = f"{len(setting.levels)} of them decide no order"
                report.note(("levels",), rule, "three are needed, and four are better")
            case ValueCheck(equals=float(number), rtol=None, atol=None) if (
                inner.take in OF_THE_SAME_KIND
            ):
                _digits((*path, "equals"), inner.value, number, report)


def _angles(setting: Setting, report: Report) -> None:
    """Note angles of more than a turn that are plain numbers: they are in rad, and degrees may be meant."""
    model = setting.model
    if model is None:
        return
    turned = set(_turned(model)) if model.dimensionless else set()
    for state in model.states:
        if state.unit != "rad" and state.name not in turned:
            continue
        for path, values in _plain(report.source.data, state.name):
            largest = max(map(abs, values), default=0.0)
            if largest > TURN:
                rule = f"{largest:g} rad are {largest / TURN:.2g} turns"
                report.note(path, rule, f"{largest:g} degrees are written `{largest:g} degree`")


def _repeated(report: Report) -> None:
    """Note a value that the list of a swept key has twice: its members are the same, or a decimal comma is meant."""
    section = report.source.data.get("sweep")
    if not isinstance(section, Mapping) or "follow" in section:
        # a member that begins where another one ended is not the same again
        return
    for key, values in section.items():
        listed = values if isinstance(values, list) else []
        numbers = Counter(x for x in listed if type(x) in (int, float))
        if twice := [x for x, count in numbers.items() if count > 1]:
            hint = "a number with a decimal comma becomes two: write 0.5"
            report.note(("sweep", key), f"has {twice[0]} more than once", hint)


def _set_and_swept(report: Report) -> None:
    """Note a value of the command line that no member has, because the file sweeps its key."""
    keys: set[str] = set()
    for part in ((), ("zip",), ("sample", "over")):
        section = _part(report.source.data, ("sweep", *part))
        keys |= set(section) if isinstance(section, Mapping) else set()
    for text in report.source.settings:
        key = text.partition("=")[0].strip()
        if key in keys:
            hint = f"leave the sweep out by `--set sweep=`, or set `sweep.{key}`"
            report.note(tuple(key.split(".")), "has no effect, because it is swept", hint)


def _turned(model: Model) -> Iterator[str]:
    """Yield the coordinates that are angles where none has a unit: a sine or a cosine of them, or of two, is taken."""
    for formula in model.accelerations:
        for part in walk(tree(model, formula)):
            if isinstance(part, Call) and part.function in ("sin", "cos"):
                (angle,) = part.arguments
                sides = (
                    angle.operands if isinstance(angle, Binary) and angle.operator in "+-" else ()
                )
                yield from (side.name for side in sides or (angle,) if isinstance(side, Name))


def _part(found: Any, path: Path_) -> Any:
    """Return what stands at a place of the content of a file; None where nothing does."""
    for key in path:
        found = found.get(key) if isinstance(found, Mapping) else None
    return found


def _plain(data: Mapping[str, Any], name: str) -> Iterator[tuple[Path_, list[float]]]:
    """Yield the places of an initial value, in its section and in the sweep, with what are plain numbers there."""
    for path in (
        ("initial", name),
        ("sweep", f"initial.{name}"),
        ("sweep", "zip", f"initial.{name}"),
        ("sweep", "sample", "over", f"initial.{name}"),
    ):
        found = _part(data, path)
        if isinstance(found, Mapping):
            # of a rule the first two numbers are values
            found = [x for rule in found.values() if isinstance(rule, list) for x in rule[:2]]
        entries = found if isinstance(found, list) else [found]
        if all(isinstance(x, int | float) and not isinstance(x, bool) for x in entries):
            yield path, [float(x) for x in entries]


def _digits(path: Path_, name: str, number: float, report: Report) -> None:
    """Note a measured number of few digits without a tolerance."""
    row, place = VALUES.get(name), report.source.place(path)
    if row is None or row.measure == "count" or number == 0.0:
        return
    text = place.text if place and place.text else repr(number)
    try:
        last = Decimal(text).as_tuple()
    except ArithmeticError:
        # a formula is meant exactly
        return
    assert isinstance(last.exponent, int)
    if len(last.digits) < EXACT_DIGITS:
        half = Decimal(5).scaleb(last.exponent - 1)
        rule = "has no tolerance, and is compared to 1e-9 of it"
        report.note(path, rule, f"`atol: {float(half):g}` compares the digits that are written")
