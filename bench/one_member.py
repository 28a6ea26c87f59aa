"""One member of the pendulum: the engine's kernel against the same loop in C -O3."""

from __future__ import annotations

import ctypes
import math
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from bench.timing import interleave, seconds
from vibsim.engine import integrate
from vibsim.models import MODELS
from vibsim.schemes import SCHEMES

LEVEL = 22
STEPS = 2**LEVEL
END = 20.0
THETA = 1.0
ROUNDS = 11


def engine(arithmetic: str) -> float:
    """Run the kernel, with everything that it gathers, and return theta at the end."""
    scheme = SCHEMES["central"]
    runs = integrate(
        MODELS["pendulum"],
        scheme,
        {**scheme.defaults(), "arithmetic": arithmetic, "end_velocity": "kick"},
        np.ones((1, 3)),
        np.array([[THETA, 0.0]]),
        np.array([END / STEPS]),
        STEPS,
        STEPS // 64,
        "compiled",
    )
    return float(runs.position[0, -1])


def build(folder: Path) -> ctypes.CDLL | None:
    """Compile the loop in C; None where there is no gcc."""
    if shutil.which("gcc") is None:
        return None
    library = folder / "loop.so"
    source = Path(__file__).with_name("loop.c")
    flags = ["-O3", "-march=native", "-ffp-contract=off", "-shared", "-fPIC"]
    subprocess.run(["gcc", *flags, str(source), "-o", str(library), "-lm"], check=True)
    return ctypes.CDLL(str(library))


def contestants(library: ctypes.CDLL) -> dict[str, Callable[[], float]]:
    """Return the loops in C, each as a function that returns theta at the end."""
    number = ctypes.c_double
    out = (number * 15)()
    for name in ("step_only", "everything", "three_term_libm"):
        getattr(library, name).restype = number
    motion = [number(THETA), number(0.0), number(1.0), number(1.0)]
    steps = ctypes.c_long(STEPS)
    return {
        "C, compensated, same sine, stepping alone": lambda: library.step_only(
            *motion, number(END), steps
        ),
        "C, compensated, same sine, gathering the same": lambda: library.everything(
            *motion, number(1.0), number(END), steps, out
        ),
        "C, three-term, the library's sine, stepping alone": lambda: library.three_term_libm(
            *motion, number(END), steps
        ),
    }


def run() -> list[str]:
    """Time all of them in turn and return the rows of the table."""
    runs: dict[str, Callable[[], float]] = {
        f"engine, {name}": lambda name=name: engine(name)  # type: ignore[misc]
        for name in ("compensated", "increment", "three_term")
    }
    with tempfile.TemporaryDirectory() as folder:
        library = build(Path(folder))
        if library is not None:
            runs |= contestants(library)
            ours = runs["engine, compensated"]()
            theirs = runs["C, compensated, same sine, gathering the same"]()
            if ours != theirs:
                raise RuntimeError(f"not the same arithmetic: {ours!r} and {theirs!r}")
        times = interleave({name: seconds(run) for name, run in runs.items()}, ROUNDS)
    base = times.get("C, compensated, same sine, gathering the same", math.nan)
    return [
        f"One member, pendulum, theta_0 = {THETA:g}, level {LEVEL}, {ROUNDS} rounds, ns per step. The engine "
        "gathers energies, extrema, peaks and turns at every step.",
        "",
        "| loop | ns per step | ratio to C gathering the same |",
        "|---|---:|---:|",
        *(
            f"| {name} | {time / STEPS * 1e9:.2f} | {time / base:.3f} |"
            for name, time in times.items()
        ),
    ]
