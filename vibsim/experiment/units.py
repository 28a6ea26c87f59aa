"""Convert numbers with units in the content of a file to plain numbers in the units of the model.

The conversion precedes all rules, which see plain numbers only. Units are valid where the model or the time has a unit:
in ``model``, ``initial``, ``time``, and values of ``sweep`` over those. Their names are in a small pint registry, which
is loaded at the first unit of a file. Text of a user never reaches pint's expression evaluator: names are looked up one
by one, and multiplied here in fractions, so ``250 g`` is the same double as ``0.25``. Angle is a dimension: a hertz is
not a radian per second.
"""

from __future__ import annotations

import keyword
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cache
from types import MappingProxyType
from typing import Any

from vibsim.core.errors import nearest
from vibsim.experiment.faults import Report
from vibsim.experiment.schema.fields import AT, DECLARED, FORMULA_NOTE, MAX_FORMULAS, TABLE
from vibsim.experiment.schema.structure import LoadTable
from vibsim.experiment.schema.unit_text import NAME, UnitError, factors, split
from vibsim.experiment.tables import file, matrix
from vibsim.experiment.yaml.parse import Path_
from vibsim.formula import CONSTANTS, FUNCTIONS, ExpressionError, constant
from vibsim.models import Model

MAX_OWN = 50
"""Largest number of units defined in one file."""
MAX_POWER = 99
"""Largest exponent of a base unit."""
_ANY = ""
"""Marks a key that accepts any unit; the value is converted to SI base units."""
FILE_ENDINGS = (*matrix.ENDINGS, *file.ENDINGS)
"""Endings of the files that a structure may name."""
_UNKNOWN = "?"
"""Marks a key that does not exist, which is reported elsewhere."""
_STAND_IN = 1.0
"""Temporary placeholder for a refused value; valid everywhere."""


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


DEFINITIONS = """\
tera- = 1e12 = T-
giga- = 1e9 = G-
mega- = 1e6 = M-
kilo- = 1e3 = k-
deci- = 1e-1 = d-
centi- = 1e-2 = c-
milli- = 1e-3 = m-
micro- = 1e-6 = \u00b5- = \u03bc- = u-
nano- = 1e-9 = n-
pico- = 1e-12 = p-
metre = [length] = m = meter
second = [time] = s = sec
gram = [mass] = g
ampere = [current] = A
kelvin = [temperature] = K
radian = [angle] = rad
turn = 6.283185307179586476925286766559005768394 * radian = _ = revolution
degree = 0.01745329251994329576923690768488612713443 * radian = deg = \u00b0
minute = 60 * second = min
hour = 3600 * second = h
day = 86400 * second
revolution_per_minute = turn / minute = rpm
hertz = 1 / second = Hz
newton = 1000 * gram * metre / second ** 2 = N
pascal = newton / metre ** 2 = Pa
bar = 100000 * pascal
joule = newton * metre = J
watt = joule / second = W
coulomb = ampere * second = C
volt = joule / coulomb = V
ohm = volt / ampere = \u03a9 = \u2126
farad = coulomb / volt = F
henry = volt * second / ampere = H
tonne = 1000000 * gram = t
percent = 0.01 = %
"""
"""Definitions of units, in the notation of pint."""
_OFFERED = """
m km cm mm kg g s ms min h day rad deg turn rpm Hz N kN Pa J W A V C ohm F H K t % percent
metre meter gram second minute hour sec radian degree newton joule
"""
"""Names that messages suggest in place of an unknown unit."""
_WORDS = """
1: a plain number; m: a length; s: a time; kg: a mass; rad: an angle; m s-1: a velocity
m s-2: an acceleration; rad s-1: an angular velocity; rad s-2: an angular acceleration; s-1: a frequency
N: a force; J: an energy; W: a power; Pa: a pressure; N m-1: a stiffness; kg s-1: a linear damping
kg m-1: a quadratic damping; m2: an area; m3: a volume; kg m2: a moment of inertia; kg m-3: a density
A: a current; V: a voltage; C: a charge; ohm: a resistance; F: a capacitance; H: an inductance
K: a temperature
"""
"""Names of quantities by unit, for messages."""
_DIMENSIONS = ("[angle]", "[mass]", "[length]", "[time]", "[current]", "[temperature]")
_SYMBOLS = dict(zip(_DIMENSIONS, ("rad", "kg", "m", "s", "A", "K"), strict=True))
"""The base unit of every dimension, in the order of messages."""


