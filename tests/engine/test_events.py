"""Steps that events divide: where they are, what rests afterwards, in every lane, with every parameter."""

import itertools
import math

import event_runs as runs_of
import numpy as np
import pytest
from event_runs import BALL, BOX, DRIVEN, TREATMENTS, numbers_of
from same_bits import arrays, assert_same_bits
from thinned import thinned

from vibsim.core.errors import SimulationError
from vibsim.engine import integrate
from vibsim.engine.events import MOST_EVENTS
from vibsim.engine.kernel import source
from vibsim.models import MODELS
from vibsim.models.bouncing_ball import impact_time, last_impact
from vibsim.models.oscillator import written
from vibsim.schemes import FIXED_STEP

KINDS = ["central", "rk4", "ab3", "crank_nicolson", "generalized_alpha", "velocity_verlet"]


def several(model, count=9, seed=5):
    """Members that rest at once, soon, later, and never."""
    rng = np.random.default_rng(seed)
    parameters = np.array([[row.default for row in model.parameters]] * count)
    parameters *= rng.uniform(0.5, 1.2, parameters.shape)
    if model is BALL:
        parameters[0, 1], parameters[1, 1], parameters[2, 3] = 0.0, 1.0, 0.0
        initial = np.column_stack([rng.uniform(0.0, 2.0, count), rng.uniform(-2.0, 2.0, count)])
        initial[3] = 0.0
    else:
        initial = rng.uniform(-2.0, 2.0, (count, 2))
        initial[:3, 1] = 0.0
        initial[3] = 0.0
    if model is DRIVEN:
        parameters[:, 1:] = [0.6, 1.0, 1.0, 0.5]
    return parameters, initial, np.linspace(0.02, 0.3, count)


LANES = [
    *((BOX, "central", events) for events in TREATMENTS),
    (DRIVEN, "rk4", "located"),
    (BALL, "rk4", "located"),
]
MORE = [
    (model, kind, events)
    for model in (BOX, DRIVEN, BALL)
    for kind in KINDS
    for events in TREATMENTS
    if (model, kind, events) not in LANES
]


def named(model, kind, events):
    return f"{model.kind}-{kind}-{events}"


@pytest.mark.parametrize(
    ("model", "kind", "events"),
    [
        *(pytest.param(*row, id=named(*row)) for row in LANES),
        *(pytest.param(*row, id=named(*row), marks=pytest.mark.slow) for row in MORE),
    ],
)
def test_both_lanes_give_the_same_bits(model, kind, events):
    scheme = FIXED_STEP[kind]
    options = {**scheme.defaults(), "events": events}
    more = {"with_series": True, "n_extrema": 5}
    plain, scalar, threaded = (
        integrate(model, scheme, options, *several(model), 96, 4, lane=lane, threads=n, **more)
        for lane, n in (("plain", 1), ("scalar", 1), ("scalar", 3))
    )
    assert_same_bits(plain, scalar)
    assert_same_bits(plain, threaded)
    assert np.isfinite(plain.position).all()
    assert plain.events.event_count.max() > 3
    for i in range(9):
        alone = integrate(
            model, scheme, options, *(x[i : i + 1] for x in several(model)), 96, 4, **more
        )
        for (name, a), (_, b) in zip(arrays(alone), arrays(plain), strict=True):
            assert a.tobytes() == b[i : i + 1].tobytes(), name


def test_members_with_events_are_not_stepped_in_blocks():
    scheme = FIXED_STEP["central"]
    with pytest.raises(SimulationError, match="sliding_box has events"):
        integrate(BOX, scheme, scheme.defaults(), *several(BOX), 8, 1, lane="blocks")
    many = integrate(BOX, scheme, scheme.defaults(), *several(BOX, 600), 96, 96)
    few = integrate(BOX, scheme, scheme.defaults(), *(x[:5] for x in several(BOX, 600)), 96, 96)
    assert many.position[:5].tobytes() == few.position.tobytes()


