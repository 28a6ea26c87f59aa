"""Elliptic functions: as many steps as each element needs, and no element changes another."""

import mpmath
import numpy as np
import pytest

from vibsim.models.shared import elliptic
from vibsim.models.shared.elliptic import agm_quarter_period, carlson_rf, jacobi, pendulum_motion

BOUNDS = [bound for bound, _ in elliptic._MEANS if bound]
EDGES = [
    *(bound * factor for bound in BOUNDS for factor in (1 - 1e-9, 1.0, 1 + 1e-9)),
    *(1.0, 1 - 1e-12, 5e-324, 1e-300, 1e-160),
]


@pytest.mark.parametrize("complement", EDGES)
def test_every_class_of_elements_has_the_steps_that_it_needs(complement):
    with mpmath.workdps(340):
        m = 1 - mpmath.mpf(complement)
        quarter = mpmath.ellipk(m)
    found = agm_quarter_period(np.array([complement]))[0]
    assert found == pytest.approx(float(quarter), rel=4e-16)
    u = np.array([0.1, 1.0, 0.9 * float(quarter)])
    ours = jacobi(u, np.full(3, complement))
    if complement < 1e-100:  # a modulus of 1 to hundreds of digits: its limit
        expected = [np.tanh(u), 1 / np.cosh(u), 1 / np.cosh(u)]
        u = u[:2]
    else:
        with mpmath.workdps(60):
            expected = [
                [float(mpmath.ellipfun(name, mpmath.mpf(x), m=m)) for x in u]
                for name in ("sn", "cn", "dn")
            ]
    for mine, true in zip(ours, expected, strict=False):
        # the argument is known to half a unit in its last place
        assert mine[: len(u)] == pytest.approx(np.array(true)[: len(u)], abs=4e-16 * (1 + u[-1]))


@pytest.mark.parametrize("ratio", [1e-300, 1e-160, 1e-30, 1e-10, 1e-3, 0.5, 1.0])
def test_carlsons_integral(ratio):
    for x, y, z in ((0.0, ratio, 1.0), (ratio, 0.3, 1.0), (1e-5, ratio, 1.0)):
        with mpmath.workdps(330):
            true = float(mpmath.elliprf(x, y, z))
        found = carlson_rf(np.array([x]), np.array([y]), np.array([z]))[0]
        assert found == pytest.approx(true, rel=2e-15)


def test_no_member_changes_another():
    rng = np.random.default_rng(0)
    count, t = 61, np.linspace(0.0, 30.0, 17)
    initial = {
        "theta": np.append(rng.uniform(-8, 8, count - 4), [0.0, np.pi, 3.14159265, 0.0])[:, None],
        "omega": np.append(rng.uniform(-3, 3, count - 4), [0.0, 0.0, 0.0, 2.0])[:, None],
    }
    parameters = {"g": rng.uniform(0.5, 2.0, (count, 1)), "L": 1.0}
    together = pendulum_motion(t, initial, parameters)
    for size in (1, 2, 7, 60):
        for start in range(0, count, size):
            chosen = slice(start, start + size)
            part = pendulum_motion(
                t,
                {name: values[chosen] for name, values in initial.items()},
                {"g": parameters["g"][chosen], "L": 1.0},
            )
            for name, values in part.items():
                assert values.tobytes() == together[name][chosen].tobytes()
