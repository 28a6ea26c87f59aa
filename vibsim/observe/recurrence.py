r"""Growth and frequency of a linear oscillation, from every step and without interpolation.

A scheme with one principal pair of roots satisfies ``u^(n+1) = s u^n - q u^(n-1)`` on a linear problem; growth and
frequency are those of the roots of ``x^2 - s x + q`` (Prony's method). s and q are fitted to the second half of the
run, where the parasitic roots of a multistep method have faded (a run in which they have not, to rounding, has no such
recurrence), each step with the weight of its own size, so that a
growing run does not rest on its end. Peaks that are interpolated by a parabola have an error of dt^3 of their own, and
none is seen where the sign changes at each step; the roots have round-off, about eps/(w dt)^2.

The solution of a linear model need not be known for that, nor anything of the scheme.

Source: G. de Prony, Journal de l'Ecole Polytechnique 1 (1795) 24-76; vibration text (B), section 4.1 for the roots.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vibsim.core.array_types import Flags, Floats
from vibsim.observe import thresholds as th


@dataclass(frozen=True)
class Motion:
    """What was found; arrays of shape (...), NaN where a run is no such recurrence."""

    log_growth: Floats  # logarithm of the growth factor of the amplitude per step
    angle: Floats  # numerical frequency times dt, from 0 to pi


def fitted(position: Floats) -> Motion:
    """Fit the recurrence to positions at every step, shape (..., N+1)."""
    steps = position.shape[-1] - 1
    if steps < th.LEAST_STEPS:
        missing = np.full(position.shape[:-1], np.nan)
        return Motion(missing, missing)
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
        apart = slope - share[..., None] * level
        rest = bend - by_level[..., None] * level
        square = np.sum(apart * apart, axis=-1)
        by_slope = np.sum(apart * rest, axis=-1) / square
        by_level = by_level - by_slope * share
        is_plane = square > th.SINGULAR * np.sum(slope * slope, axis=-1)
        both = is_plane & _is_small(rest - by_slope[..., None] * apart)
        # x - 1 = z solves z^2 - (by_slope + by_level) z - by_level = 0
        log_growth, angle = _roots(by_slope + by_level, by_level)
        # where one root has left all others behind, u^(n+1) = x u^n
        factor = np.sum(ahead * weight * level, axis=-1) / c
        alone = ~both & _is_small(ahead * weight - factor[..., None] * level)
        log_growth = np.where(alone, np.log(np.abs(factor)), log_growth)
        angle = np.where(alone, np.where(factor < 0, np.pi, 0.0), angle)
    sound = both | alone
    return Motion(np.where(sound, log_growth, np.nan), np.where(sound, angle, np.nan))


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
    return 0.5 * np.log1p(square), np.arctan2(imaginary, 1.0 + real)
