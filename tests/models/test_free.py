"""Which models are free linear oscillations, and their numbers."""

from __future__ import annotations

import math

import numpy as np
import pytest

from vibsim.models import MODELS, Model
from vibsim.models.shared.free import free_oscillation, why_not_free

OSCILLATOR = MODELS["oscillator"]


def written(*declared: str, **formulas: str) -> Model:
    return OSCILLATOR.written(formulas, declared)


@pytest.mark.parametrize(
    "model",
    [
        MODELS["spring"],
        MODELS["linear_pendulum"],
        MODELS["circuit"],
        written("k", "c", spring="k*u + c*u", damping="b*v"),
        written(force="2"),
    ],
    ids=lambda model: model.kind,
)
def test_free_ones(model: Model) -> None:
    assert why_not_free(model) == ""


@pytest.mark.parametrize(
    ("model", "reason"),
    [
        (MODELS["pendulum"], "is nonlinear"),
        (MODELS["duffing"], "is nonlinear"),
        (MODELS["elastic_pendulum"], "has several coordinates"),
        (MODELS["bouncing_ball"], "has a force with corners"),
        (MODELS["washing_machine"], "has a force that depends on time"),
        (written(force="cos(t)"), "has a force that depends on time"),
        (written(damping="b*abs(v)*v"), "has a damping that is not linear"),
        (written(damping="tanh(v)"), "has a damping that is not linear"),
        (written(spring="u + u**3"), "is nonlinear"),
        (written(spring="sign(u)"), "is nonlinear"),
    ],
)
def test_others(model: Model, reason: str) -> None:
    assert why_not_free(model) == reason


def test_numbers() -> None:
    model = written("k", spring="k*u", damping="b*v", force="6")
    b = np.array([0.0, 0.8])
    parameters = {"m": 2.0, "damping.linear": b, "parameters.k": 8.0}
    found = free_oscillation(model, {"u": 1.75, "v": 3.0}, parameters)
    np.testing.assert_allclose(found.frequency, [2.0, 2.0])
    np.testing.assert_allclose(found.damping, b / 2.0 / 2.0)
    np.testing.assert_allclose(found.position, [1.0, 1.0])
    np.testing.assert_allclose(found.velocity, [1.5, 1.5])


def test_a_spring_that_does_not_pull_back_has_no_frequency() -> None:
    model = written("k", spring="k*u")
    found = free_oscillation(model, {"u": 1.0, "v": 0.0}, {"m": 1.0, "parameters.k": -1.0})
    assert math.isnan(found.frequency[0])
