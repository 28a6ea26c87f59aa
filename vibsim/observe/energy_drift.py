r"""How the error of the energy grows with time: none, bounded, linear, quadratic or exponential.

What is fitted is M(t), the largest absolute deviation at every step so far. Let m1, m2, m3 be its means over
[T/2, T], [T/4, T/2] and [T/8, T/4]. Where ``M = a + b t^k``, whatever a and b, ``(m1 - m2)/(m2 - m3) = 2^k``: a means
smooths the stairs in which a drift climbs under an oscillation, and the oscillation itself is a. So, in this order:

- ``none``: M(T) is no more than `ABOVE_ROUND_OFF` times the predicted round-off of the energy;
- ``unclear``: fewer than `LEAST_PERIODS` periods, in which the window from T/8 on would not see the whole of an
  oscillation, or fewer than `LEAST_SAMPLES` samples;
- ``exponential``: the energy itself has changed by more than a factor e^`LARGE_CHANGE` and the k of ``|ln(E/E(0))|``
  is nearer to 1 than that of M. A smaller change cannot be told from a linear one, and the linear one is meant then;
  An energy that falls below the smallest normal number is fitted above it alone, and is never bounded;
- ``bounded``: m1 is above m2 by less than `STILL` of M(T), or it creeps only: k below `CREEP`, m1 above m2 by less
  than `STILL_CREEPS` (finer sampling of the same maximum); and so does the range of the deviation so far, which a drift
  widens from the start on, where M stands until the drift has overtaken an oscillation to the other side;
- ``linear``, ``quadratic``: k, of M or of that range, within `NEAR_POWER` of 1 or 2;
- else ``unclear``.

A drift so slow that a run shows less than `STILL` of it is called bounded: a longer run decides.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vibsim.convergence.differences import safe_ratio
from vibsim.convergence.thresholds import ABOVE_ROUND_OFF
from vibsim.core.array_types import Codes, Flags, Floats
from vibsim.core.vocabulary import DRIFTS
from vibsim.observe.thresholds import (
    CREEP,
    LARGE_CHANGE,
    LEAST_PER_PERIOD,
    LEAST_PERIODS,
    LEAST_SAMPLES,
    NEAR_POWER,
    SMALLEST_NORMAL,
    STILL,
    STILL_CREEPS,
)

NONE, BOUNDED, LINEAR, QUADRATIC, EXPONENTIAL, UNCLEAR = range(len(DRIFTS))
"""Index into `vocabulary.DRIFTS`."""


@dataclass(frozen=True)
class Drift:
    """How the energy error of members grows; arrays of shape (scheme, case)."""

    kind: Codes
    """Index into `vocabulary.DRIFTS`."""
    rate: Floats
    """Of a linear or quadratic drift the relative energy error per period, or per period squared; of an exponential
    one the change of ln E per period; 0 for none and bounded, NaN for unclear."""
    power: Floats
    """k; NaN where it cannot be told."""
    largest: Floats
    """M(T) over the energy at the start; NaN where that vanishes."""
    means: Floats
    """m3, m2 and m1, of M or of the range, in the unit of the energy, shape (scheme, case, 3)."""
    round_off: Floats
    """M(T) up to which the drift is ``none``, in the unit of the energy."""


def drift_of(
    running: Floats,
    ratio: Floats,
    energy: Floats,
    floor: Floats,
    periods: Floats,
    deviation: Floats | None = None,
) -> Drift:
    """Find how the energy error grows.

    Parameters
    ----------
    running
        M, shape (scheme, case, t), evenly sampled from 0 to the end; NaN at the ends does not matter.
    ratio
        The energy over that at the start, of the same shape.
    energy
        The energy at the start, shape (scheme, case).
    floor
        Predicted round-off of the energy at the end, shape (scheme, case).
    periods
        Length of the run in natural periods, shape (case,).
    deviation
        The deviation with its sign, of the shape of M; M alone decides where None.
    """
    samples = running.shape[-1] - 1
    # a one-sided velocity at the last point says nothing about the drift
    end = np.fmax.reduce(running[..., :-1], axis=-1)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        change = np.log(np.abs(ratio))
        means = _means(running)
        rise, k = _rise(means)
        fall, k_log = _power(np.abs(change))
        last = change[..., -2]
        gone = (np.abs(ratio * energy[..., None])[..., -2] < SMALLEST_NORMAL) & (
            np.abs(energy) > SMALLEST_NORMAL
        )
    size = np.where(np.isfinite(end) & (end > 0), end, 1.0)
    allowed = np.broadcast_to(ABOVE_ROUND_OFF * floor, end.shape)
    still = _is_still(rise, k, size)
    if deviation is not None:
        # M stands still until a drift has overtaken an oscillation to the other side, and is of no power then
        widens = (still | ~_is_named(k)) & (samples >= LEAST_PER_PERIOD * periods)
        of_range = _means(_range(deviation))
        widens &= ~_is_still(*_rise(of_range), size)
        means = np.where(widens[..., None], of_range, means)
        rise, k = _rise(means)
        still &= ~widens
    closer = ~(np.abs(k_log - 1.0) >= np.abs(k - 1.0))
    exponential = (np.abs(last) > LARGE_CHANGE) & (np.abs(k_log - 1.0) <= NEAR_POWER) & closer
    short = (periods < LEAST_PERIODS) | (samples < LEAST_SAMPLES)
    unknown = ~np.isfinite(end) | np.isnan(running[..., -2])
    rules = [
        (unknown, UNCLEAR),
        (end <= allowed, NONE),
        (np.broadcast_to(short, end.shape), UNCLEAR),
        (exponential, EXPONENTIAL),
        (gone, UNCLEAR),
        (still, BOUNDED),
        (np.abs(k - 1.0) <= NEAR_POWER, LINEAR),
        (np.abs(k - 2.0) <= NEAR_POWER, QUADRATIC),
    ]
    kind = np.select([mask for mask, _ in rules], [code for _, code in rules], UNCLEAR)
    relative = safe_ratio(rise, np.abs(energy))
    time = np.linspace(0.0, 1.0, samples + 1)
    first, second = (np.broadcast_to(_power(time**j)[0] * periods**j, end.shape) for j in (1, 2))
    per_period, per_square = safe_ratio(relative, first), safe_ratio(relative, second)
    of_log = safe_ratio(np.sign(last) * fall, first)
    for at in zip(*np.nonzero((kind == UNCLEAR) & gone & ~unknown & ~short), strict=True):
        per_sample, k[at] = _decay(change[at], np.abs(ratio[at] * energy[at]) >= SMALLEST_NORMAL)
        if per_sample < 0:
            kind[at], of_log[at] = EXPONENTIAL, per_sample * samples / periods[at[-1]]
    zero = np.zeros(end.shape)
    rates = {NONE: zero, BOUNDED: zero, LINEAR: per_period, QUADRATIC: per_square}
    rates[EXPONENTIAL] = of_log
    rate = np.select([kind == code for code in rates], list(rates.values()), np.nan)
    known = (kind != NONE) & ~unknown & ~short
    return Drift(
        kind.astype(np.int8),
        rate,
        np.where(known, k, np.nan),
        safe_ratio(end, np.abs(energy)),
        means,
        allowed,
    )


def _is_named(k: Floats) -> Flags:
    """Say where k is that of a linear or a quadratic drift."""
    return np.asarray((np.abs(k - 1.0) <= NEAR_POWER) | (np.abs(k - 2.0) <= NEAR_POWER))


def _is_still(rise: Floats, k: Floats, size: Floats) -> Flags:
    """Say where a largest value so far no longer grows, or creeps only."""
    creeps = (rise <= STILL_CREEPS * size) & (k <= CREEP)
    return np.asarray((rise <= STILL * size) | creeps)


def _range(deviation: Floats) -> Floats:
    """Return the largest less the least deviation so far, that at the start among them."""
    inner = deviation.copy()
    # one-sided velocities at the ends say nothing about the drift
    inner[..., 0], inner[..., -1] = 0.0, inner[..., -2]
    highest, lowest = (f.accumulate(inner, axis=-1) for f in (np.maximum, np.minimum))
    return np.asarray(highest - lowest)


def _decay(change: Floats, is_normal: Flags) -> tuple[float, float]:
    """Return the rate of an exponential decay up to the last normal number, per sample, and k; NaN where it is none.

    Too few samples for a fit have their mean rate.
    """
    above = change[: np.flatnonzero(is_normal)[-1] + 1]
    if len(above) <= LEAST_SAMPLES:
        return float(above[-1] / (len(above) - 1)) if len(above) > 1 else -np.inf, np.nan
    fall, k = _power(np.abs(above))
    n = len(above) - 1
    rise, _ = _power(np.arange(n + 1.0))
    return float(-fall / rise) if abs(k - 1.0) <= NEAR_POWER else np.nan, float(k)


def _power(values: Floats) -> tuple[Floats, Floats]:
    """Return by how much the mean over the last window exceeds the one before, and k."""
    return _rise(_means(values))


def _means(values: Floats) -> Floats:
    """Return m3, m2 and m1, along a new last dimension in place of the time."""
    n = values.shape[-1] - 1
    # each with its last point, but for the end of the run
    windows = [(n // 8, n // 4 + 1), (n // 4, n // 2 + 1), (n // 2, max(n, n // 2 + 1))]
    return np.stack([np.mean(values[..., a:b], axis=-1) for a, b in windows], axis=-1)


def _rise(means: Floats) -> tuple[Floats, Floats]:
    """Return m1 - m2, and k."""
    third, second, first = (means[..., i] for i in range(3))
    rise = np.asarray(first - second)
    with np.errstate(divide="ignore", invalid="ignore"):
        return rise, np.log2(rise / (second - third))
