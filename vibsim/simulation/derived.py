"""Series that follow from the stored states: energies, the work of forces, and what else a model gives out."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vibsim.engine import energies, lane_for, observed
from vibsim.formula import Binary, Expression, Name, Number, derivative
from vibsim.models import BUDGET, Model, centred, tree
from vibsim.models.base import Formula
from vibsim.simulation.members import Members
from vibsim.simulation.solution import Solution

Floats = NDArray[np.float64]

PIECE = 2**16
"""Samples that are worked on at a time, so that little memory is needed beside what is kept."""


@dataclass(frozen=True)
class Samples:
    """The stored samples of some members of one scheme."""

    model: Model
    parameters: Floats
    """Shape (case, n_parameters)."""
    dt: Floats
    """Shape (case,)."""
    every: int
    states: Floats
    """In the order of `Model.states`, shape (state, case, t)."""
    velocities_d2t: Floats | None
    """The centred differences, shape (case, coordinate, t); None where they were not asked for."""
    dissipated: Floats | None
    """Sum of the power of damping over every point so far, shape (case, t)."""
    driven: Floats | None
    """The same of the power of driving forces; their work so far where there are events."""
    lost: Floats | None
    """What sliding or impacts have cost so far (`vibsim.engine.results.Series`), shape (case, t)."""
    lane: str

    def energies(self, velocities: Floats) -> tuple[Floats, Floats]:
        """Return kinetic and potential energy with those velocities, shape (coordinate, case, t)."""
        states = np.concatenate([self.states[: self.model.coordinates], velocities])
        numbers = self.parameters, self.dt, self.every
        return energies(self.model, *numbers, states, lane=self.lane)

    def values(self, formulas: tuple[Formula, ...]) -> Floats:
        """Return the values of formulas, shape (formula, case, t)."""
        numbers = self.parameters, self.dt, self.every
        return observed(self.model, formulas, *numbers, self.states, lane=self.lane)


def derived(
    model: Model,
    group: Members,
    solution: Solution,
    steps: int,
    every: int,
    wanted: Iterable[str],
) -> dict[str, Floats]:
    """Work out series from the stored states, and for the work of forces from what was summed at every step.

    Parameters
    ----------
    wanted
        Names out of `vibsim.models.quantities`, the states and the centred velocity excepted.

    Returns
    -------
    dict
        Name to series, shape (scheme, case, t); and ``energy_initial``, shape (scheme, case).
    """
    shape = (solution.states.shape[0], *solution.states.shape[2:])
    found = {name: np.empty(shape) for name in wanted}
    found["energy_initial"] = np.empty(shape[:2])
    names = frozenset(found)
    for s, part, samples in _pieces(model, group, solution, steps, every):
        for name, values in _series(samples, names).items():
            found[name][s, part] = values
    return found


def _pieces(
    model: Model, group: Members, solution: Solution, steps: int, every: int
) -> Iterator[tuple[int, slice, Samples]]:
    """Yield the samples of some members of a scheme, with the number of the scheme and the place of the members."""
    schemes, _, cases, times = solution.states.shape
    parameters = np.stack([group.parameters[p.key] for p in model.parameters], axis=-1)
    lane = lane_for(cases, schemes * times)
    piece = max(PIECE // times, 1)
    series = solution.series
    for s in range(schemes):
        for first in range(0, cases, piece):
            part = slice(first, first + piece)
            yield (
                s,
                part,
                Samples(
                    model=model,
                    parameters=parameters[part],
                    dt=group.end[part] / steps,
                    every=every,
                    states=solution.states[s, :, part],
                    velocities_d2t=series.velocities_d2t[s, part] if series else None,
                    dissipated=_part(series.dissipated, s, part) if series else None,
                    driven=_part(series.driven, s, part) if series else None,
                    lost=_part(series.lost, s, part) if series else None,
                    lane=lane,
                ),
            )


def _part(values: Floats | None, scheme: int, part: slice) -> Floats | None:
    return None if values is None else values[scheme, part]


def _series(samples: Samples, wanted: frozenset[str]) -> dict[str, Floats]:
    """Return those of the series that are wanted, each of shape (case, t)."""
    kinetic, potential = samples.energies(samples.states[samples.model.coordinates :])
    energy = kinetic + potential
    start = energy[:, :1]
    # an energy that is too large for a number has no deviation
    with np.errstate(over="ignore", invalid="ignore"):
        deviation = energy - start
    found = {
        "kinetic_energy": kinetic,
        "potential_energy": potential,
        "energy": energy,
        "energy_deviation": deviation,
        "energy_initial": energy[:, 0],
    }
    *_, energy_d2t, deviation_d2t = centred(samples.model)
    if wanted & {energy_d2t, deviation_d2t}:
        found[energy_d2t] = _energy_d2t(samples)
        with np.errstate(over="ignore", invalid="ignore"):
            found[deviation_d2t] = found[energy_d2t] - start
    if wanted & set(BUDGET):
        # of a member that grows without bound, all of them do
        with np.errstate(over="ignore", invalid="ignore"):
            dissipated, done = work(samples)
            budget = (energy - start) + dissipated - done
        found |= zip(BUDGET, (dissipated, done, budget), strict=True)
    outputs = [output for output in samples.model.outputs if output.name in wanted]
    if outputs:
        values = samples.values(tuple(output.formula for output in outputs))
        found |= zip((output.name for output in outputs), values, strict=True)
    return {name: values for name, values in found.items() if name in wanted}


def _energy_d2t(samples: Samples) -> Floats:
    """Return the energy with ``[D_2t u]`` as the velocity; NaN where there is none or it overflows."""
    velocities = samples.velocities_d2t
    assert velocities is not None
    if np.isnan(velocities).all():
        return np.full(samples.states.shape[1:], np.nan)
    kinetic, potential = samples.energies(np.moveaxis(velocities, 1, 0))
    energy = kinetic + potential
    return np.where(np.isfinite(energy), energy, np.nan)


def work(samples: Samples) -> tuple[Floats, Floats]:
    """Return the energy that damping took and the work of driving forces since the start.

    The integral of a power P is the trapezoidal sum over every step, ``dt (sum P - (P_0 + P_n)/2)``, corrected at both
    ends by ``-dt^2/12 (P'_n - P'_0)``: the formula of Euler and Maclaurin, of fourth order where P is smooth. Where
    there are events it is not, and the engine has summed both piece by piece (`vibsim.engine.events.note_piece`).
    """
    model = samples.model
    if model.events is not None:
        assert samples.lost is not None
        assert samples.driven is not None
        (cost,) = samples.values((model.events.cost,))
        return cost * samples.lost, samples.driven
    powers = [
        Number(0.0) if formula is None else tree(model, formula)
        for formula in (model.dissipation, model.driving)
    ]
    values = samples.values((*powers, *(rate(model, power) for power in powers)))
    h = samples.dt[:, None]
    done = []
    for total, power, slope in zip(
        (samples.dissipated, samples.driven), values[:2], values[2:], strict=True
    ):
        assert total is not None
        ends = 0.5 * (power + power[:, :1])
        done.append(h * (total - ends) - h * h / 12.0 * (slope - slope[:, :1]))
    return done[0], done[1]


def rate(model: Model, formula: Expression) -> Expression:
    """Return how fast a formula changes along a motion of the model."""
    speeds = (Name(velocity) for velocity in model.velocities)
    pushes = (tree(model, acceleration) for acceleration in model.accelerations)
    ways: Mapping[str, Expression] = {
        "t": Number(1.0),
        **dict(zip(model.positions, speeds, strict=True)),
        **dict(zip(model.velocities, pushes, strict=True)),
    }
    total: Expression = Number(0.0)
    for name, speed in ways.items():
        slope = derivative(formula, name)
        if slope != Number(0.0):
            total = Binary("+", total, Binary("*", slope, speed))
    return total
