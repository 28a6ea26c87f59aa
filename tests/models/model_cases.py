"""One or more cases of every model of the registry, each with its equation written out again by hand."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import numpy as np
from scipy.integrate import OdeSolution, solve_ivp

from vibsim.engine import integrate
from vibsim.models import MODELS


@dataclass(frozen=True, eq=False)
class Case:
    """A model with numbers, and its acceleration as a function of (u, v, t) that shares nothing with it.

    Of several coordinates u, v and the acceleration are tuples.
    """

    kind: str
    acceleration: Callable[..., Any]
    numbers: dict[str, float] = field(default_factory=dict)
    """Parameters by their places in the section, where they differ from the defaults."""
    initial: tuple[float, ...] = (0.7, 0.4)
    """All positions, then all velocities."""
    end: float = 2.0
    formulas: dict[str, str] = field(default_factory=dict)
    declared: tuple[str, ...] = ()
    names: tuple[str, ...] = ()
    """Of the coordinates, where a file names them."""

    @property
    def model(self):
        model = MODELS[self.kind]
        if self.names:
            model = model.named(self.names)
        if model.written is not None:
            model = model.written(self.formulas, self.declared)
        terms = frozenset(name for name in model.optional if self.numbers.get(name, 0.0))
        return model.variant(terms) if model.variant is not None else model

    @property
    def parameters(self):
        return {p.key: self.numbers.get(p.key, p.default) for p in self.model.parameters}

    @property
    def start(self):
        return dict(zip((s.name for s in self.model.states), self.initial, strict=True))

    @property
    def coordinates(self):
        return len(self.initial) // 2

    def accelerations(self, state, t):
        """The acceleration of every coordinate."""
        if self.coordinates == 1:
            return (self.acceleration(*state, t),)
        return self.acceleration(state[: self.coordinates], state[self.coordinates :], t)

    def states(self, count=12):
        """Places and velocities of all kinds."""
        return np.random.default_rng(5).uniform(-1.3, 1.3, (count, len(self.initial)))

    def reference(self, t):
        """The states at times t, by SciPy at its smallest tolerance."""
        return solution(self, max(self.end, t[-1]))(t)

    def run(self, scheme, steps, *, lane="plain", **more):
        numbers = np.array([list(self.parameters.values())])
        arrays = (numbers, np.array([self.initial]), np.array([self.end / steps]))
        options = scheme.defaults()
        if any(option.name == "end_velocity" for option in scheme.options):
            options = {**options, "end_velocity": "kick"}
        return integrate(self.model, scheme, options, *arrays, steps, 1, lane=lane, **more)


@cache
def solution(case: Case, end: float) -> OdeSolution:
    """Solve the equation of a case once, for every scheme that is compared with it."""
    found = solve_ivp(
        lambda t, y: (*y[case.coordinates :], *case.accelerations(y, t)),
        (0.0, end),
        case.initial,
        method="DOP853",
        dense_output=True,
        rtol=3e-14,
        atol=1e-15,
    )
    return found.sol


def elastic(u, v, t, beta, gamma=0.0, push=lambda t: (0.0, 0.0)):
    """B (106)-(108), and the drag of exercise 23 by its scale in the errata."""
    (x, y), speed = u, math.hypot(*v)
    length = math.sqrt(x * x + (y - 1.0) ** 2)
    pull = beta / (1.0 - beta) * (1.0 - beta / length)
    forces = -pull * x, -pull * (y - 1.0) - beta
    return tuple(
        f - gamma / beta * speed * w + p for f, w, p in zip(forces, v, push(t), strict=True)
    )


def followed(t, beta, gamma):
    """The forces with which ``x = 0.3 sin 2t, y = 0.1 t^2`` is a solution, by its derivatives written out."""
    place, speed = (0.3 * math.sin(2 * t), 0.1 * t * t), (0.6 * math.cos(2 * t), 0.2 * t)
    wanted = -1.2 * math.sin(2 * t), 0.2
    return tuple(a - f for a, f in zip(wanted, elastic(place, speed, t, beta, gamma), strict=True))


def double_pendulum(u, v, t, g, m1, m2, l1, l2):
    """From the mass matrix of Lagrange's equations, solved for the accelerations."""
    (a, b), (va, vb) = u, v
    coupling = m2 * l1 * l2 * math.cos(a - b)
    matrix = [[(m1 + m2) * l1**2, coupling], [coupling, m2 * l2**2]]
    turning = m2 * l1 * l2 * math.sin(a - b)
    right = [
        -turning * vb**2 - (m1 + m2) * g * l1 * math.sin(a),
        turning * va**2 - m2 * g * l2 * math.sin(b),
    ]
    return tuple(np.linalg.solve(matrix, right))


