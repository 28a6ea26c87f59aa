"""The small picture of the index: what fits the experiment, small, well formed, and without what is not finite."""

from __future__ import annotations

import re
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest
import samples

from vibsim.report.data import Member
from vibsim.report.figures import thumbnail

SVG = "{http://www.w3.org/2000/svg}"


def drawn(exp, record=None):
    """Return the kind of a picture, and the points of each of its paths, shape (n, 2)."""
    record = record or samples.record(exp)
    text = thumbnail.thumbnail(record, Member(0, 0, "central"))
    assert text == thumbnail.thumbnail(record, Member(0, 0, "central"))
    assert len(text) < 12_000
    assert not re.search(r"\b(?:nan|inf)\b", text)
    group = ElementTree.fromstring(text).find(f"{SVG}g")
    assert group is not None
    paths = [path.attrib["d"] for path in group.iter(f"{SVG}path")]
    numbers = [np.array(re.findall(r"-?[\d.]+", d), dtype=float) for d in paths]
    if group.attrib["class"] == "map":
        return "map", paths
    points = [found.reshape(-1, 2) for found in numbers]
    for one in points:
        assert one.size == 0 or np.all((one >= 0.0) & (one <= [thumbnail.WIDTH, thumbnail.HEIGHT]))
    return group.attrib["class"], points


def test_a_line_of_members_is_a_response_curve():
    kind, (curve,) = drawn(samples.swept(16))
    assert kind == "curves"
    # the slowest member has no period yet
    assert len(curve) == 15
    # the period of a pendulum rises with its start, the more the higher it is: upwards is a smaller number
    assert np.all(np.diff(curve[:, 0]) > 0.0)
    assert np.all(np.diff(curve[:, 1]) < 0.0)
    assert np.all(np.diff(curve[:, 1], 2) < 0.0)


def test_both_ways_of_a_path_have_the_colours_of_the_page():
    """The way up was red on the index and blue on the page."""
    exp = samples.experiment(
        model={"kind": "duffing", "delta": 0.1, "gamma": 1.0}, initial={"u": 0.0, "v": 0.0}, levels=[1],
        time={"periods": 4, "steps_per_period": 16, "frequency": "model.omega"}, schemes=["rk4"], checks=[],
        sweep={"follow": "model.omega", "model.omega": [*np.linspace(1, 2, 9).tolist(), 1.5]},
    )  # fmt: skip
    text = thumbnail.thumbnail(samples.record(exp), Member(0, 0, "rk4"))
    points = {name: d.count("L") for name, d in re.findall(r'class="(c\d)" d="([^"]*)"', text)}
    assert points == {"c0": 8, "c1": 1}
    assert ".c0{stroke:#0072b2}" in text


def test_few_members_are_shown_by_their_motions():
    kind, curves = drawn(samples.swept(3))
    assert kind == "curves"
    assert len(curves) == 3
    assert all(len(curve) > 50 for curve in curves)


def test_two_swept_keys_are_a_map_that_is_filled():
    sweep = {
        "initial.theta": {"linspace": [0.1, 2.5, 9]},
        "model.L": {"linspace": [0.5, 2.0, 8]},
    }
    kind, paths = drawn(samples.experiment(sweep=sweep, levels=[6, 7]))
    assert kind == "map"
    assert 1 < len(paths) <= thumbnail.SHADES
    cells = re.findall(r"h([\d.]+)v([\d.]+)", "".join(paths))
    area = sum(float(width) * float(height) for width, height in cells)
    assert area == pytest.approx(thumbnail.WIDTH * thumbnail.HEIGHT, rel=0.02)


@pytest.mark.slow
def test_a_body_in_the_plane_has_its_path_with_equal_scales():
    exp = samples.experiment(
        model={"kind": "elastic_pendulum", "beta": 0.9, "Theta": 30.0}, initial={}, checks=[]
    )
    record = samples.record(exp)
    _, (path,) = drawn(exp, record)
    x, y = (np.asarray(record[f"{name}_finest"]).ravel() for name in ("x", "y"))
    assert np.ptp(path[:, 0]) / np.ptp(path[:, 1]) == pytest.approx(np.ptp(x) / np.ptp(y), rel=0.01)


def test_every_scheme_has_a_curve_and_what_leaves_the_motion_is_cut():
    # beyond its limit one scheme grows without bound
    exp = samples.experiment(
        model={"kind": "spring", "w": 1.0},
        initial={"u": 1.0},
        schemes=["rk4", "forward_euler"],
        levels=[6, 7, 8],
        checks=[],
        time={"end": 60.0},
    )
    _, curves = drawn(exp)
    assert len(curves) == 2
    # the bounded one, on top, fills more than half of the height
    assert np.ptp(curves[1][:, 1]) > 0.5 * thumbnail.HEIGHT


def test_of_a_long_run_the_last_periods_are_drawn_unless_its_size_changes():
    """The index had blocks of colour."""
    spring = {"model": {"kind": "spring", "w": 1.0}, "initial": {"u": 1.0}, "levels": [9, 10]}
    end = {"time": {"end": 60 * np.pi}, "checks": []}
    damped = {"model": {"kind": "oscillator", "damping": "0.05*v", "spring": "u"}}
    turns = []
    for exp in (spring, spring | damped):
        _, curves = drawn(samples.experiment(**exp | end))
        turns.append(np.sum(np.diff(np.sign(np.diff(curves[-1][:, 1]))) != 0))
    assert turns[0] == pytest.approx(12, abs=1)
    assert turns[1] > 50


def test_two_coordinates_that_move_together_are_drawn_over_time():
    """Their path was a straight line."""
    exp = samples.experiment(
        model={"kind": "system", "coordinates": ["x", "y"], "acceleration": {"x": "-x", "y": "-y"}},
        initial={"x": 1.0, "y": 0.5},
        checks=[],
    )
    _, curves = drawn(exp)
    assert all(np.all(np.diff(curve[:, 0]) > 0.0) for curve in curves)


@pytest.mark.parametrize("value", [np.nan, np.inf, 0.0])
def test_what_is_not_finite_or_flat_makes_a_picture_too(value):
    exp = samples.plain()
    record = samples.record(exp)
    spoilt = {
        name: replace(variable, values=np.full_like(variable.values, value))
        if np.issubdtype(np.asarray(variable.values).dtype, np.floating)
        else variable
        for name, variable in record.variables.items()
    }
    drawn(exp, replace(record, variables=spoilt))
