"""Figures that a source shows: each one asked for is drawn on the page of its experiment, under its number there."""

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
OVER_TIME = ("quantities", "panels", "each", "until", "beside")
"""Keys that belong to `over_time` alone."""
LEVEL, MEMBER = "level", "member"
"""What the panels of a figure may stand for beside a swept key."""


class FigureOfSource(Section):
    """A figure of a source."""

    stand_ins = MappingProxyType({"shows": None, "source": None})

    shows: Shows
    """What it shows."""
    source: Citation
    """Where it stands: the text, and the number of the figure."""
    quantities: Annotated[tuple[Text, ...], short(MAX_ENTRIES)] = ()
    """What is drawn over time, each in a panel; the position when left out."""
    panels: Text | None = None
    """What has a panel each: ``level``, ``member`` or a swept key."""
    each: Text | None = None
    """What has a figure each: ``member`` or a swept key."""
    until: Positive | None = None
    """When the figure ends; the end of the run when left out."""
    beside: Annotated[dict[str, Text], AfterValidator(FrozenDict)] = Field(
        {}, validate_default=True
    )
    """Further curves by their names: formulas in ``t`` and the parameters."""
