"""A validated experiment as data: every default filled in, every number a number, nothing that could change.

What reads an experiment or makes another one of it stands above: see `vibsim.experiment.experiment`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

from pydantic import AfterValidator, Field, PrivateAttr, StrictBool

from vibsim.core.errors import Fault, InputError, VibsimError
from vibsim.core.set_option import command_to_run
from vibsim.experiment.collection import ADHOC
from vibsim.experiment.schema.checks import Check, ConservesCheck, EqualCheck, ValueCheck
from vibsim.experiment.schema.fields import (
    DECLARED,
    Count,
    FrozenDict,
    Identifier,
    Level,
    Output,
    Positive,
    Section,
    Text,
)
from vibsim.experiment.schema.figures import FigureOfSource
from vibsim.experiment.schema.published import PublishedTable
from vibsim.experiment.schema.sweep import Axis
from vibsim.models import MODELS, Model, centred, natural_end, quantities, table_end
from vibsim.models.structure import Structure
from vibsim.models.table import Table
from vibsim.schemes import SCHEMES, Scheme

Numbers = Annotated[dict[str, float], AfterValidator(FrozenDict)]
Options = Annotated[dict[str, StrictBool | float | str], AfterValidator(FrozenDict)]


class TableSpec(Section):
    """A table in place of a formula: where it stands, and which numbers it had when the experiment was read."""

    file: Text
    """Path of the file, relative to the folder of the experiment file."""
    place: Text
    value: Text
    """Names of the columns of places and values."""
    numbers: Text
    """SHA-256 of the numbers (`vibsim.models.table.Table.digest`), on which results depend alone."""
    is_met: bool = False
    """Whether a step of every member ends at every point (`vibsim.models.table.Lookup.is_met`)."""
    _table: Table | None = PrivateAttr(default=None)
    _content: str = PrivateAttr(default="")

    def hold(self, table: Table, content: str) -> None:
        """Take the numbers of the file, and the SHA-256 of its bytes, which are no part of an experiment's identity."""
        self._table, self._content = table, content

    @property
    def content(self) -> str:
        """SHA-256 of the bytes of the file, as it was read."""
        return self._content

    @property
    def table(self) -> Table:
        """The numbers, which `vibsim.experiment.tables.file.attach` puts there."""
        if self._table is None:
            raise VibsimError(f"the table {self.file} was not read")
        return self._table


class ArraySpec(Section):
    """A matrix or a vector of a structure: of a file, as numbers, by degree of freedom, or the shape of a mode."""

    file: Text | None = None
    """Path of the file, relative to the folder of the experiment file."""
    columns: tuple[Text, Text] | None = None
    """Names of the columns of times and loads, where the file is the table of a load."""
    rows: tuple[tuple[float, ...] | float, ...] = ()
    entries: tuple[tuple[int, float], ...] = ()
    mode: int | None = None
    size: float = 1.0
    """What the first observed displacement has of the shape of a mode."""
    numbers: str = ""
    """SHA-256 of the numbers of a file, on which results depend alone."""


class StructureSpec(Section):
    """What a file says of a linear structure beside formulas and parameters."""

    arrays: Annotated[dict[str, ArraySpec], AfterValidator(FrozenDict)]
    """By key: ``mass``, ``stiffness``, ``damping``, ``load.0``, ``history.0`` (its table), ``start.displacement``."""
    ratios: tuple[float, ...] = ()
    """Damping ratios of the lowest modes."""
    observe: tuple[tuple[Text, tuple[tuple[int, float], ...]], ...] = ()
    """By name the factors of degrees of freedom, counted from 1."""
    is_free: bool = False
    """Whether the motion begins as the section ``initial`` says."""
    _structure: Structure | None = PrivateAttr(default=None)
    _files: tuple[tuple[str, str], ...] = PrivateAttr(default=())

    def hold(self, structure: Structure, files: tuple[tuple[str, str], ...]) -> None:
        """Take the numbers, and path and SHA-256 of the bytes of each file, no part of an experiment's identity."""
        self._structure, self._files = structure, files

    @property
    def files(self) -> tuple[tuple[str, str], ...]:
        """Path of each file, and SHA-256 of its bytes, as it was read."""
        return self._files

    @property
    def structure(self) -> Structure:
        """The numbers, which `vibsim.experiment.tables.structure.attach` puts there."""
        if self._structure is None:
            raise VibsimError("the matrices of the structure were not read")
        return self._structure


