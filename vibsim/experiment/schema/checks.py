"""What a file may claim about its outcome: the checks, as written and as used."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Self

from pydantic import BeforeValidator, ConfigDict, Discriminator, Field, StrictBool, WithJsonSchema
from pydantic_core import PydanticCustomError

from vibsim.core.errors import likely
from vibsim.core.vocabulary import ORDER_TOLERANCE, REASONS, TYPICAL_NORM, Norm, Status
from vibsim.experiment.schema.citation import Citation
from vibsim.experiment.schema.fields import (
    MAX_LEVEL,
    STAND_IN,
    GivenId,
    Index,
    Level,
    NonNegative,
    Number,
    Positive,
    Section,
    Text,
    number,
    refused,
    tag,
    tagged,
    whole,
)
from vibsim.experiment.value_names import MOST_EVENTS, VALUES, Take, Value

Drift = Literal["none", "bounded", "linear", "quadratic"]
SOLUTIONS = ("exact", "discrete")
"""What a scheme may be compared with beside another scheme; no scheme has such a name."""

_EVERY_SCHEME = "Names of the schemes; every scheme when left out."
_Schemes = Annotated[
    Annotated[tuple[Text, ...], Field(min_length=1)] | None, Field(description=_EVERY_SCHEME)
]
_Level = Annotated[Level | None, Field(description="A level; the finest one when left out.")]
_EVERY_CASE = "Index of a member of the sweep, from 0; every one when left out."
_Case = Annotated[Index | None, Field(description=_EVERY_CASE)]


class Expect(Section):
    """The verdict that a check should get."""

    stand_ins = MappingProxyType({})

    status: Status = "PASS"
    """The expected status."""
    reason: Annotated[str, Field(json_schema_extra={"enum": list(REASONS)})] | None = None
    """The expected reason; any reason when left out."""


def _swept_value(value: Any) -> Any:
    """Return a swept value as a sweep has it: a number, also of a formula, or the word of an option."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if not isinstance(value, str):
        return number(value)
    try:
        return number(value)
    except PydanticCustomError:
        return value


SweptValue = Annotated[float | str, BeforeValidator(_swept_value)]


def _describe_members(schema: dict[str, Any]) -> None:
    value = {"type": ["number", "string", "boolean"], "description": "One of the swept values."}
    schema["patternProperties"] = {r"^(model|initial|time|schemes)\..+$": value}
    schema["additionalProperties"] = False


class Members(Section):
    """The members of the sweep that a check is about: those with the given value under each swept key."""

    model_config = ConfigDict(extra="allow", json_schema_extra=_describe_members)
    __pydantic_extra__: dict[str, SweptValue]
    stand_ins = MappingProxyType({})
    other_values = SweptValue

    @property
    def swept(self) -> Mapping[str, float | str]:
        """The values by dotted key of the sweep; none of them stands for every member."""
        return self.__pydantic_extra__ or {}

    def without_members(self, **changes: Any) -> Self:
        """Return the same of an experiment without a sweep, and with other `changes`."""
        return type(self)(
            **{**{name: getattr(self, name) for name in type(self).model_fields}, **changes}
        )


_At = Annotated[
    Members,
    Field(
        description="Values of swept keys, such as `model.omega: 1.4`; every member when left out."
    ),
]


OF_A_QUANTITY = ("converges", "accurate")
"""Kinds of checks that have their quantity under their leading key."""


class MeasuringCheck(Section):
    """What every check that measures something has."""

    kind: ClassVar[str]
    id: GivenId = ""
    """Name of the check, unique in the file; `check_1` and so on when left out."""

    @property
    def measured(self) -> Self:
        """The check that is measured: this one."""
        return self

    @property
    def about(self) -> str | None:
        """The quantity that must be known over time."""
        key = self.kind if self.kind in OF_A_QUANTITY else "quantity"
        found: str | None = getattr(self, key, None)
        return found

    @property
    def member(self) -> int | None:
        """The member of the sweep that the check speaks of; None for every one."""
        has_own = "case" in type(self).model_fields
        found: int | None = getattr(self if has_own else getattr(self, "at", None), "case", None)
        return found

    @property
    def swept(self) -> Mapping[str, float | str]:
        """The swept values, by dotted key, of the members that the check speaks of; none stands for every one."""
        found: Members | None = getattr(self, "at", None)
        return found.swept if found is not None else {}

    @property
    def expected_verdict(self) -> Expect | None:
        """The verdict that passes, of a check that may say so; None of the others."""
        found: Expect | None = getattr(self, "expect", None)
        return found

    @property
    def expects_pass(self) -> bool:
        """Whether the verdict that passes is a PASS."""
        return self.expected_verdict is None or self.expected_verdict.status == "PASS"


