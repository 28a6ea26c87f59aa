"""Choose the cheapest ladder for a tolerance from a pilot run of a few members.

The pilot runs successive levels, from coarse to fine. After each new level it tries the ladders that end there, from
two levels on. The first one that reaches the tolerance for every member of the pilot is the cheapest, because a further
coarse level costs less than a finer one. For all other members ``best.nc`` states the bound, and whether it reaches the
tolerance.
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
from vibsim.convergence.extrapolation.states import Pair
from vibsim.core.array_types import Floats, Integers
from vibsim.core.errors import InputError, VibsimError
from vibsim.experiment import storage, sweep_columns
from vibsim.experiment.schema.fields import MAX_LEVEL
from vibsim.ladder.solving import climb
from vibsim.simulation.members import Members, members

if TYPE_CHECKING:
    from vibsim.experiment import Experiment

PILOT = 16
"""Most members of the pilot."""
SEARCHED = 2**16
"""Largest sweep whose members are searched for extreme values of each key."""
LEAST_STEPS = 16
"""Fewest steps of the coarsest level."""
TIMES = 32
"""Most times at which the pilot compares levels."""
MOST_LEVELS = 12
"""Most levels of a ladder; more only add round-off."""
MOST_STEPS = 2**27
"""Most steps of the pilot, over all members and levels."""
PATIENCE = 2
"""Number of successive levels without halving of the bound after which the search ends."""
PLAIN_STEPS = 2**18
"""Most steps of a level that plain Python takes faster than a new kernel is compiled."""


@dataclass(frozen=True)
class _Run:
    """One method, the members of the pilot that use it, and their levels so far."""

    method: Method
    scheme: str
    start: Start
    case: Integers
    levels: list[Pair]
    noise: list[Floats | None]
    """Noise measured at each level, for ladders whose coarsest level it is."""

    def add_level(self, steps: int, points: int) -> None:
        """Run the next level, with the given number of steps, and store it at `points` equal times and t = 0."""
        lane = "plain" if steps * len(self.case) <= PLAIN_STEPS else None
        run, every = partial(level_at, lane=lane), steps // points
        level = run(self.method, self.start, steps, every)
        self.levels.append(level)
        self.noise.append(noise_of(self.method, self.start, [steps], [every], [level], run))

    def bounds(self, steps: Sequence[int], points: int, levels: Sequence[Pair]) -> Floats:
        """Return the largest error bound of each member over the last levels, shape (case,); infinite without one."""
        # for each member, the noise at the coarsest level that resolves its motion
        noise, *finer_levels = self.noise[-len(steps) :]
        for finer in finer_levels:
            if noise is not None and finer is not None:
                noise = np.where(np.isnan(noise), finer, noise)
        t = (np.arange(points + 1) / points)[:, None]
        solution = extrapolate_members(self.method, self.start, tuple(steps), t, levels, noise)
        return _largest(solution)


@dataclass(frozen=True)
class _Trial:
    """A candidate ladder and its error bound."""

    levels: tuple[int, ...]
    error: float
    """The largest bound over all states, times and members of the pilot."""
    scheme: str
    case: int
    """The scheme and member with that bound."""


def resolve(experiment: Experiment) -> Experiment:
    """Choose the levels of an experiment that names a tolerance.

    Parameters
    ----------
    experiment
        An experiment with a tolerance; one that has levels is returned unchanged.

    Returns
    -------
    Experiment
        The experiment with successive levels: the fewest steps whose bound reaches the tolerance at every stored time
        of every member of the pilot.

    Raises
    ------
    InputError
        Where no ladder reaches the tolerance. It states the smallest bound, with its levels, scheme and member, and why
        no smaller one is possible.
    """
    if experiment.levels:
        return experiment
    tolerance = experiment.tolerance
    if tolerance is None:
        raise VibsimError(f"{experiment.name} has neither levels nor a tolerance to choose them by")
    runs = _runs(experiment)
    lowest = next(lv for lv in itertools.count() if experiment.steps(lv) >= LEAST_STEPS)
    points = max(n for n in range(1, TIMES + 1) if experiment.steps(lowest) % n == 0)
    trajectories = sum(len(run.case) for run in runs)
    best: _Trial | None = None
    mark, since, obstacle = math.inf, 0, ""
    for level in range(lowest, MAX_LEVEL + 1):
        # each level is run twice, once to measure its noise
        if 2 * trajectories * (experiment.steps(level + 1) - experiment.steps(lowest)) > MOST_STEPS:
            raise _refused(experiment, best, obstacle or "finer levels take too many steps")
        for run in runs:
            run.add_level(experiment.steps(level), points)
        smallest = math.inf
        for count in range(2, min(level - lowest + 1, MOST_LEVELS) + 1):
            trial = _trial(experiment, runs, tuple(range(level - count + 1, level + 1)), points)
            if trial.error <= tolerance:
                chosen = experiment.with_levels(trial.levels)
                if _is_enough(chosen, runs, tolerance):
                    return chosen
            smallest = min(smallest, trial.error)
            if best is None or trial.error < best.error or best.error == math.inf:
                best = trial
        if smallest < math.inf:
            steps = experiment.steps(level - 1), experiment.steps(level)
            obstacle = obstacle or _round_off(runs, steps, points, tolerance)
            mark, since = (smallest, 0) if smallest < 0.5 * mark else (mark, since + 1)
        if since == PATIENCE:
            not_smooth = (
                "the solutions of its levels do not approach each other as smooth ones would"
            )
            raise _refused(experiment, best, obstacle or not_smooth)
    raise _refused(experiment, best, obstacle or "there are no finer levels")


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
    """Return the members of the pilot: corners of the sweep, extreme values of each key, and others spread evenly."""
    count = experiment.members
    if count <= PILOT or experiment.sweep is None:
        return np.arange(count)
    shape = [axis.count for axis in experiment.sweep.axes]
    ends = [(0, n - 1) for n in shape]
    corners = itertools.islice(itertools.product(*ends), PILOT // 2)
    chosen = [0, count - 1, *(int(np.ravel_multi_index(corner, shape)) for corner in corners)]
    if count <= SEARCHED:
        columns = sweep_columns.columns(experiment, 0, count)
        numbers = [c for c in columns.values() if c.dtype.kind == "f"]
        chosen += [int(place) for c in numbers for place in (np.argmin(c), np.argmax(c))]
    # fractional parts of multiples of the golden ratio leave no large gap, for any number of them
    golden = 0.5 * (math.sqrt(5.0) - 1.0)
    spread = (int(math.fmod(0.5 + i * golden, 1.0) * count) for i in range(4 * PILOT))
    return np.array(sorted(list(dict.fromkeys([*chosen[:PILOT], *spread]))[:PILOT]))


def _gathered(experiment: Experiment, cases: Integers) -> Members:
    """Return the members `cases` of the sweep, in any order, as one group."""
    singles = [members(experiment, case, case + 1) for case in cases.tolist()]

    def join(field: str) -> dict[str, NDArray[Any]]:
        rows = [getattr(single, field) for single in singles]
        return {name: np.concatenate([row[name] for row in rows]) for name in rows[0]}

    return Members(
        index=cases,
        columns=join("columns"),
        parameters=join("parameters"),
        initial=join("initial"),
        end=np.concatenate([single.end for single in singles]),
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


def _largest(solution: Extrapolated) -> Floats:
    """Return the largest error bound of each member, shape (case,); infinite without one."""
    return np.maximum(*solution.largest_bounds())


def _is_enough(chosen: Experiment, runs: Sequence[_Run], tolerance: float) -> bool:
    """Tell whether the pilot reaches the tolerance at every time that `chosen` would store."""
    steps = tuple(chosen.steps(level) for level in chosen.levels)
    points = steps[0] // storage.sampling(chosen, chosen.levels[0])
    solutions = (climb(run.method, run.start, steps, points) for run in runs)
    return all(bool(np.all(_largest(solution) <= tolerance)) for solution in solutions)


def _round_off(runs: Sequence[_Run], steps: tuple[int, int], points: int, tolerance: float) -> str:
    """Return a message if round-off alone exceeds the tolerance for all ladders that end at this level or later."""
    for run in runs:
        # the bound of two identical levels is that of round-off alone
        if np.max(run.bounds(steps, points, [run.levels[-1]] * 2)) > tolerance:
            return "round-off" + _remedy(run.method, steps[-1])
    return ""


def _remedy(method: Method, steps: int) -> str:
    """Return a hint at the choice of an option with the least round-off, if it has less than the present one."""
    rows = [
        (method.scheme.round_off({**method.options, option.name: choice}, steps), option, choice)
        for option in method.scheme.words
        for choice in option.choices
    ]
    present = method.scheme.round_off(method.options, steps)
    least = min(rows, key=lambda row: row[0], default=None)
    if least is None or not least[0] < present:
        return ""
    return f", of which {least[1].name}: {least[2]} would leave less"


def _refused(experiment: Experiment, best: _Trial | None, reason: str) -> InputError:
    if best is None:
        hint = "no ladder has a bound at all"
    elif best.error == math.inf:
        hint = (
            f"no ladder has a bound for member {best.case} with scheme {best.scheme}: see it alone "
            f"(@{best.case} and levels in place of the tolerance), or leave it out"
        )
    else:
        hint = (
            f"the least bound is {best.error:.2g}, with levels {best.levels[0]} to {best.levels[-1]} "
            f"(scheme {best.scheme}, member {best.case})"
        )
    rule = f"no ladder reaches it: {reason}"
    return experiment.refused("tolerance", f"{experiment.tolerance:g}", rule, hint)
