"""The pictures of stability, energy and equality: every kind has one, with its marks where the numbers are."""

from __future__ import annotations

from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest
import samples
from drawn import BLUE, bars, borders, curves, dots, texts

from vibsim.experiment.schema.checks import MEASURED
from vibsim.report import choice
from vibsim.report.evidence import figure
from vibsim.report.evidence.frame import short
from vibsim.simulation import simulate_record

SPRING = {
    "model": {"kind": "spring", "w": "2*pi"},
    "initial": {"u": 1.0},
    "time": {"end": 10.0, "base_steps": 100},
    "levels": [0, 1, 2, 3],
    "samples": "all",
}
KINDS = {
    "converges": {"converges": "u"},
    "accurate": {"accurate": "u", "relative": 1e-3},
    "value": {"value": "error_linf", "quantity": "u", "below": 1.0},
    "stable": {"stable": True},
    "conserves": {"conserves": "energy", "drift": "linear"},
    "equal": {"equal": ["rk4", "discrete"], "quantity": "u"},
}
ACCURATE = KINDS["accurate"]
BEHAVIOUR = ("stable", "conserves", "equal")


def run(*checks, **changes):
    """Return the experiment, its record, and the picture of every check."""
    content = SPRING | {"schemes": ["rk4"], "checks": list(checks)} | changes
    experiment = samples.experiment(**content)
    record = samples.record(experiment)
    told = samples.summary(experiment, record)["checks"]
    found = [figure.picture(choice.of_check(record, check)) for check in told]
    for picture in found:
        if picture is not None and (drawn := samples.element(picture)):
            ElementTree.fromstring(drawn)
            assert "nan" not in drawn
    return experiment, record, found


def test_the_kinds_are_all_there():
    assert set(KINDS) == set(MEASURED)


@pytest.mark.parametrize("kind", MEASURED)
@pytest.mark.parametrize("is_claim", [False, True])
def test_every_kind_of_check_has_a_picture(kind, is_claim):
    check = {"claim": "it is so", "that": KINDS[kind]} if is_claim else KINDS[kind]
    _, _, (found,) = run(check)
    assert found.figure is not None
    assert "rk4" in found.caption


@pytest.mark.parametrize("kind", BEHAVIOUR)
def test_the_member_that_decides_is_drawn(kind):
    _, _, (found,) = run(KINDS[kind], sweep={"initial.u": [0.5, 1.0, 2.0]})
    assert found.figure is not None
    assert "initial u = " in found.caption


def test_the_error_of_every_level_is_marked_and_the_finest_one_counts():
    _, record, (found,) = run(ACCURATE)
    errors = record["u_error_norm"][0, 0, :, 1]
    shown = [y for _, y in dots(found)]
    assert len(shown) == 4
    assert sorted(shown) == pytest.approx(sorted(errors / record["check_check_1_size"][0, 0]))
    assert "filled at the finest level" in found.caption


def test_the_means_of_a_linear_drift_climb_by_two():
    check = {"conserves": "energy", "drift": "linear", "level": 1}
    experiment, _, (found,) = run(check)
    marks = bars(found)
    ends = [(10.0 * a, 10.0 * b) for a, b in ((1 / 8, 1 / 4), (1 / 4, 1 / 2), (1 / 2, 1))]
    assert np.array([(a, b) for a, _, b in marks]) == pytest.approx(np.array(ends))
    third, second, first = (y for _, y, _ in marks)
    assert (first - second) / (second - third) == pytest.approx(2.0, rel=0.05)
    # told by the largest error of the level itself
    level = simulate_record(experiment, 1)
    largest = level["energy_deviation_running_max"][0, 0] / level["energy_initial"][0, 0]
    n = largest.size - 1
    assert f"m₁ = {short(np.mean(largest[n // 2 :]))}." in found.caption
    assert "a drift like t gives 2" in found.caption
    assert "in proportion to t through" in found.caption


def test_a_quadratic_drift_climbs_by_four():
    limit = {"end": "300/pi", "base_dt": "1/pi"}
    _, _, (found,) = run(
        {"conserves": "energy", "drift": "quadratic"},
        schemes=["central"],
        initial={"u": 1.0, "v": 1.0},
        time=limit,
        levels=[0],
    )
    third, second, first = (y for _, y, _ in bars(found))
    assert (first - second) / (second - third) == pytest.approx(4.0, rel=0.1)
    assert "a drift like t² gives 4" in found.caption


