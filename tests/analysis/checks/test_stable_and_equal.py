"""Checks of stability and equality, exact quantities, and a scheme that is wrong: each verdict is provoked."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from ladders import T, facts_of
from spring_runs import PERIODS, STEPS, judged, registered, spring

from vibsim.checks.stable import _is_removed, first_within
from vibsim.comparison import solution_distance
from vibsim.convergence.verdict import judge
from vibsim.core.record import Variable
from vibsim.core.vocabulary import REASON_NAMES
from vibsim.experiment import Experiment
from vibsim.schemes import SCHEMES
from vibsim.schemes.base import Orders
from vibsim.schemes.runge_kutta import Tableau, from_tableau
from vibsim.simulation import simulate_record
from vibsim.theory import rounding_bound

LIMIT = 2.0


def at_limit(over: float) -> dict[str, float]:
    """Return the time section with w dt = `over` times the limit of the centred scheme at level 0."""
    return {"end": STEPS * LIMIT * over / (2 * np.pi), "base_steps": STEPS}


def test_just_above_the_limit_the_growth_is_the_predicted_one() -> None:
    checks = [{"stable": False, "level": 0}, {"stable": True, "level": 0}, {"stable": True}]
    run = spring(["central"], *checks, {"converges": "u"}, levels=(0, 1, 2), time=at_limit(1.001))
    at, wrong, finest, ladder = run.verdicts
    assert (at.status, at.reason) == ("PASS", "match")
    assert (wrong.status, wrong.reason) == ("FAIL", "unstable")
    assert (finest.status, finest.reason) == ("PASS", "match")
    assert (ladder.status, ladder.reason) == ("FAIL", "unstable")
    # u = (-r)^n with r + 1/r = p^2 - 2, and 2 pi/p steps to a period
    p = LIMIT * 1.001
    root = np.arccosh(p * p / 2 - 1)
    predicted = run.record["theory_growth"][0, 0, 0]
    assert predicted == pytest.approx(np.exp(root * 2 * np.pi / p), rel=1e-9)
    measured = run.record["measured_growth"][0, 0, 0]
    # both roots are there at first: ln 2 of the whole
    periods = STEPS * p / (2 * np.pi)
    assert np.log(measured / predicted) == pytest.approx(0.0, abs=np.log(4) / periods)
    for text in (at.text, ladder.text):
        assert f"{predicted:.6g} (predicted)" in text
        assert f"{measured:.6g} (measured)" in text


def test_damping_beyond_a_limit_is_no_stability() -> None:
    """``c dt`` is 5 at level 3, beyond the real limit 2.785 of RK4; w dt is 0.05. Forward Euler's growth stays none."""
    content = {
        **{
            "title": "test",
            "model": {"kind": "oscillator", "spring": "u", "damping": {"linear": 100}},
        },
        **{"initial": {"u": 1.0}, "time": {"end": 2.0, "base_steps": 5}, "schemes": ["rk4"]},
        **{"levels": [3, 4, 5], "checks": [{"stable": True, "level": n} for n in (3, 4)]},
    }
    experiment = Experiment.from_dict(content)
    run = judged(experiment, {n: simulate_record(experiment, n) for n in experiment.levels})
    assert [v.reason for v in run.verdicts] == ["unstable", "match"]
    assert "times as large as the exact one" in run.verdicts[0].text
    time = {"end": 40.0, "base_steps": 2000}
    grows = spring(["forward_euler"], {"stable": True, "level": 0}, levels=(0, 1, 2), time=time)
    assert grows.record["check_check_1_excess"][0, 0] > 1000.0
    assert grows.verdicts[0].reason == "match"


@pytest.mark.parametrize(
    ("scheme", "over", "stable"),
    [("central", 1.0, True), ("euler_cromer", 1.0, False), ("central", 0.99, True)],
)
def test_at_the_limit_the_measurement_decides(scheme: str, over: float, stable: bool) -> None:
    # plain Euler-Cromer has u^n = (-1)^n (1 + 2 n) I at w dt = 2
    run = spring([scheme], {"stable": stable}, {"stable": not stable}, time=at_limit(over))
    assert [v.status for v in run.verdicts] == ["PASS", "FAIL"]


