"""The values of a sweep for any range of members, in time and memory proportional to the range.

Values are computed with float ``+ - * /``, or with integer and decimal arithmetic, so they are the same on every
machine, and member i does not depend on the range. Sample points (random, Sobol, Latin hypercube) follow from their
seed.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from decimal import Context, Decimal
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vibsim.core.array_types import Flags, Floats, Integers
from vibsim.experiment.schema.sweep import Axis, Draw, Linspace, Logspace, Values, as_option

if TYPE_CHECKING:
    from vibsim.core.record import Record
    from vibsim.experiment.data import ExperimentSpec
    from vibsim.schemes import Options, Scheme

Column = NDArray[Any]  # values of one key, float64 or text
Columns = Mapping[str, Column]  # values of all members by dotted key, each of shape (case,)
SAME, EPS = 1e-9, 1e-14
"""Tolerances for finding a swept value: relative to the value, and relative to the largest value of the sweep."""
_PER_COUNT = 4  # number of outputs of Philox per counter value
_DIGITS = 60  # precision of intermediate decimals, enough to round any power to the nearest double


def columns(experiment: ExperimentSpec, start: int, stop: int) -> dict[str, Column]:
    """Return the swept values of members start..stop-1 by dotted key, each of shape (stop - start,).

    Values are float64 in the unit of the key, or text for options of schemes. The result is empty without a sweep.
    """
    return grid_columns(experiment.sweep.axes, start, stop) if experiment.sweep else {}


def recorded_columns(record: Record) -> Columns:
    """Return the swept values of all members of a Record, which holds them as coordinates, by dotted key."""
    return {
        str(variable.attrs["sweep_key"]): variable.values
        for variable in record.coords.values()
        if "sweep_key" in variable.attrs
    }


def option_groups(
    experiment: ExperimentSpec, scheme: int, columns: Columns
) -> list[tuple[Mapping[str, str | float | bool], Integers]]:
    """Return the distinct option sets of scheme number `scheme`, each with the positions of its members.

    `columns` holds the swept values of the members. Option sets are in the order of first occurrence, and positions in
    `columns` are increasing. Words are str, numbers float and flags bool. Without a sweep there is one set.
    """
    base = experiment.schemes[scheme].options
    size = len(next(iter(columns.values()))) if columns else 1
    prefix = f"schemes.{experiment.schemes[scheme].name}."
    swept = {name: columns[key] for name in base if (key := prefix + name) in columns}
    if not swept:
        return [(base, np.arange(size))]
    kind = np.zeros(size, dtype=np.int64)
    for column in swept.values():
        distinct, place = np.unique(column, return_inverse=True)
        # renumbered after each key, to keep the numbers small
        kind = np.unique(kind * len(distinct) + place, return_inverse=True)[1]
    order = np.argsort(kind, kind="stable")
    members = np.split(order, np.flatnonzero(np.diff(kind[order])) + 1)
    return [
        ({**base, **{n: as_option(base[n], c[where[0]]) for n, c in swept.items()}}, where)
        for where in sorted(members, key=lambda where: int(where[0]))
    ]


def options_of(experiment: ExperimentSpec, columns: Columns, scheme: int, case: int) -> Options:
    """Return the options of scheme number `scheme` for member number `case`."""
    single = {key: values[case : case + 1] for key, values in columns.items()}
    return option_groups(experiment, scheme, single)[0][0]


def by_options(
    experiment: ExperimentSpec, columns: Columns, function: Callable[[Scheme, Options], ArrayLike]
) -> Floats:
    """Return `function` for every scheme and for the options of each member, shape (scheme, 1 or case, ...)."""
    rows = []
    for i, scheme in enumerate(experiment.schemes):
        groups = option_groups(experiment, i, columns)
        values = [np.asarray(function(scheme.method, o), dtype=float) for o, _ in groups]
        count = sum(len(cases) for _, cases in groups) if len(groups) > 1 else 1
        row = np.empty((count, *values[0].shape))
        for value, (_, cases) in zip(values, groups, strict=True):
            row[cases if count > 1 else slice(None)] = value
        rows.append(row)
    return np.stack(np.broadcast_arrays(*rows))


def grid_columns(axes: Sequence[Axis], start: int, stop: int) -> dict[str, Column]:
    """Return the values of members start..stop-1 of a grid by dotted key; the last axis varies fastest."""
    columns_: dict[str, Column] = {}
    member = np.arange(start, stop, dtype=np.int64)
    inner = math.prod(axis.count for axis in axes)
    for axis in axes:
        inner //= axis.count
        index = member // inner
        first, last = (int(index[0]), int(index[-1])) if len(index) else (0, -1)
        if last - first + 1 >= axis.count:
            blocks, rows = _block(axis, 0, axis.count), index % axis.count
        elif first % axis.count <= last % axis.count:
            blocks, rows = _block(axis, first % axis.count, last % axis.count + 1), index - first
        else:
            # the range wraps around the end of the axis
            head = _block(axis, first % axis.count, axis.count)
            tail = _block(axis, 0, last % axis.count + 1)
            pairs = zip(head, tail, strict=True)
            blocks, rows = [np.concatenate(pair) for pair in pairs], index - first
        columns_ |= {key: block[rows] for key, block in zip(axis.keys, blocks, strict=True)}
    return columns_


def matching(column: Column, value: float | str) -> Flags:
    """Tell where a column equals a value: words exactly, numbers to `SAME`."""
    if column.dtype.kind == "U" or isinstance(value, str):
        return np.asarray(column.astype(str) == str(value))
    largest = float(np.max(np.abs(column), initial=0.0))
    return np.asarray(np.abs(column - value) <= SAME * abs(value) + EPS * largest)


def members_with(columns: Columns, swept: Mapping[str, float | str], count: int) -> Flags:
    """Tell which of `count` members have all `swept` values, given by dotted key; shape (count,)."""
    result = np.ones(count, dtype=np.bool_)
    for key, value in swept.items():
        result &= matching(columns[key], value)
    return result


def _block(axis: Axis, start: int, stop: int) -> list[Column]:
    if isinstance(axis.values, Draw):
        return _sample(axis.values, start, stop)
    return [_axis_values(values, start, stop) for values in axis.values]


def _axis_values(values: Values, start: int, stop: int) -> Column:
    if isinstance(values, tuple):
        return np.asarray(values)[start:stop]
    if isinstance(values, Linspace):
        return line(*values.linspace, start, stop)
    if isinstance(values, Logspace):
        return _geometric(*values.logspace, start, stop)
    first, _, step = values.range
    return first + np.arange(start, stop) * step


def line(first: float, last: float, n: int, start: int = 0, stop: int | None = None) -> Floats:
    """Return equally spaced values, ``first + (last - first)*i/(n - 1)``, with exact ends."""
    i = np.arange(start, n if stop is None else stop)
    values = first + (last - first) * i / (n - 1)
    values[i == n - 1] = last
    return values


def _geometric(first: float, last: float, n: int, start: int, stop: int) -> Floats:
    """Return geometrically spaced values, ``first*(last/first)**(i/(n - 1))``, each rounded to the nearest double.

    Powers are computed in decimals, whose ``ln`` and ``exp`` are correctly rounded on every machine. The ends are
    exact.
    """
    context = Context(prec=_DIGITS)
    height = context.subtract(context.ln(Decimal(last)), context.ln(Decimal(first)))
    rise = context.divide(height, Decimal(n - 1))
    ratio = context.exp(rise)
    value = context.multiply(Decimal(first), context.exp(context.multiply(rise, Decimal(start))))
    values = np.empty(stop - start)
    for i in range(stop - start):
        values[i] = value
        value = context.multiply(value, ratio)
    return values


def _sample(draw: Draw, start: int, stop: int) -> list[Column]:
    """Return sample points start..stop-1 as one array per key, each of shape (stop - start,)."""
    keys = len(draw.over)
    if draw.method == "random":
        unit = _random(draw.seed, keys, start, stop)
    elif draw.method == "sobol":
        unit = _sobol(draw.seed, keys, start, stop)
    else:
        unit = _latin_hypercube(draw.seed, keys, draw.n)[start:stop]
    return [low + (high - low) * unit[:, i] for i, (low, high) in enumerate(draw.over)]


def _random(seed: int, keys: int, start: int, stop: int) -> Floats:
    """Return random numbers in [0, 1), shape (stop - start, keys), computed from their positions alone.

    Source: J. K. Salmon et al., Parallel random numbers: as easy as 1, 2, 3 (2011).
    """
    stream = np.random.Philox(key=seed)
    skipped, rest = divmod(start * keys, _PER_COUNT)
    stream.advance(skipped)
    bits = stream.random_raw(rest + (stop - start) * keys)[rest:]
    return np.asarray((bits >> np.uint64(11)) * 2.0**-53).reshape(stop - start, keys)


def _sobol(seed: int, keys: int, start: int, stop: int) -> Floats:
    from scipy.stats import qmc

    engine: Any = qmc.Sobol(keys, scramble=True, rng=seed)
    if start:
        engine.fast_forward(start)
        return np.asarray(engine.random(stop - start))
    # drawing the first point alone avoids a warning about counts that are not powers of two
    first = engine.random(1)
    return np.concatenate([first, engine.random(stop - 1)]) if stop > 1 else first[:stop]


@lru_cache(maxsize=2)
def _latin_hypercube(seed: int, keys: int, n: int) -> Floats:
    """Return all points of a Latin hypercube, shape (n, keys); they cannot be drawn separately."""
    from scipy.stats import qmc

    points: Any = qmc.LatinHypercube(keys, rng=seed).random(n)
    return np.asarray(points)
