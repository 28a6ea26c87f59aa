"""Find a user's module without importing it."""

from __future__ import annotations

import importlib.util
import sys
from importlib.machinery import ModuleSpec
from pathlib import Path


def find(name: str, folder: Path) -> ModuleSpec | None:
    """Return where the outermost package of a module, or the module itself, is found; None if nowhere.

    It is searched for on `sys.path` and then in `folder`.
    """
    old_path = sys.path.copy()
    try:
        sys.path.append(str(folder))
        importlib.invalidate_caches()
        return importlib.util.find_spec(name.partition(".")[0])
    except (ImportError, ValueError):
        return None
    finally:
        sys.path[:] = old_path
