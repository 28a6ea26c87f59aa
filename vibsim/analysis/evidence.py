"""From the convergence Record to the numbers that a verdict rests on, for one quantity and one norm."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vibsim.analysis.floor import norm_of_floor, relative_floor
from vibsim.analysis.rules import Evidence
from vibsim.analysis.series import scatter
from vibsim.models import MODELS
from vibsim.record import Record
from vibsim.schemes import SCHEMES

if TYPE_CHECKING:
    from vibsim.spec import Experiment

Floats = NDArray[np.float64]


def formal_orders(experiment: Experiment, quantity: str) -> Floats:
    """Return the order that every scheme promises for a quantity, shape (scheme,)."""
    model = MODELS[experiment.model.kind]
    return np.array(
        [SCHEMES[s.kind].formal_order(quantity, model, s.options) for s in experiment.schemes],
        dtype=np.float64,
    )


def relative_floors(experiment: Experiment, steps: tuple[int, ...]) -> Floats:
    """Return the predicted round-off relative to the solution, shape (scheme, 1, level)."""
    floors = [relative_floor(SCHEMES[s.kind], s.options, steps) for s in experiment.schemes]
    return np.stack(floors)[:, None, :]


def spacing_of(record: Record) -> Floats:
    """Return the distance between common points of a convergence Record, shape (case,) or (1,)."""
    apart = float(record["t"][1] - record["t"][0])
    return np.asarray(apart * (record["end"] if "end" in record else np.ones(1)), dtype=np.float64)


def omega_dt(record: Record) -> Floats:
    """Return w dt of a convergence Record, shape (case, level); stored without levels where all have the same."""
    values = np.asarray(record["omega_dt"], dtype=np.float64)
    by_level = values if values.ndim == 2 else values[:, None]
    return np.broadcast_to(by_level, (len(values), len(record["level"])))


def ends_at_the_end(record: Record) -> bool:
    """Say whether the last common point is the end of the time interval."""
    return bool(np.asarray(record.attrs["end_included"]).item())


def evidence(
    experiment: Experiment,
    record: Record,
    quantity: str,
    norm: str,
    order: Floats,
    tolerance: float,
) -> Evidence:
    """Collect the evidence on a quantity in a norm.

    Parameters
    ----------
    record
        Convergence Record; its verdict variables are not needed.
    order
        The order that is expected of every scheme, shape (scheme,).

    Returns
    -------
    Evidence
        Arrays of shape (scheme, case, ...).
    """
    levels = tuple(int(level) for level in record["level"])
    spacing, end_included = spacing_of(record), ends_at_the_end(record)
    finest = record[f"{quantity}_finest"]
    shape = finest.shape[:2]
    kind = record.words("norm").index(norm)
    pairs = len(levels) - 1
    difference = (
        record[f"{quantity}_difference"] if pairs else np.empty((*shape, 0, finest.shape[2]))
    )
    points = len(record["t"])
    floor = np.moveaxis(record[f"{quantity}_floor"], -1, 0)
    relative = relative_floors(experiment, tuple(int(n) for n in record["steps"]))
    size = np.max(np.abs(np.nan_to_num(finest)), axis=-1)
    failed = record["status"] != 0
    scatters = [
        scatter(difference[:, :, i], difference[:, :, i + 1], norm, end_included)
        for i in range(pairs - 1)
    ]
    limits = [SCHEMES[s.kind].stability_limit for s in experiment.schemes]
    return Evidence(
        levels=levels,
        difference=(
            record[f"{quantity}_difference_norm"][..., kind] if pairs else np.empty((*shape, 0))
        ),
        scatter=np.stack(scatters, axis=-1) if scatters else np.empty((*shape, 0)),
        floor=np.moveaxis(norm_of_floor(floor, norm, points, spacing), 0, -1),
        order=np.broadcast_to(order[:, None], shape),
        tolerance=tolerance,
        error=record[f"{quantity}_error_norm"][..., kind],
        size=norm_of_floor(size, norm, points, spacing),
        failed=failed,
        applicable=np.any(np.isfinite(finest), axis=-1) | np.any(failed, axis=-1),
        omega_dt=np.broadcast_to(omega_dt(record), (*shape, len(levels))),
        stability_limit=np.broadcast_to(
            np.array([np.inf if limit is None else limit for limit in limits])[:, None], shape
        ),
        growth=growth(experiment, record),
        span=np.broadcast_to(omega_dt(record)[:, 0] * float(record["steps"][0]), shape),
        relative_floor=np.broadcast_to(relative[..., 0], shape),
    )


def growth(experiment: Experiment, record: Record) -> Floats:
    """Return the largest position of every level over the largest exact one, shape (scheme, case, level).

    Without an exact solution the coarsest level takes its place. NaN where the reference vanishes.
    """
    position = MODELS[experiment.model.kind].position
    low, high = (record[f"{position}_{name}"] for name in ("min", "max"))
    largest = np.maximum(np.abs(low), np.abs(high))
    if f"{position}_exact" in record:
        reference = np.max(np.abs(record[f"{position}_exact"]), axis=-1)[..., None]
    else:
        reference = largest[..., :1]
    usable = np.isfinite(largest) & (reference > 0)
    return np.where(usable, largest, np.nan) / np.where(usable, reference, 1.0)
