"""Members extrapolated over the levels of a ladder, and what the tableau has to know about them.

`vibsim.convergence.state_extrapolation` chooses at every time of every member. It must know the powers in which the
errors of a scheme expand, and how large the round-off of the levels is. Schemes predict that relative to the solution,
from the arithmetic and the number of steps, but a motion may magnify it a millionfold: near the separatrix of the
pendulum. So it is measured. The coarsest level is run once more in another arithmetic, which is the same method with
other rounding errors, and the difference of the two runs says what this motion makes of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibsim.comparison.member_method import Method, Start, rate_of
from vibsim.comparison.thresholds import RECENT, RESOLVED_STEP
from vibsim.convergence.state_extrapolation import Best, Circumstances, Pair, best_entry
from vibsim.convergence.thresholds import KNOWN_DIGIT
from vibsim.core.array_types import Floats
from vibsim.engine import integrate
from vibsim.schemes.base import Options

PIECE = 2**14
"""Points extrapolated at a time, so that the tableau stays in cache."""


@dataclass(frozen=True)
class Extrapolated:
    """The best solution of some members; arrays of shape (t, case)."""

    position: Floats
    velocity: Floats
    position_error: Floats
    velocity_error: Floats
    # place in the ladder of the coarsest level used for the position; -1 for none
    first: NDArray[np.intp]
    last: NDArray[np.intp]

    def largest_bounds(self) -> tuple[Floats, Floats]:
        """Return the largest bounds of position and velocity over all times, shape (case,); infinite without one."""
        return (
            _largest(self.position, self.position_error),
            _largest(self.velocity, self.velocity_error),
        )


def _largest(values: Floats, errors: Floats) -> Floats:
    is_known = np.isfinite(values) & ~np.isnan(errors)
    return np.asarray(np.max(np.where(is_known, errors, np.inf), axis=0))


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

    Parameters
    ----------
    options
        Of the scheme; those of the method where None.
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
    *,
    threads: int = 1,
    lane: str | None = None,
) -> Floats | None:
    """Measure what the motion makes of rounding errors, relative to their prediction for a motion of size 1.

    It is measured at the coarsest level that resolves the motion of the member.

    Parameters
    ----------
    steps, every
        Number of steps of every level, and the stride of its samples.
    levels
        Their position and velocity, each of shape (t, case). The coarsest may have been sampled more often than the
        rest, a whole number of times.
    threads, lane
        Of the engine; the lane is chosen by the size of the work where None.

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
        sampling = steps[0], every[0], levels[0]
        found = _apart(method, start, *sampling, threads=threads, lane=lane)
        return found[:: (len(found) - 1) // (len(levels[-1][0]) - 1)]
    noise = np.full(levels[-1][0].shape, np.nan)
    left = np.arange(len(turned))
    for n, stride, (u, v) in zip(steps, every, levels, strict=True):
        is_resolved = turned[left] <= RESOLVED_STEP * n
        now, left = left[is_resolved], left[~is_resolved]
        if len(now):
            sampling = n, stride, (u[:, now], v[:, now])
            found = _apart(method, start.of(now), *sampling, threads=threads, lane=lane)
            noise[:, now] = found[:: (len(u) - 1) // (len(noise) - 1)]
        if not len(left):
            break
    return noise


def _apart(
    method: Method,
    start: Start,
    steps: int,
    every: int,
    level: Pair,
    *,
    threads: int,
    lane: str | None,
) -> Floats:
    """Return how far apart a level and its twin have been so far, over the predicted round-off, shape (t, case)."""
    assert method.twin is not None
    twin = level_at(method, start, steps, every, method.twin, threads=threads, lane=lane)
    u, v = level
    du, dv = twin[0][: len(u)] - u, twin[1][: len(u)] - v
    apart = np.fmax(np.abs(du), np.abs(dv) / rate_of(start))
    predicted = (method.scheme.round_off(o, steps) for o in (method.options, method.twin))
    return np.asarray(np.fmax.accumulate(apart, axis=0) / max(predicted))


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
    steps
        Number of steps of every level.
    t
        Times as fractions of the end, shape (t, 1).
    levels
        Position and velocity of every level, each of shape (t, case).
    noise
        What `noise_of` returned.
    """
    case = len(start.end)
    size = max(PIECE // len(t), 1)
    parts = []
    for first in range(0, case, size):
        part = slice(first, first + size)
        some = start.of(part)
        of_part = [(np.ascontiguousarray(u[:, part]), v[:, part] + 0.0) for u, v in levels]
        parts.append(
            _extrapolate(method, some, steps, t, of_part, None if noise is None else noise[:, part])
        )
    return joined(parts)


def joined(
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
            found = [_alone(method, steps, x, levels, i, known) for i, x in enumerate(powers)]
        values = [found[0].position, found[1].velocity]
        errors = [found[0].error, found[1].error + 0.0]
        if method.end_powers != powers[1] and t[-1, 0] == 1.0:
            known, levels = _recent(known), [(u[-RECENT:], v[-RECENT:]) for u, v in levels]
            for i, x in enumerate((powers[0], method.end_powers)):
                end = _alone(method, steps, x, levels, i, known)
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


def _alone(
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


def _recent(known: Circumstances) -> Circumstances:
    times = {name: getattr(known, name)[-RECENT:] for name in ("phase", "noise", "spread")}
    return replace(known, **times)


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
