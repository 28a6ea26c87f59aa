from __future__ import annotations

import pytest

from vibsim.report.figures import drawing, gallery

EMPTY = '<svg xmlns="http://www.w3.org/2000/svg" width="1pt" height="1pt"></svg>'


@pytest.fixture
def without_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Write pages without pictures, which take most of the time: for what words and tables say."""
    monkeypatch.setattr(gallery, "pictures", lambda *_: gallery.Gallery())
    monkeypatch.setattr(drawing, "svg", lambda *_: EMPTY)


@pytest.fixture
def unrendered(monkeypatch: pytest.MonkeyPatch) -> None:
    """Make all figures of a page with their captions, and write empty files: where their names and words count."""
    monkeypatch.setattr(drawing, "svg", lambda *_: EMPTY)
    monkeypatch.setattr(drawing, "binary", lambda *_: b"")
