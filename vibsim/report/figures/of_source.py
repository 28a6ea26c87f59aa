"""The figures of a source text that an experiment file names, drawn under their numbers there."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace

from vibsim.experiment.schema.figures import FigureOfSource
from vibsim.report import words
from vibsim.report.choice import CheckedLadder
from vibsim.report.figures import (
    accuracy,
    extrema,
    model_curves,
    over_time,
    plane,
    spectra,
    theory,
    time,
)
from vibsim.report.style import Picture
from vibsim.report.tables.source_figures import PLAYER
from vibsim.report.types import Experiment

DRAWN: Mapping[str, Callable[[CheckedLadder], Picture | None]] = {
    "phase_plane": lambda lead: plane.phase(lead.record, lead.record.all_members),
    "path": lambda lead: plane.path(lead.record, lead.record.all_members),
    "peaks": lambda lead: extrema.local(lead.record, lead.record.all_members),
    "local_frequency": lambda lead: extrema.frequency(lead.record),
    "growth": lambda lead: theory.growing(lead.record),
    "frequency": lambda lead: accuracy.frequency(lead.record),
    "second_difference": lambda lead: accuracy.second_difference(lead.record),
    "differences": lambda lead: time.overlay(lead.of(lead.record.model.position)),
    "energy_error": lambda lead: (
        time.energy(lead.record, lead.member) if "energy_deviation_scaled" in lead.record else None
    ),
    "grids": lambda lead: model_curves.grids(lead.record),
    "spring": lambda lead: model_curves.spring(lead.record),
    "spectrum": lambda lead: spectra.spectrum(lead.record, lead.member),
    "poincare": lambda lead: spectra.poincare(lead.record, lead.record.all_members),
}
"""Kind of a figure to its drawing; figures over time, which have options, and the player are special."""
OF_RECORD = ("local_frequency", "frequency", "second_difference", "grids")
"""Kinds that need no series over time, which a large sweep does not store."""


def pictures(lead: CheckedLadder) -> list[tuple[FigureOfSource, list[Picture]]]:
    """Return the pictures of every figure of the file; none if the data that it shows are not stored."""
    drawn, names = [], set[str]()
    for i, figure in enumerate(lead.record.experiment.figures, 1):
        titled = []
        for picture in _drawn(lead, figure, f"source_{i}"):
            # a figure that is named twice is on the page twice
            name = picture.name if picture.name not in names else f"source_{i}_{picture.name}"
            names.add(name)
            title = f"{words.capitalized(figure.source)}: {picture.title}"
            titled.append(replace(picture, name=name, title=title))
        drawn.append((figure, titled))
    return drawn


def _drawn(lead: CheckedLadder, figure: FigureOfSource, name: str) -> list[Picture]:
    if figure.shows == PLAYER or (figure.shows not in OF_RECORD and lead.record.is_lean):
        return []
    if figure.shows == "over_time":
        return over_time.pictures(lead.record, figure, name)
    picture = DRAWN[figure.shows](lead)
    return [] if picture is None else [picture]


def undrawn(
    drawn: Iterable[tuple[FigureOfSource, Sequence[Picture]]], *, has_player: bool
) -> list[str]:
    """Return the sources of the figures of the file that are not shown."""
    return [
        words.capitalized(figure.source)
        for figure, pictures in drawn
        if not (has_player if figure.shows == PLAYER else pictures)
    ]


def of_player(experiment: Experiment) -> str:
    """Return the sources of the sketches that the player animates; empty without any."""
    sources = (row.source for row in experiment.figures if row.shows == PLAYER)
    return "; ".join(map(words.capitalized, sources))
