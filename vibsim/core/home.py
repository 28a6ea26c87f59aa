"""Location of the Snakefile and the shipped experiments: beside the package, or within it if vibsim is installed."""

from __future__ import annotations

from pathlib import Path
from shlex import quote

_PACKAGE = Path(__file__).resolve().parents[1]
SHIPPED = _PACKAGE / "shipped"
"""Copy of the files of the checkout in an installed wheel, made by `setup.py`; a checkout has no such folder."""


def is_installed() -> bool:
    """Tell whether vibsim is installed, rather than run from a checkout."""
    return SHIPPED.is_dir()


def home() -> Path:
    """Return the folder with ``Snakefile``, ``configs`` and ``workflow``."""
    return SHIPPED if is_installed() else _PACKAGE.parent


def default_results() -> Path:
    """Return the default results folder: in the checkout, or in the current folder if vibsim is installed."""
    return (Path.cwd() if is_installed() else home()) / "results"


def called(command: str) -> str:
    """Return a command of vibsim as a page shows it: in the checkout with the path of the environment."""
    return command if is_installed() else f".venv/bin/{command}"


def typed(command: str) -> str:
    """Return a command of vibsim as the user types it in the current folder."""
    if is_installed() or Path.cwd() == home():
        return called(command)
    import shutil  # not needed by jobs

    name, _, arguments = command.partition(" ")
    program = home() / ".venv" / "bin" / name
    known = shutil.which(name)
    if known is not None and Path(known).resolve() == program.resolve():
        return command
    return f"{quote(str(program))} {arguments}"
