"""The cheapest ladder for a tolerance, found by running a few members.

The pilot runs levels one after the other. With each new one it tries the ladders that end there, from two levels on:
the first that reaches the tolerance for every member of the pilot is the cheapest, because one level more at the coarse
end costs less than any at the fine end. The levels are successive. What the pilot cannot know of the other members,
``best.nc`` says for each of them: its bound, and whether it reaches the tolerance.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vibsim.comparison.best_solution import starts
from vibsim.comparison.extrapolate_members import (
    Extrapolated,
    Method,
    Start,
    extrapolate_members,
    level_at,
    noise_of,
)
from vibsim.convergence.state_extrapolation import Pair
from vibsim.core.array_types import Floats, Integers
from vibsim.core.errors import Fault, InputError, VibsimError
from vibsim.experiment import storage, sweep_columns
from vibsim.experiment.schema.fields import MAX_LEVEL
from vibsim.ladder.solving import climb
from vibsim.simulation.members import Members, members

if TYPE_CHECKING:
    from vibsim.experiment import Experiment

PILOT = 16
"""Members that are run."""
SEARCHED = 2**16
"""Up to so many members their extreme values are looked for."""
LEAST_STEPS = 16
"""Steps of the coarsest level that is tried."""
TIMES = 32
"""At so many times at most the pilot looks."""
MOST_LEVELS = 12
"""Levels of a ladder at most; more of them only add round-off."""
MOST_STEPS = 2**27
"""Steps that the pilot may take, all its members and levels together."""
PATIENCE = 2
"""After so many levels that do not halve the bound no finer one will."""
PLAIN_STEPS = 2**18
"""Up to so many steps of a level the pilot takes less time in plain Python than a new kernel takes to be compiled."""


@dataclass(frozen=True)
class _Run:
    """One method, the members of the pilot that have it, and what was run of them."""

    method: Method
    scheme: str
    start: Start
    case: Integers
    levels: list[Pair]
    noise: list[Floats | None]
    """Measured at each level, for the ladders that begin there."""

    def add_level(self, steps: int, points: int) -> None:
        """Run one level more, and look at so many times."""
        lane = "plain" if steps * len(self.case) <= PLAIN_STEPS else None
        run, every = partial(level_at, lane=lane), steps // points
        level = run(self.method, self.start, steps, every)
        self.levels.append(level)
        self.noise.append(noise_of(self.method, self.start, [steps], [every], [level], run))

    def bounds(self, steps: Sequence[int], points: int, levels: Sequence[Pair]) -> Floats:
        """Return the largest bound of each member by the last levels; infinite without one."""
        # the noise at the coarsest level that resolves the motion of each member
        noise, *others = self.noise[-len(steps) :]
        for finer in others:
            if noise is not None and finer is not None:
                noise = np.where(np.isnan(noise), finer, noise)
        t = (np.arange(points + 1) / points)[:, None]
        found = extrapolate_members(self.method, self.start, tuple(steps), t, levels, noise)
        return _largest(found)


@dataclass(frozen=True)
class _Trial:
    """A ladder that was tried."""

    levels: tuple[int, ...]
    error: float
    """The largest bound of every state, time and member of the pilot."""
    scheme: str
    case: int
    """Where it is the largest."""


def resolve(experiment: Experiment) -> Experiment:
    """Choose the levels of an experiment that names a tolerance.

    Parameters
    ----------
    experiment
        With a tolerance and without levels; one that has levels is returned as it is.

    Returns
    -------
    Experiment
        With successive levels: those of the fewest steps whose bound reaches the tolerance at every stored time of
        every member of a pilot.

    Raises
    ------
    InputError
        Where none do. It names the least bound, with its levels, scheme and member, and what forbids less.
    """
    if experiment.levels:
        return experiment
    tolerance = experiment.tolerance
    if tolerance is None:
        raise VibsimError(f"{experiment.name} has neither levels nor a tolerance to choose them by")
    runs = _runs(experiment)
    lowest = next(lv for lv in itertools.count() if experiment.steps(lv) >= LEAST_STEPS)
    points = max(n for n in range(1, TIMES + 1) if experiment.steps(lowest) % n == 0)
    tried = sum(len(run.case) for run in runs)
    least: _Trial | None = None
    mark, since, blamed = math.inf, 0, ""
    for level in range(lowest, MAX_LEVEL + 1):
        # each level is run twice
        if 2 * tried * (experiment.steps(level + 1) - experiment.steps(lowest)) > MOST_STEPS:
            raise _refused(experiment, least, blamed or "finer levels take too many steps")
        for run in runs:
            run.add_level(experiment.steps(level), points)
        here = math.inf
        for count in range(2, min(level - lowest + 1, MOST_LEVELS) + 1):
            trial = _trial(experiment, runs, tuple(range(level - count + 1, level + 1)), points)
            if trial.error <= tolerance:
                chosen = experiment.with_levels(trial.levels)
                if _is_enough(chosen, runs, tolerance):
                    return chosen
            here = min(here, trial.error)
            if least is None or trial.error < least.error or least.error == math.inf:
                least = trial
        if here < math.inf:
            steps = experiment.steps(level - 1), experiment.steps(level)
            blamed = blamed or _round_off(runs, steps, points, tolerance)
            mark, since = (here, 0) if here < 0.5 * mark else (mark, since + 1)
        if since == PATIENCE:
            not_smooth = (
                "the solutions of its levels do not approach each other as smooth ones would"
            )
            raise _refused(experiment, least, blamed or not_smooth)
    raise _refused(experiment, least, blamed or "there are no finer levels")


def _runs(experiment: Experiment) -> list[_Run]:
    cases = pilot(experiment)
    group = _gathered(experiment, cases)
    names = [scheme.name for scheme in experiment.schemes]
    return [
        _Run(method, names[i], start, cases[where], [], [])
        for i in experiment.ladder
        for method, start, where in starts(experiment, i, group)
    ]


def pilot(experiment: Experiment) -> Integers:
    """Return the members to try: the corners of the sweep, the extreme values of each key, and a spread between."""
    count = experiment.members
    if count <= PILOT or experiment.sweep is None:
        return np.arange(count)
    shape = [axis.count for axis in experiment.sweep.axes]
    ends = [(0, n - 1) for n in shape]
    corners = itertools.islice(itertools.product(*ends), PILOT // 2)
    found = [0, count - 1, *(int(np.ravel_multi_index(corner, shape)) for corner in corners)]
    if count <= SEARCHED:
        columns = sweep_columns.columns(experiment, 0, count)
        numbers = [c for c in columns.values() if c.dtype.kind == "f"]
        found += [int(place) for c in numbers for place in (np.argmin(c), np.argmax(c))]
    # multiples of the golden ratio leave no large gap, however many there are
    golden = 0.5 * (math.sqrt(5.0) - 1.0)
    spread = (int(math.fmod(0.5 + i * golden, 1.0) * count) for i in range(4 * PILOT))
    return np.array(sorted(list(dict.fromkeys([*found[:PILOT], *spread]))[:PILOT]))


def _gathered(experiment: Experiment, cases: Integers) -> Members:
    """Return the numbers of some members, wherever they stand in the sweep."""
    each = [members(experiment, case, case + 1) for case in cases.tolist()]

    def together(field: str) -> dict[str, NDArray[Any]]:
        return {
            n: np.concatenate([getattr(m, field)[n] for m in each]) for n in getattr(each[0], field)
        }

    return Members(
        index=cases,
        columns=together("columns"),
        parameters=together("parameters"),
        initial=together("initial"),
        end=np.concatenate([one.end for one in each]),
    )


def _trial(
    experiment: Experiment, runs: Sequence[_Run], levels: tuple[int, ...], points: int
) -> _Trial:
    steps = [experiment.steps(level) for level in levels]
    trials = []
    for run in runs:
        errors = run.bounds(steps, points, run.levels[-len(levels) :])
        worst = int(np.argmax(errors))
        trials.append(_Trial(levels, float(errors[worst]), run.scheme, int(run.case[worst])))
    return max(trials, key=lambda trial: trial.error)


def _largest(found: Extrapolated) -> Floats:
    """Return the largest bound of each member, infinite where it has none."""
    return np.maximum(*found.largest_bounds())


def _is_enough(chosen: Experiment, runs: Sequence[_Run], tolerance: float) -> bool:
    """Tell whether an experiment reaches the tolerance at every time that would be stored."""
    steps = tuple(chosen.steps(level) for level in chosen.levels)
    points = steps[0] // storage.sampling(chosen, chosen.levels[0])
    found = (climb(run.method, run.start, steps, points) for run in runs)
    return all(bool(np.all(_largest(one) <= tolerance)) for one in found)


def _round_off(runs: Sequence[_Run], steps: tuple[int, int], points: int, tolerance: float) -> str:
    """Tell whether round-off alone is too much for every ladder that ends here or later; empty where it is not."""
    for run in runs:
        # levels without any difference leave round-off alone
        if np.max(run.bounds(steps, points, [run.levels[-1]] * 2)) > tolerance:
            return "round-off" + _remedy(run.method, steps[-1])
    return ""


def _remedy(method: Method, steps: int) -> str:
    """Name the choice of an option that would leave less round-off."""
    rows = [
        (method.scheme.round_off({**method.options, option.name: choice}, steps), option, choice)
        for option in method.scheme.words
        for choice in option.choices
    ]
    own = method.scheme.round_off(method.options, steps)
    least = min(rows, key=lambda row: row[0], default=None)
    if least is None or not least[0] < own:
        return ""
    return f", of which {least[1].name}: {least[2]} would leave less"


def _refused(experiment: Experiment, least: _Trial | None, reason: str) -> InputError:
    if least is None:
        found = "no ladder has a bound at all"
    elif least.error == math.inf:
        found = (
            f"no ladder has a bound for member {least.case} with scheme {least.scheme}: see it alone "
            f"(@{least.case} and levels in place of the tolerance), or leave it out"
        )
    else:
        found = (
            f"the least bound is {least.error:.2g}, with levels {least.levels[0]} to {least.levels[-1]} "
            f"(scheme {least.scheme}, member {least.case})"
        )
    rule = f"no ladder reaches it: {reason}"
    name = str(experiment.file or experiment.name)
    return InputError([Fault(name, 0, "tolerance", f"{experiment.tolerance:g}", rule, found)])
