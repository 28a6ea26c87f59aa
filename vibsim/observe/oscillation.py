r"""What was measured of an oscillation: growth, frequency, phase error.

They come from the peaks that every step was searched for; of a linear, conservative model whose every step is stored,
from the recurrence that the steps satisfy. A scheme with one principal pair of roots has
``u^(n+1) = s u^n - q u^(n-1)`` on a linear problem; growth and frequency are those of the roots of ``x^2 - s x + q``
(Prony's method). s and q are fitted to the second half of the run, where the parasitic roots of a multistep method have
faded (a run in which they have not, to rounding, has no such recurrence), each step with the weight of its own size, so
that a growing run does not rest on its end. Peaks that are interpolated by a parabola have an error of dt^3 of their
own, and none is seen where the sign changes at each step; the roots have round-off, about eps/(w dt)^2. Neither the
solution of the model nor the scheme need be known.

Shapes are (scheme, case). A number that does not exist is NaN: a growth by peaks needs two of them.

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
from vibsim.observe.predicted_oscillation import is_simple, natural_frequency


def growth_factor(record: Record) -> Floats:
    """Return the last peak over the first: two peaks at least."""
    several = np.asarray(record["period_count"]) >= 1
    return np.where(several, safe_ratio(record["last_peak"], record["first_peak"]), np.nan)


def growth_per_period(block: MemberBlock, level: int) -> Floats:
    """Return the factor by which the amplitude grows in a period.

    The period is the natural one where the model is linear, so that it can be compared with theory even where the
    scheme's own period is far from it; else it is the measured one.
    """
    found, fitted = growth_over_run(block, block.records[level]), _recurrence(block, level)
    if fitted is None:
        return found
    with np.errstate(over="ignore"):
        own = on_arrays.exp(fitted.log_growth * (2.0 * np.pi / _step(block, level)))
    return np.where(np.isfinite(own), own, found)


def growth_of_motion(block: MemberBlock, level: int) -> Floats:
    """Return the same where it is the growth of the whole motion; NaN of several coordinates.

    Two coordinates pass their energy to and fro: the peaks of the first one rise and fall without any growth.
    """
    if len(block.model.positions) > 1:
        return np.full(block.shape, np.nan)
    return growth_per_period(block, level)


def growth_over_run(block: MemberBlock, record: Record) -> Floats:
    """Return the same from the first and the last peak of the whole run, the start among them; always there.

    Beyond a limit, where the sign changes at every step, the height of a peak may have either sign.
    """
    factor = np.abs(growth_factor(record))
    period = np.asarray(record["period"], dtype=float)
    time = np.asarray(record["period"] * record["period_count"], dtype=float)
    natural = 2.0 * np.pi / natural_frequency(block) if is_simple(block) else period
    intervals = safe_ratio(*np.broadcast_arrays(time, natural))
    # beyond a limit a nonlinear run may have no period: turns that it seems to make backwards in time
    usable = (factor > 0) & (intervals > 0) & (period > 0)
    log = on_arrays.log(np.where(usable, factor, 1.0)) / np.where(usable, intervals, 1.0)
    with np.errstate(over="ignore"):
        return np.where(usable, on_arrays.exp(log), np.nan)


def has_recurrence(block: MemberBlock, level: int) -> bool:
    """Tell whether the steps of a level satisfy a recurrence that can be seen: a linear model, and no step left out."""
    return is_simple(block) and int(np.asarray(block.records[level].attrs["every"])) == 1


def _recurrence(block: MemberBlock, level: int) -> Recurrence | None:
    if not has_recurrence(block, level):
        return None
    return fit_recurrence(np.asarray(block.records[level][block.model.position], dtype=float))


def _step(block: MemberBlock, level: int) -> Floats:
    """Return w dt, shape (case,)."""
    return block.omega_dt[:, block.grid.levels.index(level)]


def frequency(block: MemberBlock, level: int) -> Floats:
    """Return the angular frequency: 2 pi over the period."""
    by_peaks = _turns(np.asarray(block.records[level]["period"], dtype=float))
    fitted = _recurrence(block, level)
    if fitted is None:
        return by_peaks
    own = fitted.angle * (natural_frequency(block) / _step(block, level))
    return np.where(own > 0, own, by_peaks)


def _turns(of: Floats) -> Floats:
    """Return the frequency of a period, or the period of a frequency."""
    return safe_ratio(np.full_like(of, 2 * np.pi), of)


def error_of_frequency(block: MemberBlock, level: int) -> Floats:
    """Return the frequency over the exact one, less one."""
    return np.asarray(frequency(block, level) * _exact_period(block, level) / (2 * np.pi) - 1.0)


def phase_error(block: MemberBlock, level: int) -> Floats:
    """Return the exact period less the measured one: the time by which peaks come early, per period."""
    return np.asarray(_exact_period(block, level) - _turns(frequency(block, level)))


def _exact_period(block: MemberBlock, level: int) -> Floats:
    """Return the exact period, shape (case,); NaN where it is not known or infinite."""
    found = stored_or_nan(block.records[level], "exact_period", block.shape[1:])
    return np.where(np.isfinite(found), found, np.nan)


def phase_error_slope(record: Record) -> Floats:
    """Return the least-squares slope of the time by which peak m comes early over m (exercise 2).

    Of the first `FEWEST_EXTREMA` peaks, two at least. It is the exact period less the slope of the times of the peaks:
    the phase of the motion drops out.
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
    found = np.asarray(record["exact_period"], dtype=float) - slope
    return np.where(several & np.isfinite(found), found, np.nan)


