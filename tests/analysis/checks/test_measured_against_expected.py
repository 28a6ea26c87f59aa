"""Checks: measured against expected; numbers, claims, and the summary."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from level_records import experiment, level_records, standard_error
from spring_runs import spring

from vibsim.analysis import Verdict, analyse_records, summarise, verdicts
from vibsim.comparison import value_numbers as values
from vibsim.comparison.compare_quantities import comparisons
from vibsim.comparison.order_verdict import facts_of
from vibsim.experiment.value_names import VALUES
from vibsim.observe.member_block import block_of

T = np.linspace(0.0, 8.0, 17)


def first_order(t: Any, h: float, scheme: int, case: int) -> tuple[Any, Any]:
    theta, omega = standard_error(t, h, scheme, case)
    return theta + 0.02 * h * np.sin(t) ** 2 * t, omega


def run(*checks: dict[str, Any], error: Any = standard_error, **more: Any) -> list[Verdict]:
    failed = more.pop("failed", ())
    exp = experiment(checks=list(checks), **more)
    record = analyse_records(exp, level_records(exp, error, failed=failed))
    found = verdicts(exp, record)
    summary = summarise(exp, found, record)
    assert json.loads(json.dumps(summary, allow_nan=False)) == summary
    assert [check["id"] for check in summary["checks"]] == [v.id for v in found]
    return found


TRAP = {"levels": [6, 7, 8, 9], "error": first_order}


@pytest.mark.parametrize(
    ("expect", "sound", "trapped"),
    [
        ({}, ("PASS", "asymptotic"), ("FAIL", "order_low")),
        ({"status": "FAIL"}, ("FAIL", "mismatch"), ("PASS", "match")),
        ({"status": "FAIL", "reason": "order_low"}, ("FAIL", "mismatch"), ("PASS", "match")),
        ({"status": "FAIL", "reason": "unstable"}, ("FAIL", "mismatch"), ("FAIL", "mismatch")),
        ({"status": "INCONCLUSIVE"}, ("FAIL", "mismatch"), ("FAIL", "mismatch")),
        ({"status": "PASS", "reason": "exact"}, ("FAIL", "mismatch"), ("FAIL", "order_low")),
    ],
)
def test_expected_verdicts(
    expect: dict[str, str], sound: tuple[str, str], trapped: tuple[str, str]
) -> None:
    check = {"converges": "theta", "expect": expect}
    (found,) = run(check)
    assert (found.status, found.reason) == sound
    (found,) = run(check, **TRAP)
    assert (found.status, found.reason) == trapped
    assert found.results[0].reason == "order_low"
    assert bool(found.advice) == (found.status != "PASS")


def test_an_inconclusive_measurement_stays_one_unless_it_is_expected() -> None:
    (found,) = run({"converges": "theta"}, levels=[4, 5])
    assert (found.status, found.reason) == ("INCONCLUSIVE", "too_few_levels")
    (found,) = run({"converges": "theta", "expect": {"status": "FAIL"}}, levels=[4, 5])
    assert (found.status, found.reason) == ("INCONCLUSIVE", "too_few_levels")
    expect = {"status": "INCONCLUSIVE", "reason": "too_few_levels"}
    (found,) = run({"converges": "theta", "expect": expect}, levels=[4, 5])
    assert (found.status, found.reason) == ("PASS", "match")


def test_order_as_a_number_and_the_schemes_of_a_check() -> None:
    schemes = ["central", {"kind": "central", "label": "other"}]
    one, two, three = run(
        {"converges": "theta", "order": 1},
        {"converges": "theta", "order": 2.05, "tolerance": 0.1, "schemes": ["other"]},
        {"converges": "theta", "order": 2.05, "tolerance": 0.01},
        schemes=schemes,
    )
    assert (one.status, one.reason) == ("FAIL", "order_high")
    assert sum(one.counts.values()) == 2
    assert two.status == "PASS"
    assert [result.scheme for result in two.results] == ["other"]
    assert three.status != "PASS"


@pytest.mark.parametrize(
    ("check", "value"),
    [
        (
            {"value": "end", "quantity": "theta"},
            np.cos(8.0) - standard_error(T, 2.0**-7, 0, 0)[0][-1],
        ),
        (
            {"value": "end", "quantity": "theta", "at": {"level": 4}},
            np.cos(8.0) - standard_error(T, 2.0**-4, 0, 0)[0][-1],
        ),
        (
            {"value": "at", "quantity": "theta", "at": {"t": 4.0, "level": 5}},
            np.cos(4.0) - standard_error(T, 2.0**-5, 0, 0)[0][8],
        ),
        (
            {"value": "at", "quantity": "theta", "at": {"step": 3, "level": 4}},
            np.cos(1.5) - standard_error(T, 2.0**-4, 0, 0)[0][3],
        ),
        ({"value": "period"}, 2 * np.pi * (1 + 4.0**-7)),
        ({"value": "period_error", "at": {"level": 4}}, 4.0**-4),
        ({"value": "exact_period"}, 2 * np.pi),
        ({"value": "growth_factor"}, 1.5),
        (
            {"value": "error_linf", "quantity": "theta", "at": {"level": 4}},
            np.abs(standard_error(T, 2.0**-4, 0, 0)[0]).max(),
        ),
        (
            {"value": "error_l1", "quantity": "theta", "at": {"level": 5}},
            0.5 * np.abs(standard_error(T, 2.0**-5, 0, 0)[0]).sum(),
        ),
        ({"value": "error_l2", "quantity": "theta", "at": {"level": "best"}}, 0.0),
    ],
)
def test_values(check: dict[str, Any], value: float) -> None:
    exact = {**check, "equals": float(value), "atol": 1e-13}
    wrong = {**check, "equals": float(value) + 1e-6, "atol": 1e-7}
    below, above = {**check, "below": value + 1e-9}, {**check, "above": value + 1e-9}
    found = run(exact, wrong, below, above)
    assert [v.status for v in found] == ["PASS", "FAIL", "PASS", "FAIL"]
    assert [v.reason for v in found] == ["match", "mismatch", "match", "mismatch"]
    assert found[0].results[0].value == pytest.approx(value, abs=1e-13)


def test_without_every_step_the_frequency_is_that_of_the_period() -> None:
    """That of the recurrence is tested in `test_recurrence`."""
    exp = experiment()
    block = block_of(exp, level_records(exp, every={4: 2}))
    place = values.Place(block, {}, "", 4, None, None)
    assert values.value("frequency", place) == pytest.approx(1 / (1 + 4.0**-4), rel=1e-15)


def test_extrema_and_energies_over_every_step() -> None:
    exp = experiment()
    records = level_records(exp)
    theta, energy = records[7]["theta"][0, 0], records[7]["energy"][0, 0]
    deviation = np.abs(energy - energy[0])
    found = run(
        {"value": "max", "quantity": "theta", "equals": theta.max()},
        {"value": "min", "quantity": "theta", "equals": theta.min()},
        {"value": "max_abs", "quantity": "theta", "equals": np.abs(theta).max()},
        {"value": "max_abs", "quantity": "energy_deviation", "equals": deviation.max()},
        {
            "value": "max_abs_interior",
            "quantity": "energy_deviation",
            "equals": deviation[:-1].max(),
        },
        {
            "value": "relative_energy_error",
            "equals": np.abs(energy - energy[0]).max() / energy[0],
        },
    )
    assert [v.status for v in found] == ["PASS"] * 6


def test_what_was_not_gathered_over_every_step_is_not_made_up_from_samples() -> None:
    exp = experiment()
    block = block_of(exp, level_records(exp))
    for name in ("min", "max", "max_abs", "max_abs_interior"):
        place = values.Place(block, {}, "energy", None, None, None)
        assert np.isnan(values.value(name, place)).all(), name


def test_numbers_that_rest_on_several_levels_are_those_of_the_registry() -> None:
    found = {name for name, row in VALUES.items() if row.sees_several_levels}
    assert found == {
        "error_estimate_defect",
        "error_rate",
        "observed_order",
        "ratio",
        "coincidence",
        "richardson_error",
        "max_abs_ratio",
        "max_abs_interior_ratio",
    }


def test_numbers_of_triples_and_the_estimate() -> None:
    found = run(
        {"value": "observed_order", "quantity": "theta", "equals": 2.0, "atol": 0.01},
        {"value": "ratio", "quantity": "theta", "at": {"level": 4}, "equals": 4.0, "atol": 0.1},
        {"value": "coincidence", "quantity": "theta", "below": 0.02},
        {"value": "error_estimate_defect", "quantity": "theta", "at": {"level": 4}, "below": 0.02},
        {"value": "richardson_error", "quantity": "theta", "below": 1e-4},
    )
    assert [v.status for v in found] == ["PASS"] * 5


def test_a_number_that_does_not_exist_is_not_applicable() -> None:
    found = run(
        {"value": "period_grid", "below": 100.0},
        {"value": "period_grid", "above": -100.0},
        {"claim": "a", "that": {"value": "period_grid", "below": 1.0}, "holds": True},
        {"claim": "b", "that": {"value": "period_grid", "below": 1.0}, "holds": False},
    )
    assert {(v.status, v.reason) for v in found} == {("INCONCLUSIVE", "not_applicable")}
    assert all(v.advice for v in found)


@pytest.mark.parametrize(
    ("check", "advice"),
    [
        ({"value": "stability_limit", "equals": 9.0}, "Change"),
        ({"value": "force_evaluations", "equals": 9.0}, "Change"),
        ({"value": "max", "quantity": "theta", "equals": 9.0}, "Change"),
        ({"value": "max", "quantity": "theta", "equals": 9.0, "at": {"level": 4}}, "Change"),
    ],
)
def test_finer_levels_are_advised_where_they_change_the_number(
    check: dict[str, Any], advice: str
) -> None:
    (found,) = run(check)
    assert found.status == "FAIL"
    assert found.advice.startswith(advice)


def test_values_of_a_member_that_broke_down() -> None:
    checks = [
        {"value": "max", "quantity": "theta", "below": 1e6, "at": {"level": 7}},
        {"value": "end", "quantity": "theta", "below": 1e6, "at": {"level": 7}},
        {"value": "max", "quantity": "theta", "below": 1e6, "at": {"level": 6}},
        {"value": "at", "quantity": "theta", "below": 1e6, "at": {"level": 7, "t": 1.0}},
        {"value": "coincidence", "quantity": "theta", "below": 1e6},
        {"value": "exact_period", "below": 1e6},
    ]
    found = run(*checks, failed=((7, 0, 0),))
    statuses = [(v.status, v.reason) for v in found]
    bad, good = ("FAIL", "non_finite"), ("PASS", "match")
    assert statuses == [bad, bad, good, good, bad, good]


@pytest.mark.parametrize("holds", [True, False])
def test_claims(holds: bool) -> None:
    true = {"converges": "theta", "order": 2}
    false = {"converges": "theta", "order": 1}
    value = {"value": "error_linf", "quantity": "theta", "below": 1.0}
    found = run(*({"claim": "c", "that": that, "holds": holds} for that in (true, false, value)))
    assert [v.status for v in found] == (
        ["PASS", "FAIL", "PASS"] if holds else ["FAIL", "PASS", "FAIL"]
    )
    assert [v.reason for v in found] == (
        ["asymptotic", "mismatch", "match"] if holds else ["mismatch", "match", "mismatch"]
    )
    for v in found:
        assert v.kind == "claim"
        assert v.expected == ("true" if holds else "false")
        assert bool(v.advice) == (v.status != "PASS")


@pytest.mark.parametrize("claim", ["the error is small", "the error is small. "])
def test_a_claim_ends_with_one_point(claim: str) -> None:
    that = {"value": "error_linf", "quantity": "theta", "below": 1.0}
    (found,) = run({"claim": claim, "that": that, "holds": True})
    assert found.text.startswith("Claim: the error is small. The statement is true.")


def test_a_claim_that_cannot_be_decided() -> None:
    for holds in (True, False):
        that = {"converges": "theta"}
        (found,) = run({"claim": "c", "that": that, "holds": holds}, levels=[4, 5])
        assert (found.status, found.reason) == ("INCONCLUSIVE", "too_few_levels")


@pytest.mark.slow
def test_a_sweep_lists_the_worst_ten_and_counts_all() -> None:
    values = [0.01 * (i + 1) for i in range(25)]

    def some(t: Any, h: float, scheme: int, case: int) -> tuple[Any, Any]:
        return (first_order if case % 2 else standard_error)(t, h, scheme, case)

    more = {"sweep": {"initial.theta": values}, "levels": [6, 7, 8, 9]}
    (found,) = run({"converges": "theta"}, error=some, **more)
    assert found.status == "FAIL"
    assert found.counts == {"PASS": 13, "FAIL": 12, "INCONCLUSIVE": 0}
    assert len(found.results) == 25
    exp = experiment(**more)
    record = analyse_records(exp, level_records(exp, some))
    summary = summarise(exp, verdicts(exp, record), record)
    listed = summary["checks"][0]["results"]
    assert len(listed) == 10
    assert all(row["status"] == "FAIL" for row in listed)
    assert summary["status"] == "FAIL"
    assert sum(summary["checks"][0]["counts"].values()) == 25


def test_one_case_and_one_scheme_of_a_sweep() -> None:
    more: dict[str, Any] = {
        "sweep": {"initial.theta": [0.1, 0.2, 0.3]},
        "schemes": ["central", {"kind": "central", "label": "b"}],
    }
    at = {"case": 2, "scheme": "b"}
    (found,) = run({"value": "period", "at": at, "below": 10.0}, **more)
    assert [(r.scheme, r.case) for r in found.results] == [("b", 2)]


def test_the_summary_has_the_keys_of_the_design() -> None:
    exp = experiment()
    record = analyse_records(exp, level_records(exp))
    summary = summarise(exp, verdicts(exp, record), record)
    keys = {"vibsim_format", "collection", "experiment", "title", "status", "checks", "failures"}
    assert keys <= set(summary)
    assert summary["vibsim_format"] == 2
    check = summary["checks"][0]
    assert {"id", "kind", "text", "quantity", "expected", "status", "reason", "advice"} <= set(
        check
    )
    result = check["results"][0]
    assert set(result) == {"scheme", "case", "status", "reason", "facts", "sentence"}
    facts = result["facts"]
    assert facts["levels"] == [4, 7]
    assert facts["order_low"] <= facts["order"] <= facts["order_high"]
    assert check["text"].endswith(result["sentence"])


@pytest.mark.slow
def test_known_causes_are_named() -> None:
    start = [{"kind": "central", "start": "first_order"}]
    (found,) = run({"converges": "theta"}, schemes=start, **TRAP)
    assert "first_order" in found.text
    assert "start: centred" in found.advice

    def bad_end(t: Any, h: float, scheme: int, case: int) -> tuple[Any, Any]:
        theta, omega = standard_error(t, h, scheme, case)
        omega = omega.copy()
        omega[-1] += h
        return theta, omega

    end = [{"kind": "central", "end_velocity": "backward"}]
    trap, inside = run(
        {"converges": "omega", "norm": "linf"},
        {"converges": "omega", "norm": "linf_interior"},
        schemes=end,
        levels=[6, 7, 8, 9],
        error=bad_end,
    )
    assert trap.reason == "order_low"
    assert "end_velocity: backward" in trap.text
    assert "end_velocity: kick" in trap.advice
    assert inside.status == "PASS"
    (low,) = run({"converges": "theta"}, **TRAP)
    assert low.advice
    assert "start" not in low.advice
    (few,) = run({"converges": "theta"}, levels=[4, 5])
    assert "6 and 7" in few.advice


def test_unstable_names_level_and_step() -> None:
    (found,) = run({"converges": "theta"}, levels=[1, 2, 3, 4, 5])
    assert (found.status, found.reason) == ("FAIL", "unstable")
    assert "level 1" in found.text
    assert "w dt = 4 " in found.text
    assert "at 2 or finer" in found.advice


def test_a_failure_weighs_more_than_what_is_undecided() -> None:
    def some(t: Any, h: float, scheme: int, case: int) -> tuple[Any, Any]:
        theta, omega = standard_error(t, h, scheme, case)
        return first_order(t, h, scheme, case) if case == 1 else (theta * (1 + 400 * h), omega)

    sweep = {"initial.theta": [0.1, 0.2, 0.3]}
    (found,) = run({"converges": "theta"}, error=some, sweep=sweep, levels=[6, 7, 8, 9])
    assert found.counts == {"PASS": 0, "FAIL": 1, "INCONCLUSIVE": 2}
    assert (found.status, found.results[0].case) == ("FAIL", 1)
    assert "case 1" in found.text


def test_a_step_that_was_not_stored_has_no_value() -> None:
    exp = experiment(checks=[{"value": "at", "quantity": "theta", "at": {"step": 3}, "below": 9.0}])
    sparse = level_records(exp, every={7: 8})
    (found,) = verdicts(exp, analyse_records(exp, sparse))
    assert (found.status, found.reason) == ("INCONCLUSIVE", "not_applicable")


def test_the_summary_has_null_and_never_nan() -> None:
    exp = experiment()
    records = level_records(exp, failed=((6, 0, 0),))
    unknown = records[6].variables["failure_time"].values
    unknown[...] = np.nan
    record = analyse_records(exp, records)
    summary = summarise(exp, verdicts(exp, record), record)
    assert summary["failures"][0]["t"] is None
    json.dumps(summary, allow_nan=False)


def test_the_floor_is_measured_in_the_norm_of_the_check() -> None:
    exp = experiment()
    (theta,) = comparisons(block_of(exp, level_records(exp)), ("theta",)).values()
    at_a_point = theta.floor[0, 0]
    assert np.all(at_a_point >= 2.2e-16)
    factor = {"linf": 1.0, "linf_interior": 1.0, "l2": np.sqrt(0.5 * 17), "l1": 0.5 * 17}
    for norm, expected in factor.items():
        found = facts_of(theta, norm, np.array([[2.0]]), 0.1)
        assert found.floor[0, 0] == pytest.approx(expected * at_a_point, rel=1e-12, abs=0)


def test_every_value_of_the_registry_is_worked_out() -> None:
    assert set(values.NUMBERS) == set(VALUES)


def test_what_is_exact_is_not_the_hardest() -> None:
    """Its page would show round-off in place of an order."""
    check = {"converges": "energy_deviation"}
    run = spring(["crank_nicolson", "rk4", "central"], check, levels=(0, 1, 2, 3))
    results = run.verdicts[0].results
    assert {result.reason for result in results} == {"exact", "asymptotic"}
    assert results[-1].scheme == "crank_nicolson"
