"""What the true errors say of an order, where the exact solution is known.

They fall with the same power as the differences, and show a lower power before the differences do, which are steeper.
"""

from __future__ import annotations

import numpy as np

from vibsim.convergence.asymptotic_range import Trend, mismatches
from vibsim.convergence.differences import safe_ratio
from vibsim.convergence.ladder_statistics import Evidence, accuracy, error_orders, pick
from vibsim.convergence.thresholds import (
    EMERGING,
    ERRORS_FADE,
    ERRORS_VOUCH,
    EXCESS,
    FARTHEST,
    GROWS,
    HALF_SPACING,
    LEAVES,
    LOG2,
    SEEN_SHARE,
    SETTLED_MISMATCH,
    STAYED,
)
from vibsim.core.array_types import Flags, Floats


def errors_leave(e: Evidence, t: Trend, p: Floats) -> Flags:
    """Say where the true errors move away from h^p over the last levels of the window.

    They show a lower power before the differences do, which are steeper. Errors that stay, larger than the differences
    allow, show none: the limit is another one.
    """
    leave, last, before = _away(e, t, p)
    stays = contradicts(e, t)[0]
    if len(e.levels) > 3:
        stays = stays & errors_stay(e, t)
    little = t.several & _little(t, p, last, before)
    return np.asarray(leave & ~little & ~stays & ~_unseen(t, p, last))


def limit_is_missed(e: Evidence, t: Trend, p: Floats) -> Flags:
    """Say where the true errors move away from h^p although the differences show h^p alone: to another limit."""
    leave, last, _ = _away(e, t, p)
    return leave & _unseen(t, p, last)


def _away(e: Evidence, t: Trend, p: Floats) -> tuple[Flags, Floats, Floats]:
    """Say where the orders of the true errors move away from p, and return how far the last two are from it."""
    found = error_orders(e)
    last, before = (np.abs(pick(found, t.last + 1 - back) - p) for back in (0, 1))
    if e.error is None:
        return np.zeros(p.shape, dtype=bool), last, before
    known = pick(e.error, t.last + 2) > accuracy(e)
    return np.asarray(known & (last > LEAVES) & (last > GROWS * before)), last, before


def _unseen(t: Trend, p: Floats, last: Floats) -> Flags:
    """Say where the differences show too little for any power that would make the errors leave h^p so far.

    Of h^(1/2), the part x of the errors is ``x (2^(1/2) - 1)/(2^p - 1)`` of the differences.
    """
    least = LOG2 * last * (np.sqrt(2.0) - 1.0) / np.expm1(np.maximum(p, HALF_SPACING) * LOG2)
    return np.asarray(t.several & (np.maximum(*mismatches(t, p)) < SEEN_SHARE * least))


def _little(t: Trend, p: Floats, last: Floats, before: Floats) -> Flags:
    """Say where a lower power, which grows in the differences as well, is less than a tenth of h^p in the errors.

    Errors ``h^p + x h^r`` have the order ``p - x (1 - 2^(r-p))/log 2``, which is further away from p by 2^(p-r) at each
    level.
    """
    now, then = mismatches(t, p)
    gap = np.clip(np.log2(np.maximum(safe_ratio(last, before), 1.0)), 0.5, FARTHEST)
    share = LOG2 * last / (1.0 - np.exp2(-gap))
    return np.asarray((now > GROWS * then) & (share <= EMERGING))


def errors_vouch(e: Evidence, p: Floats) -> Flags:
    """Say of three levels where the true errors leave no room for another power beside h^p.

    They have two ratios where the differences have one, and show a lower power more than these. A tenth of h^(p-1)
    at the finest level makes the mismatch 0.05, a tenth of h^(p+1) 0.1.
    """
    if e.error is None or e.error_scatter is None or len(e.levels) != 3:
        return np.zeros(p.shape, dtype=bool)
    found = error_orders(e)
    mismatch = np.hypot(e.error_scatter, LOG2 * (found - p[..., None]))
    return _no_room(e, e.error[..., -1], mismatch[..., 1], mismatch[..., 0])


