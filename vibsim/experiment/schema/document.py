"""The structure of an experiment file, one class per section, and its JSON Schema for editors."""

from __future__ import annotations

import ast
import inspect
import sys
from collections import ChainMap
from collections.abc import Iterable, Mapping
from functools import cache, reduce
from itertools import pairwise
from operator import or_
from types import MappingProxyType
from typing import Annotated, Any, Literal

from pydantic import ConfigDict, Field, StrictBool, WithJsonSchema, create_model
from pydantic.json_schema import GenerateJsonSchema

from vibsim.experiment.kinds import Kinds
from vibsim.experiment.schema.checks import Check
from vibsim.experiment.schema.citation import Citation
from vibsim.experiment.schema.fields import (
    MAX_ENTRIES,
    MAX_LEVEL,
    Count,
    FormulaText,
    Fraction,
    Level,
    Number,
    Output,
    Positive,
    Section,
    Text,
    by_form,
    short,
)
from vibsim.experiment.schema.figures import FigureOfSource
from vibsim.experiment.schema.model_and_schemes import Event, model_section, scheme_section
from vibsim.experiment.schema.published import PublishedTable
from vibsim.experiment.schema.sweep import SweepSection, swept_options
from vibsim.models import MODELS, Model
from vibsim.models.shared.crossings import MOST_EVENTS
from vibsim.schemes import SCHEMES, Scheme

OF_KIND = object()  # marks a value whose section depends on its key ``kind``: model, schemes


def section_of_kind(section: str | int, raw: Any, kinds: Kinds) -> type[Section] | None:
    """Return the class of a model (if `section` is so called) or a scheme; None if it names no known kind."""
    kind = raw.get("kind") if isinstance(raw, Mapping) else None
    if section == "model":
        model = kinds.model(kind)
        return None if model is None else model_section(model)
    scheme = kinds.scheme(kind)
    return None if scheme is None else scheme_section(scheme)


def _without(*keys: str) -> dict[str, Any]:
    """Return the schema of a mapping with none of `keys`; names joined by a blank must not occur all together."""
    return {"not": {"anyOf": [{"required": key.split()} for key in keys]}}


class TimeSection(Section):
    """The time interval and the number of steps at level 0; level l has 2**l times as many."""

    model_config = ConfigDict(
        json_schema_extra={
            "oneOf": [
                {"required": ["end"]}
                | _without(
                    *("periods", "steps_per_period", "frequency", "steps_per_point"),
                    "base_steps base_dt",
                ),
                {"required": ["periods", "steps_per_period"]}
                | _without("end", "base_steps", "base_dt", "steps_per_point"),
                {"required": ["steps_per_point"]}
                | _without(
                    *("end", "base_steps", "base_dt", "periods", "steps_per_period", "frequency")
                ),
            ]
        }
    )

    end: Positive | None = None
    """The end time; the motion starts at 0."""
    base_steps: Count | None = None
    """Number of steps at level 0; 1 when left out."""
    base_dt: Positive | None = None
    """Time step at level 0, instead of `base_steps`; the end must be a whole multiple of it."""
    periods: Positive | None = None
    """Length in natural periods of the model (small oscillations), instead of `end`."""
    steps_per_period: Positive | None = None
    """Steps per natural period at level 0, with `periods`."""
    frequency: Text | None = None
    """A parameter of the model, such as `model.omega`: the angular frequency of a force, which defines the periods
    instead of the natural frequency. Both numbers must then be whole."""
    steps_per_point: Count | None = None
    """Steps at level 0 per spacing of the model's table; the motion ends with the table."""


class LevelRange(Section):
    """Consecutive levels, both ends included."""

    from_: Level = Field(alias="from")
    """The coarsest level."""
    to: Level
    """The finest level."""


class Every(Section):
    """Store every n-th step of each level."""

    every: Count
    """n; it must divide the number of steps of the coarsest level, at whose stored times levels are compared."""


_LevelList = Annotated[tuple[Level, ...], Field(min_length=1), short(MAX_LEVEL + 1)]
Levels: Any = by_form({"mapping": LevelRange, "other": _LevelList})
Samples: Any = by_form({"mapping": Every, "other": Literal["auto", "common", "all"]})


def _initial_schema(models: Iterable[Model]) -> dict[str, Any]:
    """Return the schema of the initial values, with the states of all models; a system may have others."""
    states = {state.name: state for model in models for state in model.states}
    properties = {
        name: {
            "type": ["number", "string"],
            "default": 0.0,
            "description": f"{state.long_name} [{state.unit}]",
        }
        for name, state in states.items()
    }
    others = {"type": ["number", "string"]}
    return {"type": "object", "properties": properties, "additionalProperties": others}


def _states_are_known(models: Iterable[Model]) -> dict[str, Any]:
    """Return the schema rule that initial values name states of some model, unless the file names the coordinates."""
    models = tuple(models)
    named = [model.kind for model in models if model.named is not None]
    states = sorted({state.name for model in models for state in model.states})
    kind = {"properties": {"kind": {"enum": named}}, "required": ["kind"]}
    return {
        "if": {"properties": {"model": {"not": kind}}},
        "then": {"properties": {"initial": {"propertyNames": {"enum": states}}}},
    }


UNITS_SCHEMA = {
    "type": "object",
    "additionalProperties": {"type": ["number", "string"]},
    "propertyNames": {"pattern": "^[^0-9\\s]+$"},
}


