"""The panel of the order over time, and the words of parts of an error."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import samples

from vibsim.report import style, words
from vibsim.report.data import Ladder, Member
from vibsim.report.figures import time as figures_time

TITLE = "Order over time, in windows of half a period"


def panel(picture: Any) -> Any:
    """Return the axes of the order over time, None where the figure has none."""
    found = [ax for ax in picture.figure.axes if TITLE in ax.get_title(loc="left")]
    return found[0] if found else None


def drawn(**changes: Any) -> tuple[Any, Any]:
    exp = samples.experiment(**changes)
    return exp, samples.record(exp)


def test_the_order_stands_below_the_ratios_with_the_promised_one() -> None:
    _, rec = drawn()
    with style.applied():
        ax = panel(figures_time.overlay(Ladder(rec, "theta", Member(0, 0, "central"))))
    labels = ax.get_legend_handles_labels()[1]
    assert labels == ["levels 6, 7, 8", "levels 7, 8, 9", "promised"]
    order = ax.lines[0].get_ydata()
    assert np.abs(np.asarray(order) - 2.0).max() < 0.1
    low, high = ax.get_ylim()
    assert low < 1.7 < 2.3 < high


def test_a_last_point_of_lower_order_is_within_the_frame_and_apart() -> None:
    one_sided = [{"kind": "central", "end_velocity": "backward"}]
    checks = [{"converges": "omega"}]
    _, rec = drawn(schemes=one_sided, levels=[8, 9, 10, 11], checks=checks)
    with style.applied():
        ax = panel(figures_time.overlay(Ladder(rec, "omega", Member(0, 0, "central"))))
    points = [line for line in ax.lines if line.get_marker() == "o"]
    assert len(points) == 2
    low, _ = ax.get_ylim()
    for line in points:
        assert low < float(line.get_ydata()[0]) < 1.3
    curves = [line for line in ax.lines if str(line.get_label()).startswith("levels")]
    for line in curves:
        assert np.nanmin(line.get_ydata()) > 1.9
        assert line.get_xdata()[-1] < 20.0


def test_uncertain_places_are_dots_and_what_is_lost_is_a_gap() -> None:
    schemes = [{"kind": "rk2", "events": "mesh"}]
    model = {"kind": "sliding_box", "m": 1.0, "k": 1.0, "mu": 0.1, "alpha": 0.5, "g": 1.0}
    time = {"end": 6.0}
    _, rec = drawn(
        schemes=schemes, model=model, initial={"u": 1.0}, time=time, levels=[6, 7, 8, 9, 10]
    )
    with style.applied():
        ax = panel(figures_time.overlay(Ladder(rec, "u", Member(0, 0, "rk2"))))
    dots = [line for line in ax.lines if line.get_marker() == "."]
    assert dots
    curves = [line for line in ax.lines if str(line.get_label()).startswith("levels")]
    assert any(np.isnan(np.asarray(line.get_ydata())).any() for line in curves)


def test_where_there_is_no_order_there_is_no_panel() -> None:
    _, rec = drawn(initial={"theta": 0.0})
    with style.applied():
        assert panel(figures_time.overlay(Ladder(rec, "theta", Member(0, 0, "central")))) is None
    assert not Ladder(rec, "nothing", Member(0, 0, "central")).has("local_order")


def test_the_finest_sound_triples_are_chosen() -> None:
    assert figures_time.finest_sound([True] * 5) == [2, 3, 4]
    assert figures_time.finest_sound([False, True, True, False]) == [1, 2]
    assert figures_time.finest_sound([False, False]) == [0]


@pytest.mark.parametrize(
    ("quantity", "letter", "title", "name"),
    [
        ("theta_phase_error", "φ(θ)", "phase error of θ", "the phase error φ(θ) of θ"),
        ("u_amplitude_error", "a(u)", "amplitude error of u", "the amplitude error a(u) of u"),
        (
            "omega_d2t",
            "ω by [D₂ₜu]",
            "ω by [D₂ₜu]",
            "the angular velocity ω by the centred difference [D₂ₜu]",
        ),
    ],
)
def test_parts_of_an_error_have_letters_and_words(
    quantity: str, letter: str, title: str, name: str
) -> None:
    assert words.symbol(quantity) == letter
    assert words.title(quantity) == title
    assert words.name(quantity) == name
