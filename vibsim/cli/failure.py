"""What went wrong, in a sentence: the one place that turns an exception into words and an exit status."""

from __future__ import annotations

import errno
import os
import sys
import tempfile
import traceback
from pathlib import Path

from vibsim.cli.supervise import check_interrupted
from vibsim.core import netcdf
from vibsim.core.errors import InputError, VibsimError

FAILED, REFUSED = 1, 2
_OF_MEMORY = (
    *("cannot allocate memory", "failed to map segment", "can't start new thread"),
    *("std::bad_alloc", "out of memory"),
)
"""How libraries tell in their own words that they were given no memory."""


def report(error: Exception) -> int:
    """Say on stderr what went wrong and return the exit status."""
    text = sentence(error)
    if isinstance(error, BrokenPipeError):
        # The reader of a pipe has gone (``vibsim list | head``); nobody is left to tell.
        sys.stderr.close()
        return FAILED
    text = from_here(text) if isinstance(error, InputError) else f"vibsim: {text}"
    print(text, file=sys.stderr, flush=True)
    return REFUSED if isinstance(error, InputError) else FAILED


def from_here(text: str) -> str:
    """Write paths at the beginning of lines from the current folder on, as they were probably given."""
    try:
        here = f"{Path.cwd()}{os.sep}"
    except OSError:
        return text
    return "\n".join(line.removeprefix(here) for line in text.split("\n"))


def sentence(error: Exception) -> str:
    """Say what went wrong; for a fault of vibsim itself, where the full text is.

    Raises
    ------
    Interrupted
        Where this process was told to end: libraries pass off as a fault of their own what is raised inside them.
    """
    check_interrupted()
    if isinstance(error, VibsimError):
        return str(error)
    if is_of_memory(error):
        return f"not enough memory ({reason(error)})"
    if (isinstance(error, OSError) and error.errno) or netcdf.is_from_library(error):
        return reason(error)
    last = traceback.extract_tb(error.__traceback__)[-1]
    place = f"{Path(last.filename).name}, line {last.lineno}"
    text = save_text("".join(traceback.format_exception(error)))
    return f"internal error, {place}: {reason(error)}; please report it {text}"


def reason(error: BaseException) -> str:
    """Return the cause that an exception names, without its number."""
    if isinstance(error, OSError) and error.strerror:
        return f"{error.filename}: {error.strerror}" if error.filename else error.strerror
    kind = type(error).__name__
    return f"{kind}: {error}" if str(error) else kind


def is_of_memory(error: BaseException) -> bool:
    """Tell whether an exception, or one that led to it, says that memory is short."""
    if isinstance(error, MemoryError) or getattr(error, "errno", None) == errno.ENOMEM:
        return True
    says_so = any(words in str(error).lower() for words in _OF_MEMORY)
    if says_so and isinstance(error, ImportError | OSError | RuntimeError):
        return True
    cause = error.__cause__ or error.__context__
    return cause is not None and is_of_memory(cause)


def save_text(text: str) -> str:
    """Write a long text to a file of its own, for whoever wants to know more, and say where it is."""
    try:
        descriptor, name = tempfile.mkstemp(prefix="vibsim-error-", suffix=".txt")
        with os.fdopen(descriptor, "w") as file:
            file.write(text)
    except OSError as problem:
        return f"(its full text could not be written: {reason(problem)})"
    return f"(its full text: {name})"
