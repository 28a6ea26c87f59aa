"""What a plan says of memory and disk against what jobs really take."""

from __future__ import annotations

import re
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import netCDF4
import pytest

from vibsim.cli import main
from vibsim.experiment.cost import COMPARED_FILE, analysis_disk, level_cost
from vibsim.plan import Choice, LevelJob, Plan, load

HEAD = "title: x\nmodel: {kind: pendulum}\ninitial: {theta: 1.0}\ntime: {end: 20.0}\n"
GRID = "sweep: {initial.theta: {linspace: [0.1, 3.0, %d]}}\n"
CASES = {
    "one member": "levels: [5, 6]\nschemes: [central]\n",
    "one compiled": "levels: [6, 20]\nschemes: [central]\n",
    "lean": "levels: [6, 7]\nschemes: [central]\n" + GRID % 200_000,
    "orders": "levels: [6, 7, 8]\nschemes: [central]\nchecks: [{converges: theta}]\n"
    + GRID % 100_000,
    "every step, two schemes": "levels: [6, 10]\nsamples: all\n"
    "schemes: [central, {kind: central, label: other, end_velocity: kick}]\n" + GRID % 2000,
    "a velocity of its own": "levels: [6, 10]\nsamples: all\nschemes: [central, rk4]\n"
    + GRID % 2000,
}
PROBE = r"""
import re, sys
from pathlib import Path
from vibsim.cli import main
assert main(sys.argv[1:]) == 0
print("peak", re.search(r"VmHWM:\s*(\d+) kB", Path("/proc/self/status").read_text())[1])
"""


def peak(*arguments: object) -> int:
    command = [sys.executable, "-c", PROBE, *map(str, arguments)]
    ended = subprocess.run(command, capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stdout + ended.stderr
    found = re.search(r"peak (\d+)", ended.stdout)
    assert found
    return 1024 * int(found[1])


def peak_of_all(*arguments: object) -> int:
    """Return the most bytes that a command and what it starts hold at a time, what they share once."""
    most = 0
    with subprocess.Popen([sys.executable, "-m", "vibsim", *map(str, arguments)]) as process:
        while process.poll() is None:
            found = list(map(memory, family(process.pid)))
            # what the processes share is that of the one that shares most
            most = max(
                most, sum(own for own, _ in found) + max((shared for _, shared in found), default=0)
            )
            time.sleep(0.02)
    assert process.returncode == 0
    return most


def family(pid: int) -> list[int]:
    """Return a process and those that it and they have started."""
    with suppress(OSError):
        told = [path.read_text() for path in Path(f"/proc/{pid}/task").glob("*/children")]
        children = [int(word) for text in told for word in text.split()]
        return [pid, *(one for child in children for one in family(child))]
    return []


def memory(pid: int) -> tuple[int, int]:
    """Return the bytes that a process has for itself, and those that others have as well."""
    with suppress(OSError):
        text = Path(f"/proc/{pid}/smaps_rollup").read_text()
        own, shared = (
            sum(map(int, re.findall(rf"^{kind}_\w+:\s*(\d+) kB", text, re.M)))
            for kind in ("Private", "Shared")
        )
        return 1024 * own, 1024 * shared
    return 0, 0


def planned(folder: Path, text: str) -> Plan:
    file = folder / "x.yaml"
    file.write_text(HEAD + text)
    return load(Choice("adhoc", file))


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_memory_and_disk_are_as_planned(tmp_path: Path, name: str) -> None:
    plan = planned(tmp_path, CASES[name])
    level = plan.levels[-1]
    made = tmp_path / level.shards[0].path
    command = ["simulate", plan.file, "--results", tmp_path, "--level", level.level]
    # The first time compiles the kernel, which takes memory of its own.
    peak(*command)
    made.unlink()
    measured = peak(*command)
    assert level.memory == pytest.approx(measured, rel=0.2)
    assert made.stat().st_size == pytest.approx(share(plan, level), rel=0.1)


def share(plan: Plan, level: LevelJob) -> float:
    """Return the planned size of the first file of a level."""
    return level.bytes * level.shards[0].stop / plan.cases


@pytest.mark.slow
def test_the_size_of_a_comparison_with_series_is_as_planned(tmp_path: Path) -> None:
    text = "levels: [6, 7, 8, 9]\nschemes: [central]\n" + GRID % 30
    plan = planned(tmp_path, text)
    common = [str(plan.file), "--results", str(tmp_path)]
    assert main(["simulate", *common, "--level", "6", "7", "8", "9"]) == 0
    assert main(["analyse", *common]) == 0
    with netCDF4.Dataset(tmp_path / plan.convergence) as data:
        size_of = {one: one.size * one.dtype.itemsize for one in data.variables.values()}
        packed = sum(size for one, size in size_of.items() if one.filters()["zlib"])
        values = sum(size_of.values())
    size = (tmp_path / plan.convergence).stat().st_size
    assert packed > 0.5 * values
    # memory holds what there is to write; what is compressed takes less of the disk
    loads = [level_cost(plan.experiment, level.level) for level in plan.levels]
    held = analysis_disk(loads, plan.cases, is_lean=False)
    assert held == pytest.approx(values + COMPARED_FILE, rel=0.2)
    assert 0.3 * held < size < 0.8 * held
    assert size / 1.5 < plan.analysis_bytes < 1.5 * size


@pytest.mark.slow
@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("name", ["lean", "orders"])
def test_an_analysis_takes_no_more_than_planned(tmp_path: Path, name: str, threads: int) -> None:
    plan = planned(tmp_path, CASES[name])
    for batch in plan.batches:
        peak(
            *("simulate", plan.file, "--results", tmp_path, "--shard", batch.shard),
            *("--level", *batch.levels),
        )
    measured = peak_of_all("analyse", plan.file, "--results", tmp_path, "--threads", threads)
    size = (tmp_path / plan.convergence).stat().st_size
    assert plan.analysis_bytes == pytest.approx(size, rel=0.1)
    asked = plan.shared_memory(threads)
    assert measured < 1.1 * asked
    assert asked == pytest.approx(measured, rel=0.3)
