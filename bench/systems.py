"""Systems of formulas against built-in models and C written by hand, and a large structure from files."""

from __future__ import annotations

import statistics
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.io import mmwrite
from scipy.sparse import lil_array

from bench import formulas, native
from bench.page import Section, gather, table
from bench.timing import process, seconds
from vibsim.engine import Trajectories, integrate
from vibsim.experiment import Experiment
from vibsim.models import MODELS, Model
from vibsim.models.system import written
from vibsim.schemes import SCHEMES
from vibsim.simulation import simulate

TITLE = "Systems and structures"
ANSWER = (
    "A chain of 64 coordinates takes {0[systems.chain_ratio]:.2f} of the time of C by hand, and a system of one "
    "formula at most {0[systems.ratio]:.2f} times that of the model built in."
)
MASSES = 64
ALPHA, DT = 0.25, 0.05
SAME = 1e-9
"""By which positions of both loops may differ: they add in another order."""


def run(small: bool) -> Section:
    """Time systems against built-in models, a chain against C, and a beam."""
    rounds = 3 if small else 11
    return gather(
        {
            "built in": lambda: against_built_in(small, rounds),
            "chain": lambda: against_c(2**8 if small else 2**15, rounds),
            "beam": lambda: beam(32 if small else 512),
        }
    )


def against_built_in(small: bool, rounds: int) -> tuple[list[str], dict[str, float]]:
    """Return the ratios of the time of a system of one formula over that of the built-in model."""
    sizes = ((1, 2**10), (64, 2**6)) if small else ((1, 2**18), (2048, 2**9))
    rows: list[list[object]] = []
    for scheme in formulas.KINDS:
        for members, steps in sizes:
            for pair in formulas.PAIRS:
                own = written(("u",), {"acceleration.u": f"-({pair.spring})"}, pair.names)
                both = [
                    formulas.go(model, scheme, members, steps) for model in (MODELS[pair.kind], own)
                ]
                a, b = (once().position for once in both)
                if not np.allclose(a, b, rtol=SAME, atol=SAME):
                    raise RuntimeError(f"{pair.kind}: a system moves otherwise")
                rows.append([scheme, members, pair.kind, ratio(both[1], both[0], rounds)])
    caption = f"A system of one formula over the same model built in, medians of {rounds} interleaved ratios."
    worst = max(float(str(row[-1])) for row in rows)
    found = table(caption, ["scheme", "members", "model", "ratio"], rows)
    return found, {"systems.ratio": worst}


def ratio(one: Callable[[], object], other: Callable[[], object], rounds: int) -> float:
    """Return the median of the ratios of two times, taken in turn."""
    timed = [seconds(one), seconds(other)]
    times = [formulas.in_turn(timed, turn) for turn in range(rounds)]
    return statistics.median(a / b for a, b in times)


def chain() -> Model:
    """Return the chain as a system of formulas, with walls that do not move."""
    names = [f"q{i}" for i in range(1, MASSES + 1)]
    around = ["0", *names, "0"]
    texts = {}
    for i, name in enumerate(names, 1):
        right, left = f"({around[i + 1]} - {name})", f"({name} - {around[i - 1]})"
        texts[f"acceleration.{name}"] = f"{right} - {left} + alpha*({right}**2 - {left}**2)"
    return written(tuple(names), texts, ("alpha",))