@pytest.mark.slow
def test_kernels_of_smooth_models_hold_nothing_of_events():
    for model in MODELS.values():
        for scheme in FIXED_STEP.values():
            if scheme.treats(model):
                text = source(model, scheme.stepper_for(model, scheme.defaults()))
                assert ("passed" in text) == (model.events is not None)


@pytest.mark.parametrize("lane", ["plain", "scalar"])
def test_turns_that_are_events_have_their_time_and_height(lane):
    """A parabola through three points around a corner is off by dt^2 in time, an event by the error of the scheme."""
    more = {"n_extrema": 3, "lane": lane}
    found = runs_of.run(BOX, "rk4", {"mu": 0.1}, (1.0, 0.0), 15.0, 2000, **more).extrema
    for times, heights, turns in (
        (found.trough_time, found.trough, ((1, -0.8), (3, -0.4))),
        (found.peak_time, found.peak, ((2, 0.6), (4, 0.2))),
    ):
        np.testing.assert_allclose(times[0, :2], [k * math.pi for k, _ in turns], atol=1e-9)
        np.testing.assert_allclose(heights[0, :2], [u for _, u in turns], atol=1e-9)
    # a peak in flight is smooth: the parabola is the motion
    ball = runs_of.run(BALL, "rk4", {}, (1.0, 0.0), 6.0, 500, **more)
    speed = math.sqrt(2.0)
    impacts = speed * np.array([1.0, 1.0 + 2 * 0.8, 1.0 + 2 * 0.8 + 2 * 0.64])
    np.testing.assert_allclose(ball.extrema.trough_time[0], impacts, atol=1e-12)
    assert ball.extrema.trough[0].tolist() == [0.0] * 3
    np.testing.assert_allclose(ball.extrema.peak_time[0, 0], speed * 1.8, atol=1e-9)
    # what is left to the mesh has no event but its points
    left = runs_of.run(BOX, "rk4", {"mu": 0.1}, (1.0, 0.0), 15.0, 2000, events="mesh", **more)
    assert left.extrema.trough_time[0, 0] == pytest.approx(math.pi, abs=0.01)
    assert left.extrema.trough_time[0, 0] != left.events.first_event_time[0]


@pytest.mark.parametrize("lane", ["plain", "scalar"])
def test_times_of_all_events_are_kept_as_far_as_there_is_room(lane):
    impacts = math.sqrt(2.0) * (1.0 + 2.0 * np.cumsum([0.0, *0.8 ** np.arange(1, 4)]))
    for room in (0, 2, 6):
        numbers = {}, (1.0, 0.0), 7.0, 100
        found = runs_of.run(BALL, "rk4", *numbers, n_events=room, lane=lane).events
        assert found.event_count[0] == 4
        assert found.event_time.shape == (1, room)
        kept = min(room, 4)
        np.testing.assert_allclose(found.event_time[0, :kept], impacts[:kept], rtol=1e-14)
        assert np.isnan(found.event_time[0, kept:]).all()


@pytest.mark.parametrize("events", TREATMENTS)
@pytest.mark.parametrize("kind", KINDS)
def test_a_box_that_sticks_stays_where_it_is_to_the_bit(kind, events):
    parameters = {"mu": 0.15, "alpha": 0.7}
    run = runs_of.run(BOX, kind, parameters, (1.3, -0.4), 30.0, 900, events=events)
    t = np.arange(901) * (30.0 / 900)
    (rest,) = run.events.rest_time
    assert 3.0 < rest < 15.0
    assert run.events.last_event_time[0] == rest
    u, v = run.position[0, t >= rest], run.velocity[0, t >= rest]
    assert len(u) > 400
    assert (v == 0.0).all()
    assert len(set(u.tolist())) == 1
    assert abs(math.tanh(0.7 * u[0]) / 0.7) <= 0.15
    # it never moved away from where friction holds it without stopping first
    assert run.events.event_count[0] >= 3


