"""The coarsest common grid of several levels, found from whole numbers of steps.

Sample k of a level is its step k*every, at the fraction k*every/steps of the whole time. Fractions are compared as
whole numbers: comparing floating-point times would lose points, or pair wrong ones.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from vibsim.convergence.differences import laid_out
from vibsim.core.array_types import Floats
from vibsim.core.errors import VibsimError
from vibsim.core.record import Record


@dataclass(frozen=True)
class Grid:
    """The common sample times of a ladder of levels."""

    levels: tuple[int, ...]
    """Strictly increasing."""
    steps: tuple[int, ...]
    """Number of steps of every level."""
    strides: tuple[int, ...]
    """Distance between common points, in stored samples of each level."""
    t: Floats
    """Common times, shape (t,); fractions of the end time where the end differs between members."""
    dt: Floats
    """Step of every level, shape (level, case), with one case where all members have the same."""
    apart: int
    """Distance between common points, in steps of the coarsest level."""
    end_included: bool
    """Whether the last common point is the end of the time interval."""

    @property
    def spacing(self) -> Floats:
        """Distance between common points in time, shape (case,) or (1,)."""
        return np.asarray(self.dt[0] * self.apart, dtype=np.float64)

    def times(self, end: Floats) -> Floats:
        """Return the common times of members that end at `end`, shape (case, t): the bits of those in level files."""
        number = self.apart * np.arange(len(self.t), dtype=np.int64)
        return number * (end / self.steps[0])[:, None]


def common_grid(records: Mapping[int, Record]) -> Grid:
    """Find the common grid of the records of a ladder.

    Parameters
    ----------
    records
        Level Records by level, each with attributes ``steps`` and ``every``.

    Raises
    ------
    VibsimError
        Where there is no level, or the levels have fewer than two sample times in common.
    """
    if not records:
        raise VibsimError("analysis needs the data of at least one level")
    levels = tuple(sorted(records))
    steps = tuple(_whole(records[level], "steps") for level in levels)
    every = tuple(_whole(records[level], "every") for level in levels)
    unit = math.lcm(*steps)
    spacings = [e * (unit // n) for e, n in zip(every, steps, strict=True)]
    apart = math.lcm(*spacings)
    strides = tuple(apart // spacing for spacing in spacings)
    count = min((np.size(records[lv]["t"]) - 1) // s for lv, s in zip(levels, strides, strict=True))
    if count < 1:
        raise VibsimError(f"levels {list(levels)} have fewer than two stored times in common")
    return Grid(
        levels=levels,
        steps=steps,
        strides=strides,
        t=np.asarray(records[levels[0]]["t"][: count * strides[0] + 1 : strides[0]], dtype=float),
        dt=np.stack([_step(records[level]) for level in levels]),
        apart=strides[0] * every[0],
        end_included=count * apart == unit,
    )


def take(grid: Grid, record: Record, name: str) -> Floats:
    """Return variable `name` of a level Record on the common grid, shape (..., t), time outermost in memory."""
    stride = grid.strides[grid.levels.index(_whole(record, "level"))]
    values = record[name][..., : (len(grid.t) - 1) * stride + 1 : stride]
    return laid_out(values)


def _whole(record: Record, name: str) -> int:
    return int(np.asarray(record.attrs[name]).item())


def _step(record: Record) -> Floats:
    """Return dt, shape (case,) where the end differs between members, else (1,)."""
    t, every = record["t"], _whole(record, "every")
    fraction = float(t[-1]) / ((np.size(t) - 1) * every)
    end = record["end"] if "end" in record else np.ones(1)
    return np.asarray(fraction * end, dtype=np.float64)