def energy_error_d2t(block: MemberBlock, record: Record) -> Floats:
    """Return max |E - E(0)| with the velocity ``[D_2t u]``, n = 1, ..., N-1.

    A scheme whose own velocity that is has its own, without the last point.
    """
    found = np.array(stored_or_nan(record, "energy_deviation_d2t_max_abs", block.shape))
    own = record["energy_deviation_max_abs_interior"]
    for i, scheme in enumerate(block.experiment.schemes):
        if not scheme.adaptive and not scheme.own_velocity:
            found[i] = own[i]
    return found


def force_evaluations(block: MemberBlock, level: int) -> Floats:
    """Return the number of evaluations of the acceleration; of an implicit scheme one for each step and stage."""
    counts = [scheme.method.force_evaluations for scheme in block.experiment.schemes]
    return _own_or(block, level, "force_evaluations_total", np.array(counts, dtype=float))


def steps_taken(block: MemberBlock, level: int) -> Floats:
    """Return the number of steps taken."""
    return _own_or(block, level, "accepted_steps", np.ones(len(block.experiment.schemes)))


def _own_or(block: MemberBlock, level: int, name: str, per_step: Floats) -> Floats:
    """Return what an adaptive scheme counted, or the number of steps times a number per step."""
    steps = block.grid.steps[block.grid.levels.index(level)]
    own = stored_or_nan(block.records[level], name, block.shape)
    return np.where(block.adaptive[:, None], own, (per_step * steps)[:, None])


def period_scale(block: MemberBlock) -> Floats:
    """Return how long an oscillation of every member takes, as far as windows over time need to know it, shape (case,).

    That of the exact solution where it has one, else that of small oscillations; of a motion with neither, an eighth
    of the time.
    """
    cases = block.shape[1:]
    exact = stored_or_nan(block.finest, "exact_period", cases)
    w = np.abs(stored_or_nan(block.finest, "natural_frequency", cases))
    with np.errstate(divide="ignore"):
        small = np.where(w > 0, 2.0 * math.pi / w, np.nan)
    found = np.where(np.isfinite(exact) & (exact > 0), exact, small)
    return np.asarray(np.where(np.isfinite(found), found, block.group.end / th.PIECES_OF_TIME))


@dataclass(frozen=True)
class Recurrence:
    """Growth and frequency by the recurrence of a run; arrays of shape (...), NaN where it satisfies none."""

    log_growth: Floats  # logarithm of the growth factor of the amplitude per step
    angle: Floats  # numerical frequency times dt, from 0 to pi


def fit_recurrence(position: Floats) -> Recurrence:
    """Fit the recurrence to positions at every step, shape (..., N+1)."""
    steps = position.shape[-1] - 1
    if steps < th.LEAST_STEPS:
        missing = np.full(position.shape[:-1], np.nan)
        return Recurrence(missing, missing)
    half = position[..., steps // 2 :]
    behind, here, ahead = half[..., :-2], half[..., 1:-1], half[..., 2:]
    with np.errstate(all="ignore"):
        weight = 1.0 / (np.abs(behind) + np.abs(here) + np.abs(ahead))
        # u'' and u' in units of the step: differences of neighbours are exact or nearly so
        slope = (here - behind) * weight
        level = here * weight
        bend = ((ahead - here) - (here - behind)) * weight
        # orthogonal first, for two roots of which one has nearly left the other behind
        c = np.sum(level * level, axis=-1)
        share, by_level = (np.sum(level * x, axis=-1) / c for x in (slope, bend))
        difference = slope - share[..., None] * level
        rest = bend - by_level[..., None] * level
        square = np.sum(difference * difference, axis=-1)
        by_slope = np.sum(difference * rest, axis=-1) / square
        by_level = by_level - by_slope * share
        is_plane = square > th.SINGULAR * np.sum(slope * slope, axis=-1)
        both = is_plane & _is_small(rest - by_slope[..., None] * difference)
        # x - 1 = z solves z^2 - (by_slope + by_level) z - by_level = 0
        log_growth, angle = _roots(by_slope + by_level, by_level)
        # where one root has left all others behind, u^(n+1) = x u^n
        factor = np.sum(ahead * weight * level, axis=-1) / c
        alone = ~both & _is_small(ahead * weight - factor[..., None] * level)
        log_growth = np.where(alone, on_arrays.log(np.abs(factor)), log_growth)
        angle = np.where(alone, np.where(factor < 0, np.pi, 0.0), angle)
    sound = both | alone
    return Recurrence(np.where(sound, log_growth, np.nan), np.where(sound, angle, np.nan))


def _is_small(left: Floats) -> Flags:
    """Say where what is left is rounding, and no parasitic root that is on its way out."""
    whole = _mean_square(left)
    found = whole < th.RECURRENCE_ROUNDING**2
    middle = left.shape[-1] // 2
    if middle >= th.LEAST_LEFT:
        stays = _mean_square(left[..., :middle]) < th.FADES**2 * _mean_square(left[..., middle:])
        found |= stays & (whole < th.RESIDUAL**2)
    return found


def _mean_square(left: Floats) -> Floats:
    return np.asarray(np.mean(left * left, axis=-1))


def _roots(total: Floats, product: Floats) -> tuple[Floats, Floats]:
    """Return log |x| and the angle of the larger root ``x = 1 + z`` of ``z^2 - total z - product = 0``."""
    discriminant = 0.25 * total * total + product
    root = np.sqrt(np.abs(discriminant))
    is_pair = discriminant < 0
    real = np.where(
        is_pair, 0.5 * total, 0.5 * total + np.where(1.0 + 0.5 * total >= 0, root, -root)
    )
    imaginary = np.where(is_pair, root, 0.0)
    # |1 + z|^2 - 1 without cancellation; of a pair, |x|^2 = q = 1 + total - product
    square = np.where(is_pair, total - product, real * (2.0 + real))
    return 0.5 * on_arrays.log1p(square), on_arrays.atan2(imaginary, 1.0 + real)
