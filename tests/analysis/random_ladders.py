"""Random real experiments over every scheme and model: what a scheme promises must not be contradicted by a verdict.

An experiment has one model, one or two schemes with random options, random levels, and members that vary initial
values, parameters and perhaps the end together. Each scheme and member is a ladder. Every scheme that is registered is
right, so a verdict FAIL on the order that it promises is wrong, and so is a PASS on another one.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Any

import numpy as np
from whole import analysed

from vibsim import Experiment, verdicts
from vibsim.core.vocabulary import NORMS, ORDER_TOLERANCE
from vibsim.models import Model
from vibsim.schemes import FIXED_STEP, NumberOption, Option

MEMBERS = 8
AGAINST = ("order_low", "order_high", "wrong_limit")
"""Reasons of FAIL that speak of an order or a limit."""
MOST_STEPS = 2**13
"""Of the finest level."""
Rng = np.random.Generator
Content = dict[str, Any]

SPRINGS = (
    "u",
    "k*u",
    "k*u + c*u**3",
    "k*sin(u)",
    "k*sinh(u)",
    "k*tanh(u)",
    "k*u + c*abs(u)*u",
    "k*u + c*max(u - 0.3, 0)",
)
DAMPINGS = (
    None,
    None,
    {"linear": 0.1},
    {"quadratic": 0.1},
    {"coulomb": 0.05},
    "d*v + d*v**3",
    "d*v*abs(v)",
)
FORCES = (
    None,
    None,
    None,
    "F*cos(p*t)",
    "F*exp(-t/5)*sin(p*t)",
    "F*heaviside(t - 1.7)",
    "F*max(t - 1.7, 0)",
    "F*t",
)
SYSTEMS: tuple[Content, ...] = (
    {"acceleration": "q*(1 - u**2)*v - u"},  # van der Pol
    {"acceleration": "-(k + c*cos(p*t))*u - d*v"},  # Mathieu
    {"acceleration": "F*cos(p*t) - d*v*abs(v) - k*sin(u)"},
    {"coordinates": ["x", "y"], "acceleration": {"x": "-k*x + c*(y - x)", "y": "-y + c*(x - y)"}},
    {
        "coordinates": ["x", "y"],
        "acceleration": {"x": "-k*x - c*x*y**2", "y": "-y - c*x**2*y + F*cos(p*t)"},
    },
    # Foucault's pendulum
    {"coordinates": ["x", "y"], "acceleration": {"x": "2*c*vy - k*x", "y": "-2*c*vx - k*y"}},
    # a corner of the force
    {
        "coordinates": ["x", "y"],
        "acceleration": {"x": "-k*x + c*max(y - x, 0)", "y": "-y - c*max(y - x, 0)"},
    },
    # a double pendulum
    {
        "coordinates": ["x", "y"],
        "mass": {"x": {"x": "1 + k", "y": "cos(x - y)"}, "y": "1"},
        "force": {"x": "-(1 + k)*sin(x) - sin(x - y)*vy**2", "y": "-sin(y) + sin(x - y)*vx**2"},
    },
    # a chain between walls
    {
        "repeat": {"i": [1, 4]},
        "coordinates": ["q{i}"],
        "acceleration": {"q{i}": "q{i+1} - 2*q{i} + q{i-1} + c*((q{i+1} - q{i})**3 - (q{i} - q{i-1})**3)"},
        "parameters": {"q0": 0.0, "q5": 0.0},
    },
    # beads that swap their velocities
    {
        "coordinates": ["x", "y"],
        "acceleration": {"x": "-k*x", "y": "-c*(y - 1)"},
        "events": [{"when": "y - x", "falling": True, "then": {"vx": "vy", "vy": "vx"}}],
    },
)  # fmt: skip
EVENTS: tuple[Content, ...] = (
    {"events": [{"when": "u - 0.3", "rising": True, "then": {"v": "-d*v"}}]},
    {"events": [{"when": "u", "then": {"v": "0.9*v + 0.1"}}]},
    {"events": [{"when": "sin(p*t)", "then": {"v": "v + 0.2"}}]},
    {"stop": "u < -0.2 and v < 0"},
)
DRIVES = {"washing_machine": "speed", "vehicle": "speed", "circuit": "parameters.p"}


@dataclass(frozen=True)
class Contradiction:
    """A verdict against a promise."""

    content: Content
    """The experiment of the member alone, with the check that was judged."""
    promised: float
    status: str
    reason: str
    order: float | None


def own_oscillator(rng: Rng) -> tuple[Content, list[str]]:
    """Return an oscillator with formulas, and the parameters that members vary."""
    model: Content = {"kind": "oscillator", "spring": str(rng.choice(SPRINGS))}
    if rng.random() < 0.15:
        model |= {"exact": "F*cos(p*t) + F*exp(-t/5)"}
    damping = DAMPINGS[rng.integers(len(DAMPINGS))]
    if damping is not None and not ("exact" in model and "coulomb" in damping):
        model["damping"] = damping
    force = FORCES[rng.integers(len(FORCES))]
    if force is not None and "exact" not in model:
        model["force"] = force
    if "exact" not in model and "coulomb" not in str(model) and rng.random() < 0.15:
        model |= EVENTS[rng.integers(len(EVENTS))]
    swept = with_parameters(model)
    if isinstance(damping, dict) and "damping" in model:
        swept += [f"damping.{next(iter(damping))}"]
    return model, swept or ["m"]


def with_parameters(model: Content) -> list[str]:
    """Give a model the parameters that its formulas name, and return what members vary."""
    formulas = {key: value for key, value in model.items() if key not in ("kind", "repeat")}
    names = sorted(set(re.findall(r"\b[kcdqFp]\b", str(formulas))))
    model["parameters"] = {**model.get("parameters", {}), **dict.fromkeys(names, 1.0)}
    return [f"parameters.{name}" for name in names]


def own_system(rng: Rng) -> tuple[Content, list[str]]:
    """Return coupled equations, and the parameters that members vary."""
    model: Content = {"kind": "system", **SYSTEMS[rng.integers(len(SYSTEMS))]}
    return model, with_parameters(model)


def own_structure(rng: Rng) -> tuple[Content, list[str]]:
    """Return masses between springs, alone or driven, and the parameters that members vary."""
    count = int(rng.integers(1, 6))
    springs = rng.uniform(0.2, 4.0, count + 1)
    stiffness = np.diag(springs[:-1] + springs[1:])
    between = np.arange(count - 1)
    stiffness[between, between + 1] = stiffness[between + 1, between] = -springs[1:-1]
    model: Content = {
        "kind": "structure",
        "mass": rng.uniform(0.5, 2.0, count).round(3).tolist(),
        "stiffness": stiffness.round(3).tolist(),
    }
    if rng.random() < 0.5:
        model["rayleigh"] = {"alpha": 0.05, "beta": 0.01}
    force = FORCES[rng.integers(len(FORCES))]
    if force is not None:
        model["load"] = {int(rng.integers(1, count + 1)): force}
    swept = with_parameters(model)
    return model, swept + ["rayleigh.alpha"] * ("rayleigh" in model or not swept)


def drawn_model(rng: Rng) -> tuple[Content, list[str]]:
    """Return the section of a model, and the parameters that members vary."""
    kinds = [
        "spring",
        "pendulum",
        "linear_pendulum",
        "physical_pendulum",
        "sliding_box",
        "washing_machine",
    ]
    kinds += ["vehicle", "bouncing_ball", "circuit", "duffing", "elastic_pendulum"]
    kinds += [*["oscillator"] * 6, *["system"] * 4, *["structure"] * 2]
    kind = str(rng.choice(kinds))
    optional = rng.random() < 0.4
    match kind:
        case "oscillator":
            return own_oscillator(rng)
        case "system":
            return own_system(rng)
        case "structure":
            return own_structure(rng)
        case "spring":
            return {"kind": kind}, ["w"]
        case "pendulum" | "physical_pendulum":
            return {"kind": kind}, ["L", *["drag"] * optional]
        case "linear_pendulum":
            return {"kind": kind}, ["L", "g"]
        case "sliding_box":
            return {"kind": kind}, ["mu", *["alpha"] * optional]
        case "washing_machine":
            return {"kind": kind}, ["k", "speed", *["b"] * optional]
        case "vehicle":
            road = str(rng.choice(["H*sin(x)", "H*exp(-(x - 3)**2)", "0"]))
            more = {"parameters": {"H": 0.1}} if "H" in road else {}
            spring = str(rng.choice(["u", "tanh(u)"]))
            return {"kind": kind, "road": road, "spring": spring, **more}, [
                "speed",
                *["b"] * optional,
            ]
        case "bouncing_ball":
            return {"kind": kind}, ["restitution"]
        case "circuit":
            voltage = {"voltage": "F*sin(p*t)", "parameters": {"F": 1.0, "p": 1.0}}
            driven = rng.random() < 0.5
            return {"kind": kind, **(voltage if driven else {})}, ["C", *["R"] * optional]
        case "duffing":
            return {"kind": kind}, ["alpha", "beta", *["delta", "gamma"] * optional]
    return {"kind": kind}, ["beta", "Theta", *["gamma"] * optional]


def drawn_values(rng: Rng, name: str) -> list[float]:
    """Return values of a parameter for every member."""
    low, high = {
        "d": (0.01, 0.5), "drag": (0.01, 0.5), "delta": (0.01, 0.5), "b": (0.01, 0.5), "R": (0.01, 0.5),
        "linear": (0.01, 2.5), "quadratic": (0.01, 0.8), "coulomb": (0.01, 0.2), "mu": (0.01, 0.3),
        "F": (0.1, 2.0), "p": (0.3, 3.0), "restitution": (0.3, 0.95), "Theta": (1.0, 60.0), "gamma": (0.02, 0.4),
    }.get(name.split(".")[-1], (0.3, 3.0))  # fmt: skip
    if name == "beta":
        low, high = 0.3, 0.95
    return [float(f"{x:.4g}") for x in np.exp(rng.uniform(math.log(low), math.log(high), MEMBERS))]


def drawn_start(rng: Rng, states: list[str]) -> dict[str, list[float]]:
    """Return initial values for every member: at rest, in balance, nearly so, tiny, or any."""
    size = 10.0 ** (rng.uniform(-6, -2) if rng.random() < 0.1 else rng.uniform(-1.0, 0.4))
    values = rng.uniform(-size, size, (len(states), MEMBERS))
    kind = rng.choice(["any", "rest", "balance", "near rest"], p=[0.45, 0.3, 0.15, 0.1])
    half = len(states) // 2
    if kind == "rest":
        values[half:] = 0.0
    elif kind == "balance":
        values[:half] = 0.0
    elif kind == "near rest":
        values[half:] *= 10.0 ** rng.uniform(-5, -1)
    return {
        name: [float(f"{x:.4g}") for x in row] for name, row in zip(states, values, strict=True)
    }


def drawn_scheme(rng: Rng, kind: str, label: str, model: Model) -> Content:
    """Return a scheme with random options, but for those that break its promise on purpose."""
    found: Content = {"kind": kind, "label": label}
    has_events = model.events is not None
    for option in FIXED_STEP[kind].options_on(model):
        if option.name == "events" or rng.random() < 0.5:
            continue
        if isinstance(option, NumberOption):
            found[option.name] = float(f"{rng.uniform(option.least, option.most):.3g}")
        elif isinstance(option, Option):
            traps = {"first_order"} if kind.startswith("central") else set()
            words = [word for word in option.choices if word not in {*traps, "backward"}]
            found[option.name] = str(rng.choice(words))
        elif not has_events:
            # a linear piece between events is a special case of the corrected frequency
            found[option.name] = True
    if kind == "newmark" and rng.random() < 0.7:
        # any other gamma damps or grows by an error of order 1
        found.pop("gamma", None)
    if has_events and rng.random() < 0.25:
        found["events"] = "mesh"
    return found


def drawn_levels(rng: Rng, end: float) -> tuple[int, list[int]]:
    """Return base steps and levels: from too coarse to round-off."""
    base = int(rng.choice([1, 1, 3, 5, 7]))
    first_dt = 10.0 ** rng.uniform(-2.3, 0.2)
    first = max(round(math.log2(end / first_dt / base)), 1 if base > 1 else 2)
    most = max(int(math.log2(MOST_STEPS / base)), first + 2)
    first = min(first, most - 2)
    count = int(rng.integers(3, 7))
    step = 2 if rng.random() < 0.07 else 1
    return base, [level for level in range(first, first + count * step, step) if level <= most]


def drawn_experiment(rng: Rng) -> Content:
    """Return the content of an experiment file."""
    model, swept = drawn_model(rng)
    zipped: dict[str, list[float]] = {f"model.{name}": drawn_values(rng, name) for name in swept}
    bare: Content = {
        "title": "t",
        "time": {"end": 1.0},
        "levels": [4],
        "schemes": ["newmark" if model["kind"] == "structure" else "backward_euler"],
    }
    plain = Experiment.from_dict(
        {**bare, "model": model, "sweep": {"zip": zipped}}
    ).model.definition
    names = [*plain.positions, *plain.velocities]
    given = model["kind"] == "elastic_pendulum" or "exact" in model
    if not given:
        zipped |= {f"initial.{name}": row for name, row in drawn_start(rng, names).items()}
    if model["kind"] == "bouncing_ball":
        zipped["initial.h"] = [abs(h) for h in zipped["initial.h"]]
    end = float(f"{10.0 ** rng.uniform(-0.3, 2.0):.4g}")
    if rng.random() < 0.2:
        zipped["time.end"] = [float(f"{end * x:.4g}") for x in rng.uniform(0.5, 1.5, MEMBERS)]
    base, levels = drawn_levels(rng, end)
    treated = [kind for kind, scheme in FIXED_STEP.items() if scheme.treats(plain)]
    kinds = rng.choice(treated, size=min(2, len(treated)), replace=False)
    schemes = [drawn_scheme(rng, str(kind), f"s{i}", plain) for i, kind in enumerate(kinds)]
    quantities = [*plain.positions[:1], *plain.velocities[:1], "energy_deviation"]
    if plain.events is not None:
        # a velocity that jumps has no order
        quantities = [plain.position]
    norm = str(rng.choice(NORMS))
    orders = ["scheme", 1, 2, 3, 4, 5]
    checks = [
        {"id": f"{q}_{order}", "converges": q, "order": order, "norm": norm}
        for q in quantities
        for order in orders
    ]
    return {
        "title": "t",
        "model": model,
        "initial": {},
        "time": {"end": end, "base_steps": base},
        "levels": levels,
        "schemes": schemes,
        "sweep": {"zip": zipped},
        "samples": "common" if rng.random() < 0.5 else "auto",
        "checks": checks,
    }


def contradictions(content: Content) -> tuple[list[Contradiction], dict[tuple[str, str], int]]:
    """Judge an experiment; return the verdicts against promises, and how often each outcome of a promise came out."""
    experiment = Experiment.from_dict(content)
    record = analysed(experiment)
    found: list[Contradiction] = []
    counts: dict[tuple[str, str], int] = {}
    for verdict in verdicts(experiment, record):
        asked = next(check for check in content["checks"] if check["id"] == verdict.id)
        for row in verdict.results:
            promised = of_member(record, f"{asked['converges']}_formal_order", row)
            # a corner of the force leaves a power of its own
            left = of_member(record, "corner_power", row) if "corner_power" in record else math.nan
            if asked["order"] == "scheme":
                counts[row.status, row.reason] = counts.get((row.status, row.reason), 0) + 1
                against = row.status == "FAIL" and row.reason in AGAINST
            else:
                away = np.abs(float(asked["order"]) - np.array([promised, left]))
                against = row.reason == "asymptotic" and not np.any(away <= ORDER_TOLERANCE)
                against |= row.reason == "wrong_limit"
            if against:
                alone = member(content, row.scheme, row.case, asked)
                found.append(Contradiction(alone, promised, row.status, row.reason, row.order))
    return found, counts


def of_member(record: Any, name: str, row: Any) -> float:
    """Return a number of the scheme and the member of a result."""
    own = np.asarray(record[name])[
        [str(label) for label in record["scheme"].values].index(row.scheme)
    ]
    return float(own if own.ndim == 0 else own[row.case if len(own) > 1 else 0])


def member(content: Content, scheme: str, case: int, check: Content) -> Content:
    """Return the experiment of one member and one scheme, with one check."""
    alone = {key: value for key, value in content.items() if key != "sweep"}
    model = dict(content["model"])
    model["parameters"] = dict(model.get("parameters", {}))
    time, initial = dict(content["time"]), {}
    for key, values in content["sweep"]["zip"].items():
        section, _, name = key.partition(".")
        value = values[case]
        if section == "initial":
            initial[name] = value
        elif section == "time":
            time[name] = value
        elif name.startswith("parameters."):
            model["parameters"][name.partition(".")[2]] = value
        elif (part := name.partition("."))[1]:
            # damping or rayleigh
            own = model.get(part[0])
            model[part[0]] = {**(own if isinstance(own, dict) else {}), part[2]: value}
        else:
            model[name] = value
    if not model["parameters"]:
        del model["parameters"]
    own = [row for row in content["schemes"] if row["label"] == scheme]
    return {
        **alone,
        "model": model,
        "initial": initial,
        "time": time,
        "schemes": own,
        "checks": [check],
    }