class StableCheck(MeasuringCheck):
    """The amplitude does not grow without bound, or it does."""

    kind: ClassVar[Literal["stable"]] = "stable"
    stand_ins = MappingProxyType({"stable": True})
    stable: StrictBool
    """Whether the schemes must be stable."""
    schemes: _Schemes = None
    level: _Level = None
    case: _Case = None
    at: _At = Members()

    @property
    def expects_pass(self) -> bool:
        """Whether they must be."""
        return self.stable


class ConservesCheck(MeasuringCheck):
    """The error of the energy has a kind of growth with time."""

    kind: ClassVar[Literal["conserves"]] = "conserves"
    stand_ins = MappingProxyType({"conserves": "energy"})
    conserves: Literal["energy", "energy_d2t"]
    """`energy` by the scheme's own velocity, or `energy_d2t` by the centred difference of the position."""
    drift: Drift = "none"
    """How the largest error so far grows: not at all (round-off), bounded, like t, or like t^2."""
    schemes: _Schemes = None
    level: _Level = None
    case: _Case = None
    at: _At = Members()

    @property
    def about(self) -> str | None:
        """The quantity that must be known over time."""
        return self.conserves.replace("energy", "energy_deviation")


class EqualCheck(MeasuringCheck):
    """The solution of a scheme is that of another one, or a known one, at every stored time."""

    kind: ClassVar[Literal["equal"]] = "equal"
    stand_ins = MappingProxyType({"equal": (STAND_IN, STAND_IN)})
    equal: tuple[Text, Text]
    """A scheme, and what it must equal: another scheme, `exact`, or `discrete`, the exact solution of its own steps."""
    quantity: Text
    """The quantity that is compared."""
    atol: NonNegative | None = None
    """How far apart they may be; derived from the number of steps and the machine precision when left out."""
    level: _Level = None
    case: _Case = None
    at: _At = Members()

    @property
    def first(self) -> str:
        """The scheme that is compared."""
        return self.equal[0]

    @property
    def second(self) -> str:
        """What it must equal: a scheme, or one of `SOLUTIONS`."""
        return self.equal[1]


_ORDER = "must be scheme (the order that the scheme promises), or a number greater than 0"
_HALVING = "order 2: half the step, a quarter of the error"


def _order(value: Any) -> Any:
    if value == "scheme":
        return value
    try:
        found = number(value)
    except PydanticCustomError as error:
        raise refused(_ORDER, likely(value, ["scheme"]) or _HALVING) from error
    if found <= 0.0:
        raise refused(_ORDER, _HALVING)
    return found


def _level(value: Any) -> Any:
    if value != "best" and not 0 <= whole(value) <= MAX_LEVEL:
        raise refused(f"must be a level from 0 to {MAX_LEVEL}, or best")
    return value if value == "best" else whole(value)


Order = Annotated[
    Literal["scheme"] | float,
    BeforeValidator(_order),
    WithJsonSchema({"anyOf": [{"const": "scheme"}, {"type": ["number", "string"]}]}),
]
LevelOrBest = Annotated[
    Literal["best"] | int,
    BeforeValidator(_level),
    WithJsonSchema({"anyOf": [{"const": "best"}, {"type": "integer", "minimum": 0}]}),
]


def _describe_best(schema: dict[str, Any]) -> None:
    description = "`best: true` is the same as `level: best`."
    schema["properties"]["best"] = {"const": True, "description": description}
    _describe_members(schema)


class PublishedAt(Members):
    """Where else a printed number is taken, beside its scheme and level."""

    t: Number | None = None
    """A stored sample time; where the end differs between members, the fraction 0 to 1 of it."""
    step: Index | None = None
    """A stored step of the level, from 0."""
    event: Annotated[int, Field(ge=1, le=MOST_EVENTS), BeforeValidator(whole)] | None = None
    """Number of an event, from 1."""
    case: Index | None = None
    """Index of a member of the sweep, from 0."""


