"""The units that a number may have, their meaning in SI base units, and conversion.

Their names are in a small pint registry, which is loaded at the first unit of a file. Text of a user never reaches
pint's expression evaluator: names are looked up one by one, and multiplied here in fractions, so ``250 g`` is the same
double as ``0.25``. Angle is a dimension: a hertz is not a radian per second.
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

MAX_POWER = 99  # largest exponent of a base unit
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
    powers: Mapping[str, int] = field(default_factory=dict)  # nonzero exponents of base units

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
