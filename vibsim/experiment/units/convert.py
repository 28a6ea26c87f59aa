"""Numbers with units in the content of a file: replaced by numbers in the units of the model before any check.

What follows sees plain numbers alone. Units may stand where a model or the time has a unit: in ``model``, ``initial``,
``time`` and the values of ``sweep`` over those. A file without units does not load the registry.
"""

from __future__ import annotations

import keyword
import math
from collections.abc import Callable, Iterable, Mapping
from fractions import Fraction
from typing import Any

from vibsim.experiment.faults import Report
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


class Units:
    """The units of a file, with which its values become plain numbers."""

    def __init__(self, data: Mapping[str, Any], report: Report) -> None:
        self.report = report
        self.own: dict[str, Any] = {}
        """Units that the file defines."""
        self.broken: set[str] = set()
        """Names of units whose definition is refused; nothing is said about what is measured in them."""
        section = data.get("model")
        kind = section.get("kind") if isinstance(section, dict) else None
        self.wanted = _wanted(MODELS.get(kind) if isinstance(kind, str) else None)
        if isinstance(data.get("units"), dict):
            self._define_all(data["units"])

    @property
    def defined(self) -> dict[str, str]:
        """The units that the file defines, in SI base units."""
        return {name: f"{float(unit.factor):.10g} {unit.text}" for name, unit in self.own.items()}

    def plain(self, path: Path_, written: Any) -> tuple[Any, set[str | int]]:
        """Return what is written at `path` with numbers in place of those with units.

        Also return the keys or positions in it where something is refused, with a fault; 1 stands in for that. Where it
        is itself refused, `path` becomes one of the faulty places.
        """
        refused: set[str | int] = set()
        if path[0] not in ("model", "initial", "time", "sweep"):
            return written, refused
        entries: Iterable[tuple[str | int, Any]] = ()
        if isinstance(written, str):
            is_number = len(path) > 1 and (path[0] != "sweep" or isinstance(path[-1], int))
            return (self._plain_number(path, written) if is_number else written), refused
        if isinstance(written, dict):
            entries = written.items()
        elif isinstance(written, list) and path[0] == "sweep":
            # the last one is a count
            entries = enumerate(written[: 2 if path[-1] in ("linspace", "logspace") else None])
        others = [(key, value) for key, value in entries if not isinstance(value, float | int)]
        # with more of them the list is refused
        if not others or len(others) > MAX_FORMULAS:
            return written, refused
        found = written.copy()
        for key, value in others:
            found[key], inner = self.plain((*path, key), value)
            if inner or (*path, key) in self.report.faulty:
                refused.add(key)
        return found, refused

    def _plain_number(self, path: Path_, text: str) -> Any:
        keys = path if path[0] != "sweep" else [key for key in path if "." in str(key)][:1]
        wanted = self.wanted(".".join(map(str, keys)))
        if wanted is None:
            return text
        try:
            number = self.number(text, wanted)
        except UnitError as error:
            self._refuse(path, error, text)
            return _STAND_IN
        return text if number is None else number

    def _refuse(self, path: Path_, error: UnitError, text: object) -> None:
        """Note a fault; nothing more is said about its place."""
        if error.rule:
            self.report.add(path, error.rule, error.hint, text)
        self.report.faulty.add(path)

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

    def _define(self, name: str, value: Any) -> None:
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

    def _define_all(self, units: dict[str, Any]) -> None:
        if len(units) > MAX_OWN:
            rule = f"must not have more than {MAX_OWN} units, has {len(units)}"
            self._refuse(("units",), UnitError(rule), "")
            return
        for name, value in units.items():
            try:
                self._define(name, value)
            except UnitError as error:
                self._refuse(("units", name), error, value)
                self.broken.add(name)


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
