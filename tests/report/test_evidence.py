"""The picture that shows a verdict."""

from __future__ import annotations

import re
from xml.etree import ElementTree

import numpy as np
import pytest
import samples

from vibsim.report.evidence import figure, frame
from vibsim.report.evidence.svg_plot import Panel, document

ORDER = {"converges": "theta", "order": "scheme"}


def pictures(*checks, **changes):
    """Return the picture of every check, and the experiment's record."""
    experiment = samples.experiment(checks=list(checks), **changes)
    record = samples.record(experiment)
    told = samples.summary(experiment, record)["checks"]
    pairs = zip(experiment.checks, told, strict=True)
    return [figure.picture(experiment, record, asserted, check) for asserted, check in pairs]


def count(svg, what):
    ElementTree.fromstring(svg)
    return len(re.findall(what, svg))


def test_an_order_has_its_curves_and_a_point_for_every_triple():
    (found,) = pictures(ORDER, levels=[6, 7, 8, 9])
    assert count(found.svg, "<polyline") == 3
    assert count(found.svg, '<circle[^>]*fill="#0072B2"') == 2
    assert count(found.svg, '<circle[^>]*fill="white"') == 0
    assert "rescaled differences of θ [rad]" in found.svg
    assert found.caption.startswith("Left: differences between levels of central")


def test_what_does_not_count_is_hollow():
    coarse = {"initial": {"theta": 3.0}, "time": {"end": 20.0}, "levels": [3, 4, 5, 6]}
    (found,) = pictures(ORDER, **coarse)
    assert count(found.svg, 'fill="white"') == 2


def test_a_number_with_a_border_is_drawn_by_level():
    below = {"value": "relative_energy_error", "at": {"level": 7}, "below": 1.0}
    maximum = {"value": "max", "quantity": "theta", "above": 0.5}
    energy, theta = pictures(below, maximum, levels=[6, 7, 8])
    assert energy is None or count(energy.svg, "<circle") == 3
    assert count(theta.svg, "<circle") == 3
    assert count(theta.svg, '<circle[^>]*fill="#0072B2"') == 1
    assert "max of θ [rad]" in theta.svg
    assert "where it should lie" in theta.caption


def test_a_number_that_must_equal_another_is_drawn_by_its_distance():
    finest = {"value": "period", "equals": 6.7, "rtol": 0.1}
    coarse = {"value": "period", "at": {"level": 6}, "equals": 6.7, "rtol": 0.1}
    drawn, beside = pictures(finest, coarse, levels=[6, 7, 8])
    assert "distance of period [s] from 6.7" in drawn.svg
    assert "what the tolerance allows" in drawn.caption
    # what a coarse level has to give is no limit: the numbers themselves, and the one that it should equal
    assert "what the tolerance allows around 6.7" in beside.caption
    assert "distance" not in beside.svg
    assert re.findall('<circle[^>]*fill="([^"]*)"', beside.svg)[0] == "#0072B2"


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
    shown = count(found.svg, "<circle") + count(found.svg, "h8l-4")
    assert shown == len(levels)
    assert count(found.svg, '<(circle|path)[^>]*fill="#0072B2"') == 1
    assert "level 6:" in found.caption or len(levels) > 1


@pytest.mark.parametrize("border", [{"equals": 6.7, "atol": 1e-3}, {"below": 6.8}, {"above": 6.0}])
def test_an_extrapolated_number_stands_behind_the_levels_with_its_error_bar(border):
    check = {"value": "period", "at": {"level": "best"}, **border}
    (found,) = pictures(check, levels=[6, 7, 8])
    assert count(found.svg, "<circle") == 4
    assert re.findall('<circle[^>]*fill="([^"]*)"', found.svg)[-1] == "#0072B2"
    assert count(found.svg, '<polyline[^>]*stroke="#0072B2"') == 1
    assert ">best<" in found.svg
    assert "the bar is the bound of its error" in found.caption


def test_a_number_that_no_run_enters_has_no_picture():
    (found,) = pictures({"value": "stability_limit", "equals": 2.0}, levels=[6, 7, 8])
    assert found is None


def test_a_number_of_two_levels_stands_at_the_coarser_one():
    check = {"value": "max_abs_ratio", "quantity": "energy_deviation", "above": 3.5}
    (found,) = pictures(check, levels=[6, 7, 8])
    assert re.findall('<circle[^>]*fill="([^"]*)"', found.svg) == ["white", "#0072B2"]
    assert pictures(check, levels=[6]) == [None]


