"""What the names of units mean: a small registry of pint's, loaded when the first unit of a file is met.

Text of a user never reaches pint's expression evaluator: single names are looked up, and what they stand for is
multiplied here, in fractions, so that ``250 g`` is the same double as ``0.25``. Angles are a dimension of their own: a
hertz is no radian per second.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cache
from types import MappingProxyType
from typing import Any

from vibsim.core.errors import nearest
from vibsim.experiment.schema.unit_text import UnitError, factors

MAX_POWER = 99
"""Largest exponent of a base unit."""

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
degree_Celsius = kelvin; offset: 273.15 = degC = celsius
degree_Fahrenheit = 5 / 9 * kelvin; offset: 255.372222 = degF = fahrenheit
"""
"""In the notation of pint's definition files."""
_OFFERED = """
m km cm mm kg g s ms min h day rad deg turn rpm Hz N kN Pa J W A V C ohm F H K t % percent
metre meter gram second minute hour radian degree newton joule
"""
"""What a message offers in place of an unknown name."""
_WORDS = {
    "1": "a plain number",
    "m": "a length",
    "s": "a time",
    "kg": "a mass",
    "rad": "an angle",
    "m s-1": "a velocity",
    "m s-2": "an acceleration",
    "rad s-1": "an angular velocity",
    "rad s-2": "an angular acceleration",
    "s-1": "a frequency",
    "N": "a force",
    "J": "an energy",
    "W": "a power",
    "Pa": "a pressure",
    "N m-1": "a stiffness",
    "kg s-1": "a linear damping",
    "kg m-1": "a quadratic damping",
    "m2": "an area",
    "m3": "a volume",
    "kg m2": "a moment of inertia",
    "kg m-3": "a density",
    "A": "a current",
    "V": "a voltage",
    "C": "a charge",
    "ohm": "a resistance",
    "F": "a capacitance",
    "H": "an inductance",
    "K": "a temperature",
}
"""What has these units, for messages."""
_SYMBOLS = {
    "[angle]": "rad",
    "[mass]": "kg",
    "[length]": "m",
    "[time]": "s",
    "[current]": "A",
    "[temperature]": "K",
}
"""The base unit of every dimension, in the order of messages."""
_OFFSET = ("degree_Celsius", "degree_Fahrenheit")


@dataclass(frozen=True)
class Unit:
    """A unit in SI base units and radians."""

    factor: Fraction = Fraction(1)
    powers: Mapping[str, int] = field(default_factory=dict)
    """Exponents of the base units by their symbols, none of them 0."""

    @property
    def text(self) -> str:
        """The base units as in models: ``kg m s-2``, ``1``."""
        parts = (
            symbol + (str(self.powers[symbol]) if self.powers[symbol] != 1 else "")
            for symbol in _SYMBOLS.values()
            if symbol in self.powers
        )
        return " ".join(parts) or "1"

    @property
    def words(self) -> str:
        """What is measured in it: ``a length``."""
        return _words().get(self.text, f"a quantity in {self.text}")

    def fits(self, wanted: Unit) -> bool:
        """Whether a number with this unit may stand where `wanted` is: an angle may be a plain number, its radians."""
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
    return {meaning(text).text: words for text, words in _WORDS.items()}


@cache
def registry() -> Any:
    """Return pint's registry of the units above, in exact fractions."""
    import pint

    found: Any = pint.UnitRegistry(None, non_int_type=Fraction, on_redefinition="raise")
    found.load_definitions(DEFINITIONS.splitlines())
    return found


@cache
def known(name: str) -> Unit | None:
    """Return the unit of one name, with or without a prefix; None where there is none.

    Raises
    ------
    UnitError
        Where its zero is not that of the base unit, so that it cannot be a factor.
    """
    found = registry().parse_unit_name(name)
    if not found:
        return None
    prefix, base, _ = found[0]
    if base in _OFFSET:
        rule = f"'{name}' is measured from a zero of its own, and cannot be part of a unit"
        raise UnitError(rule, "write K")
    factor, _ = registry().get_root_units(prefix + base)
    dimensions = registry().get_dimensionality(prefix + base)
    powers = {_SYMBOLS[name]: int(power) for name, power in dimensions.items()}
    # pint's root unit of a mass is the gram
    return Unit(Fraction(factor) / 1000 ** powers.get("kg", 0), powers)


def meaning(text: str, own: Mapping[str, Unit] = MappingProxyType({})) -> Unit:
    """Return what a unit is; `own` holds the names that a file defines.

    Raises
    ------
    UnitError
        Where the text is no unit, or names one that does not exist.
    """
    unit = Unit()
    for factor in factors(text) if text != "1" else ():
        named = own.get(factor.name) or known(factor.name)
        if named is None:
            raise UnitError(f"unknown unit '{factor.name}'", _hint(factor.name, own))
        unit = unit.times(named, factor.exponent)
    return unit


def _hint(name: str, own: Mapping[str, Unit]) -> str:
    choices = [*own, *_OFFERED.split()]
    alike = [choice for choice in choices if choice.lower() == name.lower()]
    return f"did you mean '{alike[0]}'?" if alike else nearest(name, choices)


def converted(number: float, text: str, wanted: str, own: Mapping[str, Unit]) -> float:
    """Return a number with the unit `text` in the unit `wanted`, correctly rounded.

    The number counts as the shortest decimal that is read as it: 0.3 is three tenths. Where nothing particular is
    `wanted`, it is returned in SI base units.

    Raises
    ------
    UnitError
        Where the two are of different kinds, or the number is too large.
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
    """Return `number` as a float.

    Raises
    ------
    UnitError
        Where it is too large.
    """
    try:
        return float(number)
    except OverflowError:
        raise UnitError("must be a finite number") from None
