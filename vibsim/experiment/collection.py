"""The collection of an experiment file; imports nothing, for whoever asks before anything is validated."""

from __future__ import annotations

import os
from pathlib import Path

ADHOC = "adhoc"
"""Collection of a file outside the ``configs/`` of the checkout."""
ENDINGS = (".yaml", ".yml")
"""Of the name of an experiment file."""


def find_checkout() -> Path | None:
    """Return the folder with the Snakefile and the experiments that come with vibsim, None without one."""
    for folder in (Path(__file__).resolve().parents[2], Path.cwd()):
        if (folder / "Snakefile").is_file() and (folder / "configs").is_dir():
            return folder
    return None


def collection_of(file: Path, configs: Path | None = None) -> str:
    """Name the collection of an experiment file: its folder where that is a folder of `configs`, else ``adhoc``.

    `configs` is by default the folder of collections of the checkout.
    """
    if configs is None:
        checkout = find_checkout()
        if checkout is None:
            return ADHOC
        configs = checkout / "configs"
    # Path.resolve raises where links go in a circle
    folder = Path(os.path.realpath(file)).parent
    return folder.name if folder.parent == configs.resolve() else ADHOC