@pytest.mark.parametrize("kind", KINDS)
def test_events_are_counted_and_timed(kind):
    parameters = {"mu": 0.11}
    run = runs_of.run(BOX, kind, parameters, (1.0, 0.0), 20.0, 4000)
    # half periods of pi, each 0.22 shorter in its reach: 0.78, 0.56, 0.34, 0.12, 0.1 where it sticks
    assert run.events.event_count == [5]
    accuracy = {"rel": 2e-5}
    assert run.events.first_event_time[0] == pytest.approx(math.pi, **accuracy)
    assert run.events.rest_time[0] == pytest.approx(5 * math.pi, **accuracy)
    assert run.position[0, -1] == pytest.approx(0.1, abs=1e-4)


@pytest.mark.parametrize("kind", ["central", "rk4", "gauss4", "bdf2"])
def test_peaks_at_events_are_those_of_the_motion(kind):
    """They lie at the located events, where a line through the velocities would be off by dt."""
    run = runs_of.run(BOX, kind, {"mu": 0.05}, (1.0, 0.0), 16.0, 400)
    assert run.gathered.first_peak[0] == 1.0
    assert run.gathered.period[0] == pytest.approx(2 * math.pi, rel=2e-3)
    assert run.gathered.last_peak[0] == pytest.approx(0.6, abs=2e-3)
    assert run.gathered.last_trough[0] == pytest.approx(-0.5, abs=2e-3)


STICKING = written(
    {"damping": "b*sign(v)", "spring": "k*u", "force": "cos(t/2) + a*cos(1.5*t + 1)"}, ("k", "a")
)


@pytest.mark.parametrize("kind", ["central", "rk4", "gauss4"])
@pytest.mark.parametrize("events", TREATMENTS)
@pytest.mark.parametrize(
    ("a", "peaks", "last_peak", "last_trough"),
    [
        # turning points of 40-digit pieces: every one of them sticks, or every second one
        (0.0, (2.03306898, 50.61213460), 1.25159476, -1.25159426),
        (0.8, (1.09218406, 51.25630393), 1.59836487, -1.62596544),
    ],
)
def test_a_body_that_sticks_and_goes_back_has_turned(
    kind, events, a, peaks, last_peak, last_trough
):
    """Where it sticks and then goes on the way it came it has not."""
    run = runs_of.run(
        STICKING, kind, {"b": 0.6, "k": 1.0, "a": a}, (0.1, 0.0), 60.0, 4000, events=events
    )
    found = run.gathered
    close = 2e-5 if events == "located" else 1e-2
    assert found.period[0] == pytest.approx((peaks[1] - peaks[0]) / 4, rel=close)
    assert found.period_count[0] == 4
    assert found.last_peak[0] == pytest.approx(last_peak, rel=close)
    assert found.last_trough[0] == pytest.approx(last_trough, rel=close)


@pytest.mark.parametrize("events", TREATMENTS)
def test_a_body_that_sticks_and_goes_on_has_not_turned(events):
    creeping = written({"damping": "b*sign(v)", "spring": "u", "force": "t/20 + cos(t/2)/2"}, ())
    run = runs_of.run(creeping, "rk4", {"b": 0.6}, (0.0, 0.0), 60.0, 2000, events=events)
    assert run.events.event_count == [8]
    assert np.isnan(run.gathered.first_peak[0]) or run.gathered.first_peak[0] == 0.0
    assert np.isnan(run.gathered.last_trough[0])
    assert run.gathered.period_count[0] == 0


