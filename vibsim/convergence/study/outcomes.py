"""What is measured and decided of the ladders of a study, before it is put into words."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields, replace
from decimal import Decimal

import numpy as np

from vibsim.convergence.assessment import DECIDED, Assessment, Question, assess
from vibsim.convergence.differences import orders_of_steps
from vibsim.convergence.reasons import is_one_of
from vibsim.convergence.study.measurement import (
    SINGLE,
    Measurement,
    half_last_digits,
    measurement,
    step_of_values,
)
from vibsim.convergence.study.restriction import polynomials
from vibsim.convergence.thresholds import LEAST_WITH_LIMIT, MISSED
from vibsim.core.array_types import Flags, Floats, Integers
from vibsim.core.vocabulary import LEVELS_OF_AN_ORDER, REASON_NAMES
from vibsim.elementary import on_arrays

MOST_ROUNDED = 5e-4
"""Exact values of more than three digits may be rounded to them: half of their last digit is a smaller part."""
EXACT_DIGITS = 16
"""Exact values with no more decimal digits than these may be rounded to them: whoever writes them down stops there."""
MOST_UNITS = 8.0
"""Exact values that are further from the finest level, in half units of its last digit, were not missed by rounding."""
MOST_ADDED_UP, ADDED_UP = 100.0, 10.0
"""What rounding errors add up to in a calculation, in units of the precision of the values: at most, and usually.

Bounds count the latter for single precision, whose steps are often seen beside the error."""
LEAST_RATIO = 1.4
"""Of levels whose step sizes have a smaller ratio some are left out of the verdict [calibrated].

