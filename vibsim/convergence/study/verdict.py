"""The verdict on a ladder that any solver computed, and what it can be turned into."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from vibsim.convergence.study.verdict_data import VerdictData

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class LadderVerdict(VerdictData):
    """What a ladder of levels says: facts, words and the table of levels; `print` shows it."""

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