def against_c(steps: int, rounds: int) -> tuple[list[str], dict[str, float]]:
    """Return the times of a chain of 64 coordinates, stepping alone, and in C."""
    model, scheme = chain(), SCHEMES["velocity_verlet"]
    start = np.sin(np.pi * np.arange(1, MASSES + 1) / (MASSES + 1))
    initial = np.concatenate([start, np.zeros(MASSES)])[None]

    def ours(gather_too: bool) -> Callable[[], Trajectories]:
        def once() -> Trajectories:
            return integrate(
                model,
                scheme,
                scheme.defaults(),
                np.full((1, 1), ALPHA),
                initial,
                np.full(1, DT),
                steps,
                steps,
                threads=1,
                lane="scalar",
                with_gathered=gather_too,
            )

        return once

    with tempfile.TemporaryDirectory() as folder:
        flags = (*native.STRICT, f"-DN={MASSES}")
        library = native.build("chain", Path(folder), flags)

        def by_hand() -> tuple[float, np.ndarray]:
            q, v = start.copy(), np.zeros(MASSES)
            return native.call(library, "chain", q, v, ALPHA, DT, steps), q

        ends = ours(False)().states[:MASSES, 0, -1], by_hand()[1]
        if not np.allclose(*ends, rtol=0.0, atol=SAME):
            raise RuntimeError("the chain in C moves otherwise")
        rows: list[list[object]] = []
        for words, gather_too in (("stepping alone", False), ("with energies and extrema", True)):
            once = ours(gather_too)
            over = ratio(once, by_hand, rounds)
            rows.append([words, over, seconds(once)() / steps * 1e9])
    caption = (
        f"A chain of {MASSES} masses with quadratic springs by velocity Verlet, {steps} steps, over C by hand (-O3), "
        "stepping alone."
    )
    found = table(caption, ["what", "time over C", "ns per step"], rows)
    return found, {"systems.chain_ratio": float(str(rows[0][1]))}


def beam(elements: int) -> tuple[list[str], dict[str, float]]:
    """Return the seconds of `vibsim run` with a cantilever from a .mtx pair, and the order of Newmark's scheme."""
    h, size = 1.0 / elements, 2 * elements + 2
    k = [
        [12, 6 * h, -12, 6 * h],
        [6 * h, 4 * h**2, -6 * h, 2 * h**2],
        [-12, -6 * h, 12, -6 * h],
        [6 * h, 2 * h**2, -6 * h, 4 * h**2],
    ]
    m = [
        [156, 22 * h, 54, -13 * h],
        [22 * h, 4 * h**2, 13 * h, -3 * h**2],
        [54, 13 * h, 156, -22 * h],
        [-13 * h, -3 * h**2, -22 * h, 4 * h**2],
    ]
    with tempfile.TemporaryDirectory() as folder:
        for name, rows, factor in (("k", k, h**-3), ("m", m, h / 420)):
            whole = lil_array((size, size))
            for e in range(elements):
                place = slice(2 * e, 2 * e + 4)
                whole[place, place] += np.array(rows) * factor
            mmwrite(Path(folder) / f"{name}.mtx", whole[2:, 2:].tocoo(), precision=17)
        file = Path(folder) / "beam.yaml"
        file.write_text(
            "title: Beam\nmodel: {kind: structure, mass: m.mtx, stiffness: k.mtx, "
            f"observe: {{tip: {size - 3}}}, start: {{displacement: {{mode: 1}}}}}}\n"
            "time: {end: 4.0, base_steps: 64}\nlevels: [0, 1, 2, 3]\nschemes: [newmark]\n"
            "checks: [{converges: tip, order: 2}]\n"
        )
        command = ["-m", "vibsim", "run", str(file), "--results", str(Path(folder) / "results")]
        took = process([sys.executable, *command])
        own = Experiment.from_yaml(file)
        errors = []
        for level in own.levels:
            data = simulate(own, level)
            exact = np.cos(1.8751040687119611**2 * data["t"])
            errors.append(float(abs(data["tip"][0, 0] - exact).max()))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    caption = f"A cantilever of {size - 2} degrees of freedom from a .mtx pair, against the closed form of its motion."
    rows_ = [[size - 2, took.wall, took.cpu, *(float(x) for x in orders)]]
    header = ["degrees of freedom", "wall [s]", "CPU [s]", *("order of two levels",) * 3]
    figures = {"systems.beam_wall": took.wall, "systems.beam_order": float(orders[-1])}
    return table(caption, header, rows_), figures
