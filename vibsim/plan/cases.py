"""Members of a sweep, and the samples kept of each level."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy as np
    from numpy.typing import NDArray

    from vibsim.experiment import Experiment


def columns(experiment: Experiment, start: int, stop: int) -> dict[str, NDArray[Any]]:
    """Return the swept values of the members from `start` up to, not including, `stop`.

    Parameters
    ----------
    experiment
        Its sweep is a grid of its axes in the order written, last axis fastest.
    start, stop
        Range of the global member index.

    Returns
    -------
    dict
        Dotted key to values, shape (stop - start,): float64 in the unit of the key, or text where the options of a
        scheme are swept. Empty without a sweep.
    """
    if experiment.sweep is None:
        return {}
    from vibsim.experiment.sweep_columns import columns as values_of

    return values_of(experiment.sweep.axes, start, stop)


def sampling(experiment: Experiment, level: int) -> int:
    """Return the stride of the stored samples: every how many steps of `level` one is kept.

    The first and the last time are always among them, and so are all times of the coarsest level
    unless the file asks for every n-th step of each level.
    """
    from vibsim.experiment.storage import stride

    coarsest = experiment.steps(experiment.levels[0])
    trajectories = len(experiment.schemes) * experiment.members
    return stride(experiment.samples, coarsest, experiment.steps(level), trajectories)


def option_groups(
    experiment: Experiment, scheme: int, columns: Mapping[str, NDArray[Any]]
) -> list[tuple[Mapping[str, str | float | bool], NDArray[np.int64]]]:
    """Return the options that members have of one scheme.

    Parameters
    ----------
    experiment
        The experiment.
    scheme
        Number of the scheme.
    columns
        Swept values of some members, as `columns` returns them.

    Returns
    -------
    list
        Every distinct set of options, in the order in which members first have it, with the positions of those
        members in `columns`, increasing. Without a sweep, the one set of the one member. A word is text, a number a
        float, and a flag a bool.
    """
    import numpy as np

    from vibsim.experiment.schema.sweep import as_option

    base = experiment.scheme_options(scheme)
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
