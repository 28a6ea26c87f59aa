"""Numbers whose error no finer level shows, and numbers that need the samples of their own level."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pytest
from analysis.spring_runs import Run, judged

from vibsim.experiment import Experiment
from vibsim.simulation import simulate_record

pytestmark = pytest.mark.usefixtures("without_series")

PULSE = {
    "model": {"kind": "oscillator", "spring": "u", "force": "1000 if 3.301 < t < 3.304 else 0"},
    "initial": {"u": 1.0},
    "time": {"end": 6.0},
    "levels": [6, 7, 8, 9],
    "schemes": ["newmark"],
}
DRIVEN = {
    "model": {
        **{"kind": "oscillator", "spring": "u", "damping": {"linear": 0.1}},
        **{"force": "cos(w*t)", "parameters": {"w": 2.0}},
    },
    "initial": {"u": 2.0},
    "time": {"periods": 3, "steps_per_period": 32, "frequency": "model.parameters.w"},
    "levels": [0, 1, 2, 3],
    "schemes": ["rk4"],
}
BOUNCES = {
    "model": {
        "kind": "oscillator",
        "spring": "u",
        "events": [{"when": "u", "then": {"v": "0.9*v"}}],
    },
    "initial": {"u": 1.0},
    "time": {"end": 12.0},
    "levels": [5, 6, 7, 8],
    "schemes": [{"kind": "rk4", "events": "mesh"}],
}
IMPACT_AT_THE_END = {
    **BOUNCES,
    "time": {"end": "pi/2"},
    "schemes": ["rk4", "velocity_verlet", "gauss4"],
}
FRICTION = {
    **{**BOUNCES, "schemes": ["rk4", "velocity_verlet"], "time": {"end": "pi"}},
    "model": {"kind": "oscillator", "spring": "u", "damping": {"coulomb": 0.1}},
}
DROP_TO_THE_END = {
    "model": {"kind": "bouncing_ball", "g": 9.81},
    "initial": {"h": 1.0},
    "time": {"end": math.sqrt(2.0 / 9.81)},
    "levels": [5, 6, 7, 8],
    "schemes": ["rk4", "velocity_verlet", "gauss4"],
}


def run(content: dict[str, Any], *checks: dict[str, Any]) -> Run:
    experiment = Experiment.from_dict({"title": "test", **content, "checks": list(checks)})
    return judged(experiment, {n: simulate_record(experiment, n) for n in experiment.levels})


BEST = {"at": {"level": "best"}}
AMPLITUDE = {"value": "steady_amplitude", "quantity": "u"}
LARGEST_AMPLITUDE = {**AMPLITUDE, "over": "model.parameters.w", "take": "largest"}
LARGEST_TIME = {
    **{"value": "event_time", "at": {"event": 3, "level": "best"}},
    **{"over": "initial.u", "take": "largest"},
}


@pytest.mark.parametrize(
    ("content", "check", "why", "advice"),
    [
        (PULSE, {"value": "end", **BEST, "quantity": "u", "equals": 0.96, "atol": 0.02}, "pulse", "wider"),
        (PULSE, {"value": "max_abs", **BEST, "quantity": "v", "below": 1.1}, "pulse", "wider"),
        (DRIVEN, {**AMPLITUDE, **BEST, "below": 0.5}, "fewer than 4 periods", "4 or more `periods:`"),
        (
            {**DRIVEN, "sweep": {"model.parameters.w": [2.0, 3.0]}},
            {**LARGEST_AMPLITUDE, "above": 1.0},
            "an unknown error",
            "4 or more `periods:`",
        ),
        (
            {**BOUNCES, "sweep": {"initial.u": [1.0, 2.0]}},
            {**LARGEST_TIME, "equals": 2.5 * math.pi, "rtol": 1e-3},
            "an unknown error",
            "`events: located`",
        ),
        (IMPACT_AT_THE_END, {"value": "end", **BEST, "quantity": "v", "below": 0}, "end of the run", "later"),
        (IMPACT_AT_THE_END, {"value": "event_count", "equals": 1}, "end of the run", "later"),
        (FRICTION, {"value": "event_count", "equals": 1}, "end of the run", "later"),
        # 25 steps of pi/50 are not pi/2
        (
            {**IMPACT_AT_THE_END, "time": {"end": "pi/2", "base_steps": 25}, "levels": [0, 1, 2, 3]},
            {"value": "end", "at": {"t": math.pi / 2, "level": "best"}, "quantity": "v", "below": 0},
            "end of the run",
            "later",
        ),
        (
            {**IMPACT_AT_THE_END, "sweep": {"initial.u": [1.0, 2.0]}},
            {"value": "event_count", "over": "initial.u", "take": "largest", "equals": 1},
            "an unknown error",
            "later",
        ),
        (DROP_TO_THE_END, {"value": "end", "quantity": "v", "above": 0}, "end of the run", "later"),
    ],
)  # fmt: skip
def test_what_no_level_shows_is_not_decided(
    content: dict[str, Any], check: dict[str, Any], why: str, advice: str
) -> None:
    [found] = run(content, check).summary["checks"]
    assert found["status"] == "INCONCLUSIVE"
    text = json.dumps(found)
    assert why in text
    assert advice in text


@pytest.mark.usefixtures("with_series")
def test_levels_that_differ_in_their_events_long_before_the_end_are_named() -> None:
    """The second crest of a resonance is just above a stop; the finest level alone meets it, 5 s before the end."""
    content = {
        "model": {"kind": "oscillator", "spring": "u", "force": "cos(t)"},
        "events": [{"when": "u - 3.9568636857938907", "rising": True, "then": {"v": "-0.8*v"}}],
        "initial": {"u": 0.0},
        "time": {"end": 13.14, "base_steps": 32},
        "levels": [0, 1, 2, 3],
        "schemes": ["rk4"],
    }
    (found,) = run(content, {"value": "event_count", "equals": 1}).verdicts
    assert found.status == "INCONCLUSIVE"
    assert "number of events: 0 on level 1, 0 on level 2 and 1 on level 3" in found.text
    assert "Add levels 4" in found.advice
    assert "end of the run" not in found.text


@pytest.mark.usefixtures("with_series")
def test_a_count_on_which_the_finest_levels_differ_is_not_settled() -> None:
    """The highest crest is just above a stop, and the finest level alone meets it, long before the end."""
    content = {
        "model": {**DRIVEN["model"], "force": "cos(t)"},
        "events": [{"when": "u - 3.2498152132695193", "rising": True, "then": {"v": "-0.8*v"}}],
        "initial": {"u": 0.0},
        "time": {"end": 12.2, "base_steps": 32},
        "levels": [0, 1, 2, 3],
        "schemes": ["rk4"],
    }
    count = {"value": "event_count", "equals": 1}
    of_level = {**count, "at": {"level": 3}}
    found, known = run(content, count, of_level).verdicts
    assert (found.status, found.reason) == ("INCONCLUSIVE", "pre_asymptotic")
    assert "number of events: 0 on level 1, 0 on level 2 and 1 on level 3" in found.text
    assert "Add levels 4" in found.advice
    # the number of one level is a fact
    assert known.status == "PASS"


@pytest.mark.parametrize(
    ("end", "event", "count"),
    [
        # the guard has an extremum, so that its rate has any sign
        ("2*pi", {"when": "u", "then": {"v": "0.9*v"}}, 2),
        # it rises to 0, but the event is where it falls
        ("3*pi/2", {"when": "u", "falling": True, "then": {"v": "0.9*v"}}, 1),
    ],
)
def test_a_run_may_end_at_an_extremum_or_where_a_guard_comes_back(
    end: str, event: dict[str, Any], count: int
) -> None:
    content = {
        **{**BOUNCES, "schemes": ["rk4", "velocity_verlet", "gauss4"], "time": {"end": end}},
        "model": {"kind": "oscillator", "spring": "u", "events": [event]},
    }
    checks = {"value": "event_count", "equals": count}, {"value": "end", **BEST, "quantity": "v"}
    found = run(content, checks[0], {**checks[1], "below": 1.0}).verdicts
    assert [one.status for one in found] == ["PASS", "PASS"]


def test_one_body_may_rest_on_its_stop_at_the_end_while_others_move() -> None:
    """The guard is 0 there and no event is left, but the number of events was open."""
    content = {
        "title": "a ball that has stopped bouncing beside a pendulum",
        "model": {
            "kind": "system",
            "coordinates": ["h", "q"],
            "acceleration": {"h": -10, "q": "-4*q"},
            "events": [{"when": "h", "falling": True, "then": {"vh": "-vh/2"}}],
        },
        "initial": {"h": 1.25, "q": 1.0},
        "time": {"end": 3.0, "base_steps": 30},
        "levels": [1, 2, 3],
        "schemes": ["velocity_verlet"],
    }
    count = {"value": "event_count", "above": 5}
    energy = {"value": "end", "quantity": "dissipated_energy", "equals": 12.5, "rtol": 1e-9}
    assert [one.status for one in run(content, count, energy).verdicts] == ["PASS", "PASS"]


def test_a_frequency_is_that_of_the_samples_of_its_own_level() -> None:
    """At the coarsest level a period has 1.7 steps, at the finest one 53."""
    content = {
        **{"model": {"kind": "spring"}, "initial": {"u": 1.0}, "time": {"end": 120.0}},
        **{"levels": [5, 6, 7, 8, 9, 10], "schemes": ["rk4"]},
    }
    check = {"value": "peak_frequency", "quantity": "u", "equals": 1.0, "atol": 0.01}
    found = run(content, check, {**check, **BEST}).verdicts
    assert [one.status for one in found] == ["PASS", "PASS"]


def test_the_bound_of_a_frequency_holds_in_a_run_of_few_periods() -> None:
    """Its negative frequency would move it by up to 1e-3 in four periods, alike on every level."""
    content = {
        **{"model": {"kind": "spring"}, "initial": {"u": 1.0}, "levels": [2, 3, 4, 5]},
        **{"time": {"end": 1.0, "base_steps": 20}, "schemes": ["rk4"]},
        "sweep": {"time.end": [18.9, 20.3, 22.1, 24.0, 26.5, 31.0, 47.1]},
    }
    check = {"value": "peak_frequency", "quantity": "u", "equals": 1.0, "atol": 0.01, **BEST}
    record = run(content, {**check, "id": "w"}).record
    error = np.abs(record["check_w_value"] - 1.0)
    assert np.all(error <= record["check_w_error_bound"])
    assert np.max(error) < 1e-5


DECAY = {
    "model": {"kind": "oscillator", "spring": "2.26*u", "damping": {"linear": 0.2}},
    "initial": {"u": 1.0, "v": -0.1},
    "time": {"end": 60.0},
    "levels": [7, 8, 9, 10],
    "schemes": ["rk4"],
}
FREQUENCY = {"value": "peak_frequency", "quantity": "u", **BEST}


def test_the_frequency_of_a_decay_is_that_of_the_damped_motion() -> None:
    """``sqrt(2.26 - 0.1^2)``; the highest place of its continuous spectrum is 1.499983."""
    found, away = run(
        DECAY, {**FREQUENCY, "equals": 1.5, "atol": 1e-6}, {**FREQUENCY, "above": 1.50001}
    ).verdicts
    assert (found.status, away.status) == ("PASS", "FAIL")
    assert abs(found.results[0].value - 1.5) < 1e-7


@pytest.mark.usefixtures("with_series")
def test_lines_that_are_not_told_apart_decide_nothing() -> None:
    """Two modes of 1 and 1.1 in 60 s, of which the spectrum shows one line at 0.97."""
    content = {
        "model": {"kind": "oscillator", "spring": "u", "force": "0.105*cos(1.1*t)"},
        "initial": {"u": 0.5},
        **{"time": {"end": 60.0}, "levels": [7, 8, 9, 10], "schemes": ["rk4"]},
    }
    below, wide = run(
        content, {**FREQUENCY, "below": 0.99}, {**FREQUENCY, "equals": 1.0, "atol": 1e-3}
    ).verdicts
    assert below.status == "INCONCLUSIVE"
    assert "Make the run longer (`time: end`)" in below.advice
    assert wide.status == "INCONCLUSIVE" or "do not prove it" in wide.text


def test_a_harmonic_is_that_of_the_samples_of_its_own_level() -> None:
    """Eight samples of a period mix its strong seventh harmonic in. Truth: DOP853 to 1e-12, 512 samples a period."""
    content = {
        "model": {
            **{"kind": "oscillator", "spring": "u**3", "damping": {"linear": 0.3}},
            **{"force": "2*cos(w*t)", "parameters": {"w": 0.3}},
        },
        "initial": {"u": 1.0},
        "time": {"periods": 20, "steps_per_period": 8, "frequency": "model.parameters.w"},
        **{"levels": [2, 3, 4, 5, 6], "schemes": ["rk4"]},
    }
    check = {**AMPLITUDE, "equals": 1.432149, "atol": 1e-4}
    found = run(content, check, {**check, **BEST}).verdicts
    assert [one.status for one in found] == ["PASS", "PASS"]


def test_a_phase_is_an_angle() -> None:
    """``u = -cos(2 t)/3`` lags by pi, or by -pi."""
    content = {
        "model": {
            **{"kind": "oscillator", "spring": "u", "force": "cos(w*t)", "parameters": {"w": 2.0}},
        },
        "initial": {"u": -1.0 / 3.0},
        "time": {"periods": 6, "steps_per_period": 32, "frequency": "model.parameters.w"},
        **{"levels": [0, 1, 2, 3], "schemes": ["central", "rk4", "newmark"]},
    }
    check = {"value": "steady_phase", "quantity": "u", "equals": math.pi, "atol": 0.01}
    found = run(content, check, {**check, **BEST}).verdicts
    assert [one.status for one in found] == ["PASS", "PASS"]


def test_levels_on_either_side_of_pi_have_the_phase_between_them() -> None:
    """A closed form again, of a force so late that coarse levels have the phase below -pi, which is 3.14."""
    w, b, phase = 1.3, 0.4, 4e-4 - math.pi
    lag = math.atan2(b * w, 1.0 - w**2)
    size = 1.0 / math.hypot(b * w, 1.0 - w**2)
    content = {
        "model": {
            **{"kind": "oscillator", "spring": "u", "damping": {"linear": b}},
            **{"force": "cos(w*t - late)", "parameters": {"w": w, "late": phase - lag}},
        },
        "initial": {"u": size * math.cos(phase), "v": size * w * math.sin(phase)},
        "time": {"periods": 12, "steps_per_period": 16, "frequency": "model.parameters.w"},
        **{"levels": [0, 1, 2, 3], "schemes": ["central"]},
    }
    check = {"value": "steady_phase", "quantity": "u", "equals": phase, "atol": 1e-5, **BEST}
    coarse = {"value": "steady_phase", "quantity": "u", "above": 3.0, "at": {"level": 0}}
    found = run(content, check, coarse).verdicts
    assert [one.status for one in found] == ["PASS", "PASS"]


NEAR_PI = {
    "model": {
        **{"kind": "oscillator", "spring": "u", "damping": {"linear": 0.002}},
        **{"force": "cos(w*t)", "parameters": {"w": 2.2}},
    },
    "initial": {"u": 0.1},
    "time": {"periods": 20, "steps_per_period": 16, "frequency": "model.parameters.w"},
    **{"levels": [2, 3, 4], "schemes": ["rk4"]},
}
PHASE = {"value": "steady_phase", "quantity": "u", **BEST}


@pytest.mark.usefixtures("with_series")
def test_an_angle_whose_bound_goes_through_pi_is_neither_below_nor_above() -> None:
    """Its number is -2.60, with a bound of 1.1; the phase of the steady motion is 3.1404."""
    asked = ({"below": 0.0}, {"above": 0.0}, {"above": -1.0}, {"equals": 3.1404, "atol": 0.01})
    *undecided, around = run(NEAR_PI, *({**PHASE, **one} for one in asked)).verdicts
    for verdict in undecided:
        assert verdict.status == "INCONCLUSIVE"
        assert "an angle between -3.7" in verdict.text
        assert "which goes through -pi" in verdict.text
        assert "Make the run longer (`time: periods`)" in verdict.advice
    assert around.status == "INCONCLUSIVE"
    assert "goes through" not in around.text


def test_the_largest_of_angles_is_open_where_one_goes_through_pi() -> None:
    over = {"over": "model.parameters.w", "take": "smallest"}
    content = {**NEAR_PI, "sweep": {"model.parameters.w": [2.2, 2.4]}}
    found = run(content, {**PHASE, **over, "below": 0.0}, {**PHASE, **over, "above": 0.0}).verdicts
    assert [one.status for one in found] == ["INCONCLUSIVE", "INCONCLUSIVE"]


@pytest.mark.usefixtures("with_series")
def test_a_steady_phase_of_an_unknown_bound_counts_what_is_left_of_the_start() -> None:
    """A linear oscillator after five periods: the phase is 2.8855, the levels agree on 2.9386."""
    content = {
        "model": {
            **{"kind": "duffing", "delta": 0.2167597473603224, "beta": 0.0},
            **{"gamma": 0.5534031305937521, "omega": 1.4962223256710279},
        },
        "initial": {"u": 0.8783914406293662},
        "time": {"periods": 5, "steps_per_period": 20, "frequency": "model.omega"},
        "levels": [1, 2, 3, 4],
        "schemes": ["rk4"],
    }
    for claim in ({"above": 2.90779}, {"below": 2.9}):
        [found] = run(content, {"value": "steady_phase", "quantity": "u", **BEST, **claim}).verdicts
        assert found.status == "INCONCLUSIVE"
        assert "Make the run longer (`time: periods`)" in found.advice


def test_a_crest_in_the_first_step_of_all_levels_is_in_the_bound() -> None:
    """``u'' + 0.2 u' + u = 0`` rises from 1 to 1.00019945 at t = 0.01996, before the first grid point of any level."""
    content = {
        "model": {"kind": "oscillator", "damping": {"linear": 0.2}},
        "initial": {"u": 1.0, "v": 0.02},
        "time": {"end": 20.0},
        "levels": [5, 6, 7],
    }
    content["schemes"] = ["central", "rk4", "euler_cromer", "crank_nicolson"]
    asked = {"quantity": "u", **BEST, "atol": 1e-8}
    for sign, name in ((1.0, "max"), (-1.0, "min")):
        content["initial"] = {"u": sign, "v": 0.02 * sign}
        found = run(
            content,
            {"value": name, "equals": sign * 1.00019945, **asked},
            {"value": "max_abs", "equals": 1.00019945, **asked},
            {"value": "max_abs", "quantity": "u", **BEST, "below": 1.0001},
        ).verdicts
        wrong = ("FAIL", "FAIL", "PASS")
        for verdict, status in zip(found, wrong, strict=True):
            assert status not in {result.status for result in verdict.results}
            assert len(verdict.results) == 4


