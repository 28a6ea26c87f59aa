"""A sweep of 10^5 members over two nodes of SLURM with one core each, against a run on both cores of this machine.

The cluster is that of the tests (`tests/cluster/slurm.py`): it stands on this machine, each node on a core of its own,
so both ways have the same cores. It needs root and the packages of Debian.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from statistics import median

from bench.page import Section, table
from bench.timing import process
from tests.cluster.slurm import cluster, missing

TITLE = "A cluster"
ANSWER = (
    "On two nodes of SLURM a sweep takes {0[cluster.ratio]:.2f} times as long as a local run on the same "
    "two cores."
)
EXPERIMENT = """\
title: Pendulums of many amplitudes and lengths
model: {{kind: pendulum}}
initial: {{theta: 0.1, omega: 0.0}}
time: {{end: 20.0}}
levels: {{from: 11, to: 14}}
schemes: [central]
sweep:
  initial.theta: {{linspace: [0.1, 2.5, {amplitudes}]}}
  model.L: {{linspace: [0.5, 2.0, {lengths}]}}
checks:
  - {{converges: theta, order: 2}}
"""
WAYS = {
    "vibsim run --cores 2": ("--cores", "2"),
    "vibsim run --executor slurm": ("--executor", "slurm"),
}
ROUNDS = 3


def run(small: bool) -> Section:
    """Run the sweep both ways.

    Raises
    ------
    RuntimeError
        Where there is no SLURM, or the two ways write other bytes.
    """
    if why := missing():
        raise RuntimeError(f"no SLURM: {why}")
    amplitudes, lengths = (10, 10) if small else (400, 250)
    walls: dict[str, list[float]] = {way: [] for way in WAYS}
    with tempfile.TemporaryDirectory(prefix="vibsim-") as name:
        folder = Path(name)
        file = folder / "pendulums.yaml"
        file.write_text(EXPERIMENT.format(amplitudes=amplitudes, lengths=lengths))
        with cluster(folder / "slurm") as nodes:
            for number in range(1 if small else ROUNDS):
                made = []
                for way, options in WAYS.items():
                    results = folder / f"results_{number}_{len(made)}"
                    command = [sys.executable, "-m", "vibsim", "run", str(file), *options]
                    command[5:5] = ["--results", str(results)]
                    walls[way].append(process(command, environment=nodes.environment).wall)
                    made.append(contents(results))
                if made[0] != made[1]:
                    raise RuntimeError("the cluster wrote other bytes")
    here, there = (median(found) for found in walls.values())
    caption = (
        f"{amplitudes * lengths} members at levels 11 to 14, medians of {number + 1} runs in turn. All files have the "
        "same bytes."
    )
    rows: list[list[object]] = [
        [way, wall, wall / here] for way, wall in zip(WAYS, (here, there), strict=True)
    ]
    lines = table(caption, ["what", "wall s", "over the local run"], rows)
    return Section(tuple(lines), {"cluster.ratio": there / here})


def contents(results: Path) -> dict[str, bytes]:
    """Return the bytes of all data and pages of an experiment."""
    return {
        path.relative_to(results).as_posix(): path.read_bytes()
        for path in (results / "adhoc").rglob("*")
        if path.suffix in (".nc", ".json", ".html", ".csv", ".tex", ".svg")
    }
