"""Numbers with units in the content of a file: replaced by numbers in the units of the model before all checks.

What follows sees plain numbers alone. Units may stand where a model or the time has a unit: in ``model``, ``initial``,
``time`` and the values of ``sweep`` over those. A file without units does not load the registry.
"""

from __future__ import annotations

import keyword
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

from vibsim.experiment.faults import Report
from vibsim.experiment.schema.axes import RULES
from vibsim.experiment.schema.fields import DECLARED, FORMULA_NOTE, MAX_FORMULAS, TABLE
from vibsim.experiment.schema.unit_text import NAME, UnitError, factors, split
from vibsim.experiment.yaml.parse import Path_
from vibsim.formula import CONSTANTS, FUNCTIONS, ExpressionError, constant
from vibsim.models import MODELS, Model

MAX_OWN = 50
"""Units of one file."""
ANY = ""
"""In place of a unit: any is right, and SI base units are what follows."""
UNKNOWN = "?"
"""In place of a unit: the key does not exist, which is said elsewhere, and the value does not count."""
_NO_NUMBERS = ("model.kind", "time.base_steps")
"""Keys of a name and of a count."""
_TIME = {"end": "s", "base_dt": "s", "periods": "1", "steps_per_period": "1"}
_STAND_IN = 1.0
"""Takes the place of what is refused, until it is taken out; nothing objects to it."""
Place = tuple[Any, Any, Path_, str]
"""A holder of text, the key or position in it, the place in the file, and the unit that is wanted."""


@dataclass
class Conversion:
    """The content of a file on its way to plain numbers."""

    report: Report
    own: dict[str, Any] = field(default_factory=dict)
    """Units that the file defines."""
    broken: set[str] = field(default_factory=set)
    """Names of units whose definition is refused; nothing is said about what is measured in them."""
    refused: list[Path_] = field(default_factory=list)

    def refuse(self, path: Path_, error: UnitError, text: object) -> None:
        """Note a fault; nothing more is said about its place."""
        if error.rule:
            self.report.add(path, error.rule, error.hint, text)
        self.report.faulty.add(path)
        self.refused.append(path)

    def number(self, text: str, wanted: str) -> float | None:
        """Return a number with a unit in the `wanted` one; None where it has no unit."""
        halves = split(text)
        if halves is None:
            return None
        if wanted == UNKNOWN:
            return _STAND_IN
        from vibsim.experiment.units.names import converted

        formula, unit = halves
        if any(factor.name in self.broken for factor in factors(unit)):
            raise UnitError("")
        return converted(_constant(formula), unit, wanted, self.own)

    def define(self, name: str, value: Any) -> None:
        """Add a unit of the file.

        Raises
        ------
        UnitError
            Where the name or the value cannot be that of a unit.
        """
        from vibsim.experiment.units.names import Unit, finite, meaning

        _check_name(name)
        halves = split(value) if isinstance(value, str) else None
        number = _constant(halves[0] if halves else value)
        unit = meaning(halves[1], self.own) if halves else Unit()
        factor = finite(Fraction(repr(number)) * unit.factor)
        if factor <= 0.0:
            raise UnitError("a unit must be greater than 0")
        self.own[name] = Unit(Fraction(repr(factor)), unit.powers)


def plain_numbers(data: Mapping[str, Any], report: Report) -> tuple[dict[str, Any], list[Path_]]:
    """Return `data` without units, and the places whose values are refused; 1 stands in for those.

    The units that the file defines are left as text, in SI base units.
    """
    conversion = Conversion(report)
    found = _copied(data)
    _define_all(found, conversion)
    for holder, key, path, wanted in list(_places(found)):
        value = holder[key]
        try:
            number = conversion.number(value, wanted)
        except UnitError as error:
            conversion.refuse(path, error, value)
            number = _STAND_IN
        if number is not None:
            holder[key] = number
    return found, conversion.refused


def _copied(data: Mapping[str, Any]) -> dict[str, Any]:
    """Return a copy whose numbers with units can be replaced; a list without text is the same list."""

    def copy(value: Any) -> Any:
        if isinstance(value, float | int | str):
            return value
        if isinstance(value, Mapping):
            return {key: copy(part) for key, part in value.items()}
        if isinstance(value, list) and not all(isinstance(part, float | int) for part in value):
            return [copy(part) for part in value]
        return value

    sections = ("units", "model", "initial", "time", "sweep")
    return {key: copy(value) if key in sections else value for key, value in data.items()}


def _define_all(data: dict[str, Any], conversion: Conversion) -> None:
    units = data.get("units")
    if not isinstance(units, dict):
        return
    if len(units) > MAX_OWN:
        rule = f"must not have more than {MAX_OWN} units, has {len(units)}"
        conversion.refuse(("units",), UnitError(rule), "")
        return
    for name, value in units.items():
        try:
            conversion.define(str(name), value)
        except UnitError as error:
            conversion.refuse(("units", str(name)), error, value)
            conversion.broken.add(str(name))
    data["units"] = {
        name: f"{float(unit.factor):.10g} {unit.text}" for name, unit in conversion.own.items()
    }


