"""Convert numbers with units in the content of a file to plain numbers in the units of the model.

The conversion precedes all rules, which see plain numbers only. Units are valid where the model or the time has a unit:
in ``model``, ``initial``, ``time``, and values of ``sweep`` over those. The units themselves are in
`vibsim.experiment.known_units`.
"""

from __future__ import annotations

import keyword
import math
from collections.abc import Iterable, Mapping
from fractions import Fraction
from typing import Any

from vibsim.experiment.faults import Report
from vibsim.experiment.known_units import Unit, converted, finite, meaning, unit_named
from vibsim.experiment.schema.fields import AT, DECLARED, FORMULA_NOTE, MAX_FORMULAS, TABLE
from vibsim.experiment.schema.structure import LoadTable
from vibsim.experiment.schema.unit_text import NAME, UnitError, factors, split
from vibsim.experiment.tables import file, matrix
from vibsim.experiment.yaml.parse import Path_
from vibsim.formula import CONSTANTS, FUNCTIONS, ExpressionError, constant
from vibsim.models import Model

MAX_OWN = 50  # largest number of units defined in one file
_ANY = ""  # marks a key that accepts any unit; the value is converted to SI base units
FILE_ENDINGS = (*matrix.ENDINGS, *file.ENDINGS)  # endings of the files that a structure may name
_UNKNOWN = "?"  # marks a key that does not exist, which is reported elsewhere
_STAND_IN = 1.0  # temporary placeholder for a refused value; valid everywhere


class Units:
    """The units of a file, and the conversion of its values to plain numbers."""

    def __init__(self, data: Mapping[str, Any], report: Report) -> None:
        self.report = report
        self.own: dict[str, Any] = {}
        """Units that the file defines."""
        self.broken: set[str] = set()
        """Names of units with a faulty definition; values in these units are not reported."""
        self.model = report.kinds.model_of(data.get("model"))
        self.units, self.texts = _wanted_units(self.model)
        if isinstance(data.get("units"), dict):
            self._define_all(data["units"])

    @property
    def defined(self) -> dict[str, str]:
        """The units that the file defines, in SI base units."""
        return {name: f"{float(unit.factor):.10g} {unit.text}" for name, unit in self.own.items()}

    @property
    def _is_structure(self) -> bool:
        return self.model is not None and self.model.loaded is not None

    def plain(self, path: Path_, written: Any) -> tuple[Any, set[str | int]]:
        """Return the value at `path` with plain numbers in place of those with units.

        Also return the keys or positions inside it that are refused, each with a fault and replaced by 1. If the value
        itself is refused, `path` is added to `report.faulty`.
        """
        refused: set[str | int] = set()
        if _is_swept_value(path) and isinstance(written, str):
            return self._plain_number(path, written), refused
        if path[0] not in ("model", "initial", "time", "sweep"):
            return written, refused
        entries: Iterable[tuple[str | int, Any]] = ()
        if isinstance(written, str):
            is_number = len(path) > 1 and (path[0] != "sweep" or isinstance(path[-1], int))
            return (self._plain_number(path, written) if is_number else written), refused
        if isinstance(written, dict):
            entries = written.items()
        elif isinstance(written, list) and (path[0] == "sweep" or self._is_structure):
            # the last entry is a count
            entries = enumerate(written[: 2 if path[-1] in ("linspace", "logspace") else None])
        others = [(key, value) for key, value in entries if not isinstance(value, float | int)]
        # longer lists are refused by validation
        if not others or len(others) > MAX_FORMULAS:
            return written, refused
        found = written.copy()
        for key, value in others:
            found[key], inner = self.plain((*path, key), value)
            if inner or (*path, key) in self.report.faulty:
                refused.add(key)
        return found, refused

    def _plain_number(self, path: Path_, text: str) -> Any:
        is_member = path[0] == "sweep" or _is_swept_value(path)
        keys = [key for key in path if "." in str(key)][:1] if is_member else path
        key = ".".join(map(str, keys))
        is_below = f"{key.rpartition('.')[0]}.*"
        if key.startswith(("schemes.", "model.events.")) or {key, is_below} & self.texts:
            return text
        has_formulas = self.model is not None and bool(self.model.formulas)
        is_declared = has_formulas and key.startswith(f"model.{DECLARED}.")
        is_any = is_declared or (self._is_structure and key.startswith(("model.", "initial.")))
        wanted = self.units.get(key, _ANY if is_any else _UNKNOWN)
        halves = split(text)
        if halves is None or (self._is_structure and _is_name_or_formula(path, text, halves[1])):
            return text
        try:
            if wanted == _UNKNOWN:
                return _STAND_IN
            if any(factor.name in self.broken for factor in factors(halves[1])):
                raise UnitError("")
            return converted(_constant(halves[0]), halves[1], wanted, self.own)
        except UnitError as error:
            self._refuse(path, error, text)
            return _STAND_IN

    def _refuse(self, path: Path_, error: UnitError, text: object) -> None:
        """Report a fault, and suppress further ones at its path."""
        if error.rule:
            self.report.add(path, error.rule, error.hint, text)
        self.report.faulty.add(path)

    def _define_all(self, units: dict[str, Any]) -> None:
        if len(units) > MAX_OWN:
            rule = f"must not have more than {MAX_OWN} units, has {len(units)}"
            self._refuse(("units",), UnitError(rule), "")
            return
        for name, value in units.items():
            try:
                _check_name(name)
                halves = split(value) if isinstance(value, str) else None
                number = _constant(halves[0] if halves else value)
                unit = meaning(halves[1], self.own) if halves else Unit()
                factor = finite(Fraction(repr(number)) * unit.factor)
                if factor <= 0.0:
                    raise UnitError("a unit must be greater than 0")
                self.own[name] = Unit(Fraction(repr(factor)), unit.powers)
            except UnitError as error:
                self._refuse(("units", name), error, value)
                self.broken.add(name)


