"""What a step of every explicit scheme costs in every lane, against what its force evaluations cost."""

from __future__ import annotations

import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial

import numpy as np

from bench.page import Section, table
from bench.timing import interleave
from vibsim.engine import LANES, integrate
from vibsim.engine.kernel import kernel
from vibsim.models import MODELS
from vibsim.schemes import FIXED_STEP, Scheme
from vibsim.schemes.code_generation import self_starting, written

TITLE = "Schemes in every lane"
ANSWER = (
    "Per force evaluation no explicit scheme costs more than {0[lanes.scalar.bare]:.2f} times as much as `central` for "
    "one member, {0[lanes.blocks.bare]:.2f} times for many."
)
LIMIT = 1.3
END = 20.0
BASE = "central"

OPERATIONS = {
    "central": 7,
    "central_quadratic_root": 7,
    "central_backward_damping": 8,
    "forward_euler": 4,
    "rk2": 10,
    "heun": 14,
    "rk3": 30,
    "rk4": 34,
    "ab2": 10,
    "ab3": 14,
    "euler_cromer": 4,
    "euler_cromer_u_first": 4,
    "velocity_verlet": 7,
    "position_verlet": 7,
    "yoshida4": 18,
    "pefrl": 23,
    "rkn4": 25,
}
"""``+ - * /`` of a step beside those of the force, counted by hand in its text; equal parts such as ``C_1 * dt`` count
once, and the time does not count, because a pendulum does not ask for it."""

EXTRA = 96
"""Operations that `_padded` adds to a step of Forward Euler, to measure what one costs."""


def run(small: bool) -> Section:
    """Measure lane by lane, with everything that is gathered and stepping alone."""
    kinds = [kind for kind, scheme in FIXED_STEP.items() if scheme.explicit]
    kinds = kinds[:3] if small else kinds
    missing = sorted(set(kinds) - set(OPERATIONS))
    problems = [f"no operations are counted for {', '.join(missing)}"] if missing else []
    schemes = {kind: FIXED_STEP[kind] for kind in kinds if kind in OPERATIONS}
    _compile([*schemes.values(), _padded(0), _padded(EXTRA)])
    lines = [_caption(), ""]
    figures: dict[str, float] = {}
    for lane in LANES:
        found = _lane(lane, schemes, small)
        lines += found[0]
        figures |= found[1]
    return Section(tuple(lines), figures, tuple(problems))


def _caption() -> str:
    return (
        "Every explicit scheme on the pendulum with its defaults (centred ones with `increment`), ns of CPU time per "
        "member-step, one thread. The ratio is the cost, without the scheme's own operations beyond those of `central` "
        "(counted by hand), over (force evaluations) x (the cost of `central` in the lane); "
        f"at most {LIMIT:g} is to be reached."
    )


def _lane(lane: str, schemes: dict[str, Scheme], small: bool) -> tuple[list[str], dict[str, float]]:
    members, steps, rounds = {
        "plain": (1, 512, 61),
        "scalar": (1, 2**16, 15),
        "blocks": (512, 512, 15),
    }[lane]
    rounds = 3 if small else rounds
    measured = {}
    for gathers in (False, True):
        contestants = {
            kind: partial(_cost, scheme, lane, members, steps, gathers)
            for kind, scheme in schemes.items()
        }
        if not gathers:
            contestants |= {
                str(extra): partial(_cost, _padded(extra), lane, members, steps, gathers)
                for extra in (0, EXTRA)
            }
        measured[gathers] = interleave(contestants, rounds)
    bare = measured[False]
    operation = max((bare[str(EXTRA)] - bare["0"]) / EXTRA, 0.0)
    rows: list[list[object]] = []
    worst = {False: 0.0, True: 0.0}
    for kind, scheme in schemes.items():
        beyond = max(OPERATIONS[kind] - scheme.force_evaluations * OPERATIONS[BASE], 0)
        row: list[object] = [kind, scheme.force_evaluations, beyond]
        for gathers, times in measured.items():
            allowed = scheme.force_evaluations * times[BASE]
            ratio = (times[kind] - beyond * operation) / allowed
            worst[gathers] = max(worst[gathers], ratio)
            row += [times[kind], ratio]
        rows.append(row)
    caption = (
        f"Lane `{lane}`, {members} members x {steps} steps, medians of {rounds} rounds; an operation costs "
        f"{operation:.2g} ns."
    )
    header = [
        *("scheme", "force evaluations", "operations beyond"),
        *("stepping alone", "ratio", "gathering", "ratio"),
    ]
    figures = {f"lanes.{lane}.bare": worst[False], f"lanes.{lane}.gathering": worst[True]}
    return table(caption, header, rows), figures


def _cost(scheme: Scheme, lane: str, members: int, steps: int, gathers: bool) -> float:
    """Return the CPU time of a member-step in ns."""
    theta = np.linspace(0.1, 2.5, members) if members > 1 else np.ones(1)
    parameters, initial = (
        np.ones((members, len(MODELS["pendulum"].parameters))),
        np.stack([theta, np.zeros(members)], axis=-1),
    )
    dt = np.full(members, END / steps)
    began = time.thread_time()
    integrate(
        MODELS["pendulum"],
        scheme,
        _options(scheme),
        parameters,
        initial,
        dt,
        steps,
        steps,
        lane=lane,
        with_gathered=gathers,
    )
    return (time.thread_time() - began) / (members * steps) * 1e9


def _options(scheme: Scheme) -> dict[str, str | float | bool]:
    options = scheme.defaults()
    return options | {"arithmetic": "increment"} if "arithmetic" in options else options


def _padded(extra: int) -> Scheme:
    """Return Forward Euler with more operations in a step: sums of products that differ, as in a tableau."""
    names = [f"W_{i}" for i in range(1, extra // 2 + 1)]
    terms = "".join(f" + {name} * {'va'[i % 2]}" for i, name in enumerate(names))
    text = (
        "def step_padded(state, t, dt, p, acceleration):\n"
        "    u, v = state\n"
        "    a = acceleration(u, v, t, p)\n"
        f"    return (u + dt * v, v + dt * (a{terms})), v\n"
    )
    step = written(text, {name: f"1/{2**20 + i}" for i, name in enumerate(names)})
    stepper = self_starting(step)
    return replace(FIXED_STEP["forward_euler"], kind=f"padded_{extra}", stepper=lambda _: stepper)


def _compile(schemes: list[Scheme]) -> None:
    """Compile what is not in the cache, two at a time: the compiler runs in processes of its own."""
    model = MODELS["pendulum"]
    wanted: list[Callable[[], object]] = [
        partial(kernel, model, scheme.stepper(_options(scheme)), lane, gathers)
        for scheme in schemes
        for lane in LANES
        for gathers in (False, True)
        if scheme.kind in OPERATIONS or not gathers
    ]
    with ThreadPoolExecutor(2) as pool:
        for _ in pool.map(lambda make: make(), wanted):
            pass
