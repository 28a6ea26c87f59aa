"""The solution of an experiment, extrapolated over its levels, without files."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from vibsim.comparison.best_solution import in_order, record_of, starts
from vibsim.comparison.extrapolate_members import Extrapolated, join_members
from vibsim.experiment import storage
from vibsim.ladder.choosing import resolve
from vibsim.ladder.solving import climb
from vibsim.simulation.level import coordinates
from vibsim.simulation.members import Members, members

if TYPE_CHECKING:
    import xarray

    from vibsim.experiment import Experiment

POINTS_AT_A_TIME = 2**18
"""Most points of one level that are in memory at a time."""


def best(
    experiment: Experiment, levels: Sequence[int] | None = None, *, threads: int = 1
) -> xarray.Dataset:
    """Extrapolate the solution of every scheme and member over the levels of a ladder.

    Parameters
    ----------
    levels
        Levels in place of those of the experiment. An experiment with a tolerance and no levels gets the cheapest ones
        that reach it.
    threads
        Number of threads that share the members; no result depends on it.

    Returns
    -------
    xarray.Dataset
        The content of ``best.nc``: every state over (scheme, case, t), the bound of its error ``<state>_error``, the
        coarsest and the finest level used, ``level_first`` and ``level_last``, and ``reached``.

    Raises
    ------
    VibsimError
        Where no ladder reaches the tolerance: an `InputError` that states the smallest bound and why no smaller one is
        possible. Where `levels` break a rule for the levels of a file: an `InputError` too.
    """
    if levels is not None:
        experiment = experiment.with_levels(levels)
    elif not experiment.levels:
        experiment = resolve(experiment)
    steps = tuple(experiment.steps(level) for level in experiment.levels)
    every = storage.sampling(experiment, experiment.levels[0])
    points = steps[0] // every
    size = max(POINTS_AT_A_TIME // (points + 1), 1)
    schemes = experiment.ladder

    def extrapolated(scheme: int, group: Members) -> Extrapolated:
        return in_order(
            [
                (climb(method, start, steps, points, threads=threads), where)
                for method, start, where in starts(experiment, scheme, group)
            ]
        )

    groups = [
        members(experiment, first, min(first + size, experiment.members))
        for first in range(0, experiment.members, size)
    ]
    rows = [join_members([extrapolated(i, group) for group in groups]) for i in schemes]
    group = members(experiment, 0, experiment.members)
    names = [experiment.schemes[i].name for i in schemes]
    same_end = not experiment.end_varies
    model = experiment.model.definition
    coords = coordinates(model, names, group, steps[0], every, same_end=same_end)
    return record_of(experiment, experiment.levels, coords, rows).to_xarray()
