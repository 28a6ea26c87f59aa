"""From the experiment file to convergence.nc and summary.json, against scripts that do the same by hand."""

from __future__ import annotations

import shutil
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from bench import workflow
from bench.page import Section, gather, table
from bench.timing import Process, process

TITLE = "The whole pipeline"
ANSWER = (
    "A sweep of 10^6 members on four levels takes {0[pipeline.1000000.wall]:.0f} s up to its verdicts, "
    "{0[pipeline.1000000.simd_ratio]:.1f} times the time of a vectorised script on one core."
)
EXPERIMENT = """\
title: Pendulums released at rest, from small swings to 2.5
model: {{kind: pendulum}}
initial: {{theta: 0.1, omega: 0.0}}
time: {{end: 20.0}}
levels: {{from: 8, to: 11}}
schemes:
  - {{kind: central, end_velocity: kick}}
sweep:
  initial.theta: {values}
checks:
  - {{converges: theta, order: scheme}}
"""
LEVELS = 4
SAME = 1e-6
"""Medians of two ways of computing the same agree to this, relative: the scripts round differently."""
HERE = Path(__file__).parent
PIPELINE, SCALAR, SIMD, BOTH = "pipeline", "scalar script", "SIMD script", "SIMD script, all cores"


def run(small: bool) -> Section:
    """Measure every size."""
    sizes = {1: 2, 300: 1} if small else {1: 5, 1000: 5, 100_000: 3, 1_000_000: 2}
    with tempfile.TemporaryDirectory(prefix="vibsim-bench-") as name:
        folder = Path(name)
        environment = {
            "VIBSIM_CACHE_DIR": str(folder / "kernels"),
            "NUMBA_CACHE_DIR": str(folder / "numba"),
        }

        def measure(members: int, rounds: int) -> Callable[[], tuple[list[str], dict[str, float]]]:
            return lambda: size(members, rounds, folder, environment)

        # kernels and scripts are compiled before anything is timed
        size(min(2000, max(sizes)), 1, folder, environment)
        section = gather({f"{n} members": measure(n, rounds) for n, rounds in sizes.items()})
    return Section((*INTRODUCTION, "", *section.lines), section.figures, section.problems)


INTRODUCTION = (
    f"Levels 8 to 11 up to t = 20, theta_0 from 0.1 to 2.5, {workflow.CORES} cores, whole processes. The pipeline is "
    "Snakemake with `vibsim simulate` and `vibsim analyse`, without a page. The scalar script (numba, one core) "
    "steps one member after the other in the three-term form. The SIMD script does the arithmetic, norms, exact "
    "solution and files of the pipeline by hand. All agree in the medians over members.",
)


def size(
    members: int, rounds: int, folder: Path, environment: dict[str, str]
) -> tuple[list[str], dict[str, float]]:
    """Run pipeline and scripts in turn, compare what they found, and return table and figures."""
    file = folder / f"sweep_{members}.yaml"
    values = f"{{linspace: [0.1, 2.5, {members}]}}" if members > 1 else "[0.1]"
    file.write_text(EXPERIMENT.format(values=values))
    intervals = str(common_intervals(file))
    results, out = folder / "results", folder / "by_hand"
    out.mkdir(exist_ok=True)

    def script(name: str, *rest: str) -> Process:
        command = [sys.executable, str(HERE / name), str(members), intervals, *rest]
        return process(command, environment=environment)

    def whole() -> Process:
        shutil.rmtree(results, ignore_errors=True)
        return workflow.compare(file, "adhoc", results, environment=environment)

    contestants: dict[str, Callable[[], Process]] = {
        PIPELINE: whole,
        SCALAR: lambda: script("script_scalar.py", str(out / "scalar.nc")),
        SIMD: lambda: script("script_simd.py", str(out), "1"),
        BOTH: lambda: script("script_simd.py", str(out), str(workflow.CORES)),
    }
    costs: dict[str, list[Process]] = {name: [] for name in contestants}
    for _ in range(rounds):
        for name, contestant in contestants.items():
            costs[name].append(contestant())
    found = medians(results / f"adhoc/{file.stem}/convergence.nc", out)
    shutil.rmtree(results)
    shutil.rmtree(out)
    return tables(members, rounds, intervals, costs, found)


def common_intervals(file: Path) -> int:
    """Return on how many intervals the pipeline compares the levels, which the scripts must do as well."""
    from vibsim.experiment import Experiment
    from vibsim.experiment.storage import sampling

    experiment = Experiment.from_yaml(file)
    level = experiment.levels[0]
    return int(experiment.steps(level) // sampling(experiment, level))


def medians(convergence: Path, by_hand: Path) -> dict[str, dict[str, float]]:
    """Return the medians over members of pipeline and scripts, at the finest levels."""
    import xarray

    found: dict[str, dict[str, float]] = {}
    with xarray.open_dataset(convergence, decode_timedelta=False) as data:
        one = data.isel(scheme=0)
        norm = [str(value) for value in one["norm"].values].index("l2")
        found[PIPELINE] = {
            "observed order": _median(one["theta_observed_order"].isel(triple=-1, norm=norm)),
            "error": _median(one["theta_error_norm"].isel(level=-1, norm=norm)),
            "period": _median(one["period"].isel(level=-1)),
        }
    with xarray.open_dataset(by_hand / "convergence.nc", decode_timedelta=False) as data:
        found[SIMD] = {
            "observed order": _median(data["theta_observed_order"][-1]),
            "error": _median(data["theta_error_norm"][-1]),
            "period": _median(data["period"][-1]),
        }
    with xarray.open_dataset(by_hand / "scalar.nc", decode_timedelta=False) as data:
        found[SCALAR] = {
            "observed order": _median(data["observed_order"][-1]),
            "period": _median(data["period"][-1]),
        }
    return found


def _median(values: Any) -> float:
    return float(np.nanmedian(np.asarray(values)))


def tables(
    members: int,
    rounds: int,
    intervals: str,
    costs: dict[str, list[Process]],
    found: dict[str, dict[str, float]],
) -> tuple[list[str], dict[str, float]]:
    """Write the table of one size.

    Raises
    ------
    RuntimeError
        Where the scripts find other medians than the pipeline.
    """
    wall = {name: median(cost.wall for cost in rows) for name, rows in costs.items()}
    rows: list[list[object]] = []
    for name, runs in costs.items():
        seen = found.get(name, {})
        rows.append(
            [
                *(name, wall[name], wall[PIPELINE] / wall[name], max(run.peak_mib for run in runs)),
                *(f"{seen[key]:.9g}" if key in seen else "" for key in found[PIPELINE]),
            ]
        )
    caption = f"{members} members x {LEVELS} levels, {intervals} common intervals, {rounds} rounds."
    header = ["what", "wall s", "pipeline over it", "largest process MiB", "median observed order"]
    lines = table(caption, [*header, "median error of theta", "median period"], rows)
    for name, seen in found.items():
        for key, value in seen.items():
            if not abs(value - found[PIPELINE][key]) <= SAME * abs(value):
                raise RuntimeError(f"{name} and pipeline differ in the median {key}: {found}")
    figures = {
        f"pipeline.{members}.scalar_ratio": wall[PIPELINE] / wall[SCALAR],
        f"pipeline.{members}.simd_ratio": wall[PIPELINE] / wall[SIMD],
        f"pipeline.{members}.both_ratio": wall[PIPELINE] / wall[BOTH],
        f"pipeline.{members}.wall": wall[PIPELINE],
        f"pipeline.{members}.peak_mib": max(run.peak_mib for run in costs[PIPELINE]),
    }
    return lines, figures
