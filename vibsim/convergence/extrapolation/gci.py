"""The grid convergence index: the established error bar, next to the bound of `numbers`.

For the finest two levels, ``GCI = F |u_fine - u_coarse|/(r^p - 1)`` with the refinement ratio r (P. J. Roache,
Perspective: a method for uniform reporting of grid refinement studies, J. Fluids Eng. 116, 1994). It belongs to the
finest level, not to an extrapolation. The factor F is 1.25 where the observed order of three levels is within a tenth
of the promised one; elsewhere it is 3, with the observed order kept between 1/2 and the promised one (W. L. Oberkampf
and C. J. Roy, Verification and Validation in Scientific Computing, 2010, section 8.7). Two levels show no order: F = 3.

If levels do not converge monotonically, four or more of them are fitted by ``u + c h^p`` with least squares, and the
index follows from the fit and its scatter (L. Eca and M. Hoekstra, J. Comput. Phys. 262, 2014); three levels get three
times their range, as there. This is also a lower bound if they converge monotonically with an unexpected order.

It is absolute, in the unit of the number, so that a number may be negative or cross zero; `relative` divides by the
number if it is not near zero.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vibsim.convergence.differences import gap_ratio, order_of_ratio, safe_ratio
from vibsim.convergence.extrapolation import thresholds as th
from vibsim.convergence.extrapolation.numbers import triple_at
from vibsim.convergence.extrapolation.triangular_scheme import error_left
from vibsim.convergence.thresholds import ORDINARY_ORDER
from vibsim.core.array_types import Codes, Flags, Floats
from vibsim.core.vocabulary import LEVELS_OF_AN_ORDER
from vibsim.elementary import on_arrays

CLASSES = (
    "unknown",
    "monotone",
    "oscillating",
    "monotone_divergence",
    "oscillating_divergence",
    "round_off",
)
"""How the finest three levels above round-off converge; files store an index into this tuple."""
UNKNOWN, MONOTONE, OSCILLATING, DIVERGING, SWINGING, ROUND_OFF = range(len(CLASSES))


def classify(values: Floats, levels: Sequence[int], floor: Floats) -> Codes:
    """Return how numbers converge, as indices into `CLASSES`; arguments as for `numbers.limit`.

    ``R`` is the last difference over the previous one: monotone in (0, 1), oscillating in (-1, 0), else diverging.
    """
    classes = np.full(values.shape[:-1], UNKNOWN, dtype=np.int8)
    if len(levels) < LEVELS_OF_AN_ORDER:
        return classes
    classes[np.all(np.isfinite(values[..., -3:]), axis=-1)] = ROUND_OFF
    for i in range(len(levels) - 2):
        (first, second), clean = triple_at(values, floor, i)
        # differences per level, if levels are skipped
        a, b = levels[i + 1] - levels[i], levels[i + 2] - levels[i + 1]
        ratio = safe_ratio(second / b, first / a)
        masks = [ratio >= 1, ratio > 0, ratio <= -1, ratio < 0]
        kind = np.select(masks, [DIVERGING, MONOTONE, SWINGING, OSCILLATING], UNKNOWN)
        classes = np.where(clean, kind, classes).astype(np.int8)
    return classes


def index(values: Floats, levels: Sequence[int], order: Floats, kinds: Codes) -> Floats:
    """Return the grid convergence index of the finest level, shape (...), in the unit of the numbers.

    It is NaN for one level, and where a number does not exist. `kinds` is the result of `classify`; the other arguments
    are those of `numbers.limit`.
    """
    n = len(levels)
    if n == 1:
        return np.full(values.shape[:-1], np.nan)
    promised = np.where(np.isfinite(order), order, ORDINARY_ORDER)
    with np.errstate(all="ignore"):
        change = np.abs(values[..., -1] - values[..., -2])
        gap = levels[-1] - levels[-2]
        if n == 2:
            return np.asarray(error_left(th.GCI_CAUTIOUS * change, gap_ratio(promised, gap)))
        differences = -np.diff(values[..., -3:], axis=-1)
        observed = order_of_ratio(safe_ratio(differences[..., 0], differences[..., 1]), levels[-3:])
        regular = of_order(change, gap, observed, promised)
        if n == 3:
            rough = np.asarray(th.GCI_CAUTIOUS * np.ptp(values, axis=-1))
        else:
            rough = _fitted(values, levels, promised)
            agrees = _agrees(observed, promised)
            regular = np.where(agrees, regular, np.fmax(regular, rough))
        exact = (kinds == ROUND_OFF) & (change == 0.0)
        return np.where(exact, 0.0, np.where(observed > 0, regular, rough))


def of_order(change: Floats, gap: int, observed: Floats, promised: Floats) -> Floats:
    """Return ``F |change|/(r^p - 1)`` for two levels, from the observed order (NaN if unknown) and the promised one."""
    agrees = _agrees(observed, promised)
    factor = np.where(agrees, th.GCI_TRUSTED, th.GCI_CAUTIOUS)
    capped = np.clip(np.where(np.isfinite(observed), observed, promised), th.GCI_LEAST_ORDER, None)
    p = np.where(agrees, promised, np.minimum(capped, promised))
    return np.asarray(error_left(factor * change, gap_ratio(p, gap)))


def _agrees(observed: Floats, promised: Floats) -> Flags:
    return np.asarray(np.abs(observed - promised) <= th.GCI_AGREES * promised)


def relative(index: Floats, value: Floats, scale: Floats) -> Floats:
    """Return the index relative to the number; NaN if that is near zero, compared with the `scale` of such numbers."""
    size = np.abs(value)
    usable = (size > index) & (size > th.GCI_NEAR_ZERO * scale)
    return np.where(usable, safe_ratio(*np.broadcast_arrays(index, size)), np.nan)


def _fitted(values: Floats, levels: Sequence[int], promised: Floats) -> Floats:
    """Return the index of the best fit of ``u + c h^p``, p between `GCI_LEAST_ORDER` and the promised order."""
    m = min(len(levels), th.GCI_FITTED)
    u = values[..., -m:]
    h = on_arrays.power(2.0, -(np.array(levels[-m:], dtype=np.float64) - levels[-1]))
    mean = np.mean(u, axis=-1)
    least = np.full(mean.shape, np.inf)
    index = np.full(mean.shape, np.nan)
    typical = (np.max(u, axis=-1) - np.min(u, axis=-1)) / (m - 1)
    for fraction in np.linspace(0.0, 1.0, th.GCI_EXPONENTS):
        p = th.GCI_LEAST_ORDER + fraction * np.maximum(promised - th.GCI_LEAST_ORDER, 0.0)
        x = on_arrays.power(h, p[..., None])
        dx = x - np.mean(x, axis=-1)[..., None]
        slope = np.sum(dx * (u - mean[..., None]), axis=-1) / np.sum(dx * dx, axis=-1)
        residual = u - mean[..., None] - slope[..., None] * dx
        # three numbers are fitted
        sigma = np.sqrt(np.sum(residual * residual, axis=-1) / (m - 3))
        error = np.abs(slope) * x[..., -1]
        misfit = np.abs(residual[..., -1])
        good = sigma < typical
        rough = th.GCI_CAUTIOUS * sigma / typical * (error + sigma + misfit)
        candidate = np.where(good, th.GCI_TRUSTED * error + sigma + misfit, rough)
        better = sigma < least
        least, index = np.where(better, sigma, least), np.where(better, candidate, index)
    return np.where(typical > 0, index, 0.0 * typical)
