"""A promised order with a small coefficient, behind a higher one: no verdict against it until levels decide."""

from __future__ import annotations

from typing import Any

import pytest
from thinned import thinned
from whole import analysed, decided

from vibsim import Experiment, Verdict, verdicts

pytestmark = pytest.mark.usefixtures("without_series")

SPRING = {"kind": "spring", "w": 9}


def judged(
    model: dict[str, Any],
    initial: dict[str, float],
    levels: range,
    scheme: Any,
    quantity: str,
    orders: tuple[Any, ...],
    end: float = 12.0,
) -> list[Verdict]:
    experiment = Experiment.from_dict(
        {
            "title": "t",
            "model": model,
            "initial": initial,
            "time": {"end": end},
            "levels": list(levels),
            "schemes": [scheme],
            "checks": [{"converges": quantity, "order": order} for order in orders],
        }
    )
    return decided(experiment)


WEAK = {"kind": "oscillator", "spring": "u", "damping": {"linear": 1e-4}}
"""A damping that a scheme takes backward, with an error of order 1, and so little of it."""


@pytest.mark.parametrize(
    ("model", "initial", "levels", "scheme", "quantity", "promised", "shown"),
    thinned(
        [
            (SPRING, {"u": 1.0, "v": 0.5}, range(7, 12), "euler_cromer", "v", 1, 2),
            (SPRING, {"u": 1.0, "v": 0.1}, range(8, 13), "euler_cromer", "v", 1, 2),
            (SPRING, {"u": 1.0, "v": -0.003}, range(9, 13), "euler_cromer", "v", 1, 2),
            (SPRING, {"u": 0.001, "v": 9.0}, range(8, 12), "euler_cromer_u_first", "u", 1, 2),
            (WEAK, {"u": 1.0}, range(6, 11), "central_backward_damping", "u", 1, 2),
            ({"kind": "pendulum"}, {"theta": 0.03}, range(6, 10), "rk4", "energy", 4, 5),
            (SPRING, {"u": 1.0, "v": 0.01}, range(8, 12), "rkn4", "u_amplitude_error", 4, 5),
        ],
        3,
    ),
)
def test_levels_that_show_a_higher_order_decide_nothing_against_the_promised_one(
    model: dict[str, Any],
    initial: dict[str, float],
    levels: range,
    scheme: str,
    quantity: str,
    promised: int,
    shown: int,
) -> None:
    told = judged(model, initial, levels, scheme, quantity, (promised, "scheme", shown))
    assert [(one.status, one.reason) for one in told] == [("INCONCLUSIVE", "pre_asymptotic")] * 3
    for one in told:
        assert f"has an error of order {promised} here" in one.text
        assert f"Add levels {levels[-1] + 1} and" in one.advice


def test_what_is_small_in_the_energy_is_small_in_the_motion_that_it_drives() -> None:
    """Near the top between two wells all that matters is how wrong the energy is, of order 5 where it is linear."""
    model = {"kind": "oscillator", "spring": "u**3 - u"}
    told = judged(model, {"u": 0.01}, range(10, 14), "rk4", "u", (4, 5), end=20.0)
    assert {(one.status, one.reason) for one in told} == {("INCONCLUSIVE", "pre_asymptotic")}


@pytest.mark.slow
def test_finer_levels_decide_for_the_promised_order() -> None:
    told = judged(
        SPRING, {"u": 1.0, "v": 0.5}, range(16, 21), "euler_cromer", "v", (1, "scheme", 2)
    )
    assert [(one.status, one.reason) for one in told] == [
        ("PASS", "asymptotic"),
        ("PASS", "asymptotic"),
        ("FAIL", "order_low"),
    ]


@pytest.mark.slow
def test_an_order_above_and_one_below_both_fail_all_the_same() -> None:
    above, below = judged(SPRING, {"u": 1.0, "v": 0.1}, range(8, 13), "euler_cromer", "v", (3, 0.5))
    assert (above.status, above.reason) == ("FAIL", "order_low")
    assert (below.status, below.reason) == ("FAIL", "order_high")


def test_a_special_start_has_its_higher_order() -> None:
    told = judged(SPRING, {"u": 1.0}, range(8, 13), "euler_cromer", "v", ("scheme", 2, 1))
    assert [one.status for one in told] == ["PASS", "PASS", "FAIL"]


def test_levels_that_leave_no_room_for_the_promised_power_fail_it() -> None:
    """The force has a name and is 0, so that theory promises order 1; six levels exclude it."""
    model = {"kind": "oscillator", "spring": "u", "force": "A*t", "parameters": {"A": 0.0}}
    low, high = judged(
        model, {"u": 1.0}, range(6, 12), "euler_cromer_u_first", "v", (1, 2), end=11.9
    )
    assert (low.status, low.reason) == ("FAIL", "order_high")
    assert (high.status, high.reason) == ("PASS", "asymptotic")


def test_a_start_nearly_in_balance_hides_the_promise_between_events_too() -> None:
    model = {"kind": "oscillator", "spring": "0.6876*u", "damping": {"coulomb": 0.01015}}
    model |= {"force": "0.1261*t"}
    initial = {"u": -0.001201, "v": 0.0003687}
    for norm in ("l1", "l2"):
        made = Experiment.from_dict(
            {
                "title": "t",
                "model": model,
                "initial": initial,
                "time": {"end": 63.39, "base_steps": 5},
                "levels": [3, 4, 5, 6, 7, 8],
                "schemes": ["euler_cromer_u_first"],
                "checks": [{"converges": "u", "order": order, "norm": norm} for order in (1, 2)],
            }
        )
        record = analysed(made)
        for verdict in verdicts(made, record):
            assert (verdict.status, verdict.reason) == ("INCONCLUSIVE", "pre_asymptotic")


@pytest.mark.parametrize("norm", ["l1", "l2"])
def test_what_a_hidden_promise_leaves_is_no_other_limit(norm: str) -> None:
    """Of six levels all but the last show order 2; a part of order 1, from weak damping, is left at each of them."""
    content: dict[str, Any] = {
        "title": "t",
        "model": {
            "kind": "oscillator",
            "spring": "k*u + c*u**5",
            "damping": "d*v**3",
            "force": "F*cos(p*t**2/10)",
            "parameters": {"k": 1.241, "c": 1.43, "d": 0.03275, "F": 0.2009, "p": 1.695},
        },
        "initial": {"u": 0.09669, "v": -0.1025},
        "time": {"end": 0.5743, "base_steps": 5},
        "levels": [1, 2, 3, 4, 5, 6],
        "schemes": ["central_backward_damping"],
        "checks": [{"converges": "v", "order": order, "norm": norm} for order in (1, 2)],
    }
    experiment = Experiment.from_dict(content)
    for verdict in decided(experiment):
        assert verdict.reason == "pre_asymptotic"
