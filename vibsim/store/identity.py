"""Whose file it is: the format that it is written in, and the job that made it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from vibsim.core.errors import StaleFileError
from vibsim.core.vocabulary import FORMAT


def check(path: Path, form: Any, digest: str, wanted: str | None) -> None:
    """Compare what a whole file says of itself with what is wanted.

    Parameters
    ----------
    path
        The file, for the message.
    form
        Its ``vibsim_format``, None where it has none.
    digest
        Digest of the job that made it.
    wanted
        Digest of the job whose result is wanted; None takes any.

    Raises
    ------
    StaleFileError
        When the file is of another format or another job's.
    """
    if form != FORMAT:
        raise StaleFileError(path, f"it is not in vibsim format {FORMAT}")
    if wanted is not None and digest != wanted:
        raise StaleFileError(path, f"it belongs to job {digest[:12]}, wanted is {wanted[:12]}")


def check_name(path: Path, found: str, wanted: str | None) -> None:
    """Compare what a whole file says that it is with what is wanted, None for any.

    Raises
    ------
    StaleFileError
        When it is the file of another place.
    """
    if wanted is not None and found != wanted:
        raise StaleFileError(path, f"it is {found}, wanted is {wanted}")
