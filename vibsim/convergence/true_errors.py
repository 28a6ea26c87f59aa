"""What the true errors say of an order, where the exact solution is known.

They fall with the same power as the differences, and show a lower power before the differences do, which are steeper.
"""

from __future__ import annotations

import numpy as np

from vibsim.convergence import thresholds as th
from vibsim.convergence.asymptotic_range import Trend, mismatches
from vibsim.convergence.differences import safe_ratio
from vibsim.convergence.ladder_statistics import Evidence, accuracy, pick
from vibsim.core.array_types import Flags, Floats


def leave(e: Evidence, t: Trend, p: Floats) -> Flags:
    """Say where the true errors move away from h^p over the last levels of the window.

    They show a lower power before the differences do, which are steeper. Errors that stay, larger than the differences
    allow, show none: the limit is another one.
    """
    moves, last, before = _away(e, t, p)
    stays = contradicts(e, t)[0]
    if len(e.levels) > 3:
        stays = stays & stay(e, t)
    little = t.several & _little(t, p, last, before)
    return np.asarray(moves & ~little & ~stays & ~_unseen(t, p, last))


def limit_is_missed(e: Evidence, t: Trend, p: Floats) -> Flags:
    """Say where the true errors move away from h^p although the differences show h^p alone: to another limit."""
    moves, last, _ = _away(e, t, p)
    return moves & _unseen(t, p, last)


def _away(e: Evidence, t: Trend, p: Floats) -> tuple[Flags, Floats, Floats]:
    """Say where the orders of the true errors move away from p, and return how far the last two are from it."""
    last, before = (np.abs(pick(e.error_orders, t.last + 1 - back) - p) for back in (0, 1))
    known = pick(e.error, t.last + 2) > accuracy(e)
    return np.asarray(known & (last > th.LEAVES) & (last > th.GROWS * before)), last, before


def _unseen(t: Trend, p: Floats, last: Floats) -> Flags:
    """Say where the differences show too little for any power that would make the errors leave h^p so far.

    Of h^(1/2), the part x of the errors is ``x (2^(1/2) - 1)/(2^p - 1)`` of the differences.
    """
    fall = np.expm1(np.maximum(p, th.HALF_SPACING) * th.LOG2)
    least = th.LOG2 * last * (np.sqrt(2.0) - 1.0) / fall
    return np.asarray(t.several & (np.maximum(*mismatches(t, p)) < th.SEEN_SHARE * least))


def _little(t: Trend, p: Floats, last: Floats, before: Floats) -> Flags:
    """Say where a lower power, which grows in the differences as well, is less than a tenth of h^p in the errors.

    Errors ``h^p + x h^r`` have the order ``p - x (1 - 2^(r-p))/log 2``, which is further away from p by 2^(p-r) at each
    level.
    """
    now, then = mismatches(t, p)
    gap = np.clip(np.log2(np.maximum(safe_ratio(last, before), 1.0)), 0.5, th.LARGEST_POWER_GAP)
    share = th.LOG2 * last / (1.0 - np.exp2(-gap))
    return np.asarray((now > th.GROWS * then) & (share <= th.EMERGING))


def vouch(e: Evidence, p: Floats) -> Flags:
    """Say of three levels where the true errors leave no room for another power beside h^p.

    They have two ratios where the differences have one, and show a lower power more than these. A tenth of h^(p-1)
    at the finest level makes the mismatch 0.05, a tenth of h^(p+1) 0.1.
    """
    if len(e.levels) != 3:
        return np.zeros(p.shape, dtype=bool)
    mismatch = np.hypot(e.error_scatter, th.LOG2 * (e.error_orders - p[..., None]))
    return _no_room(e, e.error[..., -1], mismatch[..., 1], mismatch[..., 0])


