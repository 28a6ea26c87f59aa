"""The figures of a page: each is a file, and part of the page itself as long as there is room."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

from vibsim.experiment.schema.figures import FigureOfSource
from vibsim.report.choice import CheckedLadder
from vibsim.report.figures import drawing, gallery, of_source, thumbnail
from vibsim.report.page import explorer, hero
from vibsim.report.page.templates import markup
from vibsim.report.style import Picture

BYTES = 1_000_000  # most bytes of all figures under tabs; further figures are files only
SEEN = "See the same picture under Figures of the source."  # in place of a caption given there
FIGURES = 6  # most figures under the tabs of a section

Shown = tuple[Picture, str]  # a picture with its markup
Sources = list[tuple[FigureOfSource, list[Picture]]]  # figures of the source with their pictures


def draw(
    lead: CheckedLadder, formats: Sequence[str]
) -> tuple[dict[str, bytes], Sources, dict[str, Any]]:
    """Draw the figures of a page from its first screen down, none of them twice.

    Return their files, the figures of the source, and the content of the page by the names that its template uses.
    """
    record = lead.record
    drawn = _Drawn(formats)
    sources = of_source.pictures(lead)
    groups = {
        "hero": [drawn.add(picture) for picture in hero.pictures(lead)],
        "source": [drawn.add(picture) for _, pictures in sources for picture in pictures],
    }
    above = [picture.name for group in groups.values() for picture, _ in group]
    shown, left_out = gallery.choose(record, lead.member)
    below = gallery.pictures(shown, lead, above)
    groups["motion"] = [drawn.add(picture) for picture in below.motion]
    belief = drawn.fitting(below.belief, FIGURES)
    named = {view.picture.name: view for view in below.members}
    single = drawn.fitting((view.picture.title, [view.picture]) for view in below.members)
    over_members = [(named[picture.name], text) for _, [(picture, text)] in single]
    views = [view for view, _ in over_members]
    small = thumbnail.thumbnail(record, shown[0])
    content = {
        "figures": groups | {"belief": belief, "members": over_members},
        "reading": {name: _captions(group) for name, group in groups.items()}
        | {"source": _readings(picture for picture, _ in groups["source"])}
        | {"belief": _captions((one for _, group in belief for one in group), groups["source"])}
        | {"members": _readings(view.picture for view in views)},
        "members": explorer.content(record, views),
        "worst": explorer.worst(record, views),
        "shared": below.shared,
        "shown": left_out,
        "more_figures": ", ".join(drawn.left_out),
    }
    return {**drawn.files, "thumbnail.svg": small.encode()}, sources, content


class _Drawn:
    """Pictures as markup for the page, and as files beside it."""

    def __init__(self, formats: Sequence[str]) -> None:
        self.formats = formats
        self.files: dict[str, bytes] = {}
        self.room = BYTES
        self.left_out: list[str] = []
        """Labels of pictures that are files only."""

    def add(self, picture: Picture) -> Shown:
        """Return a picture with its markup, and keep its files."""
        files = drawing.files(picture, self.formats)
        self.files |= files
        text = files[f"{picture.name}.svg"].decode()
        return picture, markup(drawing.inline(text, picture.alt))

    def fitting(
        self, labelled: Iterable[tuple[str, Sequence[Picture]]], most: float = math.inf
    ) -> list[tuple[str, list[Shown]]]:
        """Return pictures by their label, at most so many and as long as the page has room; further ones are files."""
        found = []
        for label, pictures in labelled:
            added = [self.add(picture) for picture in pictures]
            most -= len(added)
            self.room -= sum(len(text) for _, text in added)
            if most >= 0 and self.room >= 0:
                found.append((label, added))
            else:
                self.left_out.append(label)
        return found


def _captions(drawn: Iterable[Shown], above: Iterable[Shown] = ()) -> list[tuple[str, str]]:
    """Return each kind of picture once, named by its title up to the first colon, with its caption.

    A caption that several kinds share appears only once, and a kind that is explained `above` refers to that.
    """
    found: dict[str, Picture] = {}
    for picture, _ in drawn:
        kind, question, _ = picture.title.partition(":")[0].partition("?")
        found.setdefault(kind + question, picture)
    # the title of a figure of the source begins with the place in the source
    known = [picture.title.partition(": ")[2] for picture, _ in above]
    for kind, picture in found.items():
        is_known = picture.caption and any(title.startswith(kind) for title in known)
        found[kind] = replace(picture, title=kind, caption=SEEN if is_known else picture.caption)
    return _readings(found.values())


def _readings(pictures: Iterable[Picture]) -> list[tuple[str, str]]:
    """Return each caption once, with the title of the first picture that has it."""
    found: dict[str, str] = {}
    for picture in pictures:
        if picture.caption:
            found.setdefault(picture.caption, picture.title)
    return [(title, caption) for caption, title in found.items()]
