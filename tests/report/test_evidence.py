"""The picture that shows a verdict."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np
import pytest
import samples
from drawn import BLUE, curves, dots, marks, texts

from vibsim.report import choice, style
from vibsim.report.evidence import figure, frame

ORDER = {"converges": "theta", "order": "scheme"}


def pictures(*checks, **changes):
    """Return the picture of every check, and the experiment's record."""
    experiment = samples.experiment(checks=list(checks), **changes)
    record = samples.record(experiment)
    told = samples.summary(experiment, record)["checks"]
    return [figure.picture(choice.of_check(record, check)) for check in told]


def test_an_order_has_its_curves_and_a_point_for_every_triple():
    (found,) = pictures(ORDER, levels=[6, 7, 8, 9])
    assert sum(len(line.get_xdata()) > 2 for line in curves(found, axes=0)) == 3
    assert len(dots(found, BLUE)) == 2
    assert len(dots(found, "white")) == 0
    assert "rescaled differences of θ [rad]" in texts(found)
    assert "rescaled differences of θ [rad]" in samples.element(found)
    assert found.caption.startswith("Left: differences between levels of central")


def test_what_does_not_count_is_hollow():
    coarse = {"initial": {"theta": 3.0}, "time": {"end": 20.0}, "levels": [3, 4, 5, 6]}
    (found,) = pictures(ORDER, **coarse)
    assert len(marks(found, "white")) == 2


def test_a_number_with_a_border_is_drawn_by_level():
    below = {"value": "relative_energy_error", "at": {"level": 7}, "below": 1.0}
    maximum = {"value": "max", "quantity": "theta", "above": 0.5}
    energy, theta = pictures(below, maximum, levels=[6, 7, 8])
    assert energy is None or len(dots(energy)) == 3
    assert len(dots(theta)) == 3
    assert len(dots(theta, BLUE)) == 1
    assert "largest value of θ [rad]" in texts(theta)
    assert "where it should lie" in theta.caption


def test_a_number_that_must_equal_another_is_drawn_by_its_distance():
    finest = {"value": "period", "equals": 6.7, "rtol": 0.1}
    coarse = {"value": "period", "at": {"level": 6}, "equals": 6.7, "rtol": 0.1}
    drawn, beside = pictures(finest, coarse, levels=[6, 7, 8])
    assert "distance of period [s] from 6.7" in texts(drawn)
    assert "what the tolerance allows" in drawn.caption
    # what a coarse level has to give is no limit: the numbers themselves, and the one that it should equal
    assert "what the tolerance allows around 6.7" in beside.caption
    assert "distance" not in " ".join(texts(beside))
    assert dots(beside, BLUE) == [dots(beside)[0]]


PLACES = [
    {"value": "at", "quantity": "theta", "at": {"t": 5.0}, "equals": 0.1, "atol": 0.1},
    {"value": "end", "quantity": "theta", "at": {"step": 64, "level": 6}, "below": 2.0},
    {"value": "running_max", "quantity": "energy_deviation", "at": {"t": 5.0}, "below": 1.0},
    {"value": "error_linf", "quantity": "theta", "at": {"level": 6}, "below": 1.0},
    {"value": "growth_per_period", "equals": 1.0, "atol": 1e-3},
]


@pytest.mark.parametrize("check", PLACES)
@pytest.mark.parametrize("levels", [[6], [6, 7, 8]])
def test_a_number_at_a_time_or_of_one_level_is_drawn(check, levels):
    (found,) = pictures(check, levels=levels)
    assert len(marks(found)) == len(levels)
    assert len(marks(found, BLUE)) == 1
    assert "level 6:" in found.caption or len(levels) > 1


@pytest.mark.parametrize("border", [{"equals": 6.7, "atol": 1e-3}, {"below": 6.8}, {"above": 6.0}])
def test_an_extrapolated_number_stands_behind_the_levels_with_its_error_bar(border):
    check = {"value": "period", "at": {"level": "best"}, **border}
    (found,) = pictures(check, levels=[6, 7, 8])
    assert len(dots(found)) == 4
    assert dots(found, BLUE) == [dots(found)[-1]]
    assert len(curves(found, BLUE)) == 1
    assert "best" in texts(found)
    assert "the bar is the bound of its error" in found.caption


def test_a_number_that_no_run_enters_has_no_picture():
    (found,) = pictures({"value": "stability_limit", "equals": 2.0}, levels=[6, 7, 8])
    assert found is None


def test_a_number_of_two_levels_stands_at_the_coarser_one():
    check = {"value": "max_abs_ratio", "quantity": "energy_deviation", "above": 3.5}
    (found,) = pictures(check, levels=[6, 7, 8])
    assert dots(found) == dots(found, "white") + dots(found, BLUE)
    assert len(dots(found)) == 2
    assert pictures(check, levels=[6]) == [None]


def test_a_number_that_is_hit_exactly_is_drawn():
    check = {"value": "accepted_steps", "equals": 256.0, "rtol": 0.1}
    (found,) = pictures(check, levels=[6, 7, 8])
    assert len(dots(found)) == 2
    assert len(marks(found, BLUE)) == 1
    assert dots(found, BLUE) == []
    assert "a triangle at the lower edge has no distance at all" in found.caption


