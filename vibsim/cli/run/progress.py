"""Progress on the terminal: one line that is rewritten, or plain lines where the output is kept."""

from __future__ import annotations

import shutil
import sys

from vibsim.cli.run.snakemake import Job


class Progress:
    """Tells on stderr how far a run is."""

    def __init__(self) -> None:
        self.is_terminal = sys.stderr.isatty()
        self.done = 0
        self.started = 0
        self.total = 0
        self.current = ""

    def __call__(self, done: int, total: int, job: Job | None) -> None:
        """Take what the workflow tells: steps done of all, or a job that has started."""
        if job is not None:
            self.current = describe(job)
            self.started += 1
            if not self.is_terminal:
                count = f"{self.started} of {self.total}: " if self.total else ""
                print(f"{count}{self.current}", file=sys.stderr, flush=True)
        else:
            # the target of all is no job
            self.total = total - 1
            self.done = min(done, self.total)
            self.started = self.started if done else 0
        if self.is_terminal:
            count = f"{self.done} of {self.total}: " if self.total else ""
            self._rewrite(f"{count}{self.current}")

    def clear(self) -> None:
        """Remove the line."""
        if self.is_terminal:
            self._rewrite("")

    def _rewrite(self, text: str) -> None:
        width = shutil.get_terminal_size().columns - 1
        sys.stderr.write(f"\r\033[K{text[:width]}")
        sys.stderr.flush()


def describe(job: Job) -> str:
    """Say what a job does: ``simulate pendulum_lab/convergence level_06.nc to level_09.nc``."""
    if not job.folder:
        return job.rule
    if not job.simulates:
        return f"{job.rule} {job.folder}"
    names = [path.removeprefix(f"{job.folder}/") for path in job.outputs]
    return f"simulate {job.folder} " + " to ".join(dict.fromkeys((names[0], names[-1])))
