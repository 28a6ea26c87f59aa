"""What a level stores: which of its steps, which quantities over time, how many extrema; bounded in large sweeps."""

from __future__ import annotations

from vibsim.core.vocabulary import is_error_part
from vibsim.experiment.data import ExperimentSpec
from vibsim.experiment.value_names import MOST_EVENTS

SMALL = 200_000
"""Samples of one variable up to which ``samples: auto`` keeps every step of a level."""
LARGE = 2**17
"""Samples of one variable above which ``samples: auto`` keeps fewer than the times of the coarsest level."""
FEWEST_INTERVALS = 16
"""Intervals between the samples of a member that ``samples: auto`` always keeps."""
LEAN = 2**18
"""Samples of one variable on the coarsest level above which an experiment is lean."""
MOST_EXTREMA = 512
"""Peaks, and troughs, that are kept of a scheme and member."""
FEWEST_EXTREMA = 16
"""As many are kept of however many members."""
RUNNING = "_running_max"
"""Behind the name of an energy deviation: its largest absolute value over every step so far."""
_OF_PEAKS = "phase_error_slope"
"""The value that is made of the first `FEWEST_EXTREMA` peaks, which are kept whatever else is."""


def stride(samples: int | str, coarsest: int, steps: int, trajectories: int) -> int:
    """Return n where every n-th step of a level is stored.

    ``auto``, ``common`` and ``all`` keep times of the coarsest level: all of them, but where ``auto`` would keep too
    many. Every n-th step of each level is as it says: what the levels then have in common is what is stored of the
    coarsest.

    Parameters
    ----------
    samples
        What the file asks for: ``auto``, ``common``, ``all``, or n, which divides `coarsest`, for every n-th step.
    coarsest, steps
        Number of steps of the coarsest level, and of this one.
    trajectories
        Number of schemes times number of members.
    """
    if isinstance(samples, int):
        return samples
    if samples == "all" or (samples == "auto" and trajectories * (steps + 1) <= SMALL):
        return 1
    # the least power of two that brings the samples down to `LARGE`, as far as the steps divide
    thinning = 1
    while (
        samples == "auto"
        and trajectories * (coarsest // thinning + 1) > LARGE
        and coarsest % (2 * thinning) == 0
        and coarsest // (2 * thinning) >= FEWEST_INTERVALS
    ):
        thinning *= 2
    return steps // coarsest * thinning


def is_lean(samples: int | str, coarsest: int, trajectories: int) -> bool:
    """Tell whether levels keep of the series only the states and the energy's deviation.

    The parameters are as for `stride`. Who asks for every step, or for every n-th, gets every series.
    """
    return samples in ("auto", "common") and trajectories * (coarsest + 1) > LEAN


def extrema_kept(trajectories: int) -> int:
    """Return how many peaks, and how many troughs, a level keeps of every scheme and member.

    It is the same number on every level. Among many `trajectories` (schemes times members) fewer are kept, so that they
    take no more room than a series does (`SMALL`); all are counted.
    """
    return _fewer(MOST_EXTREMA, trajectories)


def events_kept(trajectories: int) -> int:
    """Return of how many events a level keeps the times, of every scheme and member: of fewer among many."""
    return _fewer(MOST_EVENTS, trajectories)


def event_times(experiment: ExperimentSpec) -> int:
    """Return of how many events a level keeps the times; where storage is bounded, of as many as checks ask for."""
    if experiment.model.definition.events is None:
        return 0
    checks = (check.measured for check in experiment.checks)
    numbers = (check.at.event or 0 for check in checks if check.kind == "value")
    usual = 0 if is_bounded(experiment) else events_kept(experiment.trajectories)
    return max(usual, *numbers, 0)


def _fewer(kept: int, trajectories: int) -> int:
    while kept > FEWEST_EXTREMA and kept * trajectories > SMALL:
        kept = max(kept // 2, FEWEST_EXTREMA)
    return kept


def sampling(experiment: ExperimentSpec, level: int) -> int:
    """Return the stride of the stored samples: every how many steps of `level` one is kept, the first and the last too.

    All times of the coarsest level are among them unless the file asks for every n-th step of each level.
    """
    coarsest = experiment.steps(experiment.levels[0])
    return stride(experiment.samples, coarsest, experiment.steps(level), experiment.trajectories)


def is_bounded(experiment: ExperimentSpec) -> bool:
    """Tell whether `experiment` is so large that its storage is bounded (`is_lean`)."""
    coarsest = experiment.steps(experiment.levels[0])
    return is_lean(experiment.samples, coarsest, experiment.trajectories)


def checked_quantities(experiment: ExperimentSpec) -> tuple[str, ...]:
    """Name the quantities that the checks are about."""
    named = (check.measured.about for check in experiment.checks)
    return tuple(dict.fromkeys(name for name in named if name is not None))


def lean_series(experiment: ExperimentSpec) -> tuple[str, ...]:
    """Name the quantities that a level stores as series where storage is bounded (`is_lean`).

    They are the states and the energy deviation, of which every number about an experiment can be worked out, and what
    else a check asks for.
    """
    states = (state.name for state in experiment.model.definition.states)
    # parts of an error are made of the states
    more = (name for name in checked_quantities(experiment) if not is_error_part(name))
    return tuple(dict.fromkeys([*states, "energy_deviation", *more]))


def stored_series(experiment: ExperimentSpec) -> tuple[str, ...]:
    """Name every series that a level stores of each scheme and member.

    Running maxima are among them; where storage is bounded, those that a check asks for.
    """
    running = [name for name in experiment.quantities if name.startswith("energy_deviation")]
    names = experiment.quantities
    if is_bounded(experiment):
        names = lean_series(experiment)
        checks = [check.measured for check in experiment.checks]
        wanted = {
            check.about
            for check in checks
            if check.kind == "conserves"
            or (check.kind == "value" and check.value.endswith("running_max"))
        }
        running = [name for name in running if name in wanted]
    return (*names, *(name + RUNNING for name in running))


def asks_for_peaks(experiment: ExperimentSpec) -> bool:
    """Tell whether a check is about a number that is made of single peaks."""
    checks = [check.measured for check in experiment.checks]
    return any(check.kind == "value" and check.value == _OF_PEAKS for check in checks)
