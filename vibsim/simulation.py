"""From an experiment and a level to the data of that level: every scheme, every member, one record.

The record holds what design and files call by name: the states, the energies, their exact values where they are
known, and what was gathered over every step. Shapes are (scheme, case, t), (case, t), (scheme, case) or (case,).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vibsim import plan
from vibsim.engine import Trajectories, integrate
from vibsim.models import MODELS, Model, State
from vibsim.record import Attribute, Record, Variable, attributes
from vibsim.schemes import SCHEMES

if TYPE_CHECKING:
    import xarray

    from vibsim.spec import Experiment

Floats = NDArray[np.float64]

STATUS = ("ok", "non_finite")
"""Meaning of the variable ``status``."""


@dataclass(frozen=True)
class Members:
    """The numbers of members start..stop-1; every array has shape (case,)."""

    index: NDArray[np.int64]
    columns: Mapping[str, Floats]
    """Swept values by dotted key."""
    parameters: Mapping[str, Floats]
    initial: Mapping[str, Floats]
    end: Floats


def simulate(experiment: Experiment, level: int) -> xarray.Dataset:
    """Run every scheme and member of `experiment` at `level`.

    Returns
    -------
    xarray.Dataset
        What the file ``level_LL.nc`` holds (design, section 4.4).

    Raises
    ------
    ValueError
        Where the experiment does not have the level.
    SimulationError
        Where a kernel cannot be compiled.
    """
    return simulate_record(experiment, level).to_xarray()


def simulate_record(
    experiment: Experiment, level: int, start: int = 0, stop: int | None = None
) -> Record:
    """Run members start..stop-1 (default: all) and return plain arrays; see `simulate`."""
    if level not in experiment.levels:
        raise ValueError(f"level {level} is none of {list(experiment.levels)}")
    model = MODELS[experiment.model.kind]
    group = members(experiment, start, plan.count(experiment) if stop is None else stop)
    steps, every = experiment.steps(level), plan.sampling(experiment, level)
    runs = [
        integrate(
            model,
            SCHEMES[scheme.kind],
            scheme.options,
            np.stack([group.parameters[p.name] for p in model.parameters], axis=-1),
            np.stack([group.initial[state.name] for state in model.states], axis=-1),
            group.end / steps,
            steps,
            every,
        )
        for scheme in experiment.schemes
    ]
    names = [scheme.name for scheme in experiment.schemes]
    coords = _coords(model, names, group, steps, every, same_end=not experiment.end_varies)
    variables = {
        **_series(model, runs),
        **_exact(model, group, steps, every),
        **_gathered(model, runs, group, steps),
        **_constants(model, group, steps),
    }
    attrs: dict[str, Attribute] = {
        "model": model.kind,
        "level": level,
        "steps": steps,
        "every": every,
    }
    return Record(coords, variables, attrs)


def members(experiment: Experiment, start: int, stop: int) -> Members:
    """Work out the numbers of members start..stop-1 from the experiment and its sweep."""
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
    return Members(
        index=np.arange(start, stop, dtype=np.int64),
        columns=columns,
        parameters=parameters,
        initial=fill("initial", experiment.initial),
        end=end,
    )


def _fractions(steps: int, every: int) -> NDArray[np.int64]:
    return np.arange(0, steps + 1, every, dtype=np.int64)


def _units(model: Model) -> dict[str, str]:
    """Return the unit of everything that can be swept, by dotted key."""
    states = {f"initial.{state.name}": state.unit for state in model.states}
    return states | {f"model.{p.name}": p.unit for p in model.parameters} | {"time.end": "s"}


def _coords(
    model: Model, schemes: list[str], group: Members, steps: int, every: int, same_end: bool
) -> dict[str, Variable]:
    number = _fractions(steps, every)
    t = number * (group.end[0] / steps) if same_end else number / steps
    coords = {
        "scheme": Variable(("scheme",), np.array(schemes), attributes("name of the scheme", "1")),
        "case": Variable(
            ("case",), group.index, attributes("index of the member of the sweep", "1")
        ),
        "t": Variable(
            ("t",),
            np.asarray(t, dtype=float),
            attributes("time", "s")
            if same_end
            else attributes("time as a fraction of the end time", "1"),
        ),
    }
    if not same_end:
        coords["end"] = Variable(("case",), group.end, attributes("end time of the member", "s"))
    units = _units(model)
    for key, values in group.columns.items():
        attrs = attributes(f"swept value of {key}", units[key], sweep_key=key)
        coords[key.replace(".", "_")] = Variable(("case",), values, attrs)
    return coords


def _series(model: Model, runs: list[Trajectories]) -> dict[str, Variable]:
    kinetic, potential = (
        np.stack([getattr(run, name) for run in runs])
        for name in ("kinetic_energy", "potential_energy")
    )
    energy = kinetic + potential
    states = zip(model.states, ("position", "velocity"), strict=True)
    table = {
        **{
            s.name: (np.stack([getattr(r, f) for r in runs]), s.long_name, s.unit)
            for s, f in states
        },
        "kinetic_energy": (kinetic, "kinetic energy", model.energy_unit),
        "potential_energy": (potential, "potential energy", model.energy_unit),
        "energy": (energy, "total mechanical energy", model.energy_unit),
        "energy_deviation": (
            energy - energy[..., :1],
            "deviation of the total energy from its initial value",
            model.energy_unit,
        ),
    }
    return {
        name: Variable(("scheme", "case", "t"), values, attributes(long_name, unit))
        for name, (values, long_name, unit) in table.items()
    }


def _exact(model: Model, group: Members, steps: int, every: int) -> dict[str, Variable]:
    if model.exact is None:
        return {}
    t = _fractions(steps, every) * (group.end / steps)[:, None]
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


def _gathered(
    model: Model, runs: list[Trajectories], group: Members, steps: int
) -> dict[str, Variable]:
    """Return what was gathered over every step, shape (scheme, case)."""
    rows = {**_extremes(model), **_peaks(model), **_outcomes(group.end, steps)}
    return {
        name: Variable(("scheme", "case"), np.stack([take(run) for run in runs]), attrs)
        for name, (take, attrs) in rows.items()
    }


Rows = dict[str, tuple[Callable[[Trajectories], Any], dict[str, Any]]]
"""Name of a variable to how it is taken from a run, shape (case,), and its attributes."""


def _extremes(model: Model) -> Rows:
    position, velocity, energy = *model.states, model.energy_unit
    words = "largest absolute energy deviation over every step"
    return {
        f"{position.name}_min": (
            lambda run: run.position_range[:, 0],
            _over_steps("least", position),
        ),
        f"{position.name}_max": (
            lambda run: run.position_range[:, 1],
            _over_steps("largest", position),
        ),
        f"{velocity.name}_min": (
            lambda run: run.velocity_range[:, 0],
            _over_steps("least", velocity),
        ),
        f"{velocity.name}_max": (
            lambda run: run.velocity_range[:, 1],
            _over_steps("largest", velocity),
        ),
        "energy_deviation_max_abs": (lambda run: run.deviation, attributes(words, energy)),
        "energy_deviation_max_abs_interior": (
            lambda run: run.deviation_interior,
            attributes(f"{words} but the last point", energy),
        ),
    }


def _over_steps(word: str, state: State) -> dict[str, Any]:
    return attributes(f"{word} {state.long_name} over every step", state.unit)


def _peaks(model: Model) -> Rows:
    unit = model.states[0].unit
    height = "half the height between the last peak and the last trough, interpolated"
    mean = "mean period over every step"
    turn = "time of a turn for a member that goes over the top"
    return {
        "amplitude": (
            lambda run: 0.5 * np.abs(run.last_peak - run.last_trough),
            attributes(height, unit),
        ),
        "first_peak": (
            lambda run: run.first_peak,
            attributes("height of the first peak, interpolated", unit),
        ),
        "last_peak": (
            lambda run: run.last_peak,
            attributes("height of the last peak, interpolated", unit),
        ),
        "period": (lambda run: run.period, attributes(f"{mean}, interpolated ({turn})", "s")),
        "period_grid": (
            lambda run: run.period_grid,
            attributes(f"{mean}, between peaks at grid points", "s"),
        ),
        "period_count": (
            lambda run: run.period_count,
            attributes("number of periods in the mean", "1"),
        ),
    }


def _outcomes(end: Floats, steps: int) -> Rows:
    flags = {
        "flag_values": np.arange(len(STATUS), dtype=np.int8),
        "flag_meanings": " ".join(STATUS),
    }

    def failure_time(run: Trajectories) -> Floats:
        return np.where(run.last_step < steps, (run.last_step + 1) * end / steps, np.nan)

    return {
        "status": (
            lambda run: (run.last_step < steps).astype(np.int8),
            {**attributes("what became of the member", "1"), **flags},
        ),
        "last_step": (lambda run: run.last_step, attributes("last step with finite values", "1")),
        "failure_time": (
            failure_time,
            attributes("time of the first value that is not finite or too large", "s"),
        ),
    }


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
    if model.exact_period is not None:
        period = model.exact_period(group.initial, group.parameters)
        table["exact_period"] = (np.asarray(period, dtype=float), attributes("exact period", "s"))
    return {name: Variable(("case",), values, attrs) for name, (values, attrs) in table.items()}
