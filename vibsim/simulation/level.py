"""One level as a record: its stored variables with names, units and descriptions."""

from __future__ import annotations

from collections.abc import Collection, Container, Iterable
from dataclasses import replace
from itertools import chain, count
from typing import TYPE_CHECKING, Any

import numpy as np

from vibsim.core.array_types import Floats, Integers
from vibsim.core.record import Attribute, Record, Variable, attributes, flags
from vibsim.core.vocabulary import HIGHEST, MEMBER, SERIES
from vibsim.engine import EventTimes, Extrema, Gathered, Trajectories
from vibsim.experiment import storage
from vibsim.experiment.storage import (
    RUNNING,
    asks_for_peaks,
    event_times,
    extrema_kept,
    is_bounded,
    stored_series,
)
from vibsim.models import BUDGET, ENERGIES, Model, centred, has_budget
from vibsim.simulation.derived import derived
from vibsim.simulation.members import Members, members
from vibsim.simulation.reference.solve import method, reference
from vibsim.simulation.scaled import in_scales
from vibsim.simulation.solution import solve

if TYPE_CHECKING:
    import xarray

    from vibsim.experiment import Experiment

STATUS = ("ok", "non_finite")
"""Meaning of the variable ``status``."""

_ENERGY_WORDS = {
    "kinetic_energy": "kinetic energy",
    "potential_energy": "potential energy",
    "energy": "total mechanical energy",
    "energy_deviation": "deviation of the total energy from its initial value",
    "energy_d2t": "total mechanical energy with [D_2t u] as velocity",
    "energy_deviation_d2t": "deviation of the total energy with [D_2t u] as velocity from its initial value",
}
_BUDGET_WORDS = (
    "energy that damping took since t = 0",
    "work of driving forces since t = 0",
    "deviation of the total energy plus what damping took minus the work of driving forces",
)

Row = tuple[str, Any, str, str]
"""Name of a variable, its values, its description, and its unit."""


def simulate(experiment: Experiment, level: int, *, threads: int = 1) -> xarray.Dataset:
    """Run every scheme and member of `experiment` at `level`.

    Parameters
    ----------
    threads
        Number of threads that share the members; results do not depend on it.

    Returns
    -------
    xarray.Dataset
        The content of the file ``level_LL.nc``: states, energies and outputs at the stored times, exact values if they
        are known, and extrema, periods and status of each member, taken over every step.

    Raises
    ------
    ValueError
        If the experiment does not have the level.
    SimulationError
        If a kernel cannot be compiled.
    """
    return simulate_record(experiment, level, threads=threads).to_xarray()


