"""Report why submitted jobs are pending; only SLURM is queried."""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Event, Thread

INTERVAL = 60.0  # time between two queries [s]
_LOG, _REASON = 4096, 200  # widths of the columns with the path of the log and with the reason


@contextmanager
def reported(results: Path, clear: Callable[[], None]) -> Iterator[None]:
    """Within the context, print on stderr how many jobs of a run wait and why, whenever this changes.

    `clear` is called first, to remove the progress line.
    """
    end = Event()
    thread = Thread(target=_report, args=(results, clear, end), daemon=True)
    if shutil.which("squeue"):
        thread.start()
    try:
        yield
    finally:
        end.set()


def _report(results: Path, clear: Callable[[], None], end: Event) -> None:
    last = ""
    while not end.wait(INTERVAL):
        text = in_words(reasons(results))
        if text not in ("", last):
            clear()
            print(f"vibsim: {text}", file=sys.stderr, flush=True)
        last = text


def reasons(results: Path) -> Counter[str]:
    """Return the number of pending jobs by reason; jobs of this run have their logs in `results`."""
    columns = f"STDOUT:{_LOG},Reason:{_REASON}"
    command = ["squeue", "--me", "--noheader", "--states", "PENDING", "--Format", columns]
    try:
        ended = subprocess.run(
            command, capture_output=True, text=True, check=True, timeout=INTERVAL
        )
    except (OSError, subprocess.SubprocessError):
        return Counter()  # the executor queries the scheduler too, and reports its errors
    lines = (line for line in ended.stdout.splitlines() if line.startswith(f"{results}/"))
    return Counter(line[-_REASON:].strip() for line in lines)


def in_words(counts: Counter[str]) -> str:
    """Return the counts as a sentence: ``3 jobs are pending: Priority (2); Resources (1)``."""
    details = "; ".join(f"{reason} ({number})" for reason, number in counts.most_common())
    number = counts.total()
    return f"{number} job{'s are' if number > 1 else ' is'} pending: {details}" if number else ""
