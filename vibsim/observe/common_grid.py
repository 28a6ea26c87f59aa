"""Consistency of level data, and the coarsest common grid of several levels.

A comparison of levels of different problems would still give numbers, so such levels are refused.

Sample k of a level is its step k*every, at the fraction k*every/steps of the run. Fractions are compared in integer
arithmetic: comparing floating-point times would lose points, or pair wrong ones.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibsim.convergence.differences import laid_out
from vibsim.core.array_types import Flags, Floats
from vibsim.core.errors import VibsimError
from vibsim.core.record import Record
from vibsim.experiment import Experiment
from vibsim.observe.thresholds import ROUNDED_START, SAME_START

SAME_AT_EVERY_LEVEL = frozenset({"natural_frequency", "exact_period"})
"""Variables of members that do not depend on the step."""
MEASURED = ("period", "period_count", "first_peak", "last_peak")
NEEDED = ("omega_dt", "natural_frequency", "status", "energy_initial", *MEASURED)
"""Variables of members that the analysis needs at every level, besides the states and the extrema of the position."""


@dataclass(frozen=True)
class Grid:
    """The common sample times of a ladder of levels."""

    levels: tuple[int, ...]  # strictly increasing
    steps: tuple[int, ...]  # number of steps of every level
    strides: tuple[int, ...]  # distance between common points, in stored samples of each level
    t: Floats  # common times, shape (t,); fractions of the end time if that differs between members
    dt: Floats  # shape (level, case), with one case if it is the same for all members
    stride: int  # distance between common points, in steps of the coarsest level
    end_included: bool  # whether the last common point is the end of the time interval

    @property
    def spacing(self) -> Floats:
        """Distance between common points in time, shape (case,) or (1,)."""
        return np.asarray(self.dt[0] * self.stride, dtype=np.float64)

    def times(self, end: Floats) -> Floats:
        """Return the common times of members that end at `end`, shape (case, t), with the bits of the level files."""
        number = self.stride * np.arange(len(self.t), dtype=np.int64)
        return number * (end / self.steps[0])[:, None]


def common_grid(records: Mapping[int, Record]) -> Grid:
    """Return the common grid of level records, which have the attributes ``steps`` and ``every``.

    Raises VibsimError if there is no level, or the levels have fewer than two sample times in common.
    """
    if not records:
        raise VibsimError(
            "analysis needs the data of at least one level. An experiment with `tolerance:` has no levels of its own: "
            "vibsim.best(experiment) chooses and simulates them"
        )
    levels = tuple(sorted(records))
    steps = tuple(records[level].whole("steps") for level in levels)
    every = tuple(records[level].whole("every") for level in levels)
    unit = math.lcm(*steps)
    spacings = [e * (unit // n) for e, n in zip(every, steps, strict=True)]
    stride = math.lcm(*spacings)
    strides = tuple(stride // spacing for spacing in spacings)
    count = min((np.size(records[lv]["t"]) - 1) // s for lv, s in zip(levels, strides, strict=True))
    if count < 1:
        raise VibsimError(f"levels {list(levels)} have fewer than two stored times in common")
    return Grid(
        levels=levels,
        steps=steps,
        strides=strides,
        t=np.asarray(records[levels[0]]["t"][: count * strides[0] + 1 : strides[0]], dtype=float),
        dt=np.stack([_step(records[level]) for level in levels]),
        stride=strides[0] * every[0],
        end_included=count * stride == unit,
    )


def take(grid: Grid, record: Record, name: str) -> Floats:
    """Return variable `name` of a level Record on the common grid, shape (..., t), time outermost in memory."""
    stride = _stride(grid, record)
    return laid_out(record[name][..., : (len(grid.t) - 1) * stride + 1 : stride])


def take_all(grid: Grid, record: Record, name: str) -> Floats:
    """Return variable `name` of a level Record at all its samples up to the end of the common grid, shape (..., t)."""
    return laid_out(record[name][..., : (len(grid.t) - 1) * _stride(grid, record) + 1])


def _stride(grid: Grid, record: Record) -> int:
    return grid.strides[grid.levels.index(record.whole("level"))]


def _step(record: Record) -> Floats:
    """Return dt, shape (case,) if the end time differs between members, otherwise (1,)."""
    t = record["t"]
    fraction = float(t[-1]) / ((np.size(t) - 1) * record.whole("every"))
    end = record["end"] if "end" in record else np.ones(1)
    return np.asarray(fraction * end, dtype=np.float64)


def check_belonging(experiment: Experiment, records: Mapping[int, Record]) -> None:
    """Check that level Records belong to `experiment` and to the same problem.

    Raises VibsimError with all faults: a level that the experiment does not have, a model, schemes, members, numbers of
    steps, end times or parameters that differ from the other levels or the experiment, different values at t = 0,
    missing variables.
    """
    faults = [
        f"level {level}: {fault}"
        for level, record in sorted(records.items())
        for fault in _faults(experiment, level, record, records[max(records)])
    ]
    if faults:
        raise VibsimError("levels that do not belong together:\n" + "\n".join(faults))


def _faults(experiment: Experiment, level: int, record: Record, other: Record) -> Iterator[str]:
    model = experiment.model.definition
    if level not in experiment.levels:
        yield f"the experiment has levels {list(experiment.levels)}"
        return
    steps = record.whole("steps")
    if steps != experiment.steps(level):
        yield f"{steps} steps instead of {experiment.steps(level)}"
    if str(record.attrs.get("model", model.kind)) != model.kind:
        yield f"model {record.attrs['model']} instead of {model.kind}"
    names = [scheme.name for scheme in experiment.schemes]
    if record.words("scheme") != names:
        yield f"schemes {record.words('scheme')} instead of {names}"
        return
    if not np.array_equal(record["case"], other["case"]):
        yield "other members than the finest level"
        return
    position = model.position
    needed = [state.name for state in model.states]
    needed += [f"{position}_min", f"{position}_max", *NEEDED]
    missing = [name for name in needed if name not in record]
    if missing:
        yield f"{', '.join(missing)} {'are' if len(missing) > 1 else 'is'} missing"
        return
    # values of members that do not depend on the level: parameters, period, end time
    constants = [name for name, variable in record.coords.items() if variable.dims == ("case",)]
    for name in (*constants, *sorted(SAME_AT_EVERY_LEVEL & record.variables.keys())):
        if name not in other or not _equal(record[name], other[name]):
            yield f"{name} differs from the finest level's"
    if not np.isclose(record["t"][-1], other["t"][-1], rtol=1e-12, atol=0.0):
        yield f"it ends at {record['t'][-1]:g}, the finest level at {other['t'][-1]:g}"
    # in a chain the initial values depend on the level, except those of the first member
    starts = np.asarray(record["case"]) % experiment.chain == 0
    for group in (model.positions, model.velocities):
        sizes = np.stack([np.abs(record[name][:, starts, 0]) for name in group])
        # a place that does not move in the shape of a mode has the rounding of those that do
        rounding = ROUNDED_START * np.fmax.reduce(sizes, axis=(0, 1))
        for name in group:
            yield from _start(record, other, name, starts, rounding)


def _equal(a: NDArray[Any], b: NDArray[Any]) -> bool:
    return bool(np.array_equal(a, b, equal_nan=a.dtype.kind == b.dtype.kind == "f"))


def _start(
    record: Record, other: Record, name: str, starts: Flags, rounding: Floats
) -> Iterator[str]:
    compared = [(name, other, "the finest level's", 0.0)]
    if f"{name}_exact" in record:
        # a state that is 0 at first has the rounding of what follows
        compared.append((f"{name}_exact", record, "the exact solution's", ROUNDED_START))
    values = np.asarray(record[name], dtype=np.float64)[:, starts]
    for other_name, source, words, rounded in compared:
        expected = np.asarray(source[other_name], dtype=np.float64)[..., starts, :]
        # the smaller size of the two, because an unstable level is larger than the motion
        largest = [np.fmax.reduce(np.abs(series), axis=-1) for series in (values, expected)]
        size = np.maximum(np.abs(expected[..., 0]), np.fmin(*largest))
        allowed = SAME_START * size + rounded * largest[1] + rounding
        if np.any(np.abs(values[..., 0] - expected[..., 0]) > allowed):
            yield f"{name} at t = 0 differs from {words}"
