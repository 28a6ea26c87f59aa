"""A validated experiment as immutable data: all defaults filled in, all numbers converted to floats.

Methods that read an experiment or derive another one are in `vibsim.experiment.experiment`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

from pydantic import AfterValidator, Field, PrivateAttr, StrictBool

from vibsim.core.errors import Fault, InputError
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
    """A table that replaces a formula: its file, and the digest of its numbers when the experiment was read."""

    file: Text
    """Path of the file, relative to the folder of the experiment file."""
    place: Text
    value: Text
    """Names of the columns of abscissae (`place`) and ordinates (`value`)."""
    numbers: Text
    """SHA-256 of the numbers (`vibsim.models.table.Table.digest`). Results depend on the file only through it."""
    is_met: bool = False
    """Whether the time steps of every member hit every point of the table (`vibsim.models.table.Lookup.is_met`)."""
    _table: Table | None = PrivateAttr(default=None)
    _content: str = PrivateAttr(default="")

    def hold(self, table: Table, content: str) -> None:
        """Attach the numbers of the file and the SHA-256 of its bytes. Neither is part of the experiment's identity."""
        self._table, self._content = table, content

    @property
    def table(self) -> Table:
        """The numbers, attached by `vibsim.experiment.tables.file.attach`."""
        assert self._table is not None
        return self._table


class ArraySpec(Section):
    """A matrix or vector of a structure: a file, rows of numbers, single entries, or a multiple of a mode shape."""

    file: Text | None = None
    """Path of the file, relative to the folder of the experiment file."""
    columns: tuple[Text, Text] | None = None
    """Names of the columns of times and loads, if the file is a load table."""
    rows: tuple[tuple[float, ...] | float, ...] = ()
    entries: tuple[tuple[int, float], ...] = ()
    mode: int | None = None
    size: float = 1.0
    """First observed displacement when the array is a mode shape; it scales the shape."""
    numbers: str = ""
    """SHA-256 of the numbers of the file. Results depend on the file only through it."""


class StructureSpec(Section):
    """The data of a linear structure other than its formulas and parameters."""

    arrays: Annotated[dict[str, ArraySpec], AfterValidator(FrozenDict)]
    """Keys: ``mass``, ``stiffness``, ``damping``, ``load.0``, ``history.0`` (its table), ``start.displacement``."""
    ratios: tuple[float, ...] = ()
    """Damping ratios of the lowest modes."""
    observe: tuple[tuple[Text, tuple[tuple[int, float], ...]], ...] = ()
    """Observed displacements: name, and a linear combination as pairs (degree of freedom from 1, factor)."""
    is_free: bool = False
    """Whether the section ``initial`` gives the start of the motion."""
    _structure: Structure | None = PrivateAttr(default=None)
    _files: tuple[tuple[str, str], ...] = PrivateAttr(default=())

    def hold(self, structure: Structure, files: tuple[tuple[str, str], ...]) -> None:
        """Attach the numbers, and path and SHA-256 of each file. Neither is part of the experiment's identity."""
        self._structure, self._files = structure, files

    @property
    def structure(self) -> Structure:
        """The numbers, attached by `vibsim.experiment.tables.structure.attach`."""
        assert self._structure is not None
        return self._structure


class ModelSpec(Section):
    """The model, with every parameter."""

    kind: Text
    parameters: Numbers
    """Keys are dotted paths within the section: ``m``, ``damping.linear``, ``parameters.k``."""
    formulas: Annotated[dict[str, str], AfterValidator(FrozenDict)] = FrozenDict()
    """The formulas of the file, with the keys of `vibsim.models.Model.written`."""
    coordinates: tuple[Text, ...] = ()
    """Names of the coordinates, if the file chooses them (`vibsim.models.Model.named`)."""
    tables: Annotated[dict[str, TableSpec], AfterValidator(FrozenDict)] = FrozenDict()
    """Tables that replace formulas, with the same keys."""
    terms: tuple[Text, ...] = ()
    """Optional terms (`vibsim.models.Model.optional`) in the equation: those that are not neutral or are swept."""
    structure: StructureSpec | None = None
    """The matrices of a linear structure (`vibsim.models.structure`)."""

    _own: Model | None = PrivateAttr(default=None)

    def hold(self, model: Model) -> None:
        """Attach the model itself, if a program passes one that is not registered."""
        self._own = model

    @property
    def files(self) -> tuple[tuple[str, str], ...]:
        """Path of each file that the section names, and SHA-256 of its bytes when it was read."""
        tables = tuple((row.file, row._content) for row in self.tables.values())
        return tables + (self.structure._files if self.structure is not None else ())

    @property
    def base(self) -> Model:
        """The model of this kind, before formulas, parameters and tables of the section are put in."""
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
    """End time, unless swept. With `periods` or `steps_per_point` it belongs to the unswept parameters."""
    base_steps: Count
    """Steps at level 0."""
    periods: float | None = None
    """The end in periods, if the file gives it so. Each member then has its own end time."""
    frequency: str | None = None
    """Model parameter (an angular frequency) that defines the periods; None for natural periods."""
    steps_per_point: int | None = None
    """Steps at level 0 per spacing of the model's table, if the file gives these instead of an end."""

    @property
    def is_of_model(self) -> bool:
        """Whether the end follows from the parameters of the model."""
        return self.periods is not None or self.steps_per_point is not None

    def end_of(self, model: Model, parameters: Mapping[str, Any]) -> Any:
        """Return the end time for these `parameters` (numbers or arrays), if the end itself is not swept."""
        if self.periods is not None and self.frequency is not None:
            return self.periods * (2.0 * math.pi / parameters[self.frequency])
        if self.periods is not None:
            return natural_end(model, self.periods, parameters)
        return self.end if self.steps_per_point is None else table_end(model, parameters)


