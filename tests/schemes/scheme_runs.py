"""Runs of schemes for the tests of this folder: models of their own, options, ladders that suit an order."""

import dataclasses
import math

import numpy as np

from vibsim.engine import integrate
from vibsim.models import MODELS
from vibsim.schemes import FIXED_STEP, Flag
from vibsim.schemes.orders import depends_on_velocity

DRIVEN = dataclasses.replace(
    MODELS["pendulum"],
    kind="driven",
    acceleration="-(g/L)*sin(theta) + 0.3*cos(1.7*t)",
    conservative=False,
    exact=None,
    exact_period=None,
)
"""A force that depends on the time."""
DRAGGED = dataclasses.replace(
    DRIVEN,
    kind="dragged",
    acceleration="-(g/L)*sin(theta) - 0.2*omega - 0.1*omega**3 + 0.3*cos(1.7*t)",
)
"""A force that depends on the velocity as well."""
BASIC = tuple(MODELS[kind] for kind in ("spring", "pendulum", "linear_pendulum", "oscillator"))
"""Models that between them are all a scheme can tell apart; of every other one see `tests/models`."""
ALL_MODELS = (*BASIC, DRIVEN, DRAGGED)

INITIAL = (2.0, -0.7)
END = 4.0


def suits(scheme, model):
    """Tell whether a smooth model has forces that the scheme can treat."""
    is_smooth = model.events is None
    return is_smooth and (scheme.velocity_forces or not depends_on_velocity(model))


def pairs(models):
    """Yield every scheme with equal steps, with every model that it can treat."""
    for scheme in FIXED_STEP.values():
        for model in models:
            if suits(scheme, model):
                yield scheme, model


def variants(scheme):
    """Yield the default options, and every single change of a word or a flag."""
    yield scheme.defaults()
    for option in scheme.words:
        yield from ({**scheme.defaults(), option.name: word} for word in option.choices[1:])
    for option in scheme.options:
        if isinstance(option, Flag):
            yield {**scheme.defaults(), option.name: not option.default}


def name_of(scheme, options):
    changed = {k: v for k, v in options.items() if v != scheme.defaults()[k]}
    return "-".join([scheme.kind, *(f"{key}={value}" for key, value in changed.items())])


def own_end(scheme):
    """Return the options with which the velocity at the end is the scheme's own."""
    named = {option.name for option in scheme.options}
    return {**scheme.defaults(), **({"end_velocity": "kick"} if "end_velocity" in named else {})}


def levels_for(order, digits=10.0, count=4):
    """Return the levels whose finest one leaves about ``10^-digits`` of the error: the finer the lower the order.

    That is far above the round-off, and with dt below 1e-2 at order 4 the next power of dt changes an order by less
    than 0.05; low orders would reach it at steps so many that the finest one is bounded.
    """
    finest = min(12, math.ceil(math.log2(END * 10.0 ** (digits / min(order, 8.0)))))
    return list(range(finest - count + 1, finest + 1))


def run(scheme, model, options, steps, *, initial=INITIAL, end=END, lane="plain", **more):
    """Return the trajectories of one member with every parameter at its default, every step stored."""
    parameters = np.array([[parameter.default for parameter in model.parameters]])
    numbers = (parameters, np.array([initial]), np.array([end / steps]))
    return integrate(model, scheme, options, *numbers, steps, 1, lane=lane, **more)


def series(scheme, model, options, steps):
    """Return position, velocity and energies at every point but the ends, worked out without the engine."""
    runs = run(scheme, model, options, steps, with_gathered=False)
    u, v = runs.position[0], runs.velocity[0]
    potential = 0.5 * u * u if model.linear else 1.0 - np.cos(u)
    centred = (u[2:] - u[:-2]) / (2.0 * END / steps)
    energy = 0.5 * v * v + potential
    d2t = 0.5 * centred * centred + potential[1:-1]
    return {
        model.position: u[1:-1],
        model.velocity: v[1:-1],
        "kinetic_energy": 0.5 * v[1:-1] ** 2,
        "potential_energy": potential[1:-1],
        "energy": energy[1:-1],
        "energy_deviation": (energy - energy[0])[1:-1],
        f"{model.velocity}_d2t": centred,
        "energy_d2t": d2t,
        "energy_deviation_d2t": d2t - energy[0],
    }
