"""What friction and impacts take from the energy, against closed forms; and that nothing is left over."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from vibsim import Experiment, simulate
from vibsim.models import MODELS
from vibsim.models.shared.linear_motion import swings
from vibsim.schemes import FIXED_STEP, SCHEMES

BOX, BALL = MODELS["sliding_box"], MODELS["bouncing_ball"]
ON_BOX = [kind for kind in FIXED_STEP if SCHEMES[kind].treats(BOX)]
LEVELS = [8, 9, 10]


def largest(content: dict[str, Any], quantity: str) -> list[Any]:
    """Return the largest absolute value of a quantity on every level, by scheme where there are several."""
    made = Experiment.from_dict({"title": "t", "levels": LEVELS, **content})
    found = []
    for record in (simulate(made, level) for level in made.levels):
        values = np.abs(np.asarray(record[quantity]))
        found.append(np.max(values.reshape(len(made.schemes), -1), axis=1).squeeze())
    return found


@pytest.mark.slow
@pytest.mark.parametrize(
    ("alpha", "schemes"),
    [
        *((0.0, ON_BOX[0::3]), (1.3, ON_BOX[1::3])),
        *(pytest.param(alpha, ON_BOX, marks=pytest.mark.slow) for alpha in (0.0, 1.3)),
    ],
)
def test_the_budget_of_friction_vanishes_at_the_order_of_the_scheme(
    alpha: float, schemes: list[str]
) -> None:
    content = {
        "model": {"kind": "sliding_box", "mu": 0.04, "m": 1.7, "k": 2.3, "alpha": alpha},
        "initial": {"u": 1.1, "v": -0.4},
        "time": {"end": 9.0},
        "schemes": schemes,
    }
    coarse, _, fine = largest(content, "energy_budget")
    # a power of four terms, two halvings: the ratio is 4^order but for the next terms
    assert_order_of_budget(schemes, coarse, fine, 1e-13, 0.25)


def assert_order_of_budget(
    schemes: list[str], coarse: Any, fine: Any, exact: float, missing: float
) -> None:
    """Check two halvings of every scheme; what is below `exact` is rounding."""
    for kind, first, last in zip(schemes, coarse, fine, strict=True):
        order = SCHEMES[kind].formal_order("energy_budget", BOX, SCHEMES[kind].defaults())
        assert last < exact or np.log2(first / last) / 2.0 > order - missing, kind


@pytest.mark.slow
def test_what_friction_takes_is_its_force_times_the_exact_path() -> None:
    m, k, mu, u, v, end = 1.7, 2.3, 0.04, 1.1, -0.4, 60.0
    made = Experiment.from_dict(
        {
            "title": "t",
            "model": {"kind": "sliding_box", "mu": mu, "m": m, "k": k},
            "initial": {"u": u, "v": v},
            "time": {"end": end},
            "levels": [12],
            "schemes": ["rk4"],
        }
    )
    record = simulate(made, 12)
    hold = mu * m / k
    motion = swings(np.sqrt(k / m), hold, u, v)
    turn, count = float(motion.turn), int(motion.count)
    turns = [u, turn]
    for i in range(count):
        size = abs(turn) - 2.0 * hold * (i + 1)
        turns.append(-np.sign(turns[-1]) * size)
    path = float(np.sum(np.abs(np.diff(turns))))
    assert count > 3
    assert abs(turns[-1]) < hold
    taken = np.asarray(record["dissipated_energy"])[0, 0]
    assert taken[0] == 0.0
    assert np.all(np.diff(taken) >= 0.0)
    assert taken[-1] == pytest.approx(mu * m * path, rel=1e-8)
    # it rests before the end: what was there has gone but for what the spring holds
    at_first, at_rest = 0.5 * k * u**2 + 0.5 * m * v**2, 0.5 * k * turns[-1] ** 2
    assert taken[-1] == pytest.approx(at_first - at_rest, rel=1e-8)


@pytest.mark.parametrize("events", ["located", "mesh"])
def test_what_impacts_take(events: str) -> None:
    content = {
        "model": {"kind": "bouncing_ball", "restitution": 0.7, "g": 9.81},
        "initial": {"h": 1.3, "v": 0.6},
        "time": {"end": 3.0},
        "schemes": [{"kind": "rk4", "events": events}],
    }
    coarse, _, fine = largest(content, "energy_budget")
    # free flight is exact: located, nothing is left; on the mesh a ball is set back onto the ground
    assert fine < 1e-12 if events == "located" else 1e-6 < fine < 0.8 * coarse


def test_both_compiled_and_plain_sum_the_same() -> None:
    from vibsim.engine import integrate

    for model, state in ((BOX, [1.1, -0.4]), (BALL, [1.3, 0.6])):
        scheme = SCHEMES["rk4"]
        numbers = np.array([[row.default for row in model.parameters]])
        runs = [
            integrate(
                model,
                scheme,
                scheme.defaults(),
                numbers,
                np.array([state]),
                np.array([0.05]),
                200,
                5,
                with_series=True,
                lane=lane,
            ).series
            for lane in ("plain", "scalar")
        ]
        one, other = (run.lost for run in runs if run is not None)
        assert one is not None
        assert other is not None
        assert one[0, -1] > 0.0
        np.testing.assert_array_equal(one, other)


@pytest.mark.slow
@pytest.mark.parametrize(
    "schemes",
    [ON_BOX[2::3], pytest.param(ON_BOX, marks=pytest.mark.slow)],
    ids=lambda schemes: str(len(schemes)),
)
def test_the_budget_of_a_driven_body_that_sticks_now_and_then(schemes: list[str]) -> None:
    content = {
        "model": {
            "kind": "oscillator",
            "m": 1.3,
            "spring": "2*u",
            "damping": {"coulomb": 0.45},
            "force": "0.9*cos(0.7*t) + 0.2",
        },
        "initial": {"u": 0.7},
        "time": {"end": 18.0},
        "schemes": schemes,
    }
    coarse, _, fine = largest(content, "energy_budget")
    assert np.all(largest(content, "event_count")[0] >= 4)
    assert_order_of_budget(schemes, coarse, fine, 1e-12, 0.35)


@pytest.mark.slow
def test_the_budget_of_a_damped_and_driven_body_that_strikes_a_stop() -> None:
    """Damping and force between the impacts are summed piece by piece, from event to event."""
    content = {
        "model": {
            "kind": "oscillator",
            "m": 1.3,
            "spring": "2*u",
            "damping": "0.1*v + 0.2*v**3",
            "force": "0.9*cos(0.7*t)",
            "events": [{"when": "u - 0.4", "rising": True, "then": {"v": "-0.8*v"}}],
        },
        "initial": {"u": -0.7},
        "time": {"end": 18.0},
        "schemes": ["rk4", "heun"],
    }
    coarse, _, fine = largest(content, "energy_budget")
    assert np.all(largest(content, "event_count")[0] >= 3)
    assert np.all(largest(content, "dissipated_energy")[2] > 0.1)
    assert_order_of_budget(["rk4", "heun"], coarse, fine, 1e-12, 0.35)


def test_the_work_of_a_force_beside_friction_against_a_fine_sum() -> None:
    content = {
        "title": "t",
        "model": {"kind": "oscillator", "damping": {"coulomb": 0.3}, "force": "0.8*cos(t/2)"},
        "initial": {"u": 0.5, "v": 0.3},
        "time": {"end": 12.0},
        "levels": [8, 16],
        "schemes": ["rk4"],
        "samples": {"every": 1},
    }
    made = Experiment.from_dict(content)
    coarse, fine = (simulate(made, level) for level in made.levels)
    t = np.linspace(0.0, 12.0, 2**16 + 1)
    full = simulate(Experiment.from_dict({**content, "levels": [16]}), 16)
    power = 0.8 * np.cos(t / 2.0) * np.asarray(full["v"])[0, 0]
    work = float(np.sum(power[1:] + power[:-1]) * 0.5 * (t[1] - t[0]))
    for record, allowed in ((coarse, 1e-6), (fine, 1e-8)):
        assert float(np.asarray(record["work_done"])[0, 0, -1]) == pytest.approx(work, abs=allowed)
