"""What a level stores beside numbers per member: which quantities over time, and how many extrema."""

from __future__ import annotations

from vibsim.experiment.data import ExperimentSpec
from vibsim.experiment.stored_samples import SMALL, is_lean
from vibsim.models.shared.phase_amplitude_names import is_error_part

RUNNING = "_running_max"
"""Behind the name of an energy deviation: its largest absolute value over every step so far."""
MOST_EXTREMA = 512
"""Peaks, and troughs, that are kept of a scheme and member."""
FEWEST_EXTREMA = 16
"""As many are kept of however many members."""


def asked(experiment: ExperimentSpec) -> tuple[str, ...]:
    """Name the quantities that the checks are about."""
    named = (check.measured.about for check in experiment.checks)
    return tuple(dict.fromkeys(name for name in named if name is not None))


def is_bounded(experiment: ExperimentSpec) -> bool:
    """Tell whether `experiment` is so large that its storage is bounded (`is_lean`)."""
    trajectories = len(experiment.schemes) * experiment.members
    return is_lean(experiment.samples, experiment.steps(experiment.levels[0]), trajectories)


def lean_series(experiment: ExperimentSpec) -> tuple[str, ...]:
    """Name the quantities that a level stores as series where storage is bounded (`is_lean`).

    They are the states and the energy deviation, of which every number about an experiment can be worked out, and what
    else a check asks for.
    """
    states = (state.name for state in experiment.model.definition.states)
    # parts of an error are made of the states
    more = (name for name in asked(experiment) if not is_error_part(name))
    return tuple(dict.fromkeys([*states, "energy_deviation", *more]))


def running_series(experiment: ExperimentSpec) -> tuple[str, ...]:
    """Name the running maxima that a level stores; where storage is bounded, those that a check asks for."""
    known = [name for name in experiment.quantities if name.startswith("energy_deviation")]
    if is_bounded(experiment):
        checks = [check.measured for check in experiment.checks]
        wanted = {
            check.about
            for check in checks
            if check.kind == "conserves"
            or (check.kind == "value" and check.value.endswith("running_max"))
        }
        known = [name for name in known if name in wanted]
    return tuple(name + RUNNING for name in known)


_OF_PEAKS = frozenset({"phase_error_slope"})
"""Values that are made of the first `FEWEST_EXTREMA` peaks, which are kept whatever else is."""


def asks_for_peaks(experiment: ExperimentSpec) -> bool:
    """Tell whether a check is about a number that is made of single peaks."""
    checks = [check.measured for check in experiment.checks]
    return any(check.kind == "value" and check.value in _OF_PEAKS for check in checks)


def stored_series(experiment: ExperimentSpec) -> tuple[str, ...]:
    """Name every series that a level stores of each scheme and member."""
    bounded = is_bounded(experiment)
    names = lean_series(experiment) if bounded else experiment.quantities
    return (*names, *running_series(experiment))


def extrema_kept(steps: int, trajectories: int) -> int:
    """Return how many peaks, and how many troughs, a level keeps of every scheme and member.

    There cannot be more than half as many as steps. Among many members fewer are kept, so that they take no more room
    than a series does (`SMALL`); all are counted.

    Parameters
    ----------
    steps
        Of the level.
    trajectories
        Number of schemes times number of members.
    """
    kept = min(steps // 2 + 1, MOST_EXTREMA)
    while kept > FEWEST_EXTREMA and kept * trajectories > SMALL:
        kept = max(kept // 2, FEWEST_EXTREMA)
    return kept
