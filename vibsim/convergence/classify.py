"""The rules that read the evidence on ladders, for any number of ladders at once.

The order in which the rules apply, and why, stands at the head of `vibsim.convergence.verdict`.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from vibsim.convergence import thresholds as th
from vibsim.convergence import true_errors as errors
from vibsim.convergence.asymptotic_range import Trend, lowest, mismatches, most_left
from vibsim.convergence.hidden_order import is_promise_hidden
from vibsim.convergence.ladder_statistics import (
    Evidence,
    at_rest,
    at_round_off,
    far_from_exact,
    pick,
    truly_exact,
    unresolved,
)
from vibsim.convergence.roundoff_onset import steepest
from vibsim.core.array_types import Flags, Floats
from vibsim.core.vocabulary import ORDER_TOLERANCE


def rules(e: Evidence, t: Trend) -> tuple[list[tuple[Flags, str]], Floats]:
    """Return the rules for ladders of three levels and more, first to last, and the lower end of the interval.

    It reaches down to a lower power that may be hiding.
    """
    exactly, tol = np.isinf(e.order), e.tolerance
    # the rules of an order do not reach those ladders
    p = np.where(exactly, th.ORDINARY_ORDER, e.order)
    nothing = t.count == 0
    exact = (exactly | nothing) & truly_exact(e)
    right = _right(e, t, p)
    doubtful = ~right & _two_ratios(e, t, p)
    right |= doubtful
    low = np.where(doubtful, _below(t), t.low)
    # neither that order nor a failure of the promised one, until the levels exclude this or show it
    hidden = is_promise_hidden(e, t)
    low = np.where(hidden, np.minimum(low, e.promised), low)
    hidden &= p >= e.promised - tol
    right &= ~hidden
    excluded = (t.high < p - tol) | (t.low > p + tol)
    above = t.order > p
    # one pure power, whatever the power
    pure = t.several & (np.abs(t.scatter) <= th.PURE) & (np.abs(t.change) <= th.PURE)
    wrong = excluded & (pure | _plausible(t, p, tol)) & ~_on_the_way(t, p, tol)
    wrong &= ~t.open | above | (t.local <= p - th.SUNK)
    wrong &= ~t.gap & ~t.turning & ~(t.scatter_before > th.UNRELATED)
    # a lower power may hide below or emerge from a higher one, not the other way round
    several, likely = t.several, np.round(2.0 * t.order) / 2
    together = np.abs(t.scatter) <= np.where(several, th.COINCIDENT, th.PROPORTIONAL_ALONE)
    wrong &= np.where(
        above,
        together & (t.width <= th.NARROW) & ~t.drifting & ~t.hiding & _alone(e, t, likely),
        several | (np.abs(t.scatter) <= th.FAILS_ALONE),
    )
    wrong |= _settled_elsewhere(e, t, p)
    # levels that differ by more than the solution have nothing to do with it yet
    lost = pick(e.difference, t.last + 1) > e.scale
    right &= ~lost
    wrong &= ~lost
    wrong &= ~(hidden & above)
    too_large, too_small = errors.contradicts(e, t)
    accidental = errors.irregular(e, t)
    sure = several | (np.abs(t.scatter) <= th.HIDDEN)
    # one pure power to another limit is at fault whatever its errors look like
    missed = too_large & (right | (wrong & sure & (errors.stay(e, t) | pure)))
    missed |= right & errors.limit_is_missed(e, t, p) & ~accidental
    wrong &= errors.agree(e, t)
    left, rough = e.left_to_the_mesh, ~np.isnan(e.left_to_the_mesh)
    # any other power is the accident of where events or corners lie between grid points
    regular = ~rough | ((np.abs(t.order - left) <= tol) & ~t.alternating)
    kinked, deeper = _kinked(e, t, p)
    # where no triple is left although the differences are above round-off, the corner has made them unlike each other
    unlike = nothing & (p >= e.corner)
    kinked |= unlike | (too_small & accidental)
    # finer levels show the power of the corner, not p: those that do not yet are no reason to add some
    limited = e.corner < p - tol
    swings = t.alternating & ~rough & ~kinked & ~doubtful
    still = at_rest(e) & (exactly | nothing)
    # what no level sees, no difference tells of: an exact solution alone would say that it does not matter
    unseen = missed | ((exact | nothing | exactly) & far_from_exact(e)) | np.isnan(e.error[..., -1])
    blind = e.missed & unseen
    # an implicit scheme with steps as long goes on with a velocity that has gone, and that is no fault of it
    coarse = unresolved(e) & (exact | missed | (wrong & ~right))
    return [
        (blind & e.jumps, "non_smooth"),
        (blind, "pre_asymptotic"),
        # at rest on every level, and away from a motion: steps as long as that see nothing of it
        (still & far_from_exact(e), "pre_asymptotic"),
        (still, "not_applicable"),
        (coarse, "pre_asymptotic"),
        # levels that notice their events at the same points are no closer to the exact solution for that
        (exact & far_from_exact(e) & rough, "non_smooth"),
        (exact & far_from_exact(e), "wrong_limit"),
        (exact, "exact"),
        (exactly & ~at_round_off(e), "order_low"),
        (nothing & ~exactly & (e.moved == 0.0) & far_from_exact(e), "pre_asymptotic"),
        (nothing & ~exactly & ~(rough | unlike) & _opposite(e), "oscillating"),
        (exactly | (nothing & (at_round_off(e) | ~(rough | unlike))), "round_off"),
        # orders that swing into a floor do so by noise
        (swings & t.cut & ~np.signbit(t.scatter), "round_off"),
        (swings, "oscillating"),
        (missed & regular, "wrong_limit"),
        (right & ~too_small & regular, "asymptotic"),
        (wrong & ~above & regular & (~kinked | deeper), "order_low"),
        (kinked, "non_smooth"),
        (wrong & above & ~rough, "order_high"),
        (e.missed & e.jumps, "non_smooth"),
        (e.missed, "pre_asymptotic"),
        (rough, "non_smooth"),
        (t.cut, "round_off"),
        (limited, "non_smooth"),
    ], low


def _right(e: Evidence, t: Trend, p: Floats) -> Flags:
    """Say where the order is p, surely enough to say so.

    The last two local orders, or their limit with its interval, are within the tolerance; the curves coincide; and no
    lower power can be hiding: what is left besides h^p fades, or is less than a tenth of a lower power would make.
    """
    several, tol = t.several, e.tolerance
    both = several & (np.abs(t.local - p) <= tol) & (np.abs(t.local - t.change - p) <= tol)
    both &= t.width <= th.NARROW
    both |= several & t.fading & (np.abs(t.local - p) <= tol) & (np.abs(t.change) <= tol)
    both |= errors.confirm(e, t, p) & (np.abs(t.local - p) <= tol)
    near = (np.abs(t.order - p) <= tol) & ((t.width <= tol) | both | ~several)
    # one triple alone must be proportional, unless true errors have three ratios to tell with
    alone = ~(several | errors.vouch(e, p))
    together = np.abs(t.scatter) <= np.where(alone, th.PROPORTIONAL_ALONE, th.COINCIDENT)
    clear = _alone(e, t, p)
    right = near & together & clear & ~np.signbit(t.scatter)
    right &= ~t.gap & ~t.turning
    right &= (~t.drifting & ~_leaving(t, p)) | t.irregular | _little_left(t, p)
    return np.asarray(right)


def _settled_elsewhere(e: Evidence, t: Trend, p: Floats) -> Flags:
    """Say where the ladder would pass as one of another order, whose interval excludes p.

    What is enough to believe an order is enough to say that it is not p.
    """
    likely = np.maximum(np.round(2.0 * t.order) / 2, th.LEAST_CANDIDATE)
    usual = replace(e, tolerance=min(e.tolerance, ORDER_TOLERANCE))
    settled = _right(usual, t, likely)
    doubtful = ~settled & _two_ratios(usual, t, likely)
    low = np.where(doubtful, _below(t), t.low)
    excluded = (t.high < p - e.tolerance) | (low > p + e.tolerance)
    return np.asarray((settled | doubtful) & excluded & (np.abs(likely - p) > e.tolerance))


def _kinked(e: Evidence, t: Trend, p: Floats) -> tuple[Flags, Flags]:
    """Say where a corner of the force within a step explains an order below p, and where it is lower than that.

    A corner leaves all powers up to its own: a ladder that settles lower has another cause.
    """
    low = (t.order < p - e.tolerance) | (t.local < p - e.tolerance)
    low |= t.several & (t.local - t.change < p - e.tolerance)
    kinked = ~np.isnan(e.corner) & (p >= e.corner) & (low | t.alternating)
    return kinked, np.asarray(t.order < e.corner - np.maximum(e.tolerance, th.HALF_SPACING))


def _opposite(e: Evidence) -> Flags:
    """Say where differences change their sign from level to level and fall: those of an error do, of noise do not."""
    opposite = np.signbit(e.scatter) & (np.abs(e.scatter) <= th.INCOHERENT)
    falls = e.difference[..., 1:] <= e.difference[..., :-1] * 2.0**-th.HALF_SPACING
    return np.asarray(np.all(opposite & falls, axis=-1) & ~at_round_off(e))


def _alone(e: Evidence, t: Trend, p: Floats) -> Flags:
    """Say where h^p stands alone: what is left fades, or is less than a tenth of a lower power would make."""
    mismatch, before = mismatches(t, p)
    clear = _little_left(t, p)
    clear |= t.several & ((t.fading & ~t.slow) | t.irregular)
    # as much as one triple alone may show, where it does not grow: the interval then reaches to a lower power
    steady = t.several & (np.abs(t.change) <= th.STEADY * e.tolerance)
    clear |= steady & (mismatch <= np.minimum(th.PROPORTIONAL_ALONE, th.GROWS * before))
    # one order alone: two terms of one shape tell from a power by nothing but the number
    own = np.abs(t.local - p) <= np.maximum(
        th.SINGLE_WIDTH, th.OF_SCATTER * np.abs(t.scatter) / th.LOG2
    )
    clear |= t.several & (mismatch <= th.PROPORTIONAL_ALONE) & (mismatch <= th.FADING * before)
    # one triple says too little for an order that few schemes have
    own &= (p == np.round(p)) | (np.abs(t.local - p) <= th.SINGLE_WIDTH)
    clear = np.where(t.several, clear | errors.confirm(e, t, p), own | errors.vouch(e, p))
    return np.asarray(clear & ~errors.leave(e, t, p))


def _leaving(t: Trend, p: Floats) -> Flags:
    """Say where the local orders move away from p, on one side of it: a lower power may be emerging."""
    away = t.local - p
    before = t.local - t.change - p
    return (
        t.several
        & (away * before > 0)
        & (np.abs(away) > np.abs(before))
        & (np.abs(t.change) > th.MOVES)
        & (np.abs(away) > th.DEPARTED)
        & ~t.noisy
    )


def _plausible(t: Trend, p: Floats, tol: float) -> Flags:
    """Say where an order that an expansion can have, a multiple of 1/2 other than p, is near.

    A ladder that only passes by (towards p, and away from that multiple) has not settled there. An order that is no
    whole number is believed where the series are nearly proportional only.
    """
    several = t.several
    before = t.local - t.change
    alone = np.hypot(t.scatter, th.LOG2 * (t.order - np.round(2.0 * t.order) / 2)) <= th.HIDDEN
    towards_p = np.abs(t.local - p) < np.abs(before - p)
    found = np.zeros(p.shape, dtype=bool)
    for candidate in (np.floor(2.0 * t.order) / 2, np.ceil(2.0 * t.order) / 2):
        whole = candidate == np.round(candidate)
        passing = several & towards_p
        passing &= np.abs(t.local - candidate) > np.abs(before - candidate) + th.QUIET
        # one triple tells a pure power from two proportional terms by nothing but the number
        least = np.where(whole, th.REACH_SETTLED, th.REACH)
        wide = np.where(
            whole, th.OF_SINGLE * np.abs(t.scatter) / th.LOG2, np.minimum(t.width, th.REACH)
        )
        reach = np.where(several, np.maximum(t.width, least), np.maximum(wide, th.SINGLE_WIDTH))
        near = (np.abs(t.order - candidate) <= reach) & (np.abs(candidate - p) > tol)
        near &= (candidate >= th.LEAST_CANDIDATE) & (
            several | alone | (candidate <= p + th.MOST_ABOVE)
        )
        pure = np.abs(t.order - candidate) <= th.SINGLE_WIDTH
        found |= (
            near
            & ~passing
            & (whole | np.where(several, np.abs(t.scatter) <= 2 * th.PROPORTIONAL_ALONE, pure))
        )
    return found


def _on_the_way(t: Trend, p: Floats, tol: float) -> Flags:
    """Say where the local orders approach p so fast that they may reach it: three last changes cover the way."""
    way = np.abs(t.local - p) - tol
    approach = np.abs(t.local - t.change - p) - np.abs(t.local - p)
    return np.asarray(t.several & (3 * approach >= way))


def _two_ratios(e: Evidence, t: Trend, p: Floats) -> Flags:
    """Say where the last two ratios are those of h^p, and no lower power is seen to take over.

    What is left beside h^p may then be a higher power, accidents of the levels, or less than a tenth of a lower power:
    the order passes, and its interval reaches down to the lower power that may be there.
    """
    now, before = mismatches(t, p)
    near = np.maximum(np.abs(t.local - p), np.abs(t.local - t.change - p)) <= e.tolerance
    both = t.several & near & (now <= th.PROPORTIONAL_ALONE) & (before <= th.COINCIDENT)
    # behind a jump two orders may be neighbours by accident
    both &= ~np.signbit(t.scatter) & ~t.gap & ~t.alternating & ~(np.abs(t.earlier) > th.JUMP)
    # nor are they the orders of one power where the differences have turned round between them
    both &= ~t.turning
    return np.asarray(both & ~_emerges(t, p) & (t.irregular | ~errors.leave(e, t, p)))


def _below(t: Trend) -> Floats:
    """Return the lower end of an interval that reaches to the lowest power that may be hiding, shape (...)."""
    return np.minimum(t.low, lowest(t.order - t.width, th.LARGEST_POWER_GAP))


def _little_left(t: Trend, p: Floats) -> Flags:
    """Say where what is left besides h^p is less than a tenth of a lower power would make."""
    now, before = mismatches(t, p)
    # what round-off may have made does not tell of a lower power that grows
    return np.asarray(now <= most_left(p, now, before, t.several & (now > t.noise)))


def _emerges(t: Trend, p: Floats) -> Flags:
    """Say where a lower power is seen to grow: by the shape of the differences, or in the orders.

    Three orders tell of it by their last two changes. Two orders have one, which says little where the differences
    become proportional at the same time.
    """
    now, _ = mismatches(t, p)
    spread, before = np.abs(t.scatter), t.scatter_before
    by_shape = (spread > th.QUIET) & (spread > th.GROWS * before)
    # what rises more steeply than any lower power is a floor that begins
    by_shape &= ~(spread > steepest(t.local - t.change) * before)
    last = t.local - p
    away, then, earlier = np.abs(last), np.abs(last - t.change), np.abs(last - t.change - t.earlier)
    calm = (before > th.READABLE) & (spread <= th.FADING * before)
    two = np.isnan(t.earlier) & (now > th.HIDDEN) & ~calm
    by_order = (away > th.GROWS * then) & ((then > th.GROWS * earlier) | two)
    return np.asarray((by_shape | by_order) & (now > t.noise) & ~_little_left(t, p))