UPPER = (
    "-g*(2*m1 + m2)*sin(a) - m2*g*sin(a - 2*b) - 2*sin(a - b)*m2*(vb**2*l2 + va**2*l1*cos(a - b))"
)
LOWER = "va**2*l1*(m1 + m2) + g*(m1 + m2)*cos(a) + vb**2*l2*m2*cos(a - b)"
INERTIA = "(2*m1 + m2 - m2*cos(2*a - 2*b))"
DOUBLE_PENDULUM = {
    "acceleration.a": f"({UPPER})/(l1*{INERTIA})",
    "acceleration.b": f"2*sin(a - b)*({LOWER})/(l2*{INERTIA})",
    "kinetic.0": "0.5*(m1 + m2)*(l1*va)**2 + 0.5*m2*(l2*vb)**2 + m2*l1*l2*va*vb*cos(a - b)",
    "potential.0": "-(m1 + m2)*g*l1*cos(a) - m2*g*l2*cos(b)",
    "outputs.height": "-l1*cos(a) - l2*cos(b)",
}


def chain(u, v, t, k, c):
    """Three masses 1, 2 and 1 between two walls, with dampers along the springs."""
    place, speed = (0.0, *u, 0.0), (0.0, *v, 0.0)
    pulls = [
        k * (place[i + 1] - place[i]) + c * (speed[i + 1] - speed[i]) for i in range(len(u) + 1)
    ]
    return tuple((pulls[i + 1] - pulls[i]) / m for i, m in enumerate((1.0, 2.0, 1.0)))


def wanted(t):
    """The accelerations of ``sin t``, ``t^2/2`` and ``cos 2t - 1``."""
    return -math.sin(t), 1.0, -4.0 * math.cos(2 * t)


def wanted_motion(t):
    place = math.sin(t), 0.5 * t * t, math.cos(2 * t) - 1.0
    return place, (math.cos(t), t, -2.0 * math.sin(2 * t))


CHAIN = {
    "force.q1": "k*(q2 - 2*q1) + c*(vq2 - 2*vq1)",
    "force.q2": "k*(q3 - 2*q2 + q1) + c*(vq3 - 2*vq2 + vq1)",
    "force.q3": "k*(q2 - 2*q3) + c*(vq2 - 2*vq3)",
    "mass.q2": "2",
}