class ModelSpec(Section):
    """The model, with every parameter."""

    kind: Text
    parameters: Numbers
    """By the place of each in the section: ``m``, ``damping.linear``, ``parameters.k``."""
    formulas: Annotated[dict[str, str], AfterValidator(FrozenDict)] = FrozenDict()
    """What the file writes as formulas: the keys are those of `vibsim.models.Model.written`."""
    coordinates: tuple[Text, ...] = ()
    """Their names, where the model leaves these to a file (`vibsim.models.Model.named`)."""
    tables: Annotated[dict[str, TableSpec], AfterValidator(FrozenDict)] = FrozenDict()
    """Tables that stand in place of formulas, by the same names."""
    terms: tuple[Text, ...] = ()
    """Which of `vibsim.models.Model.optional` the equation has: those that are not neutral, or are swept."""

    structure: StructureSpec | None = None
    """The matrices of a linear structure (`vibsim.models.structure`)."""

    _own: Model | None = PrivateAttr(default=None)

    def hold(self, model: Model) -> None:
        """Take the model of this kind, where a program hands it over and none is registered."""
        self._own = model

    @property
    def files(self) -> tuple[tuple[str, str], ...]:
        """Path of each file that the section names, and SHA-256 of its bytes, as it was read."""
        tables = tuple((row.file, row.content) for row in self.tables.values())
        return (*tables, *(self.structure.files if self.structure is not None else ()))

    @property
    def base(self) -> Model:
        """The model of this kind, without what the section says of it."""
        model = self._own or MODELS[self.kind]
        return model.named(self.coordinates) if model.named is not None else model

    @property
    def definition(self) -> Model:
        """The equation of motion that this section describes."""
        keys = (key.partition(".") for key in self.parameters)
        declared = tuple(name for section, _, name in keys if section == DECLARED)
        numbers: list[Any] = [x for row in self.tables.values() for x in (row.table, row.is_met)]
        numbers += [self.structure.structure] if self.structure is not None else []
        return self.base.with_formulas(self.formulas, declared, *numbers).with_terms(self.terms)


class TimeSpec(Section):
    """The time interval and the number of steps at level 0."""

    end: Positive
    """The last time of a member that is not swept."""
    base_steps: Count
    """Steps at level 0."""
    periods: float | None = None
    """The end in periods, where the file gives it so: each member then has its own end."""
    frequency: str | None = None
    """The parameter of the model whose periods these are, an angular frequency; natural periods where None."""
    steps_per_point: int | None = None
    """Steps at level 0 from a point of the model's table to the next, where the file gives these instead of an end."""

    @property
    def is_of_model(self) -> bool:
        """Whether the end follows from the parameters of the model."""
        return self.periods is not None or self.steps_per_point is not None

    def end_of(self, model: Model, parameters: Mapping[str, Any]) -> Any:
        """Return the end time of members with these `parameters` (numbers or arrays), unless swept."""
        if self.periods is not None and self.frequency is not None:
            return self.periods * (2.0 * math.pi / parameters[self.frequency])
        if self.periods is not None:
            return natural_end(model, self.periods, parameters)
        return self.end if self.steps_per_point is None else table_end(model, parameters)


class Scaling(Section):
    """What leads back from a run in characteristic units; the numbers of the run itself are dimensionless."""

    scales: Numbers
    """The characteristic scales: ``t``, every state, ``energy``."""
    parameters: Numbers
    """As in the file, in the units of the model."""
    initial: Numbers
    end: Positive


class SchemeSpec(Section):
    """A scheme, with every option."""

    name: Text
    """The label, else the kind."""
    kind: Text
    options: Options
    _own: Scheme | None = PrivateAttr(default=None)

    def hold(self, scheme: Scheme) -> None:
        """Take the scheme of this kind, where a program hands it over and none is registered."""
        self._own = scheme

    @property
    def method(self) -> Scheme:
        """The scheme of this kind, which is the same with any options."""
        return self._own or SCHEMES[self.kind]

    @property
    def adaptive(self) -> bool:
        """Whether it chooses its own steps, outside the ladder."""
        return self.method.adaptive

    @property
    def own_velocity(self) -> bool:
        """Whether it has another velocity than the centred difference ``[D_2t u]``, which is then kept beside it."""
        return not self.adaptive and self.method.stepper(self.options).own_velocity


