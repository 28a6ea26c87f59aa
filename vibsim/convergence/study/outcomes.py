"""Measurements and decisions on the ladders of a study, before they are put into words."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields, replace
from decimal import Decimal

import numpy as np

from vibsim.convergence.assessment import DECIDED, Assessment, assess
from vibsim.convergence.differences import orders_of_steps
from vibsim.convergence.question import Question
from vibsim.convergence.reasons import is_one_of
from vibsim.convergence.study.measurement import (
    SINGLE,
    Measurement,
    are_binary,
    half_last_digits,
    measurement,
    step_of_values,
)
from vibsim.convergence.study.restriction import polynomials
from vibsim.convergence.thresholds import (
    ABOVE_ROUND_OFF,
    BLOWN_UP,
    LEAST_RATIO,
    LEAST_WITH_LIMIT,
    MISSED,
)
from vibsim.core.array_types import Flags, Floats, Integers
from vibsim.core.vocabulary import LEVELS_OF_AN_ORDER, REASON_NAMES
from vibsim.elementary import on_arrays

MOST_ROUNDED = 5e-4
"""Largest relative rounding of exact values: with more than three digits, half a unit of the last one is less."""
EXACT_DIGITS = 16
"""Exact values with at most this number of decimal digits may be rounded."""
MOST_UNITS = 8.0
"""Largest distance of exact values from the finest level, in half units of its last digit, that rounding explains."""
MOST_ADDED_UP, ADDED_UP = 100.0, 10.0
"""Largest and usual accumulated rounding error of a calculation, in units of the precision of the values [calibrated].

