"""Numbers of checks with their units."""

from __future__ import annotations

import pytest

from vibsim import experiment as spec
from vibsim.analysis import analyse_records, verdicts
from vibsim.analysis.blockwise import join_parts, keep_for_verdicts
from vibsim.checks.number_units import unit_of
from vibsim.experiment.value_names import VALUES
from vibsim.simulation import simulate_record

pytestmark = pytest.mark.usefixtures("without_series")

QUANTITIES = {"value": "end", "quantity": "omega", "above": -9.0}


def run(*checks, **changes):
    content = {
        "title": "A swing",
        "source": "none",
        "model": {"kind": "pendulum", "g": 9.8, "L": 4.9},
        "initial": {"theta": 1.0},
        "time": {"end": 10.0},
        "levels": [6, 7, 8],
        "schemes": ["central"],
        "checks": list(checks),
    }
    experiment = spec.Experiment.from_dict(content | changes, name="swing", collection="adhoc")
    levels = {level: simulate_record(experiment, level) for level in experiment.levels}
    return experiment, analyse_records(experiment, levels)


@pytest.mark.parametrize(
    ("check", "unit"),
    [
        ({"value": "end", "quantity": "omega"}, "rad s-1"),
        ({"value": "max", "quantity": "wire_force"}, "N"),
        ({"value": "max_abs", "quantity": "energy_deviation"}, "J"),
        ({"value": "error_linf", "quantity": "theta"}, "rad"),
        ({"value": "error_l2", "quantity": "theta"}, "rad sqrt(s)"),
        ({"value": "error_l1", "quantity": "energy_deviation"}, "J s"),
        ({"value": "period"}, "s"),
        ({"value": "frequency"}, "rad s-1"),
        ({"value": "amplitude"}, "rad"),
        ({"value": "relative_energy_error"}, ""),
        ({"value": "growth_factor"}, ""),
    ],
)
def test_units(check, unit):
    experiment, record = run({**check, "above": -99.0})
    assert unit_of(experiment, record, experiment.checks[0]) == unit
    (verdict,) = verdicts(experiment, record)
    number = f" is {verdict.results[0].value:.10g}"
    told = f"{number} {unit}; it is above -99 {unit}." if unit else f"{number}; it is above -99."
    assert told in verdict.text
    # UDUNITS has no roots
    in_file = unit.removesuffix(" sqrt(s)") or "1"
    assert record.variable("check_check_1_value").attrs["units"] == in_file


def test_a_distance_has_the_unit_of_its_quantity():
    _, record = run({"equal": ["central", "exact"], "quantity": "omega", "atol": 1.0})
    for name in ("distance", "allowed"):
        assert record.variable(f"check_check_1_{name}").attrs["units"] == "rad s-1"


def test_a_scaled_run_has_none():
    experiment, record = run({"value": "period", "above": 0.0}, scaled=True)
    assert unit_of(experiment, record, experiment.checks[0]) == ""
    assert record.variable("check_check_1_value").attrs["units"] == "1"


def test_a_counted_number_is_equal_without_a_tolerance():
    ball = {"kind": "bouncing_ball", "g": 2.0, "restitution": 0.5, "eps_v": 0.3}
    bounces = {"value": "event_count", "equals": 3}
    given = {"model": ball, "initial": {"h": 1.0}, "time": {"end": 4.0}, "schemes": ["rk4"]}
    experiment, record = run(bounces, **given)
    (verdict,) = verdicts(experiment, record)
    assert verdict.text.endswith("event_count is 3; it is equal to 3.")


def test_every_number_says_what_it_is_measured_in():
    plain = {name for name, row in VALUES.items() if row.measure == "none"}
    words = ("factor", "ratio", "rate", "error", "degree", "order", "limit", "defect", "relative")
    words += ("coincidence", "fraction", "growth", "phase", "change")
    assert [name for name in plain if not any(word in name for word in words)] == []


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"sweep": {"initial.theta": [0.5, 1.0, 1.5]}},
        # the first turn is a corner of the drag
        {"model": {"kind": "pendulum", "drag": 0.4}, "schemes": ["rk4"], "levels": [5, 6, 7, 8]},
    ],
)
def test_what_a_run_keeps_of_its_parts_tells_the_same(changes):
    """The commands judge what is left of each part of a sweep, Python the whole."""
    checks = {"converges": "theta", "order": "scheme"}, {"value": "period", "above": 0.0}
    experiment, record = run(*checks, QUANTITIES, **changes)
    thin = []
    assert list(keep_for_verdicts(experiment, [record], thin)) == [record]
    whole, left = (list(verdicts(experiment, row)) for row in (record, join_parts(thin)))
    assert [(v.text, v.advice) for v in left] == [(v.text, v.advice) for v in whole]
    assert "rad s-1" in whole[2].text


def test_a_counted_number_at_its_border_fails_and_no_finer_level_is_advised():
    ball = {"kind": "bouncing_ball", "g": 2.0, "restitution": 0.5, "eps_v": 0.3}
    given = {"model": ball, "initial": {"h": 1.0}, "time": {"end": 4.0}, "schemes": ["rk4"]}
    (verdict,) = verdicts(*run({"value": "event_count", "above": 3}, **given))
    assert (verdict.status, verdict.results[0].reason) == ("FAIL", "mismatch")
    assert "Finer levels will not help" in verdict.advice