def test_a_drift_that_is_round_off_lies_below_its_border():
    _, record, (found,) = run({"conserves": "energy", "drift": "none"}, schemes=["crank_nicolson"])
    (border,) = borders(found)
    allowed = record["check_check_1_round_off"][0, 0] / record["energy_initial"][0, 0]
    assert border == allowed
    (curve,) = curves(found, BLUE)
    assert np.nanmax(curve.get_ydata()) < border
    low, high = found.figure.axes[0].get_ylim()
    assert low < np.nanmax(curve.get_ydata()) < border < high
    assert bars(found) == []
    assert "within the round-off of this run" in found.caption


def test_a_bounded_error_stays_at_the_dashed_line():
    _, _, (found,) = run(
        {"conserves": "energy", "drift": "bounded"}, schemes=["central"], levels=[1, 2]
    )
    heights = [y for _, y, _ in bars(found)]
    low, high = found.figure.axes[0].get_ylim()
    # less than anyone sees: a hundredth of the frame
    assert max(heights) - min(heights) < 0.01 * (high - low)
    assert "no growth" in found.caption


def test_an_exponential_drift_is_a_line_on_a_logarithmic_scale():
    _, _, (found,) = run(
        {"conserves": "energy", "drift": "bounded"}, schemes=["forward_euler"], levels=[0, 1]
    )
    assert "by the factor" in found.caption
    assert found.figure.axes[0].get_yscale() == "log"


def test_a_run_too_short_for_a_drift_says_so():
    _, _, (found,) = run(
        {"conserves": "energy", "drift": "linear"}, time={"end": 2.0, "base_steps": 20}
    )
    assert "too short to name a drift" in found.caption


def test_the_difference_is_marked_where_it_is_largest():
    check = {"equal": ["rk4", "exact"], "quantity": "u", "level": 1, "atol": 1e-8}
    experiment, record, (found,) = run(check)
    level = simulate_record(experiment, 1)
    distance = np.abs(level["u"][0, 0] - level["u_exact"][0])
    assert np.nanmax(record["check_check_1_distance_over_time"]) == distance.max()
    assert distance.max() == record["check_check_1_distance"][0, 0]
    ((x, y),) = dots(found, BLUE)
    place = 10.0 * np.argmax(distance) / (distance.size - 1)
    assert x == pytest.approx(place, abs=10.0 / 240 / 2)
    assert y == distance.max()
    assert borders(found) == [1e-8]
    assert found.figure.axes[0].get_yscale() == "log"
    assert "times the allowed 1·10⁻⁸" in found.caption


def test_a_long_run_keeps_its_largest_difference():
    check = {"equal": ["rk4", "exact"], "quantity": "u", "level": 3, "atol": 1.0}
    _, record, (found,) = run(check)
    assert record["check_check_1_distance_over_time"].shape == (1, 241)
    assert (
        np.nanmax(record["check_check_1_distance_over_time"])
        == record["check_check_1_distance"][0, 0]
    )
    assert len(dots(found)) == 1


def test_two_that_are_the_same_have_words_and_no_picture():
    check = {"equal": ["central", "verlet"], "quantity": "u", "atol": 0.0}
    two = ["central", {"kind": "central", "label": "verlet"}]
    _, _, (found,) = run(check, schemes=two)
    assert samples.element(found) == ""
    assert "identical bit by bit" in found.caption


def test_w_dt_is_marked_beside_the_limit():
    time = {"end": 10.0, "base_steps": 25}
    checks = [{"stable": False, "level": 0}, {"stable": True}]
    _, _, (unstable, stable) = run(*checks, schemes=["central"], time=time)
    for found, beyond, judged in ((unstable, True, 0), (stable, False, 3)):
        (steps,), (size,), (growth,) = (dots(found, BLUE, i) for i in range(3))
        limit, border, _ = borders(found)
        assert limit == 2.0
        assert (steps[1] > limit) == beyond
        assert (size[1] > border) == beyond
        assert steps[0] == judged
        assert len(dots(found, "white")) == 9
        # measured and predicted are one
        low, high = found.figure.axes[2].get_ylim()
        assert bars(found)[judged][1] == pytest.approx(growth[1], abs=0.002 * (high - low))
    assert "is beyond the limit 2;" in unstable.caption
    assert "is below the limit 2;" in stable.caption


