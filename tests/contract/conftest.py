"""One run of the pipeline that all tests of files and of the command line look at."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from made_once import made_once

from .door import started, vibsim

TINY = """\
title: A small linear pendulum
source: nowhere, section 1
model: {kind: linear_pendulum}
initial: {theta: 1.0}
time: {end: 8.0}
levels: [6, 7, 8]
schemes: [crank_nicolson]
output: best
checks:
  - {id: order, converges: theta, order: scheme}
  - {id: energy, converges: energy_deviation, order: scheme}
  - {value: end, quantity: theta, at: {level: 7}, equals: -0.1455, atol: 1e-2}
  - id: trap
    converges: theta
    order: 1
    expect: {status: FAIL, reason: order_high}
  - id: said
    claim: the energy grows
    source: nobody
    that: {value: relative_energy_error, above: 1e-3}
    holds: false
"""

SWEPT = """\
title: Three pendulums
model: {kind: pendulum}
time: {end: 6.0}
levels: [6, 7, 8]
schemes: [central]
sweep:
  initial.theta: [0.5, 1.0, 1.5]
checks:
  - {id: order, converges: theta, order: scheme}
"""

FAILING = """\
title: One of two members escapes
model: {kind: duffing, alpha: 1.0, beta: -1.0}
time: {end: 10.0}
levels: [4, 5]
schemes: [rk4]
sweep:
  initial.u: [0.5, 1.5]
checks:
  - {id: end, value: max_abs, quantity: u, below: 0.6}
  - {id: order, converges: u, order: 4}
"""

FILES = {"tiny": TINY, "swept": SWEPT, "failing": FAILING}


@dataclass(frozen=True)
class Runs:
    """Two runs: `passing` on two cores, of `tiny`, and `mixed` on one, of all, one of which fails."""

    folder: Path

    @property
    def passing(self) -> Path:
        return self.folder / "passing"

    @property
    def mixed(self) -> Path:
        return self.folder / "mixed"

    def of(self, experiment: str) -> Path:
        """Folder of an experiment in the run that made all."""
        return self.mixed / "adhoc" / experiment

    def file(self, name: str) -> Path:
        return self.folder / f"{name}.yaml"

    def exit_code(self, name: str) -> int:
        return int((self.folder / f"{name}.exit").read_text())

    def printed(self, name: str) -> str:
        return (self.folder / f"{name}.out").read_text()

    def run(self, name: str, cores: int, *experiments: str, start: Any = vibsim) -> None:
        files = [self.file(experiment) for experiment in experiments]
        results = self.folder / name
        ended = start("run", *files, "--results", results, "--cores", cores, "--json")
        (self.folder / f"{name}.out").write_text(ended.stdout)
        (self.folder / f"{name}.err").write_text(ended.stderr)
        (self.folder / f"{name}.exit").write_text(str(ended.returncode))


@pytest.fixture(scope="session")
def runs(tmp_path_factory: pytest.TempPathFactory, worker_id: str) -> Runs:
    """Made by the first process that asks."""

    def make(folder: Path) -> None:
        found = Runs(folder)
        for name, text in FILES.items():
            found.file(name).write_text(text)
        found.run("passing", 2, "tiny", start=started)
        # in forks of this process, which makes the same bytes (`test_contract_files`)
        found.run("mixed", 1, *FILES)

    return Runs(made_once(tmp_path_factory, worker_id, "contract runs", make))