def errors_confirm(e: Evidence, t: Trend, p: Floats) -> Flags:
    """Say of several triples where the last three true errors of the window leave no room for another power.

    The scatter of the errors is at most that of the differences times what these see less of h^(p-1), or of the least
    power below p.
    """
    if e.error is None:
        return np.zeros(p.shape, dtype=bool)
    found = error_orders(e)
    below = np.maximum(np.where(p > 1.0, p - 1.0, p - 0.5), 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        less = np.expm1(p * LOG2) / np.expm1(below * LOG2)
        finer, coarser = (
            np.hypot(less * scatter, LOG2 * (pick(found, t.last + 1 - back) - p))
            for back, scatter in enumerate((t.scatter, t.scatter_before))
        )
    return t.several & _no_room(e, pick(e.error, t.last + 2), finer, coarser)


def _no_room(e: Evidence, error: Floats, finer: Floats, coarser: Floats) -> Flags:
    """Say where mismatches of two pairs of errors are small, or fade, and the last error is no round-off."""
    fades = (finer <= ERRORS_FADE * coarser) & (finer <= SETTLED_MISMATCH)
    return np.asarray((error > EXCESS * accuracy(e)) & ((finer <= ERRORS_VOUCH) | fades))


def contradicts(e: Evidence, t: Trend) -> tuple[Flags, Flags]:
    """Say where the error at the last level of the window is larger, or smaller, than its difference allows.

    Larger: the limit is another one. Smaller: the differences are not those of the power that they look like. So are,
    whatever their error, those of two levels whose errors depend on where events or corners lie between grid points,
    unless it stays over four levels and more.
    """
    if e.error is None:
        return np.zeros(e.order.shape, dtype=bool), np.zeros(e.order.shape, dtype=bool)
    finer = t.last + 2
    gap = np.diff(np.array(e.levels))[finer - 1]
    difference, error = pick(e.difference, finer - 1), pick(e.error, finer)
    most, least = (
        difference / np.expm1(np.maximum(order, HALF_SPACING) * gap * np.log(2.0))
        for order in (
            np.minimum(t.order, t.local) - t.width,
            np.maximum(t.order, t.local) + t.width,
        )
    )
    too_large = np.nan_to_num(error, nan=0.0) > EXCESS * most + accuracy(e)
    too_small = error < least / EXCESS - accuracy(e)
    accident = too_large & irregular(e, t) & ~_stays_throughout(e)
    return too_large & ~accident, np.asarray(too_small | accident)


def irregular(e: Evidence, t: Trend) -> Flags:
    """Say where errors are the accident of where events or corners lie between grid points.

    A corner of the force within a step is one up to its own power: above that, the error has an expansion without it.
    """
    found = np.zeros(e.order.shape, dtype=bool)
    if e.left_to_the_mesh is not None:
        found |= ~np.isnan(e.left_to_the_mesh)
    if e.corner is not None:
        found |= e.corner <= t.order + HALF_SPACING
    return found


def _stays_throughout(e: Evidence) -> Flags:
    """Say where the errors of four levels and more have not even halved: those of order 1 are eight times smaller."""
    if e.error is None or len(e.levels) < 4:
        return np.zeros(e.order.shape, dtype=bool)
    with np.errstate(invalid="ignore"):
        return np.asarray(e.error[..., -1] > STAYED * e.error[..., 0])


def errors_stay(e: Evidence, t: Trend) -> Flags:
    """Say where the errors fall at less than half the stated order over the last two levels of the window."""
    if e.error is None:
        return np.zeros(e.order.shape, dtype=bool)
    gap = np.diff(np.array(e.levels))[t.last + 1]
    fall = safe_ratio(pick(e.error, t.last + 1), pick(e.error, t.last + 2))
    return np.asarray(fall < np.exp2(0.5 * np.maximum(t.local - t.width, 0.0) * gap))


def errors_agree(e: Evidence, t: Trend) -> Flags:
    """Say where the errors fall with the stated order too, over the last three levels of the window.

    Two terms of one size can look like another power in a few differences, but not in the errors at the same time.
    Without an exact solution there is nothing to compare.
    """
    agree = np.ones(e.order.shape, dtype=bool)
    if e.error is None:
        return agree
    for back in (0, 1):
        found = pick(error_orders(e), t.last + 1 - back)
        agree &= ~np.isfinite(found) | (
            np.abs(found - t.order) <= np.maximum(HALF_SPACING, t.width)
        )
    return agree
