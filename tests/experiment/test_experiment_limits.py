"""What is too large is refused from its counts, quickly and in little memory."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from experiment_files import build, faults_of, only_fault

from vibsim.experiment.cost import LevelCost
from vibsim.experiment.storage import FEWEST_EXTREMA, MOST_EXTREMA
from vibsim.experiment.sweep_columns import line
from vibsim.plan.build import build as build_plan

ALL = LevelCost(
    schemes=1,
    steps=2**28,
    samples=2**28 + 1,
    series=8,
    exact=2,
    work=1.0,
    extrema=MOST_EXTREMA,
    d2t=True,
)
MEMORY = ALL.memory(1)
DISK = replace(ALL, steps=2**12, samples=2**12 + 1, extrema=FEWEST_EXTREMA).disk(10**7)
HUGE = {"linspace": [1, 2, 10**6]}


@pytest.mark.parametrize(
    ("changes", "key", "number"),
    [
        ({"levels": [60]}, "levels[0]", "40"),
        ({"levels": [38, 39, 40]}, "levels", str(7 * 2**38)),
        ({"levels": [40], "time": {"end": 1, "base_steps": 2}}, "levels", str(2**41)),
        (
            {"levels": [30], "sweep": {"model.g": {"linspace": [1, 2, 2000]}}},
            "levels",
            str(2000 * 2**30),
        ),
        ({"time": {"end": 1, "base_steps": 10**30}}, "levels", str(960 * 10**30)),
        ({"levels": [1], "sweep": {"model.g": HUGE, "model.L": HUGE}}, "sweep", str(10**12)),
        (
            {"levels": [24, 25], "samples": "all", "time": {"end": 1, "base_steps": 16}},
            "levels",
            "bytes",
        ),
        ({"levels": [28], "samples": "all"}, "levels", str(MEMORY)),
        (
            {"levels": [12], "samples": "all", "sweep": {"model.g": {"linspace": [1, 2, 10**7]}}},
            "levels",
            str(DISK),
        ),
    ],
)
def test_message_carries_the_number(changes: dict[str, Any], key: str, number: str) -> None:
    faults = faults_of(**changes)
    assert any(fault.key == key and number in str(fault) for fault in faults), faults


def test_the_largest_that_is_allowed() -> None:
    assert build(levels=[6, 30]).steps(30) == 2**30
    assert build(levels=[1], sweep={"model.g": {"linspace": [1, 2, 10**5]}}).members == 10**5


def test_dt_must_not_vanish() -> None:
    assert "time step" in only_fault(time={"end": 5e-324}).rule


def test_linspace_has_exact_ends() -> None:
    values = line(0.1, 0.7, 7)
    assert (values[0], values[-1], len(values)) == (0.1, 0.7, 7)
    assert values[2] == 0.1 + (0.7 - 0.1) * 2 / 6


# The peak is that of the probe's own memory: `getrusage` begins with the peak of the process that started the probe.
# One process reads all files, and has that peak up to each of them.
PROBE = """
import cProfile, json, re, sys
from pathlib import Path
from vibsim.experiment import Experiment
from vibsim.core.errors import InputError
for name in sys.argv[1:]:
    profile = cProfile.Profile()
    try:
        with profile:
            Experiment.from_yaml(name)
        print(json.dumps(None))
    except InputError as error:
        calls = sum(entry.callcount for entry in profile.getstats())
        peak = re.search(r"VmHWM:\\s*(\\d+) kB", Path("/proc/self/status").read_text())
        print(json.dumps([calls, int(peak[1]), str(error)]))
"""

TOO_LARGE = {
    "level": "levels: [60]",
    "levels": "levels: {from: 0, to: 1000000000000}",
    "sweep": "levels: [6]\nsweep: {model.g: {linspace: [1, 2, 1000000000000]}}",
    "grid": "levels: [6]\nsweep: {model.g: {linspace: [1, 2, 1000000]}, "
    "model.L: {linspace: [1, 2, 1000000]}}",
    "steps": "levels: [6]\ntime: {end: 1, base_steps: 1" + "0" * 300 + "}",
    "digits": "levels: [" + "9" * 100_000 + "]",
    "list": "levels: [6]\nsweep: {model.g: [" + "x," * 30_000 + "]}",
    "names": "levels: [6]\nsweep: {model.g: [" + ",".join(f"x{i}" for i in range(90_000)) + "]}",
    "numbers": "levels: [6, " + "x, " * 30_000 + "]",
    "checks": "levels: [6]\nchecks: [" + "x, " * 90_000 + "]",
    "schemes": "levels: [6]\nschemes: [" + "central, " * 30_000 + "]",
    "formulas": "levels: [6]\ninitial: {theta: '" + "9**" * 600 + "9'}",
    "alias": "levels: [6]\na: &a [" + "1," * 3000 + "]\nb: [" + "*a," * 49 + "]",
    "keys": "levels: [6]\ninitial: {" + ", ".join(f"k{i}: 1" for i in range(50_000)) + "}",
}


@pytest.mark.slow
def test_refused_with_little_work_and_300_megabytes(tmp_path: Path) -> None:
    for name, body in TOO_LARGE.items():
        time = "" if "time:" in body else "time: {end: 20}\n"
        head = "title: x\nmodel: {kind: pendulum}\n"
        head += "" if "schemes:" in body else "schemes: [central]\n"
        (tmp_path / f"{name}.yaml").write_text(head + time + body + "\n")
    paths = [str(tmp_path / f"{name}.yaml") for name in TOO_LARGE]
    command = [sys.executable, "-c", PROBE, *paths]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=300)
    for name, found in zip(TOO_LARGE, done.stdout.splitlines(), strict=True):
        calls, kilobytes, message = json.loads(found)
        assert f"{name}.yaml:" in message
        # measured: 40 for each entry
        assert calls < 55 * max(TOO_LARGE[name].count(","), 50_000), name
        assert kilobytes < 300 * 1024, name


def test_files_are_counted_as_a_run_makes_them() -> None:
    def content(members: int) -> dict[str, Any]:
        return {
            "sweep": {"initial.theta": {"linspace": [0.1, 1.0, members]}},
            "levels": {"from": 14, "to": 16},
            "schemes": ["central", "rk4", "euler_cromer", "gauss4", "newmark"],
        }

    fault = only_fault(**content(1_600_000))
    assert fault.key == "levels"
    told = "the levels must not have more than 10000 files, they have "
    assert fault.rule.startswith(told)
    plan = build_plan(build(**content(1_000_000)))
    files = sum(len(level.shards) for level in plan.levels)
    assert int(fault.rule.removeprefix(told)) == pytest.approx(1.6 * files, rel=0.01)
