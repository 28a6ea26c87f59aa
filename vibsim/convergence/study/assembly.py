"""What was decided of a ladder as a verdict: numbers, words and the table of levels."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from vibsim.convergence.differences import orders_of_steps
from vibsim.convergence.study.common_points import CommonValues
from vibsim.convergence.study.measurement import rounding_of_sizes
from vibsim.convergence.study.outcomes import LEAST_RATIO, Outcome, Request
from vibsim.convergence.study.refinement import Refinement
from vibsim.convergence.study.sentences import Setting, describe
from vibsim.convergence.study.verdict import LadderVerdict, Level
from vibsim.convergence.thresholds import GCI_TRUSTED
from vibsim.core.array_types import Floats
from vibsim.core.vocabulary import LEVELS_OF_AN_ORDER, ORDER_TOLERANCE, REASONS
from vibsim.elementary import on_arrays

ROUNDING_SAID = 0.1
"""The rounding of printed digits is spoken of where it is so large a part of the bound of the error."""


def verdict(
    request: Request,
    steps: Refinement,
    common: CommonValues,
    one: Outcome,
    shown: tuple[Floats, tuple[str, ...]],
) -> LadderVerdict:
    """Put a verdict into numbers and words.

    `shown` are the compared values, shape (n, *points), and the names of their dimensions.
    """
    h, (values, dims) = steps.h, shown
    hidden = _hidden(request, common, one)
    reason = "not_applicable" if hidden else one.reason
    best = _known(float(one.best[0])) if one.best is not None and not dims else None
    size = one.size if one.size > 0.0 else np.nan
    found = LadderVerdict(
        quantity=request.quantity,
        status=REASONS[reason],
        reason=reason,
        order=_known(one.order),
        order_low=_known(one.low),
        order_high=_known(one.high),
        h_used=tuple(h[list(one.used)].tolist()),
        error=_known(one.error),
        error_bound=_known(one.error_bound),
        relative_error=_known(abs(one.error) / size),
        best=best,
        best_bound=_best_bound(one, best),
        gci=_known(_gci(one, h)),
        sentence="",
        advice="",
        levels=tuple(_table(one, h)),
        expected=request.order,
        at_least=request.at_least,
        size_name=steps.names[0],
        is_exact_known=one.exact_known,
        dims=dims,
        coords={dim: common.coords[dim] for dim in dims if dim in common.coords},
        values=values,
        best_values=None if one.best is None else one.best.reshape(values.shape[1:]),
    )
    setting = Setting(
        noise=request.noise or 0.0,
        sizes=steps.names,
        is_proportional=steps.is_proportional,
        interpolation=(common.kind, common.interpolation_order or 0) if hidden else None,
        is_contradicted=one.is_contradicted,
        are_sizes_rounded=_moved_by_sizes(one, h) > ORDER_TOLERANCE,
        notes=(*common.notes, *_interpolated_linearly(common, reason)),
        parts=(*common.parts, *_left_out(one), *_rounding(one)),
    )
    sentence, advice = describe(found, setting)
    return replace(found, sentence=sentence, advice=advice)


def _moved_by_sizes(one: Outcome, h: Floats) -> float:
    """Return how far the rounding of step sizes moves the order of the finest three levels at most; 0 without one."""
    if len(one.ratios) == 0 or not one.ratios[-1] > 0.0:
        return 0.0
    finest, ratio = h[one.finite[-3:]], one.ratios[-1:]
    halves = rounding_of_sizes(h)[one.finite[-3:]]
    changed = [orders_of_steps(ratio, finest + part)[0] for part in np.diag(halves)]
    moved = float(np.sum(np.abs(np.array(changed) - orders_of_steps(ratio, finest)[0])))
    return moved if np.isfinite(moved) else 0.0


def _known(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _hidden(request: Request, common: CommonValues, one: Outcome) -> bool:
    """Say whether an order may be that of the interpolation: one that is at or above it cannot be believed."""
    if common.interpolation_order is None or not np.isfinite(one.order):
        return False
    least = common.interpolation_order - ORDER_TOLERANCE
    if one.order < least or one.reason in ("exact", "non_finite"):
        return False
    # the error of the values falls at least as fast as that of values and interpolation together
    enough = request.at_least is not None and request.at_least <= least
    return not (enough and one.reason == "asymptotic")


def _interpolated_linearly(common: CommonValues, reason: str) -> tuple[str, ...]:
    """Say what may hide an order: the error of linear interpolation depends on where between two points it is made."""
    is_open = reason in ("pre_asymptotic", "oscillating", "round_off")
    if common.kind == "linear" and common.interpolation_order is not None and is_open:
        return ("The error of linear interpolation may hide the order. Use restrict: cubic.",)
    return ()


def _left_out(one: Outcome) -> tuple[str, ...]:
    """Say how many levels the verdict leaves out."""
    if not one.left_out:
        return ()
    some = f"{one.left_out} of {len(one.finite)} levels"
    return (
        f"The verdict leaves out {some}: their step sizes are closer than a factor of {LEAST_RATIO:g} to others.",
    )


def _rounding(one: Outcome) -> tuple[str, ...]:
    """Say what the digits of the exact values leave open, and that those of the values make a part of the bounds."""
    if one.agrees_to_digits:
        return (
            "The levels agree with all digits of the exact value, which are too few to tell the error.",
        )
    if not one.rounded > ROUNDING_SAID * one.error_bound or one.exact_known:
        return ()
    if one.comes_in_steps:
        return (
            "Levels with the same value show that values come in steps, which the bounds include.",
        )
    return ("The bounds include the rounding of the values to their last digit.",)


def _best_bound(one: Outcome, best: float | None) -> float | None:
    """Return how far the extrapolated number may be from the limit, or from the exact value where that is known."""
    if best is None:
        return None
    if one.exact_known:
        exact = one.values[one.finite[-1]] - one.error
        return _known(abs(best - exact) + one.floor)
    return _known(max(one.best_bound, one.floor))


def _gci(one: Outcome, h: Floats) -> float:
    """Return the grid convergence index of the finest level over its size; NaN where no order is observed.

    ``1.25 |u_n - u_(n-1)| / (|u_n| (r^p - 1))`` (Roache, J. Fluids Eng. 116, 1994).
    """
    if one.reason == "exact" and not np.any(one.differences):
        return 0.0
    if not one.order > 0.0 or len(one.finite) < LEVELS_OF_AN_ORDER or one.finite[-1] < len(h) - 1:
        return np.nan
    ratio = h[one.finite[-2]] / h[one.finite[-1]]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        relative = np.abs(one.differences[-1]) / np.float64(one.size)
        return float(GCI_TRUSTED * relative / on_arrays.expm1(one.order * on_arrays.log(ratio)))


def _table(one: Outcome, h: Floats) -> Iterator[Level]:
    """Yield the rows of the table of levels."""
    places = {int(position): k for k, position in enumerate(one.finite)}
    orders = orders_of_steps(one.ratios, h[one.finite])

    def at(entries: Floats, i: int) -> float | None:
        k = places.get(i)
        return None if k is None or k >= len(entries) else _known(entries[k])

    for i, size in enumerate(h.tolist()):
        yield Level(
            h=size,
            value=_known(one.values[i]),
            difference=at(one.differences, i),
            ratio=at(one.ratios, i),
            order=at(orders, i),
            error=_known(one.errors[i]),
        )
