"""Growth and frequency from the recurrence that the steps of a linear problem satisfy."""

import numpy as np
import pytest
from spring_runs import spring

from vibsim import theory
from vibsim.analysis.recurrence import LEAST_STEPS, fitted
from vibsim.schemes import FIXED_STEP

N = np.arange(201)


@pytest.mark.parametrize("growth", [0.5, 0.99, 1.0, 1.0 + 1e-9, 1.3, 4.0])
@pytest.mark.parametrize("angle", [0.01, 0.7, 2.0, 3.1])
def test_a_pair_of_roots_is_found_to_round_off(growth, angle):
    found = fitted(growth**N * np.cos(angle * N + 0.3))
    tolerance = 1e-13 / np.sin(angle) ** 2
    assert float(found.log_growth) == pytest.approx(np.log(growth), abs=tolerance)
    assert float(found.angle) == pytest.approx(angle, abs=tolerance)


def test_two_real_roots_give_the_larger_one():
    """Beyond the limit of centred differences the sign changes at every step."""
    found = fitted((-1.1) ** N + 0.5 * (-1 / 1.1) ** N)
    assert float(found.log_growth) == pytest.approx(np.log(1.1), rel=1e-6)
    assert float(found.angle) == np.pi


@pytest.mark.parametrize(
    "run",
    [
        np.zeros(50),
        np.cos(0.1 * N) ** 3,
        np.full(50, np.nan),
        np.arange(LEAST_STEPS, dtype=float),
    ],
    ids=["rest", "another motion", "failed", "too short"],
)
def test_what_is_no_such_recurrence_gives_nothing(run):
    found = fitted(run)
    assert np.isnan(found.log_growth)
    assert np.isnan(found.angle)


@pytest.mark.parametrize("kind", FIXED_STEP)
@pytest.mark.parametrize("w", [0.8, 2.0])
def test_measured_growth_and_frequency_are_those_of_theory(kind, w):
    """Without interpolation: to round-off over (w dt)^2, at w dt = 0.1 and 0.25."""
    scheme = FIXED_STEP[kind]
    stepper = scheme.stepper(scheme.defaults())
    record = spring(
        [kind], model={"kind": "spring", "w": w}, time={"end": 40.0, "base_dt": 0.125}
    ).record
    p = w * 0.125
    growth, frequency = (float(record[f"measured_{q}"][0, 0, 0]) for q in ("growth", "frequency"))
    assert growth == pytest.approx(float(theory.growth_per_period(stepper, p)), rel=1e-10)
    assert frequency == pytest.approx(w * float(theory.frequency_ratio(stepper, p)), rel=1e-10)