def test_growth_that_refinement_removes_is_told():
    _, _, (found,) = run({"stable": True, "level": 0}, schemes=["forward_euler"], levels=[0, 1, 2])
    assert "grows at every step" in found.caption
    assert "falls to less than half from level 0 to 1" in found.caption
    # without a limit there are two panels
    assert len(found.figure.axes) == 2


def test_at_the_limit_the_size_decides():
    _, _, (found,) = run(
        {"stable": False},
        schemes=["central"],
        initial={"u": 1.0, "v": 1.0},
        time={"end": "300/pi", "base_dt": "1/pi"},
        levels=[0],
    )
    assert "at the limit 2" in found.caption
    assert "it has blown up" in found.caption


def test_a_prediction_for_a_nonlinear_model_is_that_of_small_oscillations():
    pendulum = {"model": {"kind": "pendulum"}, "initial": {"theta": 1.0}, "time": {"end": 40.0}}
    _, _, (found,) = run({"stable": True}, schemes=["central"], levels=[6, 7], **pendulum)
    assert "predicted for small oscillations" in found.caption
    assert len(bars(found)) == 1


def test_a_run_that_breaks_down_is_drawn_up_to_there():
    checks = [
        {"conserves": "energy", "drift": "bounded"},
        {"equal": ["central", "exact"], "quantity": "u", "atol": 1.0},
        {"stable": False},
    ]
    time = {"end": 400.0, "base_steps": 400}
    _, _, found = run(*checks, schemes=["central"], time=time, levels=[0])
    energy, equal, stable = found
    assert "it ends where the run breaks down" in energy.caption
    assert "then the run breaks down" in equal.caption
    assert "beyond the limit" in stable.caption


def test_what_is_not_stored_has_a_reason_for_no_picture():
    experiment, record, _ = run(KINDS["conserves"])
    told = samples.summary(experiment, record)["checks"]
    kept = {name: v for name, v in record.variables.items() if not name.endswith("running_max")}
    poor = replace(record, variables=kept)
    found = figure.picture(choice.of_check(poor, told[0]))
    assert samples.element(found) == ""
    assert "is not stored" in found.caption


@pytest.fixture
def lean(monkeypatch):
    """Let every experiment be so large that no series are kept."""
    monkeypatch.setattr("vibsim.experiment.storage.LEAN", 0)


@pytest.mark.parametrize("kind", BEHAVIOUR)
@pytest.mark.parametrize("count", [5, 100])
def test_without_series_the_members_are_drawn(lean, kind, count):
    sweep = {"initial.u": {"linspace": [0.5, 2.0, count]}}
    _, record, (found,) = run(KINDS[kind], sweep=sweep, samples="auto")
    assert record.attrs["storage"] == "lean"
    fields = ("window_means", "distance_over_time", "value_by_level")
    assert not any(name.endswith(fields) for name in record.variables)
    assert "size_over_exact" not in record
    assert len(dots(found, BLUE)) == 1
    assert len(dots(found, "white")) == (count if count == 5 else 0)
    assert f"all {count} members (no time series are kept)" in found.caption


def test_members_on_a_grid_are_numbered(lean):
    sweep = {"initial.u": [0.5, 1.0], "model.w": [1.0, 2.0]}
    _, _, (found,) = run({"stable": True}, sweep=sweep, samples="auto")
    assert "number of the member" in texts(found)


def test_members_that_are_spread_over_decades_have_a_logarithmic_axis(lean):
    sweep = {"initial.u": {"logspace": [1e-3, 1e3, 7]}}
    _, _, (found,) = run(KINDS["equal"], sweep=sweep, samples="auto")
    white = [x for x, _ in dots(found, "white")]
    assert found.figure.axes[0].get_xscale() == "log"
    assert np.diff(np.log(white)) == pytest.approx(np.diff(np.log(white))[0], abs=1e-9)


@pytest.mark.parametrize("kind", BEHAVIOUR)
def test_a_single_run_without_series_says_why_there_is_no_picture(lean, kind):
    _, _, (found,) = run(KINDS[kind], samples="auto")
    assert samples.element(found) == ""
    assert "keeps no time series" in found.caption


def test_the_frame_holds_every_mark():
    for kind in BEHAVIOUR:
        _, _, (found,) = run(KINDS[kind])
        for i, ax in enumerate(found.figure.axes):
            (left, right), (low, high) = ax.get_xlim(), ax.get_ylim()
            for x, y in dots(found, axes=i):
                assert left <= x <= right
                assert low <= y <= high