def test_a_number_rests_on_the_levels_behind_one_that_broke_down() -> None:
    """RK4 overflows on the coarsest level; the period is 4 K(1/2) / sqrt(50)."""
    cubic = {"model": {"kind": "system", "acceleration": "-50*u**3"}, "initial": {"u": 1.0}}
    ladder = {"time": {"end": 4.0}, "levels": [2, 6, 7, 8, 9], "schemes": ["rk4"]}
    asked = {"value": "period", "equals": 4 * 1.854074677301372 / math.sqrt(50), "atol": 1e-4}
    best, coarsest = run(
        {**cubic, **ladder}, {**asked, **BEST}, {**asked, "at": {"level": 2}}
    ).verdicts
    assert (best.status, coarsest.reason) == ("PASS", "non_finite")
    assert "from the levels finer than 2, which broke down" in best.text


def test_levels_that_store_fewer_samples_leave_a_bound_of_a_steady_motion() -> None:
    """The finest level stores the times of the coarsest one, and the other one all of its own."""
    content = {
        **DRIVEN,
        "time": {"periods": 8, "steps_per_period": 64, "frequency": "model.parameters.w"},
        "levels": [1, 2, 3],
        "sweep": {"model.parameters.w": {"linspace": [0.5, 3.0, 60]}},
    }
    checks = [
        {"id": name, "value": f"steady_{name}", "quantity": "u", "below": most, **BEST}
        for name, most in (("amplitude", 1e9), ("phase", 3.0))
    ]
    record = run(content, *checks).record
    w = np.asarray(record["model_parameters_w"])
    exact = 1.0 / (1.0 - w**2 + 0.1j * w)
    for name, number in (("amplitude", np.abs(exact)), ("phase", -np.angle(exact))):
        away = np.abs(record[f"check_{name}_value"][0] - number)
        away = np.minimum(away, 2 * np.pi - away) if name == "phase" else away
        assert np.all(away <= record[f"check_{name}_error_bound"][0])
