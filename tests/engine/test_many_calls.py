"""Formulas with more calls than are written out: a function stands in the kernel once, whoever uses it."""

from __future__ import annotations

import numpy as np
import pytest

from vibsim import Experiment, simulate


@pytest.mark.slow
def test_a_function_that_another_text_brings_is_called_too() -> None:
    model = {
        "kind": "elastic_pendulum",
        "beta": 0.9,
        "gamma": 0.3,
        "exact_x": "0.3*sin(1.1*t)",
        "exact_y": "0.1*cos(t)**2",
    }
    content = {"title": "Many calls", "model": model, "time": {"end": 2.0}, "levels": [13]}
    (x,) = simulate(Experiment.from_dict({**content, "schemes": ["central"]}), 13)["x"].values[:, 0]
    assert np.isclose(x[-1], 0.3 * np.sin(2.2), rtol=1e-6)
