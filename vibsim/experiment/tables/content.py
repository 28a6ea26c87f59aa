"""Read the bytes of a table or matrix file."""

from __future__ import annotations

from pathlib import Path

from vibsim.core.errors import nearest
from vibsim.experiment.schema.fields import TABLE
from vibsim.experiment.yaml.file_content import MOST_BYTES, content_of

MOST_LISTED = 8  # largest number of files listed in a message


class TableError(ValueError):
    """An invalid table or matrix: the rule that it breaks, a hint, and for tables the faulty key."""

    def __init__(self, rule: str, hint: str = "", key: str = TABLE) -> None:
        self.rule, self.hint, self.key = rule, hint, key
        super().__init__(rule)


def bytes_of(path: Path, endings: tuple[str, ...], what: str) -> bytes:
    """Return the bytes of the file at `path`; raise `TableError` if it cannot be read, or has none of the `endings`."""
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
    """Return the message of an error of the system or a library."""
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
