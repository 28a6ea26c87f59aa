"""The numbers of tables for an experiment that was kept without them, as jobs have it."""

from __future__ import annotations

from pathlib import Path

from vibsim.core.errors import Fault, InputError
from vibsim.experiment.data import ExperimentSpec, TableSpec
from vibsim.experiment.schema.fields import TABLE
from vibsim.experiment.tables.file import TableError, read
from vibsim.models import MODELS, FormulaField


def attach(experiment: ExperimentSpec) -> None:
    """Read the tables of an experiment that was kept without their numbers.

    Raises
    ------
    InputError
        Where one cannot be read, or has other numbers than it had.
    """
    folder = experiment.file.parent if experiment.file else Path()
    for name, spec in experiment.model.tables.items():
        keys = next(row.table for row in _fields(experiment) if row.name == name)
        try:
            table, content = read(folder / spec.file, keys or ("", ""), (spec.place, spec.value))
        except TableError as error:
            raise _refusal(experiment, name, spec, error.rule, error.hint) from None
        if table.digest != spec.numbers:
            rule = "has other numbers than when the experiment was read"
            raise _refusal(experiment, name, spec, rule, "run the experiment again")
        spec.hold(table, content)


def _fields(experiment: ExperimentSpec) -> tuple[FormulaField, ...]:
    return MODELS[experiment.model.kind].formulas


def _refusal(
    experiment: ExperimentSpec, name: str, spec: TableSpec, rule: str, hint: str
) -> InputError:
    file = str(experiment.file or experiment.name)
    return InputError([Fault(file, 0, f"model.{name}.{TABLE}", spec.file, rule, hint)])
