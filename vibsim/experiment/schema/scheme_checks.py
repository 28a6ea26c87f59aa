"""Checks of how schemes behave: stable or not, how the energy drifts, equal to each other or to a known solution."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal, Self

from pydantic import Field, StrictBool

from vibsim.experiment.schema.fields import GivenId, Index, Level, NonNegative, Section, Text

Drift = Literal["none", "bounded", "linear", "quadratic"]
SOLUTIONS = ("exact", "discrete")
"""What a scheme may be compared with beside another scheme; no scheme has such a name."""

_Names = Annotated[tuple[Text, ...], Field(min_length=1)]


class MeasuringCheck(Section):
    """What every check that measures something has."""

    id: GivenId = ""
    """Name of the check, unique in the file; `check_1` and so on when left out."""

    @property
    def measured(self) -> Self:
        """The check that is measured: this one."""
        return self

    @property
    def about(self) -> str | None:
        """The quantity that must be known over time."""
        return None


class StableCheck(MeasuringCheck):
    """The amplitude does not grow without bound, or it does."""

    kind: ClassVar[Literal["stable"]] = "stable"
    stable: StrictBool
    """Whether the schemes must be stable."""
    schemes: _Names | None = None
    """Names of the schemes; every scheme when left out."""
    level: Level | None = None
    """A level; the finest one when left out."""
    case: Index | None = None
    """Index of a member of the sweep, from 0; every one when left out."""


class ConservesCheck(MeasuringCheck):
    """The error of the energy has a kind of growth with time."""

    kind: ClassVar[Literal["conserves"]] = "conserves"
    conserves: Literal["energy", "energy_d2t"]
    """`energy` by the scheme's own velocity, or `energy_d2t` by the centred difference of the position."""
    drift: Drift = "none"
    """How the largest error so far grows: not at all (round-off), bounded, like t, or like t^2."""
    schemes: _Names | None = None
    """Names of the schemes; every scheme when left out."""
    level: Level | None = None
    """A level; the finest one when left out."""
    case: Index | None = None
    """Index of a member of the sweep, from 0; every one when left out."""

    @property
    def about(self) -> str | None:
        """The quantity that must be known over time."""
        return self.conserves.replace("energy", "energy_deviation")


class EqualCheck(MeasuringCheck):
    """The solution of a scheme is that of another one, or a known one, at every stored time."""

    kind: ClassVar[Literal["equal"]] = "equal"
    equal: tuple[Text, Text]
    """A scheme, and what it must equal: another scheme, `exact`, or `discrete`, the exact solution of its own steps."""
    quantity: Text
    """The quantity that is compared."""
    atol: NonNegative | None = None
    """How far apart they may be; derived from the number of steps and the machine precision when left out."""
    level: Level | None = None
    """A level; the finest one when left out."""
    case: Index | None = None
    """Index of a member of the sweep, from 0; every one when left out."""

    @property
    def about(self) -> str | None:
        """The quantity that must be known over time."""
        return self.quantity

    @property
    def first(self) -> str:
        """The scheme that is compared."""
        return self.equal[0]

    @property
    def second(self) -> str:
        """What it must equal: a scheme, or one of `SOLUTIONS`."""
        return self.equal[1]
