"""Verdicts where the motion is not smooth: located events pass with their order, the mesh passes nothing falsely."""

from __future__ import annotations

import math
from collections import Counter
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from thinned import thinned
from whole import analysed, decided, simulated

from vibsim import Experiment, analyse, simulate, verdicts
from vibsim.analysis import analyse_records
from vibsim.core.vocabulary import REASON_NAMES

pytestmark = pytest.mark.usefixtures("without_series")

MEMBERS = 24
BOX = {"kind": "sliding_box", "mu": 0.05}
ORDERS: list[Any] = ["scheme", 2, 4]
SCHEMES: dict[str, Any] = {"rk4": "rk4", "mesh": {"kind": "rk4", "label": "mesh", "events": "mesh"}}


def experiment(**changes: Any) -> Experiment:
    return Experiment.from_dict(
        {
            "title": "t",
            "model": BOX,
            "time": {"end": 14.0},
            "levels": {"from": 6, "to": 10},
            "schemes": list(SCHEMES.values()),
            "checks": [{"converges": "u", "order": order} for order in ORDERS],
            **changes,
        }
    )


@cache
def reasons(scheme: str) -> dict[Any, Counter[str]]:
    """Return how often each reason was given to random members, by expected order."""
    sample = {"method": "random", "n": MEMBERS, "seed": 3}
    over = {"initial.u": [-2.0, 2.0], "initial.v": [-2.0, 2.0]}
    made = experiment(
        schemes=[SCHEMES[scheme]], sweep={"sample": {**sample, "over": over}}, samples="common"
    )
    record = analysed(made)
    return {
        order: Counter(
            REASON_NAMES[int(i)] for i in np.asarray(record[f"check_check_{k + 1}_reason"])[0]
        )
        for k, order in enumerate(ORDERS)
    }


@pytest.mark.slow
def test_located_events_pass_with_the_order_of_the_scheme() -> None:
    found = reasons("rk4")["scheme"]
    assert found == reasons("rk4")[4]
    assert found["asymptotic"] >= 0.9 * MEMBERS
    assert set(found) <= {"asymptotic", "pre_asymptotic"}
    # a wrong expectation is refuted, or open
    assert reasons("rk4")[2]["order_high"] > 0
    assert set(reasons("rk4")[2]) <= {"order_high", "pre_asymptotic"}


@pytest.mark.slow
def test_events_on_the_mesh_do_not_pass_by_chance() -> None:
    for order in ORDERS:
        found = reasons("mesh")[order]
        assert found["non_smooth"] >= 0.8 * MEMBERS, order
        # what is not irregular is of first order
        assert set(found) <= {"non_smooth", "asymptotic" if order == "scheme" else "order_low"}


BALL: dict[str, Any] = {"model": {"kind": "bouncing_ball"}, "initial": {"h": 1.0}}
WRONG = {"value": "event_count", "equals": 7}


@pytest.mark.parametrize(
    ("scheme", "check", "advice"),
    [
        ("rk4", WRONG, "Change `equals:`"),
        ("rk4", {**WRONG, "at": {"level": 6}}, "Change `equals:`"),
        ({"kind": "rk4", "events": "mesh"}, WRONG, "Set `events: located` for scheme rk4, or"),
    ],
)
def test_finer_levels_are_not_advised_where_they_count_the_same_bounces(
    scheme: Any, check: dict[str, Any], advice: str
) -> None:
    made = experiment(**BALL, time={"end": 5.0}, levels=[6, 7, 8], schemes=[scheme], checks=[check])
    (verdict,) = verdicts(made, analyse_records(made, simulated(made)))
    assert (verdict.status, verdict.reason) == ("FAIL", "mismatch")
    assert verdict.advice.startswith(advice)


@pytest.mark.slow
def test_the_verdict_says_what_to_change() -> None:
    made = experiment(initial={"u": 1.0, "v": 0.3})
    verdict = decided(made)[0]
    assert (verdict.status, verdict.reason) == ("INCONCLUSIVE", "non_smooth")
    assert "notices events only at grid points" in verdict.text
    assert verdict.advice == "Set `events: located` for scheme mesh."


@pytest.mark.slow
def test_members_whose_exact_solution_is_unknown_stand_beside_those_with_one() -> None:
    checks = [{"converges": "u", "order": 4}, {"converges": "v", "order": 4}]
    made = experiment(
        initial={"u": 1.0},
        schemes=["rk4"],
        sweep={"model.alpha": [0.0, 0.5]},
        checks=checks,
        levels={"from": 7, "to": 11},
    )
    assert [v.status for v in decided(made)] == ["PASS", "PASS"]