class Document(Section):
    """An experiment of vibsim: a simulation, and the claims about its outcome."""

    stand_ins = MappingProxyType({"title": None, "model": None, "time": None, "schemes": ()})

    title: Text
    """What the experiment shows, in one line."""
    source: Citation | None = None
    """The source of the experiment."""
    units: Annotated[dict[str, str], WithJsonSchema(UNITS_SCHEMA)] = Field({})
    """Additional units, such as ``rod: 4.9 m``, for all numbers that take units."""
    model: Annotated[Any, OF_KIND]
    """The equation of motion and its parameters."""
    stop: FormulaText | None = None
    """A comparison that ends the motion, the same as under `model`."""
    events: Annotated[tuple[Event, ...], short(MOST_EVENTS)] = ()
    """Events, the same as under `model`."""
    initial: dict[str, Number] = Field({})
    """Initial values of the states; 0 for those left out."""
    time: TimeSection
    """The time interval and the number of steps."""
    levels: Levels | None = None
    """The levels of refinement: each halves the time step of the previous one."""
    tolerance: Fraction | None = None
    """Error bound that the extrapolated solution must reach; vibsim then chooses the levels."""
    scaled: StrictBool = False
    """Whether to run in the characteristic units of the model, if it has a scaled equation."""
    schemes: Annotated[tuple[Annotated[Any, OF_KIND], ...], Field(min_length=1), short(MAX_ENTRIES)]
    """The schemes, each a kind or a mapping with its options."""
    sweep: SweepSection | None = None
    """Parameters that vary, by dotted path; several make a grid, in which the last one varies fastest."""
    samples: Samples = "auto"
    """Which steps are stored."""
    output: Output = "verdict"
    """The result: a verdict, or also the best solution, extrapolated over the levels."""
    checks: Annotated[tuple[Check, ...], short(MAX_ENTRIES)] = ()
    """Expected outcomes; when left out, the position converges with the order of the scheme."""
    published: Annotated[tuple[PublishedTable, ...], short(MAX_ENTRIES)] = ()
    """Tables printed in a source: every row is a claim, shown next to the computed number."""
    figures: Annotated[tuple[FigureOfSource, ...], short(MAX_ENTRIES)] = ()
    """Figures of a source: the report redraws each under its original number."""


class _Generator(GenerateJsonSchema):
    """Uses attribute docstrings as descriptions of fields, and leaves out the titles that pydantic generates.

    Pydantic would read the docstrings at every start of vibsim (`use_attribute_docstrings`), which takes 0.1 s. Only
    the schema needs them.
    """

    def field_title_should_be_set(self, schema: Any) -> bool:
        return False

    def tagged_union_schema(self, schema: Any) -> dict[str, Any]:
        # a value may match the schemas of several members, so oneOf would refuse it
        result = super().tagged_union_schema(schema)
        return {"anyOf" if key == "oneOf" else key: value for key, value in result.items()}

    def model_schema(self, schema: Any) -> dict[str, Any]:
        result, kind = super().model_schema(schema), schema["cls"]
        kinds = (base for base in kind.mro() if issubclass(base, Section))
        descriptions = ChainMap(
            *(_attribute_docstrings(c.__module__).get(c.__name__, {}) for c in kinds)
        )
        for name, field in kind.model_fields.items():
            if field.description is None and name in descriptions:
                result["properties"][field.alias or name]["description"] = descriptions[name]
        return result


@cache
def _attribute_docstrings(name: str) -> dict[str, dict[str, str]]:
    """Return the attribute docstrings of each class of a module, by names of class and field."""
    tree = ast.parse(inspect.getsource(sys.modules[name]))
    texts: dict[str, dict[str, str]] = {}
    for node in (node for node in tree.body if isinstance(node, ast.ClassDef)):
        for field, text in pairwise(node.body):
            match field, text:
                case (
                    ast.AnnAssign(target=ast.Name(id=key)),
                    ast.Expr(value=ast.Constant(value=str(words))),
                ):
                    texts.setdefault(node.name, {})[key] = inspect.cleandoc(words)
    return texts


def json_schema(kind: type[Section]) -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of files described by class `kind`."""
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema"}
    return head | kind.model_json_schema(schema_generator=_Generator)


def schema() -> dict[str, Any]:
    """Return the JSON Schema of an experiment file with the built-in models and schemes."""
    return _schema(MODELS.built_in, SCHEMES.built_in)


def installed_schema() -> dict[str, Any]:
    """Return the same with the models and schemes of all installed packages."""
    return _schema(MODELS, SCHEMES)


def _schema(models: Mapping[str, Model], schemes: Mapping[str, Scheme]) -> dict[str, Any]:
    initial = WithJsonSchema(_initial_schema(models.values()))
    any_model: Any = reduce(or_, map(model_section, models.values()))
    words = {
        "type": "string",
        "enum": sorted(schemes),
        "description": "A scheme with its defaults.",
    }
    sections = map(scheme_section, schemes.values())
    any_scheme: Any = reduce(or_, sections, Annotated[str, WithJsonSchema(words)])
    fields: dict[str, Any] = {
        "model": (any_model, ...),
        "initial": (Annotated[dict[str, Number], initial], {}),
        "schemes": (Annotated[tuple[any_scheme, ...], Field(min_length=1)], ...),
    }
    document = create_model("Document", __base__=Document, __doc__=Document.__doc__, **fields)
    extra = {"oneOf": [{"required": ["levels"]}, {"required": ["tolerance"]}]}
    document.model_config["json_schema_extra"] = extra | _states_are_known(models.values())
    result = json_schema(document)
    result["$defs"]["SweepSection"]["patternProperties"] = swept_options(schemes.values())
    return result
