"""What `vibsim plan` predicts of twenty experiments, against what their runs take.

Every run is made anew, with its page, on one core; kernels are compiled before, references are not there yet. CPU time
is that of all processes of `vibsim run`; the clock is that of the run.
"""

from __future__ import annotations

import csv
import json
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from bench.page import Section, gather, table
from bench.timing import process
from vibsim.core import private_cache

TITLE = "Plans against runs"
EXPERIMENTS = (
    "pendulum_lab/theta_convergence",
    "pendulum_lab/three_arithmetics",
    "pendulum_lab/period_map",
    "pendulum_lab/end_point_long_run",
    "showcase/duffing_branches",
    "showcase/duffing_periods",
    "showcase/duffing_response",
    "showcase/double_pendulum",
    "showcase/mass_chain",
    "showcase/cantilever",
    "showcase/two_beads",
    "showcase/van_der_pol",
    "showcase/quarter_car",
    "showcase/vehicle_over_speed",
    "vibration_text/bouncing_ball",
    "vibration_text/bumpy_road",
    "vibration_text/classical_schemes",
    "vibration_text/adaptive_against_equal_points",
    "vibration_text/elastic_pendulum_drag",
    "vibration_text/order_and_stability_map",
)
FACTOR = 1.5
"""By which a prediction may be off."""
ANSWER = (
    f"`vibsim plan` is within a factor of {FACTOR} of CPU time for {{0[plans.cpu]:.0f}}, of the clock for "
    f"{{0[plans.wall]:.0f}}, of memory for {{0[plans.memory]:.0f}} and of disk for {{0[plans.disk]:.0f}} of "
    f"{len(EXPERIMENTS)} experiments."
)
KEPT = ("imports", "kernels", "templates")
"""What of the private cache a run finds."""


def run(small: bool) -> Section:
    """Measure every experiment."""
    return gather({"plans": lambda: compared(EXPERIMENTS[:1] if small else EXPERIMENTS)})


def compared(names: Sequence[str]) -> tuple[list[str], dict[str, float]]:
    """Return the table of predictions and measurements, and how many of them agree."""
    rows: list[list[object]] = []
    agree = {"cpu": 0, "wall": 0, "memory": 0, "disk": 0}
    for name in names:
        planned, found = predicted(name), measured(name)
        row: list[object] = [name]
        for key in ("cpu", "wall", "memory", "disk"):
            row += [planned[key], found[key]]
            agree[key] += 1 / FACTOR <= planned[key] / found[key] <= FACTOR
        rows.append(row)
    header = ["experiment"]
    for key in ("CPU [s]", "clock [s]", "memory of a job [MB]", "disk [MB]"):
        header += [f"{key}, planned", "measured"]
    caption = "On one core. Disk is planned before compression."
    figures = {f"plans.{key}": float(count) for key, count in agree.items()}
    return table(caption, header, rows), figures


def predicted(name: str) -> dict[str, float]:
    """Return what `vibsim plan` says of an experiment, in seconds and MB."""
    command = [sys.executable, "-m", "vibsim", "plan", name, "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    total = json.loads(done.stdout)[0]["total"]
    found = {"memory": total["memory"] / 1e6, "disk": total["bytes"] / 1e6}
    return found | {"cpu": total["cpu_seconds"], "wall": total["wall_seconds"]["1"]}


def measured(name: str) -> dict[str, float]:
    """Run an experiment in a folder of its own, and return the same of it."""
    with tempfile.TemporaryDirectory() as folder:
        results, cache = Path(folder) / "results", Path(folder) / "cache"
        for kind in KEPT:
            known = private_cache.place() / kind
            if known.exists():
                shutil.copytree(known, cache / kind)
        command = [sys.executable, "-m", "vibsim", "run", name, "--results", str(results)]
        environment = {private_cache.VARIABLE: str(cache)}
        found = process([*command, "--cores", "1"], environment=environment)
        # of the page no memory is planned
        paths = [p for p in (results / name / "benchmarks").iterdir() if p.stem != "report"]
        jobs = [job for path in paths for job in table_of(path)]
        files = (path for path in (results / name).glob("**/*") if path.is_file())
        written = (path.stat().st_size for path in files)
        return {
            "cpu": found.cpu,
            "wall": found.wall,
            "memory": max(float(job["max_rss"]) for job in jobs) * 2**20 / 1e6,
            "disk": sum(written) / 1e6,
        }


def table_of(path: Path) -> list[dict[str, Any]]:
    """Return what Snakemake measured of a job."""
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file, delimiter="\t"))