def test_growth_that_vanishes_with_dt_is_no_instability() -> None:
    run = spring(["forward_euler"], {"stable": True, "level": 0}, levels=(0, 1, 2))
    assert float(run.record["measured_growth"][0, 0, 0]) > 1.3
    assert run.verdicts[0].status == "PASS"
    assert run.record["stability_limit"][0, 0] == 0.0
    assert "This growth of " in run.verdicts[0].text
    assert "per period vanishes with dt" in run.verdicts[0].text


def test_a_factor_near_one_shows_its_growth() -> None:
    checks = [{"stable": True, "schemes": [name], "level": 2} for name in ("rk2", "rk4", "central")]
    run = spring(["rk2", "rk4", "central"], *checks, levels=(0, 1, 2))
    predicted = run.record["theory_growth"][:, 0, 2]
    grows, decays, neither = (verdict.text for verdict in run.verdicts)
    assert f"per period is 1 + {predicted[0] - 1:.3g} (predicted)" in grows
    assert f"This growth of {predicted[0] - 1:.3g} per period" in grows
    assert f"per period is 1 - {1 - predicted[1]:.3g} (predicted)" in decays
    assert "per period is 1 (predicted) and 1 (measured)." in neither
    assert "vanishes" not in decays + neither


def test_only_at_a_limit_that_there_is_growth_is_said_to_be_in_proportion_to_the_time() -> None:
    words = "the amplitude grows in proportion to the time"
    check = {"stable": False, "level": 0}
    at = spring(["euler_cromer"], check, levels=(0,), time=at_limit(1.0)).verdicts[0]
    assert (at.status, words in at.text) == ("PASS", True)
    beyond = spring(["euler_cromer"], check, levels=(0,), time=at_limit(1.01)).verdicts[0]
    assert (beyond.status, words in beyond.text) == ("PASS", False)
    # its limit is infinite
    none = spring(["crank_nicolson"], check, levels=(0,), time=at_limit(1.0)).verdicts[0]
    assert words not in none.text


def test_advice_on_stability_points_the_right_way() -> None:
    checks = [{"stable": False}, {"stable": True}]
    stable = spring(["central"], *checks, time=at_limit(0.9)).verdicts[0]
    unstable = spring(["central"], *checks, time=at_limit(1.01)).verdicts[1]
    assert "coarser" in stable.advice
    assert "finer" not in stable.advice
    assert "finer" in unstable.advice


@pytest.mark.parametrize("damping", [{}, {"damping": {"linear": 0.1}}])
def test_a_limit_is_said_to_be_that_of_the_undamped_motion(damping: dict[str, Any]) -> None:
    model = {"kind": "oscillator", "spring": "40*u", **damping}
    checks = [{"stable": True}, {"converges": "u"}]
    stable, order = spring(
        ["rk4"], *checks, model=model, time={"end": 20.0, "base_steps": 40}
    ).verdicts
    assert ("2.82843 for the undamped motion)" in stable.advice) == bool(damping)
    assert ("of scheme rk4 for the undamped motion. Level" in order.text) == bool(damping)
    assert "w dt within the limit 2.82843" in stable.advice
    assert "beyond the limit 2.82843 of scheme rk4" in order.text


@pytest.mark.slow
def test_a_tolerance_that_is_advised_suffices() -> None:
    check = {"equal": ["central", "exact"], "quantity": "u"}
    for u in (1.0, 1.3, 1.7, 2.1, 2.3):
        verdict = spring(["central"], check, initial={"u": u}).verdicts[0]
        advised = float(re.findall(r"`atol:` above ([0-9.e+-]+)", verdict.advice)[0])
        loose = {**check, "atol": advised}
        assert spring(["central"], loose, initial={"u": u}).verdicts[0].status == "PASS"
        assert advised < 1.15 * float(verdict.results[0].value or 0.0)


def test_growth_that_theory_predicts_without_damping_is_said_to_be_so() -> None:
    model = {"kind": "oscillator", "damping": {"linear": 0.2}, "spring": "40*u"}
    told = spring(["rk4"], {"stable": True}, model=model).verdicts[0].text
    assert "predicted for free oscillations without damping) and 0.9" in told
    assert "(measured of the motion itself)" in told
    assert "without damping" not in spring(["rk4"], {"stable": True}).verdicts[0].text


