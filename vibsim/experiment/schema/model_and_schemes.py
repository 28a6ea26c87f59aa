"""Classes of the section ``model`` and the entries of ``schemes``, made from the registries.

An adaptive scheme may have a list of tolerances; it then stands for one scheme per tolerance, named after it.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, ConfigDict, Field, StrictBool, create_model
from pydantic_core import PydanticCustomError

from vibsim.experiment.kinds import COORDINATES
from vibsim.experiment.schema.fields import (
    AT,
    FORMULA,
    FORMULA_NOTE,
    TABLE,
    FormulaText,
    Line,
    Number,
    Positive,
    Section,
    Text,
    by_form,
    number,
    refused,
    short,
)
from vibsim.experiment.schema.structure import StructureSection
from vibsim.experiment.schema.sweep import tolerance_name
from vibsim.formula import CONSTANTS
from vibsim.models import FormulaField, Model, Parameter
from vibsim.models.oscillator import COULOMB
from vibsim.models.shared.coordinates import MOST
from vibsim.models.shared.crossings import MOST_EVENTS, STOP
from vibsim.schemes import AnyOption, Flag, NumberOption, Option, Scheme
from vibsim.schemes.base import EVENTS

TOLERANCE = "tolerance"  # the option of adaptive schemes that may have several values
MAX_TOLERANCES = 100


def _class_name(kind: str) -> str:
    return kind.title().replace("_", "")


def _key(kind: Any, description: str, default: Any = None) -> tuple[Any, Any]:
    """Return type and description of a key of a section."""
    return kind, Field(default=default, description=description)


@cache
def scheme_section(scheme: Scheme) -> type[Section]:
    """Return the class of an entry of ``schemes`` that is a mapping."""
    label = "Name of the scheme in this experiment, if not its kind."
    fields: dict[str, Any] = {
        "kind": _key(Literal[scheme.kind], scheme.title, ...),
        "label": _key(Line | None, label),
    }
    for option in scheme.options:
        fields[option.name] = _key(_type(option, scheme), option.description, option.default)
    if not scheme.adaptive:
        words = f"{EVENTS.description}; on models with events only, {EVENTS.default} when left out"
        fields[EVENTS.name] = _key(Literal[EVENTS.choices] | None, words)
    doc = f"{scheme.title} ({scheme.source})."
    name = f"{_class_name(scheme.kind)}Scheme"
    return create_model(name, __base__=Section, __doc__=doc, **fields)


def _bounded(**bounds: float | None) -> Any:
    """Return the type of a number with some of the bounds ``gt``, ``ge`` and ``le``."""
    finite: Any = {
        name: end for name, end in bounds.items() if end is not None and math.isfinite(end)
    }
    return Annotated[float, Field(**finite), FORMULA]


def _parameter_type(row: Parameter) -> Any:
    lower = {"gt" if row.exclusive else "ge": row.minimum}
    return _bounded(**lower, le=row.maximum)


def _option_type(option: AnyOption) -> Any:
    if isinstance(option, Option):
        return Literal[option.choices]
    return StrictBool if isinstance(option, Flag) else _bounded(ge=option.least, le=option.most)


def _type(option: AnyOption, scheme: Scheme) -> Any:
    value: Any = _option_type(option)
    if not scheme.adaptive or option.name != TOLERANCE or not isinstance(option, NumberOption):
        return value
    values = Annotated[tuple[value, ...], Field(min_length=1), short(MAX_TOLERANCES)]
    return by_form({"other": value, "list": values})


def sweep_types(model: Model | None, schemes: Iterable[tuple[str, Scheme]]) -> dict[str, Any]:
    """Return the types of all keys that can be swept, by dotted key; `schemes` are pairs of name and scheme."""
    types: dict[str, Any] = {}
    if model is not None:
        for state in model.states if model.start is None else ():
            types[f"initial.{state.name}"] = _bounded(ge=state.minimum)
        types |= {f"model.{row.key}": _parameter_type(row) for row in model.parameters}
    types["time.end"] = Positive
    for name, scheme in schemes:
        for option in scheme.options_on(model):
            types[f"schemes.{name}.{option.name}"] = _option_type(option)
    return types


def scheme_names(data: Any) -> Iterator[str]:
    """Yield the names of a list of schemes in the file, valid or not."""
    for item in data if isinstance(data, list) else ():
        name = item if not isinstance(item, Mapping) else item.get("label") or item.get("kind")
        if not isinstance(name, str):
            continue
        tolerances = item.get(TOLERANCE) if isinstance(item, Mapping) else None
        if not isinstance(tolerances, list):
            yield name
            continue
        for value in tolerances[:MAX_TOLERANCES]:
            try:
                yield tolerance_name(name, number(value))
            except PydanticCustomError:
                continue


MAX_DECLARED, MOST_TERMS = 50, 1000
Declared = Annotated[dict[str, Number], short(MAX_DECLARED, "parameters")]
_few = short(MOST, "formulas")


def _formulas(single: Any) -> Any:
    """Return the type of formulas by name, given the type of a single one."""
    return Annotated[dict[str, single], Field(min_length=1), _few]


def _formula_type(model: Model, field: FormulaField) -> Any:
    """Return the type of a formula field: text, or ``{word: coefficient}`` or ``{table: file}`` if it takes those.

    A field with one formula per coordinate or output is a mapping, or the formula of the only coordinate. A sum of
    terms is a list of formulas, or one formula.
    """
    if field.of:
        if field.of == "term":
            terms = Annotated[tuple[FormulaText, ...], Field(min_length=1), short(MOST_TERMS)]
            return by_form(
                {"other": FormulaText, "list": terms}, "must be a formula, or a list of terms"
            )
        mapping: Any = _formulas(FormulaText)
        if field.paired:
            row = {"mapping": mapping, "other": FormulaText}
            mapping = _formulas(
                by_form(row, "must be a formula, or a row such as {x: 2, y: cos(x)}")
            )
        if field.of == "output":
            return mapping
        rule = "must be a formula, or a mapping of coordinates to formulas"
        return by_form({"mapping": mapping, "other": FormulaText}, rule)
    name = f"{_class_name(model.kind)}{_class_name(field.name)}"
    fields: dict[str, Any] = {}
    if field.table is not None:
        name += "Table"
        words = f"path of a table, relative to this file: {field.description}; a .csv or a .nc file"
        fields[TABLE] = _key(Text, words, ...)
        # the default name of a column is its key
        for key, what in zip(field.table, ("places", "values"), strict=True):
            words = f"name of the column of {what} in the table, or of the variable"
            fields[key] = _key(Text, words, key)
    if field.tabled:
        words = "where the table is looked up: a formula in t and parameters, a number times t; t when left out"
        fields[AT] = _key(FormulaText, words, "t")
    for word, text in () if field.table else field.terms.items():
        value = Annotated[float, FORMULA, BeforeValidator(_coefficient(field, word))] | None
        fields[word] = _key(value, f"b of {text}")
    if not fields:
        return FormulaText
    section = create_model(name, __base__=Section, **fields)
    if field.tabled:
        return section
    rule = f"must be a formula, or a mapping such as {{{next(iter(fields))}: ...}}"
    return by_form({"mapping": section, "other": FormulaText}, rule)


def _coefficient(field: FormulaField, word: str) -> Callable[[Any], Any]:
    """Return a validator that refuses a parameter name as coefficient b of a term, with a hint how to write it."""

    def check(value: Any) -> Any:
        if isinstance(value, str) and value.isidentifier() and value not in CONSTANTS:
            whole = re.sub(r"\bb\b", value, field.terms[word])
            hint = f"with a parameter write the formula: `{field.name}: {whole}`"
            if word == COULOMB:
                # a friction formula could not hold the body at rest
                hint = f"its values may be swept, as `model.{field.name}.{word}`"
            raise refused(f"must be {FORMULA_NOTE}", hint)
        return value

    return check


class Event(Section):
    """An event defined by formulas."""

    when: FormulaText
    """a formula in the states, t and parameters: the event is where it crosses 0"""
    falling: StrictBool | None = None
    """only where it falls; both ways when left out"""
    rising: StrictBool | None = None
    """only where it rises"""
    then: dict[str, FormulaText] = Field(default_factory=dict)
    """new values of states, as formulas in the values before the event"""


class Coordinate(Section):
    """The formulas of one coordinate of a system."""

    acceleration: FormulaText | None = None
    """its acceleration"""
    mass: FormulaText | dict[str, FormulaText] | None = None
    """its mass, or its row of the mass matrix by names of coordinates"""
    force: FormulaText | None = None
    """the force on it"""


class Chain(Section):
    """A chain: the number of coordinates, and formulas with an index (`vibsim.experiment.chain`)."""

    model_config = ConfigDict(
        extra="allow", json_schema_extra={"minProperties": 2, "maxProperties": 2}
    )
    __pydantic_extra__: dict[str, dict[str, Coordinate]]

    n: int
    """number of coordinates, x_1 to x_n"""


def _refuse_coordinates(_: Any) -> Any:
    # coordinates with formulas are rewritten earlier (`vibsim.experiment.shorthand`)
    raise refused("each coordinate must have an acceleration, or a force with its mass")


@cache
def model_section(model: Model) -> type[Section]:
    """Return the section class of a model."""
    if model.loaded is not None:
        return StructureSection
    fields: dict[str, Any] = {"kind": _key(Literal[model.kind], model.title, ...)}
    for row in model.parameters:
        words = f"{row.description} [{row.unit}]"
        fields[row.name] = _key(_parameter_type(row), words, row.default)
    if model.named is not None:
        words = "names of the coordinates; the velocity of x is vx, that of u alone v"
        listed = Annotated[tuple[Text, ...], Field(min_length=1), short(MOST)]
        mapping = Annotated[dict[str, Coordinate], AfterValidator(_refuse_coordinates)]
        coordinates = by_form({"mapping": mapping, "other": listed})
        words += "; or a mapping of the names to the formulas of each"
        fields[COORDINATES] = _key(coordinates, words, model.positions)
        words = "the equation of one coordinate, such as u'' + u = 0, in place of its acceleration"
        fields["equation"] = _key(Text | None, words)
        words = "indices with first and last value: every key and entry with {i} in it is written out for each i"
        words += "; or a chain {n: 16, i: {x_i: ...}} with the formulas of each coordinate"
        fields["repeat"] = _key(dict[str, tuple[int, int]] | Chain | None, words)
    for field in model.formulas:
        names = ", ".join((*field.names, "parameters"))
        if model.named is not None:
            kinds = {"coordinates": model.position, "velocities": model.velocity, "t": "t"}
            known = [word for word, name in kinds.items() if name in field.names]
            names = " and ".join(filter(None, (", ".join(known), "parameters")))
        words = f"{field.description}; a formula in {names}"
        words += f"; {field.default} when left out" if field.default else ""
        fields[field.name] = _key(_formula_type(model, field) | None, words)
    if model.formulas:
        words = "names that the formulas use, with their values"
        fields["parameters"] = _key(Declared, words, {})
    if model.takes_events:
        words = "events: where a formula crosses 0, states get new values"
        fields["events"] = _key(Annotated[tuple[Event, ...], short(MOST_EVENTS)], words, ())
        words = "a comparison, u < 0 say, which ends the motion where it begins to hold"
        fields[STOP] = _key(FormulaText | None, words)
    doc = f"{model.title}: {model.equation} ({model.source})."
    return create_model(_class_name(model.kind), __base__=Section, __doc__=doc, **fields)
