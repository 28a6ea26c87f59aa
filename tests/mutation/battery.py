"""Small experiments of every kind, and what their verdicts and a plain ratio of differences say.

Run as a program it prints, as JSON, what it found with the package that Python imports, of the experiments that are
named, or of all.
"""

from __future__ import annotations

import json
import math
import sys
from typing import Any

CONVERGE = [
    *({"converges": q, "order": "scheme"} for q in ("theta", "omega")),
    {
        "converges": "energy_deviation",
        "order": "scheme",
        "schemes": ["central", "yoshida4", "crank_nicolson"],
    },
    {"converges": "theta", "order": "scheme", "norm": "linf"},
]
LEVELS = {"from": 5, "to": 10}
L2_BY_HAND = 0.007418752779801702
"""Of the centred recurrence on u'' + 6.25 u = 0, u(0) = 1, u'(0) = 0.4, T = 4, 64 steps, at the points of level 5."""
MACHINE_AT_END = 0.09613350695636094
"""u(4) of the machine below, from its equation by SciPy's DOP853."""


def _of(
    model: dict[str, Any], end: float, schemes: list[Any], checks: list[Any], **more: Any
) -> dict[str, Any]:
    return {
        "title": "A battery", "source": "none", "model": model, "time": {"end": end}, "levels": LEVELS,
        "schemes": schemes, "checks": checks, **more,
    }  # fmt: skip


def _each(quantities: tuple[str, ...], **more: Any) -> list[dict[str, Any]]:
    return [{"converges": q, "order": "scheme", **more} for q in quantities]


ENERGY = "energy_deviation"
EXPERIMENTS = {
    "pendulum": _of(
        {"kind": "pendulum", "g": 2.0, "L": 1.3, "m": 0.7},
        8.0,
        [
            {"kind": "central", "end_velocity": "kick"},
            "rk4",
            "crank_nicolson",
            "euler_cromer",
            "ab2",
            "ab3",
            "bdf2",
            "yoshida4",
            "pefrl",
            "rkn4",
            "newmark",
            "gauss4",
            {"kind": "central", "label": "increment", "arithmetic": "increment"},
        ],
        [
            *CONVERGE,
            {
                "value": "error_estimate_defect",
                "quantity": "theta",
                "at": {"scheme": "central", "level": 5},
                "below": 0.05,
            },
            {
                "value": "period_error",
                "at": {"scheme": "rk4", "level": 10},
                "equals": 0.0,
                "atol": 1e-6,
            },
            {"equal": ["central", "increment"], "quantity": "theta", "level": 10, "atol": 1e-11},
        ],
        initial={"theta": 1.2, "omega": 0.3},
    ),
    "samples": _of(
        {"kind": "pendulum", "L": 1.3},
        4.1,
        ["central", "rk4"],
        _each(("theta",)),
        initial={"theta": 1.2},
        samples={"every": 4},
    ),
    "spring": _of(
        {"kind": "spring", "w": 2.5},
        4.0,
        ["central", "rk4", "crank_nicolson"],
        [
            *_each(("u", "v", ENERGY)),
            {"equal": ["central", "discrete"], "quantity": "u", "level": 8, "atol": 1e-12},
            {"equal": ["crank_nicolson", "discrete"], "quantity": "u", "level": 8, "atol": 1e-12},
            {"equal": ["rk4", "discrete"], "quantity": "u", "level": 8, "atol": 1e-12},
            {
                "value": "error_l2",
                "quantity": "u",
                "at": {"scheme": "central", "level": 6},
                "equals": L2_BY_HAND,
                "rtol": 1e-3,
            },
        ],
        initial={"u": 1.0, "v": 0.4},
    ),
    "drag": _of(
        {"kind": "pendulum", "L": 1.3, "drag": 0.4},
        4.0,
        [
            {"kind": "central", "end_velocity": "kick"},
            "central_quadratic_root",
            "rk2",
            "crank_nicolson",
        ],
        [*_each(("theta", "energy_budget"))],
        initial={"theta": 2.2},
    ),
    "manufactured": _of(
        {
            "kind": "oscillator",
            "m": 1.7,
            "spring": "2*u + u**3",
            "damping": {"quadratic": 0.3},
            "exact": "1 + sin(0.7*t) + 0.3*t",
        },
        2.0,
        ["central", "central_quadratic_root", "rk2"],
        [*_each(("u",)), *_each(("energy_budget",), schemes=["central", "central_quadratic_root"])],
    ),
    "linear": _of(
        {
            "kind": "oscillator",
            "m": 1.7,
            "spring": "2*u",
            "damping": {"linear": 0.3},
            "force": "cos(1.3*t)",
        },
        4.0,
        ["central", "rk4", "crank_nicolson", "ab3"],
        _each(("u", "v", "energy_budget")),
        initial={"u": 0.5, "v": 0.2},
    ),
    "machine": _of(
        {"kind": "washing_machine", "m": 1.4, "k": 3.0, "b": 0.2, "unbalance": 0.5, "speed": 1.7},
        4.0,
        ["central", "rk4"],
        [
            *_each(("u", "energy_budget")),
            {
                "value": "end",
                "quantity": "u",
                "at": {"scheme": "rk4", "level": 10},
                "equals": MACHINE_AT_END,
                "atol": 1e-7,
            },
        ],
    ),
    "elastic": _of(
        {"kind": "elastic_pendulum", "beta": 0.8, "Theta": 30, "gamma": 0.2},
        3.0,
        ["central", "rk4", "gauss4"],
        _each(("x", "y", "energy_budget")),
    ),
    "vertical": _of(
        {"kind": "elastic_pendulum", "beta": 0.8, "Theta": 0, "epsilon": 0.2},
        3.0,
        ["central", "rk4"],
        _each(("y",)),
    ),
    "followed": _of(
        {
            "kind": "elastic_pendulum",
            "beta": 0.8,
            "gamma": 0.5,
            "exact_x": "0.4*sin(1.3*t)",
            "exact_y": "0.2*cos(t)**2",
        },
        3.0,
        ["central", "rk4"],
        _each(("x", "y", "energy_budget")),
    ),
    "box": _of(
        {"kind": "sliding_box", "mu": 0.15},
        12.0,
        ["central", "rk4"],
        [
            *_each(("u",)),
            # at rest after three half swings: 1, -0.7, 0.4, -0.1
            {
                "value": "rest_time",
                "at": {"scheme": "rk4", "level": 10},
                "equals": 3 * math.pi,
                "atol": 1e-6,
            },
        ],
        initial={"u": 1.0},
    ),
    "ball": _of(
        {"kind": "bouncing_ball", "g": 2.0, "restitution": 0.7},
        4.0,
        ["rk4", "velocity_verlet"],
        [
            # impacts at 1, 2.4 and 3.38
            {
                "value": "last_event_time",
                "at": {"scheme": "rk4", "level": 8},
                "equals": 3.38,
                "atol": 1e-9,
            },
            {
                "value": "error_linf",
                "quantity": "h",
                "at": {"scheme": "velocity_verlet", "level": 8},
                "below": 1e-9,
            },
        ],
        initial={"h": 1.0},
    ),
}

