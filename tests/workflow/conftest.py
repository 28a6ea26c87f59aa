from __future__ import annotations

import io
import json
import shutil
import subprocess
from collections.abc import Sequence
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from pathlib import Path

import pytest
from forked import vibsim
from made_once import change, made_once

from vibsim.cli import main
from vibsim.cli.chosen_plans import plans_of
from vibsim.cli.run import changes

ROOT = Path(__file__).parents[2]
TEXT = """\
title: A tiny pendulum
source: nowhere
model: {kind: pendulum, g: 1.0, L: 1.0}
initial: {theta: 1.0}
time: {end: 20.0}
levels: [6, 7, 8, 9]
schemes: [central]
checks:
  - {id: order, converges: theta, order: scheme, tolerance: 0.5}
"""


def here(*arguments: object) -> subprocess.CompletedProcess[str]:
    """Run a command in this process: one that is refused before it starts a workflow."""
    out, told = io.StringIO(), io.StringIO()
    with redirect_stdout(out), redirect_stderr(told):
        status = main([*map(str, arguments)])
    return subprocess.CompletedProcess(arguments, status, out.getvalue(), told.getvalue())


@dataclass(frozen=True)
class Place:
    """An experiment file and a results folder, both under names that a shell would trip over."""

    folder: Path
    elsewhere: Path | None = None
    """The results folder, where it is not beside the file."""

    @property
    def file(self) -> Path:
        return self.folder / "my files" / "tiny.yaml"

    @property
    def results(self) -> Path:
        return self.elsewhere or self.folder / "re sults {x} 'y' $z"

    @property
    def tiny(self) -> Path:
        return self.results / "adhoc/tiny"

    def run(
        self, *options: str, files: Sequence[Path] = (), forked_jobs: bool = True
    ) -> subprocess.CompletedProcess[str]:
        named = files or [self.file]
        words = ("run", *named, "--results", self.results, "--cores", "2", *options)
        return vibsim(*words, forked_jobs=forked_jobs)

    def jobs(self, *, files: Sequence[Path] = ()) -> list[str]:
        """Return what a run would do."""
        ended = self.run("--dry-run", "--json", files=files)
        assert ended.returncode == 0, ended.stderr
        return [short(entry["job"]) for entry in json.loads(ended.stdout)["jobs"]]

    def changed(self) -> set[str]:
        """Take the results for what they are, as a run does first, and return the files that it would make again."""
        plans = plans_of([str(self.file)])
        return {Path(e.path).name for e in changes.changed(plans, self.results, every=False)}

    def change(self, old: str, new: str) -> None:
        change(self.file, old, new)

    def content(self) -> dict[str, bytes]:
        """Return every result that must come back with the same bytes."""
        kinds = (".nc", ".json", ".html", ".csv", ".tex", ".svg")
        return {
            path.relative_to(self.results).as_posix(): path.read_bytes()
            for path in sorted(self.results.rglob("*"))
            if path.suffix in kinds and not {".snakemake", ".vibsim"} & set(path.parts)
        }


def short(job: str) -> str:
    """Shorten ``simulate adhoc/tiny level_06.nc`` to ``level_06``."""
    words = job.split()
    return words[-1].removesuffix(".nc") if len(words) == 3 else words[0]


@pytest.fixture(scope="session")
def finished(tmp_path_factory: pytest.TempPathFactory, worker_id: str) -> Place:
    """Run the tiny experiment once."""

    def make(folder: Path) -> None:
        place = Place(folder)
        place.file.parent.mkdir()
        place.file.write_text(TEXT)
        ended = place.run(forked_jobs=False)
        assert ended.returncode == 0, ended.stdout + ended.stderr

    return Place(made_once(tmp_path_factory, worker_id, "finished", make))


@pytest.fixture
def place(finished: Place, tmp_path: Path) -> Place:
    """Return a copy of the finished results, at another place."""
    shutil.copytree(finished.folder, tmp_path / "copy")
    return Place(tmp_path / "copy")
