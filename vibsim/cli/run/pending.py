"""Which submitted jobs wait, and for what, as SLURM says; other schedulers are not asked."""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Event, Thread

INTERVAL = 60.0
"""Seconds between two questions."""
_LOG = 4096
"""Width of the path of a log in the answer."""
_REASON = 200


@contextmanager
def reported(results: Path, clear: Callable[[], None]) -> Iterator[None]:
    """While this lasts, say on stderr how many jobs of a run wait and why, whenever that has changed.

    `clear` removes the line of the progress first.
    """
    end = Event()
    teller = Thread(target=_tell, args=(results, clear, end), daemon=True)
    if shutil.which("squeue"):
        teller.start()
    try:
        yield
    finally:
        end.set()


def _tell(results: Path, clear: Callable[[], None], end: Event) -> None:
    before = ""
    while not end.wait(INTERVAL):
        now = in_words(reasons(results))
        if now not in ("", before):
            clear()
            print(f"vibsim: {now}", file=sys.stderr, flush=True)
        before = now


def reasons(results: Path) -> Counter[str]:
    """Return the reasons for which jobs wait whose logs are in a results folder, each with how many."""
    rows = f"STDOUT:{_LOG},Reason:{_REASON}"
    command = ["squeue", "--me", "--noheader", "--states", "PENDING", "--Format", rows]
    try:
        ended = subprocess.run(
            command, capture_output=True, text=True, check=True, timeout=INTERVAL
        )
    except (OSError, subprocess.SubprocessError):
        # the executor has its own questions to the scheduler, and says what is wrong with it
        return Counter()
    lines = (line for line in ended.stdout.splitlines() if line.startswith(f"{results}/"))
    return Counter(line[-_REASON:].strip() for line in lines)


def in_words(found: Counter[str]) -> str:
    """Say how many jobs wait: ``3 jobs are pending: Priority (2); Resources (1)``."""
    which = "; ".join(f"{reason} ({number})" for reason, number in found.most_common())
    number = found.total()
    return f"{number} job{'s are' if number > 1 else ' is'} pending: {which}" if number else ""
