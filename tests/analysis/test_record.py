"""The convergence Record: names, shapes, signs, and numbers against the formulas that made the data."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from level_records import experiment, level_records, standard_error

from vibsim.analysis import analyse, analyse_records, summarise, verdicts
from vibsim.core.errors import VibsimError
from vibsim.core.record import Record, Variable
from vibsim.simulation import simulate

T = np.linspace(0.0, 8.0, 17)
SIZE = 0.02


def test_signs_and_factors_of_every_series() -> None:
    exp = experiment()
    record = analyse_records(exp, level_records(exp))
    h = 2.0**-4
    leading = h**2 * SIZE * T * np.sin(T)
    fourth = h**4 * SIZE * np.sin(2 * T)
    error = leading + fourth
    difference = -(0.75 * leading + (1 - 1 / 16) * fourth)
    assert record["t"] == pytest.approx(T)
    assert record["theta_error"][0, 0, 0] == pytest.approx(error, abs=1e-15)
    assert record["theta_difference"][0, 0, 0] == pytest.approx(difference, abs=1e-15)
    assert record["theta_error_estimate"][0, 0, 0] == pytest.approx(-4 / 3 * difference, abs=1e-15)
    scale = np.array([1.0, 4.0, 16.0])[:, None]
    expected = record["theta_difference"][0, 0] * scale
    assert record["theta_rescaled"][0, 0] == pytest.approx(expected, abs=1e-15)
    energy = record["energy_deviation_scaled"][0, 0]
    finest = record["energy_finest"][0, 0]
    assert energy[3] == pytest.approx(64 * (finest - finest[0]), abs=1e-15)
    assert energy[2] == pytest.approx(energy[3], abs=2e-4)
    assert record["energy_deviation_error"][0, 0, 0] == pytest.approx(-energy[0], abs=1e-15)
    start = record["energy_exact"][0, 0, 0]
    computed = 0.5 * (
        (np.cos(T) - error) ** 2 + (np.sin(T) + h**2 * SIZE * T * np.cos(T + 0.3)) ** 2
    )
    assert record["energy_error"][0, 0, 0] == pytest.approx(start - computed, abs=1e-15)
    ratio = record["theta_ratio"][0, 0, 1]
    assert np.nanmax(np.abs(ratio[1:] - 4)) < 0.05
    # both differences vanish at t = 0
    assert np.isnan(ratio[0])
    assert record["theta_finest"][0, 0] == pytest.approx(np.cos(T) - _error_at(7), abs=1e-15)
    assert np.array_equal(record["theta_exact"][0], np.cos(T))
    assert record["theta_richardson"][0, 0] == pytest.approx(np.cos(T), abs=1e-14)


def _error_at(level: int) -> np.ndarray:
    return standard_error(T, 2.0**-level, 0, 0)[0]


def test_norms_orders_and_the_numbers_of_triples() -> None:
    exp = experiment()
    record = analyse_records(exp, level_records(exp))
    errors = np.array([_error_at(level) for level in exp.levels])
    found = record["theta_error_norm"][0, 0]
    assert list(record["norm"]) == ["l1", "l2", "linf", "linf_interior"]
    assert found[:, 0] == pytest.approx(0.5 * np.abs(errors).sum(axis=1))
    assert found[:, 1] == pytest.approx(np.sqrt(0.5 * (errors**2).sum(axis=1)))
    assert found[:, 2] == pytest.approx(np.abs(errors).max(axis=1))
    assert found[:, 3] == pytest.approx(np.abs(errors[:, :-1]).max(axis=1))
    differences = record["theta_difference_norm"][0, 0, :, 1]
    order = np.log2(differences[:-1] / differences[1:])
    assert record["theta_observed_order"][0, 0, :, 1] == pytest.approx(order)
    assert record["theta_ratio_norm"][0, 0, :, 1] == pytest.approx(2**order)
    assert record["theta_proportionality"][0, 0] == pytest.approx([4.0, 4.0], abs=0.05)
    assert np.all(record["theta_coincidence"] < 0.05)
    assert record["theta_order"][0, 0] == pytest.approx(np.full(4, 2.0), abs=0.01)
    assert record["theta_order_low"][0, 0, 1] <= 2.0 <= record["theta_order_high"][0, 0, 1]
    assert record["theta_window_first"][0, 0] == 4
    assert record["theta_window_last"][0, 0] == 7
    assert record["dt"] == pytest.approx(8.0 / 2.0 ** np.arange(4, 8))
    assert list(record["steps"]) == [16, 32, 64, 128]


def test_dimensions_and_sizes_agree() -> None:
    exp = experiment(
        sweep={"initial.theta": [0.1, 0.2, 0.3]},
        schemes=["central", {"kind": "central", "label": "other"}],
    )
    record = analyse_records(exp, level_records(exp))
    sizes = record.sizes
    assert (sizes["scheme"], sizes["case"]) == (2, 3)
    assert (sizes["pair"], sizes["triple"], sizes["level"], sizes["norm"]) == (3, 2, 4, 4)
    shapes = {
        "theta_difference": ("scheme", "case", "pair", "t"),
        "theta_ratio": ("scheme", "case", "triple", "t"),
        "theta_richardson": ("scheme", "case", "t"),
        "theta_exact": ("case", "t"),
        "energy_exact": ("scheme", "case", "t"),
        "theta_error_norm": ("scheme", "case", "level", "norm"),
        "theta_richardson_error_norm": ("scheme", "case", "norm"),
        "theta_floor": ("scheme", "case", "level"),
        "theta_formal_order": ("scheme",),
        "theta_order": ("scheme", "case", "norm"),
        "theta_status": ("scheme", "case"),
        "energy_deviation_scaled": ("scheme", "case", "level", "t"),
        "omega_end": ("scheme", "case", "level"),
        "period": ("scheme", "case", "level"),
        "exact_period": ("case",),
        "omega_dt": ("case", "level"),
        "check_check_1_order": ("scheme", "case"),
    }
    for name, dims in shapes.items():
        assert record.variables[name].dims == dims, name
    assert record.coords["initial_theta"].attrs["sweep_key"] == "initial.theta"
    for name, variable in record.variables.items():
        assert isinstance(variable.attrs.get("units"), str), name
        assert isinstance(variable.attrs.get("long_name"), str), name


def test_what_is_of_a_member_has_a_level_whatever_its_values() -> None:
    exp = experiment()
    records = level_records(exp)
    attrs = {"long_name": "made up", "units": "1"}
    for level, record in records.items():
        numbers = {"of_level": float(level), "of_all": 3.0, "unknown": np.nan}
        extra = {n: Variable(("case",), np.array([v]), attrs) for n, v in numbers.items()}
        records[level] = replace(record, variables={**record.variables, **extra})
    found = analyse_records(exp, records).variables
    assert found["of_level"].dims == ("case", "level")
    np.testing.assert_array_equal(found["of_level"].values, [[4.0, 5.0, 6.0, 7.0]])
    # dimensions that depended on the values would differ between the parts of a sweep
    assert found["of_all"].dims == found["unknown"].dims == ("case", "level")
    assert found["natural_frequency"].dims == found["exact_period"].dims == ("case",)


def test_each_member_has_its_own_step_where_ends_differ() -> None:
    exp = experiment(sweep={"time.end": [8.0, 16.0]})
    record = analyse_records(exp, level_records(exp, ends=np.array([8.0, 16.0])))
    assert record.coords["dt"].dims == ("level", "case")
    assert record["dt"][0] == pytest.approx([0.5, 1.0])
    t = record["t"] * 16.0
    error = standard_error(t, 2.0**-4, 0, 1)[0]
    assert record["theta_error_norm"][0, 1, 0, 0] == pytest.approx(np.abs(error).sum() * 1.0)
    assert record["theta_error_norm"][0, 1, 0, 1] == pytest.approx(np.sqrt((error**2).sum()))


def test_levels_need_not_follow_each_other_and_may_be_stored_sparsely() -> None:
    exp = experiment(levels=[4, 6, 7])
    record = analyse_records(exp, level_records(exp, every={4: 1, 6: 2, 7: 8}))
    # C (h_4^2 - h_6^2) over C (h_6^2 - h_7^2): what lays one difference upon the other
    factor = (1 - 1 / 16) / (1 / 16 - 1 / 64)
    assert record["theta_rescaled"][0, 0, 1] == pytest.approx(
        factor * record["theta_difference"][0, 0, 1]
    )
    factor = -16 / 15
    assert record["theta_error_estimate"][0, 0, 0] == pytest.approx(
        factor * record["theta_difference"][0, 0, 0]
    )
    assert record["theta_observed_order"][0, 0, 0, 1] == pytest.approx(2.0, abs=0.02)
    assert list(record["pair"]) == [4, 6]
    assert list(record["triple"]) == [4]


@pytest.mark.parametrize("count", [1, 2, 3])
def test_short_ladders_leave_out_what_they_cannot_have(count: int) -> None:
    exp = experiment(levels=[4, 5, 6][:count])
    record = analyse_records(exp, level_records(exp))
    assert ("theta_difference" in record) == (count > 1)
    assert ("theta_ratio" in record) == (count > 2)
    (verdict,) = verdicts(exp, record)
    reason = "asymptotic" if count == 3 else "too_few_levels"
    assert verdict.reason == reason
    assert (verdict.status == "PASS") == (count == 3)
    json.dumps(summarise(exp, [verdict], record), allow_nan=False)


def test_a_member_that_failed_never_passes_and_warns_of_nothing() -> None:
    exp = experiment(
        sweep={"initial.theta": [0.1, 0.2]}, checks=[{"converges": q} for q in ("theta", "energy")]
    )
    record = analyse_records(exp, level_records(exp, failed=((5, 0, 1),)))
    for verdict in verdicts(exp, record):
        assert (verdict.status, verdict.reason) == ("FAIL", "non_finite")
        assert verdict.counts == {"PASS": 1, "FAIL": 1, "INCONCLUSIVE": 0}
        assert verdict.results[0].case == 1
        assert "level 5" in verdict.text
        assert verdict.advice
    summary = summarise(exp, verdicts(exp, record), record)
    (failure,) = summary["failures"]
    assert failure == {
        "scheme": "central",
        "level": 5,
        "case": 1,
        "t": 4.0,
        "step": 16,
        "error": "non_finite",
        "values": {"initial.theta": 0.2},
        "command": "vibsim run experiment.yaml@1",
    }
    json.dumps(summary, allow_nan=False)


def test_xarray_in_and_out_gives_the_same_as_records() -> None:
    exp = experiment()
    plain = analyse_records(exp, level_records(exp))
    sets = {level: record.to_xarray() for level, record in level_records(exp).items()}
    for given in (sets, list(sets.values())[::-1]):
        found = analyse(exp, given)
        assert set(found.variables) == {*plain.coords, *plain.variables}
        for name in plain.variables:
            np.testing.assert_array_equal(found[name].values, plain[name])
    assert [v.status for v in verdicts(exp, found)] == ["PASS"]
    assert verdicts(exp, found) == verdicts(exp, Record.from_xarray(found))


def test_an_analysis_without_a_check_is_refused() -> None:
    exp = experiment()
    record = analyse_records(exp, level_records(exp))
    more = experiment(checks=[{"id": "new", "converges": "omega"}])
    with pytest.raises(VibsimError, match="new"):
        verdicts(more, record)


def test_the_input_is_not_changed() -> None:
    exp = experiment()
    records = level_records(exp)
    before = {lv: {n: v.values.copy() for n, v in r.variables.items()} for lv, r in records.items()}
    verdicts(exp, analyse_records(exp, records))
    for level, record in records.items():
        for name, values in before[level].items():
            np.testing.assert_array_equal(record[name], values)


def test_real_simulations_give_the_numbers_of_the_issue() -> None:
    exp = experiment(
        model={"kind": "pendulum"}, time={"end": 20.0}, levels=[6, 7, 8, 9], samples="auto"
    )
    found = analyse(exp, {level: simulate(exp, level) for level in exp.levels})
    numbers = [0.9996677748139638, 0.9971663759228251, 0.9961666300804089]
    assert found["theta_end"].values[0, 0, :3] == pytest.approx(numbers, abs=1e-11)
    assert found["theta_exact"].values[0, -1] == pytest.approx(0.9958006771243681, abs=1e-12)
    bound = found["theta_richardson_error"].values
    error = found["theta_exact"].values - found["theta_richardson"].values
    assert np.all(np.abs(error) <= bound)
    assert found["theta_ratio_norm"].values[0, 0, :, 1] == pytest.approx(4.0, abs=0.05)
    assert found["energy_deviation_ratio_norm"].values[0, 0, :, 1] == pytest.approx(4.0, abs=0.05)


def test_a_ratio_beyond_single_precision_is_kept_as_infinite() -> None:
    """A large sweep keeps ratios with seven digits; a level that has all but blown up makes some of 1e40."""

    def blown_up(t: Any, h: float, scheme: int, case: int) -> tuple[Any, Any]:
        size = 1e30 if h == 2.0**-4 else h**4 * 1e-8
        return size * np.sin(t), size * np.cos(t)

    exp = experiment()
    rows = level_records(exp, blown_up)
    lean = {
        level: Record(row.coords, row.variables, {**row.attrs, "storage": "lean"})
        for level, row in rows.items()
    }
    ratio = np.asarray(analyse_records(exp, lean)["theta_ratio_norm"])
    assert ratio.dtype == np.float32
    assert np.isinf(ratio[0, 0, 0, 0])
    assert np.isfinite(ratio[0, 0, 1, 0])