def test_a_ball_without_a_frequency_is_judged() -> None:
    model = {"kind": "bouncing_ball", "restitution": 0.7}
    checks = [
        {"converges": "h", "order": "scheme", "norm": "l2"},
        {"equal": ["rk4", "exact"], "quantity": "h", "atol": 1e-12},
        {"value": "rest_time", "at": {"scheme": "rk4"}, "below": 1e9},
    ]
    made = experiment(model=model, initial={"h": 1.0}, schemes=["rk4"], checks=checks)
    found = [(v.status, v.reason) for v in decided(made)]
    # parabolas are exact, and the ball moves by its whole height: an error would have been seen
    assert found == [("PASS", "exact"), ("PASS", "match"), ("PASS", "match")]


def test_the_treatment_of_events_can_be_swept_on_a_scheme_without_other_words() -> None:
    ball = {"kind": "bouncing_ball", "restitution": 0.5}
    sweep = {"schemes.rk4.events": ["located", "mesh"], "model.restitution": [0.0, 0.5]}
    checks = [{"value": "rest_time", "above": 0.0}]
    made = experiment(
        model=ball, initial={"h": 1.0}, schemes=["rk4"], sweep=sweep, checks=checks, levels=[5, 6]
    )
    record = analysed(made)
    assert record["schemes_rk4_events"].values.tolist() == ["located"] * 2 + ["mesh"] * 2
    (verdict,) = verdicts(made, record)
    assert verdict.status == "PASS"


def test_a_motion_without_a_frequency_is_told_without_one() -> None:
    experiment = Experiment.from_dict(
        {
            "title": "test",
            "model": {"kind": "bouncing_ball"},
            "initial": {"h": 1.0},
            "time": {"end": 4.0},
            "levels": [6],
            "schemes": ["rk4"],
            "checks": [{"stable": True}],
        }
    )
    (verdict,) = decided(experiment)
    assert verdict.status == "PASS"
    assert "nan" not in verdict.text


@pytest.mark.slow
@pytest.mark.parametrize("events", ["located", "mesh"])
def test_what_meets_no_event_has_the_order_of_a_smooth_motion(events: str) -> None:
    """The position of this scheme has order 2 until the first event, and the order of its velocity behind it."""
    scheme = {"kind": "euler_cromer_u_first", "start": "centred", "events": events}
    ends = [0.8, 14.0]
    initial = {"u": -0.4, "v": 0.0}
    swept = experiment(
        schemes=[scheme], initial=initial, sweep={"time.end": ends}, time={"end": 1.0}
    )
    record = analysed(swept)
    assert record["u_formal_order"].values.tolist() == [[2.0, 1.0]]
    found = verdicts(swept, record)
    asked = {order: verdict.results for order, verdict in zip(ORDERS, found, strict=True)}
    for order in ("scheme", 2):
        (first,) = (row for row in asked[order] if row.case == 0)
        assert (first.status, first.reason) == ("PASS", "asymptotic")
    expected = {row.case: row.facts["promised"] for row in asked["scheme"]}
    assert expected == {0: 2.0, 1: 1.0}


def test_levels_that_differ_by_more_than_the_motion_decide_nothing() -> None:
    """Forward Euler lifts a ball that rests at once by a hundred times its height, less with every level."""
    made = experiment(
        model={"kind": "bouncing_ball", "restitution": 0.4364},
        initial={"h": 4.479e-06, "v": -3.163e-06},
        time={"end": 19.99, "base_steps": 5},
        levels=[7, 8, 9, 10],
        schemes=["forward_euler"],
        checks=[{"converges": "h", "order": order} for order in ("scheme", 2)],
        samples="common",
    )
    found = verdicts(made, analyse_records(made, simulated(made)))
    assert {(one.status, one.reason) for one in found} == {("INCONCLUSIVE", "pre_asymptotic")}


def test_levels_that_notice_an_event_at_one_point_have_no_wrong_limit() -> None:
    """The impact at t = 1.7334 is noticed at the same point on every level, and so a little late on all of them."""
    scheme = {"kind": "velocity_verlet", "events": "mesh"}
    made = experiment(
        model={"kind": "bouncing_ball", "restitution": 0.4681},
        initial={"h": 0.0, "v": 0.8667},
        time={"end": 2.209},
        levels=[8, 9, 10, 11],
        schemes=[scheme],
        checks=[{"converges": "h"}],
    )
    (found,) = verdicts(made, analyse_records(made, simulated(made)))
    assert (found.status, found.reason) == ("INCONCLUSIVE", "non_smooth"), found.text
    assert "events: located" in found.advice


