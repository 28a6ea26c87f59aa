"""The verdict on a ladder that any solver computed: facts, the table of levels, and what it can be turned into."""

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
    """One row of the table of levels; None where there is no such number.

    Of numbers all entries are differences with their sign, of series and fields they are norms (root mean square).
    """

    h: float
    value: float | None
    """The number, or the norm of the values."""
    difference: float | None
    """This level minus the next finer one."""
    ratio: float | None
    """This difference over the next one."""
    order: float | None
    """The order that this ratio has."""
    error: float | None
    """This level minus the exact values; where these are not known, minus the extrapolated ones."""


@dataclass(frozen=True)
class LadderVerdict:
    """What a ladder of levels says: facts, words and the table of levels; `print` shows it.

    Numbers are None where the levels do not tell them.
    """

    quantity: str
    status: Status
    reason: str
    """One of `vibsim.core.vocabulary.REASONS`."""
    order: float | None
    """The observed order of the finest three levels that may be believed."""
    order_low: float | None
    order_high: float | None
    """Its interval of 95 %."""
    h_used: tuple[float, ...]
    """Step sizes of the levels that the order rests on, the coarsest first."""
    error: float | None
    """Of the finest level: computed minus exact of a number, the root mean square of a series or field."""
    error_bound: float | None
    """What the size of that error does not exceed, in 95 % of such ladders."""
    relative_error: float | None
    """The size of the error over that of the finest level."""
    best: float | None
    """The number extrapolated over the levels; None of a series or field."""
    best_bound: float | None
    """What the error of `best` does not exceed."""
    gci: float | None
    """The grid convergence index of the finest level, relative, with safety factor 1.25 and the observed order."""
    sentence: str
    """What was found, in words."""
    advice: str
    """What to do about it; empty where nothing is to be done."""
    levels: tuple[Level, ...]
    """The table of levels, the coarsest first."""
    expected: float | None = None
    at_least: float | None = None
    """The order that was asked for."""
    size_name: str = "h"
    """Name of the step size."""
    is_exact_known: bool = False
    """Whether the errors of the levels are true ones."""
    dims: tuple[str, ...] = ()
    coords: Mapping[str, NDArray[Any]] = field(default_factory=dict, repr=False, compare=False)
    """The common points of the levels."""
    values: Floats = field(default_factory=lambda: np.empty(0), repr=False, compare=False)
    """What was compared: values of all levels at the common points, the coarsest first, shape ``(n, *points)``."""
    best_values: Floats | None = field(default=None, repr=False, compare=False)
    """The values extrapolated over the levels, shape ``(*points)``."""

    @property
    def id(self) -> str:
        """The quantity, under the name that it has in a verdict on an experiment."""
        return self.quantity

    @property
    def text(self) -> str:
        """The sentence, under the name that it has in a verdict on an experiment."""
        return self.sentence

    @property
    def is_number(self) -> bool:
        """Whether a single number was judged."""
        return bool(self.values[0].size == 1) if len(self.values) else not self.dims

    def to_dict(self) -> dict[str, Any]:
        """Return the facts as JSON has them: the entry of `vibsim judge --json`."""
        return {key: jsonable(getattr(self, key)) for key in KEYS}

    def to_xarray(self) -> xarray.Dataset:
        """Return the table of levels, the compared and the extrapolated values; the facts are the attributes."""
        from vibsim.convergence.study.labelled import dataset

        return dataset(self)

    def plot(self, path: str | Path | None = None) -> Figure:
        """Draw errors and differences against the step size; save the figure where a `path` is given.

        The figure is one of matplotlib, free of pyplot's global state.
        """
        from vibsim.convergence.study.figure import convergence_figure

        figure = convergence_figure(self)
        if path is not None:
            figure.savefig(path)
        return figure

    def __str__(self) -> str:
        from vibsim.convergence.study.terminal import as_text

        return as_text(self)
