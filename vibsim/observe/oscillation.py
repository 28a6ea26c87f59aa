r"""Measured properties of an oscillation: growth, frequency, phase error.

They are measured on the peaks that were found at every step; for a linear, conservative model with all steps stored, on
the recurrence that the steps satisfy. On a linear problem a scheme with one principal pair of roots satisfies
``u^(n+1) = s u^n - q u^(n-1)``, with u measured from the place of rest; growth and frequency are those of the roots of
``x^2 - s x + q`` (Prony's method). s and q are fitted to the second half of the run, where the parasitic roots of a
multistep method have decayed (if they have not decayed to rounding, there is no such recurrence). Each step is weighted
by the inverse of its size, so that the end of a growing run does not dominate. Interpolated peaks have an error of
O(dt^3), and there are none if the sign changes at every step; the roots have round-off of about eps/(w dt)^2. Neither
the exact solution nor the scheme need be known.

Shapes are (scheme, case). Numbers that do not exist are NaN: growth by peaks needs two peaks.

Source: vibration text (B), sections 3.5 and 4.1, exercise 2; G. de Prony, Journal de l'Ecole Polytechnique 1 (1795)
24-76.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from vibsim.convergence.differences import safe_ratio
from vibsim.core.array_types import Flags, Floats
from vibsim.core.record import Record
from vibsim.elementary import on_arrays
from vibsim.experiment.storage import FEWEST_EXTREMA
from vibsim.observe import thresholds as th
from vibsim.observe.member_block import MemberBlock, stored_or_nan
from vibsim.observe.predicted_oscillation import equilibrium, is_simple, natural_frequency


def growth_factor(record: Record) -> Floats:
    """Return the last peak over the first; NaN with fewer than two peaks."""
    several = np.asarray(record["period_count"]) >= 1
    return np.where(several, safe_ratio(record["last_peak"], record["first_peak"]), np.nan)


def growth_per_period(block: MemberBlock, level: int) -> Floats:
    """Return the factor by which the amplitude grows in a period.

    For a linear model this is the natural period, for comparison with theory even if the scheme's period is far from
    it; otherwise it is the measured period.
    """
    by_peaks, fitted = growth_over_run(block, block.records[level]), _recurrence(block, level)
    if fitted is None:
        return by_peaks
    with np.errstate(over="ignore"):
        by_roots = on_arrays.exp(fitted.log_growth * (2.0 * np.pi / _step(block, level)))
    return np.where(np.isfinite(by_roots), by_roots, by_peaks)


def growth_of_motion(block: MemberBlock, level: int) -> Floats:
    """Return `growth_per_period`, or NaN for several coordinates.

    These exchange energy: the peaks of the first one rise and fall without growth of the whole motion.
    """
    if len(block.model.positions) > 1:
        return np.full(block.shape, np.nan)
    return growth_per_period(block, level)


def growth_over_run(block: MemberBlock, record: Record) -> Floats:
    """Return the growth factor per period from the first and the last peak of the run.

    Beyond a stability limit, where the sign changes at every step, the height of a peak may have either sign.
    """
    factor = np.abs(growth_factor(record))
    period = np.asarray(record["period"], dtype=float)
    time = np.asarray(record["period"] * record["period_count"], dtype=float)
    natural = 2.0 * np.pi / natural_frequency(block) if is_simple(block) else period
    intervals = safe_ratio(*np.broadcast_arrays(time, natural))
    # beyond a stability limit a nonlinear run may have a meaningless, negative period
    usable = (factor > 0) & (intervals > 0) & (period > 0)
    log = on_arrays.log(np.where(usable, factor, 1.0)) / np.where(usable, intervals, 1.0)
    with np.errstate(over="ignore"):
        return np.where(usable, on_arrays.exp(log), np.nan)


def has_recurrence(block: MemberBlock, level: int) -> bool:
    """Tell whether a recurrence can be fitted to the steps of a level: a linear model, with every step stored."""
    return is_simple(block) and block.records[level].whole("every") == 1


def _recurrence(block: MemberBlock, level: int) -> Recurrence | None:
    if not has_recurrence(block, level):
        return None
    position = np.asarray(block.records[level][block.model.position], dtype=float)
    return fit_recurrence(position - equilibrium(block)[:, None])


def _step(block: MemberBlock, level: int) -> Floats:
    """Return w dt, shape (case,)."""
    return block.omega_dt[:, block.grid.levels.index(level)]


def frequency(block: MemberBlock, level: int) -> Floats:
    """Return the angular frequency: 2 pi over the period."""
    by_peaks = _turns(np.asarray(block.records[level]["period"], dtype=float))
    fitted = _recurrence(block, level)
    if fitted is None:
        return by_peaks
    by_roots = fitted.angle * (natural_frequency(block) / _step(block, level))
    return np.where(by_roots > 0, by_roots, by_peaks)


def _turns(x: Floats) -> Floats:
    """Return the frequency of a period, or the period of a frequency: ``2 pi/x``."""
    return safe_ratio(np.full_like(x, 2 * np.pi), x)


def error_of_frequency(block: MemberBlock, level: int) -> Floats:
    """Return the relative error of the frequency."""
    return np.asarray(frequency(block, level) * _exact_period(block, level) / (2 * np.pi) - 1.0)


def phase_error(block: MemberBlock, level: int) -> Floats:
    """Return the exact period minus the measured one: the time by which peaks come early, per period."""
    return np.asarray(_exact_period(block, level) - _turns(frequency(block, level)))


def _exact_period(block: MemberBlock, level: int) -> Floats:
    """Return the exact period, shape (case,); NaN if unknown or infinite."""
    period = stored_or_nan(block.records[level], "exact_period", block.shape[1:])
    return np.where(np.isfinite(period), period, np.nan)


def phase_error_slope(record: Record) -> Floats:
    """Return the least-squares slope of the time by which peak m comes early, as a function of m (exercise 2).

    It uses the first `FEWEST_EXTREMA` peaks and is the exact period minus the slope of the peak times, in which the
    phase of the motion drops out. NaN with fewer than two peaks.
    """
    if "exact_period" not in record or "peak_time" not in record:
        return np.full(np.shape(record["period"]), np.nan)
    time = np.asarray(record["peak_time"], dtype=float)[..., :FEWEST_EXTREMA]
    number = np.arange(time.shape[-1], dtype=float)
    known = np.isfinite(time)
    count = np.sum(known, axis=-1)
    several = count > 1
    mean = np.sum(np.where(known, number, 0.0), axis=-1) / np.maximum(count, 1)
    away = np.where(known, number - mean[..., None], 0.0)
    squares = np.sum(away * away, axis=-1)
    slope = np.sum(away * np.where(known, time, 0.0), axis=-1) / np.where(several, squares, 1.0)
    error = np.asarray(record["exact_period"], dtype=float) - slope
    return np.where(several & np.isfinite(error), error, np.nan)


def energy_error_d2t(block: MemberBlock, record: Record) -> Floats:
    """Return max |E - E(0)| with the velocity ``[D_2t u]``, n = 1, ..., N-1.

    For a scheme with this velocity it is the energy deviation without the last point.
    """
    error = np.array(stored_or_nan(record, "energy_deviation_d2t_max_abs", block.shape))
    interior = record["energy_deviation_max_abs_interior"]
    for i, scheme in enumerate(block.experiment.schemes):
        if not scheme.adaptive and not scheme.own_velocity:
            error[i] = interior[i]
    return error


def force_evaluations(block: MemberBlock, level: int) -> Floats:
    """Return the number of evaluations of the acceleration; for an implicit scheme, one per step and stage."""
    counts = [scheme.method.evaluations for scheme in block.experiment.schemes]
    return _counted(block, level, "force_evaluations_total", np.array(counts, dtype=float))


def steps_taken(block: MemberBlock, level: int) -> Floats:
    """Return the number of steps taken."""
    return _counted(block, level, "accepted_steps", np.ones(len(block.experiment.schemes)))


def _counted(block: MemberBlock, level: int, name: str, per_step: Floats) -> Floats:
    """Return the count `name` of an adaptive scheme, or `per_step` times the number of steps."""
    steps = block.grid.steps[block.grid.levels.index(level)]
    counts = stored_or_nan(block.records[level], name, block.shape)
    return np.where(block.adaptive[:, None], counts, (per_step * steps)[:, None])


def period_scale(block: MemberBlock) -> Floats:
    """Return an approximate period of every member, for the choice of time windows, shape (case,).

    It is the exact period if known, otherwise that of small oscillations, otherwise an eighth of the run.
    """
    cases = block.shape[1:]
    exact = stored_or_nan(block.finest, "exact_period", cases)
    w = np.abs(stored_or_nan(block.finest, "natural_frequency", cases))
    with np.errstate(divide="ignore"):
        small = np.where(w > 0, 2.0 * math.pi / w, np.nan)
    period = np.where(np.isfinite(exact) & (exact > 0), exact, small)
    return np.asarray(np.where(np.isfinite(period), period, block.group.end / th.PIECES_OF_TIME))


@dataclass(frozen=True)
class Recurrence:
    """Growth and frequency from the recurrence of runs; arrays of shape (...), NaN if a run satisfies none."""

    log_growth: Floats  # logarithm of the growth factor of the amplitude per step
    angle: Floats  # numerical frequency times dt, from 0 to pi


def fit_recurrence(position: Floats) -> Recurrence:
    """Fit the recurrence to positions at every step, shape (..., N+1)."""
    steps = position.shape[-1] - 1
    if steps < th.LEAST_STEPS:
        missing = np.full(position.shape[:-1], np.nan)
        return Recurrence(missing, missing)
    half = position[..., steps // 2 :]
    previous, here, following = half[..., :-2], half[..., 1:-1], half[..., 2:]
    with np.errstate(all="ignore"):
        weight = 1.0 / (np.abs(previous) + np.abs(here) + np.abs(following))
        # u'' and u' in units of the step: differences of neighbours are exact or nearly so
        slope = (here - previous) * weight
        level = here * weight
        bend = ((following - here) - (here - previous)) * weight
        # orthogonalise first, because one of two roots may have nearly decayed
        c = np.sum(level * level, axis=-1)
        share, by_level = (np.sum(level * x, axis=-1) / c for x in (slope, bend))
        difference = slope - share[..., None] * level
        bend_left = bend - by_level[..., None] * level
        square = np.sum(difference * difference, axis=-1)
        by_slope = np.sum(difference * bend_left, axis=-1) / square
        by_level = by_level - by_slope * share
        is_plane = square > th.SINGULAR * np.sum(slope * slope, axis=-1)
        has_two_roots = is_plane & _is_rounding(bend_left - by_slope[..., None] * difference)
        # x - 1 = z solves z^2 - (by_slope + by_level) z - by_level = 0
        log_growth, angle = _roots(by_slope + by_level, by_level)
        # if one root dominates all others, u^(n+1) = x u^n
        factor = np.sum(following * weight * level, axis=-1) / c
        residual = following * weight - factor[..., None] * level
        has_one_root = ~has_two_roots & _is_rounding(residual)
        log_growth = np.where(has_one_root, on_arrays.log(np.abs(factor)), log_growth)
        angle = np.where(has_one_root, np.where(factor < 0, np.pi, 0.0), angle)
    fits = has_two_roots | has_one_root
    return Recurrence(np.where(fits, log_growth, np.nan), np.where(fits, angle, np.nan))


def _is_rounding(residual: Floats) -> Flags:
    """Tell whether residuals, shape (..., step), are rounding rather than a decaying parasitic root."""
    whole = _mean_square(residual)
    is_small = whole < th.RECURRENCE_ROUNDING**2
    middle = residual.shape[-1] // 2
    if middle >= th.LEAST_LEFT:
        early, late = _mean_square(residual[..., :middle]), _mean_square(residual[..., middle:])
        is_small |= (early < th.FADES**2 * late) & (whole < th.RESIDUAL**2)
    return is_small


def _mean_square(x: Floats) -> Floats:
    return np.asarray(np.mean(x * x, axis=-1))


def _roots(total: Floats, product: Floats) -> tuple[Floats, Floats]:
    """Return log |x| and the angle of the larger root ``x = 1 + z`` of ``z^2 - total z - product = 0``."""
    discriminant = 0.25 * total * total + product
    root = np.sqrt(np.abs(discriminant))
    is_pair = discriminant < 0
    real = np.where(
        is_pair, 0.5 * total, 0.5 * total + np.where(1.0 + 0.5 * total >= 0, root, -root)
    )
    imaginary = np.where(is_pair, root, 0.0)
    # |1 + z|^2 - 1 without cancellation; for a complex pair |x|^2 = q = 1 + total - product
    square = np.where(is_pair, total - product, real * (2.0 + real))
    return 0.5 * on_arrays.log1p(square), on_arrays.atan2(imaginary, 1.0 + real)
