"""The figures of the source that an experiment file names, each drawn under its number there."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace

from vibsim.core.record import Record
from vibsim.experiment.schema.figures import FigureOfSource
from vibsim.report import choice, data
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
"""What draws each kind, but those over time, which have options, and the player."""
OF_RECORD = ("local_frequency", "frequency", "second_difference", "grids")
"""Kinds that need no series over time, which a large sweep does not keep."""


def pictures(
    experiment: Experiment, record: Record, lead: Lead
) -> list[tuple[FigureOfSource, list[Picture]]]:
    """Return the pictures of every figure that is asked for; none where what it shows is not kept of the run."""
    found, names = [], set[str]()
    for i, figure in enumerate(experiment.figures, 1):
        named = []
        for picture in _drawn(experiment, record, lead, figure, f"source_{i}"):
            # one that is asked for twice is on the page twice
            name = picture.name if picture.name not in names else f"source_{i}_{picture.name}"
            names.add(name)
            title = f"{opening(figure.source)}: {picture.title}"
            named.append(replace(picture, name=name, title=title))
        found.append((figure, named))
    return found


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
    found: Iterable[tuple[FigureOfSource, Sequence[Picture]]], *, has_player: bool
) -> list[str]:
    """Return the sources of what is asked for and not shown."""
    return [
        opening(figure.source)
        for figure, drawn in found
        if not (has_player if figure.shows == PLAYER else drawn)
    ]


def opening(source: str) -> str:
    """Return a source as the beginning of a title."""
    return source[:1].upper() + source[1:]


def of_player(experiment: Experiment) -> str:
    """Return the sources of the sketches that the player shows in motion; empty without any."""
    return "; ".join(opening(row.source) for row in experiment.figures if row.shows == PLAYER)