@dataclass(frozen=True)
class Unit:
    """A unit in SI base units and radians."""

    factor: Fraction = Fraction(1)
    powers: Mapping[str, int] = field(default_factory=dict)
    """Nonzero exponents of the base units, by symbol."""

    @property
    def text(self) -> str:
        """The unit in base units, as models write it: ``kg m s-2``, ``1``."""
        parts = (
            symbol + (str(self.powers[symbol]) if self.powers[symbol] != 1 else "")
            for symbol in _SYMBOLS.values()
            if symbol in self.powers
        )
        return " ".join(parts) or "1"

    @property
    def words(self) -> str:
        """The quantity measured in the unit: ``a length``."""
        return _words().get(self.text, f"a quantity in {self.text}")

    def fits(self, wanted: Unit) -> bool:
        """Whether a number with this unit is valid where `wanted` is expected; an angle counts as plain radians."""
        return self.powers == wanted.powers or (not wanted.powers and self.powers == {"rad": 1})

    def times(self, other: Unit, exponent: int) -> Unit:
        """Return the product with a power of another unit."""
        powers = dict(self.powers)
        for symbol, power in other.powers.items():
            powers[symbol] = powers.get(symbol, 0) + power * exponent
            if abs(powers[symbol]) > MAX_POWER:
                raise UnitError(f"has an exponent of {symbol} above {MAX_POWER}")
        kept = {symbol: power for symbol, power in powers.items() if power}
        return Unit(self.factor * other.factor**exponent, kept)


@cache
def _words() -> Mapping[str, str]:
    rows = (pair.split(": ") for pair in _WORDS.strip().replace("\n", "; ").split("; "))
    return {meaning(unit).text: words for unit, words in rows}


@cache
def registry() -> Any:
    """Return the pint registry of `DEFINITIONS`, with exact fractions."""
    import pint

    found: Any = pint.UnitRegistry(None, non_int_type=Fraction, on_redefinition="raise")
    found.load_definitions(DEFINITIONS.splitlines())
    return found


@cache
def unit_named(name: str) -> Unit | None:
    """Return the unit of a name, with or without a prefix; None if there is none."""
    found = registry().parse_unit_name(name)
    if not found:
        return None
    prefix, base, _ = found[0]
    factor, _ = registry().get_root_units(prefix + base)
    dimensions = registry().get_dimensionality(prefix + base)
    powers = {_SYMBOLS[name]: int(power) for name, power in dimensions.items()}
    # pint's root unit of mass is the gram
    return Unit(Fraction(factor) / 1000 ** powers.get("kg", 0), powers)


def meaning(text: str, own: Mapping[str, Unit] = MappingProxyType({})) -> Unit:
    """Return the unit of a text; `own` holds the units that a file defines. Raises `UnitError` for an unknown unit."""
    unit = Unit()
    for factor in factors(text) if text != "1" else ():
        named = own.get(factor.name) or unit_named(factor.name)
        if named is None:
            choices = [*own, *_OFFERED.split()]
            alike = [choice for choice in choices if choice.lower() == factor.name.lower()]
            hint = f"did you mean '{alike[0]}'?" if alike else nearest(factor.name, choices)
            raise UnitError(f"unknown unit '{factor.name}'", hint)
        unit = unit.times(named, factor.exponent)
    return unit


def converted(number: float, text: str, wanted: str, own: Mapping[str, Unit]) -> float:
    """Return a number with unit `text` converted to the unit `wanted`, correctly rounded.

    The number stands for its shortest decimal representation: 0.3 is three tenths. An empty `wanted` means SI base
    units. Raises `UnitError` if the dimensions differ, or the result is too large.
    """
    unit = meaning(text, own)
    target = meaning(wanted) if wanted else Unit(powers=unit.powers)
    if not unit.fits(target):
        shown = f" [{wanted}]" if wanted != "1" and target.text in _words() else ""
        is_rate = (target.text, unit.text) == ("rad s-1", "s-1")
        hint = "1 Hz is 2*pi rad/s" if is_rate else ""
        raise UnitError(f"must be {target.words}{shown}, but {text} is {unit.words}", hint)
    return finite(Fraction(repr(number)) * unit.factor / target.factor)


def finite(number: Fraction) -> float:
    """Return `number` as a float; raise `UnitError` if it is too large."""
    try:
        return float(number)
    except OverflowError:
        raise UnitError("must be a finite number") from None
