"""Numerical values of members: parameters, initial values and end times, from the experiment and its sweep."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vibsim.core.array_types import Floats, Integers
from vibsim.experiment import sweep_columns

if TYPE_CHECKING:
    from vibsim.experiment import Experiment
    from vibsim.models import Model


@dataclass(frozen=True)
class Members:
    """Values of members start..stop-1; every array has shape (case,)."""

    index: Integers
    columns: Mapping[str, NDArray[Any]]
    """Swept values by dotted key: numbers, or words for options of schemes."""
    parameters: Mapping[str, Floats]
    initial: Mapping[str, Floats]
    """NaN for a member that starts from the last state of the previous member."""
    end: Floats

    def numbers(self, model: Model) -> Floats:
        """Return the parameters in the order of a model, shape (case, parameter)."""
        columns = [self.parameters[row.key] for row in model.parameters]
        return np.stack(columns, axis=-1) if columns else np.empty((len(self.end), 0))

    def by_name(self, model: Model) -> dict[str, Floats]:
        """Return the parameters by their names in formulas, shape (case, 1), which broadcasts against times."""
        return {row.name: self.parameters[row.key][:, None] for row in model.parameters}

    def exact(self, model: Model, t: Floats) -> dict[str, Floats]:
        """Return the exact states at times t, shape (case, t); the model must have an exact solution."""
        assert model.exact is not None
        return model.exact(t, in_columns(self.initial), in_columns(self.parameters))


def in_columns(table: Mapping[str, Floats]) -> dict[str, Floats]:
    """Return arrays of members with shape (case, 1), which broadcasts against times."""
    return {name: values[:, None] for name, values in table.items()}


def members(experiment: Experiment, start: int, stop: int) -> Members:
    """Return the values of members start..stop-1."""
    columns = sweep_columns.columns(experiment, start, stop)
    parameters, initial = numbers_of(experiment, columns, stop - start)
    if experiment.chain > 1:
        starts = np.arange(start, stop) % experiment.chain == 0
        initial = {name: np.where(starts, values, np.nan) for name, values in initial.items()}
    end = _filled("time", {"end": experiment.time.end}, columns, stop - start)["end"]
    if experiment.end_varies and "time.end" not in columns:
        # the end follows from the parameters of each member
        end = np.full(stop - start, experiment.natural_end(parameters), dtype=float)
    return Members(np.arange(start, stop, dtype=np.int64), columns, parameters, initial, end)


def numbers_of(
    experiment: Experiment, columns: Mapping[str, NDArray[Any]], size: int
) -> tuple[dict[str, Floats], dict[str, Floats]]:
    """Return parameters and initial values of `size` members with these swept values, arrays of shape (size,)."""
    parameters = _filled("model", experiment.model.parameters, columns, size)
    initial = _filled("initial", experiment.initial, columns, size)
    start = experiment.model.definition.start
    if start is not None:
        initial |= {name: np.full(size, value) for name, value in start(parameters).items()}
    return parameters, initial


def _filled(
    section: str, values: Mapping[str, float], columns: Mapping[str, NDArray[Any]], size: int
) -> dict[str, Floats]:
    """Return the values of a section, swept or equal for all members."""
    return {
        name: columns.get(f"{section}.{name}", np.full(size, value, dtype=float))
        for name, value in values.items()
    }
