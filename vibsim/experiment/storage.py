"""What a level stores: which steps, which time series, how many extrema. Large sweeps store less."""

from __future__ import annotations

from vibsim.core.vocabulary import VECTORS, is_error_part
from vibsim.experiment.data import ExperimentSpec
from vibsim.experiment.value_names import MOST_EVENTS
from vibsim.models.base import has_solution

SMALL = 200_000
"""Largest number of samples of one variable for which ``samples: auto`` stores every step of a level."""
LARGE = 2**17
"""Largest number of samples of one variable for which ``samples: auto`` stores all times of the coarsest level."""
FEWEST_INTERVALS = 16  # fewest sampling intervals to which ``samples: auto`` thins a member
LEAN = 2**18  # samples of one variable on the coarsest level above which an experiment is lean
MOST_EXTREMA = 512  # largest number of peaks, and of troughs, stored per scheme and member
FEWEST_EXTREMA = 16  # number of extrema stored per scheme and member however many members there are
MOST_REFERENCES = 1024  # largest number of members for which reference solutions are computed
RUNNING = "_running_max"
"""Suffix of the series with the running maximum of the absolute energy deviation, over all steps so far."""
_PEAK_VALUE = "phase_error_slope"
"""The value that is computed from single peaks, the first `FEWEST_EXTREMA`, which are always stored."""


def stride(samples: int | str, coarsest: int, steps: int, trajectories: int) -> int:
    """Return n such that every n-th step of a level is stored.

    ``common`` stores the times of the coarsest level and ``all`` every step. ``auto`` chooses between them by size, or
    thins the times of the coarsest level. A number n applies to every level; the levels then share the stored times of
    the coarsest one.

    `coarsest` and `steps` are the numbers of steps of the coarsest level and of this one, and n divides the first;
    `trajectories` is the number of schemes times that of members.
    """
    if isinstance(samples, int):
        return samples
    if samples == "all" or (samples == "auto" and trajectories * (steps + 1) <= SMALL):
        return 1
    # the smallest power of two that thins to `LARGE` samples, as far as the number of steps is divisible
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
    """Tell whether levels store only the states and the energy deviation as time series.

    The parameters are those of `stride`. An experiment with ``all`` or a stride in the file is never lean.
    """
    return samples in ("auto", "common") and trajectories * (coarsest + 1) > LEAN


def extrema_kept(trajectories: int) -> int:
    """Return the number of peaks, and of troughs, that a level stores per scheme and member.

    It is the same on every level. With many `trajectories` (schemes times members) fewer are stored, so that they take
    no more room than a series (`SMALL`). All of them are counted.
    """
    return _bounded(MOST_EXTREMA, trajectories)


def event_times(experiment: ExperimentSpec) -> int:
    """Return the number of event times that a level stores per scheme and member.

    It is smaller with many of them; if storage is bounded, only as large as checks need.
    """
    if experiment.model.definition.events is None:
        return 0
    checks = (check.measured for check in experiment.checks)
    numbers = (check.at.event or 0 for check in checks if check.kind == "value")
    kept = 0 if is_bounded(experiment) else _bounded(MOST_EVENTS, experiment.trajectories)
    return max(kept, *numbers, 0)


def _bounded(count: int, trajectories: int) -> int:
    while count > FEWEST_EXTREMA and count * trajectories > SMALL:
        count = max(count // 2, FEWEST_EXTREMA)
    return count


def sampling(experiment: ExperimentSpec, level: int) -> int:
    """Return the stride of the stored samples of `level` (see `stride`), which include the first and the last step."""
    coarsest = experiment.steps(experiment.levels[0])
    return stride(experiment.samples, coarsest, experiment.steps(level), experiment.trajectories)


def is_bounded(experiment: ExperimentSpec) -> bool:
    """Tell whether the storage of `experiment` is bounded because it is large (`is_lean`)."""
    coarsest = experiment.steps(experiment.levels[0])
    return is_lean(experiment.samples, coarsest, experiment.trajectories)


def stores_references(experiment: ExperimentSpec) -> bool:
    """Tell whether levels store reference solutions: no exact solution is known, but one can be computed."""
    model = experiment.model.definition
    # in a chain the initial values depend on the level
    is_needed = model.exact is None and has_solution(model) and experiment.chain == 1
    return is_needed and experiment.members <= MOST_REFERENCES and not is_bounded(experiment)


def checked_quantities(experiment: ExperimentSpec) -> tuple[str, ...]:
    """Return the names of the quantities of all checks."""
    named = (check.measured.about for check in experiment.checks)
    return tuple(dict.fromkeys(name for name in named if name is not None))


def lean_series(experiment: ExperimentSpec) -> tuple[str, ...]:
    """Return the names of the time series that a level stores if storage is bounded (`is_lean`).

    They are the states and the energy deviation, from which all other numbers can be computed, and the quantities of
    checks.
    """
    states = (state.name for state in experiment.model.definition.states)
    # parts of an error and vectors are computed from the states
    computed = {name for name in checked_quantities(experiment) if is_error_part(name)} | {*VECTORS}
    checked = (name for name in checked_quantities(experiment) if name not in computed)
    return tuple(dict.fromkeys([*states, "energy_deviation", *checked]))


def stored_series(experiment: ExperimentSpec) -> tuple[str, ...]:
    """Return the names of all time series that a level stores.

    They include running maxima; if storage is bounded, only those that a check needs.
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
    """Tell whether a check needs a number that is computed from single peaks."""
    checks = [check.measured for check in experiment.checks]
    return any(check.kind == "value" and check.value == _PEAK_VALUE for check in checks)
