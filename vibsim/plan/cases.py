"""Members of a sweep, and the samples kept of each level."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from vibsim.spec import Experiment


def count(experiment: Experiment) -> int:
    """Return the number of members: 1 without a sweep."""
    return experiment.members


def columns(experiment: Experiment, start: int, stop: int) -> dict[str, NDArray[np.float64]]:
    """Return the swept values of the members from `start` up to, not including, `stop`.

    Parameters
    ----------
    experiment
        Its sweep is a grid in the order written, last key fastest.
    start, stop
        Range of the global member index.

    Returns
    -------
    dict
        Dotted key to values, shape (stop - start,), in the unit of the key; empty without a sweep.
    """
    import numpy as np

    if experiment.sweep is None:
        return {}
    axes = experiment.sweep.axes
    index = np.unravel_index(np.arange(start, stop), [len(values) for _, values in axes])
    return {
        key: np.asarray(values, dtype=np.float64)[position]
        for (key, values), position in zip(axes, index, strict=True)
    }


def sampling(experiment: Experiment, level: int) -> int:
    """Return the stride of the stored samples: every how many steps of `level` one is kept.

    The first and the last time are always among them, and so are all times of the coarsest level
    unless the file asks for every n-th step of each level.
    """
    from vibsim.spec.sampling import stride

    coarsest = experiment.steps(experiment.levels[0])
    trajectories = len(experiment.schemes) * experiment.members
    return stride(experiment.samples, coarsest, experiment.steps(level), trajectories)