def confirm(e: Evidence, t: Trend, p: Floats) -> Flags:
    """Say of several triples where the last three true errors of the window leave no room for another power.

    Behind the window, where the scatter of the errors is not measured, it is at most that of the differences times what
    these see less of h^(p-1), or of the least power below p.
    """
    found = e.error_orders
    below = np.maximum(np.where(p > 1.0, p - 1.0, p - 0.5), 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        less = np.expm1(p * th.LOG2) / np.expm1(below * th.LOG2)
        measured = [pick(e.error_scatter, t.last + 1 - back) for back in (0, 1)]
        most = [less * scatter for scatter in (t.scatter, t.scatter_before)]
        finer, coarser = (
            np.hypot(
                np.where(np.isnan(measured[back]), most[back], measured[back]),
                th.LOG2 * (pick(found, t.last + 1 - back) - p),
            )
            for back in (0, 1)
        )
    return t.several & _no_room(e, pick(e.error, t.last + 2), finer, coarser)


def _no_room(e: Evidence, error: Floats, finer: Floats, coarser: Floats) -> Flags:
    """Say where mismatches of two pairs of errors are small, or fade, and the last error is no round-off."""
    fades = (finer <= th.ERRORS_FADE * coarser) & (finer <= th.SETTLED_MISMATCH)
    return np.asarray((error > th.EXCESS * accuracy(e)) & ((finer <= th.ERRORS_VOUCH) | fades))


def contradicts(e: Evidence, t: Trend) -> tuple[Flags, Flags]:
    """Say where the error at the last level of the window is larger, or smaller, than its difference allows.

    Larger: the limit is another one. Smaller: the differences are not those of the power that they look like. So are,
    whatever their error, those of two levels whose errors depend on where events or corners lie between grid points,
    unless it stays over four levels and more.
    """
    finer = t.last + 2
    gap = np.diff(np.array(e.levels))[finer - 1]
    difference, error = pick(e.difference, finer - 1), pick(e.error, finer)
    orders = np.minimum(t.order, t.local) - t.width, np.maximum(t.order, t.local) + t.width
    most, least = (
        difference / np.expm1(np.maximum(order, th.HALF_SPACING) * gap * np.log(2.0))
        for order in orders
    )
    too_large = np.nan_to_num(error, nan=0.0) > th.EXCESS * most + accuracy(e)
    too_small = error < least / th.EXCESS - accuracy(e)
    accident = too_large & irregular(e, t) & ~_stays_throughout(e)
    return too_large & ~accident, np.asarray(too_small | accident)


def irregular(e: Evidence, t: Trend) -> Flags:
    """Say where errors are the accident of where events or corners lie between grid points.

    A corner of the force within a step is one up to its own power: above that, the error has an expansion without it.
    """
    return np.asarray(~np.isnan(e.left_to_the_mesh) | (e.corner <= t.order + th.HALF_SPACING))


def _stays_throughout(e: Evidence) -> Flags:
    """Say where the errors of four levels and more have not even halved: those of order 1 are eight times smaller.

    Errors that the finest step may make stay where an event or a corner lies beside a point that all levels share.
    """
    if len(e.levels) < 4:
        return np.zeros(e.order.shape, dtype=bool)
    steps = e.steps * 2.0 ** (e.levels[-1] - e.levels[0])
    step = np.where(np.isfinite(e.omega_dt[..., -1]), e.omega_dt[..., -1], 1.0 / steps)
    with np.errstate(invalid="ignore"):
        beside_a_point = e.size * step ** np.fmin(e.corner, e.left_to_the_mesh)
        stays = e.error[..., -1] > th.STAYED * e.error[..., 0]
        return np.asarray(stays & ~(e.error[..., -1] <= beside_a_point))


def stay(e: Evidence, t: Trend) -> Flags:
    """Say where the errors fall at less than half the stated order over the last two levels of the window."""
    gap = np.diff(np.array(e.levels))[t.last + 1]
    fall = safe_ratio(pick(e.error, t.last + 1), pick(e.error, t.last + 2))
    return np.asarray(fall < np.exp2(0.5 * np.maximum(t.local - t.width, 0.0) * gap))


def agree(e: Evidence, t: Trend) -> Flags:
    """Say where the errors fall with the stated order too, over the last three levels of the window.

    Two terms of one size can look like another power in a few differences, but not in the errors at the same time.
    Without an exact solution there is nothing to compare.
    """
    near = np.maximum(th.HALF_SPACING, t.width)
    last, before = (pick(e.error_orders, t.last + 1 - back) for back in (0, 1))
    agrees = [~np.isfinite(found) | (np.abs(found - t.order) <= near) for found in (last, before)]
    return np.asarray(agrees[0] & agrees[1])