def test_a_number_that_is_hit_exactly_is_drawn():
    check = {"value": "accepted_steps", "equals": 256.0, "rtol": 0.1}
    (found,) = pictures(check, levels=[6, 7, 8])
    assert count(found.svg, "<circle") == 2
    assert count(found.svg, '<path[^>]*fill="#0072B2"') == 1
    assert "a triangle at the lower edge has no distance at all" in found.caption


def test_a_large_sweep_without_series_has_the_order_alone():
    many = {"sweep": {"initial.theta": {"linspace": [0.1, 1.0, 2100]}}, "levels": [7, 8, 9]}
    (found,) = pictures(ORDER, time={"end": 3.0}, **many)
    assert count(found.svg, "<polyline") == 0
    assert count(found.svg, "<circle") == 1
    assert found.caption.startswith("central, initial.theta = ")


def test_names_of_a_user_are_text():
    (found,) = pictures(ORDER, levels=[6, 7, 8], schemes=[{"kind": "rk4", "label": "a<b>&"}])
    assert count(found.svg, "<b>") == 0


def test_points_beyond_the_frame_are_triangles_on_its_edge():
    panel = Panel((0.0, 4.0), (1.0, 3.0))
    panel.points([1, 2, 3], np.array([2.0, 9.0, -9.0]), [True, True, False], "black")
    svg = document([panel], "three points")
    assert count(svg, "<circle") == 1
    above, below = re.findall(r'd="M[\d.]+ ([\d.]+)h8l-4 (-?\d)z"', svg)
    assert (above[1], below[1]) == ("-5", "5")
    assert float(above[0]) < float(below[0])


@pytest.mark.parametrize(
    ("low", "high", "texts"),
    [
        (0.0, 20.0, ["0", "5", "10", "15", "20"]),
        (-0.052, 0.055, ["−0.05", "0", "0.05"]),
        (0.9991, 1.0003, ["0.9995", "1"]),
        # the round step would leave 0 alone
        (-0.047, 0.049, ["−0.04", "−0.02", "0", "0.02", "0.04"]),
    ],
)
def test_ticks_are_round(low, high, texts):
    assert [text for _, text in frame.ticks(low, high)] == texts


@pytest.mark.parametrize(
    ("low", "high", "texts"),
    [
        (-14.2, -11.0, ["10⁻¹⁵", "10⁻¹⁴", "10⁻¹³", "10⁻¹²", "10⁻¹¹"]),
        (0.0, 1.0, ["1", "2", "5", "10", "20", "50"]),
        (-20.0, 300.0, ["10⁰", "10¹⁰⁰", "10²⁰⁰", "10³⁰⁰"]),
    ],
)
def test_ticks_of_a_logarithmic_scale_are_few(low, high, texts):
    assert [text for _, text in frame.log_ticks(low, high)] == texts


def test_a_short_logarithmic_scale_has_round_numbers():
    found = frame.log_ticks(0.30, 0.36)
    assert [text for _, text in found] == ["2", "2.1", "2.2"]
    assert [value for value, _ in found] == pytest.approx(np.log10([2.0, 2.1, 2.2]))


def test_growth_near_1_is_shown_less_1():
    near, wide, huge = (frame.growth_scale(np.array([1.0, x])) for x in (1.0 + 1e-9, 1.5, 100.0))
    assert near.title == "growth per period, less 1"
    assert near.change(np.array([1.0 + 1e-9]))[0] == pytest.approx(1e-9, rel=1e-6)
    assert wide.change(np.array([1.5]))[0] == 1.5
    assert huge.change(np.array([100.0]))[0] == 2.0


def test_an_error_in_a_norm_is_drawn_on_a_logarithmic_scale():
    check = {"value": "error_linf", "quantity": "theta", "below": 1e-2}
    (found,) = pictures(check, levels=[6, 7, 8, 9])
    assert count(found.svg, "<circle") == 4
    heights = [float(y) for y in re.findall(r'<circle cx="[\d.]+" cy="([\d.]+)"', found.svg)]
    assert np.diff(heights) == pytest.approx(np.diff(heights)[0], rel=0.1)
    assert "error linf of θ [rad]" in found.svg
