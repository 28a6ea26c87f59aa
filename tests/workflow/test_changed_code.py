"""One behaviour changed in a room below each kind of job: the job and what is behind it run again, and no other."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from .conftest import ROOT, TEXT, short

LATER = {"analyse", "report", "index"}
EVERYTHING = {"level_06", "level_07", "level_08", "level_09", "extrapolate", *LATER}
NOTHING = {"index"}
"""The index names no code of its own: it is made again after any change."""


class Checkout:
    """A copy of the checkout with its own results, whose code may be changed."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.file = folder, folder / "tiny.yaml"
        ignored = shutil.ignore_patterns("__pycache__")
        for name in ("vibsim", "workflow"):
            shutil.copytree(ROOT / name, folder / name, ignore=ignored)
        shutil.copy(ROOT / "Snakefile", folder)
        (folder / "configs").mkdir()
        self.file.write_text(TEXT.replace("levels:", "output: best\nlevels:"))

    def run(self, *options: str) -> str:
        command = [sys.executable, "-m", "vibsim", "run", str(self.file), *options]
        environment = os.environ | {"PYTHONPATH": str(self.folder)}
        ended = subprocess.run(
            command, env=environment, cwd=self.folder, capture_output=True, text=True, check=False
        )
        assert ended.returncode == 0, ended.stdout + ended.stderr
        return ended.stdout

    def jobs(self) -> set[str]:
        found = json.loads(self.run("--dry-run", "--json"))["jobs"]
        return {short(entry["job"]) for entry in found}


@pytest.fixture(scope="module")
def checkout(tmp_path_factory: pytest.TempPathFactory) -> Checkout:
    made = Checkout(tmp_path_factory.mktemp("checkout"))
    made.run()
    assert made.jobs() == set()
    return made


CONSTANT = "CHANGED = True"
# which module belongs to which job, of many more modules: `tests/plan/test_plan_code.py`
CHANGES = {
    "experiment/data.py": ("def schemes_of(experiment, check): return ()", EVERYTHING),
    "experiment/storage.py": ("def asked(experiment): return ()", EVERYTHING),
    "experiment/sweep_columns.py": (
        "def option_groups(experiment, scheme, columns): return []",
        EVERYTHING,
    ),
    "cli/jobs/simulate.py": (CONSTANT, EVERYTHING),
    "cli/jobs/analyse.py": (CONSTANT, LATER),
    "cli/jobs/extrapolate.py": (CONSTANT, {"extrapolate", "index"}),
    "report/page/page.py": ("LONG = 3", {"report", "index"}),
    "report/templates/report.html": ("<!-- changed -->", {"report", "index"}),
    "report/page/index.py": (CONSTANT, {"report", "index"}),
    "store/writing.py": ("CONVENTIONS = 'CF-1.8'", EVERYTHING),
    "comparison/best_solution.py": (CONSTANT, {*LATER, "extrapolate"}),
    "schemes/central.py": (CONSTANT, EVERYTHING),
    "schemes/newmark.py": (CONSTANT, NOTHING),
}


@pytest.mark.slow
@pytest.mark.parametrize("part", CHANGES)
def test_a_changed_behaviour_is_seen(checkout: Checkout, part: str) -> None:
    text, expected = CHANGES[part]
    file = checkout.folder / "vibsim" / part
    before = file.read_text()
    file.write_text(f"{before}\n{text}\n")
    try:
        found = checkout.jobs()
    finally:
        file.write_text(before)
    assert found == expected
