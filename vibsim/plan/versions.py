"""Versions of installed libraries, found without importing them."""

from __future__ import annotations

import os
import sys
from functools import cache

NUMERICAL = ("numpy", "llvmlite", "scipy")
DRAWING = ("matplotlib", "jinja2")


def versions(names: tuple[str, ...]) -> dict[str, str]:
    """Return the version of each library in `names`, ``none`` for a library that is not installed.

    `importlib.metadata` gives the same, but its import would add 20 ms to every start.
    """
    installed = _installed()
    return {name: installed.get(name, "none") for name in names}


@cache
def _installed() -> dict[str, str]:
    installed: dict[str, str] = {}
    for folder in sys.path:
        try:
            entries = [entry.name for entry in os.scandir(folder or ".")]
        except OSError:
            continue
        for entry in entries:
            if entry.endswith(".dist-info"):
                name, _, version = entry.removesuffix(".dist-info").partition("-")
                installed.setdefault(name.lower(), version)
    return installed