class At(PublishedAt):
    """Where a value is taken; left out means every scheme, every case, the finest level."""

    model_config = ConfigDict(json_schema_extra=_describe_best)
    stand_ins = MappingProxyType({})

    level: LevelOrBest | None = None
    """A level, or `best` for the Richardson-extrapolated solution."""
    scheme: Text | None = None
    """Name of a scheme."""

    @classmethod
    def normal(cls, written: Mapping[str, Any]) -> tuple[Mapping[str, Any], str]:
        """Return what is written with ``level: best`` for ``best: true``."""
        if "best" not in written:
            return written, ""
        rest = {key: value for key, value in written.items() if key not in ("best", "level")}
        if written["best"] is not True:
            return rest, "best must be true, or left out"
        if written.get("level", "best") != "best":
            return rest, "must have a level or best, not both"
        return {**rest, "level": "best"}, ""


class ConvergesCheck(MeasuringCheck):
    """A quantity converges with an order, and the verdict can be trusted."""

    kind: ClassVar[Literal["converges"]] = "converges"
    stand_ins = MappingProxyType({"converges": STAND_IN})
    converges: Text
    """The quantity: a state, energy, energy_deviation, kinetic_energy, potential_energy, or the part of an error
    `<position>_phase_error` or `<position>_amplitude_error`."""
    order: Order = "scheme"
    """The order: `scheme` for the order that the scheme promises, or a number."""
    tolerance: Positive = ORDER_TOLERANCE
    """How far the observed order may be from the expected one."""
    norm: Norm = TYPICAL_NORM
    """The norm over time in which differences are measured."""
    schemes: _Schemes = None
    at: _At = Members()
    expect: Expect = Expect()
    """The verdict that passes; PASS when left out."""


class Accuracy(MeasuringCheck):
    """The error of the finest level is small enough."""

    kind: ClassVar[Literal["accurate"]] = "accurate"
    stand_ins = MappingProxyType({"accurate": STAND_IN})
    accurate: Text
    """The quantity: one that `converges` may be about."""
    relative: Positive | None = None
    """The error must be below this part of the solution, both in the L2 norm."""
    absolute: Positive | None = None
    """The error must be below this, in the unit of its norm."""
    expect: Expect = Expect()
    """The verdict that passes; PASS when left out."""

    @property
    def key(self) -> str:
        """The key that says how accurate."""
        return "relative" if self.is_relative else "absolute"

    @property
    def is_relative(self) -> bool:
        """Whether the error counts as a part of the solution."""
        return self.relative is not None

    @property
    def accuracy(self) -> float:
        """The error that is allowed; NaN where the file does not say."""
        given = self.absolute if self.relative is None else self.relative
        return math.nan if given is None else given


class AccurateCheck(Accuracy):
    """The error of the finest level, in the L2 norm over time, is small enough."""

    schemes: _Schemes = None
    at: _At = Members()


DEFAULT_RTOL, DEFAULT_ATOL = 1e-9, 1e-12
"""Tolerances of ``equals`` where a check gives none; the second of numbers without a unit, and of 0, alone."""
PLAIN = ("none", "count")
"""Measures of numbers without a unit."""