def test_a_stable_scheme_of_a_motion_that_grows_says_which_of_both_it_is_about() -> None:
    """Damping that is negative gives the motion energy, which no step size changes."""
    model = {"kind": "oscillator", "damping": {"linear": -0.2}, "spring": "40*u"}
    told = spring(["rk4"], {"stable": True}, model=model).verdicts[0]
    assert told.status == "PASS"
    assert "The motion itself grows: `stable` is about the scheme" in told.text


def test_of_several_coordinates_the_fastest_oscillation_decides_and_one_alone_shows_no_growth(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """x rises and falls as it passes its energy to the wire and back, and the wire needs the smaller step."""
    # a reference solution says nothing of a limit
    monkeypatch.setattr("vibsim.experiment.storage.MOST_REFERENCES", 0)
    # w = sqrt(0.99), and 10 w along the wire: w dt = 0.62 and 6.2, which is beyond the limit 2.83 of rk4
    checks = [{"stable": True, "level": 6}, {"stable": True, "level": 8}, {"converges": "x"}]
    model = {"kind": "elastic_pendulum", "beta": 0.99, "Theta": 10}
    more = {"model": model, "initial": {}, "time": {"end": 40.0}}
    coarse, fine, ladder = spring(["rk4"], *checks, levels=(6, 7, 8), **more).verdicts
    assert (coarse.status, coarse.reason) == ("FAIL", "unstable")
    assert "w dt = 6.219. The growth factor per period is 57.8" in coarse.text
    assert "from 8 on" in coarse.advice
    assert (fine.status, fine.reason) == ("PASS", "match")
    assert ladder.reason == "unstable"
    for verdict in (coarse, fine, ladder):
        assert "predicted for the fastest small oscillations" in verdict.text
        assert "measured" not in verdict.text


def test_growth_is_removed_where_the_next_finer_level_has_less_than_half_of_it() -> None:
    growth = np.array([[8.0, 8.0, 1.0], [8.0, 1.0, 1.0]])
    assert [_is_removed(growth, level).tolist() for level in range(3)] == [
        [False, True],
        [True, False],
        [True, False],
    ]
    assert _is_removed(growth[:, :1], 0).tolist() == [False, False]


def test_w_dt_at_the_limit_is_within_it() -> None:
    """Each level halves w dt; rounding of it does not ask for one level more."""
    found = [first_within(2.0, 3, w_dt) for w_dt in (2.1, 4.0, 4.0 * (1.0 + 1e-14), 4.1, 8.0)]
    assert found == [4, 4, 4, 5, 5]


def test_the_result_nearest_to_what_is_allowed_decides() -> None:
    sweep = {"initial.u": [1e-3, 1.0, 0.5, 0.7, 30.0]}
    run = spring(["rk4"], {"equal": ["rk4", "discrete"], "quantity": "u"}, sweep=sweep)
    (verdict,) = run.verdicts
    distance, allowed = (run.record[f"check_check_1_{n}"][0] for n in ("distance", "allowed"))
    assert verdict.status == "PASS"
    assert verdict.results[0].case == int(np.argmax(distance / allowed))
    # which is no longer the one that is allowed the least
    assert int(np.argmax(distance - allowed)) == 0


def test_an_energy_that_decays_is_said_to_decay() -> None:
    check = {"conserves": "energy", "drift": "bounded"}
    for scheme, word in (("backward_euler", "decays"), ("forward_euler", "grows")):
        text = spring([scheme], check).verdicts[0].text
        assert f"{word} exponentially" in text


@pytest.mark.parametrize("scheme", ["newmark", "backward_euler", "bdf2"])
def test_levels_that_pass_through_a_pole_say_nothing_about_stability(scheme: str) -> None:
    """``u = 1/(1 - t)`` is infinite at t = 1, and implicit steps go on behind it."""
    content = {
        "model": {"kind": "system", "equation": "u'' - 2*u**3 = 0"},
        "initial": {"u": 1.0, "v": 1.0},
        "time": {"end": 2.0, "base_steps": 3},
    }
    levels = (4, 5, 6, 7)
    checks = {"stable": True}, {"stable": False}
    for found in spring([scheme], *checks, levels=levels, **content).verdicts:
        assert (found.status, found.reason) == ("INCONCLUSIVE", "pre_asymptotic")
        assert "as where a force becomes infinite" in found.text
        assert "time: end" in found.advice
    content["time"] = {"end": 0.9, "base_steps": 3}
    (found,) = spring([scheme], checks[0], levels=levels, **content).verdicts
    assert (found.status, found.reason) == ("PASS", "match")


@pytest.mark.parametrize(
    "content",
    [
        # chaos: levels differ by whole turns, and their speeds are alike
        {
            "model": {
                "kind": "system",
                "equation": "q'' + 0.5*q' + sin(q) - 1.15*cos(2*t/3) = 0",
            },
            "initial": {"q": 1.0},
            "time": {"end": 200.0, "base_steps": 100},
        },
        # steps that are too long for the motion keep a speed of their own
        {
            "model": {"kind": "system", "equation": "u'' + 1e4*u + u**3 = 0"},
            "initial": {"u": 1.0},
            "time": {"end": 10.0, "base_steps": 10},
        },
        # the growth of a scheme, which falls with the step
        {
            "model": {"kind": "system", "equation": "u'' + u + 0.1*u**2 = 0"},
            "initial": {"u": 0.1},
            "time": {"end": 20.0, "base_steps": 100},
        },
    ],
    ids=["chaos", "coarse", "growth"],
)
def test_levels_whose_speeds_differ_for_another_cause_are_stable(content: dict[str, Any]) -> None:
    scheme = "forward_euler" if content["initial"].get("u") == 0.1 else "backward_euler"
    (found,) = spring([scheme], {"stable": True}, levels=(0, 1, 2), **content).verdicts
    assert (found.status, found.reason) == ("PASS", "match")


def test_growth_that_nothing_shows_to_vanish_is_an_instability() -> None:
    run = spring(["forward_euler"], {"stable": True}, {"stable": False})
    assert [v.reason for v in run.verdicts] == ["unstable", "match"]


def test_overflow_is_unstable_with_its_time() -> None:
    time = {"end": 400.0, "base_steps": 400}
    run = spring(["central"], {"stable": True}, {"stable": False}, time=time)
    assert [v.reason for v in run.verdicts] == ["unstable", "match"]
    failed = float(run.record["failure_time"][0, 0, 0])
    assert np.isfinite(failed)
    assert f"at t = {failed:.6g}" in run.verdicts[0].text
    assert run.summary["failures"][0]["t"] == failed


def test_growth_that_contradicts_theory_fails_whatever_is_expected() -> None:
    checks = [{"stable": False}, {"stable": True}]
    run = spring(["central"], *checks, time=at_limit(1.01))
    level = run.levels[0]
    last, u = level.variable("last_peak"), level.variable("u")
    # half the growth, in the logarithm, that the scheme has
    half = np.sqrt(np.abs(u.values))
    variables = {
        **level.variables,
        "last_peak": Variable(last.dims, np.sqrt(np.abs(last.values)), {}),
        "u": Variable(u.dims, np.sign(u.values) * half, {}),
    }
    found = judged(run.experiment, {0: replace(level, variables=variables)})
    assert [v.status for v in run.verdicts] == ["PASS", "FAIL"]
    assert [v.status for v in found.verdicts] == ["FAIL", "FAIL"]
    assert [v.reason for v in found.verdicts] == ["mismatch", "mismatch"]
    assert "not the scheme that the theory describes" in found.verdicts[0].text


SAME = [
    (["central", "velocity_verlet"], True),
    (["central", "euler_cromer"], False),
    (["crank_nicolson", "newmark"], True),
    (["crank_nicolson", "central"], False),
]


@pytest.mark.parametrize(("pair", "equal"), SAME)
@pytest.mark.parametrize("wrapped", [False, True])
def test_two_schemes_are_equal_or_not(pair: list[str], equal: bool, wrapped: bool) -> None:
    check = {"equal": pair, "quantity": "u"}
    claim = {"claim": "they are one scheme", "that": check, "holds": equal}
    run = spring(sorted(pair), claim if wrapped else check)
    assert run.verdicts[0].status == ("PASS" if equal or wrapped else "FAIL")
    assert run.verdicts[0].results[0].scheme == pair[0]
    assert len(run.verdicts[0].results) == 1


def test_a_run_that_overflows_is_compared_without_a_warning() -> None:
    """Its rounding has no finite bound; pytest makes an error of every warning."""
    check = {"equal": ["central", "discrete"], "quantity": "u"}
    run = spring(["central"], check, time={"end": 2000.0, "base_steps": 4000})
    assert run.record["check_check_1_allowed"].item() == np.inf
    assert run.verdicts[0].status == "FAIL"


def test_a_discrete_solution_is_worked_out_for_the_scheme_that_is_compared_alone(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """With a check for each of many schemes, all of them at each check would take the square of their number."""
    made: list[Any] = []
    known = solution_distance.theory.discrete

    def counted(stepper: Any, *numbers: Any, **options: Any) -> Any:
        made.append(stepper)
        return known(stepper, *numbers, **options)

    monkeypatch.setattr(solution_distance.theory, "discrete", counted)
    schemes = ["rk4", "central", "heun"]
    run = spring(schemes, *({"equal": [s, "discrete"], "quantity": "u"} for s in schemes))
    assert [v.status for v in run.verdicts] == ["PASS"] * 3
    assert len(made) == 3


def test_a_scheme_equals_its_own_discrete_solution_and_not_the_exact_one() -> None:
    checks = [
        {"equal": ["rk4", "discrete"], "quantity": "u"},
        {"equal": ["rk4", "discrete"], "quantity": "v"},
        {"equal": ["rk4", "exact"], "quantity": "u"},
        {"equal": ["rk4", "exact"], "quantity": "u", "atol": 1.0},
        {"equal": ["crank_nicolson", "exact"], "quantity": "energy"},
        {"equal": ["rk4", "exact"], "quantity": "energy"},
        {"equal": ["rk4", "crank_nicolson"], "quantity": "v_d2t"},
        {"value": "discrete_error", "quantity": "u", "below": 1e-13},
    ]
    run = spring(["rk4", "crank_nicolson"], *checks)
    expected = ["PASS", "PASS", "FAIL", "PASS", "PASS", "FAIL", "FAIL", "PASS"]
    assert [v.status for v in run.verdicts] == expected


def test_every_coordinate_and_the_energy_are_compared_with_the_reference() -> None:
    """Only the first coordinate was, and the energy of two ended in an internal error."""
    content = {
        "title": "two coordinates without a closed form",
        "model": {
            "kind": "system",
            "coordinates": ["x", "y"],
            "force": {"x": "y/2 - x - vx/10", "y": "x/2 - 3*y - y**3"},
        },
        "initial": {"x": 1.0},
        "time": {"end": 3.0, "base_steps": 15},
        "levels": [2, 3, 4],
        "schemes": ["rk4"],
        "checks": [
            *(
                {"equal": ["rk4", "exact"], "quantity": q, "atol": 1e-6}
                for q in ("y", "vy", "energy")
            ),
            {"value": "error_rate", "quantity": "y", "at": {"level": 3}, "equals": 4, "atol": 0.1},
        ],
    }
    experiment = Experiment.from_dict(content)
    levels = {level: simulate_record(experiment, level) for level in experiment.levels}
    assert [v.status for v in judged(experiment, levels).verdicts] == ["PASS"] * 4


def test_a_disturbance_of_ten_times_the_bound_is_seen() -> None:
    run = spring(["rk4"], {"equal": ["rk4", "discrete"], "quantity": "u"})
    level = run.levels[0]
    u = level.variable("u")
    moved = u.values + 10 * float(run.record["check_check_1_allowed"][0, 0]) * (
        np.arange(STEPS + 1) == 7
    )
    variables = {**level.variables, "u": Variable(u.dims, moved, u.attrs)}
    found = judged(run.experiment, {0: replace(level, variables=variables)})
    assert (found.verdicts[0].status, found.verdicts[0].reason) == ("FAIL", "mismatch")


def test_what_is_allowed_are_the_rounding_errors_of_both_sides() -> None:
    pair = ["central", "velocity_verlet"]
    checks = [{"equal": pair, "quantity": name} for name in ("u", "v")]
    run = spring(pair, *checks, {"equal": [pair[0], "discrete"], "quantity": "u"})
    steppers = [SCHEMES[name].stepper(SCHEMES[name].defaults()) for name in pair]
    numbers = 2 * np.pi, PERIODS / STEPS, 1.0, 0.0, STEPS
    bounds = np.array([rounding_bound(stepper, *numbers) for stepper in steppers])
    allowed = [run.record[f"check_check_{i}_allowed"][0, 0] for i in (1, 2, 3)]
    assert allowed == pytest.approx([*np.sum(bounds, axis=0), bounds[0, 0]], rel=1e-9)


LADDER = (0, 1, 2, 3)


@pytest.mark.parametrize(("size", "reason"), [(1e-14, "exact"), (1e-11, "order_low")])
def test_what_is_exact_may_differ_smoothly_within_round_off(size: float, reason: str) -> None:
    wrong = [size * 4.0**-k * np.sin(T) for k in range(4)]
    exact = np.cos(T)
    facts = facts_of([exact - e for e in wrong], (3, 4, 5, 6), order=np.inf, exact=exact)
    found = judge(facts)
    assert REASON_NAMES[int(found.reason[0])] == reason
    assert np.isnan(found.order[0]) == (reason == "exact")


@pytest.mark.slow
def test_what_is_conserved_exactly_passes_as_exact() -> None:
    check = {"converges": "energy_deviation"}
    run = spring(["crank_nicolson", "gauss4"], check, {"converges": "energy"}, levels=LADDER)
    for verdict in run.verdicts:
        assert (verdict.status, verdict.reason) == ("PASS", "exact")
        assert all(result.order is None for result in verdict.results)
    record = run.record
    assert np.all(np.isinf(record["energy_deviation_formal_order"]))
    for name in ("rescaled", "error_estimate", "richardson", "richardson_error"):
        assert np.all(np.isfinite(record[f"energy_deviation_{name}"])), name
    difference, rescaled = (record[f"energy_deviation_{n}"] for n in ("difference", "rescaled"))
    assert np.array_equal(difference, rescaled)
    bound = np.max(record["energy_deviation_richardson_error"])
    assert bound < 1e-12 * float(record["energy_initial"][0, 0])


@pytest.mark.parametrize("kind", ["central", "rk4", "forward_euler"])
def test_a_scheme_that_falsely_promises_to_conserve_energy_fails(
    kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    scheme = SCHEMES[kind]
    own = scheme.orders(scheme.defaults())
    boast = replace(own, energy_linear=np.inf)
    registered(monkeypatch, replace(scheme, kind="boaster", orders=lambda options: boast))
    run = spring(["boaster"], {"converges": "energy_deviation"}, levels=LADDER)
    verdict = run.verdicts[0]
    assert (verdict.status, verdict.reason) == ("FAIL", "order_low")
    assert "should be exact" in verdict.text


def test_a_wrong_weight_is_caught(monkeypatch: pytest.MonkeyPatch) -> None:
    # the sum of the weights is 1, and the scheme of order 2 only
    rows = (("1/2",), ("0", "1/2"), ("0", "0", "1"))
    wrong = from_tableau(Tableau(rows, ("1/6", "1/2", "1/6", "1/6")))
    broken = replace(SCHEMES["rk4"], kind="rk4_typo", stepper=lambda options: wrong)
    registered(monkeypatch, broken)
    checks = [
        {"converges": "u"},
        {"converges": "u", "expect": {"status": "FAIL", "reason": "order_low"}},
        {"equal": ["rk4_typo", "rk4"], "quantity": "u"},
        {"equal": ["rk4_typo", "discrete"], "quantity": "u"},
    ]
    run = spring(["rk4_typo", "rk4"], *[c | _only(c) for c in checks], levels=LADDER)
    assert [v.status for v in run.verdicts] == ["FAIL", "PASS", "FAIL", "PASS"]
    assert run.verdicts[0].reason == "order_low"


def _only(check: dict[str, object]) -> dict[str, object]:
    return {"schemes": ["rk4_typo"]} if "converges" in check else {}


def test_wrong_weights_do_not_reach_the_exact_solution(monkeypatch: pytest.MonkeyPatch) -> None:
    wrong = from_tableau(Tableau((("1/2",),), ("0", "9/10")))
    orders = Orders(position=1, velocity=1, energy=1, energy_linear=1)
    broken = replace(
        SCHEMES["rk2"],
        kind="rk2_typo",
        stepper=lambda options: wrong,
        orders=lambda options: orders,
    )
    registered(monkeypatch, broken)
    run = spring(["rk2_typo"], {"converges": "u"}, levels=(0, 1, 2, 3, 4))
    assert run.verdicts[0].status == "FAIL"
    assert run.verdicts[0].reason in {"wrong_limit", "order_high"}


@pytest.mark.slow
def test_adaptive_schemes_have_errors_and_no_orders() -> None:
    adaptive = {"kind": "dop853", "tolerance": [1e-6, 1e-10]}
    names = ["dop853_1e-06", "dop853_1e-10"]
    checks = [
        {"converges": "u"},
        {"converges": "u", "schemes": names},
        {"value": "error_linf", "quantity": "u", "below": 1e-4, "at": {"scheme": names[0]}},
        {"value": "force_evaluations", "above": STEPS / 100, "at": {"scheme": names[1]}},
        {"value": "force_evaluations", "equals": 4 * STEPS, "at": {"scheme": "rk4", "level": 0}},
        {"value": "accepted_steps", "equals": 2 * STEPS, "at": {"scheme": "rk4", "level": 1}},
        {"conserves": "energy", "drift": "none", "schemes": names[:1]},
    ]
    run = spring(["rk4", adaptive], *checks, levels=LADDER)
    ladder, own, error, *rest, drift = run.verdicts
    assert (ladder.status, len(ladder.results)) == ("PASS", 1)
    assert (own.status, own.reason) == ("INCONCLUSIVE", "not_applicable")
    assert "so u has no order" in own.text
    assert "fixed step" in own.advice
    assert error.status == "PASS"
    assert [v.status for v in rest] == ["PASS"] * 3
    # its tolerance is no round-off
    assert drift.status == "FAIL"
    record = run.record
    assert np.all(np.isnan(record["u_difference"][1:]))
    assert np.all(np.isnan(record["u_formal_order"][1:]))
    assert np.all(np.isfinite(record["u_error_norm"]))
    assert np.all(np.isnan(record["theory_growth"][1:]))
    assert np.all(np.isnan(record["stability_limit"][1:]))
    assert float(run.record["t"][-1]) == PERIODS


def test_an_adaptive_scheme_with_one_level_has_no_order() -> None:
    checks = [{"converges": "u"}, {"converges": "u", "schemes": ["dop853"]}]
    run = spring(["rk4", {"kind": "dop853", "tolerance": 1e-6}], *checks, levels=[0])
    assert [verdict.reason for verdict in run.verdicts] == ["too_few_levels", "not_applicable"]


def test_notes_and_tables_of_a_source_reach_the_summary() -> None:
    p = 2 * np.pi * PERIODS / STEPS
    value = {"value": "relative_energy_error_d2t"}
    (plain,) = spring(["central", "rk4"], {**value, "above": 0.0, "at": {"scheme": "rk4"}}).verdicts
    ours = plain.results[0].value
    # the leading error that [D_2t u] makes of RK4's energy
    assert ours == pytest.approx(p * p / 3, rel=0.01)
    table = {
        "title": "printed",
        **value,
        "beside": ["relative_energy_error", "predicted_growth_per_period"],
        "rows": [
            {"scheme": "rk4", "printed": f"{ours:.3e}", "level": 0},
            {
                "scheme": "rk4",
                "printed": f"{ours * 1.01:.3e}",
                "level": 0,
                "holds": False,
                "note": "a misprint",
            },
        ],
    }
    run = spring(["central", "rk4"], published=[table])
    right, wrong = run.verdicts
    assert (right.status, wrong.status) == ("PASS", "PASS")
    assert (right.note, wrong.note) == (None, "a misprint")
    assert run.summary["checks"][1]["note"] == "a misprint"
    beside = run.record["published_beside"]
    assert run.record.variable("published_beside").dims == ("check", "case", "beside")
    growth = run.record["theory_growth"][1, 0, 0]
    assert np.array_equal(beside[:, 0, 1], [growth, growth])
    own = run.record["energy_deviation_max_abs"][1, 0, 0] / run.record["energy_initial"][1, 0]
    assert beside[0, 0, 0] == own
