"""All schemes of a level stepped for all members: trajectories whose arrays have a leading scheme."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import fields, is_dataclass, replace
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from vibsim.core.array_types import Integers
from vibsim.engine import Trajectories, integrate
from vibsim.experiment import sweep_columns
from vibsim.models import Model
from vibsim.schemes import Scheme
from vibsim.simulation import adaptive, structure
from vibsim.simulation.members import Members

if TYPE_CHECKING:
    from vibsim.experiment import Experiment


def solve(
    experiment: Experiment, group: Members, steps: int, every: int, **more: Any
) -> Trajectories:
    """Step every scheme of `experiment` for the members of `group`, which are whole chains (`Sweep.chain`).

    The members of a chain are stepped one after the other: each starts at t = 0 from the last state that the scheme
    itself has of the one before, at the same level.

    Parameters
    ----------
    more
        Of `vibsim.engine.integrate`: ``threads``, ``with_series``, ``n_extrema``.

    Returns
    -------
    Trajectories
        Its arrays have the shapes that it says, behind a first axis of schemes.
    """
    model = experiment.model.definition
    given = np.stack([group.initial[state.name] for state in model.states], axis=-1)
    parameters, place = group.numbers(model), group.index % experiment.chain
    rows = []
    for i, scheme in enumerate(experiment.schemes):
        method, runs, initial = scheme.method, [], given.copy()
        options_of = sweep_columns.option_groups(experiment, i, group.columns)
        for link, (options, alike) in product(range(experiment.chain), options_of):
            members = alike[place[alike] == link]
            if not members.size:
                continue
            is_tabulated = method.adaptive or model.loaded is not None
            for where in adaptive.pieces(members, steps) if is_tabulated else (members,):
                run = of_kind(model, method)(
                    model,
                    method,
                    options,
                    parameters[where],
                    initial[where],
                    group.end[where] / steps,
                    steps,
                    every,
                    **more,
                )
                runs.append((run, where))
                if link < experiment.chain - 1:
                    initial[where + 1] = run.states[:, :, -1].T
        rows.append(_in_order(runs))
    found: Trajectories = _joined(
        rows, lambda arrays: arrays[0][None] if len(arrays) == 1 else np.stack(arrays)
    )
    return found


def of_kind(model: Model, scheme: Scheme) -> Callable[..., Trajectories]:
    """Return what steps members of a model by a scheme."""
    if scheme.adaptive:
        return adaptive.integrate
    return integrate if model.loaded is None else structure.integrate


def _in_order(runs: Sequence[tuple[Trajectories, Integers]]) -> Trajectories:
    """Put members that were stepped with different options where they belong."""
    if len(runs) == 1:
        return runs[0][0]
    order = np.argsort(np.concatenate([where for _, where in runs]))
    by_member = [replace(run, states=np.moveaxis(run.states, 1, 0)) for run, _ in runs]
    found: Trajectories = _joined(by_member, lambda arrays: np.concatenate(arrays)[order])
    return replace(found, states=np.ascontiguousarray(np.moveaxis(found.states, 0, 1)))


def _joined(rows: Sequence[Any], join: Callable[[Sequence[Any]], Any]) -> Any:
    """Return records of one kind as one, with the arrays in them and in the records within joined."""
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
