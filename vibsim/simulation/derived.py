"""Series that follow from the stored states: energies, the work of forces, and the outputs of a model."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from vibsim.core.array_types import Floats
from vibsim.engine import Series, Trajectories, energies, lane_for, observed
from vibsim.formula import Number
from vibsim.models import BUDGET, Model, centred, tree
from vibsim.models.base import Formula, rate
from vibsim.simulation.members import Members

SAMPLES_AT_A_TIME = 2**16
"""Number of samples that are processed at a time, to bound temporary memory."""


@dataclass(frozen=True)
class _Samples:
    """The stored samples of members of one scheme, (case, t), with the parameters of these members."""

    model: Model
    parameters: Floats
    dt: Floats
    every: int
    states: Floats
    series: Series | None
    lane: str
    own_energies: Floats | None
    """Kinetic and potential energy, shape (case, 2, t), if they do not follow from the states."""

    def energies(self, velocities: Floats) -> tuple[Floats, Floats]:
        """Return kinetic and potential energy, shape (case, t), with velocities of shape (coordinate, case, t)."""
        if self.own_energies is not None:
            return self.own_energies[:, 0], self.own_energies[:, 1]
        states = np.concatenate([self.states[: self.model.coordinates], velocities])
        return energies(self.model, self.parameters, self.dt, self.every, states, lane=self.lane)

    def values(self, formulas: tuple[Formula, ...]) -> Floats:
        """Return the values of formulas, shape (formula, case, t)."""
        numbers = self.parameters, self.dt, self.every
        return observed(self.model, formulas, *numbers, self.states, lane=self.lane)


def derived(
    model: Model,
    group: Members,
    solution: Trajectories,
    steps: int,
    every: int,
    wanted: Iterable[str],
) -> dict[str, Floats]:
    """Return series computed from the stored states, and the work of forces from sums over every step.

    Parameters
    ----------
    solution
        See `vibsim.simulation.solution.solve`.
    wanted
        Names from `vibsim.models.quantities`, except states and centred velocities.

    Returns
    -------
    dict
        Name to series, shape (scheme, case, t); and ``energy_initial``, shape (scheme, case).
    """
    schemes, _, cases, times = solution.states.shape
    result = {name: np.empty((schemes, cases, times)) for name in wanted}
    result["energy_initial"] = np.empty((schemes, cases))
    parameters = group.numbers(model)
    lane = lane_for(cases, schemes * times, step_work=model.coordinates)
    piece = max(SAMPLES_AT_A_TIME // times, 1)
    for s in range(schemes):
        for first in range(0, cases, piece):
            part = slice(first, first + piece)
            samples = _Samples(
                model=model,
                parameters=parameters[part],
                dt=group.end[part] / steps,
                every=every,
                states=solution.states[s, :, part],
                series=solution.series and _part(solution.series, s, part),
                lane=lane,
                own_energies=None if solution.energies is None else solution.energies[s, part],
            )
            for name, values in _series(samples, result.keys()):
                if name in result:
                    result[name][s, part] = values
    return result


def _part(series: Series, scheme: int, part: slice) -> Series:
    def subset(row: Any) -> Any:
        return None if row is None else row[scheme, part]

    return Series(**{field.name: subset(getattr(series, field.name)) for field in fields(series)})


def _series(samples: _Samples, wanted: Iterable[str]) -> Iterator[tuple[str, Floats]]:
    """Yield series of shape (case, t) by name; expensive ones only if they are wanted."""
    kinetic, potential = samples.energies(samples.states[samples.model.coordinates :])
    energy = kinetic + potential
    start = energy[:, :1]
    # members that grow without bound overflow
    with np.errstate(over="ignore", invalid="ignore"):
        yield "kinetic_energy", kinetic
        yield "potential_energy", potential
        yield "energy", energy
        yield "energy_deviation", energy - start
        yield "energy_initial", energy[:, 0]
        *_, energy_d2t, deviation_d2t = centred(samples.model)
        if {energy_d2t, deviation_d2t}.intersection(wanted):
            by_differences = _energy_d2t(samples)
            yield energy_d2t, by_differences
            yield deviation_d2t, by_differences - start
        if set(BUDGET).intersection(wanted):
            dissipated, driven = _work(samples)
            budget = (energy - start) + dissipated - driven
            yield from zip(BUDGET, (dissipated, driven, budget), strict=True)
    outputs = [output for output in samples.model.outputs if output.name in wanted]
    if outputs:
        values = samples.values(tuple(output.formula for output in outputs))
        yield from zip((output.name for output in outputs), values, strict=True)


def _energy_d2t(samples: _Samples) -> Floats:
    """Return the energy with ``[D_2t u]`` as the velocity; NaN where that is undefined or overflows."""
    assert samples.series is not None
    velocities = samples.series.velocities_d2t
    if np.isnan(velocities).all():
        return np.full(samples.states.shape[1:], np.nan)
    kinetic, potential = samples.energies(np.moveaxis(velocities, 1, 0))
    energy = kinetic + potential
    return np.where(np.isfinite(energy), energy, np.nan)


def _work(samples: _Samples) -> tuple[Floats, Floats]:
    """Return the energy that damping took and the work of driving forces since the start.

    The integral of a power P is the trapezoidal sum over every step, ``dt (sum P - (P_0 + P_n)/2)``, with the end
    correction ``-dt^2/12 (P'_n - P'_0)`` (Euler-Maclaurin, of fourth order for smooth P). With events P is not smooth,
    and the engine integrates both powers piece by piece (`vibsim.engine.events.note_piece`).
    """
    model, series = samples.model, samples.series
    assert series is not None
    assert series.driven is not None
    assert series.dissipated is not None
    if model.events is not None:
        (cost,) = samples.values((model.events.cost,))
        return cost * series.lost + series.dissipated, series.driven
    powers = [
        Number(0.0) if formula is None else tree(model, formula)
        for formula in (model.dissipation, model.driving)
    ]
    values = samples.values((*powers, *(rate(model, power) for power in powers)))
    h = samples.dt[:, None]

    def integral(total: Floats, power: Floats, slope: Floats) -> Floats:
        ends = 0.5 * (power + power[:, :1])
        return h * (total - ends) - h * h / 12.0 * (slope - slope[:, :1])

    return (
        integral(series.dissipated, values[0], values[2]),
        integral(series.driven, values[1], values[3]),
    )