Bounds include the usual one. On 960 ladders of RK4 and Simpson's rule down to round-off 2 best values miss theirs
instead of 24, and a tenth of the bounds is more than 1.2 and 4 times as wide."""
SMOOTH = 0.05
"""Largest distance of a level from a smooth curve, relative to the differences of the levels [calibrated]."""
SEEN = 0.1
"""The rounding of exact values matters if it is at least this part of the error of the finest level."""


@dataclass(frozen=True)
class Request:
    """The question of a user about a ladder."""

    quantity: str
    order: float | None
    at_least: float | None
    noise: float | None
    half_of_exact: float | None = None
    """Half a unit of the last digit of the exact value as written; None if only its value is known."""
    written: tuple[Decimal, ...] | None = None
    """Numbers of all levels with their digits as written."""
    spacings: Floats | None = None
    """Distance of neighbouring values of each level that was packed into integers, else 0; None if none was."""

    def halves(self, values: Floats, places: Integers, *, of_binary: bool = False) -> Floats:
        """Return half a unit of the last digit of the levels at `places`, decimal or packed; see `half_last_digits`."""
        written = None if self.written is None else [self.written[i] for i in places]
        halves = half_last_digits(values, of_binary=of_binary, written=written)
        return halves if self.spacings is None else np.maximum(halves, 0.5 * self.spacings[places])


@dataclass
class Outcome:
    """The measurements and the decision of one member; NaN for unknown numbers and for levels that are not finite."""

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
    """Differences of successive finite levels, shape (finite - 1,): signed for numbers, else norms."""
    ratios: Floats = field(default_factory=lambda: np.empty(0))
    """Signed ratios of successive differences, shape (finite - 2,)."""
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
    is_growing: bool = False
    """Whether levels without an order differ far more at the finest step than before, so that they show no limit."""
    logarithm: float = np.nan
    """Power that a logarithm multiplies in the error; NaN if the levels do not show one."""
    left_out: int = 0
    """Number of finite levels that the verdict leaves out because their step sizes are close to those of others."""
    error: float = np.nan
    error_bound: float = np.nan
    best: Floats | None = None
    """Extrapolated values, shape (points,)."""
    best_bound: float = np.nan
    """Bound of the norm of their error."""
    agrees_to_digits: bool = False
    """Whether the exact values were ignored because they have too few digits to show the error of the levels."""
    rounded: float = 0.0
    """Error of the extrapolated values due to the rounding of the levels; part of the bounds."""
    half: float = 0.0
    """Half a unit of the last digit of the finest level; 0 if it was not rounded."""
    comes_in_steps: bool = False
    """Whether that error is due to values that come in steps."""


def outcomes(
    request: Request, h: Floats, values: Floats, epsilon: Floats, exact: Floats | None
) -> list[Outcome]:
    """Return the outcome of each member.

    Parameters
    ----------
    request
        The question about all members.
    h
        Step sizes, strictly decreasing, shape (n,).
    values
        Shape (member, n, points).
    epsilon
        Relative spacing of the precision of every level, shape (n,).
    exact
        Exact values, shape (member, points); None if unknown.
    """
    finite: Flags = np.asarray(np.isfinite(values).all(axis=2))
    patterns = np.stack([finite, _judged(h, values, finite)], axis=1)
    results: dict[int, Outcome] = {}
    for pattern in np.unique(patterns, axis=0):
        members = np.flatnonzero(np.all(patterns == pattern, axis=(1, 2)))
        truth = None if exact is None else exact[members]
        subset = _with_finite(request, h, values[members], epsilon, truth, pattern)
        results |= dict(zip(members.tolist(), subset, strict=True))
    if exact is not None:
        for i, outcome in results.items():
            half = _rounding_of_exact(outcome, exact[i], request.half_of_exact)
            if not half:
                continue
            (levels,) = _with_finite(request, h, values[i : i + 1], epsilon, None, patterns[i])
            is_better = outcome.reason == "wrong_limit" or levels.reason in (*DECIDED, "exact")
            if is_better and _agrees(levels, exact[i], half):
                levels.agrees_to_digits = True
                results[i] = levels
    return [results[i] for i in range(len(values))]


def _judged(h: Floats, values: Floats, finite: Flags) -> Flags:
    """Say which levels of each member the verdict rests on: finite ones, and of close ones only some.

    Close levels are left out only if they lie on a smooth curve; otherwise there is noise, and every level counts.
    """
    judged = finite.copy()
    for i, row in enumerate(finite):
        places = np.flatnonzero(row)
        chosen = spread_out(h[places])
        others = np.setdiff1d(np.arange(len(places)), chosen)
        if len(others) and _is_smooth(h[places], values[i, places], others):
            judged[i, places[others]] = False
    return judged


def _is_smooth(h: Floats, values: Floats, places: Integers) -> bool:
    """Say whether each level at `places` is close to the cubic through the four levels nearest to it.

    The tolerance is a small part of the differences of these four. The coarsest level is not tested. `values` have the
    shape (n, points).
    """
    scale = float(np.max(np.abs(values)))
    u = values / (scale if scale > 0.0 else 1.0)
    changes = np.sqrt(np.mean(np.diff(u, axis=0) ** 2, axis=1))
    for j in places[places > 0].tolist():
        others = np.delete(np.arange(len(h)), j)
        (weights,), (near,), _ = polynomials(h[[j]], h[others], min(4, len(others)), 0.0)
        around = others[near]
        distance = u[j] - np.sum(weights[:, None] * u[around], axis=0)
        tolerance = SMOOTH * np.mean(changes[np.min(around) : np.max(around)])
        if not np.sqrt(np.mean(distance**2)) <= tolerance:
            return False
    return True


def spread_out(h: Floats) -> Integers:
    """Return the positions of step sizes that are each at least `LEAST_RATIO` times the next finer one.

    There are at least three positions if there are three levels: both ends, and the level nearest to their middle.
    """
    chosen = [len(h) - 1]
    for i in range(len(h) - 2, -1, -1):
        if h[i] >= LEAST_RATIO * h[chosen[-1]]:
            chosen.append(i)
    if len(chosen) < LEVELS_OF_AN_ORDER <= len(h):
        sizes = on_arrays.log(h)
        middle = np.argmin(np.abs(sizes[1:-1] - 0.5 * (sizes[0] + sizes[-1])))
        chosen = [len(h) - 1, int(middle) + 1, 0]
    return np.array(chosen[::-1])


def _rounding_of_exact(outcome: Outcome, exact: Floats, half: float | None) -> float:
    """Return half a unit of the last digit of exact values if their rounding may explain the outcome; else 0."""
    if outcome.reason not in ("wrong_limit", "pre_asymptotic", "round_off", "oscillating"):
        return 0.0
    if half is None:
        half = float(half_last_digits(exact[None], EXACT_DIGITS)[0])
    at_most = MOST_ROUNDED * float(np.max(np.abs(exact)))
    return half if SEEN * abs(outcome.error) <= half <= at_most else 0.0


def _agrees(levels: Outcome, exact: Floats, half: float) -> bool:
    """Say whether exact values, with a rounding error of up to `half`, may be the limit of the levels."""
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
    """Return the outcomes of members with the same finite and the same judged levels (the rows of `pattern`)."""
    finite, (count, n, points) = np.flatnonzero(pattern[0]), values.shape
    judged = np.flatnonzero(pattern[1][finite])
    exact_known = exact is not None and len(finite) > 0
    results = [
        Outcome(np.full(n, np.nan), np.full(n, np.nan), points == 1, exact_known, finite)
        for _ in range(count)
    ]
    if not len(finite):
        return results
    finite_values = values[:, finite]
    measured = measurement(finite_values, h[finite], epsilon[finite], request.noise, exact)
    judged_measured, judged_values = measured, finite_values[:, judged]
    if len(judged) < len(finite):
        judged_measured = measurement(
            judged_values, h[finite][judged], epsilon[finite][judged], request.noise, exact
        )
    assessment = None
    if len(finite) >= LEVELS_OF_AN_ORDER:
        question = Question(request.order, request.at_least, is_noise_stated=bool(request.noise))
        assessment = assess(judged_measured.ladder, question)
        if not request.noise:
            half = np.array([request.halves(rows, finite[judged]) for rows in judged_values])
            _allow_for_rounding(assessment, judged_measured, half, question)
    for k, outcome in enumerate(results):
        truth = None if exact is None else exact[k]
        _measure(outcome, measured, k, finite_values[k], truth, request.noise or 0.0)
        if assessment is not None:
            _decide(
                outcome, assessment, k, judged_measured, finite_values[k], judged, truth, request
            )
        if len(finite) < n:
            # a level that is not finite decides, whatever the others show; the error is that of the finest level
            outcome.reason = "non_finite"
        if finite[-1] < n - 1:
            outcome.error = outcome.error_bound = np.nan
    return results


def _allow_for_rounding(
    assessment: Assessment, measured: Measurement, half: Floats, question: Question
) -> None:
    """Revise a decision on values with few digits if noise as large as their rounding leads to another one.

    Otherwise the interval of the order becomes the union of both. `half` is half a unit of the last digit, shape
    (member, n).
    """
    rows = np.flatnonzero(half[:, -1] > 0.0)
    if not len(rows):
        return
    ladder = measured.ladder.some(rows)
    # rounding errors are uniformly distributed within half a unit
    rounding = (half / math.sqrt(3.0) / measured.scale[:, None])[rows]
    ladder = replace(ladder, floor=np.maximum(ladder.floor, rounding))
    rounded = assess(ladder, replace(question, is_noise_stated=True))
    is_near = assessment.error * measured.scale <= MOST_UNITS * half[:, -1]
    is_doubtful = is_one_of(assessment.reason, *DECIDED) | (
        is_near & is_one_of(assessment.reason, "wrong_limit")
    )
    is_revised = is_doubtful[rows] & (rounded.reason != assessment.reason[rows])
    assessment.low[rows] = np.fmin(assessment.low[rows], rounded.low)
    assessment.high[rows] = np.fmax(assessment.high[rows], rounded.high)
    for entry in fields(Assessment):
        getattr(assessment, entry.name)[rows[is_revised]] = getattr(rounded, entry.name)[is_revised]


def _measure(
    outcome: Outcome,
    measured: Measurement,
    k: int,
    finite_values: Floats,
    truth: Floats | None,
    noise: float,
) -> None:
    """Add the measurements of member `k`, whose finite levels have `finite_values`, shape (finite, points)."""
    scale, rows = float(measured.scale[k]), len(finite_values) - 1
    sizes = np.sqrt(np.diagonal(measured.ladder.gram[k]))[:rows]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        outcome.differences = (
            finite_values[:-1, 0] - finite_values[1:, 0] if outcome.is_number else sizes * scale
        )
    outcome.ratios = _ratios(measured, k)
    outcome.reason = "too_few_levels"
    outcome.values[outcome.finite] = finite_values[:, 0] if outcome.is_number else measured.norms[k]
    outcome.size = float(measured.norms[k, -1])
    outcome.floor = max(float(measured.ladder.floor[k, -1]) * scale, noise)
    if truth is not None:
        outcome.errors[outcome.finite] = _distances(finite_values, truth, outcome.is_number, scale)
        outcome.error = float(outcome.errors[outcome.finite[-1]])
        outcome.error_bound = abs(outcome.error) + outcome.floor


def _ratios(measured: Measurement, k: int) -> Floats:
    """Return the signed ratios of successive differences of member `k`, shape (n - 2,)."""
    rows = len(measured.ladder.h) - 1
    products = measured.ladder.gram[k, :rows, :rows]
    sizes = np.sqrt(np.diagonal(products))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        return np.asarray(np.sign(np.diagonal(products, 1)) * sizes[:-1] / sizes[1:])


def _distances(part: Floats, limit: Floats, is_number: bool, scale: float) -> Floats:
    """Return the distances of all levels from a limit: signed for numbers, else root mean squares."""
    if is_number:
        with np.errstate(over="ignore"):
            return np.asarray(part[:, 0] - limit[0])
    return np.asarray(scale * np.sqrt(np.mean(((part - limit) / scale) ** 2, axis=1)))


def _decide(
    outcome: Outcome,
    assessment: Assessment,
    k: int,
    measured: Measurement,
    finite_values: Floats,
    judged: Integers,
    truth: Floats | None,
    request: Request,
) -> None:
    """Add the decision on member `k`.

    Parameters
    ----------
    measured
        The measurement of the judged levels.
    finite_values
        Values of the finite levels, shape (finite, points).
    judged
        Positions of the levels that the verdict rests on, among the finite ones.
    truth
        Exact values, shape (points,); None if unknown.
    """
    scale, judged_values, places = (
        float(measured.scale[k]),
        finite_values[judged],
        outcome.finite[judged],
    )
    outcome.reason = REASON_NAMES[int(assessment.reason[k])]
    outcome.order, used, weights = _estimate(outcome, measured, assessment, k)
    outcome.used = tuple(places[used].tolist())
    outcome.left_out = len(finite_values) - len(judged_values)
    outcome.low, outcome.high = float(assessment.low[k]), float(assessment.high[k])
    outcome.is_contradicted = bool(assessment.contradicted[k])
    outcome.is_growing = not outcome.order >= LEAST_WITH_LIMIT and _grow(outcome)
    outcome.logarithm = float(assessment.logarithm[k])
    halves = request.halves(judged_values, places)
    outcome.half = float(halves[-1])
    is_same = not np.any(np.diff(finite_values, axis=0))
    # they may have differed before they were rounded to few digits; a calculation that is exact but for rounding
    # leaves other last bits on each level, and one that does not use the step size the same
    shows_nothing = outcome.half > outcome.floor or (
        is_same and not np.all(are_binary(finite_values))
    )
    is_known = bool(request.noise) or abs(outcome.error) <= MOST_ADDED_UP * outcome.floor
    if outcome.reason == "exact" and shows_nothing and not is_known:
        outcome.reason = "round_off"
    if np.isfinite(weights).all():
        # summed one by one, so that a member has the same bits alone and among others
        outcome.best = sum(
            (w * row for w, row in zip(weights, judged_values, strict=True)), 0.0 * judged_values[0]
        )
        # levels that are the same to the last digit of double precision show no rounding that adds up
        may_add_up = measured.epsilon[k] >= SINGLE or not is_same
        added_up = ADDED_UP * measured.epsilon[k] * measured.norms[k, -1] * may_add_up
        step = step_of_values(judged_values)
        units = np.maximum(halves, added_up)
        # printed values differ by some units of their last digit: these are no steps
        outcome.comes_in_steps = step > 10.0 * float(np.max(units))
        outcome.rounded = float(np.sum(np.maximum(units, step) * np.abs(weights)))
    if outcome.reason == "wrong_limit":
        # the floor is the rounding of stored numbers, half a unit
        most = 0.0 if request.noise else 2.0 * MOST_ADDED_UP * measured.ladder.floor[k, -1]
        # 10.46 may have been printed as 10.5
        half = float(request.halves(judged_values, places, of_binary=True)[-1])
        if abs(outcome.error) <= max(most * scale, half):
            outcome.reason = "round_off"
    bound_of_best = float(assessment.best_bound[k]) * scale
    if (
        outcome.reason == "wrong_limit"
        and outcome.rounded
        and outcome.best is not None
        and truth is not None
    ):
        distance = float(
            np.max(np.abs(_distances(outcome.best[None], truth, outcome.is_number, scale)))
        )
        if distance <= MISSED * bound_of_best + outcome.rounded:
            # rounded to the digits of the levels, the exact values may agree
            outcome.reason = "round_off"
    outcome.best_bound = bound_of_best + outcome.rounded
    if outcome.exact_known:
        return
    if outcome.is_growing:
        outcome.best, outcome.best_bound = None, np.nan
        return
    outcome.error, outcome.error_bound = (
        float(assessment.error[k]) * scale,
        max(float(assessment.error_bound[k]) * scale, request.noise or 0.0) + outcome.rounded,
    )
    if outcome.best is not None:
        outcome.errors[outcome.finite] = _distances(
            finite_values, outcome.best, outcome.is_number, scale
        )
        if outcome.is_number and outcome.errors[outcome.finite[-1]] < 0.0:
            outcome.error = -outcome.error


def _grow(outcome: Outcome) -> bool:
    """Say whether an open ladder has a finest difference far above round-off and every other difference."""
    sizes = np.abs(outcome.differences)
    least = max(BLOWN_UP * float(np.max(sizes[:-1])), ABOVE_ROUND_OFF * outcome.floor)
    return outcome.reason in ("pre_asymptotic", "round_off") and bool(sizes[-1] > least)


def _estimate(
    outcome: Outcome, measured: Measurement, assessment: Assessment, k: int
) -> tuple[float, slice, Floats]:
    """Return the order of member `k`, the positions of its levels, and the weights of the extrapolation.

    If the assessment has no order, it is that of the finest three levels with one, which may be noise.
    """
    h, order, weights = measured.ladder.h, float(assessment.order[k]), assessment.weights[k]
    first, last = int(assessment.first[k]), int(assessment.last[k])
    if outcome.reason == "exact":
        return order, slice(first, last + 1), weights
    if not np.isfinite(order):
        orders = orders_of_steps(_ratios(measured, k), h)
        known = np.flatnonzero(np.isfinite(orders))
        if len(known):
            first = int(known[-1])
            order, last = float(orders[first]), first + 2
    if not np.isfinite(weights).all() and order >= LEAST_WITH_LIMIT:
        fine = last if last > 0 else len(h) - 1
        weight = 1.0 / on_arrays.expm1(order * on_arrays.log(h[fine - 1] / h[fine]))
        weights = np.zeros(len(h))
        weights[[fine - 1, fine]] = -weight, 1.0 + weight
    return order, slice(first, last + 1), weights