# the velocity keeps its sign where there is drag, whose second derivative jumps with it
CASES = {
    "spring": Case("spring", lambda u, v, t: -2.25 * u, {"w": 1.5}),
    "pendulum": Case("pendulum", lambda u, v, t: -9.81 / 2.0 * math.sin(u), {"g": 9.81, "L": 2.0}),
    "pendulum-drag": Case(
        "pendulum",
        lambda u, v, t: -0.3 * abs(v) * v - 2.0 / 1.5 * math.sin(u),
        {"g": 2.0, "L": 1.5, "m": 0.4, "drag": 0.3},
        initial=(-1.4, 2.2),
        end=1.0,
    ),
    "linear_pendulum": Case("linear_pendulum", lambda u, v, t: -2.0 / 0.5 * u, {"g": 2, "L": 0.5}),
    "physical_pendulum": Case(
        "physical_pendulum",
        lambda u, v, t: -1.2 * 3.0 * 0.5 * math.sin(u) / 0.8,
        {"inertia": 0.8, "m": 1.2, "g": 3.0, "L": 0.5},
    ),
    "physical_pendulum-drag": Case(
        "physical_pendulum",
        lambda u, v, t: (-0.25 * abs(v) * v - 1.2 * 3.0 * 0.5 * math.sin(u)) / 0.8,
        {"inertia": 0.8, "m": 1.2, "g": 3.0, "L": 0.5, "drag": 0.25},
        initial=(-1.4, 2.6),
        end=1.0,
    ),
    "oscillator": Case(
        "oscillator",
        lambda u, v, t: (math.cos(1.3 * t) - 0.4 * v - 0.1 * v**3 - 2.0 * math.sinh(u)) / 1.5,
        {"m": 1.5, "parameters.k": 2.0},
        formulas={"spring": "k*sinh(u)", "damping": "0.4*v + 0.1*v**3", "force": "cos(1.3*t)"},
        declared=("k",),
    ),
    "oscillator-linear": Case(
        "oscillator",
        lambda u, v, t: (
            (0.8 * math.exp(-0.2 * t) * math.sin(3 * t + 0.4) - 0.3 * v - 2.0 * u) / 1.5
        ),
        {"m": 1.5, "parameters.b": 0.3},
        formulas={"spring": "2*u", "damping": "b*v", "force": "0.8*exp(-0.2*t)*sin(3*t + 0.4)"},
        declared=("b",),
    ),
    "washing_machine": Case(
        "washing_machine",
        lambda u, v, t: (0.2 * 2.25 * math.cos(1.5 * t) - 4.5 * u) / 2.0,
        {"m": 2.0, "k": 4.5, "unbalance": 0.2, "speed": 1.5},
    ),
    "washing_machine-damped": Case(
        "washing_machine",
        lambda u, v, t: (0.2 * 1.44 * math.cos(1.2 * t) - 0.6 * v - 4.5 * u) / 2.0,
        {"m": 2.0, "k": 4.5, "b": 0.6, "unbalance": 0.2, "speed": 1.2},
    ),
    "vehicle": Case(
        "vehicle",
        lambda u, v, t: (1.5 * 0.1 * 4.0 * 1.69 * math.sin(2.0 * 1.3 * t) - 3.0 * u) / 1.5,
        {"m": 1.5, "speed": 1.3},
        formulas={"spring": "3*u", "road": "0.1*sin(2*x)"},
    ),
    "vehicle-damped": Case(
        "vehicle",
        lambda u, v, t: (
            (
                -1.5 * 1.69 * 0.2 * (4.0 * (1.3 * t) ** 2 - 2.0) * math.exp(-((1.3 * t) ** 2))
                - 0.4 * v
                - math.tanh(u)
            )
            / 1.5
        ),
        {"m": 1.5, "b": 0.4, "speed": 1.3},
        formulas={"spring": "tanh(u)", "road": "0.2*exp(-x**2)"},
    ),
    "circuit": Case("circuit", lambda u, v, t: -u / (0.5 * 0.8), {"L": 0.5, "C": 0.8}),
    "circuit-driven": Case(
        "circuit",
        lambda u, v, t: (2.0 * 1.7 * math.cos(1.7 * t) - 0.3 * v - u / 0.8) / 0.5,
        {"L": 0.5, "R": 0.3, "C": 0.8, "parameters.V0": 2.0},
        formulas={"voltage": "V0*sin(1.7*t)"},
        declared=("V0",),
    ),
    "duffing": Case("duffing", lambda u, v, t: -0.5 * u - 1.3 * u**3, {"alpha": 0.5, "beta": 1.3}),
    "duffing-wells": Case(
        "duffing", lambda u, v, t: u - 1.5 * u**3, {"alpha": -1.0, "beta": 1.5}, initial=(0.9, 0.1)
    ),
    "duffing-softening": Case(
        "duffing", lambda u, v, t: -u + 0.4 * u**3, {"alpha": 1.0, "beta": -0.4}
    ),
    "duffing-driven": Case(
        "duffing",
        lambda u, v, t: 0.3 * math.cos(1.2 * t) - 0.2 * v + u - u**3,
        {"delta": 0.2, "alpha": -1.0, "beta": 1.0, "gamma": 0.3, "omega": 1.2},
    ),
    "elastic_pendulum": Case(
        "elastic_pendulum",
        lambda u, v, t: elastic(u, v, t, 0.8),
        {"beta": 0.8, "Theta": 40.0, "epsilon": 0.1},
        initial=(0.7, 0.2, 0.1, -0.3),
    ),
    "elastic_pendulum-vertical": Case(
        "elastic_pendulum",
        lambda u, v, t: elastic(u, v, t, 0.8),
        {"beta": 0.8, "Theta": 0.0, "epsilon": 0.2},
        initial=(0.0, -0.2, 0.0, 0.3),
    ),
    "elastic_pendulum-drag": Case(
        "elastic_pendulum",
        lambda u, v, t: elastic(u, v, t, 0.7, 0.4),
        {"beta": 0.7, "Theta": 20.0, "gamma": 0.4},
        initial=(0.7, 0.2, 0.5, -0.3),
    ),
    "elastic_pendulum-followed": Case(
        "elastic_pendulum",
        lambda u, v, t: elastic(u, v, t, 0.7, 0.4, lambda t: followed(t, 0.7, 0.4)),
        {"beta": 0.7, "gamma": 0.4},
        formulas={"exact_x": "0.3*sin(2*t)", "exact_y": "0.1*t**2"},
        initial=(0.0, 0.0, 0.6, 0.0),
    ),
    "system-van_der_pol": Case(
        "system",
        lambda u, v, t: 0.8 * (1.0 - u * u) * v - u,
        {"parameters.mu": 0.8},
        formulas={"acceleration.u": "mu*(1 - u**2)*v - u"},
        declared=("mu",),
    ),
    "system-mathieu": Case(
        "system",
        lambda u, v, t: -(1.2 + 0.4 * math.cos(2.0 * t)) * u,
        {"parameters.p": 1.2},
        formulas={
            "acceleration.math": "-(p + 0.4*cos(2*t))*math",
            "outputs.samples": "2*math - vmath",
        },
        declared=("p",),
        names=("math",),
    ),
    "system-damped": Case(
        "system",
        lambda u, v, t: (0.3 * math.sin(t) - 0.4 * v - 2.0 * u) / 1.5,
        formulas={"force.u": "0.3*sin(t) - 0.4*v - 2*u", "mass.u": "1.5"},
    ),
    "system-followed": Case(
        "system",
        lambda u, v, t: tuple(
            x + y
            for x, y in zip(
                chain(u, v, t, 1.3, 0.2),
                (
                    a - b
                    for a, b in zip(
                        wanted(t), chain(*wanted_motion(t), t=t, k=1.3, c=0.2), strict=True
                    )
                ),
                strict=True,
            )
        ),
        {"parameters.k": 1.3, "parameters.c": 0.2},
        formulas=CHAIN | {"exact.q1": "sin(t)", "exact.q2": "0.5*t**2", "exact.q3": "cos(2*t) - 1"},
        declared=("k", "c"),
        names=("q1", "q2", "q3"),
        initial=(0.0, 0.0, 0.0, 1.0, 0.0, 0.0),
    ),
    "system-chain": Case(
        "system",
        lambda u, v, t: chain(u, v, t, 1.3, 0.2),
        {"parameters.k": 1.3, "parameters.c": 0.2},
        formulas=CHAIN,
        declared=("k", "c"),
        names=("q1", "q2", "q3"),
        initial=(0.5, -0.2, 0.1, 0.3, 0.4, -0.6),
    ),
    "system-free_chain": Case(
        "system",
        lambda u, v, t: chain(u, v, t, 1.3, 0.0),
        {"parameters.k": 1.3, "parameters.c": 0.0},
        formulas={key: text.partition(" + c*")[0] for key, text in CHAIN.items()},
        declared=("k", "c"),
        names=("q1", "q2", "q3"),
        initial=(0.5, -0.2, 0.1, 0.3, 0.4, -0.6),
    ),
    "system-double_pendulum": Case(
        "system",
        lambda u, v, t: double_pendulum(u, v, t, 2.0, 1.0, 0.7, 1.1, 0.8),
        {
            f"parameters.{k}": x
            for k, x in {"g": 2, "m1": 1, "m2": 0.7, "l1": 1.1, "l2": 0.8}.items()
        },
        formulas=DOUBLE_PENDULUM,
        declared=("g", "m1", "m2", "l1", "l2"),
        names=("a", "b"),
        initial=(0.8, -0.3, 0.2, 0.5),
        end=1.0,
    ),
}