@pytest.mark.usefixtures("with_series")
def test_the_times_of_all_events_are_stored_of_every_level() -> None:
    made = experiment(**BALL, time={"end": 5.0}, levels=[6, 7], schemes=["rk4"], checks=[])
    levels = [simulate(made, level) for level in made.levels]
    record = analyse(made, levels)
    assert record["event_time"].dims == ("scheme", "case", "level", "event")
    kept = record.sizes["event"]
    for i, level in enumerate(levels):
        count = int(level.event_count[0, 0])
        # impact k is at sqrt(2) (1 + 2 (0.8 + ... + 0.8^(k - 1)))
        impacts = 2.0**0.5 * (1.0 + 2.0 * np.cumsum([0.0, *0.8 ** np.arange(1, count)]))
        times = level["event_time"][0, 0]
        np.testing.assert_allclose(times[:count], impacts, rtol=1e-13)
        assert np.isnan(times[count:]).all()
        np.testing.assert_array_equal(record["event_time"][0, 0, i, :kept], times)


BEADS = Path(__file__).parents[3] / "configs" / "showcase" / "two_beads.yaml"


def impact(number: int) -> float:
    """Return when the two beads strike each other, from the sinusoid of their distance."""
    gap, e, size, t = 0.5, 0.9, 2.0, 0.0
    for _ in range(number):
        t += math.acos(gap / size)
        before, size = t, math.hypot(gap, e * math.sqrt(size**2 - gap**2))
        t += math.acos(gap / size)
    return before


def beads(schemes: list[Any], checks: list[dict[str, Any]]) -> Experiment:
    content = yaml.safe_load(BEADS.read_text(encoding="utf-8"))
    return Experiment.from_dict(content | {"schemes": schemes, "checks": checks})


def time_of(number: int, **asked: float) -> dict[str, Any]:
    return {"value": "event_time", "at": {"event": number, "level": "best"}, **asked}


def test_the_time_of_an_event_has_an_error_from_the_levels() -> None:
    t = impact(3)
    checks = [
        time_of(3, equals=t, atol=1e-7),
        time_of(3, equals=t + 1e-3, atol=1e-7),
        # it agrees, but by chance as far as the levels tell
        time_of(3, equals=t, atol=1e-13),
        time_of(3, below=t + 1e-12),
        time_of(3, above=t - 1e-3),
        time_of(4, equals=t, atol=1e-7),
        {"value": "event_time", "at": {"event": 2, "level": 9}, "equals": impact(2), "atol": 1e-8},
    ]
    made = beads(["rk4"], checks)
    record = analysed(made)
    found = verdicts(made, record)
    assert [(v.status, v.reason) for v in found] == [
        ("PASS", "match"),
        ("FAIL", "mismatch"),
        ("INCONCLUSIVE", "pre_asymptotic"),
        ("INCONCLUSIVE", "pre_asymptotic"),
        ("PASS", "match"),
        ("INCONCLUSIVE", "not_applicable"),
        ("PASS", "match"),
    ], [v.text for v in found]
    value, bound = (float(record[f"check_check_1_{w}"][0, 0]) for w in ("value", "error_bound"))
    assert abs(value - t) <= bound < 1e-7
    assert "event_time of event 3 is" in found[0].text
    assert "fewer events happen" in found[5].text


def test_a_body_that_does_not_rest_is_said_to_move_at_the_end() -> None:
    """More samples were advised."""
    checks = [{"value": name, "below": 9.0} for name in ("rest_time", "last_event_time")]
    made = beads(["rk4"], checks)
    rest, last = decided(made)
    assert (rest.status, rest.reason) == ("INCONCLUSIVE", "not_applicable")
    assert "the body moves at the end" in rest.text
    assert "samples" not in rest.advice
    assert last.reason != "not_applicable"


def test_the_time_of_an_event_on_the_mesh_is_not_trusted() -> None:
    near = [time_of(3, equals=impact(3), atol=0.5), time_of(3, equals=9.0, atol=0.5)]
    made = beads([SCHEMES["mesh"]], near)
    found = verdicts(made, analyse_records(made, simulated(made)))
    for verdict in found:
        assert (verdict.status, verdict.reason) == ("INCONCLUSIVE", "pre_asymptotic")
        assert "events are left to the mesh" in verdict.text
        assert "events: located" in verdict.advice


