"""Real ladders: the pendulum by centred differences, sound and with the traps of the lecture."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from ladders import facts_of
from reference_pendulum import pendulum

from vibsim.convergence.verdict import judge
from vibsim.core.vocabulary import REASON_NAMES, STATUSES

LOW, UNDECIDED = ("FAIL", "order_low"), ("INCONCLUSIVE", "pre_asymptotic")
THETA_AT_20 = {6: 0.9996677748139638, 7: 0.9971663759228251, 8: 0.9961666300804089}


def decide(levels: range, quantity: str, **more: Any) -> tuple[str, str, float]:
    norm, floor = more.pop("norm", "l2"), more.pop("floor", 1e-15)
    fields = pendulum(levels, quantity, **more)
    found = judge(facts_of(fields, tuple(levels), norm=norm, floor=floor))
    return (
        STATUSES[int(found.status[0])],
        REASON_NAMES[int(found.reason[0])],
        float(found.order[0]),
    )


@pytest.mark.slow
def test_the_reference_gives_the_numbers_of_the_issue() -> None:
    for level, value in THETA_AT_20.items():
        for three_term in (False, True):
            theta = pendulum([level], "theta", three_term=three_term)[0]
            assert theta[-1] == pytest.approx(value, abs=1e-11)


@pytest.mark.parametrize("quantity", ["theta", "omega", "dE"])
@pytest.mark.parametrize("levels", [range(6, 9), range(6, 10), range(7, 12)])
def test_the_sound_scheme_passes(quantity: str, levels: range) -> None:
    status, reason, order = decide(levels, quantity)
    assert (status, reason) == ("PASS", "asymptotic")
    assert order == pytest.approx(2.0, abs=0.02)


@pytest.mark.parametrize("levels", [range(6, 11), range(8, 12)])
@pytest.mark.parametrize("quantity", ["theta", "omega"])
def test_a_first_order_start_is_order_low(levels: range, quantity: str) -> None:
    status, reason, order = decide(levels, quantity, first=True)
    assert (status, reason) == ("FAIL", "order_low")
    assert order == pytest.approx(1.0, abs=0.05)
    # with one or two levels less it may be open, but never passes
    for count in (1, 2):
        if len(levels) - count >= 3:
            assert decide(levels[:-count], quantity, first=True)[:2] in (LOW, UNDECIDED)


@pytest.mark.parametrize(
    ("quantity", "levels"),
    [
        ("omega", range(6, 12)),
        ("omega", range(8, 13)),
        ("dE", range(6, 14)),
        ("dE", range(8, 14)),
    ],
)
def test_a_one_sided_end_is_seen_by_the_norm_that_sees_the_end(
    quantity: str, levels: range
) -> None:
    """The error of the end is a point alone, whose first order is seen a few levels later than that of a series."""
    trap = decide(levels, quantity, backward=True, norm="linf")
    assert trap[:2] == LOW
    for count in range(3, len(levels) + 1):
        fewer = levels[:count]
        assert decide(fewer, quantity, backward=True, norm="linf")[:2] in (LOW, UNDECIDED)
        inside = decide(fewer, quantity, backward=True, norm="linf_interior")
        assert inside[:2] == ("PASS", "asymptotic")


def test_an_extrapolated_end_is_not_called_wrong_while_it_spoils_the_maximum() -> None:
    # theta_0 = 3: the local orders of max |dE| are 1.06, 1.73, 1.90, 1.96 on levels 6 to 11
    assert decide(range(6, 10), "dE", theta_0=3.0, norm="linf")[:2] == (
        "INCONCLUSIVE",
        "pre_asymptotic",
    )
    assert decide(range(6, 12), "dE", theta_0=3.0, norm="linf")[0] == "PASS"
    assert decide(range(6, 10), "dE", theta_0=3.0, norm="linf_interior")[0] == "PASS"


def three_term_floor(levels: range, factor: float = 1.0) -> np.ndarray:
    return np.array([factor * 2.0**-53 * (2.0**level) ** 1.5 for level in levels])


@pytest.mark.parametrize("factor", [0.1, 1.0, 3.0])
def test_three_term_round_off_is_found_although_its_prediction_is_rough(factor: float) -> None:
    for levels in (range(13, 23), range(15, 23)):
        floor = three_term_floor(levels, factor)
        found = decide(levels, "theta", three_term=True, floor=floor)
        if found[:2] == ("INCONCLUSIVE", "round_off"):
            # noise that is predicted three times too large hides all levels from 15 on but three
            assert (factor, levels[0]) == (3.0, 15)
            continue
        assert found[:2] == ("PASS", "asymptotic")
        assert found[2] == pytest.approx(2.0, abs=0.05)
    for levels in (range(17, 23), range(18, 22), range(19, 22)):
        floor = three_term_floor(levels, factor)
        found = decide(levels, "theta", three_term=True, floor=floor)
        assert found[:2] == ("INCONCLUSIVE", "round_off")


def test_the_increment_form_passes_on_the_same_levels() -> None:
    levels = range(17, 23)
    floor = np.array([2.0**-53 * 2.0 ** (level / 2) for level in levels])
    assert decide(levels, "theta", floor=floor)[:2] == ("PASS", "asymptotic")
