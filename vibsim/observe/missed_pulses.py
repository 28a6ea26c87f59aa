"""Pulses of the force in time that lie between the points of every level, so that no level sees them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from vibsim.apriori.table_corners import has_tables, table_pulses
from vibsim.core.array_types import Flags, Floats
from vibsim.core.record import Record, Variable
from vibsim.formula import Pulses
from vibsim.formula.jumps import MOST_GAPS
from vibsim.models.base import Model, by_name, varies_in_time
from vibsim.simulation.members import Members
from vibsim.simulation.reference.one_sided_forces import pulses_of_force

AROUND = np.arange(-2, 4)  # points around a pulse


@dataclass(frozen=True)
class Missed:
    """For every member a pulse of the force that no level sees, shape (case,); NaN if there is none."""

    time: Floats
    width: Floats
    jumps: Flags  # whether the force jumps there, or has corners


def missed_pulses(model: Model, finest: Record, group: Members) -> Missed:
    """Return a pulse of the force between the points of the finest level, which include those of all other levels."""
    parameters = by_name(model.parameters, group.parameters)
    steps = finest.whole("steps")
    of_tables = table_pulses(model, parameters, group.end, steps)
    in_tables = np.isfinite(of_tables.time)
    if not varies_in_time(model):
        return Missed(of_tables.time, of_tables.width, in_tables)
    of_formulas = _of_formulas(model, finest, group, parameters)
    both = Pulses(of_formulas.time, of_formulas.width).and_others(of_tables)
    jumps = of_formulas.jumps | (np.isnan(of_formulas.time) & in_tables)
    return Missed(both.time, both.width, jumps)


def may_miss_pulses(model: Model) -> bool:
    """Tell whether the force of a model may have pulses in time, in formulas or tables."""
    return varies_in_time(model) or has_tables(model)


def _of_formulas(
    model: Model, finest: Record, group: Members, parameters: Mapping[str, Floats]
) -> Missed:
    cases = len(group.end)
    states = np.stack([np.asarray(finest[state.name], dtype=float) for state in model.states])
    # states of the first scheme that is finite throughout
    scheme = np.argmax(np.isfinite(states).all(axis=(0, -1)), axis=0)
    samples = states.shape[-1] - 1

    def pulses(t: Floats, *, smooth: bool) -> Pulses:
        """Return a pulse of every member between times of shape (case, gap + 1)."""
        place = (t[:, :-1] / group.end[:, None] * samples).astype(np.int64)
        at = states[:, scheme[:, None], np.arange(cases)[:, None], np.clip(place, 0, samples)]
        return pulses_of_force(model, parameters, at, t, smooth=smooth)

    gaps = steps = finest.whole("steps")
    while cases * gaps > MOST_GAPS and gaps % 2 == 0:
        gaps //= 2
    t = np.arange(gaps + 1) * (group.end / gaps)[:, None]
    coarse = pulses(t, smooth=False)
    is_there = np.isfinite(coarse.time)
    time, width = coarse.time, coarse.width
    if gaps < steps:
        # keep pulses that also lie between points of the finest level
        dt = group.end / steps
        first = np.maximum(np.floor(np.nan_to_num(time) / dt) + AROUND[0], 0.0)
        near = pulses((first[:, None] + (AROUND - AROUND[0])) * dt[:, None], smooth=False)
        time, width = (np.where(is_there, x, np.nan) for x in (near.time, near.width))
    is_there = np.isfinite(time)
    is_smooth = np.isfinite(pulses(t, smooth=True).time) if is_there.any() else is_there
    return Missed(time, width, is_there & ~is_smooth)


def missed_variables(missed: Missed) -> dict[str, Variable]:
    """Return the pulses as variables of the convergence Record."""
    words = "time of a pulse of the force between the points of every level"
    return {
        "pulse_time": Variable.of(("case",), missed.time, words, "s"),
        "pulse_width": Variable.of(("case",), missed.width, "how long that pulse lasts", "s"),
    }