class Sweep(Section):
    """Parameters that vary: a grid, the last axis fastest."""

    axes: tuple[Axis, ...]
    """In the order written."""
    follow: str | None = None
    """A key of the last axis, where each member along that starts from the last state of the one before."""

    @property
    def keys(self) -> tuple[str, ...]:
        """Dotted keys of everything that varies, in the order written."""
        return tuple(key for axis in self.axes for key in axis.keys)

    @property
    def count(self) -> int:
        """Number of members."""
        return math.prod(axis.count for axis in self.axes)

    @property
    def chain(self) -> int:
        """Number of members that start one from the other; 1 where all start as the file says."""
        return self.axes[-1].count if self.follow else 1

    @property
    def _spans(self) -> Iterator[tuple[str, Any, Any]]:
        for axis in self.axes:
            yield from ((key, *span) for key, span in zip(axis.keys, axis.spans, strict=True))

    def least_end(self, time: TimeSpec) -> float:
        """Return the earliest end of a member, as far as the sweep gives it."""
        ends = (float(low) for key, low, _ in self._spans if key == "time.end")
        return min(ends, default=time.end)

    def fixed_end(self, time: TimeSpec) -> float | None:
        """Return the end that every member has, None where the end varies.

        One that follows from the model counts as different as soon as a parameter of the model is.
        """
        differ = [key for key, low, high in self._spans if low != high]
        by_model = time.is_of_model and any(key.startswith("model.") for key in differ)
        return None if by_model or "time.end" in differ else self.least_end(time)


class ReadExperiment(Section):
    """What every experiment is called, and where it was read."""

    collection: Identifier
    name: Identifier
    title: Text
    source: Text | None
    _file: Path | None = PrivateAttr(default=None)
    _settings: tuple[str, ...] = PrivateAttr(default=())

    @property
    def file(self) -> Path | None:
        """Where it was read; not part of its identity."""
        return self._file

    @property
    def folder(self) -> Path:
        """Folder of that file, from which paths start, and where a command runs."""
        return self._file.parent if self._file else Path()

    @property
    def settings(self) -> tuple[str, ...]:
        """What a command line gave in place of values of the file, as ``KEY=VALUE``; not part of its identity."""
        return self._settings

    @property
    def word(self) -> str:
        """How a command line names the experiment.

        One that comes with vibsim is named by its collection, any other by its file, in the folder of that file:
        results hold no path of a machine, and are the same wherever they are made.
        """
        file = self._file or Path(f"{self.name}.yaml")
        word = file.name if self.collection == ADHOC else f"{self.collection}/{file.stem}"
        is_whole = self.name == file.stem
        return word if is_whole else f"{word}@{self.name.removeprefix(f'{file.stem}_case_')}"

    def command_of(self, case: int) -> str:
        """Return the command that runs one member of the sweep alone."""
        return command_to_run(f"{self.word}@{case}", self.settings)


