"""Members extrapolated over the levels of a ladder, and what the tableau has to know about them.

`vibsim.convergence.state_extrapolation` chooses at every time of every member. It must know the powers in which the
errors of a scheme expand, and how large the round-off of the levels is. Schemes predict that relative to the solution,
from the arithmetic and the number of steps, but a motion may magnify it a millionfold: near the separatrix of the
pendulum. So it is measured. The coarsest level is run once more in another arithmetic, which is the same method with
other rounding errors, and the difference of the two runs says what this motion makes of them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibsim.comparison.thresholds import LONG_RUN, RECENT, RESOLVED_STEP
from vibsim.convergence.state_extrapolation import (
    Best,
    Circumstances,
    Pair,
    Tableau,
    best_entry,
    tableau,
)
from vibsim.convergence.thresholds import KNOWN_DIGIT
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
        """First power of the expansion of the error, and the distance to the next."""
        return self._powers(self.model.position, self.options)

    @cached_property
    def velocity_powers(self) -> tuple[int, int]:
        """The same of the velocity before the last time."""
        return self._powers(self.model.velocity, self._own_end())

    @cached_property
    def end_powers(self) -> tuple[int, int]:
        """The same of the velocity at the last time."""
        return self._powers(self.model.velocity, self.options)

    @cached_property
    def has_one_expansion(self) -> bool:
        """Whether position and velocity have the same powers at all times."""
        return self.position_powers == self.velocity_powers == self.end_powers

    def _others(self) -> Iterator[Options]:
        """Yield the options with another choice of one word."""
        for option in self.scheme.words:
            for choice in option.choices:
                yield {**self.options, option.name: choice}

    @cached_property
    def twin(self) -> Options | None:
        """Options of the same method with other rounding errors; None where there are none."""
        own = self.scheme.round_off(self.options, LONG_RUN)
        return next((o for o in self._others() if self.scheme.round_off(o, LONG_RUN) != own), None)

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
        """Return the options with which the last velocity is the scheme's own, as all others are."""
        mine = self.scheme.stepper(self.options)
        for other in self._others():
            its = self.scheme.stepper(other)
            same = (mine.start, mine.step, mine.variant) == (its.start, its.step, its.variant)
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

    def of(self, some: Integers | slice) -> Start:
        """Return the numbers of some of the members."""
        return Start(*(values[some] for values in vars(self).values()))


def rate_of(start: Start) -> Floats:
    """Return w, shape (case,): a change of the velocity is w times one of the position. At least 1 over the time."""
    return np.asarray(np.fmax(start.frequency, 1.0 / start.end))


@dataclass(frozen=True)
class Extrapolated:
    """The best solution of some members; arrays of shape (t, case)."""

    position: Floats
    velocity: Floats
    position_error: Floats
    velocity_error: Floats
    first: NDArray[np.intp]  # place of the coarsest level used for the position; -1 for none
    last: NDArray[np.intp]

    def largest_bounds(self) -> tuple[Floats, Floats]:
        """Return the largest bounds of position and velocity over all times, shape (case,); infinite without one."""

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

    The options of the scheme are those of the method where None.
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
    """Measure what the motion makes of rounding errors, relative to their prediction for a motion of size 1.

    It is measured at the coarsest level that resolves the motion of the member.

    Parameters
    ----------
    steps, every, levels
        Number of steps of every level, the stride of its samples, and position and velocity, each of shape (t, case).
        The coarsest may have been sampled more often than the rest, a whole number of times.
    run
        `level_at`, with threads and lane of the engine.

    Returns
    -------
    array
        Shape (t, case), the largest so far; NaN where no level resolves the motion, None where the scheme has no other
        arithmetic.
    """
    if method.twin is None:
        return None
    turned = rate_of(start) * start.end
    if np.all(turned <= RESOLVED_STEP * steps[0]):
        found = _distance_of_twin(method, start, steps[0], every[0], levels[0], run)
        return found[:: (len(found) - 1) // (len(levels[-1][0]) - 1)]
    noise = np.full(levels[-1][0].shape, np.nan)
    left = np.arange(len(turned))
    for n, stride, (u, v) in zip(steps, every, levels, strict=True):
        is_resolved = turned[left] <= RESOLVED_STEP * n
        now, left = left[is_resolved], left[~is_resolved]
        if len(now):
            part = u[:, now], v[:, now]
            found = _distance_of_twin(method, start.of(now), n, stride, part, run)
            noise[:, now] = found[:: (len(u) - 1) // (len(noise) - 1)]
        if not len(left):
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
    """Return how far apart a level and its twin have been so far, over the predicted round-off, shape (t, case)."""
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
        Position and velocity of every level, each of shape (t, case).
    noise
        What `noise_of` returned.
    """
    size = max(POINTS_AT_A_TIME // len(t), 1)
    parts = []
    for first in range(0, len(start.end), size):
        part = slice(first, first + size)
        some = [(np.ascontiguousarray(u[:, part]), v[:, part] + 0.0) for u, v in levels]
        of_part = None if noise is None else noise[:, part]
        parts.append(_extrapolate(method, start.of(part), steps, t, some, of_part))
    return join_members(parts)


def join_members(
    parts: Sequence[Extrapolated], order: NDArray[np.intp] | slice = slice(None)
) -> Extrapolated:
    """Return the members of all parts, in their order, or in the order that is given."""
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
        known = circumstances(method, start, t, levels, noise)
        powers = method.position_powers, method.velocity_powers
        if powers[0] == powers[1]:
            both = best_entry(method.tableau(steps, powers[0]), levels, known)
            found = [both, both]
        else:
            found = [
                _one_quantity(method, steps, x, levels, i, known) for i, x in enumerate(powers)
            ]
        values = [found[0].position, found[1].velocity]
        errors = [found[0].error, found[1].error + 0.0]
        if method.end_powers != powers[1] and t[-1, 0] == 1.0:
            recent = {name: getattr(known, name)[-RECENT:] for name in ("phase", "noise", "spread")}
            known = replace(known, **recent)
            levels = [(u[-RECENT:], v[-RECENT:]) for u, v in levels]
            for i, x in enumerate((powers[0], method.end_powers)):
                end = _one_quantity(method, steps, x, levels, i, known)
                values[i][-1], errors[i][-1] = end[i][-1], end.error[-1]
                if i == 0:
                    found[0].entry[-1] = end.entry[-1]
        row, column = np.divmod(found[0].entry.astype(np.intp), len(steps))
        is_none = found[0].entry < 0
        return Extrapolated(
            position=values[0],
            velocity=values[1],
            position_error=errors[0],
            velocity_error=errors[1] * known.rate,
            first=np.where(is_none, -1, row - column),
            last=np.where(is_none, -1, row),
        )


def _one_quantity(
    method: Method,
    steps: tuple[int, ...],
    powers: tuple[int, int],
    levels: Sequence[Pair],
    which: int,
    known: Circumstances,
) -> Best:
    """Extrapolate the position (0) or the velocity (1) by itself."""
    alone = [(0.0 * u, v) if which else (u, 0.0 * v) for u, v in levels]
    return best_entry(method.tableau(steps, powers), alone, known)


def inverse_power(x: Any, p: int) -> Any:
    """Return x^-p by multiplication: library powers differ in the last bit."""
    product = x
    for _ in range(p - 1):
        product = product * x
    return 1.0 / product


def circumstances(
    method: Method, start: Start, t: Floats, levels: Sequence[Pair], noise: Floats | None
) -> Circumstances:
    """Return what is known of members besides their levels; arguments as for `extrapolate_members`."""
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
        # at rest there is no error that one could not believe
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
