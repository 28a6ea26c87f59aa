"""All schemes of a level stepped for all members: arrays with a leading scheme."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from vibsim import plan
from vibsim.engine import (
    EventTimes,
    Extrema,
    Gathered,
    Series,
    Trajectories,
    integrate,
)
from vibsim.schemes import SCHEMES
from vibsim.simulation import adaptive
from vibsim.simulation.members import Members

if TYPE_CHECKING:
    from vibsim.experiment import Experiment

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Solution:
    """What was computed, stacked over the schemes."""

    states: Floats
    """In the order of `Model.states`, shape (scheme, state, case, t)."""
    last_step: NDArray[np.int64]
    """Shape (scheme, case)."""
    gathered: Gathered
    """Its arrays have the shape (scheme, case) or (scheme, case, state, 2)."""
    series: Series | None
    """Its arrays have the shape (scheme, case, t) or (scheme, case, coordinate, t)."""
    extrema: Extrema | None
    """Its arrays have the shape (scheme, case, extremum) or (scheme, case)."""
    events: EventTimes | None
    """Its arrays have the shape (scheme, case); None for a smooth model."""


def solve(
    experiment: Experiment,
    group: Members,
    steps: int,
    every: int,
    threads: int,
    *,
    with_series: bool = False,
    n_extrema: int = 0,
) -> Solution:
    """Step every scheme of `experiment` for the members of `group`; see `vibsim.engine.integrate`."""
    keep = {"with_series": with_series, "n_extrema": n_extrema}
    rows = [
        _in_order(
            [
                (_run(experiment, i, options, group, where, steps, every, threads, keep), where)
                for options, members in plan.option_groups(experiment, i, group.columns)
                for where in _pieces(experiment, i, members, steps)
            ]
        )
        for i in range(len(experiment.schemes))
    ]
    return Solution(
        states=_stack(row.states for row in rows),
        last_step=_stack(row.last_step for row in rows),
        gathered=_each(Gathered, [row.gathered for row in rows], _stack),
        series=_each(Series, [row.series for row in rows], _stack) if with_series else None,
        extrema=_each(Extrema, [row.extrema for row in rows], _stack) if n_extrema else None,
        events=_each(EventTimes, [row.events for row in rows], _stack) if rows[0].events else None,
    )


def has_adaptive(experiment: Experiment) -> bool:
    """Tell whether a scheme of `experiment` chooses its own steps."""
    return any(SCHEMES[scheme.kind].adaptive for scheme in experiment.schemes)


def _pieces(
    experiment: Experiment, scheme: int, where: NDArray[np.int64], steps: int
) -> Iterable[NDArray[np.int64]]:
    """Yield members to be stepped together."""
    is_adaptive = SCHEMES[experiment.schemes[scheme].kind].adaptive
    return adaptive.pieces(where, steps) if is_adaptive else (where,)


def _run(
    experiment: Experiment,
    scheme: int,
    options: Any,
    group: Members,
    where: NDArray[np.int64],
    steps: int,
    every: int,
    threads: int,
    keep: Mapping[str, Any],
) -> Trajectories:
    model = experiment.model.definition
    method = SCHEMES[experiment.schemes[scheme].kind]
    parameters = [group.parameters[p.key][where] for p in model.parameters]
    return (adaptive.integrate if method.adaptive else integrate)(
        model,
        method,
        options,
        np.stack(parameters, axis=-1) if parameters else np.empty((len(where), 0)),
        np.stack([group.initial[state.name][where] for state in model.states], axis=-1),
        group.end[where] / steps,
        steps,
        every,
        threads=threads,
        **keep,
    )


def _in_order(parts: list[tuple[Trajectories, NDArray[np.int64]]]) -> Trajectories:
    """Put members that were stepped with different options where they belong."""
    if len(parts) == 1:
        return parts[0][0]
    order = np.argsort(np.concatenate([where for _, where in parts]))

    def sorted_(arrays: Iterable[Any]) -> NDArray[Any]:
        return np.asarray(np.concatenate(list(arrays))[order])

    def sorted_rows(arrays: Iterable[Any]) -> NDArray[Any]:
        return np.asarray(np.concatenate(list(arrays), axis=1)[:, order])

    runs = [run for run, _ in parts]
    one = runs[0]
    return Trajectories(
        states=sorted_rows(run.states for run in runs),
        last_step=sorted_(run.last_step for run in runs),
        gathered=_each(Gathered, [run.gathered for run in runs], sorted_),
        series=_each(Series, [run.series for run in runs], sorted_) if one.series else None,
        extrema=_each(Extrema, [run.extrema for run in runs], sorted_) if one.extrema else None,
        events=_each(EventTimes, [run.events for run in runs], sorted_) if one.events else None,
    )


Kind = TypeVar("Kind", Gathered, Series, Extrema, EventTimes)


def _each(kind: type[Kind], rows: list[Any], join: Any) -> Kind:
    columns = {field.name: [getattr(row, field.name) for row in rows] for field in fields(kind)}
    joined: dict[str, Any] = {
        name: None if parts[0] is None else join(parts) for name, parts in columns.items()
    }
    return kind(**joined)


def _stack(arrays: Iterable[NDArray[Any]]) -> NDArray[Any]:
    """Stack arrays along a new first axis; one array is not copied."""
    found = list(arrays)
    return found[0][None] if len(found) == 1 else np.stack(found)
