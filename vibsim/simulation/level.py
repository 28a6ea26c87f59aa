"""One level as a record: what is stored of it, under which names."""

from __future__ import annotations

from collections.abc import Container, Iterable
from itertools import chain, count
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vibsim import plan
from vibsim.core.record import Attribute, Record, Variable, attributes
from vibsim.core.vocabulary import HIGHEST
from vibsim.experiment.storage import (
    RUNNING,
    asks_for_peaks,
    extrema_kept,
    is_bounded,
    stored_series,
)
from vibsim.models import BUDGET, ENERGIES, Model, State, centred, has_budget, has_solution
from vibsim.simulation.derived import derived
from vibsim.simulation.gathered import event_times, extrema, gathered, of_own_steps
from vibsim.simulation.members import Members, members
from vibsim.simulation.reference.solve import method, reference
from vibsim.simulation.scaled import in_scales
from vibsim.simulation.solution import Solution, has_adaptive, solve

if TYPE_CHECKING:
    import xarray

    from vibsim.experiment import Experiment

SERIES = ("scheme", "case", "t")
MOST_REFERENCES = 1024
"""Of more members no reference is computed where the exact solution is not known."""

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


def simulate(experiment: Experiment, level: int, *, threads: int = 1) -> xarray.Dataset:
    """Run every scheme and member of `experiment` at `level`.

    Parameters
    ----------
    threads
        How many threads share the members; no number depends on it.

    Returns
    -------
    xarray.Dataset
        What the file ``level_LL.nc`` holds: states, energies and outputs at the times that are kept, their exact values
        where they are known, and of every step the extrema, periods and status of each member.

    Raises
    ------
    ValueError
        Where the experiment does not have the level.
    SimulationError
        Where a kernel cannot be compiled.
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
        raise ValueError(f"level {level} is none of {list(experiment.levels)}")
    model = experiment.model.definition
    group = members(experiment, start, experiment.members if stop is None else stop)
    steps, every = experiment.steps(level), plan.sampling(experiment, level)
    is_lean, wanted = is_bounded(experiment), stored_series(experiment)
    kept = extrema_kept(steps, len(experiment.schemes) * experiment.members)
    solution = solve(
        experiment,
        group,
        steps,
        every,
        threads,
        with_series=not _of_states(model).issuperset(wanted),
        n_extrema=0 if is_lean and not asks_for_peaks(experiment) else kept,
    )
    with_d2t = experiment.own_velocity or not is_lean
    names = [scheme.name for scheme in experiment.schemes]
    variables = {
        **_series(model, group, solution, steps, every, wanted),
        **({} if is_lean else _exact(experiment, group, steps, every)),
        **gathered(model, solution.gathered, solution.last_step, group, steps, with_d2t=with_d2t),
        **(extrema(model, solution.extrema) if solution.extrema else {}),
        **(event_times(solution.events) if solution.events else {}),
        **(of_own_steps(solution.gathered) if has_adaptive(experiment) else {}),
        **_constants(model, group, steps),
    }
    attrs: dict[str, Attribute] = {
        "model": model.kind,
        "level": level,
        "steps": steps,
        "every": every,
        "storage": "lean" if is_lean else "series",
    }
    coords = coordinates(model, names, group, steps, every, same_end=not experiment.end_varies)
    coords["level"] = Variable((), np.array(level, dtype=np.int16), attributes("level", "1"))
    return in_scales(Record(coords, variables, attrs), experiment)


def _of_states(model: Model) -> set[str]:
    """Name the series that follow from the states at the samples alone."""
    outputs = (output.name for output in model.outputs)
    return {*(state.name for state in model.states), *ENERGIES, *outputs}


def _derived_words(model: Model) -> dict[str, dict[str, Any]]:
    """Return the attributes of every series that is worked out of the states."""
    words = dict(_ENERGY_WORDS)
    if has_budget(model):
        words |= zip(BUDGET, _BUDGET_WORDS, strict=True)
    energies = {name: attributes(told, model.energy_unit) for name, told in words.items()}
    return energies | {row.name: attributes(row.long_name, row.unit) for row in model.outputs}


def _units(model: Model) -> dict[str, str]:
    """Return the unit of every number that can be swept, by dotted key."""
    states = {f"initial.{state.name}": state.unit for state in model.states}
    return states | {f"model.{p.key}": p.unit for p in model.parameters} | {"time.end": "s"}


def _numbers(steps: int, every: int) -> NDArray[np.int64]:
    return np.arange(0, steps + 1, every, dtype=np.int64)


def coordinates(
    model: Model, schemes: list[str], group: Members, steps: int, every: int, *, same_end: bool
) -> dict[str, Variable]:
    """Return the coordinates of some members at every `every`-th of `steps` steps.

    Parameters
    ----------
    schemes
        Names of the schemes.
    group
        The members; each swept key becomes a coordinate of them.
    steps, every
        Number of steps, and the stride of the samples.
    same_end
        Whether all members of the experiment end at the same time, so that ``t`` is a time and no fraction of the end.
    """
    number = _numbers(steps, every)
    t = number * (group.end[0] / steps) if same_end else number / steps
    words = "time" if same_end else "time as a fraction of the end time"
    coords = {
        "scheme": Variable(("scheme",), np.array(schemes), attributes("name of the scheme", "1")),
        "case": Variable(
            ("case",), group.index, attributes("index of the member of the sweep", "1")
        ),
        "t": Variable(
            ("t",), np.asarray(t, dtype=float), attributes(words, "s" if same_end else "1")
        ),
    }
    if not same_end:
        coords["end"] = Variable(("case",), group.end, attributes("end time of the member", "s"))
    units = _units(model)
    for key, values in group.columns.items():
        attrs = attributes(f"swept value of {key}", units.get(key, "1"), sweep_key=key)
        coords[_plain_name(key, coords)] = Variable(("case",), values, attrs)
    return coords


def _plain_name(key: str, taken: Container[str]) -> str:
    """Return a name for a swept key that netCDF programs can work with; labels of schemes may hold anything."""
    name = "".join(c if c.isascii() and c.isalnum() else "_" for c in key)
    return next(n for n in chain([name], (f"{name}_{i}" for i in count(2))) if n not in taken)


def _series(
    model: Model,
    group: Members,
    solution: Solution,
    steps: int,
    every: int,
    wanted: Iterable[str],
) -> dict[str, Variable]:
    names = list(wanted)
    table = {
        state.name: Variable(SERIES, solution.states[:, k], _of(state))
        for k, state in enumerate(model.states)
    }
    if solution.series is not None:
        velocities = model.states[model.coordinates :]
        for k, (name, velocity) in enumerate(zip(centred(model), velocities, strict=False)):
            words = f"{velocity.long_name} by [D_2t u], the centred difference of the position"
            values = solution.series.velocities_d2t[:, :, k]
            table[name] = Variable(SERIES, values, attributes(words, velocity.unit))
        for name, values in (
            ("energy_deviation", solution.series.deviation_running),
            ("energy_deviation_d2t", solution.series.deviation_d2t_running),
        ):
            words = f"largest absolute {_ENERGY_WORDS[name]}, over every step so far"
            attrs = attributes(words, model.energy_unit)
            table[name + RUNNING] = Variable(SERIES, values, attrs)
        table = {name: variable for name, variable in table.items() if name in names}
    told = _derived_words(model)
    worked_out = [name for name in told if name in names]
    found = derived(model, group, solution, steps, every, worked_out)
    for name in worked_out:
        table[name] = Variable(SERIES, found[name], told[name])
    attrs = attributes("total mechanical energy at t = 0", model.energy_unit)
    table["energy_initial"] = Variable(("scheme", "case"), found["energy_initial"], attrs)
    return table


def _of(state: State) -> dict[str, Any]:
    return attributes(state.long_name, state.unit)


def _exact(experiment: Experiment, group: Members, steps: int, every: int) -> dict[str, Variable]:
    """Return the exact states, or a reference for them where they are not known."""
    model = experiment.model.definition
    if model.exact is None:
        few = has_solution(model) and experiment.members <= MOST_REFERENCES
        return _computed(model, group, _numbers(steps, every) / steps) if few else {}
    t = _numbers(steps, every) * (group.end / steps)[:, None]
    exact = model.exact(
        t,
        {name: values[:, None] for name, values in group.initial.items()},
        {name: values[:, None] for name, values in group.parameters.items()},
    )
    return {
        f"{state.name}_exact": Variable(
            ("case", "t"), exact[state.name], attributes(f"exact {state.long_name}", state.unit)
        )
        for state in model.states
    }


def _computed(model: Model, group: Members, fraction: NDArray[np.float64]) -> dict[str, Variable]:
    """Return reference solutions with the bounds of their errors; nothing where no member has one."""
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


def _constants(model: Model, group: Members, steps: int) -> dict[str, Variable]:
    frequency = np.broadcast_to(model.natural_frequency(group.parameters), group.end.shape)
    table = {
        "natural_frequency": (
            frequency,
            attributes("angular frequency of small oscillations", "rad s-1"),
        ),
        "omega_dt": (
            frequency * (group.end / steps),
            attributes("angular frequency of small oscillations times the time step", "1"),
        ),
    }
    if model.highest_frequency is not None:
        highest = np.broadcast_to(model.highest_frequency(group.parameters), group.end.shape)
        table[HIGHEST] = (
            highest * (group.end / steps),
            attributes("highest angular frequency of small oscillations times the time step", "1"),
        )
    if model.exact_period is not None:
        period = model.exact_period(group.initial, group.parameters)
        table["exact_period"] = (np.asarray(period, dtype=float), attributes("exact period", "s"))
    return {name: Variable(("case",), values, attrs) for name, (values, attrs) in table.items()}