def _is_swept_value(path: Path_) -> bool:
    """Tell whether `path` is a swept value in a check or a printed number: ``checks[0].at.model.omega``."""
    return path[0] in ("checks", "published") and path[-2:-1] == ("at",) and "." in str(path[-1])


def _check_name(name: str) -> None:
    """Refuse names that already have a meaning, or are ambiguous in a formula."""
    if not NAME.fullmatch(name) or keyword.iskeyword(name):
        raise UnitError("the name of a unit must consist of letters and _, and begin with a letter")
    if name in CONSTANTS or name in FUNCTIONS:
        what = "constant" if name in CONSTANTS else "function"
        raise UnitError(f"'{name}' is a {what} of formulas", "choose another name")
    if unit_named(name) is not None:
        raise UnitError(f"'{name}' is a unit already", "choose another name")


def _is_name_or_formula(path: Path_, text: str, after_number: str) -> bool:
    """Tell whether a text of a structure that begins like a number with a unit is a name or a formula of the time t.

    Names are those of files, such as ``frame 2 m.csv``, and of the columns of a load table.
    """
    if text.lower().endswith(FILE_ENDINGS) or (
        len(path) > 3 and path[-1] in LoadTable.model_fields
    ):
        return True
    try:
        has_time = any(factor.name == "t" for factor in factors(after_number))
    except UnitError:
        has_time = True
    return path[:2] == ("model", "load") and has_time


def _constant(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, str | int | float):
        raise UnitError("must be a number with a unit, such as 4.9 m")
    try:
        number = constant(value) if isinstance(value, str) else float(value)
    except ExpressionError as error:
        rule = f"must be {FORMULA_NOTE}, before its unit ({error.rule})"
        raise UnitError(rule, error.hint) from None
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise UnitError("must be a finite number")
    return number


def _wanted_units(model: Model | None) -> tuple[dict[str, str], set[str]]:
    """Return the units by dotted key, and the keys without units: names, formulas and counts.

    A key that ends with ``.*`` stands for all keys below it.
    """
    units = {"time.end": "s", "time.base_dt": "s"}
    units |= {"time.periods": "1", "time.steps_per_period": "1"}
    texts = {"model.kind", "model.stop", "time.base_steps"}
    if model is None:
        return units, texts
    units |= {f"initial.{state.name}": state.unit for state in model.states}
    units |= {f"model.{row.key}": row.unit for row in model.parameters}
    if model.named is not None or model.loaded is not None:
        # equations of the file alone, which are consistent in any units
        units |= {key: _ANY for key in units if not key.startswith("time.")}
    for row in model.formulas:
        key = f"model.{row.name}"
        units |= {f"{key}.{word}": unit for word, unit in row.term_units.items()}
        texts |= {key, *(f"{key}.{name}" for name in (TABLE, AT, *(row.table or ())))}
        texts |= {f"{key}.*"} if row.of else set()
    return units, texts
