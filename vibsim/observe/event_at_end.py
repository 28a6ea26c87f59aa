"""Members of which no level can tell whether an event happens before the end of the run.

A guard g is 0 at an event (`vibsim.models.events`). The event nearest to the end is about ``g/g'`` away from it, with g
and its rate g' at the end; or the last event is known. If the levels change this distance by about as much as it is,
errors of the scheme or rounding decide on which side of the end the event lies.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from vibsim.convergence.differences import last_change, safe_ratio
from vibsim.convergence.thresholds import ROUND_OFF_SAFETY, STILL_TO_CHANGE
from vibsim.core.array_types import Flags, Floats
from vibsim.core.record import Record
from vibsim.formula import Expression, Name, values_of
from vibsim.models import Model
from vibsim.models.base import rate, tree
from vibsim.models.events import Crossings, Impact
from vibsim.observe.common_grid import Grid
from vibsim.simulation.members import Members


def changed_at_events(model: Model) -> frozenset[str]:
    """Return the states that jump at events."""
    match model.events:
        case Crossings(rows):
            return frozenset(name for row in rows for name, _ in row.then)
        case Impact():
            return frozenset(model.velocities)
    return frozenset()


def may_jump(model: Model, quantity: str) -> bool:
    """Tell whether a quantity may jump at an event: all but the states that none changes."""
    changed = changed_at_events(model)
    return bool(changed) and quantity not in {row.name for row in model.states} - changed


def is_at_end(
    model: Model, records: Mapping[int, Record], grid: Grid, group: Members, floor: Floats
) -> Flags:
    """Tell whether an event is too near to the end to be told from one behind it, shape (scheme, case).

    Parameters
    ----------
    floor
        Predicted round-off of the finest level, relative to the solution.
    """
    rows = [records[level] for level in grid.levels]
    found = np.zeros(np.shape(rows[-1]["status"]), dtype=bool)
    if model.events is None:
        return found
    guards = _guards(model)
    distances = [
        np.stack([_distance(model, row, group, guard) for row in rows], axis=-1) for guard in guards
    ]
    counts = np.stack([row["event_count"] for row in rows[-3:]], axis=-1)
    last = np.stack([group.end - row["last_event_time"] for row in rows], axis=-1)
    distances.append(np.where(np.all(counts == counts[..., :1], axis=-1)[..., None], last, np.nan))
    with np.errstate(invalid="ignore"):
        for distance in distances:
            error = STILL_TO_CHANGE * last_change(distance) + ROUND_OFF_SAFETY * floor * group.end
            found |= np.abs(distance[..., -1]) <= error
    return found


def _guards(model: Model) -> list[Expression]:
    """Return the formulas that vanish where the state may jump or the motion may end."""
    match model.events:
        case Crossings(rows):
            return [tree(model, row.guard) for row in rows]
        case Impact():
            return [Name(model.position)]
    return []


def _distance(model: Model, record: Record, group: Members, guard: Expression) -> Floats:
    """Return how far from the end a guard vanishes, or since when the member is at rest, shape (scheme, case)."""
    numbers = {row.name: np.asarray(record[row.name])[..., -1] for row in model.states}
    parameters = {name: value[:, 0] for name, value in group.by_name(model).items()}
    value, change = values_of(
        [guard, rate(model, guard)], {**parameters, **numbers, "t": group.end}
    )
    rest, shape = np.asarray(record["rest_time"]), np.shape(record["status"])
    distance = safe_ratio(*(np.broadcast_to(x, shape) for x in (value, change)))
    return np.where(np.isnan(rest), distance, group.end - rest)
