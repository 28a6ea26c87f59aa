"""What would settle a verdict, and why an order is another one: predictions against what then happens."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from spring_runs import spring

from vibsim.analysis import Verdict, analyse_records, verdicts
from vibsim.checks.sentences import cost_in_words
from vibsim.comparison.order_verdict import CAUSES
from vibsim.core.record import Record
from vibsim.experiment import Experiment
from vibsim.experiment.cost import level_cost
from vibsim.simulation import simulate_record

pytestmark = pytest.mark.usefixtures("without_series")

PENDULUM = {"model": {"kind": "pendulum"}, "initial": {"theta": 1.0}, "time": {"end": 20.0}}
CHECK = {"converges": "theta"}


def judged(*checks: dict[str, Any], **data: Any) -> tuple[list[Verdict], Record]:
    given = {"title": "test", "schemes": ["central"], "checks": list(checks or (CHECK,))}
    experiment = Experiment.from_dict({**PENDULUM, **given, **data})
    records = {level: simulate_record(experiment, level) for level in experiment.levels}
    record = analyse_records(experiment, records)
    return verdicts(experiment, record), record


def cause(record: Record, check: int = 0) -> str:
    return CAUSES[int(record[f"check_check_{check + 1}_cause"][0, 0])]


@pytest.mark.parametrize("theta", [3.08, 3.1])
def test_the_predicted_number_of_levels_suffices(theta: float) -> None:
    """Of the centred scheme, whose errors have even powers; elsewhere it is a guess (docs/method.md)."""
    start = {"initial": {"theta": theta}}
    for first in (4, 5):
        levels = [first, first + 1, first + 2, first + 3]
        (found,), record = judged(**start, levels=levels)
        if found.reason != "pre_asymptotic":
            continue
        more = int(record["check_check_1_levels_needed"][0, 0])
        assert 1 <= more <= 4
        assert f"Add level{'s' if more > 1 else ''} {levels[-1] + 1}" in found.advice
        finer = [levels[-1] + 1 + i for i in range(more + 1)]
        (then,), _ = judged(**start, levels=levels + finer)
        assert then.status == "PASS"
        return
    pytest.fail("no ladder was too coarse")


def test_levels_are_predicted_towards_the_order_that_the_scheme_has() -> None:
    """An order of 3 is asked of a scheme of order 2: one level more decides, and not those to 3."""
    check = {"converges": "theta", "order": 3}
    run = {"initial": {"theta": 1.5}, "time": {"end": 5.0}, "schemes": ["heun"]}
    (found,), record = judged(check, **run, levels=[4, 5, 6])
    assert found.reason == "pre_asymptotic"
    assert int(record["check_check_1_levels_needed"][0, 0]) == 1
    (then,), _ = judged(check, **run, levels=[4, 5, 6, 7])
    assert then.reason == "order_low"


def test_levels_that_have_nothing_to_do_with_the_solution_predict_nothing() -> None:
    """Adams-Bashforth with long steps grows beyond all bounds: the differences fall like dt^36."""
    model = {"kind": "spring", "w": 4.398}
    (found,), record = judged(
        {"converges": "u"},
        model=model,
        initial={"u": 0.928, "v": -1.09},
        time={"end": 24.39},
        schemes=["ab2"],
        levels=[6, 7, 8],
    )
    assert found.reason == "pre_asymptotic"
    assert int(record["check_check_1_levels_needed"][0, 0]) == -1
    assert "is not known yet" in found.advice


@pytest.mark.slow
def test_noise_that_grows_predicts_by_the_order_of_the_scheme() -> None:
    """Gauss' method is exact on the solution 2 + t, near which rounding grows: an order of -1.7 reaches no level 40."""
    model = {
        "kind": "oscillator",
        "spring": "sin(u)",
        "damping": {"linear": 0.2},
        "exact": "2+t",
    }
    (found,), record = judged(
        {"converges": "u"},
        model=model,
        initial={},
        time={"end": 40.0, "base_steps": 7},
        schemes=["gauss4"],
        levels=[9, 10, 11, 12],
    )
    assert found.reason == "round_off"
    assert int(record["check_check_1_readable_level"][0, 0]) < 15


