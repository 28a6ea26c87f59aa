"""Whole processes: what a job costs beyond its stepping, how much memory a deep level takes, nothing to do."""

from __future__ import annotations

import json
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

from bench.timing import Process, process

ROOT = Path(__file__).resolve().parents[1]
EXPERIMENT = """\
title: One member at a deep level
model: {kind: pendulum}
initial: {theta: 1.0}
time: {end: 20.0}
levels: [6, 26]
samples: common
schemes: [central]
"""
ROUNDS = 5


def run() -> list[str]:
    """Measure and return the rows of the table."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        file = folder / "deep_level.yaml"
        file.write_text(EXPERIMENT)
        rows = [*_levels(file, folder), *_nothing_to_do(folder)]
    return ["Whole processes, medians.", "", "| what | figure |", "|---|---:|", *rows]


def _levels(file: Path, folder: Path) -> list[str]:
    vibsim = [sys.executable, "-m", "vibsim"]

    def simulate(level: int) -> list[str]:
        out = str(folder / f"level_{level:02d}.nc")
        return [*vibsim, "simulate", str(file), "--level", str(level), "--out", out]

    process(simulate(26))
    little = [process(simulate(6)) for _ in range(ROUNDS)]
    deep = [process(simulate(26)) for _ in range(3)]
    return [
        f"| simulate job, level 6 (64 steps), CPU seconds | {_median(little, 'cpu'):.2f} |",
        f"| simulate job, level 26 (6.7e7 steps), wall seconds | {_median(deep, 'wall'):.2f} |",
        f"| simulate job, level 26, peak MiB | {_median(deep, 'peak_mib'):.0f} |",
    ]


def _nothing_to_do(folder: Path) -> list[str]:
    results = folder / "results"
    files = sorted(str(path) for path in (ROOT / "configs" / "pendulum_lab").glob("*.yaml"))
    config = folder / "config.json"
    config.write_text(json.dumps({"experiments": files, "results": str(results)}))
    ours = [sys.executable, "-m", "vibsim", "run", "pendulum_lab", "--results", str(results)]
    bare = [
        *(
            sys.executable,
            "-m",
            "snakemake",
            "--cores",
            "2",
            "--snakefile",
            str(ROOT / "Snakefile"),
        ),
        *("--workflow-profile", str(ROOT / "workflow/profiles/default")),
        *("--configfile", str(config)),
    ]
    cold = process(ours, VIBSIM_CACHE_DIR=str(folder / "kernels"))
    done = subprocess.run(bare, capture_output=True, text=True, check=True)
    if "Nothing to be done" not in done.stdout + done.stderr:
        raise RuntimeError("Snakemake by hand does not see the files of the run")
    pairs = [(process(ours).wall, process(bare).wall) for _ in range(ROUNDS)]
    times = [statistics.median(column) for column in zip(*pairs, strict=True)]
    ratio = statistics.median(a / b for a, b in pairs)
    return [
        f"| pendulum_lab ({len(files)} experiments), cold, no kernel compiled before, wall seconds | {cold.wall:.1f} |",
        f"| the same again, nothing to do, `vibsim run`, wall seconds | {times[0]:.2f} |",
        f"| nothing to do, bare Snakemake on the same files, wall seconds | {times[1]:.2f} |",
        f"| nothing to do, ratio pair by pair | {ratio:.2f} |",
    ]


def _median(costs: list[Process], field: str) -> float:
    return statistics.median(getattr(cost, field) for cost in costs)
