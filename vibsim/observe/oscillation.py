"""What was measured of an oscillation: growth, frequency, phase error.

Of a linear, conservative model whose every step is stored they are those of the recurrence that the steps satisfy
(`vibsim.observe.recurrence`). Elsewhere they come from the peaks that every step was searched for.

Shapes are (scheme, case). A number that does not exist is NaN: a growth by peaks needs two of them.

Source: vibration text (B), sections 3.5 and 4.1, exercise 2.
"""

from __future__ import annotations

import math

import numpy as np

from vibsim.convergence.differences import safe_ratio
from vibsim.core.array_types import Floats
from vibsim.core.record import Record
from vibsim.experiment.storage import FEWEST_EXTREMA
from vibsim.observe.member_block import MemberBlock
from vibsim.observe.predicted_oscillation import is_simple, natural_frequency
from vibsim.observe.recurrence import Motion, fitted
from vibsim.observe.thresholds import PIECES_OF_TIME
from vibsim.schemes import SCHEMES


def growth_factor(record: Record) -> Floats:
    """Return the last peak over the first: two peaks at least."""
    several = np.asarray(record["period_count"]) >= 1
    return np.where(several, safe_ratio(record["last_peak"], record["first_peak"]), np.nan)


def amplitude_error(record: Record) -> Floats:
    """Return the last peak over the first one, less one."""
    return np.asarray(growth_factor(record) - 1.0)


def growth_per_period(block: MemberBlock, level: int) -> Floats:
    """Return the factor by which the amplitude grows in a period.

    The period is the natural one where the model is linear, so that it can be compared with theory even where the
    scheme's own period is far from it; else it is the measured one.
    """
    record, index = block.records[level], block.grid.levels.index(level)
    found = growth_over_run(block, record)
    motion = _recurrence(block, level)
    if motion is None:
        return found
    with np.errstate(over="ignore"):
        own = np.exp(motion.log_growth * (2.0 * np.pi / block.omega_dt[:, index]))
    return np.where(np.isfinite(own), own, found)


def growth_of_motion(block: MemberBlock, level: int) -> Floats:
    """Return the same where it is the growth of the whole motion; NaN of several coordinates.

    Two coordinates pass their energy to and fro: the peaks of the first one rise and fall without any growth.
    """
    if len(block.model.positions) > 1:
        return np.full(block.shape, np.nan)
    return growth_per_period(block, level)


def has_recurrence(block: MemberBlock, level: int) -> bool:
    """Tell whether the steps of a level satisfy a recurrence that can be seen: a linear model, and no step left out."""
    return is_simple(block) and int(np.asarray(block.records[level].attrs["every"])) == 1


def _recurrence(block: MemberBlock, level: int) -> Motion | None:
    """Return the recurrence of every run, where there is one."""
    if not has_recurrence(block, level):
        return None
    return fitted(np.asarray(block.records[level][block.model.position], dtype=float))


def growth_over_run(block: MemberBlock, record: Record) -> Floats:
    """Return the same from the first and the last peak of the whole run, the start among them; always there.

    Beyond a limit, where the sign changes at every step, the height of a peak may have either sign.
    """
    time = np.asarray(record["period"] * record["period_count"], dtype=float)
    return _per_period(block, record, np.abs(growth_factor(record)), time)


def _per_period(block: MemberBlock, record: Record, factor: Floats, time: Floats) -> Floats:
    period = np.asarray(record["period"], dtype=float)
    natural = 2.0 * np.pi / natural_frequency(block) if is_simple(block) else period
    intervals = safe_ratio(*np.broadcast_arrays(time, natural))
    usable = (factor > 0) & (intervals > 0)
    log = np.log(np.where(usable, factor, 1.0)) / np.where(usable, intervals, 1.0)
    with np.errstate(over="ignore"):
        return np.where(usable, np.exp(log), np.nan)


def frequency(block: MemberBlock, level: int) -> Floats:
    """Return the angular frequency: 2 pi over the period."""
    by_peaks = _frequency_by_peaks(block.records[level])
    motion = _recurrence(block, level)
    if motion is None:
        return by_peaks
    p = block.omega_dt[:, block.grid.levels.index(level)]
    own = motion.angle * (natural_frequency(block) / p)
    return np.where(own > 0, own, by_peaks)


def _frequency_by_peaks(record: Record) -> Floats:
    period = np.asarray(record["period"], dtype=float)
    return safe_ratio(np.full_like(period, 2 * np.pi), period)


def error_of_frequency(block: MemberBlock, level: int) -> Floats:
    """Return the frequency over the exact one, less one."""
    return np.asarray(frequency(block, level) * _exact_period(block, level) / (2 * np.pi) - 1.0)


