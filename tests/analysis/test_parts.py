"""A sweep in parts: the same bytes whatever is analysed together, lean or not, and a member alone."""

from __future__ import annotations

import dataclasses
import os
import signal
import sys
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray
from sweeps import CHECKS, SWEEPS, assert_same_bytes, cut, in_parts, of
from thinned import thinned
from whole import simulated

from vibsim import Experiment, analyse
from vibsim.analysis import analyse_records, blockwise, keep_for_verdicts, summarise, verdicts
from vibsim.comparison.value_numbers import NUMBERS
from vibsim.core.errors import VibsimError
from vibsim.core.record import Record, Variable
from vibsim.experiment.storage import stored_series
from vibsim.experiment.value_names import VALUES, Value
from vibsim.models import MODELS


@pytest.fixture(params=["series", "lean"])
def storage(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    if request.param == "lean":
        monkeypatch.setattr("vibsim.experiment.storage.LEAN", 0)
    return str(request.param)


@cache
def made(name: str, storage: str) -> tuple[dict[int, Record], Record]:
    """Return the levels of a sweep, and what was found of it, in the storage that the test has set."""
    records = simulated(SWEEPS[name])
    whole = analyse_records(SWEEPS[name], records)
    assert whole.attrs["storage"] == storage
    return records, whole


@pytest.mark.parametrize(
    ("name", "storage"),
    thinned(
        [("grid", "lean"), ("ends", "series"), ("options", "lean"), ("tolerance", "series")], 2
    ),
    indirect=["storage"],
)
def test_parts_and_processes_change_no_bit(name: str, storage: str) -> None:
    """Parts of three processes that do not divide the members evenly, and of one member where they are fewest."""
    experiment = SWEEPS[name]
    records, whole = made(name, storage)
    size = {6: 1, 8: 3}.get(experiment.members, 5)
    assert_same_bytes(in_parts(experiment, records, size, 3), whole)


ME = os.getpid()


def analyse_or_die(experiment: Experiment, records: dict[int, Record]) -> Record:
    if os.getpid() != ME:
        os.kill(os.getpid(), signal.SIGKILL)
    return analyse_records(experiment, records)


@pytest.mark.slow
def test_a_process_that_is_killed_ends_the_analysis(monkeypatch: pytest.MonkeyPatch) -> None:
    experiment = SWEEPS["grid"]
    monkeypatch.setattr(blockwise, "analyse_records", analyse_or_die)
    with pytest.raises(VibsimError, match="was killed; there may be too little memory"):
        in_parts(experiment, simulated(experiment), 5, 2)


@pytest.mark.parametrize("name", thinned(SWEEPS, 3))
def test_a_member_alone_has_the_numbers_and_verdicts_that_it_has_in_the_sweep(
    name: str, storage: str
) -> None:
    experiment = SWEEPS[name]
    _, whole = made(name, storage)
    expected = verdicts(experiment, whole)
    # of a grid of 7 by 4 every value of both; half of them with either storage
    cases = [4 * k + k % 4 for k in range(7)] if name == "grid" else range(experiment.members)
    for case in cases[storage == "lean" :: 2]:
        alone = experiment.alone(case)
        found = analyse_records(alone, simulated(alone))
        same = cut(whole, case, case + 1)
        for key, variable in same.variables.items():
            one = found.variables[key].values
            assert np.array_equal(one.ravel(), variable.values.ravel(), equal_nan=True), key
        for verdict, check in zip(verdicts(alone, found), expected, strict=True):
            own = {r.scheme: r for r in check.results if r.case == case}
            for result in verdict.results:
                assert result.reason == own[result.scheme].reason
                assert result.order == own[result.scheme].order
                assert result.value == own[result.scheme].value


@pytest.mark.parametrize("name", SWEEPS)
def test_bounded_storage_changes_no_number(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    experiment = SWEEPS[name]
    _, full = made(name, "series")
    monkeypatch.setattr("vibsim.experiment.storage.LEAN", 0)
    _, lean = made(name, "lean")
    assert not any("t" in variable.dims for variable in lean.variables.values())
    assert lean.words("norm") == ["l1", "l2", "linf"]
    kinds = [full.words("norm").index(norm) for norm in lean.words("norm")]
    for key, variable in lean.variables.items():
        of_series = key.endswith("richardson_error_max")
        expected = full[key.removesuffix("_max")].max(axis=-1) if of_series else full[key]
        if "norm" in variable.dims:
            expected = expected[..., kinds]
        if variable.values.dtype == np.float32:
            np.testing.assert_allclose(variable.values, expected, rtol=1e-6, err_msg=key)
        else:
            assert np.array_equal(variable.values, expected, equal_nan=True), key
    for a, b in zip(verdicts(experiment, lean), verdicts(experiment, full), strict=True):
        assert (a.status, a.reason, a.counts, a.where) == (b.status, b.reason, b.counts, b.where)


def needs_another_model(row: Value) -> bool:
    """Tell whether a value is of linear or driven models, of events, or of formulas without functions: no pendulum."""
    return row.needs_linear or row.needs_events or row.needs_rational or row.needs_force


def every_value() -> Experiment:
    checks = []
    for name, row in VALUES.items():
        check = {"value": name, "below": 1.0}
        if needs_another_model(row):
            continue
        if row.of != "none":
            energy = row.of in {"deviation", "running"}
            check["quantity"] = "energy_deviation" if energy else "omega"
        if row.needs_time:
            check["at"] = {"step": 4, "level": 5}
        checks.append(check)
        if row.best:
            best = {"level": "best"} | ({"step": 4} if row.needs_time else {})
            checks.append({**check, "at": best})
    checks.append({"converges": "potential_energy", "norm": "linf_interior"})
    return of({"initial.theta": [0.5, 1.0, 2.0], "time.end": [10.0, 20.0]}, checks=checks)


def values_of(experiment: Experiment, record: Record) -> NDArray[np.float64]:
    """Return the number that each check on a value or an order measured, shape (check, scheme, case)."""
    field = {"value": "value", "converges": "order"}
    names = [f"check_{check.id}_{field[check.kind]}" for check in experiment.checks]
    return np.array([record[name] for name in names])


@pytest.mark.slow
def test_every_value_can_be_asked_for_where_storage_is_bounded(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    experiment = every_value()
    full = values_of(experiment, analyse_records(experiment, simulated(experiment)))
    monkeypatch.setattr("vibsim.experiment.storage.LEAN", 0)
    records = simulated(experiment)
    names = {n for n, v in records[7].variables.items() if "t" in v.dims}
    running = "energy_deviation_running_max"
    assert names == {"theta", "omega", "energy_deviation", "potential_energy", running}
    assert names == set(stored_series(experiment))
    lean = values_of(experiment, analyse_records(experiment, records))
    asked = {check.value for check in experiment.checks if check.kind == "value"}
    rows = {name: VALUES[name] for name in NUMBERS}
    assert asked == {n for n, row in rows.items() if not needs_another_model(row)}
    assert np.isfinite(full).any(axis=(1, 2)).mean() > 0.9
    assert np.array_equal(lean, full, equal_nan=True)


def test_what_bounded_storage_keeps_of_a_member(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("vibsim.experiment.storage.LEAN", 0)
    experiment = of({"initial.theta": [0.5, 1.0]}, checks=CHECKS[:1], schemes=["central"])
    record = analyse_records(experiment, simulated(experiment))
    everything = (*record.coords.values(), *record.variables.values())
    size = sum(v.values.nbytes for v in everything if "case" in v.dims) / experiment.members
    # of these the three numbers on the error of the finest level
    assert size < 940 + 3 * 8


def test_verdicts_need_only_what_is_kept_of_parts() -> None:
    experiment = SWEEPS["ends"]
    _, whole = made("ends", "series")
    thin: list[Record] = []
    (part,) = keep_for_verdicts(experiment, [whole], thin)
    assert part is whole
    assert not any("t" in variable.dims for variable in thin[0].variables.values())
    expected = summarise(experiment, verdicts(experiment, whole), whole)
    assert summarise(experiment, verdicts(experiment, thin[0]), thin[0]) == expected
    assert expected["failure_count"] > 0


def test_a_failure_has_its_step_where_storage_is_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    experiment = SWEEPS["ends"]
    _, full = made("ends", "series")
    monkeypatch.setattr("vibsim.experiment.storage.LEAN", 0)
    _, lean = made("ends", "lean")
    assert "last_step" in full
    assert "last_step" not in lean
    of_full, of_lean = (
        summarise(experiment, verdicts(experiment, r), r)["failures"] for r in (full, lean)
    )
    assert of_full
    assert of_lean == of_full


def test_options_that_are_swept_give_each_member_the_promises_of_its_own_scheme() -> None:
    experiment = SWEEPS["options"]
    _, record = made("options", "series")
    assert record.variables["theta_formal_order"].dims == ("scheme", "case")
    arithmetic = record["schemes_central_arithmetic"]
    floor = record["theta_floor"][0, :, -1]
    # 2^-53 N^(3/2) against the distance 2^-52 between numbers, at N = 128
    ratio = floor[arithmetic == "three_term"] / floor[arithmetic == "compensated"]
    assert ratio == pytest.approx(np.full(6, 0.5 * 128**1.5))
    # the other scheme has no option that is swept
    assert np.ptp(record["theta_floor"][1, ::2, -1]) == 0.0
    (omega,) = (v for v in verdicts(experiment, record) if v.id == "check_2")
    assert omega.where
    for found in omega.where.values():
        shares = found["keys"]["schemes.central.end_velocity"]["shares"]
        assert set(shares) == {"kick", "extrapolate", "backward"}


@pytest.mark.slow
def test_swept_words_are_as_wide_in_every_part() -> None:
    experiment = SWEEPS["options"]
    records, _ = made("options", "series")
    found = set()
    # every third has both words of one option, and two of the other
    for case in range(0, experiment.members, 3):
        one = {level: cut(record, case, case + 1) for level, record in records.items()}
        for record in one.values():  # as a file gives them: no wider than they need to be here
            for name in ("schemes_central_arithmetic", "schemes_central_end_velocity"):
                word = record.coords[name]
                narrow = np.array(word.values.tolist())
                record.coords[name] = Variable(word.dims, narrow, word.attrs)  # type: ignore[index]
        part = analyse_records(experiment, one)
        found.add(tuple(v.values.dtype for v in part.coords.values()))
    assert len(found) == 1


def test_verdicts_are_refused_where_the_checks_changed() -> None:
    _, record = made("grid", "series")
    other = [dict(check, id=f"check_{i + 1}") for i, check in enumerate(CHECKS)]
    other[0]["tolerance"] = 0.2
    changed = of({"initial.theta": [1.0]}, checks=other)
    with pytest.raises(VibsimError, match="analyse the levels again"):
        verdicts(changed, record)


@pytest.mark.filterwarnings("ignore:.*:FutureWarning")
def test_a_grid_unstacks_with_one_call(storage: str) -> None:
    experiment = SWEEPS["grid"]
    records, _ = made("grid", storage)
    data = analyse(experiment, [record.to_xarray() for record in records.values()])
    grid = data.set_index(case=["initial_theta", "initial_omega"]).unstack("case")
    assert grid.theta_order.dims == ("scheme", "norm", "initial_theta", "initial_omega")
    assert grid.sizes["initial_theta"] == 7
    assert grid.sizes["initial_omega"] == 4
    one = grid.period.sel(initial_theta=2.5, initial_omega=0.3, scheme="central", level=7)
    case = 3 * 4 + 1
    assert one.item() == records[7]["period"][0, case]
    if storage == "series":
        assert {"initial_theta", "initial_omega"} < set(grid.theta_ratio.dims)


@pytest.mark.slow
def test_without_an_exact_solution_only_errors_are_unknown(
    storage: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    experiment = of({"initial.theta": [0.5, 1.0]}, checks=CHECKS[:3])
    records = simulated(experiment)
    known = analyse_records(experiment, records)
    for record in records.values():
        for name in ("theta_exact", "omega_exact", "exact_period"):
            record.variables.pop(name, None)  # type: ignore[attr-defined]
    bare = dataclasses.replace(
        MODELS["pendulum"],
        exact=None,
        exact_period=None,
        variant=None,
        acceleration="-(g/L)*sin(theta) + 0*abs(theta)",
    )
    for name, module in list(sys.modules.items()):
        if name.startswith("vibsim.") and hasattr(module, "MODELS"):
            monkeypatch.setattr(module, "MODELS", {"pendulum": bare})
    found = analyse_records(experiment, records)
    assert np.isnan(found["theta_error_norm"]).all()
    assert np.isfinite(found["energy_deviation_error_norm"]).all()
    assert "exact_period" not in found
    assert ("theta_exact" in known) == (storage == "series")
    assert np.array_equal(found["theta_difference_norm"], known["theta_difference_norm"])
    assert np.all(found["theta_floor"] <= known["theta_floor"])
    assert_same_bytes(in_parts(experiment, records, 1), found)
    assert [v.status for v in verdicts(experiment, found)]


@pytest.mark.slow
def test_what_no_level_can_tell_is_said_of_what_is_kept_of_parts() -> None:
    """Of friction with a spring of its own nothing is known; of the undamped one the exact solution is."""
    for alpha, is_said in ((0.5, True), (0.0, False)):
        data = {
            "title": "test",
            "model": {"kind": "sliding_box", "alpha": alpha, "mu": 0.1},
            "initial": {"u": 2.0},
            "time": {"end": 10.0},
            "levels": [7, 8, 9, 10],
            "schemes": ["rk2"],
            "checks": [{"converges": "u"}],
        }
        experiment = Experiment.from_dict(data)
        whole = analyse_records(experiment, simulated(experiment))
        thin: list[Record] = []
        list(keep_for_verdicts(experiment, [whole], thin))
        (found,) = verdicts(experiment, thin[0])
        assert found.status == "PASS"
        assert ("convergence to a wrong answer would go unnoticed" in found.text) == is_said
        assert found.text == verdicts(experiment, whole)[0].text