class ValueCheck(MeasuringCheck):
    """A number of the outcome equals, is below or is above a given one."""

    kind: ClassVar[Literal["value"]] = "value"
    stand_ins = MappingProxyType({"value": STAND_IN})
    value: Annotated[str, Field(json_schema_extra={"enum": sorted(VALUES)})]
    """Name of the number, see `vibsim list checks`."""
    quantity: Text | None = None
    """The quantity that it is of, where it is of one."""
    at: At = At()
    """Where it is taken."""
    over: Text | None = None
    """The swept key over which one number is taken of all members, or `cases` where one varies only: see `take`."""
    take: Take | None = None
    """That number: the `largest`, the `smallest` or the `mean`, the value of the key `where_largest` (or `where`) or
    `where_smallest` is, or `monotone`: 1 where it rises with the key, -1 where it falls, else 0."""
    equals: Number | None = None
    """The number that it must equal, within `rtol` and `atol`."""
    below: Number | None = None
    """The number that it must be below."""
    above: Number | None = None
    """The number that it must be above."""
    rtol: NonNegative | None = None
    """Relative tolerance of `equals`."""
    atol: NonNegative | None = None
    """Absolute tolerance of `equals`."""

    @classmethod
    def normal(cls, written: Mapping[str, Any]) -> tuple[Mapping[str, Any], str]:
        """Return what is written with ``level: best`` for a number of all members, where there is such a level."""
        row, at = VALUES.get(str(written.get("value"))), written.get("at") or {}
        is_plain = isinstance(at, Mapping) and not {"level", "best"} & set(at)
        if "take" not in written or row is None or not row.best or not is_plain:
            return written, ""
        return {**written, "at": {**at, "level": "best"}}, ""

    @property
    def number(self) -> Value:
        """What is said of the number that is asked for, whose name is a known one."""
        return VALUES[self.value]

    @property
    def allowed(self) -> float:
        """How far the number may be from `equals`; NaN where the check has a border."""
        if self.equals is None:
            return math.nan
        plain = self.rtol is None and self.atol is None
        rtol = DEFAULT_RTOL if plain else self.rtol or 0.0
        # what has a unit may be as small as it likes
        sized = self.equals != 0.0 and self.number.measure not in PLAIN
        atol = (0.0 if sized else DEFAULT_ATOL) if plain else self.atol or 0.0
        return atol + rtol * abs(self.equals)


def as_data(check: Any) -> dict[str, Any]:
    """Return a check as JSON-able data, with its kind, and a claim with that of what decides it."""
    data: dict[str, Any] = {"kind": check.kind, **check.model_dump(mode="json")}
    return data | ({"that": as_data(check.that)} if check.kind == "claim" else {})


def without_kind(data: Mapping[str, Any]) -> dict[str, Any]:
    """Return what `as_data` returned as it is validated."""
    found = {key: value for key, value in data.items() if key != "kind"}
    return found | ({"that": without_kind(found["that"])} if "that" in found else {})


def by_key(kinds: Iterable[str]) -> Callable[[Any], str | None]:
    """Return what tells of which of some kinds a check is: by its leading key."""

    def which(value: Any) -> str | None:
        if isinstance(value, ClaimCheck | MeasuringCheck):
            kind: str = value.kind
            return tag(kind)
        keys = value if isinstance(value, dict) else ()
        return next((tag(key) for key in kinds if key in keys), None)

    return which


def one_of(members: Mapping[str, type[Section]], which: Callable[[Any], str | None]) -> Any:
    """Return the union of checks, of which `which` tells by `by_key`."""
    *others, last = members
    rule = f"must be a mapping with the key {', '.join(others)} or {last}"
    return tagged(
        members, Discriminator(which, custom_error_type="check", custom_error_message=rule)
    )


MEASURED: Mapping[str, type[Section]] = MappingProxyType(
    {
        row.kind: row
        for row in (
            *(ConvergesCheck, AccurateCheck, ValueCheck),
            *(StableCheck, ConservesCheck, EqualCheck),
        )
    }
)
"""The checks that measure something, by their leading key."""
KINDS = ("claim", *MEASURED)
"""Leading keys, in the order in which they are looked for."""

Measurement = (
    ConvergesCheck | AccurateCheck | ValueCheck | StableCheck | ConservesCheck | EqualCheck
)
if TYPE_CHECKING:
    Measured = Measurement
else:
    Measured = one_of(MEASURED, by_key(KINDS))


class ClaimCheck(Section):
    """A statement of a source, true or false, and the measurement that decides it."""

    kind: ClassVar[Literal["claim"]] = "claim"
    stand_ins = MappingProxyType({"claim": STAND_IN})
    id: GivenId = ""
    """Name of the check, unique in the file; `check_1` and so on when left out."""
    claim: Text
    """The statement, in words."""
    source: Citation | None = None
    """Where the statement stands."""
    that: Measured
    """The check that measures it."""
    holds: StrictBool = True
    """Whether the statement is expected to be true."""
    note: Text | None = None
    """What a reader of the report should know of it."""

    @property
    def measured(self) -> Measurement:
        """The check that is measured: the one that decides the claim."""
        return self.that


if TYPE_CHECKING:
    Check = Measurement | ClaimCheck
else:
    Check = one_of({**MEASURED, "claim": ClaimCheck}, by_key(KINDS))
