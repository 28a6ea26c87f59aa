"""The sine against 50 digits, and the same bits in every lane."""

import math

import mpmath
import numpy as np
import pytest

from vibsim.engine import elementary

RNG = np.random.default_rng(20261121)

ARGUMENTS = {
    "the first quarter turns": RNG.uniform(-math.pi / 2, math.pi / 2, 3000),
    "small": RNG.choice([-1, 1], 500) * 10.0 ** RNG.uniform(-300, 0, 500),
    "some turns": RNG.uniform(-30, 30, 3000),
    "many turns": RNG.uniform(-1e5, 1e5, 3000),
    "beside the zeros": np.concatenate(
        [
            np.nextafter(math.pi * k, math.pi * k + s)
            for k in (np.arange(1, 30_000, 97),)
            for s in (-1, 1)
        ]
    ),
    "beside the maxima": math.pi * (np.arange(0, 30_000, 97) + 0.5),
    "beyond the reduction": RNG.uniform(1e5, 1e15, 300),
}


@pytest.mark.parametrize("place", ARGUMENTS)
def test_sine_is_right_to_two_units_in_the_last_place(place):
    worst = 0.0
    with mpmath.workdps(50):
        for x in map(float, ARGUMENTS[place]):
            true = mpmath.sin(mpmath.mpf(x))
            error = abs(mpmath.mpf(elementary.sin(x)) - true) / mpmath.mpf(math.ulp(float(true)))
            worst = max(worst, float(error))
    assert worst < 2.0


@pytest.mark.parametrize(
    "x", [0.0, -0.0, math.ulp(0.0), math.inf, -math.inf, math.nan, 1e5, -1e5, 1e300]
)
def test_sine_of_special_values(x):
    value = elementary.sin(x)
    if math.isfinite(x):
        assert value == pytest.approx(math.sin(x), rel=3e-16)
    else:
        assert math.isnan(value)


def test_sine_is_odd_to_the_last_bit():
    for x in map(float, ARGUMENTS["many turns"][:500]):
        assert elementary.sin(-x) == -elementary.sin(x)
