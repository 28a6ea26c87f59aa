"""Real ladders on which a verdict or a bound has once been wrong, and level data that do not belong together."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from thinned import thinned
from whole import analysed

from vibsim import Experiment, VibsimError, analyse, simulate, verdicts

pytestmark = pytest.mark.usefixtures("without_series")

KICK = {"kind": "central", "end_velocity": "kick"}


def problem(levels: Any, scheme: Any = KICK, end: float = 20.0, **more: Any) -> Experiment:
    quantity = more.pop("quantity", "theta")
    checks = more.pop("checks", [{"converges": quantity, "order": "scheme"}])
    model = more.pop("model", {"kind": "pendulum"})
    return Experiment.from_dict(
        {
            "title": "t",
            "model": model,
            "initial": more,
            "time": {"end": end},
            "levels": list(levels),
            "schemes": [scheme],
            "checks": checks,
        }
    )


def outcome(experiment: Experiment) -> tuple[list[tuple[str, str]], Any]:
    record = analysed(experiment)
    return [(v.status, v.reason) for v in verdicts(experiment, record)], record


LINEAR = {"kind": "linear_pendulum"}

SOUND_BUT_HARD = [
    # two terms that cancel, or look like another power in one triple
    {"levels": (8, 9, 10), "end": 58.49, "theta": -1.36, "omega": 1.55},
    {"levels": (8, 9, 10), "end": 89.02, "theta": -1.36, "omega": 1.55},
    {"levels": (2, 3, 4), "end": 4.88, "theta": -2.3, "omega": -0.79},
    {"levels": (1, 2, 3), "end": 2.6, "theta": 2.61, "omega": -2.55},
    {"levels": (6, 7, 8), "end": 110.0, "theta": 1.0, "model": LINEAR},
    {"levels": (6, 7, 8), "end": 110.0, "theta": 1.0, "model": LINEAR, "quantity": "omega"},
    {"levels": (7, 8, 9), "end": 198.0, "theta": -0.87, "quantity": "omega"},
    {"levels": (7, 8, 9), "end": 208.34, "theta": 0.6, "omega": 2.65},
    # the extrapolated end against the interior
    {
        "levels": (2, 3, 4),
        "scheme": "central",
        "end": 2.21,
        "theta": -2.92,
        "omega": 0.73,
        "quantity": "omega",
    },
    {
        "levels": (7, 8, 9),
        "scheme": "central",
        "end": 6.49,
        "theta": -2.37,
        "omega": -0.76,
        "quantity": "energy_deviation",
    },
    {
        "levels": (1, 2, 3, 4, 5),
        "scheme": "central",
        "end": 3.24,
        "theta": 0.81,
        "omega": -0.57,
        "quantity": "energy_deviation",
        "model": LINEAR,
    },
    # round-off, magnified near the separatrix
    {"levels": (12, 13, 14, 15, 16), "end": 60.0, "theta": 3.1415926},
    {"levels": (12, 13, 14, 15), "end": 60.0, "theta": 3.1415926},
    {
        "levels": (12, 13, 14, 15, 16),
        "end": 60.0,
        "theta": 3.14159,
        "scheme": {**KICK, "arithmetic": "increment"},
    },
    # round-off of a position, seen in a velocity
    {
        "levels": (8, 9, 10),
        "end": 0.405,
        "theta": 19.229487992049542,
        "model": {"kind": "pendulum", "g": 0.1705},
        "quantity": "omega",
        "scheme": {"kind": "central", "arithmetic": "three_term"},
    },
]


@pytest.mark.parametrize("case", thinned(SOUND_BUT_HARD, 3))
def test_a_sound_scheme_never_fails(case: dict[str, Any]) -> None:
    ((status, reason),), _ = outcome(problem(**case))
    assert status != "FAIL", reason


@pytest.mark.slow
@pytest.mark.parametrize(
    ("levels", "theta", "omega", "end"),
    thinned([(range(12, 17), 3.1415926, 1.0, 1.0), (range(10, 15), math.pi - 1e-8, 2.0, 1.0)], 2),
)
def test_a_start_near_the_top_converges_to_the_exact_solution(
    levels: Any, theta: float, omega: float, end: float
) -> None:
    found, _ = outcome(problem(levels, end=end, theta=theta, omega=omega))
    assert found == [("PASS", "asymptotic")]


@pytest.mark.usefixtures("with_series")
@pytest.mark.parametrize("quantity", ["omega", "energy_deviation"])
def test_a_change_that_happens_to_vanish_is_no_small_error(quantity: str) -> None:
    experiment = problem(range(3, 8), "central", 1.7, theta=1.18, omega=1.16, quantity=quantity)
    _, record = outcome(experiment)
    true = record[f"{quantity}_richardson_error_norm"].sel(norm="linf").item()
    assert true <= record[f"{quantity}_richardson_error"].max().item()


@pytest.mark.usefixtures("with_series")
@pytest.mark.slow
def test_bounds_of_extrapolations_hold_for_random_members() -> None:
    """Of members that pass, 99 in 100 at least have an error within the bound, and none is far beyond."""
    rng = np.random.default_rng(5)
    passed, beyond, worst = 0, 0, 0.0
    for _ in range(60):
        theta, omega, end = rng.uniform((-3, -2, 1), (3, 2, 30))
        steps = math.ceil(math.log2(end)) + 2
        experiment = problem(range(steps, steps + 4), "central", end, theta=theta, omega=omega)
        _, record = outcome(experiment)
        for quantity in ("theta", "omega", "energy_deviation"):
            if int(record[f"{quantity}_status"].item()) != 0:
                continue
            true = record[f"{quantity}_richardson_error_norm"].sel(norm="linf").item()
            ratio = true / record[f"{quantity}_richardson_error"].max().item()
            passed, beyond, worst = passed + 1, beyond + (ratio > 1), max(worst, ratio)
    assert passed > 60
    assert beyond <= 0.02 * passed
    assert worst < 4


def test_a_short_run_is_not_called_exact() -> None:
    found, _ = outcome(problem(range(5, 9), end=0.01, theta=1.57))
    assert found == [("INCONCLUSIVE", "round_off")]


def test_what_stays_at_rest_shows_nothing() -> None:
    found, _ = outcome(problem(range(5, 9), theta=0.0))
    assert found == [("INCONCLUSIVE", "not_applicable")]


@pytest.mark.parametrize("bound", [{"above": -1e9}, {"below": 1e9}])
@pytest.mark.parametrize("holds", [True, False])
def test_a_number_that_broke_down_shows_nothing(bound: dict[str, float], holds: bool) -> None:
    that = {"value": "end", "quantity": "theta", "at": {"level": 6}, **bound}
    experiment = problem(
        range(6, 10),
        end=2000.0,
        theta=1.0,
        model=LINEAR,
        checks=[{"claim": "x", "that": that, "holds": holds}],
    )
    found, _ = outcome(experiment)
    assert found == [("FAIL", "non_finite")]


def test_amplitude_and_growth_need_what_they_are_made_of() -> None:
    checks = [{"value": "amplitude", "equals": 0}, {"value": "growth_factor", "below": 2}]
    found, _ = outcome(problem(range(5, 9), end=1.0, theta=1.0, checks=checks))
    assert found == [("INCONCLUSIVE", "not_applicable")] * 2


def test_an_infinite_period_does_not_exist() -> None:
    checks = [{"value": "exact_period", "above": 0}]
    found, _ = outcome(problem(range(7, 10), theta=0.0, omega=2.0, checks=checks))
    assert found == [("INCONCLUSIVE", "not_applicable")]


@pytest.mark.parametrize("levels", [(6, 7, 8), (7, 8, 9, 10), (7, 8, 9, 10, 11, 12)])
def test_the_first_order_start_is_found_out(levels: tuple[int, ...]) -> None:
    scheme = {"kind": "central", "start": "first_order"}
    found, _ = outcome(problem(levels, scheme, theta=1.0))
    assert found == [("FAIL", "order_low")]


def tampered(kind: str) -> list[Any]:
    """Return levels 6 to 9 of which one, or all, are not what they say."""
    experiment = problem(range(6, 10), theta=1.0)
    data = [simulate(experiment, level) for level in range(6, 10)]
    match kind:
        case "another start":
            data[3] = simulate(problem(range(6, 10), theta=1.0001), 9)
        case "another parameter":
            data[1] = simulate(
                problem(range(6, 10), theta=1.0, model={"kind": "pendulum", "g": 1.01}), 7
            )
        case "another end":
            data[0] = simulate(problem(range(6, 10), end=20.2, theta=1.0), 6)
        case "another sign":
            data[2] = data[2].assign(theta=-data[2].theta)
        case "another model":
            data[2] = simulate(problem(range(6, 10), theta=1.0, model=LINEAR), 8)
        case "shifted":
            data = [level.assign(theta=level.theta.shift(t=-1, fill_value=0.9)) for level in data]
        case "another scheme":
            data[0] = simulate(
                problem(range(6, 10), {"kind": "central", "label": "x"}, theta=1.0), 6
            )
        case "twice":
            data.append(data[3])
        case "unknown level":
            data.append(simulate(problem(range(6, 11), theta=1.0), 10))
    return data


@pytest.mark.parametrize(
    "kind",
    [
        "another start",
        "another parameter",
        "another end",
        "another sign",
        "another model",
        "shifted",
        "another scheme",
        "twice",
        "unknown level",
    ],
)
def test_levels_that_do_not_belong_together_are_refused(kind: str) -> None:
    with pytest.raises(VibsimError, match="level"):
        analyse(problem(range(6, 10), theta=1.0), tampered(kind))


def test_a_part_of_the_ladder_may_be_analysed() -> None:
    experiment = problem(range(6, 10), theta=1.0)
    record = analyse(experiment, tampered("not")[:3])
    assert list(record.level.values) == [6, 7, 8]


@pytest.mark.usefixtures("with_series")
@pytest.mark.parametrize("kind", ["rk4", "central", "newmark"])
def test_levels_that_friction_stops_at_once_belong_to_their_exact_solution(kind: str) -> None:
    """Their velocity is 0 throughout, and that of the exact solution at t = 0 has the rounding of its motion."""
    model = {"kind": "oscillator", "spring": "u", "damping": {"coulomb": 0.1}}
    checks = [{"accurate": "u", "relative": 1e-3}]
    made = problem([1, 2, 3], kind, 30.0, u=1.0, model=model, checks=checks)
    [(status, reason)], _ = outcome(made)
    assert (status, reason) in (("FAIL", "unstable"), ("FAIL", "mismatch"))
