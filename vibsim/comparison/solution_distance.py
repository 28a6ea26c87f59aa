"""The distance of a solution from that of another scheme, from the exact one, or from its exact difference equations.

Solutions are equal if they differ by no more than their accumulated rounding errors. Theory bounds these for the states
of a linear model (`vibsim.theory.rounding_bound`); elsewhere, and for energies, the bound is `ABOVE_ROUND_OFF` times
the predicted floor, an order of magnitude.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vibsim import theory
from vibsim.apriori.exact_values import known_values
from vibsim.apriori.roundoff_floor import SPACING_AT_ONE
from vibsim.comparison.quantity_comparison import Compared
from vibsim.convergence.thresholds import ABOVE_ROUND_OFF
from vibsim.core.array_types import Floats
from vibsim.core.vocabulary import CENTRED, plain_name
from vibsim.experiment.schema.checks import EqualCheck
from vibsim.experiment.sweep_columns import option_groups
from vibsim.models import ENERGIES
from vibsim.observe.member_block import MemberBlock, energy_at_start, stored_or_nan
from vibsim.observe.predicted_oscillation import equilibrium, is_simple, natural_frequency


@dataclass(frozen=True)
class SolutionDistance:
    """The distance of two solutions, in the unit of the quantity; NaN where one of them does not exist."""

    scheme: int  # index of the compared scheme
    over_time: Floats  # shape (case, t); NaN without a value, at the ends of ``[D_2t u]``
    largest: Floats  # shape (case,)
    allowed: Floats  # largest distance of equal solutions, shape (case,)


def solution_distance(
    block: MemberBlock, compared: Compared, check: EqualCheck
) -> SolutionDistance:
    """Return the distance of the two solutions that a check compares."""
    names = [scheme.name for scheme in block.experiment.schemes]
    level = block.grid.levels[-1] if check.level is None else check.level
    first, name = names.index(check.first), check.quantity
    record = block.records[level]
    values = stored_or_nan(record, name, (*block.shape, len(record["t"])))
    floor = ABOVE_ROUND_OFF * compared[name].floor[..., block.grid.levels.index(level)]
    bound = rounding(block, level, name, first, floor[first])
    if check.second in names:
        second = names.index(check.second)
        reference, accuracy = values[second], rounding(block, level, name, second, floor[second])
    elif check.second == "exact":
        reference = exact_series(block, level, name)[first]
        accuracy = _accuracy_of_exact(block, level, name, values[first])
    else:
        reference, accuracy = discrete(block, level, name, first), np.zeros_like(bound)
    inside = slice(1, -1) if name.endswith(CENTRED) else slice(None)
    distance = np.full(block.shape[1:] + values.shape[-1:], np.nan)
    with np.errstate(invalid="ignore", over="ignore"):
        distance[:, inside] = np.abs(values[first] - reference)[..., inside]
    largest = np.max(distance[:, inside], axis=-1)
    allowed = np.full(largest.shape, check.atol) if check.atol is not None else bound + accuracy
    return SolutionDistance(first, distance, largest, np.asarray(allowed))


def rounding(block: MemberBlock, level: int, name: str, scheme: int, floor: Floats) -> Floats:
    """Return a bound of the rounding errors of one scheme over the whole run, shape (case,); else `floor`."""
    plain = plain_name(name)
    if not is_simple(block) or plain in ENERGIES or block.adaptive[scheme]:
        return np.broadcast_to(floor, block.shape[1:])
    result = np.full(block.shape[1:], np.nan)
    steps, numbers = _numbers(block, level)
    for options, where in option_groups(block.experiment, scheme, block.columns):
        stepper = block.experiment.schemes[scheme].method.stepper(options)
        w, dt, u, v, rest = (x[where] for x in numbers)
        of_swing = theory.rounding_bound(stepper, w, dt, u, v, steps)
        # numbers are rounded at their distance from 0, not from the place of rest
        of_rest = theory.rounding_bound(stepper, w, dt, rest, 0.0 * v, steps)
        bounds = [x + np.where(rest == 0.0, 0.0, y) for x, y in zip(of_swing, of_rest, strict=True)]
        # the centred difference divides the rounding errors of two positions by 2 dt
        bounds_of_state = bounds[int(plain == block.model.velocity)]
        result[where] = bounds[0] / dt if name.endswith(CENTRED) else bounds_of_state
    # the theory is that of an oscillation
    return np.where(np.isnan(natural_frequency(block)), floor, result)


def discrete(block: MemberBlock, level: int, name: str, scheme: int) -> Floats:
    """Return the exact solution of the difference equations of one scheme at the stored times, shape (case, t).

    It is NaN unless the model is linear and undamped and `name` is a state.
    """
    record, model = block.records[level], block.model
    series = np.full((*block.shape[1:], len(record["t"])), np.nan)
    is_known = is_simple(block) and not block.adaptive[scheme]
    if not is_known or name not in (model.position, model.velocity):
        return series
    steps, numbers = _numbers(block, level)
    n = np.arange(len(record["t"])) * record.whole("every")
    for options, where in option_groups(block.experiment, scheme, block.columns):
        w, dt, u, v, rest = (x[where] for x in numbers)
        stepper = block.experiment.schemes[scheme].method.stepper(options)
        swing, velocity = theory.discrete(stepper, w, dt, u, v, n, steps=steps)
        series[where] = velocity if name == model.velocity else swing + rest[:, None]
    return series


def discrete_error(block: MemberBlock, level: int, name: str) -> Floats:
    """Return the largest distance of a state from the exact solution of the difference equations, (scheme, case)."""
    record = block.records[level]
    if name not in record:
        return np.full(block.shape, np.nan)
    own = np.stack([discrete(block, level, name, i) for i in range(block.shape[0])])
    with np.errstate(invalid="ignore", over="ignore"):
        return np.asarray(np.max(np.abs(record[name] - own), axis=-1))


def _numbers(block: MemberBlock, level: int) -> tuple[int, tuple[Floats, ...]]:
    """Return the number of steps, and w, dt, the start and the place of rest r, each of shape (case,).

    The start is the initial position from r, and the initial velocity.
    """
    model, initial = block.model, block.group.initial
    steps, rest = block.grid.steps[block.grid.levels.index(level)], equilibrium(block)
    start = initial[model.position] - rest, initial[model.velocity]
    numbers = natural_frequency(block), block.group.end / steps, *start, rest
    return steps, tuple(np.broadcast_to(x, block.shape[1:]) for x in numbers)


def exact_series(block: MemberBlock, level: int, name: str) -> Floats:
    """Return the exact values at the stored times of a level, shape (scheme, case, t); NaN if they are unknown."""
    record, model, plain = block.records[level], block.model, plain_name(name)
    shape = (*block.shape, len(record["t"]))
    if plain == "energy" and model.conservative:
        return np.broadcast_to(energy_at_start(record)[..., None], shape)
    n = np.arange(shape[-1]) * record.whole("every")
    t = n * (block.group.end / block.grid.steps[block.grid.levels.index(level)])[:, None]
    if model.exact is not None:
        states = block.group.exact(model, t)
    else:
        known = {row.name: f"{row.name}_exact" for row in model.states}
        states = {state: record[key] for state, key in known.items() if key in record}
    exact = states.get(plain)
    if exact is None:
        exact = known_values(model, plain, states, t, block.group)
    return np.broadcast_to(np.nan if exact is None else np.asarray(exact), shape)


def _accuracy_of_exact(block: MemberBlock, level: int, name: str, values: Floats) -> Floats:
    """Return the accuracy of an exact solution, shape (case,): its phase w t has a rounding error."""
    record, bound = block.records[level], f"{plain_name(name)}_exact_error"
    if bound in record:
        return np.asarray(record[bound], dtype=float)
    size = np.max(np.abs(np.nan_to_num(values)), axis=-1)
    return np.asarray(SPACING_AT_ONE * (1.0 + block.phase) * size * block.magnified)
