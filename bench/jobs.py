"""Whole processes: what a job costs beyond its stepping, how much memory a deep level takes, nothing to do."""

from __future__ import annotations

import statistics
import sys
import tempfile
from pathlib import Path

from bench.timing import process

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
    results = str(folder / "results")
    ours = [
        sys.executable,
        "-m",
        "vibsim",
        "run",
        "pendulum_lab/theta_convergence",
        "--results",
        results,
    ]
    file = ROOT / "configs" / "pendulum_lab" / "theta_convergence.yaml"
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
        *("--directory", str(ROOT), "--workflow-profile", str(ROOT / "workflow/profiles/default")),
        *("--config", f"experiments=['{file}']", f"results={results}"),
    ]
    process(ours)
    pairs = [(process(ours).wall, process(bare).wall) for _ in range(ROUNDS)]
    times = [statistics.median(column) for column in zip(*pairs, strict=True)]
    ratio = statistics.median(a / b for a, b in pairs)
    return [
        f"| nothing to do, `vibsim run` of one experiment, seconds | {times[0]:.2f} |",
        f"| nothing to do, bare Snakemake on the same files, seconds | {times[1]:.2f} |",
        f"| nothing to do, ratio pair by pair | {ratio:.2f} |",
    ]


def _median(costs: list[object], field: str) -> float:
    return statistics.median(getattr(cost, field) for cost in costs)
