"""The bytes of a table or a matrix beside an experiment file, or why they cannot be had."""

from __future__ import annotations

from pathlib import Path

from vibsim.core.errors import nearest
from vibsim.experiment.schema.fields import TABLE
from vibsim.experiment.yaml.file_content import MOST_BYTES, content_of

MOST_LISTED = 8
"""Files that a message lists, at most."""


class TableError(ValueError):
    """A table or a matrix that is refused: the rule that it breaks, how to keep it, and for tables the key at fault."""

    def __init__(self, rule: str, hint: str = "", key: str = TABLE) -> None:
        self.rule, self.hint, self.key = rule, hint, key
        super().__init__(rule)


def bytes_of(path: Path, endings: tuple[str, ...], what: str) -> bytes:
    """Return the bytes of the file at `path`, whose name must have one of some endings; TableError without any."""
    if path.suffix.lower() not in endings:
        known = " or ".join(endings) if len(endings) == 2 else ", ".join(endings)
        raise TableError(f"the name of a {what} must end with {known}")
    if path.is_dir():
        raise TableError("is a folder, and must be a file")
    try:
        found = content_of(path, MOST_BYTES)
    except FileNotFoundError:
        raise TableError("there is no such file", _alike(path, endings, what)) from None
    except (OSError, ValueError) as error:
        raise TableError(f"cannot be read ({reason(error)})") from None
    if len(found) > MOST_BYTES:
        raise TableError(f"must not be larger than {MOST_BYTES >> 20} MiB")
    return found


def reason(error: Exception) -> str:
    """Return what an error of the system or of a library says."""
    return getattr(error, "strerror", None) or str(error)


def _alike(path: Path, endings: tuple[str, ...], what: str) -> str:
    try:
        beside = sorted(p.name for p in path.parent.iterdir() if p.suffix.lower() in endings)
    except (OSError, ValueError):
        return "there is no such folder"
    if not beside:
        return f"there is no {what} in that folder"
    hint = nearest(path.name, beside)
    is_short = hint.startswith("did") or what == "matrix" or len(beside) <= MOST_LISTED
    return hint if is_short else f"there are {len(beside)} {what}s in that folder"