def phase_error(block: MemberBlock, level: int) -> Floats:
    """Return the exact period less the measured one: the time by which peaks come early, per period."""
    found = frequency(block, level)
    period = safe_ratio(np.full_like(found, 2 * np.pi), found)
    return np.asarray(_exact_period(block, level) - period)


def _exact_period(block: MemberBlock, level: int) -> Floats:
    """Return the exact period, shape (case,); NaN where it is not known or infinite."""
    record = block.records[level]
    if "exact_period" not in record:
        return np.full(block.shape[1], np.nan)
    found = np.asarray(record["exact_period"], dtype=float)
    return np.where(np.isfinite(found), found, np.nan)


def phase_error_slope(record: Record) -> Floats:
    """Return the least-squares slope of the time by which peak m comes early over m (exercise 2).

    Of the first `FEWEST_EXTREMA` peaks, two at least.

    It is the exact period less the slope of the times of the peaks: the phase of the motion drops out.
    """
    missing = np.full_like(_frequency_by_peaks(record), np.nan)
    if "exact_period" not in record or "peak_time" not in record:
        return missing
    time = np.asarray(record["peak_time"], dtype=float)[..., :FEWEST_EXTREMA]
    number = np.arange(time.shape[-1], dtype=float)
    known = np.isfinite(time)
    count = np.sum(known, axis=-1)
    several = count > 1
    mean = np.sum(np.where(known, number, 0.0), axis=-1) / np.maximum(count, 1)
    away = np.where(known, number - mean[..., None], 0.0)
    squares = np.sum(away * away, axis=-1)
    slope = np.sum(away * np.where(known, time, 0.0), axis=-1) / np.where(several, squares, 1.0)
    found = np.asarray(record["exact_period"], dtype=float) - slope
    return np.where(several & np.isfinite(found), found, missing)


def energy_error_d2t(block: MemberBlock, record: Record) -> Floats:
    """Return max |E - E(0)| with the velocity ``[D_2t u]``, n = 1, ..., N-1.

    A scheme whose own velocity that is has its own, without the last point.
    """
    found = np.full(block.shape, np.nan)
    if "energy_deviation_d2t_max_abs" in record:
        found[...] = record["energy_deviation_d2t_max_abs"]
    own = record["energy_deviation_max_abs_interior"]
    for i, scheme in enumerate(block.experiment.schemes):
        if not scheme.adaptive and not scheme.own_velocity:
            found[i] = own[i]
    return found


def force_evaluations(block: MemberBlock, level: int) -> Floats:
    """Return the number of evaluations of the acceleration; of an implicit scheme one for each step and stage."""
    counts = [SCHEMES[scheme.kind].force_evaluations for scheme in block.experiment.schemes]
    return _own_or(block, level, "force_evaluations_total", np.array(counts, dtype=float))


def steps_taken(block: MemberBlock, level: int) -> Floats:
    """Return the number of steps taken."""
    return _own_or(block, level, "accepted_steps", np.ones(len(block.experiment.schemes)))


def _own_or(block: MemberBlock, level: int, name: str, per_step: Floats) -> Floats:
    """Return what an adaptive scheme counted, or the number of steps times a number per step."""
    record = block.records[level]
    steps = block.grid.steps[block.grid.levels.index(level)]
    found = np.array(np.broadcast_to((per_step * steps)[:, None], block.shape))
    own = np.asarray(record[name], dtype=float) if name in record else np.full(block.shape, np.nan)
    found[block.adaptive] = own[block.adaptive]
    return found


def period_scale(block: MemberBlock) -> Floats:
    """Return how long an oscillation of every member takes, as far as windows over time need to know it, shape (case,).

    That of the exact solution where it has one, else that of small oscillations; of a motion with neither, an eighth
    of the time.
    """
    end = np.broadcast_to(block.group.end, block.shape[1:])
    exact = _of_case(block, "exact_period")
    w = np.abs(_of_case(block, "natural_frequency"))
    with np.errstate(divide="ignore"):
        small = np.where(w > 0, 2.0 * math.pi / w, np.nan)
    found = np.where(np.isfinite(exact) & (exact > 0), exact, small)
    return np.asarray(np.where(np.isfinite(found), found, end / PIECES_OF_TIME))


def _of_case(block: MemberBlock, name: str) -> Floats:
    """Return a number of every member; NaN where the levels do not hold it."""
    if name not in block.finest:
        return np.full(block.shape[1:], np.nan)
    return np.broadcast_to(np.asarray(block.finest[name], dtype=np.float64), block.shape[1:])
