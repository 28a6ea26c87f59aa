"""The verdict on a tolerance: it must say what ``best.nc`` says of every member, and where the worst are."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from whole import simulated

from vibsim import Experiment, InputError, VibsimError, best, ladder, verdicts
from vibsim.analysis import analyse_records, keep_for_verdicts, summarise
from vibsim.comparison.best_solution import best_record
from vibsim.core.record import Record

pytestmark = pytest.mark.usefixtures("without_series")

STATES = ("theta", "omega")
HARD = 22
"""Number of the member next to the separatrix, which the pilot does not try."""


def experiment(**changes: Any) -> Experiment:
    data: dict[str, Any] = {
        "title": "t",
        "model": {"kind": "pendulum"},
        "initial": {"theta": 1.0},
        "time": {"end": 20.0},
        "schemes": [{"kind": "central", "end_velocity": "kick"}],
        "sweep": {"initial.omega": {"linspace": [1.2, 2.2, 40]}},
        "tolerance": 1e-4,
    }
    return Experiment.from_dict({**data, **changes})


@pytest.fixture(scope="module")
def swept() -> Experiment:
    return ladder.resolve(experiment())


@pytest.fixture(scope="module")
def convergence(swept: Experiment) -> Record:
    return analyse_records(swept, simulated(swept))


@pytest.mark.slow
def test_a_member_that_the_pilot_did_not_try_fails(swept: Experiment, convergence: Record) -> None:
    assert HARD not in ladder.choosing.pilot(swept)
    order, verdict = verdicts(swept, convergence)
    assert order.kind == "converges"
    assert (verdict.id, verdict.kind) == ("tolerance", "tolerance")
    assert (verdict.status, verdict.reason) == ("FAIL", "mismatch")
    assert verdict.expected == "at most 0.0001"
    assert verdict.counts == {"PASS": 39, "FAIL": 1, "INCONCLUSIVE": 0}
    found = best(swept)
    bounds = np.max([found[f"{state}_error"].max("t") for state in STATES], axis=0)[0]
    assert [r.value for r in verdict.results] == sorted(bounds.tolist(), reverse=True)
    worst = verdict.results[0]
    assert (worst.case, worst.status, worst.reason) == (HARD, "FAIL", "mismatch")
    assert [r.status for r in verdict.results[1:]] == ["PASS"] * 39
    np.testing.assert_array_equal(found["reached"][0], bounds <= 1e-4)
    omega = float(found["initial_omega"][HARD])
    assert verdict.where["FAIL"]["keys"]["initial.omega"]["range"] == [omega, omega]
    assert f"FAIL in 1 of 40 results, with initial.omega equal to {omega:.6g}" in verdict.text
    assert f"The hardest is scheme central, case {HARD} (" in verdict.text
    assert f"{bounds[HARD]:.3g}" in verdict.text
    first, last = swept.levels[0], swept.levels[-1]
    assert f"finer `levels:` than {first} to {last}" in verdict.advice
    assert "end_velocity" not in verdict.advice
    summary = summarise(swept, [order, verdict], convergence)
    assert summary["status"] == "FAIL"
    assert len(summary["checks"][1]["results"]) == 10
    json.dumps(summary, allow_nan=False)


def test_the_pilot_alone_passes(swept: Experiment) -> None:
    tried = ladder.choosing.pilot(swept).tolist()
    omega = np.linspace(1.2, 2.2, 40)[tried].tolist()
    chosen = experiment(sweep={"initial.omega": omega}).with_levels(swept.levels)
    record = analyse_records(chosen, simulated(chosen))
    verdict = verdicts(chosen, record)[-1]
    assert (verdict.status, verdict.reason, verdict.advice) == ("PASS", "match", "")
    assert verdict.counts["PASS"] == len(tried)


@pytest.mark.slow
def test_the_bounds_are_those_of_the_extrapolated_solution(
    swept: Experiment, convergence: Record
) -> None:
    record = best_record(swept, simulated(swept))
    for state, unit in zip(STATES, ("rad", "rad s-1"), strict=True):
        variable = convergence.variable(f"{state}_best_error")
        assert variable.dims == ("scheme", "case")
        assert variable.attrs["units"] == unit
        np.testing.assert_array_equal(variable.values, record[f"{state}_error"].max(axis=-1))


@pytest.mark.slow
def test_the_verdict_needs_only_what_is_kept_of_parts(
    swept: Experiment, convergence: Record
) -> None:
    thin: list[Record] = []
    list(keep_for_verdicts(swept, [convergence], thin))
    expected = summarise(swept, verdicts(swept, convergence), convergence)
    assert summarise(swept, verdicts(swept, thin[0]), thin[0]) == expected


def test_levels_in_which_nothing_is_known() -> None:
    lone = experiment(sweep=None, time={"end": 2000.0}).with_levels((5, 6))
    verdict = verdicts(lone, analyse_records(lone, simulated(lone)))[-1]
    assert (verdict.status, verdict.reason, verdict.results[0].value) == ("FAIL", "mismatch", None)
    assert "is unknown" in verdict.text


@pytest.mark.parametrize("is_swept", [False, True])
def test_the_advice_names_the_options_of_the_scheme(is_swept: bool) -> None:
    options = {"end_velocity": "extrapolate", "arithmetic": "three_term"}
    sweep = {"schemes.central.end_velocity": ["extrapolate"]} if is_swept else None
    poor = experiment(schemes=[{"kind": "central", **options}], sweep=sweep, tolerance=1e-12)
    poor = poor.with_levels((6, 7, 8))
    verdict = verdicts(poor, analyse_records(poor, simulated(poor)))[-1]
    found = best(poor)
    assert verdict.results[0].value == found["omega_error"].max() > found["theta_error"].max()
    assert "(of omega" in verdict.text
    assert ("end_velocity: kick` for scheme central" in verdict.advice) == (not is_swept)
    assert "arithmetic: compensated` for scheme central" in verdict.advice


def test_an_analysis_without_the_tolerance_is_refused(swept: Experiment) -> None:
    plain = experiment(tolerance=None, levels=list(swept.levels))
    record = analyse_records(plain, simulated(plain))
    assert not any(name.endswith("_best_error") for name in record.variables)
    assert [v.kind for v in verdicts(plain, record)] == ["converges"]
    with pytest.raises(VibsimError, match="analyse the levels again"):
        verdicts(swept, record)


def test_no_check_may_have_its_name() -> None:
    checks = [{"id": "tolerance", "converges": "theta"}]
    with pytest.raises(InputError, match="verdict on the tolerance"):
        experiment(checks=checks)
    assert experiment(checks=checks, tolerance=None, levels=[5, 6, 7]).checks[0].id == "tolerance"