def test_an_event_that_the_mesh_moves_across_the_end_asks_for_located_events() -> None:
    """Another end would not help: a ball on a moving table has five impacts on three levels, and four on the finest."""
    data = {
        "title": "x",
        "model": {
            "kind": "oscillator",
            "spring": "1 + 0*u",
            "potential": "u",
            "events": [
                {
                    "when": "u - 0.1*sin(3*t)",
                    "falling": True,
                    "then": {"v": "0.3*cos(3*t) - 0.6*(v - 0.3*cos(3*t))"},
                }
            ],
        },
        "initial": {"u": 0.5},
        "time": {"end": 2.7, "base_steps": 50},
        "levels": [1, 2, 3, 4],
        "schemes": [{"kind": "rk4", "label": "mesh", "events": "mesh"}],
        "checks": [
            {"value": "end", "quantity": name, "equals": 0.4, "atol": 1e-6}
            for name in ("dissipated_energy", "v")
        ],
    }
    made = Experiment.from_dict(data)
    records = [simulate(made, level) for level in made.levels]
    assert [int(r.event_count[0, 0]) for r in records] == [5, 5, 5, 4]
    for verdict in verdicts(made, analyse(made, records)):
        assert verdict.status == "INCONCLUSIVE"
        assert "because events are left to the mesh" in verdict.text
        assert verdict.advice == "Set `events: located` for scheme mesh."


@pytest.mark.parametrize("kind", thinned(["central", "heun", "gauss4", "ab3", "forward_euler"], 3))
def test_the_bounds_of_the_times_of_events_hold(kind: str) -> None:
    made = beads([kind], [time_of(k, above=0.0) for k in (1, 2, 3)])
    record = analysed(made)
    for k in (1, 2, 3):
        value, bound = (
            float(record[f"check_check_{k}_{w}"][0, 0]) for w in ("value", "error_bound")
        )
        assert abs(value - impact(k)) <= bound < 0.2


def test_a_large_sweep_keeps_the_times_that_checks_ask_for(monkeypatch: pytest.MonkeyPatch) -> None:
    made = beads(["rk4"], [time_of(2, equals=impact(2), atol=1e-7)])
    monkeypatch.setattr("vibsim.experiment.storage.LEAN", 0)
    levels = [simulate(made, level) for level in made.levels]
    assert levels[0].sizes["event"] == 2
    assert verdicts(made, analyse(made, levels))[0].status == "PASS"


def test_levels_that_share_the_point_beside_an_impact_do_not_bound_an_extremum() -> None:
    """A ball falls from 1, exactly: its lowest point is 0, but every level has the same point, above it."""
    ball = {
        "kind": "system",
        "coordinates": ["x", "y"],
        "acceleration": {"x": 0, "y": "-g"},
        "parameters": {"g": 1.0},
        "events": [{"when": "y", "falling": True, "then": {"vy": "-0.9*vy"}}],
    }
    experiment = Experiment.from_dict(
        {
            **{"title": "x", "model": ball, "initial": {"x": 0, "vx": 1, "y": 0.5, "vy": 0.7}},
            "time": {"end": math.sqrt(1.49) + 0.7 + 0.001, "base_steps": 1},
            **{"levels": [4, 5, 6, 7], "schemes": ["rk4"]},
            "checks": [
                {"value": "min", "quantity": "y", "at": {"level": "best"}, "above": 1e-6},
                {"value": "max", "quantity": "y", "at": {"level": "best"}, "equals": 0.745},
            ],
        }
    )
    lowest, highest = decided(experiment)
    assert lowest.status == "INCONCLUSIVE"
    assert highest.status == "PASS"


def test_a_motion_that_ends_has_its_lowest_point_at_its_end() -> None:
    thrown = {
        "kind": "system",
        "coordinates": ["x", "y"],
        "acceleration": {"x": 0, "y": -1},
        "stop": "y < -x/2",
    }
    experiment = Experiment.from_dict(
        {
            **{"title": "x", "model": thrown, "initial": {"vx": 1, "vy": 2}, "time": {"end": 6}},
            **{"levels": [3, 4, 5, 6], "schemes": ["rk4"]},
            "checks": [
                {"value": "min", "quantity": "y", "at": {"level": "best"}, "below": -2.4999999},
                {"value": "max", "quantity": "y", "at": {"level": "best"}, "above": 1.9999999},
            ],
        }
    )
    assert [verdict.status for verdict in decided(experiment)] == ["PASS", "PASS"]
