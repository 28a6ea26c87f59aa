"""The checks: what a file may claim about its outcome."""

from __future__ import annotations

import math
from collections.abc import Mapping
from contextlib import suppress
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Self, get_args

from pydantic import BeforeValidator, ConfigDict, Field, StrictBool, WithJsonSchema
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
    by_form,
    number,
    refused,
    whole,
)
from vibsim.experiment.value_names import MOST_EVENTS, VALUES, Take, Value

Drift = Literal["none", "bounded", "linear", "quadratic"]
SOLUTIONS = ("exact", "discrete")
"""Words for the solutions that a scheme may be compared with; no scheme may have these names."""

_EVERY_SCHEME = "Names of the schemes; all schemes when left out."
_Schemes = Annotated[
    Annotated[tuple[Text, ...], Field(min_length=1)] | None, Field(description=_EVERY_SCHEME)
]
_Level = Annotated[Level | None, Field(description="A level; the finest one when left out.")]
_EVERY_CASE = "Index of a member of the sweep, from 0; all members when left out."
_Case = Annotated[Index | None, Field(description=_EVERY_CASE)]


class Expect(Section):
    """The expected verdict of a check."""

    stand_ins = MappingProxyType({})

    status: Status = "PASS"
    """The expected status."""
    reason: Annotated[str, Field(json_schema_extra={"enum": list(REASONS)})] | None = None
    """The expected reason; any reason when left out."""


def _swept_value(value: Any) -> Any:
    """Return a swept value in the form that a sweep has: a number, also from a formula, or an option word."""
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
    """Selects the members of the sweep that a check applies to, by values of swept keys."""

    model_config = ConfigDict(extra="allow", json_schema_extra=_describe_members)
    __pydantic_extra__: dict[str, SweptValue]
    stand_ins = MappingProxyType({})
    other_values = SweptValue

    @property
    def swept(self) -> Mapping[str, float | str]:
        """Values by dotted key of the sweep; empty for all members."""
        return self.__pydantic_extra__ or {}

    def without_members(self, **changes: Any) -> Self:
        """Return a copy without swept values, as for an experiment without a sweep, with `changes` to its fields."""
        return type(self)(
            **{**{name: getattr(self, name) for name in type(self).model_fields}, **changes}
        )


_At = Annotated[
    Members,
    Field(
        description="Values of swept keys, such as `model.omega: 1.4`; all members when left out."
    ),
]


OF_A_QUANTITY = ("converges", "accurate")  # kinds of checks whose leading key holds the quantity


class MeasuringCheck(Section):
    """Base class of all checks that measure something."""

    kind: ClassVar[str]
    id: GivenId = ""
    """Name of the check, unique in the file; `check_1` and so on when left out."""

    @property
    def measured(self) -> Self:
        """The check that is evaluated: this one."""
        return self

    @property
    def about(self) -> str | None:
        """The quantity whose time series the check needs; None if it needs none."""
        key = self.kind if self.kind in OF_A_QUANTITY else "quantity"
        quantity: str | None = getattr(self, key, None)
        return quantity

    @property
    def member(self) -> int | None:
        """Index of the member of the sweep that the check applies to; None for all."""
        has_case = "case" in type(self).model_fields
        case: int | None = getattr(self if has_case else getattr(self, "at", None), "case", None)
        return case

    @property
    def swept(self) -> Mapping[str, float | str]:
        """Swept values by dotted key that select the members the check applies to; empty for all."""
        members: Members | None = getattr(self, "at", None)
        return members.swept if members is not None else {}

    @property
    def expected_verdict(self) -> Expect | None:
        """The verdict that passes; None for kinds of checks without the key `expect`."""
        expect: Expect | None = getattr(self, "expect", None)
        return expect

    @property
    def expects_pass(self) -> bool:
        """Whether the check expects the verdict PASS."""
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
        """Whether the check expects stability."""
        return self.stable


class ConservesCheck(MeasuringCheck):
    """The error of the energy grows with time in the given way."""

    kind: ClassVar[Literal["conserves"]] = "conserves"
    stand_ins = MappingProxyType({"conserves": "energy"})
    conserves: Literal["energy", "energy_d2t"]
    """`energy` by the scheme's own velocity, or `energy_d2t` by the centred difference of the position."""
    drift: Drift = "none"
    """Growth of the running maximum of the error: none (round-off), bounded, like t, or like t^2."""
    schemes: _Schemes = None
    level: _Level = None
    case: _Case = None
    at: _At = Members()

    @property
    def about(self) -> str | None:
        """The energy deviation that belongs to the energy."""
        return self.conserves.replace("energy", "energy_deviation")


