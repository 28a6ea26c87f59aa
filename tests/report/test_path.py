"""The path of a body with two coordinates: what is drawn is what was computed, in a frame of its shape."""

import numpy as np
import pytest
import samples

from vibsim import simulate
from vibsim.report import choice, style, words
from vibsim.report.data import Member
from vibsim.report.figures import gallery, plane

CONTENT = {
    "model": {"kind": "elastic_pendulum", "beta": 0.9, "Theta": 40},
    "initial": {},
    "time": {"end": 6.0},
    "levels": [3, 4, 5, 6],
    "schemes": ["central", "rk4"],
    "checks": [{"converges": "x", "order": 2, "schemes": ["central"]}],
}


def drawn(**changes):
    exp = samples.experiment(**(CONTENT | changes))
    rec = samples.record(exp)
    shown, _ = gallery.choose(rec)
    return exp, rec, shown, plane.path(rec, shown)


@pytest.fixture(scope="module")
def levels():
    return drawn()


def test_every_chosen_level_has_a_panel_with_one_scale(levels):
    _, _, _, picture = levels
    axes = picture.figure.axes
    assert [ax.get_title() for ax in axes] == ["level 3", "level 5", "level 6"]
    for ax in axes:
        assert ax.get_aspect() == 1.0
        (left, right), (low, high) = ax.get_xlim(), ax.get_ylim()
        box = ax.get_position()
        wide, tall = picture.figure.get_size_inches()
        shape = (box.height * tall) / (box.width * wide)
        assert shape == pytest.approx((high - low) / (right - left), rel=1e-9)


@pytest.mark.slow
def test_a_level_that_looks_like_the_finest_one_is_left_out():
    *_, picture = drawn(levels=[5, 8, 11, 12])
    assert [ax.get_title() for ax in picture.figure.axes] == ["level 5", "level 12"]


def test_the_curves_are_the_levels_and_the_reference(levels):
    exp, rec, _, picture = levels
    for ax, level in zip(picture.figure.axes, (3, 5, 6), strict=True):
        lines = ax.get_lines()
        labels = [line.get_label() for line in lines if not line.get_label().startswith("_")]
        assert labels == ["central", "rk4", "reference"]
        stored = simulate(exp, level)
        every = (stored.sizes["t"] - 1) // (len(rec["t"]) - 1)
        for i, line in enumerate((lines[0], lines[2])):
            for name, values in zip(("x", "y"), line.get_data(), strict=True):
                wanted = stored[name].values[i, 0, ::every]
                np.testing.assert_allclose(values, wanted, rtol=0.0, atol=1e-13)
        (left, right), (low, high) = ax.get_xlim(), ax.get_ylim()
        x, y = lines[-1].get_data()
        assert left < x.min() <= x.max() < right
        assert low < y.min() <= y.max() < high


@pytest.mark.parametrize(
    ("key", "told"),
    [
        ("initial.theta = -0.3 rad", "initial θ = −0.3 rad"),
        ("model.parameters.gamma = 1, model.damping.linear = 0", "gamma = 1, linear damping = 0"),
        ("schemes.trap.start = centred", "start of trap = centred"),
        ("time.end = 3 s", "end = 3 s"),
    ],
)
def test_members_are_named_in_words(key, told):
    assert words.swept(key) == told


@pytest.mark.slow
def test_members_of_a_sweep_have_panels_of_their_own():
    _, rec, shown, picture = drawn(sweep={"model.gamma": [0.0, 0.5]})
    titles = [ax.get_title() for ax in picture.figure.axes]
    assert titles == [words.swept(rec.case_name(case)) for case in sorted({m.case for m in shown})]


def test_a_body_at_rest_and_one_coordinate_have_no_path():
    at_rest = {"model": {"kind": "elastic_pendulum", "Theta": 0}}
    assert drawn(**at_rest)[-1] is None
    one = {"model": {"kind": "pendulum"}, "initial": {"theta": 1.0}}
    checks = [{"converges": "theta", "order": 2, "schemes": ["central"]}]
    exp, _, _, picture = drawn(**one, checks=checks)
    assert picture is None
    assert exp.model.definition.position == "theta"


@pytest.mark.slow
@pytest.mark.parametrize(("phase", "is_drawn"), [(0.0, False), (0.3, True)])
def test_coordinates_that_move_together_have_no_path(phase, is_drawn):
    """The deflections of a beam in one mode gave three panels with one straight line."""
    model = {"kind": "system", "coordinates": ["x", "y"], "acceleration": {"x": "-x", "y": "-y"}}
    exp = samples.experiment(
        model=model, initial={"x": 1.0, "y": 0.3, "vy": phase}, schemes=["rk4"], checks=[]
    )
    record = samples.record(exp)
    with style.applied():
        picture = plane.path(record, [Member(0, 0, "rk4")])
    assert (picture is not None) is is_drawn


def test_of_many_coordinates_the_one_that_decides_is_drawn_and_no_path():
    """A path of the first two of a chain says nothing of its motion."""
    chain = {
        "kind": "system",
        "coordinates": ["x", "y", "z"],
        "acceleration": {"x": "y - 2*x", "y": "x - 2*y + z", "z": "y - 2*z"},
    }
    exp = samples.experiment(
        model=chain,
        initial={"x": 1.0},
        time={"end": 6.0},
        levels=[5, 6, 7],
        schemes=["rk4"],
        checks=[{"converges": "z"}],
    )
    record = samples.record(exp)
    decisive = choice.find_lead(record, samples.summary(exp, record))
    shown = gallery.choose(record)[0]
    with style.applied():
        found = gallery.pictures(shown, decisive, [])
    names = [picture.name for picture in found.motion]
    assert names == ["motion_z_0_rk4"]
    estimated = dict(found.belief)["estimated error"]
    assert [picture.name for picture in estimated] == ["solution_z_0_rk4"]
