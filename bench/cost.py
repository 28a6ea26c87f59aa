"""What a step costs against the number of members, the level and the number of cores."""

from __future__ import annotations

import tempfile
from functools import partial
from pathlib import Path

import numpy as np

from bench import ours, workflow
from bench.page import Section, chart, gather, table
from bench.pipeline import EXPERIMENT
from bench.timing import interleave, seconds

TITLE = "Cost against members, levels and cores"
ANSWER = (
    "A step of one of many members costs {0[cost.stepping]:.2g} ns, {0[cost.gathering]:.2g} ns with all that is "
    "gathered; all cores together are {0[cost.speed_up]:.2f} times as fast as one."
)
PICTURE = Path(__file__).resolve().parents[1] / "docs" / "images" / "cost-members.svg"
Measured = tuple[list[str], dict[str, float]]


def run(small: bool) -> Section:
    """Measure every group."""
    return gather(
        {
            "members": partial(members, small),
            "levels": partial(levels, small),
            "cores": partial(cores, small),
            "cores of a run": partial(cores_of_a_run, small),
        }
    )


def nanoseconds(
    theta: ours.Floats, steps: int, rounds: int, threads: int = 1
) -> tuple[float, float]:
    """Return ns per member-step, gathering and stepping alone; little work is repeated until it takes a millisecond."""
    repeats = max(1, 100_000 // (len(theta) * steps))

    def go(gathers: bool) -> None:
        for _ in range(repeats):
            ours.step(theta, 20.0, steps, gather=gathers, threads=threads)

    times = interleave({str(k): seconds(partial(go, k)) for k in (True, False)}, rounds)
    unit = repeats * len(theta) * steps * 1e-9
    return times["True"] / unit, times["False"] / unit


def members(small: bool) -> Measured:
    """From one member to a million, the whole call of the engine."""
    counts = [1, 10, 100] if small else [10**k for k in range(7)]
    rows: list[list[object]] = []
    for count in counts:
        found = nanoseconds(np.linspace(0.1, 2.5, count), 256, 3 if count < 10**6 else 2)
        rows.append([count, *found])
    caption = "Compensated, level 8 (256 steps), one thread, ns per member-step. The engine chooses the lane itself."
    picture = ""
    if not small:
        curves = {
            name: [(float(row[0]), float(row[k])) for row in rows]  # type: ignore[arg-type]
            for k, name in ((1, "gathering"), (2, "stepping alone"))
        }
        PICTURE.write_text(chart("Cost of a member-step against members", "ns", curves))
        picture = f"![Cost of a member-step against members](images/{PICTURE.name})"
    lines = table(caption, ["members", "gathering", "stepping alone"], rows)
    figures = dict(zip(("cost.gathering", "cost.stepping"), found, strict=True))
    return [*lines, picture, ""] if picture else lines, figures


def levels(small: bool) -> Measured:
    """One member and 4096 members, from shallow to deep."""
    deepest = {
        1: (6, 10, 14) if small else (6, 10, 14, 18, 22, 24),
        4096: (6,) if small else (6, 9, 12),
    }
    rows: list[list[object]] = []
    for count, chosen in deepest.items():
        for level in chosen:
            found = nanoseconds(np.linspace(1.0, 2.5, count), 2**level, 3)
            rows.append([f"{count} x level {level}", *found])
    caption = "Compensated, one thread, ns per member-step."
    return table(caption, ["members and level", "gathering", "stepping alone"], rows), {}


def cores(small: bool) -> Measured:
    """The same work in one thread and in as many as there are cores."""
    count, steps = (256, 64) if small else (65_536, 1024)
    rows: list[list[object]] = []
    theta = np.linspace(0.1, 2.5, count)
    found = {n: nanoseconds(theta, steps, 3, n) for n in range(1, workflow.CORES + 1)}
    for threads, (gathering, stepping) in found.items():
        speed_up = (found[1][0] / gathering, found[1][1] / stepping)
        rows.append([threads, gathering, stepping, *speed_up])
    caption = f"{count} members x {steps} steps, compensated, ns per member-step of wall time."
    header = ["threads", "gathering", "stepping alone", "speed-up gathering", "speed-up stepping"]
    return table(caption, header, rows), {"cost.speed_up": speed_up[0]}


def cores_of_a_run(small: bool) -> Measured:
    """The whole pipeline on one core and on all."""
    count = 50 if small else 100_000
    rows: list[list[object]] = []
    with tempfile.TemporaryDirectory(prefix="vibsim-bench-") as name:
        file = Path(name) / "sweep.yaml"
        file.write_text(EXPERIMENT.format(values=f"{{linspace: [0.1, 2.5, {count}]}}"))
        for number in range(1, workflow.CORES + 1):
            cost = workflow.compare(file, "adhoc", Path(name) / f"results_{number}", number)
            rows.append([number, cost.wall, cost.cpu, cost.peak_mib])
    caption = f"The whole pipeline without the page, {count} members x 4 levels, one run each."
    return table(caption, ["cores", "wall s", "CPU s", "largest process MiB"], rows), {}