def simulate_record(
    experiment: Experiment,
    level: int,
    start: int = 0,
    stop: int | None = None,
    *,
    threads: int = 1,
) -> Record:
    """Run members start..stop-1 (default: all) and return plain arrays; see `simulate`."""
    if level not in experiment.levels:
        raise ValueError(f"level {level!r} is none of {list(experiment.levels)}")
    model = experiment.model.definition
    group = members(experiment, start, experiment.members if stop is None else stop)
    steps, every = experiment.steps(level), storage.sampling(experiment, level)
    is_lean, wanted = is_bounded(experiment), stored_series(experiment)
    kept = extrema_kept(experiment.trajectories)
    of_states = {state.name for state in model.states}.union(ENERGIES)
    of_states |= {output.name for output in model.outputs}
    solution = solve(
        experiment,
        group,
        steps,
        every,
        threads=threads,
        with_series=not of_states.issuperset(wanted),
        n_extrema=0 if is_lean and not asks_for_peaks(experiment) else kept,
        n_events=event_times(experiment),
    )
    run = solution.gathered
    assert run is not None
    rows = [*_ranges(model, run), *_peaks(model, run), *_ends(solution, group.end, steps)]
    if experiment.own_velocity or not is_lean:
        words = "largest absolute deviation of the energy with [D_2t u] as velocity, over every inner step"
        name = "energy_deviation_d2t_max_abs"
        rows.append((name, run.deviation_d2t, words, model.energy_unit))
    outcomes = _table(MEMBER, rows)
    status = outcomes["status"]
    outcomes["status"] = replace(status, attrs={**status.attrs, **flags(STATUS)})
    variables = _series(model, group, solution, steps, every, wanted)
    if not is_lean:
        number = np.arange(0, steps + 1, every, dtype=np.int64)
        variables |= _exact(experiment, group, number, steps)
    variables |= outcomes
    if solution.extrema:
        variables |= _extrema(model, solution.extrema)
    if solution.events:
        variables |= _table(MEMBER, _events(solution.events))
        if event_times(experiment):
            variables |= _event_times(solution.events)
    if any(scheme.adaptive for scheme in experiment.schemes):
        variables |= _table(MEMBER, _own_steps(run))
    variables |= _table(("case",), _constants(model, group, steps))
    attrs: dict[str, Attribute] = {
        "model": model.kind,
        "level": level,
        "steps": steps,
        "every": every,
        "storage": "lean" if is_lean else "series",
    }
    names = [scheme.name for scheme in experiment.schemes]
    coords = coordinates(model, names, group, steps, every, same_end=not experiment.end_varies)
    coords |= _table((), [("level", np.array(level, dtype=np.int16), "level", "1")])
    if solution.extrema:
        places = np.arange(solution.extrema.peak.shape[-1], dtype=np.int32)
        words = "number of the peak or trough, from 0"
        coords |= _table(("extremum",), [("extremum", places, words, "1")])
    return in_scales(Record(coords, variables, attrs), experiment)


def coordinates(
    model: Model, schemes: list[str], group: Members, steps: int, every: int, *, same_end: bool
) -> dict[str, Variable]:
    """Return the coordinates of members at every `every`-th of `steps` steps.

    Parameters
    ----------
    schemes
        Names of the schemes.
    group
        The members; each swept key becomes a coordinate along ``case``.
    same_end
        Whether all members of the experiment end at the same time; ``t`` is then a time, otherwise a fraction of the
        end time.
    """
    number = np.arange(0, steps + 1, every, dtype=np.int64)
    t = number * (group.end[0] / steps) if same_end else number / steps
    words = ("time", "s") if same_end else ("time as a fraction of the end time", "1")
    coords = {
        **_table(("scheme",), [("scheme", np.array(schemes), "name of the scheme", "1")]),
        **_table(("case",), [("case", group.index, "index of the member of the sweep", "1")]),
        **_table(("t",), [("t", np.asarray(t, dtype=float), *words)]),
    }
    if not same_end:
        coords |= _table(("case",), [("end", group.end, "end time of the member", "s")])
    units = {f"initial.{state.name}": state.unit for state in model.states}
    units |= {f"model.{p.key}": p.unit for p in model.parameters} | {"time.end": "s"}
    for key, values in group.columns.items():
        attrs = attributes(f"swept value of {key}", units.get(key, "1"), sweep_key=key)
        coords[_plain_name(key, coords)] = Variable(("case",), values, attrs)
    return coords


def _plain_name(key: str, taken: Container[str]) -> str:
    """Return a netCDF name for a swept key, which may contain any characters of a scheme's label."""
    name = "".join(c if c.isascii() and c.isalnum() else "_" for c in key)
    return next(n for n in chain([name], (f"{name}_{i}" for i in count(2))) if n not in taken)


def _table(dims: tuple[str, ...], rows: Iterable[Row]) -> dict[str, Variable]:
    return {
        name: Variable(dims, values, attributes(words, unit)) for name, values, words, unit in rows
    }