DAMPED = [
    "central_quadratic_root",
    "crank_nicolson",
    "bdf2",
    "newmark",
    "gauss4",
]
"""Reproduce a quadratic solution with any damping here."""
OF_DEGREE_ONE = ["rk4", "ab2", "ab3", "euler_cromer"]
WITHOUT_DAMPING = ["velocity_verlet", "yoshida4", "pefrl", "rkn4"]
"""Take no force that depends on the velocity."""
SOLUTIONS = {
    "constant": "1.2",
    "linear": "1.2 + 0.7*t",
    "quadratic": "1.2 + 0.7*t + 0.3*t**2",
}


def _polynomial(exact: str, damping: dict[str, float], schemes: list[str]) -> dict[str, Any]:
    model = {"kind": "oscillator", "m": 1.7, "spring": "2*u + u**3", "exact": exact}
    within = {"value": "error_linf", "quantity": "u", "below": 1e-12}
    content = _of({**model, **damping}, 2.0, list(schemes), [within])
    return {**content, "levels": {"from": 5, "to": 7}}


def _polynomials() -> dict[str, dict[str, Any]]:
    """Return the tests of section 8.5 of the vibration text: a solution, and a kind of damping, each."""
    found = {}
    for name, exact in SOLUTIONS.items():
        low = name != "quadratic"
        linear = ["central", *DAMPED, *(OF_DEGREE_ONE if low else ())]
        found[f"{name}, linear damping"] = _polynomial(exact, {"damping": {"linear": 0.3}}, linear)
        squared = linear if low else DAMPED
        found[f"{name}, quadratic damping"] = _polynomial(
            exact, {"damping": {"quadratic": 0.3}}, squared
        )
        free = WITHOUT_DAMPING if low else ["velocity_verlet"]
        found[f"{name}, no damping"] = _polynomial(exact, {}, free)
    return found


POLYNOMIALS = _polynomials()
"""What note [hpl 3] of the vibration text asks about; counted apart from the others."""


def run(name: str) -> dict[str, Any]:
    """Return what the verdicts of an experiment say, by check and scheme, and what a plain ratio says."""
    from vibsim import analyse, simulate, verdicts
    from vibsim import experiment as spec

    experiment = spec.Experiment.from_dict(
        {**EXPERIMENTS, **POLYNOMIALS}[name],
        name=name.replace(", ", "_").replace(" ", "_"),
        collection="battery",
    )
    found = analyse(experiment, [simulate(experiment, level) for level in experiment.levels])
    told = {}
    for check, verdict in zip(experiment.checks, verdicts(experiment, found), strict=True):
        kind = check.value if check.kind == "value" else check.kind
        told[f"{verdict.id} {kind}"] = [
            f"{r.scheme}: {r.status} {r.reason}" for r in verdict.results
        ]
    return {"verdicts": told, "plain": _plain(experiment, found)}


def _plain(experiment: Any, found: Any) -> dict[str, bool]:
    """Say of every quantity and scheme whether the last ratio of differences is near its order, within 1/2."""
    near = {}
    for check in experiment.checks:
        if check.kind != "converges":
            continue
        for i, scheme in enumerate(experiment.schemes):
            orders = found[f"{check.converges}_formal_order"].values
            order = float(orders.reshape(len(experiment.schemes), -1)[i, 0])
            norms = found[f"{check.converges}_difference_norm"].sel(norm="l2").values[i, 0]
            ratio = math.log2(norms[-2] / norms[-1]) if min(norms[-2:]) > 0 else math.nan
            near[f"{check.converges}, {scheme.name}"] = (
                math.isinf(order) or abs(ratio - order) < 0.5
            )
    return near


if __name__ == "__main__":
    report: dict[str, Any] = {}
    for experiment_name in sys.argv[1:] or (*EXPERIMENTS, *POLYNOMIALS):
        try:
            report[experiment_name] = run(experiment_name)
        except Exception as error:  # a fault may do anything
            report[experiment_name] = {"error": f"{type(error).__name__}: {error}"[:200]}
    json.dump(report, sys.stdout)
