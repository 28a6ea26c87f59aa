"""The verdict on a ladder from its outcome: numbers, words and the table of levels."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from vibsim.convergence.differences import orders_of_steps
from vibsim.convergence.extrapolation.thresholds import GCI_TRUSTED
from vibsim.convergence.study.common_points import CommonValues
from vibsim.convergence.study.measurement import rounding_of_sizes
from vibsim.convergence.study.outcomes import Outcome, Request
from vibsim.convergence.study.refinement import Refinement
from vibsim.convergence.study.sentences import BEYOND_ROUND_OFF, Setting, describe
from vibsim.convergence.study.verdict import LadderVerdict, Level
from vibsim.convergence.thresholds import ABOVE_ROUND_OFF, FLOOR_DECLINE, LEAST_RATIO
from vibsim.core.array_types import Floats
from vibsim.core.vocabulary import LEVELS_OF_AN_ORDER, ORDER_TOLERANCE, REASONS
from vibsim.elementary import on_arrays

NOISE_SEEN = 4.0
"""A difference of two levels above this multiple of their stated noise is hardly noise."""
ROUNDING_SAID = 0.1
"""A sentence mentions the rounding of printed digits if it is more than this part of the error bound."""


def verdict(
    request: Request,
    steps: Refinement,
    common: CommonValues,
    outcome: Outcome,
    compared: tuple[Floats, tuple[str, ...]],
) -> LadderVerdict:
    """Return the verdict of an outcome.

    `compared` holds the compared values, shape (n, *points), and the names of their dimensions.
    """
    h, (values, dims) = steps.h, compared
    hidden = _hidden(request, common, outcome)
    is_noise_seen = _is_noise_seen(request, outcome)
    reason = "not_applicable" if hidden else outcome.reason
    if reason == "pre_asymptotic" and is_noise_seen:
        reason = "round_off"
    best = _or_none(float(outcome.best[0])) if outcome.best is not None and not dims else None
    size = outcome.size if outcome.size > 0.0 else np.nan
    facts = LadderVerdict(
        quantity=request.quantity,
        status=REASONS[reason],
        reason=reason,
        order=_or_none(outcome.order),
        order_low=_or_none(outcome.low),
        order_high=_or_none(outcome.high),
        h_used=tuple(h[list(outcome.used)].tolist()),
        error=_or_none(outcome.error),
        error_bound=_or_none(outcome.error_bound),
        relative_error=_or_none(abs(outcome.error) / size),
        best=best,
        best_bound=_best_bound(outcome, best),
        gci=_or_none(_gci(outcome, h)),
        sentence="",
        advice="",
        levels=tuple(_table(outcome, h)),
        expected=request.order,
        at_least=request.at_least,
        size_name=steps.names[0],
        is_exact_known=outcome.exact_known,
        dims=dims,
        coords={dim: common.coords[dim] for dim in dims if dim in common.coords},
        values=values,
        best_values=None if outcome.best is None else outcome.best.reshape(values.shape[1:]),
    )
    setting = Setting(
        is_noise_stated=bool(request.noise),
        is_noise_seen=is_noise_seen,
        are_digits_few=not request.noise
        and outcome.half > 0.0
        and not _finest(outcome) > ABOVE_ROUND_OFF * outcome.half,
        sizes=steps.names,
        is_proportional=steps.is_proportional,
        interpolation=(common.kind, common.interpolation_order or 0) if hidden else None,
        is_contradicted=outcome.is_contradicted,
        is_growing=outcome.is_growing,
        logarithm=_or_none(outcome.logarithm),
        are_sizes_rounded=_order_shift(outcome, h) > ORDER_TOLERANCE,
        notes=(*common.notes, *_interpolated_linearly(common, reason)),
        parts=(*common.parts, *_left_out(outcome), *_rounding(outcome)),
    )
    sentence, advice = describe(facts, setting)
    return replace(facts, sentence=sentence, advice=advice)


def _finest(outcome: Outcome) -> float:
    """Return the size of the difference of the finest two levels; NaN if there are no two, or they are the same."""
    size = float(np.abs(outcome.differences[-1])) if len(outcome.differences) else 0.0
    return size if size > 0.0 else np.nan


def _is_noise_seen(request: Request, outcome: Outcome) -> bool:
    """Say whether the finest difference may be noise, stated or of rounding, so that a finer level would not help.

    Rounding makes differences near the precision of the values, or, added up, tiny ones that do not fall.
    """
    finest = _finest(outcome)
    if request.noise:
        return not finest > NOISE_SEEN * request.noise
    previous = float(np.abs(outcome.differences[-2:][0])) if len(outcome.differences) else np.nan
    is_tiny = finest <= BEYOND_ROUND_OFF * outcome.size
    return finest <= ABOVE_ROUND_OFF * outcome.floor or (
        is_tiny and finest > FLOOR_DECLINE * previous
    )


def _order_shift(outcome: Outcome, h: Floats) -> float:
    """Return the largest change of the order of the finest three levels due to rounded step sizes; 0 without order."""
    if len(outcome.ratios) == 0 or not outcome.ratios[-1] > 0.0:
        return 0.0
    finest, ratio = h[outcome.finite[-3:]], outcome.ratios[-1:]
    halves = rounding_of_sizes(h)[outcome.finite[-3:]]
    changed = [orders_of_steps(ratio, finest + change)[0] for change in np.diag(halves)]
    shift = float(np.sum(np.abs(np.array(changed) - orders_of_steps(ratio, finest)[0])))
    return shift if np.isfinite(shift) else 0.0


def _or_none(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _hidden(request: Request, common: CommonValues, outcome: Outcome) -> bool:
    """Say whether the interpolation may hide the order: only orders below that of the interpolation are reliable."""
    if common.interpolation_order is None or not np.isfinite(outcome.order):
        return False
    least = common.interpolation_order - ORDER_TOLERANCE
    if outcome.order < least or outcome.reason in ("exact", "non_finite"):
        return False
    # without the interpolation, the values converge at least as fast
    is_reached = request.at_least is not None and request.at_least <= least
    return not (is_reached and outcome.reason == "asymptotic")


def _interpolated_linearly(common: CommonValues, reason: str) -> tuple[str, ...]:
    """Warn of linear interpolation, whose error depends on the position between two points and may hide an order."""
    is_open = reason in ("pre_asymptotic", "oscillating", "round_off")
    if common.kind == "linear" and common.interpolation_order is not None and is_open:
        return ("The error of linear interpolation may hide the order. Use restrict: cubic.",)
    return ()


def _left_out(outcome: Outcome) -> tuple[str, ...]:
    """Say how many levels the verdict leaves out."""
    if not outcome.left_out:
        return ()
    levels = f"{outcome.left_out} of {len(outcome.finite)} levels"
    return (
        f"The verdict leaves out {levels}: their step sizes are closer than a factor of {LEAST_RATIO:g} to others.",
    )


def _rounding(outcome: Outcome) -> tuple[str, ...]:
    """Say that the digits of the exact values are too few, or that the bounds include the rounding of the values."""
    if outcome.agrees_to_digits:
        return (
            "The levels agree with all digits of the exact value, which are too few to tell the error.",
        )
    if not outcome.rounded > ROUNDING_SAID * outcome.error_bound or outcome.exact_known:
        return ()
    if outcome.comes_in_steps:
        return ("The bounds allow for values that come in steps.",)
    return ("The bounds include the rounding of the values to their last digit.",)


def _best_bound(outcome: Outcome, best: float | None) -> float | None:
    """Return a bound of the distance of the extrapolated number from the limit, or from the exact value if known."""
    if best is None:
        return None
    if outcome.exact_known:
        exact = outcome.values[outcome.finite[-1]] - outcome.error
        return _or_none(abs(best - exact) + outcome.floor)
    return _or_none(max(outcome.best_bound, outcome.floor))


def _gci(outcome: Outcome, h: Floats) -> float:
    """Return the grid convergence index of the finest level, relative to its size; NaN without an observed order.

    ``1.25 |u_n - u_(n-1)| / (|u_n| (r^p - 1))`` (Roache, J. Fluids Eng. 116, 1994).
    """
    if outcome.reason == "exact" and not np.any(outcome.differences):
        return 0.0
    if (
        not outcome.order > 0.0
        or len(outcome.finite) < LEVELS_OF_AN_ORDER
        or outcome.finite[-1] < len(h) - 1
    ):
        return np.nan
    ratio = h[outcome.finite[-2]] / h[outcome.finite[-1]]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        relative = np.abs(outcome.differences[-1]) / np.float64(outcome.size)
        return float(GCI_TRUSTED * relative / on_arrays.expm1(outcome.order * on_arrays.log(ratio)))


def _table(outcome: Outcome, h: Floats) -> Iterator[Level]:
    """Yield the rows of the table of levels."""
    index = {int(position): k for k, position in enumerate(outcome.finite)}
    orders = orders_of_steps(outcome.ratios, h[outcome.finite])

    def entry(entries: Floats, i: int) -> float | None:
        k = index.get(i)
        return None if k is None or k >= len(entries) else _or_none(entries[k])

    for i, size in enumerate(h.tolist()):
        yield Level(
            h=size,
            value=_or_none(outcome.values[i]),
            difference=entry(outcome.differences, i),
            ratio=entry(outcome.ratios, i),
            order=entry(orders, i),
            error=_or_none(outcome.errors[i]),
        )
