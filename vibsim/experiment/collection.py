"""The collection of an experiment file. Imports little, because it is used before anything is validated."""

from __future__ import annotations

import os
from pathlib import Path

from vibsim.core.home import home

ADHOC = "adhoc"  # collection of a file outside the shipped ``configs/``
SITE = "docs"  # folder among the collections of the results, with the documentation (``make docs``)
ENDINGS = (".yaml", ".yml")  # endings of the names of experiment files


def collection_of(file: Path, configs: Path | None = None) -> str:
    """Return the collection of an experiment file: the name of its folder if that is in `configs`, else ``adhoc``.

    The default of `configs` is the folder of the shipped collections.
    """
    if configs is None:
        configs = home() / "configs"
    folder = Path(os.path.realpath(file)).parent  # Path.resolve raises an error for circular links
    return folder.name if folder.parent == configs.resolve() else ADHOC
