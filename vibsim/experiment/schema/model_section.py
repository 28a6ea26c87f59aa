"""The section ``model`` as it is written: numbers, and formulas where the model takes some."""

from __future__ import annotations

import keyword
import re
from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import (
    AfterValidator,
    BeforeValidator,
    Discriminator,
    Field,
    StringConstraints,
    Tag,
    WithJsonSchema,
    create_model,
)
from pydantic_core import PydanticCustomError

from vibsim.experiment.schema.fields import FORMULA, TABLE, MadeSection, Number, Section, Text, tag
from vibsim.experiment.schema.scheme_section import class_name
from vibsim.formula import FUNCTIONS
from vibsim.models import FormulaField, Model

MAX_DECLARED = 50
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")


def _as_text(value: Any) -> Any:
    """Return a number as the text of a formula."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        return repr(value)
    if not isinstance(value, str):
        raise PydanticCustomError("formula", "must be a formula, or a number")
    return value


FormulaText = Annotated[
    str,
    StringConstraints(min_length=1),
    BeforeValidator(_as_text),
    WithJsonSchema({"type": ["string", "number"], "minLength": 1}),
]


def _declared(names: Mapping[str, float]) -> Mapping[str, float]:
    if len(names) > MAX_DECLARED:
        rule = f"must not have more than {MAX_DECLARED} parameters, has {len(names)}"
        raise PydanticCustomError("long", "{rule}", {"rule": rule})
    return names


Declared = Annotated[dict[str, Number], AfterValidator(_declared)]


def name_fault(name: str, taken: Mapping[str, str]) -> str:
    """Return what is wrong with the name of a declared parameter; empty for nothing.

    Parameters
    ----------
    taken
        Names that mean something already, with what they mean.
    """
    if keyword.iskeyword(name) or name in ("and", "or", "not", "if", "else"):
        return f"'{name}' is a word of the grammar of formulas and cannot be a name"
    if not _NAME.fullmatch(name):
        return "a name must consist of letters, digits and _, and begin with a letter"
    if name in FUNCTIONS:
        return f"'{name}' is a function"
    return f"'{name}' is {taken[name]}" if name in taken else ""


def _shape(value: Any) -> str:
    return tag("term") if isinstance(value, Mapping | Section) else tag("formula")


def _formula_type(model: Model, field: FormulaField) -> Any:
    if field.table is not None:
        return _formula_or(_table_section(model, field, field.table))
    if not field.terms:
        return FormulaText
    fields: dict[str, Any] = {
        word: (Annotated[float, FORMULA] | None, Field(default=None, description=f"b of {text}"))
        for word, text in field.terms.items()
    }
    section = create_model(
        f"{class_name(model.kind)}{class_name(field.name)}", __base__=MadeSection, **fields
    )
    return _formula_or(section)


def _formula_or(section: Any) -> Any:
    return Annotated[
        Annotated[FormulaText, Tag(tag("formula"))] | Annotated[section, Tag(tag("term"))],
        Discriminator(_shape),
    ]


def _table_section(model: Model, field: FormulaField, names: tuple[str, str]) -> type[Section]:
    """Return the class of ``{table: file}``; `names` are the keys for the columns, and their names by default."""
    words = f"path of a table, relative to this file: {field.description}"
    fields: dict[str, Any] = {
        TABLE: (Text, Field(description=f"{words}; a .csv or a .nc file")),
    }
    for name, what in zip(names, ("places", "values"), strict=True):
        told = f"name of the column of {what} in the table, or of the variable"
        fields[name] = (Text, Field(default=name, description=told))
    title = f"{class_name(model.kind)}{class_name(field.name)}Table"
    return create_model(title, __base__=MadeSection, **fields)


def model_section(model: Model) -> type[Section]:
    """Return the class of the section of a model."""
    fields: dict[str, Any] = {"kind": (Literal[model.kind], Field(description=model.title))}
    for row in model.parameters:
        bound: dict[str, float] = {}
        if row.minimum is not None:
            bound = {"gt": row.minimum} if row.exclusive else {"ge": row.minimum}
        if row.maximum is not None:
            bound["le"] = row.maximum
        description = f"{row.description} [{row.unit}]"
        number = Annotated[float, Field(**bound), FORMULA]
        fields[row.name] = (number, Field(default=row.default, description=description))
    for field in model.formulas:
        names = ", ".join((*field.names, "parameters"))
        words = f"{field.description}; a formula in {names}"
        words += f"; {field.default} when left out" if field.default else ""
        fields[field.name] = (
            _formula_type(model, field) | None,
            Field(default=None, description=words),
        )
    if model.formulas:
        words = "names that the formulas use, with their values"
        fields["parameters"] = (Declared, Field(default={}, description=words))
    doc = f"{model.title}: {model.equation} ({model.source})."
    return create_model(class_name(model.kind), __base__=MadeSection, __doc__=doc, **fields)
