"""Judge the results of any solver at several step sizes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, overload

import numpy as np

from vibsim.convergence.assessment import Assessment, assess
from vibsim.convergence.step_orders import order_of_ratio
from vibsim.convergence.study.common_points import CommonValues, common_values, exact_values
from vibsim.convergence.study.grid_values import GridValues, grid_values
from vibsim.convergence.study.measurement import Measurement, finite_levels, measurement
from vibsim.convergence.study.refinement import Refinement, refinement
from vibsim.convergence.study.refusal import chosen, number, refused
from vibsim.convergence.study.restriction import RESTRICTIONS
from vibsim.convergence.study.sentences import Facts, describe
from vibsim.convergence.study.verdict import LadderVerdict
from vibsim.convergence.study.verdict_data import Level
from vibsim.core.array_types import Floats, Integers
from vibsim.core.vocabulary import ORDER_TOLERANCE, REASON_NAMES, REASONS

FEWEST = 3
"""Levels that show an order."""
GCI_FACTOR = 1.25
"""Safety factor of the grid convergence index of three levels and more."""
Sizes = Sequence[float] | Mapping[str, Sequence[float]]
Exact = Any | Callable[..., Any]


@overload
def judge(
    h: Sizes,
    values: Sequence[Any],
    *,
    order: float | None = None,
    at_least: float | None = None,
    exact: Exact | None = None,
    noise: float | None = None,
    restrict: str = "subset",
    dims: Sequence[str] | None = None,
    members: Literal[False] = False,
) -> LadderVerdict: ...


@overload
def judge(
    h: Sizes,
    values: Sequence[Any],
    *,
    order: float | None = None,
    at_least: float | None = None,
    exact: Exact | None = None,
    noise: float | None = None,
    restrict: str = "subset",
    dims: Sequence[str] | None = None,
    members: Literal[True],
) -> list[LadderVerdict]: ...


def judge(
    h: Sizes,
    values: Sequence[Any],
    *,
    order: float | None = None,
    at_least: float | None = None,
    exact: Exact | None = None,
    noise: float | None = None,
    restrict: str = "subset",
    dims: Sequence[str] | None = None,
    members: bool = False,
) -> LadderVerdict | list[LadderVerdict]:
    """Judge whether results at several step sizes converge, with which order, and how large their error is.

    Parameters
    ----------
    h
        Step size of every level, in any order: positive, all different, in any ratio. Where several sizes are refined
        together, a mapping from names to such lists. The order then counts powers of the first one. The others need
        not be proportional to it, but must decrease with it.
    values
        The result of every level, in the order of `h`: numbers, numpy arrays of any dimension, or xarray objects.
    order, at_least
        The order that is expected, or the lowest one that is. Without both any order passes that may be believed.
    exact
        The exact result, if it is known: a number; an array or xarray object at the points that are compared; or a
        function of the coordinates, in the order of the dimensions.
    noise
        How noisy each level is (an iteration that stops early, printed digits): the root mean square of the noise.
        Without it the levels are taken to be exact up to rounding.
    restrict
        How levels are brought to common points. ``subset`` takes the points that all levels have: by their coordinates
        (xarray), or by their number, of n, 2n - 1, 3n - 2, ... points from end to end or n, 2n, 3n, ... points of a
        periodic grid. ``mean`` takes averages over the cells of the coarsest level. ``linear`` and ``cubic``
        interpolate, with an error of order 2 or 4, so that no order from there on is believed.
    dims
        Names of the dimensions that are refined (``"axis 0"``, ``"axis 1"`` of numpy arrays). The others must be the
        same on every level. Without it all are compared.
    members
        Whether the first dimension of each result counts members, each a ladder of its own.

    Returns
    -------
    LadderVerdict or list of LadderVerdict
        The verdict; with `members` one for each.

    Raises
    ------
    InputError
        For arguments that do not fit together; the message names the argument, its value and the rule.

    Examples
    --------
    The midpoint rule for the integral of exp(x) from 0 to 1, with 10, 20, 40 and 80 intervals:

    >>> import numpy as np
    >>> from vibsim import judge
    >>> def midpoint(n):
    ...     return float(np.mean(np.exp((np.arange(n) + 0.5) / n)))
    >>> counts = [10, 20, 40, 80]
    >>> verdict = judge([1 / n for n in counts], [midpoint(n) for n in counts], order=2)
    >>> verdict.status, verdict.reason
    ('PASS', 'asymptotic')
    >>> round(verdict.order, 2)
    2.0
    >>> abs(verdict.best - (np.e - 1)) < 1e-6
    True

    The error of the finest level is known without the exact value, here to two digits:

    >>> f"{verdict.error:.1e}", f"{midpoint(80) - (np.e - 1):.1e}"
    ('-1.1e-05', '-1.1e-05')

    A rule of first order is told apart from it:

    >>> def left(n):
    ...     return float(np.mean(np.exp(np.arange(n) / n)))
    >>> verdict = judge([1 / n for n in counts], [left(n) for n in counts], order=2)
    >>> verdict.status, verdict.reason
    ('FAIL', 'order_low')

    Series and fields are compared at the points that all levels have. Euler's method for u' = -u:

    >>> def euler(n):
    ...     return (1 - 1 / n) ** np.arange(n + 1)
    >>> verdict = judge([1 / n for n in counts], [euler(n) for n in counts], at_least=1)
    >>> verdict.status, round(verdict.order, 1)
    ('PASS', 1.0)

    With coordinates the exact solution may be a function of them:

    >>> import xarray
    >>> def series(n):
    ...     return xarray.DataArray(euler(n), {"t": np.linspace(0, 1, n + 1)}, ["t"], name="u")
    >>> levels = [series(n) for n in counts]
    >>> verdict = judge([1 / n for n in counts], levels, order=1, exact=lambda t: np.exp(-t))
    >>> verdict.quantity, verdict.status, f"{verdict.error:.1e}"
    ('u', 'PASS', '1.8e-03')

    Faulty arguments are refused:

    >>> judge([0.1, 0.05, 0.05], [1.0, 2.0, 3.0])
    Traceback (most recent call last):
    ...
    vibsim.core.errors.InputError: judge: h[2]: 0.05: is the step size of level 1, too; all must differ
    """
    found = verdicts(
        h,
        values,
        order=order,
        at_least=at_least,
        exact=exact,
        noise=noise,
        restrict=restrict,
        dims=dims,
        members=members,
    )
    return found if members else found[0]


@dataclass(frozen=True)
class _Question:
    """What is asked of a ladder."""

    quantity: str
    order: float | None
    at_least: float | None
    noise: float | None


def verdicts(
    h: Sizes,
    values: Sequence[Any],
    *,
    quantity: str | None = None,
    order: float | None = None,
    at_least: float | None = None,
    exact: Exact | None = None,
    noise: float | None = None,
    restrict: str = "subset",
    dims: Sequence[str] | None = None,
    members: bool = False,
) -> list[LadderVerdict]:
    """Return the verdict on each member, or on the one ladder; `quantity` is its name in words, the rest as `judge`."""
    if order is not None and at_least is not None:
        raise refused("order", order, "must not be given together with at_least")
    order = None if order is None else number("order", order, above=0.0)
    at_least = None if at_least is None else number("at_least", at_least, above=0.0)
    noise = None if noise is None else number("noise", noise, least=0.0)
    kind = chosen("restrict", restrict, RESTRICTIONS)
    levels = _levels(values, members)
    steps = refinement(h, len(levels))
    levels = [levels[i] for i in steps.positions]
    if isinstance(dims, str):
        dims = [dims]
    fixed = levels[0].dims[:1] if members else ()
    common = common_values(levels, kind, dims, fixed)
    truth = None if exact is None else exact_values(exact, common, members=members)
    question = _Question(quantity or levels[0].name or "u", order, at_least, noise)
    return list(_each(question, steps, common, truth, members))


def _levels(values: Any, members: bool) -> list[GridValues]:
    """Return the values of every level."""
    if isinstance(values, str | Mapping):
        raise refused(
            "values", type(values).__name__, "must be a list with the result of every level"
        )
    try:
        entries = list(values)
    except TypeError:
        rule = "must be a list with the result of every level"
        raise refused("values", type(values).__name__, rule) from None
    if not entries:
        raise refused("values", "[]", "must hold at least one level")
    levels = [grid_values(entry, f"values[{i}]") for i, entry in enumerate(entries)]
    if members and not levels[0].dims:
        raise refused("members", "True", "needs values with a first dimension that counts members")
    return levels


def _each(
    question: _Question,
    steps: Refinement,
    common: CommonValues,
    truth: Floats | None,
    members: bool,
) -> Iterator[LadderVerdict]:
    """Yield the verdict on every member."""
    n = len(steps.h)
    shape = common.values.shape[1:]
    inner = shape[1:] if members else shape
    count = shape[0] if members else 1
    values = np.swapaxes(common.values.reshape(n, count, -1), 0, 1)
    exact = None if truth is None else truth.reshape(count, -1)
    finite = finite_levels(values)
    outcomes: dict[int, _Outcome] = {}
    for pattern in np.unique(finite, axis=0):
        chosen_members = np.flatnonzero(np.all(finite == pattern, axis=1))
        outcomes |= _outcomes(question, steps, common, values, exact, pattern, chosen_members)
    dims = common.dims[1:] if members else common.dims
    for i in range(count):
        yield _verdict(question, steps, common, outcomes[i], (values[i].reshape(n, *inner), dims))


@dataclass(frozen=True)
class _Outcome:
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
    used: tuple[int, int] | None = None
    error: float = np.nan
    error_bound: float = np.nan
    best: Floats | None = None
    """Extrapolated values, shape (points,)."""


def _outcomes(
    question: _Question,
    steps: Refinement,
    common: CommonValues,
    values: Floats,
    exact: Floats | None,
    pattern: Floats,
    chosen_members: Integers,
) -> dict[int, _Outcome]:
    """Return what was decided of members whose finite levels are the same."""
    finite = np.flatnonzero(pattern)
    shown = values[chosen_members]
    part = shown[:, finite]
    truth = None if exact is None else exact[chosen_members]
    if not len(finite):
        nothing = np.full(values.shape[1], np.nan)
        empty = np.empty(0)
        broken = _Outcome(
            "non_finite",
            finite,
            values.shape[2] == 1,
            nothing,
            empty,
            empty,
            nothing,
            np.nan,
            np.nan,
            False,
        )
        return {int(i): broken for i in chosen_members}
    h = steps.h[finite]
    measured = measurement(part, h, common.epsilon[finite], question.noise, truth)
    decided = None
    if len(finite) >= FEWEST:
        decided = assess(
            measured.ladder,
            expected=question.order,
            at_least=question.at_least,
            tolerance=ORDER_TOLERANCE,
        )
    is_whole = len(finite) == values.shape[1]
    found = {}
    for k, i in enumerate(chosen_members.tolist()):
        one = _measured(
            measured, k, finite, part[k], None if truth is None else truth[k], values.shape[1]
        )
        if decided is not None:
            one = _decided(one, decided, k, measured, part[k])
        if not is_whole:
            # levels that are not finite decide, whatever the others say; the error is that of the finest level
            one = replace(one, reason="non_finite")
            if finite[-1] < values.shape[1] - 1:
                one = replace(one, error=np.nan, error_bound=np.nan)
        found[i] = one
    return found


def _measured(
    measured: Measurement, k: int, finite: Integers, part: Floats, truth: Floats | None, n: int
) -> _Outcome:
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
    found = _Outcome(
        reason="too_few_levels",
        finite=finite,
        is_number=is_number,
        values=values,
        differences=differences,
        ratios=ratios,
        errors=errors,
        size=float(measured.ladder.size[k]) * scale,
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
        return np.asarray(part[:, 0] - limit[0])
    return np.asarray(scale * np.sqrt(np.mean(((part - limit) / scale) ** 2, axis=1)))


def _decided(
    one: _Outcome, decided: Assessment, k: int, measured: Measurement, part: Floats
) -> _Outcome:
    """Add what was decided of member `k`."""
    scale = float(measured.scale[k])
    weights = decided.weights[k]
    # added up one by one, so that a member has the same digits alone and among others
    best = (
        None
        if np.isnan(weights).any()
        else sum(w * row for w, row in zip(weights, part, strict=True))
    )
    used = int(one.finite[int(decided.first[k])]), int(one.finite[int(decided.last[k])])
    order = float(decided.order[k])
    error, bound, errors = one.error, one.error_bound, one.errors
    if not one.exact_known:
        error, bound = float(decided.error[k]) * scale, float(decided.error_bound[k]) * scale
        if best is not None:
            errors = one.errors.copy()
            errors[one.finite] = _distances(part, best, one.is_number, scale)
            if one.is_number and errors[one.finite[-1]] < 0.0:
                error = -error
    return replace(
        one,
        reason=REASON_NAMES[int(decided.reason[k])],
        order=order,
        low=float(decided.low[k]),
        high=float(decided.high[k]),
        used=used,
        error=error,
        error_bound=bound,
        errors=errors,
        best=best,
    )


def _verdict(
    question: _Question,
    steps: Refinement,
    common: CommonValues,
    one: _Outcome,
    shown: tuple[Floats, tuple[str, ...]],
) -> LadderVerdict:
    """Put a verdict into numbers and words."""
    h, (values, dims) = steps.h, shown
    hidden = _hidden(question, common, one)
    reason = "not_applicable" if hidden else one.reason
    status = REASONS[reason]
    is_exact = reason == "exact"
    best = float(one.best[0]) if one.best is not None and not dims else None
    best_bound = _best_bound(one, best)
    size = one.size if one.size > 0.0 else np.nan
    relative = abs(one.error) / size
    used = () if one.used is None else tuple(h[one.used[0] : one.used[1] + 1].tolist())
    broken = tuple(h[np.isnan(one.values)].tolist())
    facts = Facts(
        quantity=question.quantity,
        status=status,
        reason=reason,
        h=tuple(h.tolist()),
        order=_known(one.order),
        low=_known(one.low),
        high=_known(one.high),
        expected=question.order,
        at_least=question.at_least,
        error=_known(one.error),
        error_bound=_known(one.error_bound),
        relative_error=_known(relative),
        best=best,
        best_bound=best_bound,
        is_exact_known=one.exact_known,
        is_number=one.is_number,
        has_noise=bool(question.noise),
        not_finite=broken,
        sizes=steps.names,
        is_proportional=steps.is_proportional,
        interpolation=(common.kind, common.interpolation_order or 0) if hidden else None,
        notes=common.notes,
    )
    sentence, advice = describe(facts)
    return LadderVerdict(
        quantity=question.quantity,
        status=status,
        reason=reason,
        order=facts.order,
        order_low=facts.low,
        order_high=facts.high,
        h_used=used,
        error=facts.error,
        error_bound=facts.error_bound,
        relative_error=facts.relative_error,
        best=best,
        best_bound=best_bound,
        gci=0.0 if is_exact and not np.any(one.differences) else _known(_gci(one, h)),
        sentence=sentence,
        advice=advice,
        levels=tuple(_table(one, h)),
        expected=question.order,
        at_least=question.at_least,
        size_name=steps.names[0],
        is_exact_known=one.exact_known,
        dims=dims,
        coords={dim: common.coords[dim] for dim in dims if dim in common.coords},
        values=values,
        best_values=None if one.best is None else one.best.reshape(values.shape[1:]),
    )


def _known(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _hidden(question: _Question, common: CommonValues, one: _Outcome) -> bool:
    """Say whether an order may be that of the interpolation: one that is at or above it cannot be believed."""
    if common.interpolation_order is None or not np.isfinite(one.order):
        return False
    least = common.interpolation_order - ORDER_TOLERANCE
    if one.order < least or one.reason in ("exact", "non_finite"):
        return False
    # the error of the values falls at least as fast as that of values and interpolation together
    enough = question.at_least is not None and question.at_least <= least
    return not (enough and one.reason == "asymptotic")


def _best_bound(one: _Outcome, best: float | None) -> float | None:
    """Return how far the extrapolated number may be from the limit: what the bound of the error leaves beside it."""
    if best is None:
        return None
    finest = one.values[one.finite[-1]]
    if one.exact_known:
        # the bound of the error is then that of a known error, and says nothing of the extrapolation
        return _known(abs(best - (finest - one.error)) + one.floor)
    return _known(max(one.error_bound - abs(finest - best), one.floor))


def _gci(one: _Outcome, h: Floats) -> float:
    """Return the grid convergence index of the finest level over its size; NaN where no order is observed.

    ``1.25 |u_n - u_(n-1)| / (|u_n| (r^p - 1))`` (Roache, J. Fluids Eng. 116, 1994).
    """
    if not one.order > 0.0 or len(one.finite) < FEWEST or one.finite[-1] < len(h) - 1:
        return np.nan
    ratio = h[one.finite[-2]] / h[one.finite[-1]]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        relative = np.abs(one.differences[-1]) / np.float64(one.size)
        return float(GCI_FACTOR * relative / np.expm1(one.order * np.log(ratio)))


def _table(one: _Outcome, h: Floats) -> Iterator[Level]:
    """Yield the rows of the table of levels."""
    places = {int(position): k for k, position in enumerate(one.finite)}
    steps = h[one.finite]
    ratios = enumerate(one.ratios)
    orders = np.array([float(order_of_ratio(r, steps[k : k + 3])) for k, r in ratios])

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
