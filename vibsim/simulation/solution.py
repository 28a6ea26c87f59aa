"""All schemes of a level for all members: trajectories whose arrays have a leading axis of schemes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import fields, is_dataclass, replace
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from vibsim.core.array_types import Integers
from vibsim.core.errors import SimulationError
from vibsim.engine import Trajectories, integrate
from vibsim.experiment import sweep_columns
from vibsim.models import Model
from vibsim.schemes import SCHEMES, Scheme
from vibsim.simulation import adaptive, structure
from vibsim.simulation.members import Members

if TYPE_CHECKING:
    from vibsim.experiment import Experiment


def solve(
    experiment: Experiment, group: Members, steps: int, every: int, **more: Any
) -> Trajectories:
    """Step every scheme of `experiment` for the members of `group`, which are whole chains (`Sweep.chain`).

    The members of a chain are stepped one after the other: each starts at t = 0 from the last state of the previous
    member by the same scheme at the same level.

    Parameters
    ----------
    more
        Further arguments of `vibsim.engine.integrate`: ``threads``, ``with_series``, ``n_extrema``.

    Returns
    -------
    Trajectories
        With a leading axis of schemes in every array.
    """
    model = experiment.model.definition
    start = np.stack([group.initial[state.name] for state in model.states], axis=-1)
    parameters, place = group.numbers(model), group.index % experiment.chain
    rows = []
    for i, scheme in enumerate(experiment.schemes):
        method, runs, initial = scheme.method, [], start.copy()
        option_groups = sweep_columns.option_groups(experiment, i, group.columns)
        for link, (options, same_options) in product(range(experiment.chain), option_groups):
            members = same_options[place[same_options] == link]
            if not members.size:
                continue
            is_tabulated = method.adaptive or model.loaded is not None
            for where in adaptive.pieces(members, steps) if is_tabulated else (members,):
                numbers = parameters[where], initial[where], group.end[where] / steps
                try:
                    run = integrator(model, method)(
                        model, method, options, *numbers, steps, every, **more
                    )
                except (SimulationError, TypeError, ValueError) as error:
                    if SCHEMES.built_in.get(method.kind) is method:
                        raise
                    raise SimulationError(
                        f"scheme {scheme.name}: its step fails: {error}"
                    ) from error
                runs.append((run, where))
                if link < experiment.chain - 1:
                    initial[where + 1] = run.states[:, :, -1].T
        rows.append(_in_order(runs))
    trajectories: Trajectories = _joined(
        rows, lambda arrays: arrays[0][None] if len(arrays) == 1 else np.stack(arrays)
    )
    return trajectories


def integrator(model: Model, scheme: Scheme) -> Callable[..., Trajectories]:
    """Return the function that steps members of a model by a scheme."""
    if scheme.adaptive:
        return adaptive.integrate
    return integrate if model.loaded is None else structure.integrate


def _in_order(runs: Sequence[tuple[Trajectories, Integers]]) -> Trajectories:
    """Join runs with different options, and restore the order of members."""
    if len(runs) == 1:
        return runs[0][0]
    order = np.argsort(np.concatenate([where for _, where in runs]))
    by_member = [replace(run, states=np.moveaxis(run.states, 1, 0)) for run, _ in runs]
    joined: Trajectories = _joined(by_member, lambda arrays: np.concatenate(arrays)[order])
    return replace(joined, states=np.ascontiguousarray(np.moveaxis(joined.states, 0, 1)))


def _joined(rows: Sequence[Any], join: Callable[[Sequence[Any]], Any]) -> Any:
    """Return one dataclass from several of the same type, with `join` applied to their arrays, also nested ones."""
    first = rows[0]
    if first is None:
        return None
    if not is_dataclass(first):
        return join(rows)
    kind: Any = type(first)
    return kind(
        **{
            field.name: _joined([getattr(row, field.name) for row in rows], join)
            for field in fields(kind)
        }
    )
