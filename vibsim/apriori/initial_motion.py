"""How the motions of members begin, where the order of a scheme depends on that (`vibsim.schemes.orders`)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, get_args

import numpy as np
from numpy.typing import NDArray

from vibsim.apriori.thresholds import BALANCED
from vibsim.core.array_types import Floats, Integers
from vibsim.formula import values
from vibsim.models import Model, tree
from vibsim.models.base import Numbers
from vibsim.schemes import SCHEMES
from vibsim.schemes.orders import Beginning, depends_on_velocity, is_autonomous
from vibsim.simulation.members import numbers_of

if TYPE_CHECKING:
    from vibsim.experiment import Experiment


BEGINNINGS: tuple[Beginning, ...] = get_args(Beginning)


def beginning_matters(experiment: Experiment) -> bool:
    """Tell whether some scheme promises other orders to motions that begin in a special way."""
    model = experiment.model.definition
    if model.events is not None or model.lookup is not None or depends_on_velocity(model):
        return False
    # a swept option is another one in every member
    return _sweeps(experiment, "schemes.") or any(
        SCHEMES[scheme.kind].depends_on_beginning(scheme.options) for scheme in experiment.schemes
    )


def beginning_varies(experiment: Experiment) -> bool:
    """Tell whether members may begin in different ways, so that each has orders of its own."""
    return beginning_matters(experiment) and _sweeps(experiment, "initial.", "model.")


def _sweeps(experiment: Experiment, *sections: str) -> bool:
    """Tell whether something in one of these sections is swept."""
    keys = experiment.sweep.keys if experiment.sweep else ()
    return any(key.startswith(sections) for key in keys)


def beginnings(experiment: Experiment, columns: Mapping[str, NDArray[Any]]) -> Integers:
    """Return the index in `BEGINNINGS` for every member, shape (case,); of shape (1,) where it is one for all."""
    size = len(next(iter(columns.values()))) if beginning_varies(experiment) else 1
    if not beginning_matters(experiment):
        return np.zeros(size, dtype=np.int64)
    model = experiment.model.definition
    own = {key: column[:size] for key, column in columns.items()}
    parameters, initial = numbers_of(experiment, own, size)
    fastest = np.max([np.abs(initial[name]) for name in model.velocities], axis=0)
    at_rest = (fastest == 0.0) & is_autonomous(model)
    with np.errstate(all="ignore"):
        frequency = np.asarray(model.natural_frequency(parameters), dtype=float)
        rounding = BALANCED * fastest * np.nan_to_num(frequency)
        is_balanced = _pull(model, parameters, initial) <= rounding
    found = np.where(at_rest, BEGINNINGS.index("rest"), BEGINNINGS.index("any"))
    found = np.where(is_balanced, BEGINNINGS.index("balance"), found)
    return np.broadcast_to(found, size)


def _pull(model: Model, parameters: Numbers, initial: Numbers) -> Floats:
    """Return the largest acceleration of a coordinate at the start, shape (case,)."""
    named = {row.name: np.asarray(parameters[row.key], float) for row in model.parameters}
    named |= {**initial, "t": np.zeros(1)}
    pulls = [np.abs(values(tree(model, a), named)) for a in model.accelerations]
    return np.asarray(np.max(pulls, axis=0))