def test_of_a_verdict_that_is_settled_nothing_is_predicted() -> None:
    (found,), record = judged(levels=[6, 7, 8, 9])
    assert found.status == "PASS"
    for name in ("levels_needed", "readable_level", "readable_level_compensated"):
        assert int(record[f"check_check_1_{name}"][0, 0]) == -1
    assert cause(record) == "none"


@pytest.mark.slow
def test_levels_at_which_an_order_can_be_read_are_named_and_right() -> None:
    """RK4 is in round-off from level 14 on; on the levels that the advice names it passes."""
    (found,), record = judged(schemes=["rk4"], levels=[13, 14, 15, 16])
    assert found.reason == "round_off"
    last = int(record["check_check_1_readable_level"][0, 0])
    assert f"such as {last - 3} to {last}" in found.advice
    (then,), _ = judged(schemes=["rk4"], levels=list(range(last - 3, last + 1)))
    assert then.status == "PASS"


@pytest.mark.slow
def test_the_arithmetic_that_reaches_further_is_named() -> None:
    plain = {"kind": "central", "arithmetic": "three_term"}
    levels = [17, 18, 19, 20]
    (found,), record = judged(schemes=[plain], levels=levels, samples="common")
    assert found.reason == "round_off"
    own, best = (
        int(record[f"check_check_1_{n}"][0, 0])
        for n in ("readable_level", "readable_level_compensated")
    )
    assert own < 18 < best
    assert "Set `arithmetic: compensated`" in found.advice
    assert f"up to level {best}" in found.advice


@pytest.mark.slow
def test_the_arithmetic_that_was_named_can_read_the_order() -> None:
    (found,), _ = judged(levels=[17, 18, 19, 20], samples="common")
    assert found.status == "PASS"


def test_times_at_which_the_leading_error_vanishes_are_no_higher_order() -> None:
    """w = 2 pi: with w dt = pi/8, every eighth point is a turning point (released from rest)."""
    time = {"end": 10.0, "base_steps": 160}
    checks = [{"converges": "u"}, {"converges": "v"}]
    run = spring(["central"], *checks, levels=range(5), time=time, samples={"every": 8})
    position, velocity = run.verdicts
    assert (position.reason, velocity.status) == ("order_high", "PASS")
    assert "turning points" in position.text
    assert "`time: end`" in position.advice
    # a finer first level has common times between them: as advised
    run = spring(["central"], checks[0], levels=range(1, 5), time=time, samples={"every": 8})
    assert run.verdicts[0].status == "PASS"


def test_an_order_that_theory_has_too_is_told_from_an_accident() -> None:
    """Exercise 3 of the vibration text: the frequency correction makes the order 4."""
    scheme = {"kind": "central", "frequency_correction": True}
    run = spring(
        [scheme],
        {"converges": "u", "order": 2},
        levels=range(4),
        time={"end": 10.3, "base_steps": 120},
    )
    (found,) = run.verdicts
    assert found.reason == "order_high"
    assert cause(run.record) == "theory"
    assert "`order: scheme`" in found.advice or "`order: 4`" in found.advice


def test_a_velocity_of_higher_order_than_its_position_is_no_matter_of_theory() -> None:
    """From rest, the velocity of Euler-Cromer is of second order; its position, and the phase, of first.

    The force is there by name, and 0: nothing is known of what a number happens to be.
    """
    model = {"kind": "oscillator", "spring": "4*pi**2*u", "force": "A*t", "parameters": {"A": 0.0}}
    checks = [{"converges": "v"}, {"converges": "u"}]
    run = spring(
        ["euler_cromer_u_first"],
        *checks,
        levels=range(6),
        time={"end": 1.9, "base_steps": 32},
        model=model,
    )
    velocity, position = run.verdicts
    assert (velocity.reason, position.status) == ("order_high", "PASS")
    assert cause(run.record) == "one_quantity"
    assert "vanishes in v" in velocity.text
    assert "The phase of u is of first order" in velocity.text


