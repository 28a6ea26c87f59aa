"""One member of the pendulum: the engine's kernel against the same loop in C."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from bench import native, ours
from bench.page import Section, table
from bench.timing import interleave, seconds

TITLE = "One member"
ANSWER = (
    "A step of the compiled loop takes {0[one_member.ns]:.3g} ns, {0[one_member.ratio]:.2f} times the time of the same "
    "loop in C."
)
END = 20.0
THETA = 1.0

BASE = "C, compensated, same sine, gathering the same"
BARE = "C, compensated, same sine, stepping alone"
LIBM = "C, three-term, libm's sine, stepping alone"
FAST = "C with -ffast-math, three-term, libm's sine, stepping alone"


def run(small: bool) -> Section:
    """Time all of them in turn."""
    level, rounds = (16, 3) if small else (22, 11)
    steps = 2**level
    runs = engine_runs(steps)
    reason = ""
    with tempfile.TemporaryDirectory() as folder:
        try:
            runs |= c_runs(Path(folder), steps)
        except native.NotHereError as error:
            reason = str(error)
        else:
            check(runs)
        times = interleave({name: seconds(run) for name, run in runs.items()}, rounds)
    base = times.get(BASE, math.nan)
    rows: list[list[object]] = [
        [name, time / steps * 1e9, time / base] for name, time in times.items()
    ]
    if reason:
        rows.append(["C", f"not measured: {reason}", None])
    caption = (
        f"One pendulum, theta_0 = {THETA:g}, level {level} ({steps} steps), {rounds} rounds. Gathering means "
        "energies, extrema, peaks and turns at every step. C is built with `-O3 -march=native -ffp-contract=off` and "
        "ends with the same bits; `-ffast-math` would undo the compensation."
    )
    header = ["loop", "ns per step", "ratio to C gathering the same"]
    figures = {
        "one_member.ratio": times["engine, compensated"] / base,
        "one_member.bare_ratio": times["engine, compensated, stepping alone"]
        / times.get(BARE, math.nan),
        "one_member.three_term_ratio": times["engine, three_term, stepping alone"]
        / times.get(LIBM, math.nan),
        "one_member.three_term_gathering_ratio": times["engine, three_term"]
        / times.get(LIBM, math.nan),
        "one_member.ns": times["engine, compensated"] / steps * 1e9,
    }
    return Section(tuple(table(caption, header, rows)), figures)


def engine_runs(steps: int) -> dict[str, Callable[[], float]]:
    """Return the kernel in each arithmetic, with everything that it gathers and without."""

    def go(arithmetic: str, gather: bool) -> float:
        theta = np.array([THETA])
        runs = ours.step(theta, END, steps, arithmetic=arithmetic, samples=64, gather=gather)
        return float(runs.position[0, -1])

    return {
        f"engine, {name}{'' if gather else ', stepping alone'}": lambda n=name, g=gather: go(n, g)  # type: ignore[misc]
        for gather in (True, False)
        for name in ("compensated", "increment", "three_term")
    }


def c_runs(folder: Path, steps: int) -> dict[str, Callable[[], float]]:
    """Return the loops in C, each as a function that returns theta at the end."""
    strict = native.build("loop", folder, native.STRICT)
    fast = native.build("loop", folder, native.FAST_MATH)
    out = np.empty(19)
    motion = (THETA, 0.0, 1.0, 1.0)
    return {
        BARE: lambda: float(native.call(strict, "step_only", *motion, END, steps)),
        BASE: lambda: float(native.call(strict, "everything", *motion, 1.0, END, steps, out)),
        LIBM: lambda: float(native.call(strict, "three_term_libm", *motion, END, steps)),
        FAST: lambda: float(native.call(fast, "three_term_libm", *motion, END, steps)),
    }


def check(runs: dict[str, Callable[[], float]]) -> None:
    """Refuse to compare different arithmetic."""
    names = ("engine, compensated", "engine, compensated, stepping alone", BASE, BARE)
    ends = {name: runs[name]() for name in names}
    if len(set(ends.values())) != 1:
        raise RuntimeError(f"not the same arithmetic: {ends}")
