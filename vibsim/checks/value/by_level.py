"""The number of a ``value`` check at every level, and whether a finer level would bring it where it should be.

A number that misses what is asked may come there on finer levels, or have settled elsewhere: the count of bounces that
are located is the same on each of them. By how much the finest levels still change it tells the two apart.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vibsim.checks.value.criteria import SAMPLED, compare
from vibsim.comparison import value_numbers
from vibsim.experiment.value_names import VALUES

if TYPE_CHECKING:
    from vibsim.experiment.schema.checks import ValueCheck

Floats = NDArray[np.float64]
Codes = NDArray[np.int16]
Flags = NDArray[np.bool_]

UNKNOWN, SETTLED, MOVING = -1, 0, 1
"""What finer levels do to a number that misses what is asked: not known, too little, perhaps enough."""
REACH = 3.0
"""All finer levels together change a number by no more than so many times its last change (an order of 1/2 by 2.4)."""


def by_level(name: str, place: value_numbers.Place) -> Floats:
    """Return the number `name` at every level, shape (scheme, case, level).

    A step of a level is the same time on every other one; of the extrapolated solution it is that of a common time.
    NaN where a level has no such number.
    """
    if place.level == "best" and name in SAMPLED:
        return np.stack(value_numbers.samples(place), axis=-1)
    time, data = place.t, place.data()
    if place.step is not None and data is not None:
        every = int(np.asarray(data.attrs["every"]))
        index = place.step // every
        time = float(data["t"][index]) if index < len(data["t"]) else place.t
    rows = (replace(place, level=level, t=time, step=None) for level in place.levels)
    return np.stack([value_numbers.value(name, row) for row in rows], axis=-1)


def has_levels(name: str) -> bool:
    """Tell whether a number is another one at every level."""
    return "level" in VALUES[name].at


def own_levels(name: str, levels: Sequence[int]) -> tuple[int, ...]:
    """Return the levels that have such a number: one that is made of several has the coarsest of them as its own."""
    return tuple(levels)[: len(levels) - VALUES[name].finer_levels]


def prospects(
    check: ValueCheck, numbers: Floats, levels: Sequence[int], level: int, fulfilled: Flags
) -> tuple[Codes, Codes]:
    """Return what finer levels do to a number that misses what is asked, each of shape (scheme, case).

    Parameters
    ----------
    numbers
        Of every level, shape (scheme, case, level).
    level
        The level that is asked for.
    fulfilled
        Where the number that is asked for is as it should be, shape (scheme, case): nothing is said of it.

    Returns
    -------
    tuple
        `SETTLED`, `MOVING` or `UNKNOWN`; and the first finer level of the ladder at which the number is as asked, -1
        for none.
    """
    holds, away = compare(check, numbers)
    finer = np.array(levels) > level
    helps = holds & finer
    first = np.where(np.any(helps, axis=-1), np.array(levels)[np.argmax(helps, axis=-1)], -1)
    code = np.full(numbers.shape[:-1], UNKNOWN, dtype=np.int16)
    if len(levels) > 1:
        with np.errstate(all="ignore"):
            change = np.abs(np.diff(numbers[..., -3:], axis=-1))
            change[..., :-1] *= 0.5
            last = np.max(change, axis=-1)
            code[away[..., -1] <= REACH * last] = MOVING
            code[away[..., -1] > REACH * last] = SETTLED
    code[fulfilled], first[fulfilled] = UNKNOWN, -1
    return code, first.astype(np.int16)
