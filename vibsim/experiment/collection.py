"""The collection of an experiment file; imports little, for whoever asks before anything is validated."""

from __future__ import annotations

import os
from pathlib import Path

from vibsim.core.home import home

ADHOC = "adhoc"
"""Collection of a file outside the shipped ``configs/``."""
SITE = "docs"
"""Folder of the results where a collection would be, with the documentation that ``make docs`` makes."""
ENDINGS = (".yaml", ".yml")
"""Of the name of an experiment file."""


def collection_of(file: Path, configs: Path | None = None) -> str:
    """Name the collection of an experiment file: its folder where that is a folder of `configs`, else ``adhoc``.

    `configs` is by default the folder of the shipped collections.
    """
    if configs is None:
        configs = home() / "configs"
    # Path.resolve raises where links go in a circle
    folder = Path(os.path.realpath(file)).parent
    return folder.name if folder.parent == configs.resolve() else ADHOC
