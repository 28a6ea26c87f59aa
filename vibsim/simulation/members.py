"""The numbers of members: parameters, initial values and end times, from the experiment and its sweep."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vibsim import plan

if TYPE_CHECKING:
    from vibsim.spec import Experiment

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Members:
    """The numbers of members start..stop-1; every array has shape (case,)."""

    index: NDArray[np.int64]
    columns: Mapping[str, NDArray[Any]]
    """Swept values by dotted key: numbers, or words for options of schemes."""
    parameters: Mapping[str, Floats]
    initial: Mapping[str, Floats]
    end: Floats


def members(experiment: Experiment, start: int, stop: int) -> Members:
    """Work out the numbers of members start..stop-1."""
    columns = plan.columns(experiment, start, stop)

    def fill(section: str, values: Mapping[str, float]) -> dict[str, Floats]:
        return {
            name: columns.get(f"{section}.{name}", np.full(stop - start, value, dtype=float))
            for name, value in values.items()
        }

    parameters = fill("model", experiment.model.parameters)
    end = fill("time", {"end": experiment.time.end})["end"]
    if experiment.end_varies and "time.end" not in columns:
        # the end is a number of natural periods, and each member has its own
        end = np.asarray(experiment.natural_end(parameters), dtype=float)
    initial = fill("initial", experiment.initial)
    known = experiment.model.definition.start
    if known is not None:
        shape = (stop - start,)
        initial |= {name: np.full(shape, value) for name, value in known(parameters).items()}
    return Members(
        index=np.arange(start, stop, dtype=np.int64),
        columns=columns,
        parameters=parameters,
        initial=initial,
        end=end,
    )
