"""The jobs of a run, and how far it is: one line that is rewritten, or plain lines where the output is kept."""

from __future__ import annotations

import shutil
import sys
from dataclasses import dataclass


@dataclass(frozen=True)
class Job:
    """A job that Snakemake started, or would start."""

    rule: str
    outputs: tuple[str, ...]
    """The files that it makes, from the results folder."""
    log: str
    reason: str
    """Why it is to run."""

    @property
    def simulates(self) -> bool:
        """Whether it makes level files."""
        return self.rule.startswith("simulate")

    @property
    def folder(self) -> str:
        """Folder of the experiment, empty for the index."""
        parts = self.outputs[0].split("/")
        return "/".join(parts[:2]) if len(parts) > 2 else ""

    def __str__(self) -> str:
        """Say what it does: ``simulate pendulum_lab/convergence level_06.nc to level_09.nc``."""
        if not self.folder:
            return self.rule
        if not self.simulates:
            return f"{self.rule} {self.folder}"
        names = [path.removeprefix(f"{self.folder}/") for path in self.outputs]
        return f"simulate {self.folder} " + " to ".join(dict.fromkeys((names[0], names[-1])))


class Progress:
    """Tells on stderr how far a run is."""

    def __init__(self) -> None:
        self.is_terminal = sys.stderr.isatty()
        self.done = 0
        self.started = 0
        self.total = 0
        self.current = ""

    def count(self, done: int, total: int) -> None:
        """Take how many jobs are done of how many, both with the target of all, which is no job."""
        self.total = total - 1
        self.done = min(done, self.total)
        if not done:
            self.started = 0
        self._show()

    def start(self, job: Job) -> None:
        """Take a job that has started."""
        self.current = str(job)
        self.started += 1
        if not self.is_terminal:
            count = f"{self.started} of {self.total}: " if self.total else ""
            print(f"{count}{self.current}", file=sys.stderr, flush=True)
        self._show()

    def clear(self) -> None:
        """Remove the line."""
        if self.is_terminal:
            self._rewrite("")

    def _show(self) -> None:
        if self.is_terminal:
            count = f"{self.done} of {self.total}: " if self.total else ""
            self._rewrite(f"{count}{self.current}")

    def _rewrite(self, text: str) -> None:
        width = shutil.get_terminal_size().columns - 1
        sys.stderr.write(f"\r\033[K{text[:width]}")
        sys.stderr.flush()
