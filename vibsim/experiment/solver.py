"""An experiment with a solver of the user, as data: its levels, its members, and the command of each.

A level is a set of sizes that are refined together, the coarsest first. A member of the sweep is a set of parameters.
This module turns text of the file into arguments, but runs nothing.
"""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Mapping
from functools import cached_property
from pathlib import Path
from string import Formatter
from typing import Annotated, Any

from pydantic import AfterValidator

from vibsim.experiment.data import ReadExperiment, Sweep
from vibsim.experiment.schema.checks import as_data, without_kind
from vibsim.experiment.schema.fields import FrozenDict, Section, Text
from vibsim.experiment.schema.solver import (
    PLACE,
    Kind,
    QuantitySection,
    ResourcesSection,
    SolverCheck,
)

Argument = int | float | str  # a size or a parameter; an int if the file has a whole number
OUTPUTS = (PLACE, f"{PLACE}.nc", f"{PLACE}.csv")
"""Placeholders of the file that a command writes; the first two are equivalent."""

NO_MODULE = "cannot be found: no installed package and no module beside the file has this name"
"""The rule for a module of a function of the user."""


class SolverSpec(Section):
    """How a level is computed."""

    kind: Kind
    text: Text
    """The command, `module:function`, or the path of a file, with placeholders."""
    inputs: tuple[Text, ...] = ()
    """Paths of files that the solver depends on, relative to the folder of the experiment file."""


class SolverExperiment(ReadExperiment):
    """An experiment with a solver of the user."""

    solver: SolverSpec
    sizes: Annotated[dict[str, tuple[int | float, ...]], AfterValidator(FrozenDict)]
    """Sizes by name, for every level, the coarsest first. The first name is the step size."""
    numbers: tuple[int, ...] = ()
    """Value of `level` at each level, if sizes are formulas in it."""
    quantities: Annotated[dict[str, QuantitySection], AfterValidator(FrozenDict)]
    sweep: Sweep | None = None
    whole: tuple[str, ...] = ()
    """Swept names whose values in the file are all whole numbers."""
    values: Annotated[dict[str, Argument], AfterValidator(FrozenDict)] = FrozenDict()
    """Parameters, if this is a single member of a sweep."""
    resources: ResourcesSection
    checks: tuple[SolverCheck, ...]

    @property
    def has_program(self) -> bool:
        """Whether a command or a function makes the levels, not files that exist."""
        return self.solver.kind != "files"

    @property
    def step(self) -> str:
        """Name of the step size."""
        return next(iter(self.sizes))

    @property
    def levels(self) -> range:
        """Positions of the levels, the coarsest first."""
        return range(len(self.sizes[self.step]))

    @property
    def members(self) -> int:
        """Number of members of the sweep, 1 without one."""
        return self.sweep.count if self.sweep else 1

    def sizes_of(self, level: int) -> dict[str, int | float]:
        """Return the sizes of a level by name."""
        return {name: values[level] for name, values in self.sizes.items()}

    def parameters_of(self, member: int) -> dict[str, Argument]:
        """Return the parameters of a member by name."""
        parameters: dict[str, Argument] = dict(self.values)
        for name, column in self._columns.items():
            value = column[member]
            parameters[name] = int(value) if name in self.whole else value
        return parameters

    @cached_property
    def _columns(self) -> dict[str, list[Any]]:
        if self.sweep is None:
            return {}
        from vibsim.experiment.sweep_columns import grid_columns

        columns = grid_columns(self.sweep.axes, 0, self.members)
        return {name: column.tolist() for name, column in columns.items()}

    def words(self, level: int, member: int) -> dict[str, str]:
        """Return the text of the placeholders of a level, without those for the output and the threads."""
        values = {**self.parameters_of(member), **self.sizes_of(level)}
        if self.numbers:
            values["level"] = self.numbers[level]
        return {name: str(value) for name, value in values.items()}

    def arguments(self, level: int, member: int, more: Mapping[str, str]) -> list[str]:
        """Return the program and arguments of a command; `more` holds the text of further placeholders."""
        words = {**self.words(level, member), **more}
        return [filled(part, words) for part in shlex.split(self.solver.text)]

    def path(self, level: int, member: int) -> str:
        """Return the path of the existing file of a level, relative to the folder of the experiment file."""
        return filled(self.solver.text, self.words(level, member))

    def alone(self, member: int) -> SolverExperiment:
        """Return the experiment of one member, without a sweep, named ``<name>_case_<member>``.

        Raises `InputError` if there is no such member.
        """
        self.check_member(member, self.members)
        update = {
            "name": f"{self.name}_case_{member}",
            "sweep": None,
            "whole": (),
            "values": FrozenDict(self.parameters_of(member)),
        }
        single = self.model_copy(update=update)
        single.__dict__.pop("_columns", None)
        return single

    @property
    def content(self) -> dict[str, Any]:
        """The experiment as JSON data, for `restore`."""
        data = self.model_dump(mode="json", exclude={"checks"})
        return data | {"checks": [as_data(check) for check in self.checks]}


def restore(
    content: Mapping[str, Any], file: Path | None, settings: tuple[str, ...] = ()
) -> SolverExperiment:
    """Return the experiment with this `content`; `file` and `settings` are those with which it was read."""
    checks = [without_kind(check) for check in content["checks"]]
    experiment = SolverExperiment.model_validate({**content, "checks": checks})
    experiment._file, experiment._settings = file, settings
    return experiment


def placeholders(template: str) -> Iterator[str]:
    """Yield the names in braces; raise `ValueError` if braces do not match, or contain more than a name."""
    for _, name, form, conversion in Formatter().parse(template):
        if form or conversion:
            raise ValueError("braces hold a name and nothing else")
        if name is not None:
            yield name


def filled(template: str, words: Mapping[str, str]) -> str:
    """Return a template with its placeholders replaced; doubled braces become single ones."""
    parts = Formatter().parse(template)
    return "".join(text + (words[name] if name is not None else "") for text, name, *_ in parts)
