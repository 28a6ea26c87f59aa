"""The numbers of a sweep: what each key is of any range of members, in time and memory of that range.

Every number is made with ``+ - * /`` of floats, or with arithmetic of whole numbers and decimals, so that it is the
same on every machine; and member i is the same whatever range is asked. Scattered points (random, of a Sobol sequence,
of a latin hypercube) follow from their seed.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from decimal import Context, Decimal
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vibsim.core.array_types import Flags, Floats, Integers
from vibsim.experiment.schema.sweep import Axis, Draw, Linspace, Logspace, Values, as_option

if TYPE_CHECKING:
    from vibsim.experiment.data import ExperimentSpec

Column = NDArray[Any]
"""Values of one key, float64 or text."""
SAME, EPS = 1e-9, 1e-14
"""A number names a swept value that is it to this part of itself, and to that of the largest one of the sweep."""
_PER_COUNT = 4
"""Numbers that Philox gives at each value of its counter."""
_DIGITS = 60
"""Of the decimals in between: enough for the double next to the true value of any power that a double can hold."""


def columns(experiment: ExperimentSpec, start: int, stop: int) -> dict[str, Column]:
    """Return the swept values of members start..stop-1 by dotted key, each of shape (stop - start,).

    They are float64 in the unit of the key, or text where the options of a scheme are swept; empty without a sweep.
    """
    return columns_of(experiment.sweep.axes, start, stop) if experiment.sweep else {}


def option_groups(
    experiment: ExperimentSpec, scheme: int, columns: Mapping[str, Column]
) -> list[tuple[Mapping[str, str | float | bool], Integers]]:
    """Return the options that members have of scheme number `scheme`; `columns` holds their swept values.

    Every distinct set of options comes once, in the order in which members first have it, with the positions of those
    members in `columns`, increasing. Without a sweep, it is the one set of the one member. A word is text, a number a
    float, and a flag a bool.
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
        # numbered anew for each key, so that the numbers stay small
        kind = np.unique(kind * len(distinct) + place, return_inverse=True)[1]
    order = np.argsort(kind, kind="stable")
    members = np.split(order, np.flatnonzero(np.diff(kind[order])) + 1)
    return [
        ({**base, **{n: as_option(base[n], c[where[0]]) for n, c in swept.items()}}, where)
        for where in sorted(members, key=lambda where: int(where[0]))
    ]


def columns_of(axes: Sequence[Axis], start: int, stop: int) -> dict[str, Column]:
    """Return the values of members start..stop-1 of a grid by dotted key; the last axis varies fastest."""
    found: dict[str, Column] = {}
    member = np.arange(start, stop, dtype=np.int64)
    inner = math.prod(axis.count for axis in axes)
    for axis in axes:
        inner //= axis.count
        turn = member // inner
        first, last = (int(turn[0]), int(turn[-1])) if len(turn) else (0, -1)
        if last - first + 1 >= axis.count:
            blocks, place = _block(axis, 0, axis.count), turn % axis.count
        elif first % axis.count <= last % axis.count:
            blocks, place = _block(axis, first % axis.count, last % axis.count + 1), turn - first
        else:
            # the range ends in the next turn of the axis
            head = _block(axis, first % axis.count, axis.count)
            tail = _block(axis, 0, last % axis.count + 1)
            pairs = zip(head, tail, strict=True)
            blocks, place = [np.concatenate(pair) for pair in pairs], turn - first
        found |= {key: block[place] for key, block in zip(axis.keys, blocks, strict=True)}
    return found


def matching(column: Column, value: float | str) -> Flags:
    """Say where a column has a value: a word as it is, a number to `SAME` of it."""
    if column.dtype.kind == "U" or isinstance(value, str):
        return np.asarray(column.astype(str) == str(value))
    largest = float(np.max(np.abs(column), initial=0.0))
    return np.asarray(np.abs(column - value) <= SAME * abs(value) + EPS * largest)


def members_with(
    columns: Mapping[str, Column], swept: Mapping[str, float | str], count: int
) -> Flags:
    """Say which of `count` members have every one of some values by dotted key, shape (count,)."""
    found = np.ones(count, dtype=np.bool_)
    for key, value in swept.items():
        found &= matching(columns[key], value)
    return found


def _block(axis: Axis, start: int, stop: int) -> list[Column]:
    if isinstance(axis.values, Draw):
        return _scatter(axis.values, start, stop)
    return [_part(values, start, stop) for values in axis.values]


def _part(values: Values, start: int, stop: int) -> Column:
    if isinstance(values, tuple):
        return np.asarray(values)[start:stop]
    if isinstance(values, Linspace):
        return line(*values.linspace, start, stop)
    if isinstance(values, Logspace):
        return _power(*values.logspace, start, stop)
    first, _, step = values.range
    return first + np.arange(start, stop) * step


def line(first: float, last: float, n: int, start: int = 0, stop: int | None = None) -> Floats:
    """Return values of a line, ``first + (last - first)*i/(n - 1)``, with exact ends."""
    i = np.arange(start, n if stop is None else stop)
    found = first + (last - first) * i / (n - 1)
    found[i == n - 1] = last
    return found


def _power(first: float, last: float, n: int, start: int, stop: int) -> Floats:
    """Return values of a geometric line, ``first*(last/first)**(i/(n - 1))``, each rounded to the nearest double.

    The powers are taken in decimals, whose ``ln`` and ``exp`` are rounded correctly on every machine; the ends come
    out exact.
    """
    context = Context(prec=_DIGITS)
    height = context.subtract(context.ln(Decimal(last)), context.ln(Decimal(first)))
    rise = context.divide(height, Decimal(n - 1))
    ratio = context.exp(rise)
    value = context.multiply(Decimal(first), context.exp(context.multiply(rise, Decimal(start))))
    found = np.empty(stop - start)
    for i in range(stop - start):
        found[i] = value
        value = context.multiply(value, ratio)
    return found


def _scatter(draw: Draw, start: int, stop: int) -> list[Column]:
    """Return points number start..stop-1, the values of one key after the other, each of shape (stop - start,)."""
    keys = len(draw.over)
    if draw.method == "random":
        unit = _random(draw.seed, keys, start, stop)
    elif draw.method == "sobol":
        unit = _sobol(draw.seed, keys, start, stop)
    else:
        unit = _latin_hypercube(draw.seed, keys, draw.n)[start:stop]
    return [low + (high - low) * unit[:, i] for i, (low, high) in enumerate(draw.over)]


def _random(seed: int, keys: int, start: int, stop: int) -> Floats:
    """Return numbers in [0, 1), shape (stop - start, keys), found from their positions alone.

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
    # asked for the first one alone, it does not warn of numbers that are no power of two
    first = engine.random(1)
    return np.concatenate([first, engine.random(stop - 1)]) if stop > 1 else first[:stop]


@lru_cache(maxsize=2)
def _latin_hypercube(seed: int, keys: int, n: int) -> Floats:
    """Return every point of a latin hypercube, shape (n, keys): none is known without the others."""
    from scipy.stats import qmc

    points: Any = qmc.LatinHypercube(keys, rng=seed).random(n)
    return np.asarray(points)
