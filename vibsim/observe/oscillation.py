"""What was measured of an oscillation: growth, frequency, phase error.

Of a linear, conservative model whose every step is stored they are those of the recurrence that the steps satisfy
(`vibsim.observe.recurrence`). Elsewhere they come from the peaks that every step was searched for.

Shapes are (scheme, case). A number that does not exist is NaN: a growth by peaks needs two of them.

Source: vibration text (B), sections 3.5 and 4.1, exercise 2.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vibsim.convergence.differences import safe_ratio
from vibsim.core.record import Record
from vibsim.experiment.storage import FEWEST_EXTREMA
from vibsim.observe.member_block import Part
from vibsim.observe.predicted_oscillation import is_simple, natural_frequency
from vibsim.observe.recurrence import Motion, fitted
from vibsim.schemes import SCHEMES

Floats = NDArray[np.float64]


def growth_factor(record: Record) -> Floats:
    """Return the last peak over the first: two peaks at least."""
    several = np.asarray(record["period_count"]) >= 1
    return np.where(several, safe_ratio(record["last_peak"], record["first_peak"]), np.nan)


def amplitude_error(record: Record) -> Floats:
    """Return the last peak over the first one, less one."""
    return np.asarray(growth_factor(record) - 1.0)


def growth_per_period(part: Part, level: int) -> Floats:
    """Return the factor by which the amplitude grows in a period.

    The period is the natural one where the model is linear, so that it can be compared with theory even where the
    scheme's own period is far from it; else it is the measured one.
    """
    record, index = part.records[level], part.grid.levels.index(level)
    found = growth_over_run(part, record)
    motion = _recurrence(part, level)
    if motion is None:
        return found
    with np.errstate(over="ignore"):
        own = np.exp(motion.log_growth * (2.0 * np.pi / part.omega_dt[:, index]))
    return np.where(np.isfinite(own), own, found)


def growth_of_motion(part: Part, level: int) -> Floats:
    """Return the same where it is the growth of the whole motion; NaN of several coordinates.

    Two coordinates pass their energy to and fro: the peaks of the first one rise and fall without any growth.
    """
    if len(part.model.positions) > 1:
        return np.full(part.shape, np.nan)
    return growth_per_period(part, level)


def has_recurrence(part: Part, level: int) -> bool:
    """Tell whether the steps of a level satisfy a recurrence that can be seen: a linear model, and no step left out."""
    return is_simple(part) and int(np.asarray(part.records[level].attrs["every"])) == 1


def _recurrence(part: Part, level: int) -> Motion | None:
    """Return the recurrence of every run, where there is one."""
    if not has_recurrence(part, level):
        return None
    return fitted(np.asarray(part.records[level][part.model.position], dtype=float))


def growth_over_run(part: Part, record: Record) -> Floats:
    """Return the same from the first and the last peak of the whole run, the start among them; always there.

    Beyond a limit, where the sign changes at every step, the height of a peak may have either sign.
    """
    time = np.asarray(record["period"] * record["period_count"], dtype=float)
    return _per_period(part, record, np.abs(growth_factor(record)), time)


def _per_period(part: Part, record: Record, factor: Floats, time: Floats) -> Floats:
    period = np.asarray(record["period"], dtype=float)
    natural = 2.0 * np.pi / natural_frequency(part) if is_simple(part) else period
    intervals = safe_ratio(*np.broadcast_arrays(time, natural))
    usable = (factor > 0) & (intervals > 0)
    log = np.log(np.where(usable, factor, 1.0)) / np.where(usable, intervals, 1.0)
    with np.errstate(over="ignore"):
        return np.where(usable, np.exp(log), np.nan)


def frequency(part: Part, level: int) -> Floats:
    """Return the angular frequency: 2 pi over the period."""
    by_peaks = _frequency_by_peaks(part.records[level])
    motion = _recurrence(part, level)
    if motion is None:
        return by_peaks
    p = part.omega_dt[:, part.grid.levels.index(level)]
    own = motion.angle * (natural_frequency(part) / p)
    return np.where(own > 0, own, by_peaks)


def _frequency_by_peaks(record: Record) -> Floats:
    period = np.asarray(record["period"], dtype=float)
    return safe_ratio(np.full_like(period, 2 * np.pi), period)


def error_of_frequency(part: Part, level: int) -> Floats:
    """Return the frequency over the exact one, less one."""
    return np.asarray(frequency(part, level) * _exact_period(part, level) / (2 * np.pi) - 1.0)


def phase_error(part: Part, level: int) -> Floats:
    """Return the exact period less the measured one: the time by which peaks come early, per period."""
    found = frequency(part, level)
    period = safe_ratio(np.full_like(found, 2 * np.pi), found)
    return np.asarray(_exact_period(part, level) - period)


def _exact_period(part: Part, level: int) -> Floats:
    """Return the exact period, shape (case,); NaN where it is not known or infinite."""
    record = part.records[level]
    if "exact_period" not in record:
        return np.full(part.shape[1], np.nan)
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


def energy_error_d2t(part: Part, record: Record) -> Floats:
    """Return max |E - E(0)| with the velocity ``[D_2t u]``, n = 1, ..., N-1.

    A scheme whose own velocity that is has its own, without the last point.
    """
    found = np.full(part.shape, np.nan)
    if "energy_deviation_d2t_max_abs" in record:
        found[...] = record["energy_deviation_d2t_max_abs"]
    own = record["energy_deviation_max_abs_interior"]
    for i, scheme in enumerate(part.experiment.schemes):
        if not scheme.adaptive and not scheme.own_velocity:
            found[i] = own[i]
    return found


def force_evaluations(part: Part, level: int) -> Floats:
    """Return the number of evaluations of the acceleration; of an implicit scheme one for each step and stage."""
    counts = [SCHEMES[scheme.kind].force_evaluations for scheme in part.experiment.schemes]
    return _own_or(part, level, "force_evaluations_total", np.array(counts, dtype=float))


def steps_taken(part: Part, level: int) -> Floats:
    """Return the number of steps taken."""
    return _own_or(part, level, "accepted_steps", np.ones(len(part.experiment.schemes)))


def _own_or(part: Part, level: int, name: str, per_step: Floats) -> Floats:
    """Return what an adaptive scheme counted, or the number of steps times a number per step."""
    record = part.records[level]
    steps = part.grid.steps[part.grid.levels.index(level)]
    found = np.array(np.broadcast_to((per_step * steps)[:, None], part.shape))
    own = np.asarray(record[name], dtype=float) if name in record else np.full(part.shape, np.nan)
    found[part.adaptive] = own[part.adaptive]
    return found
