"""How far the solution of a scheme is from another scheme's, from the exact one, or from that of its own steps.

What may be called equal follows from the arithmetic: each side is known no better than its accumulated rounding errors.
For the states of a linear model theory bounds them (`vibsim.theory.rounding_bound`); elsewhere, and for energies,
it is `ABOVE_ROUND_OFF` times the predicted floor, an order of magnitude.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from vibsim import theory
from vibsim.apriori.exact_values import known_values
from vibsim.apriori.roundoff_floor import SPACING_AT_ONE
from vibsim.comparison.quantity_comparison import Comparison
from vibsim.convergence.thresholds import ABOVE_ROUND_OFF
from vibsim.core.array_types import Floats
from vibsim.models import ENERGIES
from vibsim.observe.member_block import CENTRED, MemberBlock, energy_at_start, plain_name
from vibsim.observe.predicted_oscillation import is_simple, natural_frequency, steppers
from vibsim.schemes import SCHEMES

if TYPE_CHECKING:
    from vibsim.experiment.schema.checks import EqualCheck


@dataclass(frozen=True)
class Apart:
    """How far two solutions are from each other, in the unit of the quantity; NaN where one of them does not exist."""

    scheme: int  # number of the scheme that is compared
    # at every stored time, shape (case, t); NaN where the quantity has no value, at the ends of ``[D_2t u]``
    over_time: Floats
    largest: Floats  # shape (case,)
    allowed: Floats  # what that may be, shape (case,)


def apart(block: MemberBlock, compared: Mapping[str, Comparison], check: EqualCheck) -> Apart:
    """Return how far the two solutions that a check compares are from each other."""
    names = [scheme.name for scheme in block.experiment.schemes]
    level = block.grid.levels[-1] if check.level is None else check.level
    first, name = names.index(check.first), check.quantity
    record = block.records[level]
    missing = np.full((*block.shape, len(record["t"])), np.nan)
    values = np.asarray(record[name], dtype=float) if name in record else missing
    floor = ABOVE_ROUND_OFF * compared[name].floor[..., block.grid.levels.index(level)]
    bound = rounding(block, level, name, first, floor[first])
    if check.second in names:
        second = names.index(check.second)
        other, more = values[second], rounding(block, level, name, second, floor[second])
    elif check.second == "exact":
        other = exact_series(block, level, name)[first]
        more = _of_exact(block, level, name, values[first])
    else:
        other, more = discrete(block, level, name)[first], np.zeros_like(bound)
    inside = slice(1, -1) if name.endswith(CENTRED) else slice(None)
    distance = np.full(block.shape[1:] + values.shape[-1:], np.nan)
    with np.errstate(invalid="ignore", over="ignore"):
        distance[:, inside] = np.abs(values[first] - other)[..., inside]
    largest = np.max(distance[:, inside], axis=-1)
    allowed = np.full(largest.shape, check.atol) if check.atol is not None else bound + more
    return Apart(first, distance, largest, np.asarray(allowed))


def rounding(block: MemberBlock, level: int, name: str, scheme: int, floor: Floats) -> Floats:
    """Return a bound of the rounding errors of one scheme over the whole run, shape (case,); else `floor`."""
    plain = plain_name(name)
    if not is_simple(block) or plain in ENERGIES or block.adaptive[scheme]:
        return np.broadcast_to(floor, block.shape[1:])
    found = np.full(block.shape[1:], np.nan)
    which = int(plain == block.model.velocity)
    for options, where in steppers(block, scheme):
        stepper = SCHEMES[block.experiment.schemes[scheme].kind].stepper(options)
        w, dt, u, v = (x[where] for x in _numbers(block, level))
        bounds = theory.rounding_bound(stepper, w, dt, u, v, steps_of(block, level))
        # the centred difference divides the rounding errors of two positions by 2 dt
        found[where] = bounds[0] / dt if name.endswith(CENTRED) else bounds[which]
    return found


def discrete(block: MemberBlock, level: int, name: str) -> Floats:
    """Return the exact solution of every scheme's own steps at the stored times, shape (scheme, case, t).

    Of a linear model without damping; NaN elsewhere, and for what is no state.
    """
    record = block.records[level]
    found = np.full((*block.shape, len(record["t"])), np.nan)
    if not is_simple(block) or name not in (block.model.position, block.model.velocity):
        return found
    which, steps = int(name == block.model.velocity), steps_of(block, level)
    n = np.arange(len(record["t"])) * int(np.asarray(record.attrs["every"]).item())
    for i, scheme in enumerate(block.experiment.schemes):
        for options, where in steppers(block, i):
            stepper = SCHEMES[scheme.kind].stepper(options)
            w, dt, u, v = (x[where] for x in _numbers(block, level))
            found[i, where] = theory.discrete(stepper, w, dt, u, v, n, steps=steps)[which]
    return found


def discrete_error(block: MemberBlock, level: int, name: str) -> Floats:
    """Return the largest distance of a state from the exact solution of the scheme's own steps, (scheme, case)."""
    record = block.records[level]
    if name not in record:
        return np.full(block.shape, np.nan)
    with np.errstate(invalid="ignore", over="ignore"):
        return np.asarray(np.max(np.abs(record[name] - discrete(block, level, name)), axis=-1))


def steps_of(block: MemberBlock, level: int) -> int:
    """Return the number of steps of a level."""
    return block.grid.steps[block.grid.levels.index(level)]


def _numbers(block: MemberBlock, level: int) -> tuple[Floats, Floats, Floats, Floats]:
    """Return w, dt and the initial position and velocity, each of shape (case,)."""
    model, initial = block.model, block.group.initial
    cases = block.shape[1:]
    return (
        np.broadcast_to(natural_frequency(block), cases),
        np.broadcast_to(block.group.end / steps_of(block, level), cases),
        np.broadcast_to(initial[model.position], cases),
        np.broadcast_to(initial[model.velocity], cases),
    )


def exact_series(block: MemberBlock, level: int, name: str) -> Floats:
    """Return the exact values at the stored times of a level, shape (scheme, case, t); NaN where they are not known."""
    record, model, plain = block.records[level], block.model, plain_name(name)
    shape = (*block.shape, len(record["t"]))
    if plain == "energy" and model.conservative:
        return np.broadcast_to(energy_at_start(record)[..., None], shape)
    n = np.arange(shape[-1]) * int(np.asarray(record.attrs["every"]).item())
    t = n * (block.group.end / steps_of(block, level))[:, None]
    initial, parameters = (
        {key: values[:, None] for key, values in table.items()}
        for table in (block.group.initial, block.group.parameters)
    )
    if model.exact is not None:
        states = model.exact(t, initial, parameters)
    else:
        names = (model.position, model.velocity)
        states = {n: record[f"{n}_exact"] for n in names if f"{n}_exact" in record}
    if plain in states:
        return np.broadcast_to(np.asarray(states[plain]), shape)
    found = known_values(model, plain, states, t, block.group)
    return np.full(shape, np.nan) if found is None else np.broadcast_to(found, shape)


def _of_exact(block: MemberBlock, level: int, name: str, values: Floats) -> Floats:
    """Return how well an exact solution is known, shape (case,): its phase w t has a rounding error."""
    record, bound = block.records[level], f"{plain_name(name)}_exact_error"
    if bound in record:
        return np.asarray(record[bound], dtype=float)
    phase = natural_frequency(block) * block.group.end
    size = np.max(np.abs(np.nan_to_num(values)), axis=-1)
    return np.asarray(SPACING_AT_ONE * (1.0 + phase) * size * block.magnified)
