"""A model given as a formula against the same model built in, in both compiled lanes."""

from __future__ import annotations

import os
import statistics
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from bench.page import Section, table
from bench.timing import seconds
from vibsim.engine import Trajectories, integrate
from vibsim.models import MODELS, Model
from vibsim.models.oscillator import written
from vibsim.schemes import SCHEMES

TITLE = "Formulas"
ANSWER = "A model written as a formula takes at most {0[formulas.ratio]:.2f} times the time of the same model built in."
KINDS = ("central", "rk4")
IDLE = 1.2
"""Load of a machine that does nothing else."""
DT = 0.01
START = (0.8, 0.1)


@dataclass(frozen=True)
class Pair:
    """A built-in model, and the spring of an oscillator with the same acceleration."""

    kind: str
    spring: str
    names: tuple[str, ...]


PAIRS = (
    Pair("spring", "w**2*u", ("w",)),
    Pair("duffing", "alpha*u + beta*u**3", ("alpha", "beta")),
    Pair("pendulum", "g/L*sin(u)", ("g", "L")),
)


def run(small: bool) -> Section:
    """Time each pair in turn: the built-in model, the formula with a mass, and with the mass 1 left out."""
    rounds = 3 if small else 21
    load = os.getloadavg()[0]
    sizes = ((1, 2**10), (64, 2**6)) if small else ((1, 2**18), (2048, 2**9))
    rows: list[list[object]] = []
    for scheme in KINDS:
        for members, steps in sizes:
            for pair in PAIRS:
                with_mass, without, time = ratios(pair, scheme, members, steps, rounds)
                rows.append([scheme, members, pair.kind, time, with_mass, without])
    header = [
        *("scheme", "members", "model", "built in, ns per member-step"),
        *("formula with a mass, ratio", "formula, mass 1, ratio"),
    ]
    caption = (
        "The oscillator `m u'' + s(u) = 0` with the spring of a built-in model as a formula, over that model, with the "
        f"same bits: medians of the ratios of {rounds} interleaved rounds, one thread.{busy(load)}"
    )
    figures = {"formulas.ratio": max(float(str(row[-1])) for row in rows)}
    return Section(tuple(table(caption, header, rows)), figures)


def busy(load: float) -> str:
    """Say that the machine had other work, where it had."""
    if load < IDLE:
        return ""
    return f" The machine had other work (load {load:.1f}): times are too long; ratios are of neighbouring runs."


def ratios(
    pair: Pair, scheme: str, members: int, steps: int, rounds: int
) -> tuple[float, float, float]:
    """Return both ratios, and the time of the built-in model [ns per member and step]."""
    formula = written({"spring": pair.spring}, pair.names)
    models = (
        MODELS[pair.kind],
        formula,
        formula.variant(frozenset()) if formula.variant else formula,
    )
    runs = [go(model, scheme, members, steps) for model in models]
    ends = [run().position for run in runs]
    if any(not np.array_equal(ends[0], other) for other in ends[1:]):
        raise RuntimeError(f"{pair.kind}: a formula has other bits than the built-in model")
    timed = [seconds(run) for run in runs]
    times = [in_turn(timed, turn) for turn in range(rounds)]
    by_model = list(zip(*times, strict=True))
    over = [
        statistics.median(b / a for a, b in zip(by_model[0], by_model[k], strict=True))
        for k in (1, 2)
    ]
    return over[0], over[1], statistics.median(by_model[0]) / (members * steps) * 1e9


def in_turn(timed: Sequence[Callable[[], float]], turn: int) -> list[float]:
    """Time each once, every second time in the other order."""
    order = range(len(timed)) if turn % 2 else reversed(range(len(timed)))
    found = {i: timed[i]() for i in order}
    return [found[i] for i in range(len(timed))]


def go(model: Model, kind: str, members: int, steps: int) -> Callable[[], Trajectories]:
    """Return what runs a model with its defaults; declared parameters are 1 as well."""
    scheme = SCHEMES[kind]
    values = [row.default if row.default or not row.path else 1.0 for row in model.parameters]
    parameters = np.tile(values, (members, 1))
    initial = np.tile(START, (members, 1))

    def once() -> Trajectories:
        options = scheme.defaults()
        dt = np.full(members, DT)
        return integrate(model, scheme, options, parameters, initial, dt, steps, steps, threads=1)

    return once
