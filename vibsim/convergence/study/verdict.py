"""The verdict on a ladder of any solver: facts, the table of levels, and conversions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vibsim.core.array_types import Floats
from vibsim.core.vocabulary import Status, jsonable

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

KEYS = (
    *("quantity", "status", "reason", "order", "order_low", "order_high", "h_used", "error"),
    *("error_bound", "best", "best_bound", "gci", "sentence", "advice"),
)
"""Keys of a verdict as JSON."""


@dataclass(frozen=True)
class Level:
    """One row of the table of levels; None where a number does not exist.

    For numbers all entries are signed; for series and fields they are norms (root mean square).
    """

    h: float
    value: float | None
    """The number, or the norm of the values."""
    difference: float | None
    """This level minus the next finer one."""
    ratio: float | None
    """This difference divided by the next one."""
    order: float | None
    """The order that corresponds to this ratio."""
    error: float | None
    """This level minus the exact values; if these are unknown, minus the extrapolated ones."""


@dataclass(frozen=True)
class LadderVerdict:
    """The verdict on a ladder of levels: facts, words and the table of levels; `print` shows it.

    Numbers are None if the levels do not determine them.
    """

    quantity: str
    status: Status
    reason: str
    """One of `vibsim.core.vocabulary.REASONS`."""
    order: float | None
    """The observed order of the finest three levels that the verdict rests on."""
    order_low: float | None
    order_high: float | None
    """The ends of its 95 % interval."""
    h_used: tuple[float, ...]
    """Step sizes of the levels that the order rests on, the coarsest first."""
    error: float | None
    """Error of the finest level: computed minus exact for a number, root mean square for a series or field."""
    error_bound: float | None
    """Upper bound of the size of that error, which holds for 95 % of such ladders."""
    relative_error: float | None
    """Size of the error relative to the size of the finest level."""
    best: float | None
    """The number extrapolated over the levels; None for a series or field."""
    best_bound: float | None
    """Upper bound of the error of `best`."""
    gci: float | None
    """The grid convergence index of the finest level, relative, with safety factor 1.25 and the observed order."""
    sentence: str
    """The result in words."""
    advice: str
    """What to do about it; empty if nothing needs to be done."""
    levels: tuple[Level, ...]
    """The table of levels, the coarsest first."""
    expected: float | None = None
    at_least: float | None = None
    """The expected order."""
    size_name: str = "h"
    """Name of the step size."""
    is_exact_known: bool = False
    """Whether the errors of the levels are true errors."""
    dims: tuple[str, ...] = ()
    coords: Mapping[str, NDArray[Any]] = field(default_factory=dict, repr=False, compare=False)
    """The common points of the levels."""
    values: Floats = field(default_factory=lambda: np.empty(0), repr=False, compare=False)
    """Values of all levels at the common points, the coarsest first, shape ``(n, *points)``."""
    best_values: Floats | None = field(default=None, repr=False, compare=False)
    """The values extrapolated over the levels, shape ``(*points)``."""

    @property
    def id(self) -> str:
        """The quantity; verdicts on experiments have the same property."""
        return self.quantity

    @property
    def text(self) -> str:
        """The sentence; verdicts on experiments have the same property."""
        return self.sentence

    @property
    def is_number(self) -> bool:
        """Whether a single number was judged."""
        return bool(self.values[0].size == 1) if len(self.values) else not self.dims

    def to_dict(self) -> dict[str, Any]:
        """Return the facts as a JSON object: an entry of `vibsim judge --json`."""
        return {key: jsonable(getattr(self, key)) for key in KEYS}

    def to_xarray(self) -> xarray.Dataset:
        """Return the table of levels and the compared and extrapolated values, with the facts as attributes."""
        from vibsim.convergence.study.labelled import dataset

        return dataset(self)

    def plot(self, path: str | Path | None = None) -> Figure:
        """Draw errors and differences against the step size; save the figure if a `path` is given.

        The result is a matplotlib figure that does not use pyplot.
        """
        from vibsim.convergence.study.figure import convergence_figure

        figure = convergence_figure(self)
        if path is not None:
            figure.savefig(path)
        return figure

    def __str__(self) -> str:
        from vibsim.convergence.study.terminal import as_text

        return as_text(self)
