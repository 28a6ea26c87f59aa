"""The evidence that a verdict rests on, and the rules that read it, for any number of ladders at once.

The order in which the rules apply, and why, stands at the head of `vibsim.analysis.verdict`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vibsim.analysis.series import safe_ratio
from vibsim.analysis.cut import LOG2, QUIET
from vibsim.analysis.window import (
    GROWS,
    HIDDEN,
    OF_SCATTER,
    SETTLED,
    SINGLE_WIDTH,
    Trend,
    most_left,
)
from vibsim.vocabulary import TOLERANCE

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

BLAME = 100.0
"""Round-off may be blamed for a difference up to so many times its predicted floor, an order of magnitude."""
TINY = 1e-10
"""Differences of a scheme that is exact are no larger part of the solution."""
VISIBLE = 1e4
"""An ordinary error, (w dt)^p at the coarsest level, this many times above the blamed floor would have been seen."""
COINCIDENT = 0.2
"""Largest scatter (see `series.scatter`) of curves that count as proportional."""
UNRELATED = 0.7
"""Series with so much scatter have nothing to do with each other, and a change from there says nothing."""
SINGLE = 0.05
"""The same where one triple is the only evidence."""
NARROW = 0.2
"""Half the width of the interval of an order that is called too high, at most."""
PURE = 1e-3
"""Scatter, or change of the order, below which a ladder is one pure power, whatever the power."""
BLOWN_UP = 10.0
"""A solution so many times larger than the exact one has grown."""
EXCESS = 1.5
"""An error so many times the one that the differences allow, or so many times smaller, contradicts them."""
EXACT_ACCURACY = 1e-12
"""An exact solution is trusted to this part of its size."""

MOVES = QUIET / 2
"""A smaller last change of the order is no movement away: half of what is too small to read a trend from."""
DEPARTED = 0.012
"""An order no further from p has not left it: a little more than `QUIET`, so that p + QUIET still counts as p."""
REACH = 0.05
"""An order this near a multiple of 1/2 may be that multiple: a tenth of the distance between two of them."""
REACH_SETTLED = 0.1
"""The same for a whole number that several triples support: a tenth of the distance between whole numbers."""
OF_SINGLE = 2.0
"""A single order may be so many times its scatter (over log 2) from the whole number that it stands for."""
SUNK = 0.9
"""Orders that are lower than p by more and fall leave p behind: of h^(p-1), too little h^p is left to be counted."""
LEAST_CANDIDATE = 0.5
"""The least order that an expansion has: a solution that stays away from its limit has none."""
MOST_ABOVE = 2.0
"""A superconvergent quantity gains at most the next even power."""
AGREEMENT = 0.25
"""Orders of differences and of errors agree within half of what separates two orders."""
ON_MESH = 1.0
"""Order of what is left by events that are noticed at the grid point behind them."""
ORDINARY = 2.0
"""Order of the error that would have been seen where an exact quantity is promised."""
LEAVES = 0.03
"""Orders of true errors may be so far from p: a tenth of h^(p-1) beside h^p makes 0.07."""
VOUCHED = 0.04
"""Mismatch of errors that leaves no room for a tenth of a lower power, which makes 0.05."""
VOUCHED_FADING = 0.6
"""What the errors show besides h^p falls at least to this part of itself per level when it is a higher power."""
LEAST_ORDER = 0.25
"""No stated order is taken for less when errors are predicted: half the least that an expansion has, 1/2."""


@dataclass(frozen=True)
class Evidence:
    """The numbers of ladders that a verdict rests on."""

    levels: tuple[int, ...]
    """The n levels, strictly increasing."""
    difference: Floats
    """Norms of the differences, shape (..., n-1)."""
    scatter: Floats
    """Signed scatter of the triples in the same norm (`series.scatter`), shape (..., n-2)."""
    floor: Floats
    """Predicted round-off at every level in the same norm, shape (..., n)."""
    order: Floats
    """The order p that is expected, infinite for what is to be exact, shape (...)."""
    omega_dt: Floats
    """w dt, shape (..., n)."""
    size: Floats
    """Norm of the solution, shape (...)."""
    relative_floor: Floats
    """Predicted round-off relative to the solution at the coarsest level, shape (...)."""
    tolerance: float = TOLERANCE
    """How far from p an order may be."""
    error: Floats | None = None
    """Norms of the true errors, shape (..., n); NaN where the exact solution is not known."""
    failed: Flags | None = None
    """Whether a member broke down, shape (..., n)."""
    applicable: Flags | None = None
    """Whether the quantity exists, shape (...)."""
    stability_limit: Floats | None = None
    """Largest stable w dt, infinite where there is no limit, shape (...)."""
    span: Floats | None = None
    """w T, the length of the run in units of the inverse frequency, shape (...); None counts as long."""
    on_mesh: Flags | None = None
    """Whether events were left to the mesh: the error then has no expansion beyond its first power, shape (...)."""
    growth: Floats | None = None
    """Largest position over the largest exact position, shape (..., n); NaN where not known."""
    ceiling: Floats | None = None
    """The most that round-off can be in any arithmetic, at every level in the same norm, shape (..., n)."""
    error_scatter: Floats | None = None
    """Signed scatter of the errors of successive levels, shape (..., n-1), of three levels; NaN where not known."""


def breakdown(e: Evidence, shape: tuple[int, ...]) -> tuple[Flags, Flags, Flags]:
    """Say of every level whether it broke down or is beyond the limit, and of every ladder whether it grows."""
    none = np.zeros((*shape, len(e.levels)), dtype=bool)
    broken = none if e.failed is None else none | e.failed
    beyond = none
    if e.stability_limit is not None:
        # at the limit itself a scheme may still be stable, and w dt carries rounding
        beyond = none | (e.omega_dt > e.stability_limit[..., None] * (1 + 1e-9))
    if e.growth is None:
        return broken, beyond, np.zeros(shape, dtype=bool)
    last = e.growth[..., -1]
    before = e.growth[..., -2] if len(e.levels) > 1 else last
    return broken, beyond, (last > BLOWN_UP) & ~(last < 0.5 * before)


def error_orders(e: Evidence) -> Floats:
    """Return the order of the true errors of every pair, shape (..., n-1); NaN where they are not known."""
    if e.error is None:
        return np.full(e.difference.shape, np.nan)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(
            np.log2(safe_ratio(e.error[..., :-1], e.error[..., 1:])) / np.diff(np.array(e.levels))
        )


def rules(e: Evidence, t: Trend) -> list[tuple[Flags, str]]:
    """Return the rules for ladders of three levels and more, first to last."""
    exactly, tol = np.isinf(e.order), e.tolerance
    # the rules of an order do not reach those ladders
    p = np.where(exactly, ORDINARY, e.order)
    nothing = t.count == 0
    exact = (exactly | nothing) & _truly_exact(e)
    right = _right(e, t, p)
    excluded = (t.high < p - tol) | (t.low > p + tol)
    above = t.order > p
    wrong = excluded & (_pure(t) | _plausible(t, p, tol)) & ~_on_the_way(t, p, tol)
    wrong &= ~t.open | above | (t.local <= p - SUNK)
    wrong &= ~t.gap & ~t.turning & ~(t.scatter_before > UNRELATED)
    # a lower power may hide below or emerge from a higher one, not the other way round
    several, likely = t.several, np.round(2.0 * t.order) / 2
    together = np.abs(t.scatter) <= np.where(several, COINCIDENT, SINGLE)
    wrong &= np.where(
        above,
        together & (t.width <= NARROW) & ~t.drifting & ~t.hiding & _alone(e, t, likely),
        several | (np.abs(t.scatter) <= COINCIDENT),
    )
    too_large, too_small = _contradicts(e, t)
    sure = several | (np.abs(t.scatter) <= HIDDEN)
    missed = too_large & (right | (wrong & sure & _errors_stay(e, t)))
    wrong &= _errors_agree(e, t)
    rough = np.zeros(p.shape, dtype=bool) if e.on_mesh is None else e.on_mesh
    # the mesh leaves the power 1: any other one is the accident of where events lie between grid points
    regular = ~rough | ((np.abs(t.order - ON_MESH) <= tol) & ~t.alternating)
    return [
        (exact & _far_from_exact(e), "wrong_limit"),
        (exact, "exact"),
        (exactly & ~at_round_off(e), "order_low"),
        (exactly | (nothing & (at_round_off(e) | ~rough)), "round_off"),
        (t.alternating & ~rough, "oscillating"),
        (missed & regular, "wrong_limit"),
        (right & ~too_small & regular, "asymptotic"),
        (wrong & ~above & regular, "order_low"),
        (wrong & above & ~rough, "order_high"),
        (rough, "non_smooth"),
        (t.cut, "round_off"),
    ]


def _right(e: Evidence, t: Trend, p: Floats) -> Flags:
    """Say where the order is p, surely enough to say so.

    The last two local orders, or their limit with its interval, are within the tolerance; the curves coincide; and no
    lower power can be hiding: what is left besides h^p fades, or is less than a tenth of a lower power would make.
    """
    several, tol = t.several, e.tolerance
    both = several & (np.abs(t.local - p) <= tol) & (np.abs(t.local - t.change - p) <= tol)
    both &= t.width <= NARROW
    both |= several & t.fading & (np.abs(t.local - p) <= tol) & (np.abs(t.change) <= tol)
    near = (np.abs(t.order - p) <= tol) & ((t.width <= tol) | both | ~several)
    together = np.abs(t.scatter) <= np.where(several, COINCIDENT, SINGLE)
    clear = _alone(e, t, p)
    right = near & together & clear & ~np.signbit(t.scatter)
    return np.asarray(right & ~t.gap & ~t.drifting & ~t.turning & ~_leaving(t, p))


def _errors_leave(e: Evidence, t: Trend, p: Floats) -> Flags:
    """Say where the true errors move away from h^p over the last levels of the window.

    They show a lower power before the differences do, which are steeper.
    """
    if e.error is None or len(e.levels) < 4:
        return np.zeros(p.shape, dtype=bool)
    found = error_orders(e)
    last, before = (np.abs(_pick(found, t.last + 1 - back) - p) for back in (0, 1))
    known = _pick(e.error, t.last + 2) > _accuracy(e)
    return np.asarray(known & (last > LEAVES) & (last > GROWS * before))


def _pure(t: Trend) -> Flags:
    """Say where a ladder is one pure power, whatever the power."""
    return np.asarray(t.several & (np.abs(t.scatter) <= PURE) & (np.abs(t.change) <= PURE))


def _alone(e: Evidence, t: Trend, p: Floats) -> Flags:
    """Say where h^p stands alone: what is left besides it fades, or is less than a tenth of a lower power would make."""
    mismatch = np.hypot(t.scatter, LOG2 * (t.local - p))
    before = np.hypot(t.scatter_before, LOG2 * (t.local - t.change - p))
    clear = mismatch <= most_left(p, mismatch, before, t.several)
    clear |= t.several & ((t.fading & ~t.slow) | t.irregular)
    # one order alone: two terms of one shape tell from a power by nothing but the number
    own = np.abs(t.local - p) <= np.maximum(SINGLE_WIDTH, OF_SCATTER * np.abs(t.scatter) / LOG2)
    clear = np.where(t.several, clear, own | errors_vouch(e, p))
    return np.asarray(clear & ~_errors_leave(e, t, p))


def errors_vouch(e: Evidence, p: Floats) -> Flags:
    """Say of three levels where the true errors leave no room for another power beside h^p.

    They have two ratios where the differences have one, and show a lower power more than these. A tenth of h^(p-1)
    at the finest level makes the mismatch 0.05, a tenth of h^(p+1) 0.1.
    """
    if e.error is None or e.error_scatter is None or len(e.levels) != 3:
        return np.zeros(p.shape, dtype=bool)
    found = error_orders(e)
    mismatch = np.hypot(e.error_scatter, LOG2 * (found - p[..., None]))
    finer, coarser = mismatch[..., 1], mismatch[..., 0]
    fades = (finer <= VOUCHED_FADING * coarser) & (finer <= SETTLED)
    known = e.error[..., -1] > EXCESS * _accuracy(e)
    return np.asarray(known & ((finer <= VOUCHED) | fades))


def _leaving(t: Trend, p: Floats) -> Flags:
    """Say where the local orders move away from p, on one side of it: a lower power may be emerging."""
    away = t.local - p
    before = t.local - t.change - p
    return (
        t.several
        & (away * before > 0)
        & (np.abs(away) > np.abs(before))
        & (np.abs(t.change) > MOVES)
        & (np.abs(away) > DEPARTED)
        & ~t.noisy
    )


def _plausible(t: Trend, p: Floats, tol: float) -> Flags:
    """Say where an order that an expansion can have, a multiple of 1/2 other than p, is near.

    A ladder that only passes by (towards p, and away from that multiple) has not settled there. An order that is no
    whole number is believed where the series are nearly proportional only.
    """
    several = t.several
    before = t.local - t.change
    alone = np.hypot(t.scatter, LOG2 * (t.order - np.round(2.0 * t.order) / 2)) <= HIDDEN
    towards_p = np.abs(t.local - p) < np.abs(before - p)
    found = np.zeros(p.shape, dtype=bool)
    for candidate in (np.floor(2.0 * t.order) / 2, np.ceil(2.0 * t.order) / 2):
        whole = candidate == np.round(candidate)
        passing = several & towards_p
        passing &= np.abs(t.local - candidate) > np.abs(before - candidate) + QUIET
        # one triple tells a pure power from two proportional terms by nothing but the number
        least = np.where(whole, REACH_SETTLED, REACH)
        wide = np.where(whole, OF_SINGLE * np.abs(t.scatter) / LOG2, np.minimum(t.width, REACH))
        reach = np.where(several, np.maximum(t.width, least), np.maximum(wide, SINGLE_WIDTH))
        near = (np.abs(t.order - candidate) <= reach) & (np.abs(candidate - p) > tol)
        near &= (candidate >= LEAST_CANDIDATE) & (several | alone | (candidate <= p + MOST_ABOVE))
        most = np.where(several, 2 * SINGLE, HIDDEN)
        found |= near & ~passing & (whole | (np.abs(t.scatter) <= most))
    return found


def _on_the_way(t: Trend, p: Floats, tol: float) -> Flags:
    """Say where the local orders approach p so fast that they may reach it: three last changes cover the way."""
    way = np.abs(t.local - p) - tol
    approach = np.abs(t.local - t.change - p) - np.abs(t.local - p)
    return np.asarray(t.several & (3 * approach >= way))


def _floor_of_pairs(e: Evidence) -> Floats:
    return np.asarray(e.floor[..., :-1] + e.floor[..., 1:])


def at_round_off(e: Evidence) -> Flags:
    """Say where all differences may be round-off."""
    return np.asarray(np.all(e.difference <= BLAME * _floor_of_pairs(e), axis=-1))


def _truly_exact(e: Evidence) -> Flags:
    """Say where all differences are round-off although an ordinary error would have been seen."""
    # what a short run has accumulated is smaller by (w T)^2
    power = np.where(np.isinf(e.order), ORDINARY, e.order)
    ordinary = np.minimum(e.omega_dt[..., 0], 1.0) ** power
    if e.span is not None:
        ordinary = ordinary * np.minimum(e.span, 1.0) ** 2
    tiny = np.all(e.difference <= TINY * e.size[..., None], axis=-1)
    return np.asarray(at_round_off(e) & tiny & (ordinary >= VISIBLE * BLAME * e.relative_floor))


def _accuracy(e: Evidence) -> Floats:
    """Return how well the finest error is known, shape (...)."""
    return np.asarray(BLAME * e.floor[..., -1] + EXACT_ACCURACY * e.size)


def _far_from_exact(e: Evidence) -> Flags:
    if e.error is None:
        return np.zeros(e.order.shape, dtype=bool)
    return np.asarray(np.nan_to_num(e.error[..., -1], nan=0.0) > _accuracy(e))


def _contradicts(e: Evidence, t: Trend) -> tuple[Flags, Flags]:
    """Say where the error at the last level of the window is larger, or smaller, than its difference allows.

    Larger: the limit is another one. Smaller: the differences are not those of the power that they look like.
    """
    if e.error is None:
        return np.zeros(e.order.shape, dtype=bool), np.zeros(e.order.shape, dtype=bool)
    finer = t.last + 2
    gap = np.diff(np.array(e.levels))[finer - 1]
    difference, error = _pick(e.difference, finer - 1), _pick(e.error, finer)
    most, least = (
        difference / np.expm1(np.maximum(order, LEAST_ORDER) * gap * np.log(2.0))
        for order in (
            np.minimum(t.order, t.local) - t.width,
            np.maximum(t.order, t.local) + t.width,
        )
    )
    too_large = np.nan_to_num(error, nan=0.0) > EXCESS * most + _accuracy(e)
    return too_large, np.asarray(error < least / EXCESS - _accuracy(e))


def _errors_stay(e: Evidence, t: Trend) -> Flags:
    """Say where the errors fall at less than half the stated order over the last two levels of the window."""
    if e.error is None:
        return np.zeros(e.order.shape, dtype=bool)
    gap = np.diff(np.array(e.levels))[t.last + 1]
    fall = safe_ratio(_pick(e.error, t.last + 1), _pick(e.error, t.last + 2))
    return np.asarray(fall < np.exp2(0.5 * np.maximum(t.local - t.width, 0.0) * gap))


def _errors_agree(e: Evidence, t: Trend) -> Flags:
    """Say where the errors fall with the stated order too, over the last three levels of the window.

    Two terms of one size can look like another power in a few differences, but not in the errors at the same time.
    Without an exact solution there is nothing to compare.
    """
    agree = np.ones(e.order.shape, dtype=bool)
    if e.error is None:
        return agree
    levels = np.array(e.levels, dtype=np.float64)
    for back in (0, 1):
        coarse, fine = t.last + 1 - back, t.last + 2 - back
        ratio = safe_ratio(_pick(e.error, coarse), _pick(e.error, fine))
        with np.errstate(divide="ignore", invalid="ignore"):
            found = np.log2(ratio) / (levels[fine] - levels[coarse])
        agree &= ~np.isfinite(found) | (np.abs(found - t.order) <= np.maximum(AGREEMENT, t.width))
    return agree


def _pick(values: Floats, index: NDArray[np.int64]) -> Floats:
    """Return one entry of the last axis for each ladder."""
    return np.take_along_axis(values, index[..., None], axis=-1)[..., 0]
