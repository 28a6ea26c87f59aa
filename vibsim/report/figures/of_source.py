"""The figures of a source text that an experiment file names, drawn under their numbers there."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace

from vibsim.core.record import Record
from vibsim.experiment.schema.figures import FigureOfSource
from vibsim.report import choice, data, words
from vibsim.report.choice import Lead
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

Draw = Callable[[Experiment, Record, Lead], Picture | None]


DRAWN: Mapping[str, Draw] = {
    "phase_plane": lambda e, r, _: plane.phase(e, r, data.all_members(r)),
    "path": lambda e, r, _: plane.path(e, r, data.all_members(r)),
    "peaks": lambda e, r, _: extrema.local(e, r, data.all_members(r)),
    "local_frequency": lambda e, r, _: extrema.frequency(e, r),
    "growth": lambda e, r, _: theory.growing(e, r),
    "frequency": lambda e, r, _: accuracy.frequency(e, r),
    "second_difference": lambda e, r, _: accuracy.second_difference(r),
    "differences": lambda e, r, lead: time.overlay(r, choice.position(e), lead.member),
    "energy_error": lambda _, r, lead: (
        time.energy(r, lead.member) if "energy_deviation_scaled" in r else None
    ),
    "grids": lambda e, r, _: model_curves.grids(r),
    "spring": lambda e, r, _: model_curves.spring(e, r),
    "spectrum": lambda e, r, lead: spectra.spectrum(e, r, lead.member),
    "poincare": lambda e, r, _: spectra.poincare(e, r, data.all_members(r)),
}
"""Kind of a figure to its drawing; figures over time, which have options, and the player are special."""
OF_RECORD = ("local_frequency", "frequency", "second_difference", "grids")
"""Kinds that need no series over time, which a large sweep does not store."""


def pictures(
    experiment: Experiment, record: Record, lead: Lead
) -> list[tuple[FigureOfSource, list[Picture]]]:
    """Return the pictures of every figure of the file; none if the data that it shows are not stored."""
    drawn, names = [], set[str]()
    for i, figure in enumerate(experiment.figures, 1):
        titled = []
        for picture in _drawn(experiment, record, lead, figure, f"source_{i}"):
            # a figure that is named twice is on the page twice
            name = picture.name if picture.name not in names else f"source_{i}_{picture.name}"
            names.add(name)
            title = f"{words.capitalized(figure.source)}: {picture.title}"
            titled.append(replace(picture, name=name, title=title))
        drawn.append((figure, titled))
    return drawn


def _drawn(
    experiment: Experiment, record: Record, lead: Lead, figure: FigureOfSource, name: str
) -> list[Picture]:
    if figure.shows == PLAYER or (figure.shows not in OF_RECORD and data.is_lean(record)):
        return []
    if figure.shows == "over_time":
        return over_time.pictures(experiment, record, figure, name)
    picture = DRAWN[figure.shows](experiment, record, lead)
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
