"""The structure of the file of an experiment with a solver of the user, one class per section, and its JSON Schema."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, get_args

from pydantic import BeforeValidator, ConfigDict, Field

from vibsim.core.vocabulary import Restriction
from vibsim.experiment.schema.checks import Accuracy, Expect, MeasuringCheck, one_of
from vibsim.experiment.schema.citation import Citation
from vibsim.experiment.schema.document import Levels, json_schema
from vibsim.experiment.schema.fields import (
    MAX_ENTRIES,
    STAND_IN,
    Count,
    FormulaText,
    Line,
    NonNegative,
    Number,
    Positive,
    Section,
    Text,
    by_form,
    refused,
    short,
)
from vibsim.experiment.schema.sweep import ParameterSweep

Kind = Literal["command", "python", "files"]
KINDS: tuple[Kind, ...] = get_args(Kind)  # kinds of solvers, each a key of the section ``solver``
PLACE = "output"  # placeholder of the file that a command writes
RESERVED = (PLACE, "level", "levels", "threads", "case")  # names that nothing else may have
MOST_LEVELS = 100


def _function(value: Any) -> Any:
    module, colon, name = value.partition(":") if isinstance(value, str) else ("", "", "")
    parts = [*module.split("."), name]
    if not colon or not all(part.isidentifier() and part.isascii() for part in parts):
        raise refused("must be module:function", "e.g. heat:solve")
    return value


Function = Annotated[str, BeforeValidator(_function)]


class SolverSection(Section):
    """How a level is computed: by a command, by a Python function, or not at all because its file exists."""

    model_config = ConfigDict(json_schema_extra={"oneOf": [{"required": [kind]} for kind in KINDS]})
    stand_ins = MappingProxyType({})

    command: Line | None = None
    """A program with its arguments, run without a shell in the folder of this file. `{h}` stands for a size or a swept
    parameter, `{output}` for the netCDF or CSV file to write (`{output.csv}` if the program goes by the ending), and
    `{threads}` for the number of threads."""
    python: Function | None = None
    """`module:function`, called with sizes and swept parameters by their names; it returns an `xarray.Dataset`."""
    files: Line | None = None
    """The path of a netCDF or CSV file for each level, from the folder of this file, with placeholders."""
    inputs: Annotated[tuple[Line, ...], short(MAX_ENTRIES)] = ()
    """Files that the solver reads or consists of; when one changes, all levels are computed again."""


_List = Annotated[tuple[Number, ...], Field(min_length=1), short(MOST_LEVELS)]
if TYPE_CHECKING:
    Sizes = tuple[float, ...] | str
else:
    Sizes = by_form({"text": Line, "other": _List})


class RefineSection(Section):
    """What differs between levels: for each name a list of values, or a formula in `level`. The first is the step size.

    Several names are refined together.
    """

    model_config = ConfigDict(extra="allow", json_schema_extra={"minProperties": 1})
    __pydantic_extra__: dict[str, Sizes]
    stand_ins = MappingProxyType({})
    other_values = Sizes

    levels: Levels | None = None
    """The levels, for formulas in `level` such as `h: 1/2**level`."""

    @property
    def sizes(self) -> Mapping[str, tuple[float, ...] | str]:
        """Values or formula of each name."""
        return self.__pydantic_extra__ or {}


class QuantitySection(Section):
    """A variable or a column of the output."""

    stand_ins = MappingProxyType({})
    coordinates: Annotated[tuple[Line, ...], Field(min_length=1)] | None = None
    """Names of the coordinates that it must have; when left out, it is a number, or has the coordinates of the file."""
    restrict: Restriction = "subset"
    """How levels are restricted to common points."""
    exact: FormulaText | None = None
    """The exact values, if they are known: a number, or a formula in its coordinates and in swept numbers."""
    noise: NonNegative | None = None
    """Root mean square of the noise of each level (an iteration that stops early, printed digits)."""


class SolverConvergesCheck(MeasuringCheck):
    """A quantity converges."""

    kind: ClassVar[Literal["converges"]] = "converges"
    stand_ins = MappingProxyType({"converges": STAND_IN})
    converges: Text
    """The quantity."""
    order: Positive | None = None
    """The expected order."""
    at_least: Positive | None = None
    """The lowest expected order; without this and `order`, any credible order passes."""
    expect: Expect = Expect()
    """The verdict that passes; PASS when left out."""


class SolverAccurateCheck(Accuracy):
    """The error of the finest level is small enough."""


CHECKS: Mapping[str, type[Section]] = MappingProxyType(
    {"converges": SolverConvergesCheck, "accurate": SolverAccurateCheck}
)
"""All kinds of checks on the levels of a solver, by leading key."""
if TYPE_CHECKING:
    SolverCheck = SolverConvergesCheck | SolverAccurateCheck
else:
    SolverCheck = one_of(CHECKS)


class ResourcesSection(Section):
    """Resources that one level needs, for Snakemake."""

    mem_mb: Count = 1000
    """Memory [MB]: as many jobs run at once as fit."""
    runtime: Count | None = None
    """Run time [min], for clusters that require it; vibsim itself enforces no limit."""
    threads: Count = 1
    """Number of cores."""


class SolverDocument(Section):
    """An experiment with a solver of the user."""

    stand_ins = MappingProxyType({"title": None, "solver": None, "refine": None, "quantities": {}})

    title: Text
    """What the experiment shows, in one line."""
    source: Citation | None = None
    """The source of the experiment."""
    solver: SolverSection
    """How a level is computed."""
    refine: RefineSection
    """What differs between levels."""
    quantities: Annotated[dict[str, QuantitySection], Field(min_length=1)]
    """The quantities that are judged: variables or columns of the output, by name."""
    checks: Annotated[tuple[SolverCheck, ...], short(MAX_ENTRIES)] = ()
    """Expected outcomes; when left out, every quantity converges."""
    resources: ResourcesSection = ResourcesSection()
    """Resources that one level needs."""
    sweep: ParameterSweep | None = None
    """Parameters that vary; every member has all levels."""


def schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of an experiment file with a solver of the user."""
    return json_schema(SolverDocument)