class Scaling(Section):
    """What converts a dimensionless run back to the units of the model."""

    scales: Numbers
    """The characteristic scales: ``t``, every state, ``energy``."""
    parameters: Numbers
    """Parameters as in the file, in the units of the model; so are `initial` and `end`."""
    initial: Numbers
    end: Positive


class SchemeSpec(Section):
    """A scheme, with every option."""

    name: Text
    """The label if there is one, otherwise the kind."""
    kind: Text
    options: Options
    _own: Scheme | None = PrivateAttr(default=None)

    def hold(self, scheme: Scheme) -> None:
        """Attach the scheme itself, if a program passes one that is not registered."""
        self._own = scheme

    @property
    def method(self) -> Scheme:
        """The scheme of this kind; it does not depend on the options."""
        return self._own or SCHEMES[self.kind]

    @property
    def adaptive(self) -> bool:
        """Whether the scheme is adaptive: it chooses its own steps and has no levels."""
        return self.method.adaptive

    @property
    def own_velocity(self) -> bool:
        """Whether its velocity differs from the centred difference ``[D_2t u]``; both are then stored."""
        return not self.adaptive and self.method.stepper(self.options).own_velocity


class Sweep(Section):
    """Parameters that vary: a grid of members in which the last axis varies fastest."""

    axes: tuple[Axis, ...]
    """In the order of the file."""
    follow: str | None = None
    """A key of the last axis: each member along it starts from the final state of the previous one."""

    @property
    def keys(self) -> tuple[str, ...]:
        """Dotted keys of all swept parameters, in the order of the file."""
        return tuple(key for axis in self.axes for key in axis.keys)

    @property
    def count(self) -> int:
        """Number of members."""
        return math.prod(axis.count for axis in self.axes)

    @property
    def chain(self) -> int:
        """Length of a chain of members that each start from the previous one; 1 without `follow`."""
        return self.axes[-1].count if self.follow else 1

    @property
    def _spans(self) -> Iterator[tuple[str, Any, Any]]:
        for axis in self.axes:
            yield from ((key, *span) for key, span in zip(axis.keys, axis.spans, strict=True))

    def least_end(self, time: TimeSpec) -> float:
        """Return the smallest end time in the sweep; without a swept end, that of the file."""
        ends = (float(low) for key, low, _ in self._spans if key == "time.end")
        return min(ends, default=time.end)

    def fixed_end(self, time: TimeSpec) -> float | None:
        """Return the end time shared by all members, None if it varies.

        An end that follows from the model counts as varying as soon as any model parameter does.
        """
        differ = [key for key, low, high in self._spans if low != high]
        by_model = time.is_of_model and any(key.startswith("model.") for key in differ)
        return None if by_model or "time.end" in differ else self.least_end(time)


class ReadExperiment(Section):
    """The names of an experiment, and where it was read."""

    collection: Identifier
    name: Identifier
    title: Text
    source: Text | None
    _file: Path | None = PrivateAttr(default=None)
    _settings: tuple[str, ...] = PrivateAttr(default=())

    @property
    def file(self) -> Path | None:
        """The experiment file, None if there is none; not part of the identity."""
        return self._file

    @property
    def folder(self) -> Path:
        """Folder of that file. Relative paths start here, and commands of the user run here."""
        return self._file.parent if self._file else Path()

    @property
    def settings(self) -> tuple[str, ...]:
        """Overrides of the command line, as ``KEY=VALUE``; not part of the identity."""
        return self._settings

    @property
    def word(self) -> str:
        """The argument that names the experiment on a command line.

        It is ``collection/name`` for a shipped experiment, else the file name without its folder: results hold no path
        of a machine, so they are the same wherever they are made.
        """
        file = self._file or Path(f"{self.name}.yaml")
        word = file.name if self.collection == ADHOC else f"{self.collection}/{file.stem}"
        is_whole = self.name == file.stem
        return word if is_whole else f"{word}@{self.name.removeprefix(f'{file.stem}_case_')}"

    def refused(self, key: str, value: str, rule: str, hint: str = "") -> InputError:
        """Return the error of a value of the file that breaks a rule only when it is used."""
        return InputError([Fault(str(self._file or self.name), 0, key, value, rule, hint)])

    def check_member(self, case: int, members: int) -> None:
        """Raise `InputError` if there is no member number `case` among `members`."""
        if not 0 <= case < members:
            there = "there is 1 member" if members == 1 else f"there are {members} members"
            raise self.refused("", str(case), f"a case must be from 0 to {members - 1}", there)

    @property
    def has_program(self) -> bool:
        """Whether a program of the user makes its levels, which the command line must allow."""
        return False

    def command_of(self, case: int) -> str:
        """Return the shell command that runs only member `case` of the sweep."""
        return command_to_run(f"{self.word}@{case}", self.settings, has_program=self.has_program)