The two powers of the error model leave a smooth rest. At levels side by side it is no independent misfit, as the model
takes it, and their many differences would make any order seem sure."""
SMOOTH = 0.05
"""Levels lie on a smooth curve if each is off it by so small a part of what levels differ by [calibrated]."""
SEEN = 0.1
"""The rounding of exact values is seen where it is so large a part of the error of the finest level."""


@dataclass(frozen=True)
class Request:
    """What a user asks of a ladder."""

    quantity: str
    order: float | None
    at_least: float | None
    noise: float | None
    half_of_exact: float | None = None
    """Half a unit of the last digit of the exact value as it was written; None where only its value is known."""
    written: tuple[Decimal, ...] | None = None
    """Numbers of all levels with the digits that they were written with."""

    def halves(self, part: Floats, places: Integers, *, of_binary: bool = False) -> Floats:
        """Return half a unit of the last digit of levels, whose places are given; see `half_last_digits`."""
        written = None if self.written is None else [self.written[i] for i in places]
        return half_last_digits(part, of_binary=of_binary, written=written)


@dataclass
class Outcome:
    """What was measured and decided of one member; NaN where nothing is known, and where a level is not finite."""

    values: Floats
    """Numbers, or norms of the values, shape (n,)."""
    errors: Floats
    """Shape (n,)."""
    is_number: bool
    exact_known: bool
    finite: Integers
    """Positions of the levels that are finite."""
    reason: str = "non_finite"
    differences: Floats = field(default_factory=lambda: np.empty(0))
    """Of successive finite levels, with their sign where they are numbers or of opposite shape, shape (finite - 1,)."""
    ratios: Floats = field(default_factory=lambda: np.empty(0))
    """With their sign, shape (finite - 2,)."""
    size: float = np.nan
    floor: float = np.nan
    """Norm and noise of the finest level."""
    order: float = np.nan
    low: float = np.nan
    high: float = np.nan
    used: tuple[int, ...] = ()
    """Positions of the levels that the order rests on."""
    is_contradicted: bool = False
    """Whether finer levels contradict that order."""
    left_out: int = 0
    """How many finite levels the verdict leaves out, because their step sizes are close to those of others."""
    error: float = np.nan
    error_bound: float = np.nan
    best: Floats | None = None
    """Extrapolated values, shape (points,)."""
    best_bound: float = np.nan
    """How far they are from the limit at most, in the norm."""
    agrees_to_digits: bool = False
    """Whether the levels were judged without the exact values, which have too few digits to tell their error."""
    rounded: float = 0.0
    """How far the extrapolated values are off because those of the levels have few digits; part of the bounds."""
    comes_in_steps: bool = False
    """Whether they are so far off because the values come in steps."""


def outcomes(
    request: Request, h: Floats, values: Floats, epsilon: Floats, exact: Floats | None
) -> list[Outcome]:
    """Return what was decided of each member.

    Parameters
    ----------
    asked
        What is asked of all of them.
    h
        Step sizes, strictly decreasing, shape (n,).
    values
        Shape (member, n, points).
    epsilon
        Relative spacing of the precision of every level, shape (n,).
    exact
        Exact values, shape (member, points); None where they are not known.
    """
    finite: Flags = np.asarray(np.isfinite(values).all(axis=2))
    patterns = np.stack([finite, _judged(h, values, finite)], axis=1)
    found: dict[int, Outcome] = {}
    for pattern in np.unique(patterns, axis=0):
        members = np.flatnonzero(np.all(patterns == pattern, axis=(1, 2)))
        truth = None if exact is None else exact[members]
        some = _with_finite(request, h, values[members], epsilon, truth, pattern)
        found |= dict(zip(members.tolist(), some, strict=True))
    if exact is not None:
        for i, one in found.items():
            half = _rounding_of_exact(one, exact[i], request.half_of_exact)
            if not half:
                continue
            (levels,) = _with_finite(request, h, values[i : i + 1], epsilon, None, patterns[i])
            is_better = one.reason == "wrong_limit" or levels.reason in (*DECIDED, "exact")
            if is_better and _agrees(levels, exact[i], half):
                levels.agrees_to_digits = True
                found[i] = levels
    return [found[i] for i in range(len(values))]


def _judged(h: Floats, values: Floats, finite: Flags) -> Flags:
    """Say which levels of each member a verdict rests on: finite ones, and of those side by side only some.

    Some are left out where all lie on a smooth curve. Else there is noise, of which every level tells.
    """
    judged = finite.copy()
    for i, row in enumerate(finite):
        places = np.flatnonzero(row)
        kept = spread_out(h[places])
        others = np.setdiff1d(np.arange(len(places)), kept)
        if len(others) and _is_smooth(h[places], values[i, places], others):
            judged[i, places[others]] = False
    return judged


def _is_smooth(h: Floats, values: Floats, places: Integers) -> bool:
    """Say whether levels at some places are where the cubic through the four levels around them has them.

    Nothing is asked of the coarsest one, which has none before it. They may be off by a small part
    of what these differ by. `values` are of shape (n, points).
    """
    scale = float(np.max(np.abs(values)))
    u = values / (scale if scale > 0.0 else 1.0)
    moved = np.sqrt(np.mean(np.diff(u, axis=0) ** 2, axis=1))
    for j in places[places > 0].tolist():
        others = np.delete(np.arange(len(h)), j)
        (weights,), (near,), _ = polynomials(h[[j]], h[others], min(4, len(others)), 0.0)
        around = others[near]
        off = u[j] - np.sum(weights[:, None] * u[around], axis=0)
        allowed = SMOOTH * np.mean(moved[np.min(around) : np.max(around)])
        if not np.sqrt(np.mean(off**2)) <= allowed:
            return False
    return True


def spread_out(h: Floats) -> Integers:
    """Return the places of step sizes of which each is `LEAST_RATIO` times the next finer one at least.

    Of three levels and more they are three at least: the ends, and the one that is nearest to their middle.
    """
    kept = [len(h) - 1]
    for i in range(len(h) - 2, -1, -1):
        if h[i] >= LEAST_RATIO * h[kept[-1]]:
            kept.append(i)
    if len(kept) < LEVELS_OF_AN_ORDER <= len(h):
        sizes = on_arrays.log(h)
        middle = np.argmin(np.abs(sizes[1:-1] - 0.5 * (sizes[0] + sizes[-1])))
        kept = [len(h) - 1, int(middle) + 1, 0]
    return np.array(kept[::-1])


def _rounding_of_exact(one: Outcome, exact: Floats, half: float | None) -> float:
    """Return half a unit of the last digit of exact values, if that may be why nothing else was decided; else 0."""
    if one.reason not in ("wrong_limit", "pre_asymptotic", "round_off", "oscillating"):
        return 0.0
    if half is None:
        half = float(half_last_digits(exact[None], EXACT_DIGITS)[0])
    at_most = MOST_ROUNDED * float(np.max(np.abs(exact)))
    return half if SEEN * abs(one.error) <= half <= at_most else 0.0


def _agrees(levels: Outcome, exact: Floats, half: float) -> bool:
    """Say whether exact values may be the limit of the levels, but for a rounding of up to `half`."""
    if levels.best is None:
        return False
    away = np.sqrt(np.mean((levels.best - exact) ** 2))
    return bool(away <= levels.best_bound + half)


def _with_finite(
    request: Request,
    h: Floats,
    values: Floats,
    epsilon: Floats,
    exact: Floats | None,
    pattern: Flags,
) -> list[Outcome]:
    """Return what was decided of members that have the same finite levels, and the same ones that are judged."""
    finite, (count, n, points) = np.flatnonzero(pattern[0]), values.shape
    judged = np.flatnonzero(pattern[1][finite])
    exact_known = exact is not None and len(finite) > 0
    found = [
        Outcome(np.full(n, np.nan), np.full(n, np.nan), points == 1, exact_known, finite)
        for _ in range(count)
    ]
    if not len(finite):
        return found
    part = values[:, finite]
    measured = measurement(part, h[finite], epsilon[finite], request.noise, exact)
    few, rest = measured, part[:, judged]
    if len(judged) < len(finite):
        few = measurement(rest, h[finite][judged], epsilon[finite][judged], request.noise, exact)
    decided = None
    if len(finite) >= LEVELS_OF_AN_ORDER:
        question = Question(request.order, request.at_least)
        if request.noise:
            question = question.with_stated_noise
        decided = assess(few.ladder, question)
        if not request.noise:
            half = np.array([request.halves(rows, finite[judged]) for rows in rest])
            _allow_for_rounding(decided, few, half, question)
    for k, one in enumerate(found):
        truth = None if exact is None else exact[k]
        _measure(one, measured, k, part[k], truth, request.noise or 0.0)
        if decided is not None:
            _decide(one, decided, k, few, part[k], judged, truth, request)
        if len(finite) < n:
            # levels that are not finite decide, whatever the others say; the error is that of the finest level
            one.reason = "non_finite"
        if finite[-1] < n - 1:
            one.error = one.error_bound = np.nan
    return found


def _allow_for_rounding(
    decided: Assessment, measured: Measurement, half: Floats, question: Question
) -> None:
    """Take back what was decided of values of few digits, if noise as large as their rounding decides otherwise.

    What is decided in both cases has an interval that holds both. `half` is half a unit of the last digit, of shape
    (member, n).
    """
    near = decided.error * measured.scale <= MOST_UNITS * half[:, -1]
    doubtful = is_one_of(decided.reason, *DECIDED) | (
        near & is_one_of(decided.reason, "wrong_limit")
    )
    rows = np.flatnonzero((half[:, -1] > 0.0) & doubtful)
    if not len(rows):
        return
    ladder = measured.ladder.some(rows)
    # of a rounding all values within half a unit are equally probable
    rounding = (half / math.sqrt(3.0) / measured.scale[:, None])[rows]
    ladder = replace(ladder, floor=np.maximum(ladder.floor, rounding))
    doubted = assess(ladder, question.with_stated_noise)
    same = doubted.reason == decided.reason[rows]
    decided.low[rows] = np.fmin(decided.low[rows], doubted.low)
    decided.high[rows] = np.fmax(decided.high[rows], doubted.high)
    for one in fields(Assessment):
        getattr(decided, one.name)[rows[~same]] = getattr(doubted, one.name)[~same]


def _measure(
    one: Outcome, measured: Measurement, k: int, part: Floats, truth: Floats | None, noise: float
) -> None:
    """Add what was measured of member `k`, whose finite levels are `part`, shape (finite, points)."""
    scale, rows = float(measured.scale[k]), len(part) - 1
    sizes = np.sqrt(np.diagonal(measured.ladder.gram[k]))[:rows]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        one.differences = part[:-1, 0] - part[1:, 0] if one.is_number else sizes * scale
    one.ratios = _ratios(measured, k)
    one.reason = "too_few_levels"
    one.values[one.finite] = part[:, 0] if one.is_number else measured.norms[k]
    one.size = float(measured.norms[k, -1])
    one.floor = max(float(measured.ladder.floor[k, -1]) * scale, noise)
    if truth is not None:
        one.errors[one.finite] = _distances(part, truth, one.is_number, scale)
        one.error = float(one.errors[one.finite[-1]])
        one.error_bound = abs(one.error) + one.floor


def _ratios(measured: Measurement, k: int) -> Floats:
    """Return the ratios of successive differences of member `k`, with their sign, shape (n - 2,)."""
    rows = len(measured.ladder.h) - 1
    products = measured.ladder.gram[k, :rows, :rows]
    sizes = np.sqrt(np.diagonal(products))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        return np.asarray(np.sign(np.diagonal(products, 1)) * sizes[:-1] / sizes[1:])


def _distances(part: Floats, limit: Floats, is_number: bool, scale: float) -> Floats:
    """Return the distances of all levels from a limit: with their sign of numbers, else root mean squares."""
    if is_number:
        with np.errstate(over="ignore"):
            return np.asarray(part[:, 0] - limit[0])
    return np.asarray(scale * np.sqrt(np.mean(((part - limit) / scale) ** 2, axis=1)))


def _decide(
    one: Outcome,
    decided: Assessment,
    k: int,
    measured: Measurement,
    every: Floats,
    judged: Integers,
    truth: Floats | None,
    request: Request,
) -> None:
    """Add what was decided of member `k`, whose finite levels are `every` and whose exact values are `truth`.

    The verdict rests on the levels at the places `judged`, of which `measured` is.
    """
    scale, part, places = float(measured.scale[k]), every[judged], one.finite[judged]
    one.reason = REASON_NAMES[int(decided.reason[k])]
    one.order, used, weights = _estimate(one, measured, decided, k)
    one.used = tuple(places[used].tolist())
    one.left_out = len(every) - len(part)
    one.low, one.high = float(decided.low[k]), float(decided.high[k])
    one.is_contradicted = bool(decided.contradicted[k])
    if np.isfinite(weights).all():
        # added up one by one, so that a member has the same digits alone and among others
        one.best = sum((w * row for w, row in zip(weights, part, strict=True)), 0.0 * part[0])
        added_up = ADDED_UP * SINGLE * measured.norms[k, -1] * measured.are_single[k]
        halves, step = request.halves(part, places), step_of_values(part)
        units = np.maximum(halves, float(added_up))
        # the last digits are steps, too, of a unit or some
        one.comes_in_steps = step > 10.0 * float(np.max(units))
        one.rounded = float(np.sum(np.maximum(units, step) * np.abs(weights)))
    if one.reason == "wrong_limit":
        # the floor is that of storing numbers, half a unit
        most = 0.0 if request.noise else 2.0 * MOST_ADDED_UP * measured.ladder.floor[k, -1]
        # what was printed as 10.5 was 10.46
        half = float(request.halves(part, places, of_binary=True)[-1])
        if abs(one.error) <= max(most * scale, half):
            one.reason = "round_off"
    bound_of_best = float(decided.best_bound[k]) * scale
    if one.reason == "wrong_limit" and one.rounded and one.best is not None and truth is not None:
        away = float(np.max(np.abs(_distances(one.best[None], truth, one.is_number, scale))))
        if away <= MISSED * bound_of_best + one.rounded:
            # the exact values, with so many digits, may be what was printed
            one.reason = "round_off"
    one.best_bound = bound_of_best + one.rounded
    if one.exact_known:
        return
    one.error, one.error_bound = (
        float(decided.error[k]) * scale,
        max(float(decided.error_bound[k]) * scale, request.noise or 0.0) + one.rounded,
    )
    if one.best is not None:
        one.errors[one.finite] = _distances(every, one.best, one.is_number, scale)
        if one.is_number and one.errors[one.finite[-1]] < 0.0:
            one.error = -one.error


def _estimate(
    one: Outcome, measured: Measurement, decided: Assessment, k: int
) -> tuple[float, slice, Floats]:
    """Return the order of member `k`, the places of its levels, and the weights of the extrapolation.

    Where no order may be believed, they are those of the finest three levels that have one. The verdict says that such
    an estimate is not to be trusted.
    """
    h, order, weights = measured.ladder.h, float(decided.order[k]), decided.weights[k]
    first, last = int(decided.first[k]), int(decided.last[k])
    if one.reason == "exact":
        return order, slice(first, last + 1), weights
    if not np.isfinite(order):
        orders = orders_of_steps(_ratios(measured, k), h)
        known = np.flatnonzero(np.isfinite(orders))
        if len(known):
            first = int(known[-1])
            order, last = float(orders[first]), first + 2
    if not np.isfinite(weights).all() and order >= LEAST_WITH_LIMIT:
        fine = last if last > 0 else len(h) - 1
        part = 1.0 / on_arrays.expm1(order * on_arrays.log(h[fine - 1] / h[fine]))
        weights = np.zeros(len(h))
        weights[[fine - 1, fine]] = -part, 1.0 + part
    return order, slice(first, last + 1), weights
