"""Members extrapolated over the levels of a ladder, and the facts about them that the tableau needs.

`vibsim.convergence.extrapolation.states` needs the powers in which the errors of a scheme expand, and the round-off of
the levels. Schemes predict round-off relative to the solution, from the arithmetic and the number of steps, but a
motion may amplify it a millionfold, as near the separatrix of the pendulum. So it is measured: the coarsest level runs
once more in another arithmetic, which is the same method with other rounding errors, which shows the amplification.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibsim.comparison.thresholds import LONG_RUN, RECENT, RESOLVED_STEP
from vibsim.convergence.extrapolation.states import (
    Best,
    Circumstances,
    Pair,
    Tableau,
    best_entry,
    tableau,
)
from vibsim.convergence.extrapolation.thresholds import KNOWN_DIGIT
from vibsim.core.array_types import Floats, Integers
from vibsim.engine import integrate
from vibsim.models import Model
from vibsim.schemes import Options, Scheme

POINTS_AT_A_TIME = 2**14  # points extrapolated at a time, so that the tableau stays in cache


@dataclass(frozen=True)
class Method:
    """A scheme with its options on a model."""

    model: Model
    scheme: Scheme
    options: Options

    @cached_property
    def position_powers(self) -> tuple[int, int]:
        """First power of the expansion of the position error, and the distance to the next power."""
        return self._powers(self.model.position, self.options)

    @cached_property
    def velocity_powers(self) -> tuple[int, int]:
        """The same for the velocity before the last time."""
        return self._powers(self.model.velocity, self._own_end())

    @cached_property
    def end_powers(self) -> tuple[int, int]:
        """The same for the velocity at the last time."""
        return self._powers(self.model.velocity, self.options)

    @cached_property
    def has_one_expansion(self) -> bool:
        """Whether position and velocity have the same powers at all times."""
        return self.position_powers == self.velocity_powers == self.end_powers

    def _variants(self) -> Iterator[Options]:
        """Yield the options with another choice of one word."""
        for option in self.scheme.words:
            for choice in option.choices:
                yield {**self.options, option.name: choice}

    @cached_property
    def twin(self) -> Options | None:
        """Options of the same method with other rounding errors, or None."""
        own = self.scheme.round_off(self.options, LONG_RUN)
        return next(
            (o for o in self._variants() if self.scheme.round_off(o, LONG_RUN) != own), None
        )

    def tableau(self, steps: tuple[int, ...], powers: tuple[int, int]) -> Tableau:
        """Return the tableau of a quantity whose error has these powers."""
        known = self._tableaux.get((steps, powers))
        if known is None:
            round_off = tuple(self.scheme.round_off(self.options, n) for n in steps)
            known = self._tableaux[steps, powers] = tableau(steps, *powers, round_off)
        return known

    @cached_property
    def _tableaux(self) -> dict[tuple[tuple[int, ...], tuple[int, int]], Tableau]:
        return {}

    def _powers(self, quantity: str, options: Options) -> tuple[int, int]:
        p = int(self.scheme.formal_order(quantity, self.model, options))
        return p, 2 if self.scheme.has_even_powers(quantity, self.model, options) else 1

    def _own_end(self) -> Options:
        """Return options with which the last velocity is computed like all others."""
        own = self.scheme.stepper(self.options)
        for other in self._variants():
            its = self.scheme.stepper(other)
            same = (own.start, own.step, own.variant) == (its.start, its.step, its.variant)
            if its.end == "own" and same:
                return other
        return self.options


@dataclass(frozen=True)
class Start:
    """The numbers of some members."""

    parameters: Floats  # in the order of `Model.parameters`, shape (case, n_parameters)
    initial: Floats  # position and velocity, shape (case, 2)
    end: Floats  # shape (case,)
    frequency: Floats  # angular frequency of small oscillations, shape (case,)

    def of(self, subset: Integers | slice) -> Start:
        """Return the numbers of some of the members."""
        return Start(*(values[subset] for values in vars(self).values()))


def rate_of(start: Start) -> Floats:
    """Return the ratio w of velocity to position changes, at least 1/end, shape (case,)."""
    return np.asarray(np.fmax(start.frequency, 1.0 / start.end))


@dataclass(frozen=True)
class Extrapolated:
    """The best solution of some members; arrays of shape (t, case)."""

    position: Floats
    velocity: Floats
    position_error: Floats
    velocity_error: Floats
    first: NDArray[np.intp]  # index of the coarsest level used for the position; -1 for none
    last: NDArray[np.intp]

    def largest_bounds(self) -> tuple[Floats, Floats]:
        """Return the largest bounds of position and velocity over all times, shape (case,); infinite if unknown."""

        def largest(values: Floats, errors: Floats) -> Floats:
            is_known = np.isfinite(values) & ~np.isnan(errors)
            return np.asarray(np.max(np.where(is_known, errors, np.inf), axis=0))

        velocity = largest(self.velocity, self.velocity_error)
        return largest(self.position, self.position_error), velocity


def level_at(
    method: Method,
    start: Start,
    steps: int,
    every: int,
    options: Options | None = None,
    *,
    threads: int = 1,
    lane: str | None = None,
) -> Pair:
    """Run one level; return position and velocity at every `every`-th step, each of shape (t, case).

    The options of the scheme are those of the method by default.
    """
    run = integrate(
        method.model,
        method.scheme,
        method.options if options is None else options,
        start.parameters,
        start.initial,
        start.end / steps,
        steps,
        every,
        lane=lane,
        threads=threads,
        with_gathered=False,
    )
    return run.position.T, run.velocity.T


def noise_of(
    method: Method,
    start: Start,
    steps: Sequence[int],
    every: Sequence[int],
    levels: Sequence[Pair],
    run: Callable[..., Pair] = level_at,
) -> Floats | None:
    """Measure round-off so far, in units of its prediction for a motion of size 1.

    It is measured at the coarsest level that resolves the motion of the member.

    Parameters
    ----------
    steps, every, levels
        Number of steps of each level, the stride of its samples, and position and velocity, each of shape (t, case).
        Coarse levels may have an integer multiple of the samples of the finest one.
    run
        `level_at`, with threads and lane of the engine.

    Returns
    -------
    array
        Shape (t, case); NaN if no level resolves the motion; None if the scheme has only one arithmetic.
    """
    if method.twin is None:
        return None
    turned = rate_of(start) * start.end
    if np.all(turned <= RESOLVED_STEP * steps[0]):
        distance = _distance_of_twin(method, start, steps[0], every[0], levels[0], run)
        return distance[:: (len(distance) - 1) // (len(levels[-1][0]) - 1)]
    noise = np.full(levels[-1][0].shape, np.nan)
    unresolved = np.arange(len(turned))
    for n, stride, (u, v) in zip(steps, every, levels, strict=True):
        is_resolved = turned[unresolved] <= RESOLVED_STEP * n
        resolved, unresolved = unresolved[is_resolved], unresolved[~is_resolved]
        if len(resolved):
            level = u[:, resolved], v[:, resolved]
            distance = _distance_of_twin(method, start.of(resolved), n, stride, level, run)
            noise[:, resolved] = distance[:: (len(u) - 1) // (len(noise) - 1)]
        if not len(unresolved):
            break
    return noise


def _distance_of_twin(
    method: Method,
    start: Start,
    steps: int,
    every: int,
    level: Pair,
    run: Callable[..., Pair],
) -> Floats:
    """Return the largest distance so far of a level from its twin, over the predicted round-off, shape (t, case)."""
    assert method.twin is not None
    twin = run(method, start, steps, every, method.twin)
    u, v = level
    du, dv = twin[0][: len(u)] - u, twin[1][: len(u)] - v
    distance = np.fmax(np.abs(du), np.abs(dv) / rate_of(start))
    predicted = (method.scheme.round_off(o, steps) for o in (method.options, method.twin))
    return np.asarray(np.fmax.accumulate(distance, axis=0) / max(predicted))


def extrapolate_members(
    method: Method,
    start: Start,
    steps: tuple[int, ...],
    t: Floats,
    levels: Sequence[Pair],
    noise: Floats | None,
) -> Extrapolated:
    """Extrapolate members over all levels.

    Parameters
    ----------
    t
        Times as fractions of the end, shape (t, 1).
    levels
        Position and velocity of each level, each of shape (t, case).
    noise
        Result of `noise_of`.
    """
    size = max(POINTS_AT_A_TIME // len(t), 1)
    blocks = []
    for first in range(0, len(start.end), size):
        members = slice(first, first + size)
        pairs = [(np.ascontiguousarray(u[:, members]), v[:, members] + 0.0) for u, v in levels]
        block_noise = None if noise is None else noise[:, members]
        blocks.append(_extrapolate(method, start.of(members), steps, t, pairs, block_noise))
    return join_members(blocks)


def join_members(
    parts: Sequence[Extrapolated], order: NDArray[np.intp] | slice = slice(None)
) -> Extrapolated:
    """Return the members of all parts, in this order."""
    if len(parts) == 1 and isinstance(order, slice):
        return parts[0]
    names = Extrapolated.__dataclass_fields__
    arrays = {n: np.concatenate([getattr(part, n) for part in parts], axis=1) for n in names}
    return Extrapolated(**{name: values[:, order] for name, values in arrays.items()})


def _extrapolate(
    method: Method,
    start: Start,
    steps: tuple[int, ...],
    t: Floats,
    levels: Sequence[Pair],
    noise: Floats | None,
) -> Extrapolated:
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        facts = circumstances(method, start, t, levels, noise)
        powers = method.position_powers, method.velocity_powers
        if powers[0] == powers[1]:
            both = best_entry(method.tableau(steps, powers[0]), levels, facts)
            best = [both, both]
        else:
            best = [_one_quantity(method, steps, p, levels, i, facts) for i, p in enumerate(powers)]
        values = [best[0].position, best[1].velocity]
        errors = [best[0].error, best[1].error + 0.0]
        if method.end_powers != powers[1] and t[-1, 0] == 1.0:
            recent = {name: getattr(facts, name)[-RECENT:] for name in ("phase", "noise", "spread")}
            facts = replace(facts, **recent)
            levels = [(u[-RECENT:], v[-RECENT:]) for u, v in levels]
            for i, p in enumerate((powers[0], method.end_powers)):
                end = _one_quantity(method, steps, p, levels, i, facts)
                values[i][-1], errors[i][-1] = end[i][-1], end.error[-1]
                if i == 0:
                    best[0].entry[-1] = end.entry[-1]
        row, column = np.divmod(best[0].entry.astype(np.intp), len(steps))
        is_none = best[0].entry < 0
        return Extrapolated(
            position=values[0],
            velocity=values[1],
            position_error=errors[0],
            velocity_error=errors[1] * facts.rate,
            first=np.where(is_none, -1, row - column),
            last=np.where(is_none, -1, row),
        )


def _one_quantity(
    method: Method,
    steps: tuple[int, ...],
    powers: tuple[int, int],
    levels: Sequence[Pair],
    state: int,
    facts: Circumstances,
) -> Best:
    """Extrapolate the position (0) or the velocity (1) alone."""
    alone = [(0.0 * u, v) if state else (u, 0.0 * v) for u, v in levels]
    return best_entry(method.tableau(steps, powers), alone, facts)


def inverse_power(x: Any, p: int) -> Any:
    """Return x^-p by multiplication, since powers of libraries differ in the last bit."""
    product = x
    for _ in range(p - 1):
        product = product * x
    return 1.0 / product


def circumstances(
    method: Method, start: Start, t: Floats, levels: Sequence[Pair], noise: Floats | None
) -> Circumstances:
    """Return the facts about members besides their levels; arguments as for `extrapolate_members`."""
    rate, model = rate_of(start), method.model
    size = np.zeros(len(start.end))
    for u, v in levels:
        largest = np.fmax.reduce(np.fmax(np.abs(u), np.abs(v) / rate), axis=0)
        size = np.where(largest == largest, largest, size)
    phase = rate * (t * start.end)
    measured = np.full_like(phase, np.nan) if noise is None else noise
    return Circumstances(
        rate=rate,
        size=size,
        # at rest any error is credible
        limit=np.where(
            size > 0, KNOWN_DIGIT * np.fmin(size, 0.25 * (model.turn or np.inf)), np.inf
        ),
        phase=phase,
        response=np.zeros(1)
        if model.linear
        else inverse_power(rate * start.end, method.position_powers[0]),
        noise=np.fmax(measured, size),
        spread=np.where(measured == measured, np.fmax(phase, 1.0), 1.0),
    )
