"""The picture that shows a verdict."""

from __future__ import annotations

import re
from xml.etree import ElementTree

import numpy as np
import pytest
import samples

from vibsim.report import evidence
from vibsim.report.stamp import Panel, document

ORDER = {"converges": "theta", "order": "scheme"}


def pictures(*checks, **changes):
    """Return the picture of every check, and the experiment's record."""
    experiment = samples.experiment(checks=list(checks), **changes)
    record = samples.record(experiment)
    told = samples.summary(experiment, record)["checks"]
    pairs = zip(experiment.checks, told, strict=True)
    return [evidence.picture(experiment, record, asserted, check) for asserted, check in pairs]


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
    drawn, none = pictures(finest, coarse, levels=[6, 7, 8])
    assert "distance of period [s] from 6.7" in drawn.svg
    assert "what the tolerance allows" in drawn.caption
    assert none is None


def test_a_large_sweep_without_series_has_the_order_alone():
    many = {"sweep": {"initial.theta": {"linspace": [0.1, 1.0, 2100]}}, "levels": [7, 8, 9]}
    (found,) = pictures(ORDER, time={"end": 3.0}, **many)
    assert count(found.svg, "<polyline") == 0
    assert count(found.svg, "<circle") == 1
    assert found.caption.startswith("central, initial.theta = ")


def test_names_of_a_user_are_text():
    (found,) = pictures(ORDER, levels=[6, 7, 8], schemes=[{"kind": "rk4", "label": "a<b>&"}])
    assert count(found.svg, "<b>") == 0


def test_other_checks_have_none():
    equal = {"equal": ["central", "exact"], "quantity": "theta", "atol": 1.0}
    assert pictures({"stable": True}, equal, levels=[6, 7, 8]) == [None, None]


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
    ],
)
def test_ticks_are_round(low, high, texts):
    assert [text for _, text in evidence._ticks(low, high)] == texts