def test_a_large_sweep_without_series_has_the_order_alone():
    many = {"sweep": {"initial.theta": {"linspace": [0.1, 1.0, 2100]}}, "levels": [7, 8, 9]}
    (found,) = pictures(ORDER, time={"end": 3.0}, **many)
    assert len(found.figure.axes) == 1
    assert len(dots(found)) == 1
    assert found.caption.startswith("central, initial θ = ")


def test_names_of_a_user_are_text():
    (found,) = pictures(ORDER, levels=[6, 7, 8], schemes=[{"kind": "rk4", "label": "a<b>&"}])
    assert "<b>" not in samples.element(found)
    ElementTree.fromstring(samples.element(found))


def test_points_beyond_the_frame_are_triangles_on_its_edge():
    with style.applied():
        ax = frame.panel(style.canvas(1.0), "three points", "x")
    ax.set_ylim(1.0, 3.0)
    frame.points(ax, [1, 2, 3], np.array([2.0, 9.0, -9.0]), [True, True, False])
    drawn = {line.get_marker(): line for line in ax.lines}
    assert sorted(drawn) == ["^", "o", "v"]
    for marker, place, edge in (("^", 2.0, 1.0), ("v", 3.0, 0.0)):
        assert drawn[marker].get_transform() == ax.get_xaxis_transform()
        assert [float(x) for x in drawn[marker].get_xdata()] == [place]
        assert drawn[marker].get_ydata().tolist() == [edge]


def ticks(low, high, *, is_log):
    """Return the values and texts on a vertical axis."""
    with style.applied():
        ax = frame.panel(style.canvas(1.0), "ticks", "x")
        if is_log:
            style.log_axis(ax, "y", 10.0**low, 10.0**high, most=5)
        else:
            frame.round_ticks(ax.yaxis)
            ax.set_ylim(low, high)
        ax.figure.draw_without_rendering()
    at = ax.yaxis.get_major_locator()()
    bottom, top = ax.get_ylim()
    named = zip(at, ax.yaxis.get_major_formatter().format_ticks(at), strict=True)
    return [(value, text) for value, text in named if bottom <= value <= top]


@pytest.mark.parametrize(
    ("low", "high", "expected"),
    [
        (0.0, 20.0, ["0", "5", "10", "15", "20"]),
        (-0.052, 0.055, ["−0.05", "0", "0.05"]),
        (0.9991, 1.0003, ["0.9995", "1"]),
        # the round step would leave 0 alone
        (-0.047, 0.049, ["−0.04", "−0.02", "0", "0.02", "0.04"]),
    ],
)
def test_ticks_are_round(low, high, expected):
    assert [text for _, text in ticks(low, high, is_log=False)] == expected


@pytest.mark.parametrize(
    ("low", "high", "expected"),
    [
        (-14.2, -11.0, ["10⁻¹⁴", "10⁻¹³", "10⁻¹²", "10⁻¹¹"]),
        (0.0, 1.0, ["1", "2", "5", "10"]),
        (-20.0, 289.0, ["10⁰", "10¹⁰⁰", "10²⁰⁰"]),
    ],
)
def test_ticks_of_a_logarithmic_scale_are_few(low, high, expected):
    assert [text for _, text in ticks(low, high, is_log=True)] == expected


def test_a_short_logarithmic_scale_has_round_numbers():
    found = ticks(0.30, 0.36, is_log=True)
    assert [text for _, text in found] == ["2", "2.1", "2.2"]
    assert [value for value, _ in found] == pytest.approx([2.0, 2.1, 2.2])


def test_growth_near_1_is_shown_less_1():
    near, wide, huge = (frame.growth_scale(np.array([1.0, x])) for x in (1.0 + 1e-9, 1.5, 100.0))
    assert near.title == "growth per period, less 1"
    assert (near.less, wide.less, huge.less) == (1.0, 0.0, 0.0)
    assert (near.is_log, wide.is_log, huge.is_log) == (False, False, True)


def test_an_error_in_a_norm_is_drawn_on_a_logarithmic_scale():
    check = {"value": "error_linf", "quantity": "theta", "below": 1e-2}
    (found,) = pictures(check, levels=[6, 7, 8, 9])
    assert len(dots(found)) == 4
    assert found.figure.axes[0].get_yscale() == "log"
    heights = np.log(sorted(y for _, y in dots(found)))
    assert np.diff(heights) == pytest.approx(np.diff(heights)[0], rel=0.1)
    assert "largest error of θ [rad]" in texts(found)


def test_a_range_too_narrow_for_its_numbers_has_one_of_them():
    with style.applied():
        ax = style.canvas(2.0).add_subplot()
        frame.scale(ax, np.array([3.0 - 1e-9, 3.0 + 1e-9]))
        told = ax.yaxis.get_major_formatter().format_ticks(ax.get_yticks())
    assert told == ["3"]
