"""What is measured and decided of the ladders of a study, before it is put into words."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from vibsim.convergence.assessment import Assessment, assess
from vibsim.convergence.differences import order_of_differences
from vibsim.convergence.study.measurement import (
    Measurement,
    finite_levels,
    half_last_digit,
    measurement,
)
from vibsim.convergence.thresholds import MISSED, NOISE_FACTOR, STATED_NOISE_FACTOR
from vibsim.core.array_types import Flags, Floats, Integers
from vibsim.core.vocabulary import ORDER_TOLERANCE, REASON_NAMES

FEWEST = 3
"""Levels that show an order."""
MOST_ROUNDED = 5e-4
"""Levels that are all the same may be exact where half of their last digit is a larger part: of up to three digits."""


@dataclass(frozen=True)
class Question:
    """What is asked of a ladder."""

    quantity: str
    order: float | None
    at_least: float | None
    noise: float | None


@dataclass(frozen=True)
class Outcome:
    """What was measured and decided of one member; arrays over all levels have NaN where a level is not finite."""

    reason: str
    finite: Integers
    """Positions of the levels that are finite."""
    is_number: bool
    values: Floats
    """Numbers, or norms of the values, shape (n,)."""
    differences: Floats
    """Of successive finite levels, with their sign where they are numbers or of opposite shape, shape (finite - 1,)."""
    ratios: Floats
    """With their sign, shape (finite - 2,)."""
    errors: Floats
    """Shape (n,)."""
    size: float
    floor: float
    """Norm and noise of the finest level."""
    exact_known: bool
    order: float = np.nan
    low: float = np.nan
    high: float = np.nan
    used: tuple[int, ...] = ()
    """Positions of the levels that the order rests on."""
    error: float = np.nan
    error_bound: float = np.nan
    best: Floats | None = None
    """Extrapolated values, shape (points,)."""
    best_bound: float = np.nan
    """How far they are from the limit at most, in the norm."""
    rounded: float = 0.0
    """How far the extrapolated values are off because those of the levels have few digits; part of the bounds."""


def outcomes(
    question: Question, h: Floats, values: Floats, epsilon: Floats, exact: Floats | None
) -> list[Outcome]:
    """Return what was decided of each member.

    Parameters
    ----------
    question
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
    finite = finite_levels(values)
    found: dict[int, Outcome] = {}
    for pattern in np.unique(finite, axis=0):
        members = np.flatnonzero(np.all(finite == pattern, axis=1))
        truth = None if exact is None else exact[members]
        some = _with_finite(question, h, values[members], epsilon, truth, pattern)
        found |= dict(zip(members.tolist(), some, strict=True))
    return [found[i] for i in range(len(values))]


def _with_finite(
    question: Question,
    h: Floats,
    values: Floats,
    epsilon: Floats,
    exact: Floats | None,
    pattern: Flags,
) -> list[Outcome]:
    """Return what was decided of members that have the same finite levels."""
    finite, n = np.flatnonzero(pattern), len(h)
    if not len(finite):
        return [_nothing(n, is_number=values.shape[2] == 1)] * len(values)
    part = values[:, finite]
    measured = measurement(part, h[finite], epsilon[finite], question.noise, exact)
    decided = None
    if len(finite) >= FEWEST:
        decided = assess(
            measured.ladder,
            expected=question.order,
            at_least=question.at_least,
            tolerance=ORDER_TOLERANCE,
            noise_factor=STATED_NOISE_FACTOR if question.noise else NOISE_FACTOR,
        )
    found = []
    for k in range(len(values)):
        truth = None if exact is None else exact[k]
        one = _measured(measured, k, finite, part[k], truth, n)
        if decided is not None:
            one = _decided(one, decided, k, measured, part[k], truth)
        if len(finite) < n:
            # levels that are not finite decide, whatever the others say; the error is that of the finest level
            one = replace(one, reason="non_finite")
        if finite[-1] < n - 1:
            one = replace(one, error=np.nan, error_bound=np.nan)
        found.append(one)
    return found


def _nothing(n: int, *, is_number: bool) -> Outcome:
    """Return what is known of a member without a finite level."""
    levels, none = np.full(n, np.nan), np.empty(0)
    return Outcome(
        reason="non_finite",
        finite=np.empty(0, dtype=np.int64),
        is_number=is_number,
        values=levels,
        differences=none,
        ratios=none,
        errors=levels,
        size=np.nan,
        floor=np.nan,
        exact_known=False,
    )


