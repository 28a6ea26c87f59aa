"""Members of which no level can tell whether an event happens before the end of the run.

A guard g is 0 at an event (`vibsim.models.events`). If the levels change g at the end, or how long before it the last
event was, by about as much as it is, errors of the scheme or rounding decide on which side of the end the event lies.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from vibsim.convergence.differences import last_change
from vibsim.convergence.thresholds import ROUND_OFF_SAFETY, STILL_TO_CHANGE
from vibsim.core.array_types import Flags, Floats
from vibsim.core.record import Record
from vibsim.formula import Expression, values_of
from vibsim.models import Model
from vibsim.models.base import rate, tree
from vibsim.observe.common_grid import Grid
from vibsim.simulation.members import Members


def may_jump(model: Model, quantity: str) -> bool:
    """Tell whether a quantity may jump at an event: all but the states that none changes."""
    changed = set(model.events.changed(model.velocities) if model.events else ())
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
    round_off = ROUND_OFF_SAFETY * floor * group.end
    since_rest, since_last = (
        np.stack([group.end - row[name] for row in rows], axis=-1)
        for name in ("rest_time", "last_event_time")
    )
    moves = np.isnan(since_rest[..., -1])
    counts = np.stack([row["event_count"] for row in rows[-3:]], axis=-1)
    same_event = np.all(counts == counts[..., :1], axis=-1)
    with np.errstate(all="ignore"):
        found |= same_event & _may_be_zero(since_last, round_off)
        found |= ~moves & _may_be_zero(np.nan_to_num(since_rest), round_off)
        for direction, guard in model.events.guards(model.position, model.velocity):
            numbers = [_at_end(model, row, group, tree(model, guard)) for row in rows]
            value, slope = (np.stack(x, axis=-1) for x in zip(*numbers, strict=True))
            # a body that rests on a stop does not move towards it
            comes = np.any((direction * slope >= 0.0) & (slope != 0.0), axis=-1)
            found |= moves & comes & _may_be_zero(value, round_off * np.abs(slope[..., -1]))
    return found


def _may_be_zero(numbers: Floats, round_off: Floats) -> Flags:
    """Tell whether finer levels may bring a number to 0, from its values on all levels, shape (..., level)."""
    error = STILL_TO_CHANGE * last_change(numbers) + round_off
    return np.asarray(np.abs(numbers[..., -1]) <= error)


def _at_end(
    model: Model, record: Record, group: Members, guard: Expression
) -> tuple[Floats, Floats]:
    """Return a guard at the end of the run and its rate there, shape (scheme, case)."""
    states = {row.name: np.asarray(record[row.name])[..., -1] for row in model.states}
    parameters = {name: value[:, 0] for name, value in group.by_name(model).items()}
    value, change = (
        np.broadcast_to(x, np.shape(record["status"]))
        for x in values_of([guard, rate(model, guard)], {**parameters, **states, "t": group.end})
    )
    return value, change
