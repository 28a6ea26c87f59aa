"""Judge the results of any solver at several step sizes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from decimal import Decimal
from typing import Any, Literal, overload

import numpy as np

from vibsim.convergence.study.assembly import verdict
from vibsim.convergence.study.common_points import common_values, exact_values
from vibsim.convergence.study.grid_values import GridValues, grid_values
from vibsim.convergence.study.measurement import half_written
from vibsim.convergence.study.outcomes import Request, outcomes
from vibsim.convergence.study.refinement import refinement
from vibsim.convergence.study.refusal import chosen, finite_number, refused
from vibsim.convergence.study.verdict import LadderVerdict
from vibsim.core.vocabulary import RESTRICTIONS

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
    dims: Sequence[str | int] | None = None,
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
    dims: Sequence[str | int] | None = None,
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
    dims: Sequence[str | int] | None = None,
    members: bool = False,
) -> LadderVerdict | list[LadderVerdict]:
    """Judge whether results at several step sizes converge, with which order, and how large their error is.

    Parameters
    ----------
    h
        Step size of each level, in any order: positive, all different, in any ratio. If several sizes are refined
        together, a mapping from names to such lists. The order then refers to the first one. The others need not be
        proportional to it, but must decrease with it.
    values
        The result of each level, in the order of `h`: numbers, numpy arrays of any dimension, or xarray objects.
        Numbers may be `decimal.Decimal`, whose zeros at the end count as digits.
    order, at_least
        The expected order, or the lowest expected one. Without either, any order passes that is certain enough.
    exact
        The exact result, if it is known: a number, or a `decimal.Decimal` of the digits as they are written; an array
        or xarray object at the compared points; or a function of the coordinates. If its parameters have the names of
        the dimensions, they may come in any order; otherwise it gets the coordinates in the order of the dimensions.
        It is averaged along the dimensions whose cells are.
    noise
        Root mean square of the noise of each level (from an iteration that stops early, or from printed digits).
        Without it the levels are assumed to be exact up to rounding.
    restrict
        How levels are brought to common points. ``subset`` takes the points that all levels have: by their coordinates
        (xarray), or by their number, of n, 2n - 1, 3n - 2, ... points from end to end or n, 2n, 3n, ... points of a
        periodic grid. ``mean`` takes averages over the cells of the coarsest level. ``linear`` and ``cubic``
        interpolate with an error of order 2 or 4, so orders from there on cannot be shown.
    dims
        Names of the refined dimensions (of numpy arrays their numbers, from 0), all by default. The others must be the
        same on each level.
    members
        Whether the first dimension of each result counts members, each with its own verdict.

    Returns
    -------
    LadderVerdict or list of LadderVerdict
        The verdict; with `members` one for each.

    Raises
    ------
    InputError
        If arguments do not fit together; the message names the argument, its value and the rule.

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

    A first-order rule fails:

    >>> def left(n):
    ...     return float(np.mean(np.exp(np.arange(n) / n)))
    >>> verdict = judge([1 / n for n in counts], [left(n) for n in counts], order=2)
    >>> verdict.status, verdict.reason
    ('FAIL', 'order_low')

    Series and fields are compared at their common points. Euler's method for u' = -u:

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
    dims: Sequence[str | int] | None = None,
    members: bool = False,
) -> list[LadderVerdict]:
    """Return the verdict on each member, or on the only ladder; `quantity` is its name in sentences. See `judge`."""
    if order is not None and at_least is not None:
        raise refused("order", order, "must not be given together with at_least")
    order = None if order is None else finite_number("order", order, above=0.0)
    at_least = None if at_least is None else finite_number("at_least", at_least, above=0.0)
    noise = None if noise is None else finite_number("noise", noise, least=0.0)
    kind = chosen("restrict", restrict, RESTRICTIONS)
    levels = _levels(values, members)
    steps = refinement(h, len(levels))
    levels = [levels[i] for i in steps.positions]
    if isinstance(dims, str | int):
        dims = [dims]
    names = None if dims is None else [d if isinstance(d, str) else f"axis {d}" for d in dims]
    fixed = levels[0].dims[:1] if members else ()
    common = common_values(levels, kind, names, fixed)
    half = half_written(exact) if isinstance(exact, Decimal) else None
    written = tuple(level.written for level in levels if level.written is not None)
    spacings = np.array([level.spacing for level in levels])
    request = Request(
        quantity or levels[0].name or "u",
        order,
        at_least,
        noise,
        half,
        written if len(written) == len(levels) else None,
        spacings if spacings.any() else None,
    )
    exact_array = None if exact is None else exact_values(exact, common, members=members)
    shape, n = common.values.shape[1:], len(steps.h)
    count, points = (shape[0], shape[1:]) if members else (1, shape)
    ladders = np.swapaxes(common.values.reshape(n, count, -1), 0, 1)
    limits = None if exact_array is None else exact_array.reshape(count, -1)
    point_dims = common.dims[1:] if members else common.dims
    # numbers near the limits of double precision: results that overflow are not stated
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        results = outcomes(request, steps.h, ladders, common.epsilon, limits)
        return [
            verdict(request, steps, common, outcome, (ladder.reshape(n, *points), point_dims))
            for outcome, ladder in zip(results, ladders, strict=True)
        ]


def _levels(values: Any, members: bool) -> list[GridValues]:
    """Return the values of each level."""
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