def _series(
    model: Model,
    group: Members,
    solution: Trajectories,
    steps: int,
    every: int,
    wanted: Collection[str],
) -> dict[str, Variable]:
    unit = model.energy_unit
    rows: list[Row] = [
        (state.name, solution.states[:, k], state.long_name, state.unit)
        for k, state in enumerate(model.states)
    ]
    if solution.series is not None:
        velocities = model.states[model.coordinates :]
        for k, (name, velocity) in enumerate(zip(centred(model), velocities, strict=False)):
            words = f"{velocity.long_name} by [D_2t u], the centred difference of the position"
            rows.append((name, solution.series.velocities_d2t[:, :, k], words, velocity.unit))
        for name, values in (
            ("energy_deviation", solution.series.deviation_running),
            ("energy_deviation_d2t", solution.series.deviation_d2t_running),
        ):
            words = f"largest absolute {_ENERGY_WORDS[name]}, over every step so far"
            rows.append((name + RUNNING, values, words, unit))
        rows = [row for row in rows if row[0] in wanted]
    words_of = dict(_ENERGY_WORDS)
    if has_budget(model):
        words_of |= zip(BUDGET, _BUDGET_WORDS, strict=True)
    columns = [(name, words, unit) for name, words in words_of.items()]
    columns += [(row.name, row.long_name, row.unit) for row in model.outputs]
    columns = [row for row in columns if row[0] in wanted]
    values_of = derived(model, group, solution, steps, every, [name for name, _, _ in columns])
    rows += [(name, values_of[name], words, own_unit) for name, words, own_unit in columns]
    start = values_of["energy_initial"]
    return {
        **_table(SERIES, rows),
        **_table(MEMBER, [("energy_initial", start, "total mechanical energy at t = 0", unit)]),
    }


def _exact(
    experiment: Experiment, group: Members, number: Integers, steps: int
) -> dict[str, Variable]:
    """Return the exact states, or reference solutions if they are not known."""
    model = experiment.model.definition
    if model.exact is None:
        is_computed = storage.stores_references(experiment)
        return _computed(model, group, number / steps) if is_computed else {}
    exact = group.exact(model, number * (group.end / steps)[:, None])
    rows = (
        (f"{row.name}_exact", exact[row.name], f"exact {row.long_name}", row.unit)
        for row in model.states
    )
    return _table(("case", "t"), rows)


def _computed(model: Model, group: Members, fraction: Floats) -> dict[str, Variable]:
    """Return reference solutions with the bounds of their errors; empty if no member has one."""
    with np.errstate(all="ignore"):
        series, bounds = reference(model, group, fraction)
    if not np.isfinite(bounds[model.position]).any():
        return {}
    table = {}
    for state in model.states:
        words = f"{state.long_name} of the reference solution"
        attrs = attributes(words, state.unit, method=method(model))
        table[f"{state.name}_exact"] = Variable(("case", "t"), series[state.name], attrs)
        attrs = attributes(f"bound of the error of the {words}", state.unit)
        table[f"{state.name}_exact_error"] = Variable(("case",), bounds[state.name], attrs)
    return table


def _constants(model: Model, group: Members, steps: int) -> Iterable[Row]:
    frequency = np.broadcast_to(model.natural_frequency(group.parameters), group.end.shape)
    words = "angular frequency of small oscillations"
    yield "natural_frequency", frequency, words, "rad s-1"
    yield "omega_dt", frequency * (group.end / steps), f"{words} times the time step", "1"
    if model.highest_frequency is not None:
        highest = np.broadcast_to(model.highest_frequency(group.parameters), group.end.shape)
        yield HIGHEST, highest * (group.end / steps), f"highest {words} times the time step", "1"
    if model.exact_period is not None:
        period = model.exact_period(group.initial, group.parameters)
        yield "exact_period", np.asarray(period, dtype=float), "exact period", "s"


def _ranges(model: Model, run: Gathered) -> Iterable[Row]:
    """Yield the extrema and norms of states and energies over every step; arrays of shape (scheme, case)."""
    for k, state in enumerate(model.states):
        for i, (end, words) in enumerate((("min", "least"), ("max", "largest"))):
            long_name = f"{words} {state.long_name} over every step"
            yield f"{state.name}_{end}", run.ranges[..., k, i], long_name, state.unit
        long_name = f"norm of the {state.long_name} over every step"
        yield f"{state.name}_l1", run.norms[..., k, 0], f"l1 {long_name}", _times_second(state.unit)
        # udunits does not support square roots of units
        words = f"l2 {long_name} (times the square root of s)"
        yield f"{state.name}_l2", run.norms[..., k, 1], words, state.unit
    words, unit = "largest absolute energy deviation over every step", model.energy_unit
    yield "energy_deviation_max_abs", run.deviation, words, unit
    name = "energy_deviation_max_abs_interior"
    yield name, run.deviation_interior, f"{words} but the last point", unit