@pytest.mark.parametrize("restitution", [0.0, 0.3, 0.8, 0.95])
@pytest.mark.parametrize("slow", [0.0, 1e-3])
@pytest.mark.parametrize("steps", [3, 40, 1000])
def test_a_ball_lies_after_the_sum_of_all_its_bounces(restitution, slow, steps):
    """Many impacts in a step, infinitely many where it rests at speed 0 only."""
    parameters = {"g": 9.81, "restitution": restitution, "eps_v": slow}
    initial = {"h": 1.0, "v": 1.0}
    p = {row.name: row.default for row in BALL.parameters} | parameters
    wanted = float(impact_time(last_impact(initial, p), initial, p))
    end = 1.1 * wanted
    run = runs_of.run(BALL, "rk4", parameters, (1.0, 1.0), end, steps)
    (rest,) = run.events.rest_time
    # of infinitely many bounces in a step, those behind number MOST_EVENTS are left out
    tiny = restitution**MOST_EVENTS if slow == 0.0 else 0.0
    assert rest == pytest.approx(wanted, rel=1e-12 + 10 * tiny, abs=end / steps * (slow == 0.0))
    assert run.position[0, -1] == run.velocity[0, -1] == 0.0
    assert run.position.min() >= 0.0


HOSTILE = [
    (BOX, {"mu": 0.0}, (1.0, 0.0)),
    (BOX, {"mu": 0.0, "alpha": 3.0}, (0.0, 0.0)),
    (BOX, {"mu": 0.25}, (0.25, 0.0)),
    (BOX, {"mu": 0.25}, (math.nextafter(0.25, 1.0), 0.0)),
    (BOX, {"mu": 0.25}, (0.25, 1e-300)),
    (BOX, {"mu": 0.25}, (0.0, 5e-324)),
    (BOX, {"mu": 1e-300}, (1.0, 0.0)),
    (BOX, {"mu": 1e8}, (1.0, 1.0)),
    (BOX, {"alpha": 1e-200}, (1.0, 1.0)),
    (BOX, {"alpha": 1e9}, (1.0, 1.0)),
    (BALL, {"restitution": 0.0}, (1.0, 0.0)),
    (BALL, {"restitution": 1.0}, (1.0, 0.0)),
    (BALL, {"restitution": 0.999999, "eps_v": 0.0}, (1.0, 0.0)),
    (BALL, {"restitution": 1.0, "eps_v": 0.0}, (1e-9, 0.0)),
    (BALL, {"restitution": 1.0, "eps_v": 0.0}, (0.0, 1e-300)),
    (BALL, {"restitution": 0.5, "eps_v": 0.0}, (0.0, -1.0)),
    (BALL, {"restitution": 0.5, "eps_v": 0.0}, (0.0, 0.0)),
    (BALL, {"restitution": 0.5, "eps_h": 10.0}, (1.0, 1.0)),
    (BALL, {"g": 1e12}, (1.0, 0.0)),
    (DRIVEN, {"b": 0.0, "k": 1.0, "A": 1.0, "w": 1.0}, (0.0, 0.0)),
    (DRIVEN, {"b": 1.0, "k": 1.0, "A": 1.0, "w": 2.0}, (0.0, 0.0)),
    (DRIVEN, {"b": 0.3, "k": 0.0, "A": 1.0, "w": 50.0}, (0.0, 0.0)),
]


@pytest.mark.parametrize("events", TREATMENTS)
@pytest.mark.parametrize("kind", thinned(["central", "rk4", "crank_nicolson"], 3))
def test_no_parameters_keep_a_run_from_its_end(kind, events):
    """Compiled, with the bits of the plain lane (`test_both_lanes_give_the_same_bits`): up to 256 events a step."""
    for dt, (model, parameters, initial) in itertools.product((1e-3, 0.3, 7.0, 1e6), HOSTILE):
        numbers = parameters, initial, 6 * dt, 6
        run = runs_of.run(model, kind, *numbers, events=events, lane="scalar")
        good = int(run.last_step[0])
        assert np.isfinite(run.position[0, : good + 1]).all()
        assert np.isfinite(run.velocity[0, : good + 1]).all()
        assert run.events.event_count[0] <= 6 * MOST_EVENTS
        assert not run.events.rest_time[0] > 6 * dt * (1 + 1e-12)
        if model is BALL:
            assert good == 6