class ExperimentSpec(ReadExperiment):
    """The fields of an experiment, and what follows from them alone."""

    model: ModelSpec
    initial: Numbers
    """Initial value of every state."""
    time: TimeSpec
    levels: tuple[Level, ...]
    """Strictly increasing; none where `tolerance` is still to choose them."""
    schemes: tuple[SchemeSpec, ...]
    sweep: Sweep | None = None
    samples: Annotated[int, Field(ge=1)] | Literal["auto", "common", "all"] = "auto"
    """Which steps are stored; a number n stands for every n-th of each level."""
    output: Output = "verdict"
    """``best`` where the extrapolated solution is wanted beside the verdict."""
    tolerance: float | None = None
    """Error bound that chooses the levels; None where the file gives them."""
    checks: tuple[Check, ...] = ()
    """As written, and behind them one claim for every row of `published`."""
    published: tuple[PublishedTable, ...] = ()
    """Tables of numbers that a source printed."""
    figures: tuple[FigureOfSource, ...] = ()
    """Figures that a source shows, which the page draws."""
    units: Annotated[dict[str, str], AfterValidator(FrozenDict)] = FrozenDict()
    """Units that the file defines, in SI base units; every number is converted already."""
    scaling: Scaling | None = None
    """Present where the run is made in the characteristic units of the model."""
    _notes: tuple[tuple[int, str], ...] = PrivateAttr(default=())

    @property
    def notes(self) -> tuple[tuple[int, str], ...]:
        """What the file says and probably does not mean: line (0 without one) and text; not part of its identity."""
        return self._notes

    @property
    def members(self) -> int:
        """Number of members of the sweep, 1 without one."""
        return self.sweep.count if self.sweep else 1

    @property
    def chain(self) -> int:
        """Number of members that start one from the other (`Sweep.chain`)."""
        return self.sweep.chain if self.sweep else 1

    @property
    def trajectories(self) -> int:
        """Number of schemes times number of members."""
        return len(self.schemes) * self.members

    @property
    def end_varies(self) -> bool:
        """Whether the end time differs between members, so that ``t`` is the fraction 0 to 1 of it."""
        return self.sweep is not None and self.sweep.fixed_end(self.time) is None

    @property
    def written(self) -> tuple[Check, ...]:
        """The checks without those of `published`."""
        rows = sum(len(table.rows) for table in self.published)
        return self.checks[: len(self.checks) - rows]

    @property
    def ladder(self) -> tuple[int, ...]:
        """Numbers of the schemes that take equal steps, and so have levels to compare; at least one."""
        return tuple(i for i, scheme in enumerate(self.schemes) if not scheme.adaptive)

    @property
    def own_velocity(self) -> bool:
        """Whether some scheme has another velocity than the centred difference ``[D_2t u]``, without events."""
        smooth = self.model.definition.events is None
        return smooth and any(scheme.own_velocity for scheme in self.schemes)

    @property
    def quantities(self) -> tuple[str, ...]:
        """Names of every quantity that is kept as a series where storage is not bounded."""
        return quantities(self.model.definition, self.own_velocity)

    def natural_end(self, parameters: Mapping[str, Any]) -> Any:
        """Return the end time of a member with these `parameters` (numbers or arrays), unless swept."""
        return self.time.end_of(self.model.definition, parameters)

    def steps(self, level: int) -> int:
        """Return the number of steps at `level`: ``base_steps * 2**level``."""
        return self.time.base_steps << level

    def __eq__(self, other: object) -> bool:
        return isinstance(other, ExperimentSpec) and self.__dict__ == other.__dict__

    def __hash__(self) -> int:
        return hash(tuple(self.__dict__.values()))


AnyExperiment = TypeVar("AnyExperiment", bound=ExperimentSpec)
"""The class of an experiment, which stays the same where one is made of another."""


def check_member(case: int, members: int, name: str) -> None:
    """Refuse a member that an experiment has not, which is read from a file called `name`."""
    if not 0 <= case < members:
        there = "there is 1 member" if members == 1 else f"there are {members} members"
        rule = f"a case must be from 0 to {members - 1}"
        raise InputError([Fault(name, 0, "", str(case), rule, there)])


def schemes_of(experiment: ExperimentSpec, check: Check) -> tuple[int, ...]:
    """Return the numbers of the schemes that a check, or that inside a claim, is about, increasing.

    They are those that it names. Where it names none, they are those with equal steps; and where it is about what only
    schemes with a velocity of their own have, those.
    """
    inner = check.measured
    named: tuple[str, ...] | None
    if isinstance(inner, ValueCheck):
        named = None if inner.at.scheme is None else (inner.at.scheme,)
    else:
        named = inner.equal if isinstance(inner, EqualCheck) else inner.schemes
    if named is not None:
        return tuple(i for i, scheme in enumerate(experiment.schemes) if scheme.name in named)
    quantity = inner.conserves if isinstance(inner, ConservesCheck) else inner.about
    if quantity not in centred(experiment.model.definition):
        return experiment.ladder
    return tuple(i for i in experiment.ladder if experiment.schemes[i].own_velocity)
