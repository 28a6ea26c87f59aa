"""Types of single values: numbers (also as constant formulas), whole numbers, names, text.

Messages are worded for the author of the file.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from functools import reduce
from numbers import Integral, Real
from operator import or_
from typing import Annotated, Any, ClassVar, Literal

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    GetJsonSchemaHandler,
    StringConstraints,
    Tag,
    WithJsonSchema,
)
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from vibsim.experiment.schema.unit_text import split
from vibsim.formula import ExpressionError, constant

IDENTIFIER = r"^[a-z0-9_]+$"
_CONTROL = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\ud800-\udfff\ufffe\uffff]")
_COMMA = re.compile(r"[-+]?\d+,\d+")
MAX_LEVEL = 40
STAND_IN = "?"  # placeholder for faulty text that cannot be left out; has no further fault
MAX_FORMULAS = 1000  # largest number of formulas in one list
MAX_ENTRIES = 1000  # largest number of schemes or checks of one experiment
DECLARED = "parameters"  # key of the section ``model`` with the parameters of formulas
TABLE = "table"  # key of the path of a table
AT = "at"  # key of the abscissa, as a function of time, at which a table is evaluated
FORMULA_NOTE = "a number, or a constant formula such as 2*pi/30"


class Section(BaseModel):
    """A section of an experiment: immutable, and without unknown keys."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, defer_build=True)

    stand_ins: ClassVar[Mapping[str, Any] | None] = None
    """Placeholders for faulty required values, so that rules can still check the other values; None if a faulty section
    is left out as a whole."""
    other_values: ClassVar[Any] = None
    """Annotation of the values of keys that are not fields; None if there are no such keys."""

    @classmethod
    def normal(cls, content: Mapping[str, Any]) -> tuple[Mapping[str, Any], str]:
        """Return the content with abbreviations expanded, and the rule that it breaks (empty if none)."""
        return content, ""


class FrozenDict(dict[str, Any]):
    """An immutable, hashable dictionary."""

    def __hash__(self) -> int:  # type: ignore[override]
        return hash(frozenset(self.items()))

    def _refuse(self, *_: object, **__: object) -> Any:
        raise TypeError("an experiment does not change; build another one")

    __setitem__ = __delitem__ = __ior__ = _refuse
    clear = pop = popitem = setdefault = update = _refuse

    def __reduce__(self) -> tuple[Any, ...]:
        return (FrozenDict, (dict(self),))

    def __deepcopy__(self, memo: object) -> FrozenDict:
        return self


def refused(rule: str, hint: str = "") -> PydanticCustomError:
    """Return the validation error of a value that breaks `rule`."""
    return PydanticCustomError("refused", "{rule}", {"rule": rule, "hint": hint})


def tag(name: str) -> str:
    """Mark the name of a union member, to distinguish it from keys in the location of an error."""
    return f"\0{name}"


_FORMS = ("mapping", "text", "number", "list", "rows", "row", "other")


def by_form(members: Mapping[str, Any], rule: str = "", error: str = "form") -> Any:
    """Return a union of types selected by the YAML form of the value; any other form breaks `rule`, an `error`.

    A member is named after a key that its mapping must have (the first one in `members` that is there), or is
    ``mapping``, ``text``, ``number``, ``list``, ``rows`` (a list of lists), ``row`` (any other list), or ``other`` for
    all remaining forms, beside a `rule` for those of single values.
    """

    def form(value: Any) -> str:
        if isinstance(value, Mapping | Section):
            keys = value if isinstance(value, Mapping) else type(value).model_fields
            forms = [*(name for name in members if name in keys and name not in _FORMS), "mapping"]
        elif isinstance(value, list | tuple):
            forms = ["list", "rows" if value and isinstance(value[0], list | tuple) else "row"]
        else:
            forms = ["text" if isinstance(value, str) else "number"]
        if not (rule and isinstance(value, Mapping | Section | list | tuple)):
            forms.append("other")
        return tag(next((name for name in forms if name in members), forms[0]))

    more: Any = {"custom_error_type": error, "custom_error_message": rule} if rule else {}
    kinds: Any = (Annotated[kind, Tag(tag(name))] for name, kind in members.items())
    return Annotated[reduce(or_, kinds), Discriminator(form, **more)]