class EqualCheck(MeasuringCheck):
    """The solution of a scheme equals that of another scheme, or a known solution, at every stored time."""

    kind: ClassVar[Literal["equal"]] = "equal"
    stand_ins = MappingProxyType({"equal": (STAND_IN, STAND_IN)})
    equal: tuple[Text, Text]
    """A scheme, and what it must equal: another scheme, `exact`, or `discrete`, the exact solution of its difference
    equations."""
    quantity: Text
    """The quantity that is compared."""
    atol: NonNegative | None = None
    """Largest difference; derived from the number of steps and the machine precision when left out."""
    level: _Level = None
    case: _Case = None
    at: _At = Members()

    @property
    def first(self) -> str:
        """The scheme that is compared."""
        return self.equal[0]

    @property
    def second(self) -> str:
        """The scheme, or the word of `SOLUTIONS`, that it must equal."""
        return self.equal[1]


_ORDER = "must be scheme (the order that the scheme promises), or a number greater than 0"
_HALVING = "order 2: half the step, a quarter of the error"


def _order(value: Any) -> Any:
    if value == "scheme":
        return value
    try:
        order = number(value)
    except PydanticCustomError as error:
        raise refused(_ORDER, likely(value, ["scheme"]) or _HALVING) from error
    if order <= 0.0:
        raise refused(_ORDER, _HALVING)
    return order


def _level(value: Any) -> Any:
    if value == "best":
        return value
    with suppress(PydanticCustomError):
        if 0 <= whole(value) <= MAX_LEVEL:
            return whole(value)
    raise refused(f"must be a level from 0 to {MAX_LEVEL}, or best", likely(value, ["best"]))


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
    """Time, event or members of a printed number."""

    t: Number | None = None
    """A stored sample time; if the end differs between members, the fraction 0 to 1 of it."""
    step: Index | None = None
    """A stored step of the level, from 0."""
    event: Annotated[int, Field(ge=1, le=MOST_EVENTS), BeforeValidator(whole)] | None = None
    """Number of an event, from 1."""
    case: Index | None = None
    """Index of a member of the sweep, from 0."""


class At(PublishedAt):
    """The scheme, member, level and time of a value; by default all schemes, all members, the finest level."""

    model_config = ConfigDict(json_schema_extra=_describe_best)
    stand_ins = MappingProxyType({})

    level: LevelOrBest | None = None
    """A level, or `best` for the Richardson-extrapolated solution."""
    scheme: Text | None = None
    """Name of a scheme."""

    @classmethod
    def normal(cls, content: Mapping[str, Any]) -> tuple[Mapping[str, Any], str]:
        """Return the content with ``best: true`` replaced by ``level: best``, and the rule that it breaks."""
        if "best" not in content:
            return content, ""
        others = {key: value for key, value in content.items() if key not in ("best", "level")}
        if content["best"] is not True:
            return others, "best must be true, or left out"
        if content.get("level", "best") != "best":
            return others, "must have a level or best, not both"
        return {**others, "level": "best"}, ""


class ConvergesCheck(MeasuringCheck):
    """A quantity converges with an order, and the verdict can be trusted."""

    kind: ClassVar[Literal["converges"]] = "converges"
    stand_ins = MappingProxyType({"converges": STAND_IN})
    converges: Text
    """The quantity: a state, energy, energy_deviation, kinetic_energy, potential_energy, all coordinates as
    position_vector or velocity_vector, or the part of an error `<position>_phase_error` or
    `<position>_amplitude_error`."""
    order: Order = "scheme"
    """The order: `scheme` for the order that the scheme promises, or a number."""
    tolerance: Positive = ORDER_TOLERANCE
    """Largest difference of the observed order from the expected one."""
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
    """The quantity, as for `converges`."""
    relative: Positive | None = None
    """The error must be below this fraction of the solution, both in the L2 norm."""
    absolute: Positive | None = None
    """The error must be below this, in the unit of its norm."""
    expect: Expect = Expect()
    """The verdict that passes; PASS when left out."""

    @property
    def key(self) -> str:
        """The key that holds the bound."""
        return "relative" if self.is_relative else "absolute"

    @property
    def is_relative(self) -> bool:
        """Whether the bound is relative to the solution."""
        return self.relative is not None

    @property
    def accuracy(self) -> float:
        """The bound of the error; NaN if the file gives none."""
        bound = self.absolute if self.relative is None else self.relative
        return math.nan if bound is None else bound