def _times_second(unit: str) -> str:
    """Return the unit of an integral over time."""
    of_rate, _, last = f" {unit}".rpartition(" ")
    if last == "s-1":
        return of_rate.strip() or "1"
    return "s" if unit == "1" else f"{unit} s"


def _peaks(model: Model, run: Gathered) -> Iterable[Row]:
    unit, mean = model.states[0].unit, "mean period over every step"
    height = "half the height between the last peak and the last trough, interpolated"
    yield "amplitude", 0.5 * np.abs(run.last_peak - run.last_trough), height, unit
    yield "first_peak", run.first_peak, "height of the first peak, interpolated", unit
    yield "last_peak", run.last_peak, "height of the last peak, interpolated", unit
    words = f"{mean}, interpolated (time of a turn for a member that goes over the top)"
    yield "period", run.period, words, "s"
    yield "period_grid", run.period_grid, f"{mean}, between peaks at grid points", "s"
    yield "period_count", run.period_count, "number of periods in the mean", "1"


def _ends(solution: Trajectories, end: Floats, steps: int) -> Iterable[Row]:
    failed = solution.last_step < steps
    yield "status", failed.astype(np.int8), "what became of the member", "1"
    yield "last_step", solution.last_step, "last step with finite values", "1"
    time = np.where(failed, (solution.last_step + 1) * end / steps, np.nan)
    yield "failure_time", time, "time of the first value that is not finite or too large", "s"


def _extrema(model: Model, extrema: Extrema) -> dict[str, Variable]:
    """Return the local extrema of the position, and their numbers (vibration text, section 3.5)."""
    unit, parabola = model.states[0].unit, "on the parabola through three points"
    parabola += " or of the event" if model.events is not None else ""
    table: dict[str, Variable] = {}
    for kind in ("peak", "trough"):
        rows = (
            (f"{kind}_time", f"time of the {kind}s, {parabola}", "s"),
            (kind, f"height of the {kind}s, {parabola}", unit),
            (f"{kind}_time_grid", f"time of the {kind}s at grid points", "s"),
            (f"{kind}_grid", f"height of the {kind}s at grid points", unit),
        )
        table |= _table(
            (*MEMBER, "extremum"), ((row[0], getattr(extrema, row[0]), *row[1:]) for row in rows)
        )
        name, words = f"{kind}_count", f"number of {kind}s, including those that are not stored"
        table |= _table(MEMBER, [(name, getattr(extrema, name), words, "1")])
    return table


def _events(events: EventTimes) -> Iterable[Row]:
    words = "number of events, where the motion is not smooth"
    yield "event_count", events.event_count, words, "1"
    yield "first_event_time", events.first_event_time, "time of the first event", "s"
    yield "last_event_time", events.last_event_time, "time of the last event", "s"
    words = "time from which the member was at rest to the end, or of its stop"
    yield "rest_time", events.rest_time, words, "s"


def _event_times(events: EventTimes) -> dict[str, Variable]:
    """Return the times of single events."""
    words = "times of the first events, NaN behind the last"
    return _table((*MEMBER, "event"), [("event_time", events.event_time, words, "s")])


def _own_steps(run: Gathered) -> Iterable[Row]:
    """Yield counts of adaptive schemes; NaN for other schemes."""
    words = "of an adaptive scheme, whatever the level"
    yield "accepted_steps", run.accepted_steps, f"accepted steps {words}", "1"
    evaluations = f"evaluations of the acceleration {words}, with those for its dense output"
    yield "force_evaluations_total", run.force_evaluations, evaluations, "1"
