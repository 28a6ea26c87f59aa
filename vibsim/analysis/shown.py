"""What pictures of checks need beside the number that decides, kept where series are.

- ``value``: the number at every level;
- ``conserves``: the means of the largest energy error so far over [T/8, T/4], [T/4, T/2] and [T/2, T], by which its
  drift is named (`vibsim.analysis.drift`), and the error up to which it is round-off;
- ``equal``: how far the two solutions are from each other over time.

The latter two are those of the level that a check names, at all of its stored times, which `convergence.nc` does not
have.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vibsim.analysis.part import Part
from vibsim.record import Variable, attributes

if TYPE_CHECKING:
    from vibsim.spec import Experiment

Floats = NDArray[np.float64]

PLACES = 241
"""Most places in time of a distance: as many as a picture has pixels."""
WINDOWS = 3
"""Windows over which the drift of an energy is averaged."""

FIELDS: Mapping[str, tuple[str, tuple[str, ...], str]] = {
    "means": (
        "conserves",
        ("scheme", "case", "window"),
        "means of the largest energy error so far, in the unit of the energy",
    ),
    "round_off": (
        "conserves",
        ("scheme", "case"),
        "largest energy error that is taken for round-off, in the unit of the energy",
    ),
    "numbers": (
        "value",
        ("scheme", "case", "level"),
        "the number at every level, in its own unit; that of a step at the same time of every level",
    ),
    "distance": (
        "equal",
        ("case", "place"),
        "largest distance of two solutions around each of evenly spaced places in time, in the unit of the quantity",
    ),
}
"""Variable ``check_<name>``: the kind of checks that have one, its further dimensions, and its meaning."""


def places(part: Part) -> int:
    """Return at how many places in time a distance is kept."""
    return min(PLACES, max(len(record["t"]) for record in part.records.values()))


def by_place(values: Floats, count: int) -> Floats:
    """Return the largest value around each of evenly spaced places from the first to the last time.

    Parameters
    ----------
    values
        Shape (case, t), evenly spaced; NaN is passed over.
    count
        Number of places.

    Returns
    -------
    array
        Shape (case, place); NaN where no time is nearest to a place.
    """
    last = values.shape[-1] - 1
    nearest = np.round(np.arange(last + 1) * ((count - 1) / max(last, 1))).astype(int)
    taken, first = np.unique(nearest, return_index=True)
    found = np.full((*values.shape[:-1], count), np.nan)
    found[..., taken] = np.fmax.reduceat(values, first, axis=-1)
    return found


def shown(
    part: Part, rows: Sequence[tuple[str, Mapping[str, NDArray[Any] | int]]]
) -> dict[str, Variable]:
    """Return the variables of `FIELDS`, with the checks of their kind as first dimension; none where storage is lean.

    Parameters
    ----------
    rows
        Kind and measured fields of the checks, in the order of the file.
    """
    table: dict[str, Variable] = {}
    for name, (kind, dims, words) in FIELDS.items():
        found = [np.asarray(row[name], dtype=np.float64) for of, row in rows if of == kind]
        if found and not part.lean:
            attrs = attributes(f"of each check {kind}: {words}", "1")
            table[f"check_{name}"] = Variable((f"{kind}_check", *dims), np.stack(found), attrs)
    return table


def number_of(experiment: Experiment, name: str) -> int:
    """Return the position of a check among those that measure the same kind of thing."""
    kinds = {check.id: check.measured.kind for check in experiment.checks}
    return [one for one, kind in kinds.items() if kind == kinds[name]].index(name)
