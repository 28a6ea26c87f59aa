"""An experiment whose levels a solver of the user makes, as data: its levels, its members, and what makes each.

A level is a set of sizes that are refined together, the coarsest first; a member of the sweep is a set of parameters.
Text of the file becomes arguments here, and nothing is run.
"""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Mapping
from functools import cached_property
from pathlib import Path
from string import Formatter
from typing import Annotated, Any

from pydantic import AfterValidator

from vibsim.experiment.data import ReadExperiment, Sweep, check_member
from vibsim.experiment.schema.checks import as_data, without_kind
from vibsim.experiment.schema.fields import FrozenDict, Section, Text
from vibsim.experiment.schema.solver import (
    PLACE,
    Kind,
    QuantitySection,
    ResourcesSection,
    SolverCheck,
)

Argument = int | float | str
"""A size or a parameter; what a file writes as a whole number is one."""
OUTPUTS = (PLACE, f"{PLACE}.nc", f"{PLACE}.csv")
"""Placeholders of the file that a command writes; the first is the second."""


class SolverSpec(Section):
    """How a level is made."""

    kind: Kind
    text: Text
    """The command, `module:function`, or the path of a file, with placeholders."""
    inputs: tuple[Text, ...] = ()
    """Paths of files that it depends on, from the folder of the experiment file."""


class SolverExperiment(ReadExperiment):
    """One experiment with a solver of the user."""

    solver: SolverSpec
    sizes: Annotated[dict[str, tuple[int | float, ...]], AfterValidator(FrozenDict)]
    """Of every level, the coarsest first; the first name is the step size."""
    numbers: tuple[int, ...] = ()
    """What `level` is of each level, where sizes are formulas in it."""
    quantities: Annotated[dict[str, QuantitySection], AfterValidator(FrozenDict)]
    sweep: Sweep | None = None
    whole: tuple[str, ...] = ()
    """Swept names whose values are all written as whole numbers."""
    values: Annotated[dict[str, Argument], AfterValidator(FrozenDict)] = FrozenDict()
    """Parameters of one member alone."""
    resources: ResourcesSection
    checks: tuple[SolverCheck, ...]

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
        """Return the sizes of a level by their names."""
        return {name: values[level] for name, values in self.sizes.items()}

    def parameters_of(self, member: int) -> dict[str, Argument]:
        """Return the parameters of a member by their names."""
        found: dict[str, Argument] = dict(self.values)
        for name, column in self._columns.items():
            value = column[member]
            found[name] = int(value) if name in self.whole else value
        return found

    @cached_property
    def _columns(self) -> dict[str, list[Any]]:
        if self.sweep is None:
            return {}
        from vibsim.experiment.sweep_columns import columns_of

        columns = columns_of(self.sweep.axes, 0, self.members)
        return {name: column.tolist() for name, column in columns.items()}

    def words(self, level: int, member: int) -> dict[str, str]:
        """Return what stands for the placeholders of a level, without those of the output and of threads."""
        found = {**self.parameters_of(member), **self.sizes_of(level)}
        if self.numbers:
            found["level"] = self.numbers[level]
        return {name: str(value) for name, value in found.items()}

    def arguments(self, level: int, member: int, more: Mapping[str, str]) -> list[str]:
        """Return the program of a command and its arguments; `more` stands for further placeholders."""
        words = {**self.words(level, member), **more}
        return [filled(part, words) for part in shlex.split(self.solver.text)]

    def path(self, level: int, member: int) -> str:
        """Return the path of the file of a level that is there, from the folder of the experiment file."""
        return filled(self.solver.text, self.words(level, member))

    def alone(self, member: int) -> SolverExperiment:
        """Return the experiment of one member, without a sweep, named ``<name>_case_<member>``.

        InputError where there is no such member.
        """
        check_member(member, self.members, str(self.file or self.name))
        update = {
            "name": f"{self.name}_case_{member}",
            "sweep": None,
            "whole": (),
            "values": FrozenDict(self.parameters_of(member)),
        }
        found = self.model_copy(update=update)
        found.__dict__.pop("_columns", None)
        return found

    @property
    def content(self) -> dict[str, Any]:
        """The experiment as JSON-able data, which `restore` reads."""
        data = self.model_dump(mode="json", exclude={"checks"})
        return data | {"checks": [as_data(check) for check in self.checks]}


def restore(
    content: Mapping[str, Any], file: Path | None, settings: tuple[str, ...] = ()
) -> SolverExperiment:
    """Return the experiment with this `content`; `file` is where it was read, with which `settings`."""
    checks = [without_kind(check) for check in content["checks"]]
    found = SolverExperiment.model_validate({**content, "checks": checks})
    found._file, found._settings = file, settings
    return found


def placeholders(template: str) -> Iterator[str]:
    """Yield the names between braces; ValueError where braces do not match, or hold more than a name."""
    for _, name, form, conversion in Formatter().parse(template):
        if form or conversion:
            raise ValueError("braces hold a name and nothing else")
        if name is not None:
            yield name


def filled(template: str, words: Mapping[str, str]) -> str:
    """Return a template with words in place of its placeholders; doubled braces are single ones."""
    parts = Formatter().parse(template)
    return "".join(text + (words[name] if name is not None else "") for text, name, *_ in parts)
