"""The place of the Snakefile and the shipped experiments: beside the package, or in it where that is installed."""

from __future__ import annotations

from pathlib import Path

_PACKAGE = Path(__file__).resolve().parents[1]
SHIPPED = _PACKAGE / "shipped"
"""What a wheel holds of the checkout (`setup.py` puts it there); a checkout has no such folder."""


def home() -> Path:
    """Return the folder with ``Snakefile``, ``configs`` and ``workflow``."""
    return SHIPPED if SHIPPED.is_dir() else _PACKAGE.parent


def default_results() -> Path:
    """Return the results folder of the checkout; of an installed vibsim, that in the current folder."""
    return (Path.cwd() if SHIPPED.is_dir() else home()) / "results"


def called(command: str) -> str:
    """Return a command of vibsim as a user types it: in the checkout, or anywhere where it is installed."""
    return command if SHIPPED.is_dir() else f".venv/bin/{command}"
