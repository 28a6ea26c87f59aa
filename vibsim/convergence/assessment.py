"""The verdict on any ladder of levels, from the probabilities of the error model.

A power *dominates* where no other one has more than a tenth of it. The table of decisions, first to last:

| what is found | status and reason |
|---|---|
| a value that is not finite | FAIL ``non_finite`` |
| fewer than three levels | INCONCLUSIVE ``too_few_levels`` |
| all differences are noise as expected, but not the distance from the exact solution | FAIL ``wrong_limit`` |
| the levels show some order, surely, and the exact solution is far from their limit (`MISSED`) | FAIL ``wrong_limit`` |
| all differences are noise as expected | PASS ``exact`` |
| a power within the tolerance of the expected one dominates, surely | PASS ``asymptotic`` |
| others dominate, surely, the expected one does not, and one is definite | FAIL ``order_low``, ``order_high`` |
| noise is more probable than errors that alternate, and than all else | INCONCLUSIVE ``round_off`` |
| errors that change their sign from level to level are | INCONCLUSIVE ``oscillating`` |
| anything else | INCONCLUSIVE ``pre_asymptotic`` |

*Surely* is a probability above ``1 - RISK``. For a FAIL it is one above ``1 - RISK_OF_THREE`` where it rests on three
levels and coarser ones do not fit them: three levels may fall like a power by accident.

Noise that is predicted to grow may not do so. Where it ends a window, and the finest differences show that it may be
far less (`_least_noise`), the ladder is judged with less noise as well. Then a verdict is sure that is sure
with one of the two, while it has at least the probability `RISK` with the other.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vibsim.convergence.error_model.hypotheses import times
from vibsim.convergence.error_model.posterior import Ladder, Posterior, posterior
from vibsim.core.array_types import Codes, Flags, Floats, Integers
from vibsim.core.vocabulary import ORDER_TOLERANCE, REASON_NAMES, REASONS, STATUSES

RISK = 0.01
"""Accepted probability that a verdict is wrong."""
RISK_OF_THREE = 0.1 * RISK
"""The same of a FAIL by three levels behind others that do not fit (seeds 1, 3, 11, 101-103)."""
DEFINITE = 0.9
"""An order fails only where one power has so much of the probability, alone or as one of two of a size."""
INTERVAL = 0.95
"""Probability of the interval of an order."""
BOUND = 3.0
"""Standard deviations in the bound of an error: of the tails that the posterior has, these are 95 % (seeds 1 and 3)."""
BLOCK = 256
"""So many ladders are judged together at most."""
LARGEST_RATIO = 1e60
"""Of a difference to the largest finer one, and of noise to the largest difference: more says no more."""
MISSED = 3.0
"""A limit is missed that is so many bounds of the best value away from it,"""
MISSED_SHARE = 0.5
"""and at least so large a part of the estimated error of the finest level."""
STATED_NOISE_FACTOR = 2.0
"""The same as `NOISE_FACTOR` of noise that a user states: differences of normal noise exceed it in one of 200."""
NOISE_FACTOR = 10.0
"""Noise may be so many times its prediction where levels are said to differ by nothing else, and so many times their
finest differences."""
ASYMPTOTIC, ORDER_LOW, ORDER_HIGH, PRE_ASYMPTOTIC = (
    REASON_NAMES.index(name) for name in ("asymptotic", "order_low", "order_high", "pre_asymptotic")
)
Sides = tuple[Floats, Floats, Floats]
"""The probabilities that a lower power dominates, one that is expected, and a higher one."""


@dataclass(frozen=True)
class Assessment:
    """What was decided of ladders; arrays of shape (ladder,) where no other is given."""

    status: Codes  # index into `vocabulary.STATUSES`
    reason: Codes  # index into `vocabulary.REASON_NAMES`
    order: Floats  # the order of the finest three levels that the verdict rests on; NaN where there is none
    low: Floats  # lower end of the interval of the order
    high: Floats  # upper end
    first: Integers  # coarsest level that the verdict rests on, as a position
    last: Integers  # finest one
    error: Floats  # norm of the error of the finest level, estimated where the exact solution is not known
    error_bound: Floats  # what it is at most
    weights: Floats  # the best value is the sum of these times the values of the levels, shape (ladder, level)
    best_bound: Floats  # how far the limit is from the best value, at most


def assess(
    ladder: Ladder,
    *,
    expected: float | None = None,
    at_least: float | None = None,
    tolerance: float = ORDER_TOLERANCE,
    noise_factor: float = NOISE_FACTOR,
) -> Assessment:
    """Decide whether ladders converge as expected.

    Parameters
    ----------
    ladder
        The numbers of any number of ladders with the same step sizes.
    expected
        The order that is expected.
    at_least
        The least order that is expected. Without either, any order will do that can be believed.
    tolerance
        How far from `expected`, or below `at_least`, an order may be.
    noise_factor
        Noise may be so many times `Ladder.floor` where levels are said to differ by nothing else.
    """
    n, count = len(ladder.h), len(ladder.gram)
    finite = np.all(np.isfinite(ladder.gram), axis=(-2, -1)) & np.all(
        np.isfinite(ladder.floor), axis=-1
    )
    reason = np.full(count, REASON_NAMES.index("non_finite"))
    found = _nothing(count, n)
    if n < 3:
        reason[finite] = REASON_NAMES.index("too_few_levels")
    else:
        every = np.flatnonzero(finite)
        for start in range(0, len(every), BLOCK):
            rows = every[start : start + BLOCK]
            part, size, factors = _scaled(ladder, rows)
            believed = posterior(part, expected)
            sides = _sides(believed, expected, at_least, tolerance)
            exact = _is_only_noise(part, noise_factor)
            # what the levels say of the limit without the exact solution
            of_limit, missed = believed, np.zeros(len(rows), dtype=bool)
            if part.exact_known:
                of_limit = posterior(_without_exact(part), expected)
                _, settled, _ = _sides(of_limit, None, None, tolerance)
                missed = exact & _is_away(part, noise_factor)
                risk = np.where(_rests_on_three(of_limit), RISK_OF_THREE, RISK)
                missed |= (settled > 1.0 - risk) & _is_missed(part, of_limit)
            codes = _reasons(believed, sides, exact, missed)
            # finer levels may show more if their noise is less than predicted
            less = _least_noise(part)
            again = np.flatnonzero(_is_cut_short(part, less, believed) & ~exact & ~missed)
            if len(again):
                other = posterior(_with_noise(part, less, again), expected)
                lower, right, higher = (side[again] for side in sides)
                codes[again], chosen = _of_both(
                    codes[again],
                    (lower, right, higher),
                    other,
                    _sides(other, expected, at_least, tolerance),
                )
                believed.replace(again[chosen], other, chosen)
            reason[rows] = codes
            numbers = _numbers(part, believed, of_limit, exact, missed, factors)
            for name, value in numbers.items():
                in_units = name in ("error", "error_bound", "best_bound")
                found[name][rows] = value * size if in_units else value
    status = np.array(
        [STATUSES.index(REASONS[REASON_NAMES[code]]) for code in reason], dtype=np.int8
    )
    return Assessment(status=status, reason=reason.astype(np.int8), **found)


def _nothing(count: int, levels: int) -> dict[str, np.ndarray]:
    """Return the numbers of ladders of which nothing is known."""
    names = ("order", "low", "high", "error", "error_bound", "best_bound")
    unknown = {name: np.full(count, np.nan) for name in names}
    window = {"first": np.zeros(count, dtype=np.int64), "last": np.full(count, levels - 1)}
    return {**unknown, **window, "weights": np.full((count, levels), np.nan)}


def _scaled(ladder: Ladder, rows: Integers) -> tuple[Ladder, Floats, Floats]:
    """Return some of the ladders over the norm of their largest row, that norm, and a factor on every difference.

    Squares of differences that are too large or small for each other would overflow or vanish: coarse levels that have
    blown up so far are brought nearer.
    """
    gram, count = ladder.gram[rows], len(ladder.h) - 1
    norms = np.sqrt(np.diagonal(gram, axis1=1, axis2=2))
    factors = np.ones_like(norms)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        for k in range(count - 2, -1, -1):
            ratio = norms[:, k] / np.max((norms * factors)[:, k + 1 : count], axis=-1)
            factors[:, k] = np.where(ratio > LARGEST_RATIO, LARGEST_RATIO / ratio, 1.0)
    # beside differences of 0 any size will do
    factors = np.where(factors > 0.0, factors, 1.0)
    size = np.max(norms * factors, axis=-1)
    size = np.where(size > 0.0, size, 1.0)
    over = factors / size[:, None]
    gram = gram * over[:, :, None] * over[:, None, :]
    # squares of what is larger would overflow
    floor = np.minimum(ladder.floor[rows] / size[:, None], LARGEST_RATIO)
    part = Ladder(ladder.h, gram, floor, ladder.numbers[rows], ladder.exact_known)
    return part, size, factors[:, :count]


def _is_only_noise(ladder: Ladder, factor: float) -> Flags:
    """Say where all levels differ by no more than the noise that is expected of them."""
    n = len(ladder.h)
    d = np.sqrt(np.diagonal(ladder.gram, axis1=1, axis2=2))[:, : n - 1]
    allowed = factor * (ladder.floor[:, :-1] + ladder.floor[:, 1:])
    return np.asarray(np.all(d <= allowed, axis=-1))


def _is_away(ladder: Ladder, factor: float) -> Flags:
    """Say where the finest level is further from the exact solution than noise explains."""
    return np.asarray(np.sqrt(ladder.gram[:, -1, -1]) > factor * ladder.floor[:, -1])


def _is_missed(ladder: Ladder, of_limit: Posterior) -> Flags:
    """Say where the exact solution is far outside of the bound of the best value."""
    # the best value less the exact one, in the rows
    path = np.concatenate([of_limit.path, np.ones((len(of_limit.path), 1))], axis=-1)
    distance = _norm(path, ladder.gram)
    bound = BOUND * np.sqrt(_variance(ladder, of_limit) + ladder.floor[:, -1] ** 2)
    error = _norm(of_limit.path, ladder.gram[:, :-1, :-1])
    return np.asarray((distance > MISSED * bound) & (distance > MISSED_SHARE * error))


def _least_noise(ladder: Ladder) -> Floats:
    """Return the noise of every level if it grows no more than the finest differences show, shape (ladder, n).

    At the coarsest level it is as predicted, since storing numbers makes noise even where differences are 0.
    """
    finest = np.sqrt(np.max(np.diagonal(ladder.gram, axis1=1, axis2=2)[:, -2:], axis=-1))
    least = np.maximum(ladder.floor[:, :1], NOISE_FACTOR * finest[:, None])
    return np.asarray(np.minimum(ladder.floor, least))


def _is_cut_short(ladder: Ladder, less: Floats, believed: Posterior) -> Flags:
    """Say where noise that may be far less than predicted ends the most probable window."""
    every, last = np.arange(len(less)), _window(believed)[1]
    return np.asarray(NOISE_FACTOR * less[every, last] < ladder.floor[every, last])


def _with_noise(ladder: Ladder, noise: Floats, rows: Integers) -> Ladder:
    """Return some of the ladders with other noise."""
    return Ladder(
        ladder.h, ladder.gram[rows], noise[rows], ladder.numbers[rows], ladder.exact_known
    )


def _of_both(
    codes: Integers, sides: Sides, other: Posterior, sides_of_other: Sides
) -> tuple[Integers, Flags]:
    """Return the reasons of ladders that were judged with the predicted noise and with less, and where less counts.

    A verdict is sure that is sure with one of the two, while the other does not exclude it.
    """
    none = np.zeros(len(codes), dtype=bool)
    codes_of_other = _reasons(other, sides_of_other, none, none)
    excluded = _probability(codes, sides_of_other) < RISK
    added = ~_is_decided(codes) & _is_decided(codes_of_other)
    added &= _probability(codes_of_other, sides) >= RISK
    codes = np.where(added, codes_of_other, codes)
    return np.where(excluded, PRE_ASYMPTOTIC, codes), excluded | added


def _probability(codes: Integers, sides: Sides) -> Floats:
    """Return the probability of what is decided, 1 where nothing is."""
    lower, right, higher = sides
    return np.select([codes == ASYMPTOTIC, _is_decided(codes)], [right, lower + higher], 1.0)


def _is_decided(codes: Integers) -> Flags:
    """Say where there is a verdict on the order."""
    return np.isin(codes, (ASYMPTOTIC, ORDER_LOW, ORDER_HIGH))


def _norm(path: Floats, gram: Floats) -> Floats:
    """Return the norm of a combination of rows with this Gram matrix, shape (ladder,)."""
    return np.asarray(np.sqrt(np.maximum(_square(path, gram), 0.0)))


def _square(path: Floats, gram: Floats) -> Floats:
    """Return the square of the same norm."""
    return np.asarray(np.sum(path * times(gram, path), axis=-1))


def _variance(ladder: Ladder, of_limit: Posterior) -> Floats:
    """Return the mean square distance of the limit from its mean over all hypotheses."""
    path, n = of_limit.path, len(ladder.h)
    differences = ladder.gram[:, : n - 1, : n - 1]
    return np.asarray(np.maximum(of_limit.path_squared - _square(path, differences), 0.0))


def _reasons(p: Posterior, sides: Sides, exact: Flags, missed: Flags) -> Integers:
    """Return the reasons of the verdicts, as positions in `REASON_NAMES`; see the head of this module."""
    lower, right, higher = sides
    definite = np.max(_near_each_power(p), axis=-1) > DEFINITE
    risk = np.where(_rests_on_three(p), RISK_OF_THREE, RISK)
    another = (lower + higher > 1.0 - risk) & (right < risk) & definite
    cases = [
        (missed, "wrong_limit"),
        (exact, "exact"),
        (right > 1.0 - RISK, "asymptotic"),
        (another & (lower > higher), "order_low"),
        (another, "order_high"),
        (p.noise > np.maximum(1.0 - p.noise - p.alternating, p.alternating), "round_off"),
        (p.alternating > 1.0 - p.noise - p.alternating, "oscillating"),
    ]
    codes = [REASON_NAMES.index(name) for _, name in cases]
    return np.select([mask for mask, _ in cases], codes, REASON_NAMES.index("pre_asymptotic"))


def _rests_on_three(p: Posterior) -> Flags:
    """Say where windows of three levels behind others that do not fit have most of the probability."""
    three = [start > 0 and end - start == 2 for start, end in p.windows]
    return np.asarray(np.sum(p.window[:, three], axis=-1) > 0.5)


def _near_each_power(p: Posterior) -> Floats:
    """Return the probability that each power, within the usual tolerance, dominates or is one of two of a size."""
    near = np.abs(p.powers[:, None] - p.powers) <= ORDER_TOLERANCE + 1e-9
    one_of_two = np.any(np.abs(p.pairs[:, :, None] - p.powers) <= ORDER_TOLERANCE + 1e-9, axis=1)
    return np.asarray(_sums(p.alone, near) + _sums(p.of_pairs, one_of_two))


def _sums(values: Floats, chosen: Flags) -> Floats:
    """Return sums of the values along the last axis that are chosen in each column, shape (ladder, column)."""
    return np.stack([np.sum(values[:, part], axis=-1) for part in chosen.T], axis=-1)


def _numbers(
    ladder: Ladder,
    believed: Posterior,
    of_limit: Posterior,
    exact: Flags,
    missed: Flags,
    factors: Floats,
) -> dict[str, np.ndarray]:
    """Return what an `Assessment` holds beside status and reason, for ladders of three levels and more."""
    n, orders = len(ladder.h), believed.orders
    first, last = _window(believed)
    order = np.where(exact, np.nan, _finest_order(orders, last))
    # where the exact solution is missed, the levels alone have an order
    ends = zip(_interval(of_limit, order), _interval(believed, order), strict=True)
    low, high = (np.where(exact, np.nan, np.where(missed, a, b)) for a, b in ends)
    window = {"first": np.where(exact, 0, first), "last": np.where(exact, n - 1, last)}
    best = _best(ladder, of_limit, exact, factors)
    return {"order": order, "low": low, "high": high, **window, **best}


def _without_exact(ladder: Ladder) -> Ladder:
    m = len(ladder.h) - 1
    return Ladder(ladder.h, ladder.gram[:, :m, :m], ladder.floor, ladder.numbers, exact_known=False)


def _sides(
    believed: Posterior, expected: float | None, at_least: float | None, tolerance: float
) -> Sides:
    """Return the probabilities that a lower power dominates, one that is expected, and a higher one."""
    powers, alone, mixed = believed.powers, believed.alone, believed.of_pairs
    margin = tolerance + 1e-9
    if expected is not None:
        least, most = expected - margin, expected + margin
    elif at_least is not None:
        least, most = at_least - margin, np.inf
    else:
        # the neighbourhood that holds most
        right = np.max(_sums(alone, np.abs(powers[:, None] - powers) <= margin), axis=-1)
        return np.zeros(len(alone)), right, np.zeros(len(alone))
    low, high = powers < least, powers > most
    lower, right, higher = (np.sum(alone[:, part], axis=-1) for part in (low, ~low & ~high, high))
    # two powers of one size are no order, but tell of one that both are below, or above
    first, second = believed.pairs.T
    lower = lower + np.sum(mixed[:, second < least], axis=-1)
    higher = higher + np.sum(mixed[:, first > most], axis=-1)
    if expected is None:
        right = right + np.sum(mixed[:, first >= least], axis=-1)
    return lower, right, higher


def _window(believed: Posterior) -> tuple[Integers, Integers]:
    """Return the coarsest and the finest level of the most probable window of each ladder."""
    first, last = np.array(believed.windows)[np.argmax(believed.window, axis=-1)].T
    return first, last


def _finest_order(orders: Floats, last: Integers) -> Floats:
    """Return the order of the finest three levels up to `last` that have one."""
    index = np.arange(orders.shape[-1])
    usable = np.isfinite(orders) & (index <= last[:, None] - 2)
    usable = np.where(np.any(usable, axis=-1, keepdims=True), usable, np.isfinite(orders))
    finest = np.max(np.where(usable, index, -1), axis=-1)
    picked = np.take_along_axis(orders, np.maximum(finest, 0)[:, None], axis=-1)[:, 0]
    return np.where(finest >= 0, picked, np.nan)


def _interval(believed: Posterior, order: Floats) -> tuple[Floats, Floats]:
    """Return the range of powers that holds `INTERVAL` of what is believed, and the measured order."""
    outside = 0.5 * (1.0 - INTERVAL)
    whole = np.maximum(believed.expansion, 1e-300)[:, None]
    below = np.cumsum(believed.lowest, axis=-1) / whole
    above = np.cumsum(believed.highest[:, ::-1], axis=-1) / whole
    low = believed.powers[np.argmax(below > outside, axis=-1)]
    high = believed.powers[::-1][np.argmax(above > outside, axis=-1)]
    return np.fmin(low, order), np.fmax(high, order)


def _best(ladder: Ladder, of_limit: Posterior, exact: Flags, factors: Floats) -> dict[str, Floats]:
    """Return the best value, its bound, and the error of the finest level.

    Three levels have the extrapolation by their own order, more levels the mean over all hypotheses. Where levels
    differ by noise alone, the finest one is the best.
    """
    n = len(ladder.h)
    path = of_limit.path
    differences = ladder.gram[:, : n - 1, : n - 1]
    spread = _variance(ladder, of_limit)
    floor = ladder.floor[:, -1]
    if n == 3:
        p, ratio = of_limit.orders[:, 0], ladder.h[1] / ladder.h[2]
        with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
            step = np.where(p > 0.0, -1.0 / (ratio**p - 1.0), np.nan)
        other = np.stack([np.zeros_like(step), step], axis=-1) - path
        spread = spread + _square(other, differences)
        path = path + other
    path = np.where(exact[:, None], 0.0, path)
    spread = np.where(exact, differences[:, -1, -1], spread)
    weights = np.zeros((len(path), n))
    weights[:, -1] = 1.0
    weights[:, :-1] += path * factors
    weights[:, 1:] -= path * factors
    bound = BOUND * np.sqrt(spread + floor**2)
    if ladder.exact_known:
        error = np.sqrt(ladder.gram[:, -1, -1])
        largest = error + floor
    else:
        error = _norm(path, differences)
        largest = error + bound
    return {"weights": weights, "best_bound": bound, "error": error, "error_bound": largest}
