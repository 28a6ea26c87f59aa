"""An experiment with results, made once by the jobs alone: no workflow is started."""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path

import pytest
from made_once import change, made_once

from vibsim.cli import main

TEXT = """\
title: A small linear pendulum
model: {kind: linear_pendulum}
initial: {theta: 1.0}
time: {end: 20.0}
levels: [6, 7, 8]
schemes: [central, rk4]
checks:
  - {id: order, converges: theta, order: scheme}
  - {id: end, value: end, quantity: theta, at: {level: 8, scheme: rk4}, equals: 0.5, atol: 1e-3}
"""


@dataclass(frozen=True)
class Made:
    """An experiment file and its results, which a test may change."""

    folder: Path

    @property
    def file(self) -> Path:
        return self.folder / "small.yaml"

    @property
    def results(self) -> Path:
        return self.folder / "results"

    @property
    def small(self) -> Path:
        return self.results / "adhoc/small"

    def vibsim(self, command: str, *arguments: object) -> int:
        return main([command, *map(str, arguments), "--results", str(self.results)])

    def change(self, old: str, new: str) -> None:
        change(self.file, old, new)

    def make(self) -> None:
        assert self.vibsim("simulate", self.file, "--level", 6, 7, 8) == 0
        assert self.vibsim("analyse", self.file) == 0


@pytest.fixture(scope="session")
def finished(tmp_path_factory: pytest.TempPathFactory, worker_id: str) -> Made:
    def make(folder: Path) -> None:
        made = Made(folder)
        made.file.write_text(TEXT)
        made.make()

    return Made(made_once(tmp_path_factory, worker_id, "made", make))


@pytest.fixture
def made(finished: Made, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Made:
    shutil.copytree(finished.folder, tmp_path / "made")
    capsys.readouterr()
    return Made(tmp_path / "made")
