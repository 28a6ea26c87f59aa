"""The player: what is drawn is where the record says that it is, small enough, and only where it can be drawn."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest
import samples
from thinned import thinned

from vibsim.report.data import Results
from vibsim.report.figures import scenes
from vibsim.report.page import player

PENDULUM = {"kind": "pendulum"}
DRAGGED = {"kind": "pendulum", "drag": 0.4}
BALL = {"kind": "bouncing_ball", "restitution": 0.8}
VEHICLE = {
    "kind": "vehicle",
    "speed": 2.0,
    "parameters": {"H": 0.1},
    "road": "H*sin(x)",
    "spring": "4*u",
}
MODELS = {
    "pendulum": (PENDULUM, {"theta": 1.0}),
    "dragged": (DRAGGED, {"theta": 1.0}),
    "over the top": (PENDULUM, {"theta": 0.0, "omega": 2.5}),
    "linear_pendulum": ({"kind": "linear_pendulum"}, {"theta": 1.0}),
    "physical_pendulum": ({"kind": "physical_pendulum", "drag": 0.2}, {"theta": 1.0}),
    "elastic_pendulum": ({"kind": "elastic_pendulum", "gamma": 0.1}, {}),
    "vehicle": (VEHICLE, {"u": 0.1}),
    "bouncing_ball": (BALL, {"h": 1.0}),
    "sliding_box": ({"kind": "sliding_box"}, {"u": 1.0}),
    "washing_machine": ({"kind": "washing_machine"}, {"u": 0.1}),
    "spring": ({"kind": "spring"}, {"u": 1.0}),
    "duffing": ({"kind": "duffing"}, {"u": 1.0}),
    "oscillator": (
        {"kind": "oscillator", "damping": {"linear": 0.2}, "force": "2*cos(3*t)"},
        {"u": 1.0},
    ),
    # the force that makes this the solution names the coefficient of damping, a parameter with a path
    "manufactured": (
        {"kind": "oscillator", "damping": {"linear": 0.2}, "exact": "cos(t)"},
        {},
    ),
}


def made(name="pendulum", **changes):
    model, initial = MODELS[name]
    scheme = {"kind": "central"} if name != "bouncing_ball" else {"kind": "rk4"}
    exp = samples.experiment(
        **({"model": model, "initial": initial, "schemes": [scheme], "checks": []} | changes)
    )
    return samples.record(exp)


def element(record):
    return player.element(record)


def data(text):
    found = re.search(r'<script type="application/json">(.*?)</script>', text, re.DOTALL)
    assert found is not None
    return json.loads(found.group(1))


def at(lane, look, k):
    """Return a number of the parts of a look at every time, in pixels, shape (t,)."""
    part = next(part for part in lane.scene.parts if part.look == look)
    return np.broadcast_to(part.at[k], lane.motion.t.shape)


@pytest.mark.parametrize("name", thinned(MODELS, 2))
def test_every_system_is_drawn_within_its_frame(name):
    record = made(name)
    text, shown = element(record), player.lanes(record)
    assert text == element(record)
    assert len(text) < 200_000
    assert not {"NaN", "Infinity"} & set(re.findall(r"\w+", json.dumps(data(text))))
    assert len(data(text)["lanes"]) == len(shown) > 0
    for lane, packed in zip(shown, data(text)["lanes"], strict=True):
        assert len(packed["u"]) == lane.motion.t.size > 200
        for part, row in zip(lane.scene.parts, packed["parts"], strict=True):
            for column, values in zip(part.at, row["at"], strict=True):
                scale = 10.0 if isinstance(values, list) else 1.0
                assert np.allclose(np.array(values) / scale, column, rtol=0.0, atol=0.06)
            if part.shape != "track":
                for column, most in zip(part.at, (scenes.WIDTH, scenes.HEIGHT), strict=False):
                    assert 0.0 <= np.min(column) <= np.max(column) <= most
        # something moves
        assert any(isinstance(column, list) for row in packed["parts"] for column in row["at"])


@pytest.mark.parametrize("name", ["dragged", "over the top", "physical_pendulum"])
def test_the_forces_on_a_pendulum_are_those_of_the_model(name):
    record = made(name)
    lane = player.lanes(record)[0]
    (x, y), motion = (at(lane, "body", k) for k in (0, 1)), lane.motion
    x0, y0 = (at(lane, "pivot", k) for k in (0, 1))
    length = np.hypot(x - x0, y - y0)
    assert np.ptp(length) < 1e-9
    down = np.arctan2(x - x0, y - y0)
    assert np.allclose(np.cos(down), np.cos(motion.states["theta"]))
    along = np.array([x - x0, y - y0]) / length
    pull, gravity = (
        np.array([at(lane, look, 2), at(lane, look, 3)]) for look in ("pull", "gravity")
    )
    weight = float(np.hypot(*gravity)[0])
    assert np.all(gravity[1] > 0.0)
    # the force in the wire is what turns the bob, and what carries its weight (m = L = g = 1)
    omega = motion.states["omega"]
    most = scenes.LONGEST / scenes.WEIGHT
    wanted = np.clip(along[1] + omega**2, -most, most)
    assert np.allclose(-np.sum(pull * along, axis=0) / weight, wanted, atol=1e-6)
    if motion.has("drag_force"):
        drag = np.array([at(lane, "drag", 2), at(lane, "drag", 3)])
        moves = np.array([np.gradient(x, motion.t), np.gradient(y, motion.t)])
        power = np.sum(drag * moves, axis=0)[2:-2]
        # but for the turns, where both are next to nothing
        assert power.max() < 1e-3 * -power.min()


@pytest.mark.parametrize("name", thinned(["dragged", "over the top", "elastic_pendulum"], 3))
def test_forces_and_angle_are_labelled_and_the_legend_names_what_is_magnified(name):
    record = made(name)
    lane = player.lanes(record)[0]
    labels = {part.look: part.label for part in lane.scene.parts if part.label}
    assert labels.keys() >= {"angle", "gravity", "pull"}
    told = dict(lane.scene.legend)
    assert all(text.split()[-1] in told[look] for look, text in labels.items() if look in told)
    assert ("drag" in labels) == ("5 times" in told.get("drag", ""))
    # the arc goes from below to the wire, also after a whole turn
    x0, y0, x1, y1 = (at(lane, "wire", k) for k in range(4))
    arc = next(part for part in lane.scene.parts if part.look == "angle")
    length = np.hypot(x1 - x0, y1 - y0)
    for k in range(0, lane.motion.t.size, 7):
        (line,) = scenes.strokes("arc", scenes.values_of(arc, k))
        along = np.array([x1[k] - x0[k], y1[k] - y0[k]]) / length[k]
        assert line[0] == pytest.approx((x0[k], y0[k] + arc.at[2]))
        assert (np.array(line[-1]) - (x0[k], y0[k])) / arc.at[2] == pytest.approx(along, abs=1e-6)


def test_the_wheel_stays_on_the_road_and_the_body_where_the_record_says():
    record = made("vehicle")
    lane = player.lanes(record)[0]
    t, wheel, body = lane.motion.t, at(lane, "wheel", 1), at(lane, "body", 1)
    road = 0.1 * np.sin(2.0 * t)
    scale = np.ptp(wheel) / np.ptp(road)
    assert np.allclose(np.gradient(wheel), np.gradient(-scale * road), atol=1e-6 * scale)
    lift = wheel - body
    assert np.allclose(
        lift - lift.mean(), scale * (u := lane.motion.states["u"]) - scale * u.mean()
    )


def test_a_ball_touches_the_ground_at_each_impact_and_never_passes_it():
    record = made("bouncing_ball", time={"end": 5.0}, levels=[5, 6, 7])
    lane = player.lanes(record)[0]
    h = lane.motion.states["h"]
    assert h.min() >= 0.0
    low = (h[1:-1] < h[:-2]) & (h[1:-1] <= h[2:])
    # at most what it falls in half a frame
    assert h[1:-1][low].size >= 2
    assert h[1:-1][low].max() < 2.0 * (lane.motion.t[1] - lane.motion.t[0])


def test_a_second_motion_is_shown_where_it_differs_visibly():
    both = player.lanes(made(levels=[6, 7, 8, 9], time={"end": 20.0}))
    assert len(both) == 2
    apart = np.abs(both[0].motion.states["theta"] - both[1].motion.states["theta"])
    assert apart.max() > player.VISIBLE
    assert len(player.lanes(made(levels=[9, 10, 11], time={"end": 20.0}))) == 1


def test_a_long_run_has_a_window_that_moves_and_the_page_says_what_it_leaves_out():
    short, long, longer = (
        made("spring", time={"end": end}, levels=levels)
        for end, levels in ((30.0, [9, 10]), (200.0, [11, 12]), (6000.0, [16, 17]))
    )
    for record, is_whole, is_cut in ((short, 1, 0), (long, 0, 0), (longer, 0, 1)):
        text = element(record)
        found = data(text)
        span = found["t"][1] - found["t"][0]
        assert (found["window"] == pytest.approx(span)) == bool(is_whole)
        assert ("are shown" in text) == bool(is_cut)
        assert span <= record.experiment.time.end
        assert len(text) < 200_000


@pytest.mark.parametrize(
    "changes",
    [
        {"model": {"kind": "circuit", "voltage": "sin(t)"}, "initial": {}},
        {"initial": {"theta": 0.0}},
        {"initial": {"theta": 1.0}, "time": {"end": 1e6}, "levels": [3, 4, 5]},
    ],
    ids=["no displacement", "at rest", "broken down"],
)
def test_what_cannot_be_drawn_has_no_player(changes):
    record = made(**changes)
    assert element(record) == ""


def test_a_member_of_a_sweep_is_drawn_with_its_own_parameters():
    sweep = {"model.speed": [1.0, 4.0]}
    record = made("vehicle", sweep=sweep, time={"end": 10.0})
    lane = player.lanes(record)[0]
    speed = float(lane.motion.parameters["speed"])
    assert f"speed = {speed:g} " in lane.title
    track = next(part for part in lane.scene.parts if part.shape == "track")
    last = float(re.findall(r"([\d.]+) [\d.]+$", track.outline)[0])
    assert last > 0.0
    offsets = np.asarray(track.at[0])
    assert np.ptp(offsets) == pytest.approx(last - scenes.WIDTH, abs=1.0)


def test_a_run_that_is_shown_whole_is_not_called_cut_where_its_members_differ_in_length():
    sweep = {"model.w": [0.5, 0.7, 1.0, 2.0, 3.0]}
    time = {"periods": 5, "steps_per_period": 2}
    record = made("spring", sweep=sweep, time=time, levels=[5, 6, 7])
    text = element(record)
    assert "w = 2 " in text
    assert "are shown" not in text


def test_data_cannot_end_its_script(monkeypatch):
    record = made()
    monkeypatch.setattr(Results, "time_unit", "</script><b>")
    text = element(record)
    assert text.count("</script>") == 2
    assert data(text)["unit"] == "</script><b>"


def test_a_body_on_a_spring_has_its_dashpot_and_its_force_where_it_has_any():
    record = made("oscillator")
    lane = player.lanes(record)[0]
    arrow = next(part for part in lane.scene.parts if part.shape == "arrow")
    ratio = arrow.at[2] / np.cos(3.0 * lane.motion.t)
    assert ratio == pytest.approx(scenes.FORCE, rel=1e-6)
    body = next(part for part in lane.scene.parts if part.look == "body")
    rod = [part for part in lane.scene.parts if part.shape == "line"][-1]
    assert rod.at[2] == pytest.approx(body.at[0] - 18.0)
    assert ("pull", "driving force") in lane.scene.legend
    record = made("spring")
    shapes = [part.shape for part in player.lanes(record)[0].scene.parts]
    assert shapes.count("spring") == 1
    assert "arrow" not in shapes
    assert shapes.count("box") == 1


def test_a_force_from_a_table_has_its_arrow(tmp_path, monkeypatch):
    (tmp_path / "push.csv").write_text("\n".join(["t,f", "0,0", "1,2", "2,-1", "3,4", "4,0"]))
    monkeypatch.chdir(tmp_path)
    model = {
        "kind": "system",
        "force": "-4*u - 0.3*v + input/2",
        "mass": 1.5,
        "input": {"table": "push.csv", "x": "t", "h": "f"},
    }
    exp = samples.experiment(
        model=model,
        initial={"u": 0.1},
        time={"steps_per_point": 4},
        levels=[0, 1, 2],
        schemes=["rk4"],
        checks=[],
    )
    lane = player.lanes(samples.record(exp))[0]
    arrow = next(part for part in lane.scene.parts if part.look == "pull")
    # at the points of the table
    heights = arrow.at[2][np.searchsorted(lane.motion.t, [1.0, 2.0, 3.0])]
    assert heights / heights[0] == pytest.approx([1.0, -0.5, 2.0])
