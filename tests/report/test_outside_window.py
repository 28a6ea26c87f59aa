"""Of levels outside the window of an order it is said why they are: round-off only where they are near its floor."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from vibsim import Experiment, analyse, simulate, verdicts
from vibsim.core.record import Record
from vibsim.core.vocabulary import TYPICAL_NORM
from vibsim.report import style
from vibsim.report.data import Ladder, Member, Results
from vibsim.report.figures import time
from vibsim.report.tables import levels as tables

CONTENT = {
    "title": "outside",
    "model": {"kind": "spring", "w": 2.0},
    "initial": {"u": 1.0},
    "time": {"end": 10.0},
    "schemes": ["central"],
    "checks": [{"converges": "u"}],
}


def made(levels: range, noise: float = 0.0, **more: Any) -> tuple[Any, Results]:
    """Return verdict and record of a run; `noise` is added to every level."""
    experiment = Experiment.from_dict({**CONTENT, "levels": list(levels), **more})
    random = np.random.default_rng(2)
    data = []
    for level in experiment.levels:
        one = simulate(experiment, level)
        rough = noise * random.normal(size=one["u"].shape)
        rough[..., 0] = 0.0
        data.append(one.assign(u=one["u"] + rough) if noise else one)
    record = analyse(experiment, data)
    (found,) = verdicts(experiment, record)
    return found, Results.of(experiment, Record.from_xarray(record))


def notes(record: Results) -> list[str]:
    """Return what the table of levels says of each of them."""
    return tables._notes(Ladder(record, "u", Member(0, 0, "central")), TYPICAL_NORM)


def legend(record: Results) -> str:
    with style.applied():
        figure = time.overlay(Ladder(record, "u", Member(0, 0, "central"))).figure
    return " ".join(label for ax in figure.axes for label in ax.get_legend_handles_labels()[1])


@pytest.mark.slow
def test_a_floor_above_round_off_is_not_called_round_off() -> None:
    _, record = made(range(6, 14), noise=1e-5)
    assert "round-off" not in " ".join(notes(record)) + legend(record)
    assert "no longer proportional" in notes(record)
    found, _ = made(range(9, 14), noise=1e-3)
    assert found.status == "INCONCLUSIVE"
    assert "have reached round-off" not in found.text


@pytest.mark.slow
def test_what_is_round_off_is_called_so() -> None:
    plain = {"kind": "central", "arithmetic": "three_term", "label": "central"}
    _, record = made(range(10, 19), schemes=[plain], samples="common")
    assert "round-off" in notes(record)


def test_coarse_levels_are_called_too_coarse() -> None:
    _, record = made(range(4, 11))
    assert notes(record)[0] == "too coarse"
    assert "round-off" not in notes(record)


def test_a_ratio_needs_two_levels_that_are_sound_and_do_not_vanish() -> None:
    is_sound = np.array([[[True, False, True, True, True]]])
    found = tables._ratios(np.array([[[8.0, 4.0, 2.0, 1.0, 0.0]]]), is_sound)
    np.testing.assert_array_equal(found, [[[np.nan, np.nan, 2.0, np.nan, np.nan]]])


def test_levels_of_the_same_order_before_those_that_are_used_are_not_called_too_coarse() -> None:
    _, record = made(range(6, 19, 2))
    orders = record["u_observed_order"][0, 0, :, record.words("norm").index(TYPICAL_NORM)]
    assert abs(orders[0] - 2.0) < 0.02
    assert notes(record)[0] == "not needed"


def test_levels_that_overflow_broke_down(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("vibsim.experiment.storage.MOST_REFERENCES", 0)
    model = {"kind": "oscillator", "spring": "u**3"}
    labelled = {"kind": "forward_euler", "label": "central"}
    _, record = made(
        range(4, 8), model=model, initial={"u": 10.0}, time={"end": 200.0}, schemes=[labelled]
    )
    assert "broke down" in notes(record)
    assert "round-off" not in notes(record)