class ExperimentSpec(ReadExperiment):
    """The fields of an experiment, and properties derived from them."""

    model: ModelSpec
    initial: Numbers
    """Initial value of every state."""
    time: TimeSpec
    levels: tuple[Level, ...]
    """Strictly increasing; empty as long as `tolerance` has not chosen them."""
    schemes: tuple[SchemeSpec, ...]
    sweep: Sweep | None = None
    samples: Annotated[int, Field(ge=1)] | Literal["auto", "common", "all"] = "auto"
    """Which steps are stored; a number n means every n-th step of each level."""
    output: Output = "verdict"
    """``best`` to compute the extrapolated solution as well as the verdict."""
    tolerance: float | None = None
    """Error bound from which the levels are chosen; None if the file gives them."""
    checks: tuple[Check, ...] = ()
    """The checks of the file, followed by one claim for every row of `published`."""
    published: tuple[PublishedTable, ...] = ()
    """Tables of numbers that a source printed."""
    figures: tuple[FigureOfSource, ...] = ()
    """Figures of a source, which the report draws."""
    units: Annotated[dict[str, str], AfterValidator(FrozenDict)] = FrozenDict()
    """Units that the file defines, in SI base units. All numbers are already converted."""
    scaling: Scaling | None = None
    """Set if the run uses the characteristic units of the model."""
    _notes: tuple[tuple[int, str], ...] = PrivateAttr(default=())

    @property
    def notes(self) -> tuple[tuple[int, str], ...]:
        """Warnings about probable mistakes: line of the file (0 if none) and text; not part of the identity."""
        return self._notes

    @property
    def members(self) -> int:
        """Number of members of the sweep, 1 without one."""
        return self.sweep.count if self.sweep else 1

    @property
    def chain(self) -> int:
        """Length of a chain of members that each start from the previous one (`Sweep.chain`)."""
        return self.sweep.chain if self.sweep else 1

    @property
    def trajectories(self) -> int:
        """Number of schemes times number of members."""
        return len(self.schemes) * self.members

    @property
    def end_varies(self) -> bool:
        """Whether the end time differs between members. Then ``t`` is the fraction 0 to 1 of it."""
        return self.sweep is not None and self.sweep.fixed_end(self.time) is None

    @property
    def written(self) -> tuple[Check, ...]:
        """The checks without those of `published`."""
        rows = sum(len(table.rows) for table in self.published)
        return self.checks[: len(self.checks) - rows]

    @property
    def ladder(self) -> tuple[int, ...]:
        """Indices of the fixed-step schemes, which have levels to compare; at least one."""
        return tuple(i for i, scheme in enumerate(self.schemes) if not scheme.adaptive)

    @property
    def own_velocity(self) -> bool:
        """Whether the velocity of some scheme differs from ``[D_2t u]``. Always False for models with events."""
        smooth = self.model.definition.events is None
        return smooth and any(scheme.own_velocity for scheme in self.schemes)

    @property
    def quantities(self) -> tuple[str, ...]:
        """Names of all quantities that are stored as time series, if storage is not bounded."""
        return quantities(self.model.definition, self.own_velocity)

    def natural_end(self, parameters: Mapping[str, Any]) -> Any:
        """Return the end time for these `parameters` (numbers or arrays), if the end itself is not swept."""
        return self.time.end_of(self.model.definition, parameters)

    def steps(self, level: int) -> int:
        """Return the number of steps at `level`: ``base_steps * 2**level``."""
        return self.time.base_steps << level

    def __eq__(self, other: object) -> bool:
        return isinstance(other, ExperimentSpec) and self.__dict__ == other.__dict__

    def __hash__(self) -> int:
        return hash(tuple(self.__dict__.values()))


AnyExperiment = TypeVar("AnyExperiment", bound=ExperimentSpec)
"""Class of an experiment, kept by functions that derive one experiment from another."""


def schemes_of(experiment: ExperimentSpec, check: Check) -> tuple[int, ...]:
    """Return the indices of the schemes that a check applies to, increasing; a claim applies where its check does.

    A check that names no schemes applies to all fixed-step schemes that have its quantity: only schemes whose velocity
    differs from the centred difference have both.
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