def _measured(
    measured: Measurement, k: int, finite: Integers, part: Floats, truth: Floats | None, n: int
) -> Outcome:
    """Return what was measured of one member, whose finite levels are `part`, shape (finite, points)."""
    is_number = part.shape[1] == 1
    scale = float(measured.scale[k])
    products = measured.products[k]
    sizes = np.sqrt(np.diagonal(products))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        differences = part[:-1, 0] - part[1:, 0] if is_number else sizes * scale
        signs = np.sign(np.diagonal(products, 1))
        ratios = signs * sizes[:-1] / sizes[1:]
    values = np.full(n, np.nan)
    values[finite] = part[:, 0] if is_number else measured.norms[k]
    errors = np.full(n, np.nan)
    found = Outcome(
        reason="too_few_levels",
        finite=finite,
        is_number=is_number,
        values=values,
        differences=differences,
        ratios=ratios,
        errors=errors,
        size=float(measured.size[k]) * scale,
        floor=float(measured.ladder.floor[k, -1]) * scale,
        exact_known=truth is not None,
    )
    if truth is None:
        return found
    errors[finite] = _distances(part, truth, is_number, scale)
    error = float(errors[finite[-1]])
    return replace(found, error=error, error_bound=abs(error) + found.floor)


def _distances(part: Floats, limit: Floats, is_number: bool, scale: float) -> Floats:
    """Return the distances of all levels from a limit: with their sign of numbers, else root mean squares."""
    if is_number:
        with np.errstate(over="ignore"):
            return np.asarray(part[:, 0] - limit[0])
    return np.asarray(scale * np.sqrt(np.mean(((part - limit) / scale) ** 2, axis=1)))


def _decided(
    one: Outcome,
    decided: Assessment,
    k: int,
    measured: Measurement,
    part: Floats,
    truth: Floats | None,
) -> Outcome:
    """Add what was decided of member `k`, whose finite levels are `part` and whose exact values are `truth`."""
    scale = float(measured.scale[k])
    one = replace(one, reason=REASON_NAMES[int(decided.reason[k])])
    order, used, weights = _estimate(one, measured.ladder.h, decided, k)
    # added up one by one, so that a member has the same digits alone and among others
    best: Floats | None = None
    rounded = 0.0
    if np.isfinite(weights).all():
        best = sum((w * row for w, row in zip(weights, part, strict=True)), 0.0 * part[0])
        rounded = half_last_digit(part) * float(np.sum(np.abs(weights)))
    bound_of_best = float(decided.best_bound[k]) * scale
    if one.reason == "wrong_limit" and rounded and best is not None and truth is not None:
        away = float(np.max(np.abs(_distances(best[None], truth, one.is_number, scale))))
        if away <= MISSED * bound_of_best + rounded:
            # the exact values, with so many digits, may be what was printed
            one = replace(one, reason="round_off")
    if one.reason == "exact" and rounded > MOST_ROUNDED * one.size:
        rounded = 0.0
    error, bound, errors = one.error, one.error_bound, one.errors
    if not one.exact_known:
        error = float(decided.error[k]) * scale
        bound = float(decided.error_bound[k]) * scale + rounded
        if best is not None:
            errors = one.errors.copy()
            errors[one.finite] = _distances(part, best, one.is_number, scale)
            if one.is_number and errors[one.finite[-1]] < 0.0:
                error = -error
    return replace(
        one,
        order=order,
        low=float(decided.low[k]),
        high=float(decided.high[k]),
        used=tuple(one.finite[used].tolist()),
        error=error,
        error_bound=bound,
        errors=errors,
        best=best,
        best_bound=bound_of_best + rounded,
        rounded=rounded,
    )


def _estimate(one: Outcome, h: Floats, decided: Assessment, k: int) -> tuple[float, slice, Floats]:
    """Return the order of member `k`, the places of its levels, and the weights of the extrapolation.

    Where no order may be believed, they are those of the finest three levels that have one. The verdict says that such
    an estimate is not to be trusted.
    """
    order, weights = float(decided.order[k]), decided.weights[k]
    first, last = int(decided.first[k]), int(decided.last[k])
    if one.reason == "exact":
        return order, slice(first, last + 1), weights
    if not np.isfinite(order):
        for i in range(len(one.ratios) - 1, -1, -1):
            order = float(order_of_differences(one.ratios[i], h[i : i + 3]))
            if np.isfinite(order):
                first, last = i, i + 2
                break
    if not np.isfinite(weights).all() and order > 0.0:
        fine = last if last > 0 else len(h) - 1
        part = 1.0 / np.expm1(order * np.log(h[fine - 1] / h[fine]))
        weights = np.zeros(len(h))
        weights[[fine - 1, fine]] = -part, 1.0 + part
    return order, slice(first, last + 1), weights
