"""``best.nc``: the best solution of a ladder, extrapolated over all its levels, with a bound of its error."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibsim.apriori.force_discontinuities import corners_of, may_have_corners
from vibsim.comparison.extrapolate_members import (
    Extrapolated,
    Method,
    Start,
    extrapolate_members,
    join_members,
    noise_of,
)
from vibsim.convergence.extrapolation.states import Pair
from vibsim.core.array_types import Floats, Integers
from vibsim.core.record import Attribute, Record, Variable, flags
from vibsim.core.vocabulary import MEMBER, SERIES
from vibsim.experiment import Experiment, sweep_columns
from vibsim.observe.common_grid import Grid, check_belonging, common_grid, take
from vibsim.simulation.members import Members, members
from vibsim.simulation.scaled import in_scales

REACHED = ("no", "yes")
"""Meanings of the values of the variable ``reached``."""


def best_record(experiment: Experiment, records: Mapping[int, Record]) -> Record:
    """Extrapolate the solution of each scheme with equal steps and each member over all levels.

    Parameters
    ----------
    records
        Level Records of the same members by level.

    Returns
    -------
    Record
        The contents of ``best.nc``: dims scheme, case, t; each state, and ``<state>_error``, the bound of its error;
        ``level_first`` and ``level_last``, the range of the used levels; if the experiment has a tolerance,
        ``reached(scheme, case)``: whether no bound exceeds it. The numbers of a member do not depend on other members.

    Raises
    ------
    VibsimError
        If the Records do not belong together, or have no common times.
    """
    grid = common_grid(records)
    check_belonging(experiment, records)
    finest = records[grid.levels[-1]]
    t = Variable(("t",), grid.t, finest.coords["t"].attrs)
    rows = extrapolated(experiment, records, grid)
    return record_of(experiment, grid.levels, {**finest.coords, "t": t}, rows)


def extrapolated(
    experiment: Experiment, records: Mapping[int, Record], grid: Grid
) -> list[Extrapolated]:
    """Extrapolate level Records over all levels, at their common times; return one row per scheme of the ladder."""
    finest = records[grid.levels[-1]]
    group = members(experiment, int(finest["case"][0]), int(finest["case"][-1]) + 1)
    states = [state.name for state in experiment.model.definition.states]
    levels = [tuple(take(grid, records[level], name) for name in states) for level in grid.levels]
    strides = [grid.stride * n // grid.steps[0] for n in grid.steps]
    t = (np.arange(len(grid.t)) * grid.stride / grid.steps[0])[:, None]
    rows = []
    for i in experiment.ladder:
        parts = []
        for method, start, where in starts(experiment, i, group):
            # time is outermost in memory; a slice of all members avoids a copy
            columns = slice(None) if len(where) == len(group.end) else where
            pairs: list[Pair] = [(u[i].T[:, columns], v[i].T[:, columns]) for u, v in levels]
            noise = noise_of(method, start, grid.steps, strides, pairs)
            parts.append((extrapolate_members(method, start, grid.steps, t, pairs, noise), where))
        rows.append(in_order(parts))
    model = experiment.model.definition
    if not may_have_corners(model):
        return rows
    corners = corners_of(model, finest, group, grid.dt[0])
    unseen = corners.unseen(group.end, grid.steps, np.asarray(finest["omega_dt"]))
    return [_widened(row, unseen[i]) for row, i in zip(rows, experiment.ladder, strict=True)]


def _widened(row: Extrapolated, share: Floats) -> Extrapolated:
    """Add a share, of shape (case,), of the size of each state to its bounds."""
    return replace(
        row,
        position_error=row.position_error + share * np.max(np.abs(row.position), axis=0),
        velocity_error=row.velocity_error + share * np.max(np.abs(row.velocity), axis=0),
    )


def starts(
    experiment: Experiment, scheme: int, group: Members
) -> Iterator[tuple[Method, Start, Integers]]:
    """Yield each method of one scheme with its members; there are several if options are swept."""
    model, method = experiment.model.definition, experiment.schemes[scheme].method
    initial = np.stack([group.initial[state.name] for state in model.states], axis=-1)
    frequency = np.asarray(model.natural_frequency(group.parameters))
    all_members = Start(
        group.numbers(model), initial, group.end, np.broadcast_to(frequency, group.end.shape)
    )
    for options, indices in sweep_columns.option_groups(experiment, scheme, group.columns):
        yield Method(model, method, options), all_members.of(indices), indices


def in_order(parts: Sequence[tuple[Extrapolated, Integers]]) -> Extrapolated:
    """Join members that ran with different options, in their original order."""
    if len(parts) == 1:
        return parts[0][0]
    order = np.argsort(np.concatenate([indices for _, indices in parts]))
    return join_members([part for part, _ in parts], order)


def record_of(
    experiment: Experiment,
    levels: tuple[int, ...],
    coords: Mapping[str, Variable],
    rows: Sequence[Extrapolated],
) -> Record:
    """Return the Record of extrapolated solutions, one row for each scheme."""
    model = experiment.model.definition
    coords_of_best = {
        name: v for name, v in coords.items() if v.dims in (("scheme",), ("case",), ("t",))
    }
    names = np.asarray([experiment.schemes[i].name for i in experiment.ladder])
    coords_of_best["scheme"] = Variable(("scheme",), names, coords["scheme"].attrs)
    variables: dict[str, Variable] = {}

    def add(name: str, fields: Iterable[NDArray[Any]], words: str, units: str) -> None:
        stacked = np.stack([np.ascontiguousarray(values.T) for values in fields])
        variables[name] = Variable.of(SERIES, stacked, words, units)

    states = list(zip(model.states, ("position", "velocity"), strict=True))
    for state, field in states:
        words = f"{state.long_name}, extrapolated over the levels"
        add(state.name, (getattr(row, field) for row in rows), words, state.unit)
    for state, field in states:
        words = f"{state.long_name}: bound of the error of the extrapolation"
        bounds = (getattr(row, f"{field}_error") for row in rows)
        add(f"{state.name}_error", bounds, words, state.unit)
    numbers = np.array([*levels, -1], dtype=np.int8)
    for name, words in (("first", "coarsest"), ("last", "finest")):
        words = f"{words} level used for the {model.states[0].long_name}, -1 for none"
        add(f"level_{name}", (numbers[getattr(row, name)] for row in rows), words, "1")
    if experiment.tolerance is not None:
        tolerance = experiment.tolerance
        reached = np.stack([np.maximum(*row.largest_bounds()) <= tolerance for row in rows])
        text = (
            f"whether every bound of the member is at most {tolerance:g} in the unit of its state"
        )
        variables["reached"] = Variable.of(MEMBER, reached.astype(np.int8), text, **flags(REACHED))
    attributes: dict[str, Attribute] = {
        "title": experiment.title,
        "model": model.kind,
        "levels": list(levels),
    }
    return in_scales(Record(coords_of_best, variables, attributes), experiment)
