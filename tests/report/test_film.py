"""What a movie shows: the times of its frames and the window, without drawing any."""

from __future__ import annotations

import numpy as np
import pytest
import samples

from vibsim.report.data import Results
from vibsim.report.movie import film
from vibsim.simulation import simulate_record


def shown(end=20.0, level=10, model=None, initial=None, end_shown=None, **options):
    model, initial = model or {"kind": "spring"}, initial or {"u": 1.0}
    exp = samples.experiment(
        model=model, initial=initial, time={"end": end}, levels=[level - 1, level], schemes=["central"], checks=[],
    )  # fmt: skip
    record = Results.of(exp, simulate_record(exp, level))
    name = exp.model.definition.position
    run = film.run(record, "central", name)
    return film.film(record, [run], name, end=end_shown, **{"fps": 25.0} | options)


def test_a_short_run_is_shown_whole_and_a_long_one_in_a_window_that_moves():
    short, long = shown(end=9 * 2 * np.pi), shown(end=40 * 2 * np.pi)
    assert short.window == pytest.approx(9 * 2 * np.pi)
    assert long.window == pytest.approx(6 * 2 * np.pi, rel=0.02)
    assert shown(end=40 * 2 * np.pi, periods=4.0).window == pytest.approx(4 * 2 * np.pi, rel=0.02)
    # 40 periods have fewer frames each, but they are all there
    assert long.t.size == film.MOST_FRAMES
    assert not long.is_cut


def test_of_a_very_long_run_the_beginning_is_shown_unless_frames_are_named():
    very_long = shown(end=400 * 2 * np.pi, level=14)
    assert very_long.is_cut
    periods = very_long.t[-1] / (2 * np.pi)
    assert very_long.t.size / periods == pytest.approx(film.FEWEST_FRAMES_A_PERIOD, rel=0.02)
    asked = shown(end=400 * 2 * np.pi, level=14, frames=100)
    assert asked.t.size == 100
    assert asked.t[-1] == pytest.approx(400 * 2 * np.pi)
    assert not asked.is_cut


def test_a_part_of_the_time_has_the_frames_of_that_part():
    part = shown(end=40 * 2 * np.pi, start=10.0, end_shown=20.0)
    assert (part.t[0], part.t[-1]) == (10.0, 20.0)
    assert part.t.size == 200  # 8 s at least


def test_a_run_that_breaks_down_and_a_system_without_a_drawing_have_the_window_alone():
    assert shown(end=20.0).scenes
    assert shown(model={"kind": "circuit", "voltage": "sin(t)"}, initial={"i": 1.0}).scenes == ()
    broken = shown(end=1e7, level=5, initial={"u": 1.0}, frames=3)
    assert broken.scenes == ()
    assert np.isfinite(broken.t).all()


def test_a_computed_solution_is_not_called_exact():
    pendulum = {"kind": "pendulum", "drag": 0.1}
    assert shown(model=pendulum, initial={"theta": 1.0}).name_of_exact == "reference"
    assert shown().name_of_exact == "exact"
