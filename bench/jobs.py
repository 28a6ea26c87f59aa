"""Whole processes: what a job costs beyond its stepping, kernels, nothing to do, the cold start of a default run."""

from __future__ import annotations

import json
import statistics
import subprocess
import sys
import tempfile
from functools import partial
from pathlib import Path

import numpy as np

from bench import ours, workflow
from bench.page import Section, gather, table
from bench.timing import Process, process

TITLE = "Jobs and runs"
ANSWER = (
    "A small job takes {0[jobs.small_wall]:.2f} s, nearly all of it to start; the default run takes "
    "{0[runs.cold]:.0f} s."
)
EXPERIMENT = """\
title: One member at a deep level
model: {kind: pendulum}
initial: {theta: 1.0}
time: {end: 20.0}
levels: [6, 20, 26]
samples: common
schemes: [central]
"""
ROOT = Path(__file__).resolve().parents[1]
Measured = tuple[list[str], dict[str, float]]

KERNEL = """\
import json, sys, time
sys.path.insert(0, sys.argv[1])
began = time.perf_counter()
import numpy as np
from bench import ours
imported = time.perf_counter()
ours.step(np.linspace(0.1, 1.0, 64), 20.0, 64, lane=sys.argv[2])
print(json.dumps([time.perf_counter() - imported, imported - began]))
"""
IMPORTS = (
    "numpy",
    "netCDF4",
    "pydantic",
    "llvmlite.binding",
    "scipy.integrate",
    "xarray",
    "matplotlib.figure",
)


def run(small: bool) -> Section:
    """Measure every group."""
    rounds = 1 if small else 5
    with tempfile.TemporaryDirectory(prefix="vibsim-bench-") as name:
        folder = Path(name)
        file = folder / "deep_level.yaml"
        file.write_text(EXPERIMENT)
        return gather(
            {
                "simulate jobs": partial(levels, file, folder, rounds, small),
                "imports": partial(imports, rounds),
                "kernels": partial(kernels, folder, min(rounds, 3)),
                "runs": partial(runs, folder, rounds, small),
            }
        )


def levels(file: Path, folder: Path, rounds: int, small: bool) -> Measured:
    """Simulate levels of one member by hand; stepping is what the engine alone takes for the same steps."""

    def simulate(level: int) -> Process:
        out = str(folder / f"level_{level:02d}.nc")
        command = [sys.executable, "-m", "vibsim", "simulate", str(file), "--level", str(level)]
        return process([*command, "--out", out], cwd=folder)

    rows: list[list[object]] = []
    beyond: dict[int, float] = {}
    small_wall = 0.0
    for level in (6, 20) if small else (6, 20, 26):
        simulate(level)
        theta, steps = np.array([1.0]), 2**level
        ours.step(theta, 20.0, steps, samples=64)
        jobs = [simulate(level) for _ in range(rounds if level < 26 else min(rounds, 3))]
        began = statistics.median(_cpu(theta, steps) for _ in range(3))
        cpu = statistics.median(job.cpu for job in jobs)
        beyond[level] = cpu - began
        peak = max(job.peak_mib for job in jobs)
        wall = statistics.median(job.wall for job in jobs)
        small_wall = small_wall or wall
        rows.append([f"level {level}, {steps} steps", wall, cpu, began, beyond[level], peak])
    caption = (
        "One job of one member and one scheme, kernel from the cache. Stepping is the time of the engine alone for the "
        "same steps."
    )
    header = ["job", "wall s", "CPU s", "stepping s", "CPU beyond stepping s", "peak MiB"]
    figures = {"jobs.beyond_stepping": max(beyond.values()), "jobs.small_wall": small_wall}
    each = (
        "With one job for each case 1000 members x 4 levels would take "
        f"{4000 * small_wall / workflow.CORES / 60:.0f} minutes on {workflow.CORES} cores."
    )
    return [*table(caption, header, rows), each, ""], figures


def _cpu(theta: ours.Floats, steps: int) -> float:
    from time import process_time

    began = process_time()
    ours.step(theta, 20.0, steps, samples=64)
    return process_time() - began


def imports(rounds: int) -> Measured:
    """Import each library alone; take off what Python itself takes."""

    def seconds(text: str) -> float:
        costs = [process([sys.executable, "-c", text]) for _ in range(rounds)]
        return statistics.median(cost.cpu for cost in costs)

    bare = seconds("pass")
    rows: list[list[object]] = [["Python alone", bare]]
    rows += [[name, seconds(f"import {name}") - bare] for name in IMPORTS]
    return table("What an import costs a process, CPU seconds.", ["import", "s"], rows), {}


def kernels(folder: Path, rounds: int) -> Measured:
    """Compile a kernel in an empty cache, and take it from the cache."""
    from vibsim.engine import LANES

    rows: list[list[object]] = []
    figures = {}
    for lane in (lane for lane in LANES if lane != "plain"):
        first: list[float] = []
        again: list[float] = []
        for i in range(rounds):
            cache = str(folder / f"kernels_{lane}_{i}")
            for times in (first, again):
                times.append(_kernel(lane, cache))
        rows.append([lane, statistics.median(first), statistics.median(again)])
        figures[f"kernels.{lane}.compile"] = statistics.median(first)
        figures[f"kernels.{lane}.cached"] = statistics.median(again)
    caption = "The first call of a kernel with an empty cache and from the cache, seconds, with the import of LLVM."
    return table(caption, ["lane", "compiled", "from the cache"], rows), figures


def _kernel(lane: str, cache: str) -> float:
    import os

    done = subprocess.run(
        [sys.executable, "-c", KERNEL, str(ROOT), lane],
        capture_output=True,
        text=True,
        check=True,
        env={**os.environ, "VIBSIM_CACHE_DIR": cache},
    )
    return float(json.loads(done.stdout)[0])


def runs(folder: Path, rounds: int, small: bool) -> Measured:
    """Run the default experiments from nothing, then again with nothing to do, against Snakemake by hand."""
    from vibsim.core.home import home
    from vibsim.plan import choose

    words = ["theta_convergence"] if small else []
    choices = choose(words, home())
    results, cache = folder / "results", str(folder / "kernels")
    ours_ = [sys.executable, "-m", "vibsim", "run", *words, "--results", str(results)]
    cold = process(ours_, cwd=folder, environment={"VIBSIM_CACHE_DIR": cache})
    bare = workflow.command([choice.file for choice in choices], results)[:-1]
    done = subprocess.run(bare, capture_output=True, text=True, check=True, cwd=folder)
    if "Nothing to be done" not in done.stdout + done.stderr:
        raise RuntimeError("Snakemake by hand does not see the files of the run")
    pairs = [
        (process(ours_, cwd=folder).wall, process(bare, cwd=folder).wall) for _ in range(rounds)
    ]
    own, by_hand = (statistics.median(column) for column in zip(*pairs, strict=True))
    ratio = statistics.median(a / b for a, b in pairs)
    rows: list[list[object]] = [
        ["cold: no results, no kernel compiled before", cold.wall],
        ["the same again, nothing to do, `vibsim run`", own],
        ["nothing to do, bare Snakemake on the same files", by_hand],
        ["ratio of the two, pair by pair (no unit)", ratio],
    ]
    caption = (
        f"A default run of {len(choices)} experiments with their pages, {workflow.CORES} cores."
    )
    figures = {"runs.cold": cold.wall, "runs.nothing_ratio": ratio}
    return table(caption, ["run", "wall s"], rows), figures
