"""Turn exceptions into messages and exit statuses; no other module does."""

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
_MEMORY_MESSAGES = (
    *("cannot allocate memory", "failed to map segment", "can't start new thread"),
    *("std::bad_alloc", "out of memory"),
)
"""Texts in messages of libraries that could not allocate memory."""


def report(error: Exception) -> int:
    """Print the message of an error to stderr, and return the exit status."""
    text = sentence(error)
    if isinstance(error, BrokenPipeError):
        # the reader of a pipe has ended (``vibsim list | head``)
        sys.stderr.close()
        return FAILED
    text = from_here(text) if isinstance(error, InputError) else f"vibsim: {text}"
    print(text, file=sys.stderr, flush=True)
    return REFUSED if isinstance(error, InputError) else FAILED


def from_here(text: str) -> str:
    """Make paths at the beginning of lines relative to the current folder, as the user probably wrote them."""
    try:
        here = f"{Path.cwd()}{os.sep}"
    except OSError:
        return text
    return "\n".join(line.removeprefix(here) for line in text.split("\n"))


def sentence(error: Exception) -> str:
    """Return the message of an error; for a fault of vibsim itself, it says where the traceback is.

    Raises Interrupted where a signal requested this process to end: a library may have turned the Interrupted that was
    raised inside it into an error of its own.
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
    """Return the message of an exception, without its error number."""
    if isinstance(error, OSError) and error.strerror:
        return f"{error.filename}: {error.strerror}" if error.filename else error.strerror
    kind = type(error).__name__
    return f"{kind}: {error}" if str(error) else kind


def is_of_memory(error: BaseException) -> bool:
    """Tell whether an exception, or one of its causes, means that memory is short."""
    if isinstance(error, MemoryError) or getattr(error, "errno", None) == errno.ENOMEM:
        return True
    says_so = any(words in str(error).lower() for words in _MEMORY_MESSAGES)
    if says_so and isinstance(error, ImportError | OSError | RuntimeError):
        return True
    cause = error.__cause__ or error.__context__
    return cause is not None and is_of_memory(cause)


def save_text(text: str) -> str:
    """Write a long text to a temporary file, and return a remark that names this file."""
    try:
        descriptor, name = tempfile.mkstemp(prefix="vibsim-error-", suffix=".txt")
        with os.fdopen(descriptor, "w") as file:
            file.write(text)
    except OSError as problem:
        return f"(its full text could not be written: {reason(problem)})"
    return f"(its full text: {name})"
