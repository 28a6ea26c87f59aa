"""Runs of models with events for the tests of several folders."""

import numpy as np

from vibsim.engine import integrate
from vibsim.models import MODELS
from vibsim.models.oscillator import written
from vibsim.schemes import FIXED_STEP

BOX, BALL = MODELS["sliding_box"], MODELS["bouncing_ball"]
DRIVEN = written({"damping": "b*sign(v)", "spring": "k*u", "force": "A*cos(w*t)"}, ("k", "A", "w"))
"""Sticks and slips for ever."""
TREATMENTS = ("located", "mesh")


def numbers_of(model, parameters, initial, dt=None):
    """Return the arrays of one member: parameters by name (the others at their defaults), initial values, step."""
    given = {row.name: row.default for row in model.parameters} | parameters
    assert set(given) == {row.name for row in model.parameters}
    return np.array([list(given.values())]), np.array([initial], dtype=float), np.array([dt])


def run(model, kind, parameters, initial, end, steps, *, events="located", lane="plain", **more):
    """Return the trajectories of one member, every step stored."""
    scheme = FIXED_STEP[kind]
    numbers = numbers_of(model, parameters, initial, end / steps)
    options = {**scheme.defaults(), "events": events}
    return integrate(model, scheme, options, *numbers, steps, 1, lane=lane, **more)