@pytest.mark.parametrize("near", [0.0, 0.3])
def test_on_the_mesh_a_ball_bounces_at_the_first_point_below_the_height_that_is_near(near):
    """B, section 10.9. Free flight is exact: h = 1 - t^2/2."""
    numbers = {"g": 1.0, "restitution": 0.5, "eps_h": near}, (1.0, 0.0), 2.0, 40
    run = runs_of.run(BALL, "rk4", *numbers, events="mesh")
    t = 0.05 * np.arange(41)
    first = np.flatnonzero(1.0 - t**2 / 2.0 < near)[0]
    assert run.events.first_event_time[0] == pytest.approx(t[first], abs=1e-12)
    assert run.velocity[0, first] == pytest.approx(0.5 * t[first], rel=1e-12)


def test_a_box_at_the_edge_of_sticking_sticks_and_one_beyond_it_does_not():
    edge = 0.25
    for u, moves in ((edge, False), (-edge, False), (math.nextafter(edge, 1.0), True)):
        run = runs_of.run(BOX, "central", {"mu": edge}, (u, 0.0), 10.0, 100)
        assert (run.events.event_count[0] > 0) == moves
        assert (run.position[0] == u).all() == (not moves)
        assert np.abs(run.position[0] - u).max() < 1e-15
        assert (run.events.rest_time[0] == 0.0) == (not moves)


def test_a_held_body_leaves_when_the_force_exceeds_what_friction_holds():
    parameters = {"b": 0.6, "k": 1.0, "A": 1.0, "w": 0.5}
    run = runs_of.run(DRIVEN, "rk4", parameters, (0.5, 0.0), 10.0, 640)
    assert run.events.first_event_time[0] == pytest.approx(2.0 * math.acos(-0.1), rel=1e-14)
    t = np.arange(641) * (10.0 / 640)
    held = t < run.events.first_event_time[0]
    assert (run.position[0, held] == 0.5).all()
    assert (run.velocity[0, held] == 0.0).all()
    assert (run.velocity[0, np.flatnonzero(~held)[1:5]] < 0.0).all()


def test_a_parameter_may_have_the_name_of_a_number_of_the_kernel():
    runs = []
    for name in ("k", "mode"):
        model = written({"damping": "b*sign(v)", "spring": f"{name}*u"}, (name,))
        runs.append(runs_of.run(model, "rk4", {"b": 0.1, name: 4.0}, (1.0, 0.0), 6.0, 96))
    assert runs[0].position.tobytes() == runs[1].position.tobytes()


def test_what_is_not_gathered_changes_no_step():
    for model, events in ((BOX, "located"), (BALL, "mesh"), (DRIVEN, "located")):
        numbers, scheme = several(model), FIXED_STEP["rk4"]
        options = {**scheme.defaults(), "events": events}
        whole, bare = (
            integrate(model, scheme, options, *numbers, 64, 1, lane="plain", with_gathered=with_)
            for with_ in (True, False)
        )
        assert bare.events is None
        assert whole.position.tobytes() == bare.position.tobytes()
        assert whole.velocity.tobytes() == bare.velocity.tobytes()


def test_the_last_velocity_is_taken_from_one_side_of_an_event():
    """`extrapolate` over the last two velocities would miss a jump between them, or give a body at rest a speed."""
    for end in (3.2, 16.0):
        scheme = FIXED_STEP["central"]
        numbers = numbers_of(BOX, {"mu": 0.11}, (1.0, 0.0), end / 64)
        by_end = [
            integrate(BOX, scheme, {**scheme.defaults(), "end_velocity": rule}, *numbers, 64, 1)
            for rule in ("extrapolate", "backward", "kick")
        ]
        assert len({run.velocity[0, -1] for run in by_end}) == 1
    assert by_end[0].velocity[0, -1] == 0.0
