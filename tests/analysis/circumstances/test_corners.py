"""Verdicts where the motion meets corners of the force within steps: the power that each leaves, and the place."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from thinned import thinned
from whole import analysed, simulated

from vibsim import Experiment, Verdict, analyse, simulate, verdicts
from vibsim.analysis import analyse_records
from vibsim.apriori.force_discontinuities import switches_of, words_of
from vibsim.schemes import FIXED_STEP, SCHEMES

pytestmark = pytest.mark.usefixtures("without_series")

QUADRATIC = {"kind": "oscillator", "damping": {"quadratic": 0.5}}


def experiment(schemes: list[Any], **changes: Any) -> Experiment:
    content = {
        "title": "t",
        "model": QUADRATIC,
        "initial": {"u": 1.0},
        "time": {"end": 20.0},
        "levels": [8, 9, 10, 11, 12],
        "schemes": schemes,
        "samples": "common",
        "checks": [
            {"id": name, "converges": "u", "order": "scheme", "schemes": [name]} for name in schemes
        ],
        **changes,
    }
    return Experiment.from_dict(content)


def judged(made: Experiment) -> list[Verdict]:
    return list(verdicts(made, analyse_records(made, simulated(made))))


TREATED = [
    kind for kind in FIXED_STEP if SCHEMES[kind].treats(experiment(["rk4"]).model.definition)
]


@pytest.mark.slow
def test_every_scheme_on_quadratic_damping() -> None:
    """Orders up to 3 show; a higher one does not, and the place of the first turn is named."""
    made = experiment(TREATED)
    model = made.model.definition
    for kind, verdict in zip(TREATED, judged(made), strict=True):
        scheme = SCHEMES[kind]
        if scheme.formal_order("u", model, scheme.defaults()) <= 3.0:
            assert (verdict.status, verdict.reason) == ("PASS", "asymptotic"), verdict.text
        else:
            assert verdict.status == "INCONCLUSIVE"
            # the finest levels of gauss4 reach round-off
            assert verdict.reason in ("non_smooth", "round_off")


@pytest.mark.parametrize("scheme", ["rk4", "gauss4"])
def test_the_place_of_the_corner_is_named(scheme: str) -> None:
    (verdict,) = judged(experiment([scheme], levels=[6, 7, 8, 9]))
    assert (verdict.status, verdict.reason) == ("INCONCLUSIVE", "non_smooth")
    assert "at t = 3.22" in verdict.text
    assert "the velocity v passes zero" in verdict.text
    assert "Expect order 3" in verdict.text
    assert "before t = 3.22" in verdict.advice


@pytest.mark.parametrize("levels", [[4, 5, 6], [5, 6, 7], [6, 7, 8], [4, 5, 6, 7], [5, 6, 7, 8]])
def test_levels_that_show_no_order_yet_are_told_of_the_corner(levels: list[int]) -> None:
    """Finer ones show its order, not that of the scheme: none are asked for."""
    model = {"kind": "oscillator", "damping": "d*v*abs(v)", "parameters": {"d": 0.1}}
    (verdict,) = judged(experiment(["rk4"], model=model, time={"end": 10.0}, levels=levels))
    assert (verdict.status, verdict.reason) == ("INCONCLUSIVE", "non_smooth"), verdict.text
    assert "Expect order 3" in verdict.text
    assert "before t = 3.1" in verdict.advice
    assert "Add level" not in verdict.advice


def test_levels_that_are_too_coarse_for_the_order_of_the_corner_are_asked_for() -> None:
    """The order of the scheme is the one that the corner leaves: finer levels show it."""
    (verdict,) = judged(experiment(["rk3"], levels=[4, 5, 6]))
    assert verdict.reason == "pre_asymptotic", verdict.text
    assert "Add level" in verdict.advice


def test_before_the_first_turn_the_order_is_that_of_the_scheme() -> None:
    made = experiment(["rk4"], time={"end": 3.0}, levels=[5, 6, 7, 8])
    record = analysed(made)
    assert np.isnan(record["corner_time"]).all()
    assert [(v.status, v.reason) for v in verdicts(made, record)] == [("PASS", "asymptotic")]


def test_an_order_below_that_of_the_corner_is_not_excused() -> None:
    """A second-order scheme of which the fourth order is expected: the corner of quadratic damping leaves the third."""
    check = {"converges": "u", "order": 4, "schemes": ["rk2"]}
    (verdict,) = judged(experiment(["rk2"], checks=[check], levels=[8, 9, 10, 11]))
    assert (verdict.status, verdict.reason) == ("FAIL", "order_low")


def test_an_accident_of_three_levels_beside_a_corner_is_no_lower_order() -> None:
    """Errors fall like dt, then at once: the last local orders are near 1, while a power of 2.5 is believed."""
    model = {
        "kind": "oscillator",
        "m": 1.0,
        "spring": "u + 2*abs(u)",
        "damping": {"linear": 0.1},
    }
    made = experiment(
        ["rk3"],
        model=model,
        initial={"u": 1.0, "v": 0.4},
        time={"end": 3.0},
        levels=[9, 10, 11, 12, 13, 14],
    )
    (verdict,) = judged(made)
    assert (verdict.status, verdict.reason) == ("INCONCLUSIVE", "non_smooth"), verdict.text


def corner(model: dict[str, Any], **changes: Any) -> tuple[float, float, str]:
    """Return time, power and words of the first corner."""
    made = experiment(
        ["velocity_verlet" if "damping" not in model else "rk4"], model={"kind": "oscillator", **model},
        checks=[], levels=[7, 10], **changes,
    )  # fmt: skip
    record = analysed(made)
    index = int(record["corner_switch"][0, 0])
    words = words_of(made.model.definition, index) if index >= 0 else ""
    return float(record["corner_time"][0, 0]), float(record["corner_power"][0, 0]), words


@pytest.mark.parametrize(
    ("model", "time", "power", "words"),
    [
        ({"damping": "0.1*abs(v)*v"}, math.pi, 3.0, "the velocity v passes zero"),
        ({"damping": "v*v*abs(v)*v/99"}, math.pi, 5.0, "the velocity v passes zero"),
        ({"spring": "u + abs(u)/1000"}, math.pi / 2, 2.0, "u passes zero"),
        ({"spring": "u + sign(u)/1000"}, math.pi / 2, 1.0, "u passes zero"),
        ({"spring": "u + max(u - 0.5, 0)/1000"}, math.pi / 3, 2.0, "u - 0.5 passes zero"),
        # a contact of two balls, which the motion leaves and which it enters
        ({"spring": "u + max(u - 0.5, 0)**1.5/1000"}, math.pi / 3, 2.5, "u - 0.5 passes zero"),
        ({"spring": "u + max(-u, 0)**1.5/1000"}, math.pi / 2, 2.5, "u passes zero"),
        ({"force": "heaviside(t - 3.01)"}, 3.01, 1.0, "t - 3.01 passes zero"),
        ({"force": "max(t - 3.01, 0)**3"}, 3.01, 4.0, "t - 3.01 passes zero"),
        ({"force": "mod(t, 1.7)/9"}, 1.7, 1.0, "t/1.7 passes a whole number"),
        ({"force": "1 if mod(t, 1.7) < 0.9 else 0"}, 0.9, 1.0, "a condition in the formula"),
        ({"spring": "u + max(u - 2, 0)"}, math.nan, math.nan, ""),
        # grid points of the coarsest level: jumps alone matter there
        ({"force": "heaviside(t - 5)"}, 5.0, 1.0, "t - 5 passes zero"),
        ({"force": "1 if t < 5 else 0"}, 5.0, 1.0, "passes zero"),
        ({"force": "heaviside(t)"}, 0.0, 1.0, "t passes zero"),
        ({"force": "max(t - 5, 0)"}, math.nan, math.nan, ""),
        ({"force": "max(t - 5, 0) + heaviside(t - 7.01)"}, 7.01, 1.0, "t - 7.01 passes zero"),
        ({"force": "heaviside(t - 5) + heaviside(t - 4.01)"}, 4.01, 1.0, "t - 4.01 passes zero"),
        ({"force": "heaviside(t - 5) + heaviside(t - 7.01)"}, 5.0, 1.0, "t - 5 passes zero"),
        # both sides are the same
        ({"spring": "u + max(u, 0) + min(u, 0)"}, math.nan, math.nan, ""),
    ],
)
def test_the_power_that_a_corner_leaves(
    monkeypatch: pytest.MonkeyPatch, model: dict[str, Any], time: float, power: float, words: str
) -> None:
    # a corner is found in what the levels computed, without a reference solution
    monkeypatch.setattr("vibsim.experiment.storage.MOST_REFERENCES", 0)
    found = corner(model)
    assert found[0] == pytest.approx(time, abs=0.02, nan_ok=True)
    assert found[1] == pytest.approx(power, nan_ok=True)
    assert words in found[2]


@pytest.mark.parametrize("scheme", ["rk4", "yoshida4"])
def test_a_contact_leaves_a_broken_power_by_every_scheme(scheme: str) -> None:
    """It was a corner for one and a jump of a derivative for the other."""
    made = experiment(
        [scheme],
        model={"kind": "oscillator", "spring": "u + max(u - 0.2, 0)**1.5"},
        initial={"u": -1.0},
        time={"end": 4.0, "base_steps": 10},
        levels=[3, 4, 5, 6, 7],
    )
    (verdict,) = judged(made)
    assert verdict.reason == "non_smooth"
    assert "the force changes like the power 1.5 of the distance within a step" in verdict.text
    assert "Expect order 2.5" in verdict.text


def test_a_smooth_force_has_no_corners() -> None:
    made = experiment(["rk4"], model={"kind": "oscillator", "spring": "sin(u)"}, levels=[4, 5])
    assert not switches_of(made.model.definition)
    assert "corner_time" not in analysed(made)


def test_members_of_a_sweep_have_their_own_corner() -> None:
    sweep = {"initial.v": [-0.5, 0.0, 0.5, -2.0]}
    made = experiment(["rk4"], sweep=sweep, checks=[], levels=[7, 9], time={"end": 2.5})
    record = analysed(made)
    times = record["corner_time"].values[0]
    assert np.isnan(times).tolist() == [True, True, False, False]
    assert 0.3 < times[2] < 0.5
    for case in range(4):
        alone = analyse(made.alone(case), [simulate(made.alone(case), lv) for lv in made.levels])
        assert alone["corner_time"].values[0, 0] == pytest.approx(times[case], nan_ok=True)


@pytest.mark.usefixtures("with_series")
def test_a_velocity_that_an_event_turns_has_passed_no_corner() -> None:
    event = {"when": "u", "falling": True, "then": {"v": "-0.75*v"}}
    ball = {**QUADRATIC, "spring": "g", "parameters": {"g": 9.81}, "events": [event]}
    # it falls from rest, bounces at 0.75 and turns at the top at 1.07
    made = experiment(["rk4"], model=ball, initial={"u": 2.0}, time={"end": 1.2})
    convergence = analysed(made)
    bounce, turn = convergence.event_time.values[0, 0, -1, 0], convergence.corner_time.item()
    assert bounce == pytest.approx(0.7532, abs=0.01)
    assert turn > bounce + 0.1


@pytest.mark.usefixtures("with_series")
@pytest.mark.parametrize(
    ("acceleration", "then", "jumps"),
    [
        ("-sin(0.25*sign(u) - u)", {"v": "0.9*v"}, True),
        ("-sin(0.25*sign(u) - u)", {"u": "u - 0.1"}, False),
        ("-0.2 - abs(u)", {"v": "0.9*v"}, False),
    ],
)
def test_a_force_that_jumps_where_an_event_is_has_a_corner(
    acceleration: str, then: dict[str, str], *, jumps: bool
) -> None:
    """A rocking block: steps end at the impact, but rounding and stages decide on which side the force is taken."""
    model = {
        **{"kind": "system", "acceleration": acceleration},
        "events": [{"when": "u", "falling": True, "then": then}],
    }
    time, power, what = corner(model, initial={"u": 0.15}, time={"end": 2.5})
    if jumps:
        assert (time, power, what) == (pytest.approx(1.5690, abs=0.02), 1.0, "u passes zero")
    else:
        assert (math.isnan(time), math.isnan(power), what) == (True, True, "")


def test_a_turn_with_friction_is_an_event_and_no_corner_within_a_step() -> None:
    """Steps end where friction turns; a ladder that is too coarse is not blamed on it. The driving force may jump."""
    box = {"kind": "sliding_box", "mu": 0.3}
    coarse = experiment(["rk4"], model=box, initial={"u": 0.4, "v": 1.0}, levels=[3, 4, 5, 6])
    (verdict,) = judged(coarse)
    assert verdict.reason == "pre_asymptotic", verdict.text
    driven = corner({"damping": {"coulomb": 0.1}, "force": "heaviside(t - 3.01)"})
    assert driven[0] == pytest.approx(3.01, abs=0.02)
    assert driven[2] == "t - 3.01 passes zero"


@pytest.mark.parametrize("scheme", ["rk4", "central"])
def test_a_jump_at_a_grid_point_is_named(scheme: str) -> None:
    """A step that begins there and one that ends there take the same value, which is wrong for one of them."""
    made = experiment(
        [scheme],
        model={"kind": "oscillator", "force": "1 if t < 1 else 0"},
        time={"end": 2.0},
        levels=[4, 5, 6, 7],
    )
    (verdict,) = judged(made)
    assert (verdict.status, verdict.reason) == ("INCONCLUSIVE", "non_smooth")
    assert "the force jumps at a grid point (" in verdict.text


def test_the_mean_of_both_sides_keeps_order_2_of_central() -> None:
    made = experiment(
        ["central"],
        model={"kind": "oscillator", "force": "heaviside(t - 1)"},
        time={"end": 2.0},
        levels=[4, 5, 6, 7],
    )
    (verdict,) = judged(made)
    assert (verdict.status, verdict.reason) == ("PASS", "asymptotic")


@pytest.mark.slow
@pytest.mark.parametrize(
    "content",
    [
        {
            "model": {"kind": "oscillator", "spring": "k*u+abs(u)*u", "parameters": {"k": 0.962}},
            "initial": {"u": 0.846},
            "time": {"end": 15.65},
            "levels": [9, 10, 11],
            "schemes": ["gauss4"],
        },
        {
            "model": {
                "kind": "oscillator",
                "force": "max(t-a,0)",
                "spring": "k*u",
                "parameters": {"k": 1.932, "a": 3.632},
            },
            "initial": {"u": -0.988},
            "time": {"end": 10, "base_steps": 5},
            "levels": [9, 10, 11, 12],
            "schemes": ["pefrl"],
        },
    ],
)
def test_differences_that_a_corner_makes_unlike_each_other_are_no_round_off(
    content: dict[str, Any],
) -> None:
    checks = [{"converges": "u"}]
    (found,) = judged(Experiment.from_dict({"title": "t", **content, "checks": checks}))
    assert (found.status, found.reason) == ("INCONCLUSIVE", "non_smooth")
    assert " at t = " in found.text


JUMPS = {
    "title": "t",
    "model": {"kind": "oscillator", "spring": "u", "force": "heaviside(t - 3.3)"},
    "initial": {"u": 1.0},
    "time": {"end": 10.0},
    "schemes": ["rk4", "central"],
    "checks": [{"converges": "u", "order": 1}, {"converges": "v", "order": 1}],
}


@pytest.mark.parametrize("levels", thinned([[4, 8], [4, 12], [6, 11]], 2))
def test_a_jump_within_a_step_makes_no_wrong_limit(levels: list[int]) -> None:
    """Differences may show order 1 by accident, with errors that belong to another place of the jump in its step."""
    made = Experiment.from_dict(JUMPS | {"levels": {"from": levels[0], "to": levels[1]}})
    reasons = {result.reason for verdict in judged(made) for result in verdict.results}
    assert reasons <= {"asymptotic", "non_smooth", "pre_asymptotic"}


@pytest.mark.slow
@pytest.mark.usefixtures("with_series")
def test_a_wrong_limit_is_seen_beside_a_jump() -> None:
    made = Experiment.from_dict(JUMPS | {"levels": [4, 5, 6, 7, 8], "schemes": ["rk4"]})
    data = [simulate(made, level) for level in made.levels]
    for level in data:
        level["u"] = level["u"] + 0.1 * level["t"]
    (found, _) = verdicts(made, analyse(made, data))
    assert (found.status, found.reason) == ("FAIL", "wrong_limit")


@pytest.mark.parametrize("scheme", ["ab2", "forward_euler"])
def test_a_jump_in_the_last_step_makes_no_wrong_limit(scheme: str) -> None:
    """A scheme that looks at the beginning of its steps alone knows nothing of it on any level."""
    made = experiment(
        [scheme],
        model={"kind": "oscillator", "force": "heaviside(t - 1.7)"},
        time={"end": 1.736, "base_steps": 3},
        levels=[1, 2, 3, 4],
        checks=[{"converges": "v", "norm": "linf"}],
    )
    (found,) = judged(made)
    assert (found.status, found.reason) == ("INCONCLUSIVE", "non_smooth"), found.text
    assert "t = 1.7" in found.text


@pytest.mark.slow
@pytest.mark.usefixtures("with_series")
def test_a_jump_beside_a_point_of_all_levels_makes_no_wrong_limit() -> None:
    """It lies 0.005 of a step behind a point of level 10 and of every finer one: all of them take it to be there."""
    made = experiment(
        ["gauss4"],
        model={"kind": "oscillator", "damping": {"linear": 0.2}, "force": "heaviside(t - 1.7)/4"},
        time={"end": 21.49},
        levels=[9, 10, 11, 12, 13],
        checks=[{"converges": "u", "norm": "l1"}],
    )
    (found,) = judged(made)
    assert (found.status, found.reason) == ("INCONCLUSIVE", "non_smooth"), found.text


def test_a_corner_beside_a_point_of_all_levels_is_no_lower_order() -> None:
    """It lies 0.003 behind a point of every level, so errors fall like 0.003 dt until steps are as short as that."""
    model = {"kind": "oscillator", "force": "5*max(t - 1.003, 0)"}
    checks = [{"id": str(p), "converges": "u", "order": p} for p in ("scheme", 1)]
    made = experiment(
        ["rk4"], model=model, time={"end": 8.0}, levels=[6, 7, 8, 9, 10], checks=checks
    )
    for verdict in judged(made):
        assert (verdict.status, verdict.reason) == ("INCONCLUSIVE", "non_smooth"), verdict.text
        (row,) = verdict.results
        assert row.order == pytest.approx(1.0, abs=0.2)


def test_the_roughest_corner_counts_not_the_first() -> None:
    """Quadratic damping has a corner at each turn from t = 3.2 on, which leaves order 3; the force jumps at t = 7.3."""
    model = {**QUADRATIC, "force": "heaviside(t - 7.3)"}
    made = experiment(["heun", "rk4"], model=model, levels=[7, 8, 9, 10])
    record = analysed(made)
    assert np.asarray(record["corner_power"]).ravel().tolist() == [1.0, 1.0]
    assert np.asarray(record["corner_time"]).ravel() == pytest.approx([7.3, 7.3])
    for verdict in verdicts(made, record):
        assert (verdict.status, verdict.reason) == ("INCONCLUSIVE", "non_smooth"), verdict.text


@pytest.mark.slow
@pytest.mark.parametrize(("load", "power"), [("heaviside(t - 1.7)", 1.0), ("max(t - 1.7, 0)", 2.0)])
def test_corners_of_the_load_of_a_structure_are_known(load: str, power: float) -> None:
    model = {"kind": "structure", "stiffness": [[2, -1], [-1, 2]], "load": {2: load}}
    made = experiment(["newmark"], model=model, initial={}, checks=[{"converges": "u1"}])
    record = analysed(made)
    assert np.asarray(record["corner_power"]).item() == power
    assert np.asarray(record["corner_time"]).item() == pytest.approx(1.7)


def test_a_pulse_of_the_load_of_a_structure_that_no_level_sees_is_known() -> None:
    model = {
        "kind": "structure",
        "stiffness": [[2, -1], [-1, 2]],
        "load": {1: "1e4*exp(-((t - 7.3)/1e-5)**2)"},
    }
    checks = [{"converges": "u1"}]
    made = experiment(["newmark"], model=model, initial={}, levels=[7, 8, 9], checks=checks)
    (verdict,) = judged(made)
    assert (verdict.status, verdict.reason) == ("INCONCLUSIVE", "pre_asymptotic"), verdict.text
    assert "pulse" in verdict.text


@pytest.mark.parametrize(
    ("force", "place"),
    [
        ("abs(t - 1)**1.5", "at a grid point (t - 1 passes zero at t = 1)"),
        ("max(t - 1, 0)**1.5 - u", "at a grid point (t - 1 passes zero at t = 1)"),
        # the start is a grid point of every level
        ("abs(u - 0.25)**1.5", "at a grid point (u - 0.25 passes zero at t = 0)"),
        ("abs(0.25 - u)**1.5", "at a grid point (0.25 - u passes zero at t = 0)"),
        # no formula of this power goes on behind the corner
        ("cos(3*t) - abs(u - 0.75)**1.5", "within a step (u - 0.75 passes zero at t = "),
        (
            "sin(t) + sign(t - 1.3)*abs(t - 1.3)**1.5",
            "within a step (t - 1.3 passes zero at t = 1.3)",
        ),
    ],
)
def test_a_broken_power_counts_within_steps_and_at_grid_points(force: str, place: str) -> None:
    model = {"kind": "system", "coordinates": {"u": {"acceleration": force}}}
    times = {"initial": {"u": 0.25, "v": 1.0}, "time": {"end": 2.0, "base_steps": 4}}
    made = experiment(["rk4"], model=model, levels=[2, 3, 4, 5, 6], **times)
    (verdict,) = judged(made)
    assert (verdict.status, verdict.reason) == ("INCONCLUSIVE", "non_smooth"), verdict.text
    assert "the force changes like the power 1.5 of the distance" in verdict.text
    assert place in verdict.text
    assert "Expect order 2.5" in verdict.text
    assert ("before t = " in verdict.advice) == ("t = 0)" not in verdict.text)
    if "grid point" in place:
        assert "Set `order: 2.5`" in verdict.advice


@pytest.mark.parametrize(
    "force", ["abs(t - 1)**3", "abs(t - 1)**1.5*abs(t - 1)**0.5 - u", "cos(abs(t - 1.3))"]
)
def test_a_force_that_is_smooth_on_both_sides_of_a_grid_point_keeps_its_order(force: str) -> None:
    model = {"kind": "system", "coordinates": {"u": {"acceleration": force}}}
    times = {"initial": {"u": 0.25, "v": 1.0}, "time": {"end": 2.0, "base_steps": 4}}
    made = experiment(["rk4"], model=model, levels=[2, 3, 4, 5, 6], **times)
    (verdict,) = judged(made)
    assert (verdict.status, verdict.reason) == ("PASS", "asymptotic"), verdict.text
