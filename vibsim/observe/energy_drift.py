r"""Growth of the energy error with time: none, bounded, linear, quadratic or exponential.

The fitted quantity is M(t), the largest absolute deviation over all steps so far. Let m1, m2, m3 be its means over
[T/2, T], [T/4, T/2] and [T/8, T/4]. If ``M = a + b t^k``, ``(m1 - m2)/(m2 - m3) = 2^k`` for any a and b: the means
smooth the steps in which a drift rises under an oscillation, and a is the oscillation itself. The rules, in order:

- ``none``: M(T) is at most `ABOVE_ROUND_OFF` times the predicted round-off of the energy;
- ``unclear``: fewer than `LEAST_PERIODS` periods, so that the window from T/8 on does not contain a whole oscillation,
  or fewer than `LEAST_SAMPLES` samples;
- ``exponential``: the energy itself has changed by more than a factor e^`LARGE_CHANGE`, and the k of ``|ln(E/E(0))|``
  is closer to 1 than that of M. A smaller change cannot be distinguished from a linear one, and counts as linear. An
  energy that falls below the smallest normal number is only fitted above it, and is never bounded;
- ``bounded``: m1 exceeds m2 by less than `STILL` of M(T), or M only creeps: k below `CREEP`, and m1 exceeds m2 by less
  than `STILL_CREEPS` (finer sampling of the same maximum). The same must hold for the range of the deviation so far,
  which a drift widens from the start, while M is constant until the drift exceeds the opposite swing of an oscillation;
- ``linear``, ``quadratic``: k of M or of that range is within `NEAR_POWER` of 1 or 2. The range decides if it gives 1
  and M gives 2, because M may seem quadratic when a drift has just begun to dominate. The range, and M if it has risen
  by less than `SMALL_RISE` of itself, must still grow in the last T/8, by at least `STILL_WIDENS` of a steady drift:
  an oscillation with a slowly moving centre, or with several frequencies, widens them temporarily. A drift that only
  shows in the range, or in a small rise of M, must move both ends of the range in the same direction;
- otherwise ``unclear``.

A drift of less than `STILL` over the run is called bounded; a longer run would show it. Where the velocity at the last
point has a formula of its own (`Scheme.has_own_end`), or does not exist, the sample before stands in its place.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from vibsim.apriori.roundoff_floor import SPACING_AT_ONE, solution_size
from vibsim.convergence.differences import largest, safe_ratio
from vibsim.convergence.thresholds import ABOVE_ROUND_OFF
from vibsim.core.array_types import Codes, Flags, Floats
from vibsim.core.vocabulary import CENTRED, DRIFTS
from vibsim.elementary import on_arrays
from vibsim.formula import derivative, values
from vibsim.models.base import tree
from vibsim.observe import thresholds as th
from vibsim.observe.member_block import MemberBlock, energy_at_start, stored_or_nan
from vibsim.schemes.base import UNIT_ROUND_OFF, round_off

NONE, BOUNDED, LINEAR, QUADRATIC, EXPONENTIAL, UNCLEAR = range(len(DRIFTS))
"""Index into `vocabulary.DRIFTS`."""


@dataclass(frozen=True)
class Drift:
    """Growth of the energy error of members; arrays of shape (scheme, case)."""

    kind: Codes  # index into `vocabulary.DRIFTS`
    # linear, quadratic: relative energy error per period, or per period squared; exponential: change of ln E per
    # period; none, bounded: 0; unclear: NaN
    rate: Floats
    power: Floats  # k; NaN if undetermined
    largest: Floats  # M(T) over the energy at the start; NaN if that is 0
    means: Floats  # m3, m2 and m1, of M or of the range, as energies, shape (scheme, case, 3)
    round_off: Floats  # M(T) up to which the drift is ``none``, in the unit of the energy


def drift_at(block: MemberBlock, level: int, name: str = "energy_deviation") -> Drift:
    """Return the growth of an energy deviation at a level; `name` may have the suffix `CENTRED`.

    NaN rows of its series are ``unclear``.
    """
    record, index = block.records[level], block.grid.levels.index(level)
    initial = energy_at_start(record)
    deviation = stored_or_nan(record, name, (*block.shape, len(record["t"])))
    # over all steps so far, or over the samples so far if that is not stored
    if f"{name}_running_max" in record:
        running = np.asarray(record[f"{name}_running_max"], dtype=float)
    else:
        inner = np.array(deviation)
        if name.endswith(CENTRED):
            inner[..., [0, -1]] = 0.0
        running = np.asarray(np.maximum.accumulate(np.abs(inner), axis=-1))
    # from the energy itself if stored, which has more digits if it decays
    plain = name.replace("_deviation", "")
    energy = record[plain] if plain in record else initial[..., None] + deviation
    ratio = safe_ratio(*np.broadcast_arrays(energy, initial[..., None]))
    if name.endswith(CENTRED):
        ratio[..., 0] = 1.0
    one_sided = ~block.has_own_end()
    running = _held(running, one_sided)
    if f"{name}_max_abs_interior" in record:
        over_steps = np.asarray(record[f"{name}_max_abs_interior"], dtype=float)
        running[one_sided, -1] = over_steps[one_sided]
    has_no_end = one_sided | name.endswith(CENTRED)
    ratio, deviation = _held(ratio, has_no_end), _held(deviation, has_no_end)
    size = np.abs(initial) + solution_size([np.nan_to_num(deviation)])
    # for members that grow without bound the floor overflows
    with np.errstate(over="ignore", invalid="ignore"):
        condition = _condition(block, level, size)
        # not magnified by the motion, which shifts a disturbance in time but conserves the energy
        floor = block.floor_of(name, size * condition / block.magnified)[..., index]
        floor = np.maximum(floor, _of_steps(block, level) * size * condition)
    # for an adaptive scheme the floor contains its tolerance, which is not round-off
    floor[block.adaptive] = SPACING_AT_ONE * size[block.adaptive]
    w, exact = (
        stored_or_nan(record, name, block.shape[1:])
        for name in ("natural_frequency", "exact_period")
    )
    end = block.group.end
    periods = np.where(np.isnan(w), end / exact, w * end / (2.0 * np.pi))
    found = drift_of(running, ratio, initial, floor, periods, deviation)
    # the period of a large swing is not that of small oscillations
    is_other = np.isfinite(w * exact) & (not block.model.linear)
    longer = np.where(is_other, w * exact / (2.0 * np.pi), 1.0)
    factor = np.where(found.kind == QUADRATIC, longer**2, longer)
    return replace(found, rate=found.rate * factor)


def _held(series: Floats, members: Flags) -> Floats:
    """Return a series (scheme, case, t) in which the last sample of some members repeats the one before."""
    result = np.array(series)
    result[members, -1] = result[members, -2]
    return result


def _condition(block: MemberBlock, level: int, size: Floats) -> Floats:
    """Return the condition number of the energy with respect to the states, at least 1, shape (scheme, case).

    A conserved energy keeps the error of every rounding of the states, ``dE = sum of (dE/dx) dx``, with dx relative to
    the size of x. Relative to the energy (`size`) it is 2 for an oscillation about 0, which counts as 1, and much more
    if positions are large compared with the amplitude. An energy that is not conserved follows the motion and its
    magnification.
    """
    model, record = block.model, block.records[level]
    if not model.conservative:
        return np.broadcast_to(block.magnified, size.shape)
    states = {s.name: np.asarray(record[s.name], dtype=float) for s in model.states}
    numbers = {**block.group.by_name(model), **states, "t": 0.0}
    energy = tree(model, model.kinetic_energy) + tree(model, model.potential_energy)
    square = np.zeros(next(iter(states.values())).shape)
    with np.errstate(all="ignore"):
        for name, values_of in states.items():
            slope = values(derivative(energy, name), numbers)
            square = square + (slope * largest(values_of)[..., None]) ** 2
        condition = 0.5 * safe_ratio(np.sqrt(largest(square)), size)
    return np.asarray(np.fmax(condition, 1.0))


def _of_steps(block: MemberBlock, level: int) -> Floats:
    """Return the part of the round-off of the energy that depends on the step, shape (scheme, case).

    It is relative to the energy, over `ABOVE_ROUND_OFF`. Rounded coefficients change every step, of size p = w dt, by
    the same relative error: N p. Steps larger than a radian are differences of numbers of size p^2, with independent
    rounding errors: ``N^(1/2) p^2``. Centred differences have their own prediction for each arithmetic.
    """
    kinds = [scheme.method for scheme in block.experiment.schemes]
    plain = np.array([kind.round_off is round_off for kind in kinds])
    index = block.grid.levels.index(level)
    p, steps = block.radians[:, index], block.grid.steps[index]
    size = th.STEPPED * UNIT_ROUND_OFF * (steps * p + steps**0.5 * p * p)
    return np.where(plain[:, None], np.minimum(size, th.MOST_ROUNDED), 0.0) / ABOVE_ROUND_OFF


@np.errstate(divide="ignore", invalid="ignore", over="ignore")
def drift_of(
    running: Floats,
    ratio: Floats,
    energy: Floats,
    floor: Floats,
    periods: Floats,
    deviation: Floats,
) -> Drift:
    """Return the growth of the energy error.

    Parameters
    ----------
    running, ratio
        M, and the energy over its initial value, shape (scheme, case, t), evenly sampled from 0 to the end.
    energy, floor
        The energy at the start, and its predicted round-off at the end, shape (scheme, case).
    periods
        Length of the run in natural periods, shape (case,).
    deviation
        The deviation with its sign, in the shape of M.
    """
    samples = running.shape[-1] - 1
    end = np.fmax.reduce(running, axis=-1)
    change = on_arrays.log(np.abs(ratio))
    fall, k_log = _power(np.abs(change))
    last, left = change[..., -1], np.abs(ratio * energy[..., None])[..., -1]
    means, so_far = _means(running), _range(deviation)
    of_range = _means(so_far)
    (rise, k), (range_rise, range_k) = _rise(means), _rise(of_range)
    # the last rise of an oscillation with several frequencies may be a stair
    moves = _shifts_the_range(deviation)
    stops = (_last_rise(running) < th.STILL_WIDENS * rise) | ~moves
    range_stops = (_last_rise(so_far) < th.STILL_WIDENS * range_rise) | ~moves
    gone = (left < th.SMALLEST_NORMAL) & (np.abs(energy) > th.SMALLEST_NORMAL)
    size = np.where(np.isfinite(end) & (end > 0), end, 1.0)
    allowed = np.broadcast_to(ABOVE_ROUND_OFF * floor, end.shape)
    still = _is_still(rise, k, size)
    # M is constant until a drift exceeds the opposite swing of an oscillation; shortly after, its k is arbitrary
    overtakes = _is_near(k, 2) & _is_near(range_k, 1)
    widens = still | overtakes | ~(_is_near(k, 1) | _is_near(k, 2))
    widens &= samples >= th.LEAST_PER_PERIOD * periods
    widens &= ~_is_still(range_rise, range_k, size)
    has_stopped = np.where(widens, range_stops, (rise < th.SMALL_RISE * size) & stops)
    means = np.where(widens[..., None], of_range, means)
    rise, k = np.where(widens, range_rise, rise), np.where(widens, range_k, k)
    still &= ~widens
    closer = ~(np.abs(k_log - 1.0) >= np.abs(k - 1.0))
    exponential = (np.abs(last) > th.LARGE_CHANGE) & _is_near(k_log, 1) & closer
    short = (periods < th.LEAST_PERIODS) | (samples < th.LEAST_SAMPLES)
    unknown = ~np.isfinite(end) | np.isnan(running[..., -1])
    rules = [
        (unknown, UNCLEAR),
        (end <= allowed, NONE),
        (np.broadcast_to(short, end.shape), UNCLEAR),
        (exponential, EXPONENTIAL),
        (gone, UNCLEAR),
        (still, BOUNDED),
        (has_stopped, UNCLEAR),
        (_is_near(k, 1), LINEAR),
        (_is_near(k, 2), QUADRATIC),
    ]
    kind = np.select([mask for mask, _ in rules], [code for _, code in rules], UNCLEAR)
    relative = safe_ratio(rise, np.abs(energy))
    time = np.linspace(0.0, 1.0, samples + 1)
    first, second = (np.broadcast_to(_power(time**j)[0] * periods**j, end.shape) for j in (1, 2))
    per_period, per_square = safe_ratio(relative, first), safe_ratio(relative, second)
    of_log = safe_ratio(np.sign(last) * fall, first)
    for at in zip(*np.nonzero((kind == UNCLEAR) & gone & ~unknown & ~short), strict=True):
        per_sample, k[at] = _decay(change[at], np.abs(ratio[at] * energy[at]) >= th.SMALLEST_NORMAL)
        if per_sample < 0:
            kind[at], of_log[at] = EXPONENTIAL, per_sample * samples / periods[at[-1]]
    rates = {LINEAR: per_period, QUADRATIC: per_square, EXPONENTIAL: of_log}
    still_or_none = np.where((kind == NONE) | (kind == BOUNDED), 0.0, np.nan)
    rate = np.select([kind == code for code in rates], list(rates.values()), still_or_none)
    power = np.where((kind != NONE) & ~unknown & ~short, k, np.nan)
    relative = safe_ratio(end, np.abs(energy))
    return Drift(kind.astype(np.int8), rate, power, relative, means, allowed)


def _is_near(k: Floats, power: int) -> Flags:
    return np.asarray(np.abs(k - power) <= th.NEAR_POWER)


def _is_still(rise: Floats, k: Floats, size: Floats) -> Flags:
    """Tell whether a running maximum no longer grows, or only creeps."""
    creeps = (rise <= th.STILL_CREEPS * size) & (k <= th.CREEP)
    return np.asarray((rise <= th.STILL * size) | creeps)


def _range(deviation: Floats) -> Floats:
    """Return the largest minus the least deviation so far, including 0 at the start."""
    inner = deviation.copy()
    inner[..., 0] = 0.0
    highest, lowest = (f.accumulate(inner, axis=-1) for f in (np.maximum, np.minimum))
    return np.asarray(highest - lowest)


def _shifts_the_range(deviation: Floats) -> Flags:
    """Tell whether both ends of the range move in the same direction from the third quarter to the last, as in a drift.

    An oscillation with several frequencies may temporarily grow on one side only.
    """
    n = deviation.shape[-1] - 1
    if n < th.LEAST_SAMPLES:
        return np.ones(deviation.shape[:-1], dtype=bool)
    third, last = deviation[..., n // 2 : 3 * n // 4], deviation[..., 3 * n // 4 :]
    high, low = (f(last, axis=-1) - f(third, axis=-1) for f in (np.max, np.min))
    slower, faster = (f(np.abs(high), np.abs(low)) for f in (np.minimum, np.maximum))
    return np.asarray((np.sign(high) == np.sign(low)) & (slower >= th.BOTH_MOVE * faster))


def _last_rise(values: Floats) -> Floats:
    """Return an estimate of m1 - m2 from the means over the last two eighths, exact for k = 1."""
    n = values.shape[-1]
    width = max(n // 8, 1)
    last, previous = values[..., n - width :], values[..., max(n - 2 * width, 0) : n - width]
    return np.asarray(3.0 * (np.mean(last, axis=-1) - np.mean(previous, axis=-1)))


def _decay(change: Floats, is_normal: Flags) -> tuple[float, float]:
    """Return the rate of an exponential decay up to the last normal number, per sample, and k; NaN for other decays.

    With too few samples for a fit it is the mean rate.
    """
    normal = change[: np.flatnonzero(is_normal)[-1] + 1]
    if len(normal) <= th.LEAST_SAMPLES:
        return float(normal[-1] / (len(normal) - 1)) if len(normal) > 1 else -np.inf, np.nan
    fall, k = _power(np.abs(normal))
    n = len(normal) - 1
    rise, _ = _power(np.arange(n + 1.0))
    return float(-fall / rise) if abs(k - 1.0) <= th.NEAR_POWER else np.nan, float(k)


def _power(values: Floats) -> tuple[Floats, Floats]:
    """Return m1 - m2 and k of a series."""
    return _rise(_means(values))


def _means(values: Floats) -> Floats:
    """Return m3, m2 and m1, along a new last dimension in place of the time."""
    n = values.shape[-1] - 1
    windows = [(n // 8, n // 4), (n // 4, n // 2), (n // 2, n)]
    return np.stack([np.mean(values[..., a : b + 1], axis=-1) for a, b in windows], axis=-1)


def _rise(means: Floats) -> tuple[Floats, Floats]:
    """Return m1 - m2 and k from `_means`."""
    third, second, first = (means[..., i] for i in range(3))
    rise = np.asarray(first - second)
    return rise, on_arrays.log2(rise / (second - third))