class AccurateCheck(Accuracy):
    """The error of the finest level, in the L2 norm over time, is small enough."""

    schemes: _Schemes = None
    at: _At = Members()


DEFAULT_RTOL, DEFAULT_ATOL = 1e-9, 1e-12
"""Default tolerances of ``equals``; the absolute one only for numbers without a unit, and for 0."""
PLAIN = ("none", "count")  # measures (`Value.measure`) of numbers without a unit


class ValueCheck(MeasuringCheck):
    """A number of the outcome equals, is below or is above a given one."""

    kind: ClassVar[Literal["value"]] = "value"
    stand_ins = MappingProxyType({"value": STAND_IN})
    value: Annotated[str, Field(json_schema_extra={"enum": sorted(VALUES)})]
    """Name of the number, see `vibsim list checks`."""
    quantity: Text | None = None
    """The quantity of the number, if it has one."""
    at: At = At()
    """The scheme, member, level and time of the number."""
    over: Text | None = None
    """The swept key over which the numbers of all members are reduced to one (see `take`), or `cases`: the only one, or
    all members."""
    take: Take | None = None
    """The reduction: the `largest`, the `smallest`, the `mean`, the value of the key `where_largest` (or `where`) or
    `where_smallest` occurs, or `monotone`: 1 if the numbers rise with the key, -1 if they fall, else 0."""
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
    def normal(cls, content: Mapping[str, Any]) -> tuple[Mapping[str, Any], str]:
        """Return the content with ``level: best`` as the default of reductions over members, if the number has it."""
        row, at = VALUES.get(str(content.get("value"))), content.get("at") or {}
        is_plain = isinstance(at, Mapping) and not {"level", "best"} & set(at)
        if "take" not in content or row is None or not row.best or not is_plain:
            return content, ""
        return {**content, "at": {**at, "level": "best"}}, ""

    @property
    def number(self) -> Value:
        """The description of the number."""
        return VALUES[self.value]

    @property
    def allowed(self) -> float:
        """Tolerance of `equals`; NaN for checks with `below` or `above`."""
        if self.equals is None:
            return math.nan
        plain = self.rtol is None and self.atol is None
        rtol = DEFAULT_RTOL if plain else self.rtol or 0.0
        # a number with a unit has no natural absolute tolerance
        sized = self.equals != 0.0 and self.number.measure not in PLAIN
        atol = (0.0 if sized else DEFAULT_ATOL) if plain else self.atol or 0.0
        return atol + rtol * abs(self.equals)


def as_data(check: Any) -> dict[str, Any]:
    """Return a check as JSON data with its kind; a claim includes the check that decides it."""
    data: dict[str, Any] = {"kind": check.kind, **check.model_dump(mode="json")}
    return data | ({"that": as_data(check.that)} if check.kind == "claim" else {})


def without_kind(data: Mapping[str, Any]) -> dict[str, Any]:
    """Return the result of `as_data` in the form that is validated, without kinds."""
    fields = {key: value for key, value in data.items() if key != "kind"}
    return fields | ({"that": without_kind(fields["that"])} if "that" in fields else {})


def one_of(members: Mapping[str, type[Section]]) -> Any:
    """Return the union of kinds of checks by their leading key."""
    *others, last = members
    return by_form(
        members, f"must be a mapping with the key {', '.join(others)} or {last}", "check"
    )


Measurement = (
    ConvergesCheck | AccurateCheck | ValueCheck | StableCheck | ConservesCheck | EqualCheck
)
MEASURED: Mapping[str, type[Section]] = MappingProxyType(
    {check.kind: check for check in get_args(Measurement)}
)
"""The checks that measure something, by leading key."""
if TYPE_CHECKING:
    Measured = Measurement
else:
    Measured = one_of(MEASURED)


class ClaimCheck(Section):
    """A statement of a source, and the check that decides whether it is true."""

    kind: ClassVar[Literal["claim"]] = "claim"
    stand_ins = MappingProxyType({"claim": STAND_IN})
    id: GivenId = ""
    """Name of the check, unique in the file; `check_1` and so on when left out."""
    claim: Text
    """The statement, in words."""
    source: Citation | None = None
    """The source of the statement."""
    that: Measured
    """The check that decides it."""
    holds: StrictBool = True
    """Whether the statement is expected to be true."""
    note: Text | None = None
    """A remark for readers of the report."""

    @property
    def measured(self) -> Measurement:
        """The check that is evaluated: the one that decides the claim."""
        return self.that


if TYPE_CHECKING:
    Check = Measurement | ClaimCheck
else:
    Check = one_of({**MEASURED, "claim": ClaimCheck})
