"""Numbers that the vibration text works out: rates of the true error, and the accuracy of a second difference."""

import math

import numpy as np
import pytest

from vibsim import Experiment, analyse, simulate, verdicts


def measured(name, quantity, at, w, levels=(0, 1, 2), steps=30, periods=8):
    """Return one value of a run of centred differences on the spring."""
    check = {"value": name, "at": at, "equals": 0.0}
    experiment = Experiment.from_dict(
        {
            "title": "t",
            "model": {"kind": "spring", "w": w},
            "initial": {"u": 0.3},
            "time": {"periods": periods, "steps_per_period": steps},
            "levels": list(levels),
            "schemes": ["central"],
            "samples": "all",
            "checks": [check | ({"quantity": quantity} if quantity else {})],
        }
    )
    data = [simulate(experiment, level) for level in experiment.levels]
    (verdict,) = verdicts(experiment, analyse(experiment, data))
    return verdict.results[0].value


def discrete_norm(w, steps, periods):
    """Return the norm of B, section 2.2, of the exact discrete solution (20)."""
    p = 2 * math.pi / steps
    n = np.arange(steps * periods + 1)
    error = 0.3 * (np.cos(n * p) - np.cos(n * 2 * math.asin(p / 2)))
    return math.sqrt(p / w * np.sum(error**2))


@pytest.mark.parametrize("level", [0, 1])
def test_the_rate_is_that_of_the_exact_discrete_solution(level):
    coarse, fine = (discrete_norm(0.35, 30 * 2**k, 8) for k in (level, level + 1))
    rate = measured("error_rate", "u", {"level": level}, 0.35)
    assert rate == pytest.approx(math.log2(coarse / fine), rel=1e-10)


@pytest.mark.parametrize("steps", [2, 3, 7, 40])
def test_the_second_difference_of_a_cosine(steps):
    """B, exercise 7: (2/p)^2 sin^2(p/2); two points per period are the highest frequency of a mesh."""
    fraction = measured("second_difference_fraction", None, {"level": 0}, 1.3, (0,), steps)
    p = 2 * math.pi / steps
    assert fraction == pytest.approx((2 / p * math.sin(p / 2)) ** 2, rel=1e-12)
