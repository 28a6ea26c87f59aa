"""Figures of a source, which the report redraws under their original numbers."""

from __future__ import annotations

from types import MappingProxyType
from typing import Annotated, Literal, get_args

from pydantic import AfterValidator, Field

from vibsim.experiment.schema.citation import Citation
from vibsim.experiment.schema.fields import MAX_ENTRIES, FrozenDict, Positive, Section, Text, short

Shows = Literal[
    "over_time", "phase_plane", "path", "peaks", "local_frequency", "growth", "frequency", "second_difference",
    "differences", "energy_error", "grids", "spring", "spectrum", "poincare", "player",
]  # fmt: skip
KINDS: tuple[str, ...] = get_args(Shows)
OVER_TIME = ("quantities", "panels", "each", "until", "beside")  # keys of `over_time` alone
LEVEL, MEMBER = "level", "member"  # values of `panels` and `each` besides swept keys


class FigureOfSource(Section):
    """A figure of a source."""

    stand_ins = MappingProxyType({"shows": None, "source": None})

    shows: Shows
    """The kind of figure."""
    source: Citation
    """The source: the text, and the number of the figure."""
    quantities: Annotated[tuple[Text, ...], short(MAX_ENTRIES)] = ()
    """Quantities that are drawn over time, each in a panel; the position when left out."""
    panels: Text | None = None
    """One panel per ``level``, ``member`` or value of a swept key."""
    each: Text | None = None
    """One figure per ``member`` or value of a swept key."""
    until: Positive | None = None
    """Last time of the figure; the end of the run when left out."""
    beside: Annotated[dict[str, Text], AfterValidator(FrozenDict)] = Field(
        {}, validate_default=True
    )
    """Further curves by name: formulas in ``t`` and the parameters."""