def _check_name(name: str) -> None:
    """Refuse names that mean something already, or that could not be told from what stands beside them."""
    from vibsim.experiment.units.names import known

    if not NAME.fullmatch(name) or keyword.iskeyword(name):
        raise UnitError("the name of a unit must consist of letters and _, and begin with a letter")
    if name in CONSTANTS or name in FUNCTIONS:
        what = "constant" if name in CONSTANTS else "function"
        raise UnitError(f"'{name}' is a {what} of formulas", "choose another name")
    try:
        is_taken = known(name) is not None
    except UnitError:
        is_taken = True
    if is_taken:
        raise UnitError(f"'{name}' is a unit already", "choose another name")


def _constant(value: Any) -> float:
    """Return the number before a unit."""
    if isinstance(value, bool) or not isinstance(value, str | int | float):
        raise UnitError("must be a number with a unit, such as 4.9 m")
    try:
        number = constant(value) if isinstance(value, str) else float(value)
    except ExpressionError as error:
        raise UnitError(
            f"must be {FORMULA_NOTE}, before its unit ({error.rule})", error.hint
        ) from None
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise UnitError("must be a finite number")
    return number


def _places(data: Mapping[str, Any]) -> Iterator[Place]:
    """Yield every place of a value that may have a unit."""
    section = data.get("model")
    kind = section.get("kind") if isinstance(section, dict) else None
    model = MODELS.get(kind) if isinstance(kind, str) else None
    wanted = _wanted(model)
    for name in ("model", "initial", "time"):
        yield from _values(data.get(name), (name,), name, wanted)
    sweep = data.get("sweep")
    if not isinstance(sweep, dict):
        return
    for key, written in sweep.items():
        if key == "zip" and isinstance(written, dict):
            for inner, values in written.items():
                yield from _swept(values, ("sweep", key, inner), wanted(inner))
        elif key == "sample" and isinstance(written, dict):
            over = written.get("over")
            for inner, values in over.items() if isinstance(over, dict) else ():
                yield from _listed(values, ("sweep", key, "over", inner), wanted(inner))
        else:
            yield from _swept(written, ("sweep", key), wanted(key))


def _wanted(model: Model | None) -> Callable[[str], str | None]:
    """Return what tells the unit of a dotted key; None where the value is no number."""
    units = {f"time.{name}": unit for name, unit in _TIME.items()}
    formulas: set[str] = set()
    if model is not None:
        units |= {f"initial.{state.name}": state.unit for state in model.states}
        units |= {f"model.{row.key}": row.unit for row in model.parameters}
        for row in model.formulas:
            units |= {f"model.{row.name}.{word}": unit for word, unit in row.term_units.items()}
        formulas = {f"model.{row.name}" for row in model.formulas}
        tables = [(f"model.{row.name}", row.table) for row in model.formulas if row.table]
        formulas |= {f"{key}.{name}" for key, names in tables for name in (TABLE, *names)}

    def wanted(key: str) -> str | None:
        if key.startswith("schemes.") or key in _NO_NUMBERS or key in formulas:
            return None
        is_declared = bool(formulas) and key.startswith(f"model.{DECLARED}.")
        return units.get(key, ANY if is_declared else UNKNOWN)

    return wanted


def _values(
    section: Any, path: Path_, key: str, wanted: Callable[[str], str | None]
) -> Iterator[Place]:
    """Yield the values of a section, and those of the mappings in it."""
    for name, value in section.items() if isinstance(section, dict) else ():
        if isinstance(value, dict):
            yield from _values(value, (*path, name), f"{key}.{name}", wanted)
        elif isinstance(value, str):
            unit = wanted(f"{key}.{name}")
            if unit is not None:
                yield section, name, (*path, name), unit


def _swept(written: Any, path: Path_, unit: str | None) -> Iterator[Place]:
    """Yield the values of one key of a sweep, however they are given."""
    if isinstance(written, dict):
        for rule in RULES:
            values = written.get(rule)
            # the last one is a count
            last = 2 if rule in ("linspace", "logspace") else None
            yield from _listed(values, (*path, rule), unit, last)
    else:
        yield from _listed(written, path, unit)


def _listed(values: Any, path: Path_, unit: str | None, last: int | None = None) -> Iterator[Place]:
    if unit is None or not isinstance(values, list):
        return
    texts = [i for i, value in enumerate(values[:last]) if isinstance(value, str)]
    # with more of them the list is refused
    if len(texts) <= MAX_FORMULAS:
        yield from ((values, i, (*path, i), unit) for i in texts)
