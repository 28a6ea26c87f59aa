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
    energies,
    integrate,
    lane_for,
)
from vibsim.models import Model
from vibsim.schemes import SCHEMES
from vibsim.simulation import adaptive
from vibsim.simulation.members import Members

if TYPE_CHECKING:
    from vibsim.spec import Experiment

Floats = NDArray[np.float64]

PIECE = 2**16
"""Samples whose energies are worked out at a time, so that little memory is needed beside what is kept."""


@dataclass(frozen=True)
class Solution:
    """What was computed, stacked over the schemes."""

    position: Floats
    """Shape (scheme, case, t)."""
    velocity: Floats
    last_step: NDArray[np.int64]
    """Shape (scheme, case)."""
    gathered: Gathered
    """Its arrays have the shape (scheme, case) or (scheme, case, 2)."""
    series: Series | None
    """Its arrays have the shape (scheme, case, t)."""
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
        position=_stack(row.position for row in rows),
        velocity=_stack(row.velocity for row in rows),
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

    runs = [run for run, _ in parts]
    one = runs[0]
    return Trajectories(
        position=sorted_(run.position for run in runs),
        velocity=sorted_(run.velocity for run in runs),
        last_step=sorted_(run.last_step for run in runs),
        gathered=_each(Gathered, [run.gathered for run in runs], sorted_),
        series=_each(Series, [run.series for run in runs], sorted_) if one.series else None,
        extrema=_each(Extrema, [run.extrema for run in runs], sorted_) if one.extrema else None,
        events=_each(EventTimes, [run.events for run in runs], sorted_) if one.events else None,
    )


Kind = TypeVar("Kind", Gathered, Series, Extrema, EventTimes)


def _each(kind: type[Kind], rows: list[Any], join: Any) -> Kind:
    names = [field.name for field in fields(kind)]
    return kind(**{name: join(getattr(row, name) for row in rows) for name in names})


def _stack(arrays: Iterable[NDArray[Any]]) -> NDArray[Any]:
    """Stack arrays along a new first axis; one array is not copied."""
    found = list(arrays)
    return found[0][None] if len(found) == 1 else np.stack(found)


def energies_of(
    model: Model,
    group: Members,
    solution: Solution,
    steps: int,
    every: int,
    wanted: Iterable[str],
) -> dict[str, Floats]:
    """Work out series of energies from the stored states.

    Parameters
    ----------
    wanted
        Names out of ``kinetic_energy``, ``potential_energy``, ``energy``, ``energy_deviation``, ``energy_d2t``,
        ``energy_deviation_d2t``.

    Returns
    -------
    dict
        Name to series, shape (scheme, case, t); and ``energy_initial``, shape (scheme, case).
    """
    schemes, cases, times = solution.position.shape
    found = {name: np.empty(solution.position.shape) for name in wanted}
    found["energy_initial"] = np.empty((schemes, cases))
    parameters = np.stack([group.parameters[p.key] for p in model.parameters], axis=-1)
    lane = lane_for(cases, schemes * times)
    piece = max(PIECE // times, 1)
    for s in range(schemes):
        for first in range(0, cases, piece):
            part = slice(first, first + piece)
            kinetic, potential = energies(
                model,
                parameters[part],
                group.end[part] / steps,
                every,
                solution.position[s, part],
                solution.velocity[s, part],
                lane=lane,
            )
            energy = kinetic + potential
            series = {
                "kinetic_energy": kinetic,
                "potential_energy": potential,
                "energy": energy,
                "energy_deviation": energy - energy[:, :1],
                "energy_initial": energy[:, 0],
            }
            if not set(found) <= series.keys():
                energy_d2t = _energy_d2t(
                    model, parameters, group, solution, steps, every, s, part, lane
                )
                series["energy_d2t"] = energy_d2t
                series["energy_deviation_d2t"] = energy_d2t - energy[:, :1]
            for name, values in found.items():
                values[s, part] = series[name]
    return found


def _energy_d2t(
    model: Model,
    parameters: Floats,
    group: Members,
    solution: Solution,
    steps: int,
    every: int,
    scheme: int,
    part: slice,
    lane: str,
) -> Floats:
    """Return the energy with ``[D_2t u]`` as the velocity, shape (case, t); NaN where there is none or it overflows."""
    assert solution.series is not None
    velocity = solution.series.velocity_d2t[scheme, part]
    if np.isnan(velocity).all():
        return np.full(velocity.shape, np.nan)
    kinetic, potential = energies(
        model,
        parameters[part],
        group.end[part] / steps,
        every,
        solution.position[scheme, part],
        velocity,
        lane=lane,
    )
    energy = kinetic + potential
    return np.where(np.isfinite(energy), energy, np.nan)
