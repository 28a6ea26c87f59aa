"""What friction and impacts take from the energy, against closed forms; and that nothing is left over."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from vibsim import Experiment, InputError, simulate
from vibsim.models import MODELS
from vibsim.models.dry_friction import swings
from vibsim.schemes import FIXED_STEP, SCHEMES

BOX, BALL = MODELS["sliding_box"], MODELS["bouncing_ball"]
ON_BOX = [kind for kind in FIXED_STEP if SCHEMES[kind].treats(BOX)]
LEVELS = [8, 9, 10]


def largest(content: dict[str, Any], quantity: str) -> list[float]:
    """Return the largest absolute value of a quantity on every level."""
    made = Experiment.from_dict({"title": "t", "levels": LEVELS, **content})
    records = [simulate(made, level) for level in made.levels]
    return [float(np.max(np.abs(np.asarray(record[quantity])))) for record in records]


@pytest.mark.parametrize("alpha", [0.0, 1.3])
@pytest.mark.parametrize("kind", ON_BOX)
def test_the_budget_of_friction_vanishes_at_the_order_of_the_scheme(
    kind: str, alpha: float
) -> None:
    content = {
        "model": {"kind": "sliding_box", "mu": 0.04, "m": 1.7, "k": 2.3, "alpha": alpha},
        "initial": {"u": 1.1, "v": -0.4},
        "time": {"end": 9.0},
        "schemes": [kind],
    }
    order = SCHEMES[kind].formal_order("energy_budget", BOX, SCHEMES[kind].defaults())
    coarse, _, fine = largest(content, "energy_budget")
    # a power of four terms, two halvings: the ratio is 4^order but for the next terms
    assert fine < 1e-13 or np.log2(coarse / fine) / 2.0 > order - 0.25


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


def test_a_driven_body_that_sticks_has_no_budget() -> None:
    content = {
        "title": "t",
        "model": {"kind": "oscillator", "damping": {"coulomb": 0.3}, "force": "cos(t/2)"},
        "initial": {"u": 0.5},
        "time": {"end": 9.0},
        "levels": LEVELS,
        "schemes": ["rk4"],
        "checks": [{"converges": "energy_budget", "order": "scheme"}],
    }
    with pytest.raises(InputError, match="energy_budget"):
        Experiment.from_dict(content)
    content["model"] = {"kind": "oscillator", "damping": {"coulomb": 0.3}}
    Experiment.from_dict(content)