def test_a_special_motion_that_theory_does_not_know_is_left_open_on_few_levels() -> None:
    """The velocity of Euler-Cromer shows order 2 at levels where the position shows none yet.

    A force that happens to be 0 keeps theory from knowing that nothing of order 1 is there; more levels exclude it.
    """
    model = {
        "kind": "oscillator",
        "spring": "k*tanh(u)",
        "force": "A*t",
        "parameters": {"k": 3.11, "A": 0.0},
    }
    (found,), record = judged(
        {"converges": "v"},
        model=model,
        initial={"u": 0.781},
        time={"end": 40.0, "base_steps": 3},
        schemes=["euler_cromer_u_first"],
        levels=[7, 8, 9],
    )
    assert found.reason == "pre_asymptotic"
    assert "an error of order 1 here" in found.text
    assert cause(record) == "none"


def test_a_scheme_that_promises_less_is_named() -> None:
    model = {"kind": "oscillator", "damping": {"linear": 0.3}, "spring": "u"}
    (found,), _ = judged(
        {"converges": "u", "order": 2},
        model=model,
        initial={"u": 1.0},
        schemes=["central_backward_damping"],
        levels=[6, 7, 8, 9],
    )
    assert found.reason == "order_low"
    assert "uses the backward difference for the damping" in found.text
    assert "`kind: central`" in found.advice
    (found,), _ = judged(
        {"converges": "theta", "order": 2}, schemes=["euler_cromer"], levels=[9, 10, 11, 12]
    )
    assert "promises no more than order 1" in found.text
    assert found.advice == "Set `start: centred` for scheme euler_cromer, or `order: scheme`."
    (found,), _ = judged(
        {"converges": "energy_deviation", "order": 2},
        schemes=["euler_cromer"],
        levels=[9, 10, 11, 12],
    )
    assert "`kind:`" in found.advice
    assert "start:" not in found.advice


def test_a_last_point_of_lower_order_is_seen_in_the_data() -> None:
    scheme = {"kind": "central", "end_velocity": "backward"}
    check = {"converges": "omega", "norm": "linf"}
    (found,), record = judged(check, schemes=[scheme], levels=[8, 9, 10, 11, 12])
    assert found.reason == "order_low"
    assert cause(record) == "last_point"


def test_a_start_of_lower_order_is_seen_in_everything() -> None:
    scheme = {"kind": "central", "start": "first_order"}
    _, record = judged(schemes=[scheme], levels=[8, 9, 10, 11])
    assert cause(record) == "everything"


def test_the_first_stable_level_is_named_with_its_growth() -> None:
    checks = [{"converges": "u"}, {"stable": True, "level": 0}]
    run = spring(["central"], *checks, levels=range(4), time={"end": 10.0, "base_steps": 10})
    both = run.verdicts
    # w dt = 2 pi: half of it is beyond the limit 2, a quarter is within
    assert both[0].reason == both[1].reason == "unstable"
    assert "Level 2 is the first" in both[0].text
    assert "at 2 or finer" in both[0].advice
    assert "from 2 on" in both[1].advice
    p = 2 * math.pi
    root = (p**2 - 2 + p * math.sqrt(p**2 - 4)) / 2
    assert f"{root ** (2 * math.pi / p):.4g}"[:4] in both[0].text


def test_costs_are_those_of_the_plan() -> None:
    data = {**PENDULUM, "title": "test", "schemes": ["central", "rk4"], "levels": [6, 7, 8]}
    experiment = Experiment.from_dict(data)
    words = cost_in_words(experiment, [9, 10])
    assert words.startswith(f"{2 * (512 + 1024)} steps, less than 0.1 s on one core, ")
    memory = max(level_cost(experiment, level).memory(1) for level in (9, 10))
    assert words.endswith(f"{memory / 1e6:.0f} MB of memory")
    large = cost_in_words(experiment, [30])
    seconds = level_cost(experiment, 30).seconds(1)
    assert seconds > 10
    assert f"{seconds:.2g} s" in large or " min" in large


@pytest.mark.slow
def test_what_is_foreseen_of_a_member_depends_on_no_other() -> None:
    sweep = {"sweep": {"initial.theta": [0.5, 3.0, 2.0]}}
    _, whole = judged(**sweep, levels=[4, 5, 6, 7])
    for case, theta in enumerate([0.5, 3.0, 2.0]):
        _, alone = judged(initial={"theta": theta}, levels=[4, 5, 6, 7])
        for field in ("levels_needed", "readable_level", "readable_level_compensated", "cause"):
            name = f"check_check_1_{field}"
            np.testing.assert_array_equal(whole[name][:, case], alone[name][:, 0])