def number(value: Any) -> float:
    """Return `value` as a finite float; text is evaluated as a constant formula."""
    if isinstance(value, str):
        if _COMMA.fullmatch(value):
            raise refused("must have a decimal point", f"write {value.replace(',', '.')}")
        try:
            return constant(value)
        except ExpressionError as error:
            if split(value) is None:
                raise refused(f"must be {FORMULA_NOTE} ({error.rule})", error.hint) from None
        raise refused(
            "must be a number without a unit: only model, initial, time and a sweep of these take units",
            "write the number alone, in the unit of the table of models (of a scaled run: over its scale)",
        )
    if isinstance(value, bool) or not isinstance(value, Real):
        raise refused(f"must be {FORMULA_NOTE}")
    try:
        result = float(value)
    except OverflowError:
        result = math.inf
    if not math.isfinite(result):
        raise refused("must be a finite number")
    return result


def whole(value: Any) -> int:
    """Return `value` as an int; ``6.0`` is 6."""
    is_whole = isinstance(value, Integral) or (isinstance(value, float) and value.is_integer())
    if isinstance(value, bool) or not is_whole:
        raise refused("must be a whole number")
    return int(value)


def exponent(value: Any) -> int:
    """Return `value` as a level; refuse a number of steps."""
    level = whole(value)
    if level > MAX_LEVEL:
        meaning = "level n has 2^n steps"
        if level.bit_count() == 1:
            meaning += f"; {level} steps are level {level.bit_length() - 1}"
        raise refused(f"must be at most {MAX_LEVEL}", f"{meaning} (times `base_steps:` of `time:`)")
    return level


def short(limit: int, what: str = "entries") -> BeforeValidator:
    """Refuse a list or a mapping of more than `limit` entries before its entries are validated."""

    def check(values: Any) -> Any:
        if isinstance(values, list | tuple | dict) and len(values) > limit:
            raise refused(f"must not have more than {limit} {what}, has {len(values)}")
        return values

    return BeforeValidator(check)


def plain(values: Any) -> Any:
    """Refuse a list of more than `MAX_FORMULAS` formulas."""
    if isinstance(values, list | tuple):
        formulas = sum(not isinstance(value, int | float) for value in values)
        if formulas > MAX_FORMULAS:
            raise refused(f"must not hold more than {MAX_FORMULAS} formulas, holds {formulas}")
    return values


def _printable(text: str) -> str:
    """Refuse control characters and those that are invalid in XML 1.0 (2008), section 2.2."""
    match = _CONTROL.search(text)
    if match:
        raise refused(f"must not hold control characters, holds U+{ord(match.group()):04X}")
    return text


def _one_line(text: str) -> str:
    if len(text.splitlines()) > 1 or set("\t\r\n") & set(text):
        raise refused("must be on one line, without tabs")
    return text


class _Formula:
    """Annotation of a float that may be given as text; the JSON Schema then accepts both."""

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> CoreSchema:
        return core_schema.no_info_before_validator_function(number, handler(source))

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        result = handler(schema)
        if result.get("type") == "number":
            result["type"] = ["number", "string"]
        return result


def _as_text(value: Any) -> Any:
    """Return a number as the text of a formula, and text unchanged."""
    if isinstance(value, float) and not math.isfinite(value):
        raise refused("must be a finite number")
    if isinstance(value, int | float) and not isinstance(value, bool):
        return repr(value)
    if not isinstance(value, str):
        raise refused("must be a formula, or a number")
    return value


def _no_default(schema: dict[str, Any]) -> None:
    """Remove the default from the schema: an empty id stands for a generated one."""
    schema.pop("default", None)


FORMULA = _Formula()
Number = Annotated[float, FORMULA]
Positive = Annotated[float, Field(gt=0), FORMULA]
Fraction = Annotated[float, Field(gt=0, lt=1), FORMULA]
NonNegative = Annotated[float, Field(ge=0), FORMULA]
Level = Annotated[int, Field(ge=0, le=MAX_LEVEL), BeforeValidator(exponent)]
Count = Annotated[int, Field(ge=1), BeforeValidator(whole)]
Index = Annotated[int, Field(ge=0), BeforeValidator(whole)]
Identifier = Annotated[str, Field(pattern=IDENTIFIER)]
GivenId = Annotated[Identifier, Field(json_schema_extra=_no_default)]
"""The id of a check; empty if the file gives none."""
Text = Annotated[str, Field(min_length=1), AfterValidator(_printable)]
"""Text that may have several lines."""
Line = Annotated[Text, AfterValidator(_one_line)]  # text on one line
FormulaText = Annotated[
    str,
    StringConstraints(min_length=1),
    BeforeValidator(_as_text),
    WithJsonSchema({"type": ["string", "number"], "minLength": 1}),
]
"""A formula as text, or a number."""
Output = Literal["verdict", "best"]
