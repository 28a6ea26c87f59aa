"""Events and stops as formulas: against built-in models, motions known piece by piece, and in every lane."""

import math
from itertools import pairwise, product

import numpy as np
import pytest
from event_runs import BALL, TREATMENTS, run
from same_bits import arrays, assert_same_bits
from thinned import thinned

from vibsim.engine import integrate
from vibsim.models.oscillator import written
from vibsim.models.system import written as system
from vibsim.schemes import FIXED_STEP

BOUNCE = {"spring": "g", "events.1.falling": "u", "events.1.then.v": "-e*v"}
FALLING = written(BOUNCE, ("g", "e"))
BETWEEN = written(
    {
        "events.1.rising": "u - right",
        "events.1.then.v": "-e*v",
        "events.2.falling": "u + left",
        "events.2.then.v": "-e*v",
    },
    ("left", "right", "e"),
)
STOPS = {"left": 0.6, "right": 0.4, "e": 0.9}
KICKED = written({"events.1.when": "sin(pi*t)", "events.1.then.v": "v + kick"}, ("kick",))
STOPPED = written({"stop": "u < 0"}, ())


BEADS = system(
    ("x", "y"),
    {
        "acceleration.x": "-x",
        "acceleration.y": "-y",
        "kinetic.0": "m*vx**2/2 + vy**2/2",
        "potential.0": "m*x**2/2 + y**2/2",
        "events.1.falling": "y - x - gap",
        "events.1.then.vx": "(m*vx + vy - e*(vx - vy))/(m + 1)",
        "events.1.then.vy": "(m*vx + vy + e*m*(vx - vy))/(m + 1)",
    },
    ("m", "gap", "e"),
)
"""Two beads on springs that strike each other, with the restitution e."""
HIT = {"m": 3.0, "gap": 0.5, "e": 0.9}
FLIGHT = ("x", "y"), {"acceleration.x": "0", "acceleration.y": "-g"}, ("g",)
"""A projectile without drag."""
FAR = next(r.real for r in np.roots([0.25, -2.0, 5.0, 0.0, -9.0]) if r.real > 0.0 == r.imag)
"""When it is 3 away: ``t^2 + (2 t - t^2/2)^2 = 9``."""


def go(model, kind, given, initial, end, steps, **more):
    """Return the trajectories of one member; declared parameters by their bare names."""
    parameters = {row.key: given.get(row.name, 1.0) for row in model.parameters}
    scheme = FIXED_STEP[kind]
    events, lane = more.pop("events", "located"), more.pop("lane", "plain")
    numbers = numbers_of_keys(parameters, initial, end / steps)
    options = {**scheme.defaults(), "events": events}
    return integrate(model, scheme, options, *numbers, steps, 1, lane=lane, **more)


def numbers_of_keys(parameters, initial, dt):
    return np.array([list(parameters.values())]), np.array([initial], dtype=float), np.array([dt])


def rotated(u, v, t):
    """Return the motion of ``u'' = -u`` after a time."""
    return u * math.cos(t) + v * math.sin(t), v * math.cos(t) - u * math.sin(t)


def between(end):
    """Return impact times and the last state between two stops, from the phase at which each sinusoid meets one."""
    u, v, t, times = 0.0, 1.0, 0.0, []
    while True:
        # u = size cos(phase - s), and u' = size sin(phase - s), after s more
        size, phase = math.hypot(u, v), math.atan2(v, u)
        waits = []
        for place, sign in ((STOPS["right"], 1.0), (-STOPS["left"], -1.0)):
            if size > abs(place):
                wait = (phase - sign * math.acos(place / size)) % (2 * math.pi)
                waits.append((wait if wait > 1e-9 else 2 * math.pi, place))
        wait, place = min(waits)
        if t + wait > end:
            return times, rotated(u, v, end - t)
        t += wait
        v = -STOPS["e"] * rotated(u, v, wait)[1]
        u = place
        times.append(t)


@pytest.mark.parametrize("events", TREATMENTS)
@pytest.mark.parametrize("kind", FIXED_STEP)
def test_a_ball_of_formulas_is_the_bouncing_ball(kind, events):
    more = {"events": events, "with_series": True, "n_extrema": 5, "n_events": 9}
    numbers = {"g": 1.0, "restitution": 0.8, "eps_v": 0.0}, (1.0, 0.0), 8.0, 150
    ball = run(BALL, kind, *numbers, **more)
    own = go(FALLING, kind, {"g": 1.0, "e": 0.8}, (1.0, 0.0), 8.0, 150, **more)
    np.testing.assert_allclose(own.states, ball.states, rtol=0, atol=1e-13)
    assert own.events.event_count == ball.events.event_count
    assert own.events.event_count[0] >= 4
    np.testing.assert_allclose(own.events.event_time, ball.events.event_time, rtol=1e-13)
    np.testing.assert_allclose(own.extrema.trough_time, ball.extrema.trough_time, rtol=1e-12)
    np.testing.assert_allclose(own.series.lost, ball.series.lost, atol=1e-13)


@pytest.mark.parametrize("kind", thinned(FIXED_STEP, 3))
def test_located_stops_and_impacts_leave_a_scheme_its_order(kind):
    scheme = FIXED_STEP[kind]
    order = scheme.formal_order("u", BETWEEN, scheme.defaults())
    times, last = between(12.0)
    assert len(times) > 6
    found = []
    for steps in (4800, 9600, 19200) if order == 1 else (600, 1200, 2400):
        way = go(BETWEEN, kind, STOPS, (0.0, 1.0), 12.0, steps, n_events=len(times) + 1)
        assert way.events.event_count[0] == len(times)
        error = np.abs(way.events.event_time[0, :-1] - times).max()
        found.append(error + np.abs(way.position[0, -1] - last[0]))
        quarter = go(STOPPED, kind, {}, (1.0, 0.0), 2.0, steps // 20)
        found[-1] += abs(quarter.events.rest_time[0] - math.pi / 2)
    rates = [math.log2(a / b) for a, b in pairwise(found)]
    assert abs(rates[-1] - order) < (0.35 if order == 1 else 0.25), (rates, found)
    assert found[-1] < (0.1 if order == 1 else 1e-3)


@pytest.mark.parametrize("lane", ["plain", "scalar"])
def test_a_stop_ends_the_motion_with_the_state_as_it_is(lane):
    steps = 400
    way = go(STOPPED, "rk4", {}, (1.0, 0.0), 4.0, steps, lane=lane, with_series=True)
    assert way.events.rest_time[0] == pytest.approx(math.pi / 2, abs=1e-9)
    assert way.events.event_count[0] == 1
    t = np.arange(steps + 1) * (4.0 / steps)
    ended = t > math.pi / 2
    assert np.ptp(way.position[0, ended]) == 0.0
    assert way.position[0, -1] == pytest.approx(0.0, abs=1e-12)
    np.testing.assert_allclose(way.velocity[0], -np.sin(np.minimum(t, math.pi / 2)), atol=1e-9)
    assert np.all(way.series.lost == 0.0)


def test_on_the_mesh_a_stop_is_the_first_grid_point_where_it_holds():
    """As the text ends a motion where |theta| < 1e-3 (B, section 10.6), which may be grid points behind a crossing."""
    stopped = written({"stop": "abs(u) < 0.05", "spring": "sin(u)", "damping": "0.1*v"}, ())
    free = written({"spring": "sin(u)", "damping": "0.1*v"}, ())
    smooth = go(free, "rk4", {}, (2.0, 0.0), 40.0, 400)
    way = go(stopped, "rk4", {}, (2.0, 0.0), 40.0, 400, events="mesh")
    first = int(np.argmax(np.abs(smooth.position[0]) < 0.05))
    assert way.events.rest_time[0] == first * (40.0 / 400)
    np.testing.assert_array_equal(way.states[:, 0, : first + 1], smooth.states[:, 0, : first + 1])
    assert np.all(way.states[:, 0, first:] == way.states[:, 0, first : first + 1])


def test_a_kicked_oscillator_is_known_between_its_kicks():
    way = go(KICKED, "rk4", {"kick": 0.3}, (1.0, 0.0), 5.5, 2200, with_series=True, n_events=8)
    np.testing.assert_allclose(way.events.event_time[0, :5], np.arange(1, 6), atol=1e-13)
    assert way.events.event_count[0] == 5
    u, v, lost = 1.0, 0.0, 0.0
    for _ in range(5):
        u, v = rotated(u, v, 1.0)
        lost -= 0.5 * (v + 0.3) ** 2 - 0.5 * v * v
        v += 0.3
    u, v = rotated(u, v, 0.5)
    np.testing.assert_allclose(way.states[:, 0, -1], (u, v), atol=1e-11)
    assert way.series.lost[0, -1] == pytest.approx(lost, abs=1e-11)


@pytest.mark.parametrize(
    ("way", "times"),
    [("falling", (0.5, 2.5, 4.5)), ("rising", (1.5, 3.5)), ("when", (0.5, 1.5, 2.5, 3.5, 4.5))],
)
@pytest.mark.parametrize("events", TREATMENTS)
def test_a_body_that_goes_through_has_one_event_for_each_crossing_in_its_direction(
    way, times, events
):
    model = written({f"events.1.{way}": "u", "spring": "pi**2*u"}, ())
    found = go(model, "gauss4", {}, (1.0, 0.0), 5.2, 520, n_events=9, events=events).events
    assert found.event_count[0] == len(times)
    far = 1e-7 if events == "located" else 0.0101
    np.testing.assert_allclose(found.event_time[0, : len(times)], times, atol=far)


@pytest.mark.parametrize("events", TREATMENTS)
@pytest.mark.parametrize("kind", ["ab3", "central", "gauss4"])
def test_events_that_are_only_counted_leave_the_motion_as_it_is(kind, events):
    spring = {"spring": "u + u**3"}
    counted = {**spring, "events.1.when": "u - 0.1", "events.2.falling": "u*v"}
    still, way = (written(texts, ()) for texts in (spring, counted))
    with_events = go(way, kind, {}, (1.0, 0.2), 20.0, 400, n_events=9, events=events)
    assert with_events.events.event_count[0] == 17
    scheme = FIXED_STEP[kind]
    numbers = numbers_of_keys({"m": 1.0}, (1.0, 0.2), 20.0 / 400)
    smooth = integrate(still, scheme, scheme.defaults(), *numbers, 400, 1, lane="plain")
    assert np.array_equal(with_events.states, smooth.states)


def test_who_begins_on_a_guard_goes_to_its_side_by_its_rate():
    for v, count in ((1.0, 2), (-1.0, 1)):
        model = written({"events.1.falling": "u", "spring": "pi**2*u"}, ())
        found = go(model, "gauss4", {}, (0.0, v), 3.5, 350).events
        assert found.event_count[0] == count, v


def test_a_jump_of_the_position_takes_the_energy_of_the_spring_too():
    model = written({"events.1.rising": "v", "events.1.then.u": "u/2", "damping": "0.1*v"}, ())
    way = go(model, "gauss4", {}, (1.0, 0.0), 20.0, 1000, with_series=True)
    u, v = way.states[:, 0]
    energy = 0.5 * (u * u + v * v)
    assert way.events.event_count[0] >= 3
    assert way.series.lost[0, -1] > 0.1
    left = energy - energy[0] + way.series.lost[0] + way.series.dissipated[0]
    assert np.max(np.abs(left)) < 1e-7


def test_simultaneous_events_happen_one_after_another():
    texts = {"events.1.falling": "u", "events.2.falling": "2*u", "events.2.then.v": "-v"}
    found = go(written(texts, ()), "rk4", {}, (1.0, 0.0), 3.0, 100, n_events=4)
    assert found.events.event_count[0] == 2
    np.testing.assert_allclose(found.events.event_time[0, :2], math.pi / 2, atol=1e-6)
    assert found.position.min() > -1e-6


@pytest.mark.parametrize("lane", ["plain", "scalar"])
@pytest.mark.parametrize("kind", ["rk4", "gauss4", "central"])
def test_an_event_that_turns_back_the_motion_is_no_second_event_of_another_one(kind, lane):
    texts = {"events.1.when": "u", "events.1.then.v": "v/2"}
    texts |= {"events.2.when": "2*u", "events.2.then.v": "v + 1"}
    way = go(written(texts, ()), kind, {}, (1.0, 0.0), 8.0, 200, n_events=8, lane=lane)
    # it comes to 0 with -1, -1/2 and -3/4, of which a half and 1 more are left
    assert way.events.event_count[0] == 6
    times = np.repeat([0.5, 1.5, 2.5], 2) * math.pi
    np.testing.assert_allclose(way.events.event_time[0, :6], times, atol=2e-3)
    wanted = rotated(0.0, 0.625, 8.0 - 2.5 * math.pi)
    np.testing.assert_allclose(way.states[:, 0, -1], wanted, atol=2e-3)


@pytest.mark.parametrize("events", TREATMENTS)
def test_a_jump_to_where_the_motion_stops_ends_it(events):
    texts = {"events.1.falling": "u", "events.1.then.u": "-3", "stop": "u < -2"}
    way = go(written(texts, ()), "rk4", {}, (1.0, 0.0), 8.0, 200, n_events=4, events=events)
    assert way.events.event_count[0] == 1
    assert way.events.rest_time[0] == pytest.approx(math.pi / 2, abs=0.05)
    assert way.states[0, 0, -1] == -3.0


def test_a_ball_that_does_not_bounce_stays_on_the_ground():
    way = go(FALLING, "rk4", {"g": 1.0, "e": 0.0}, (1.0, 0.0), 5.0, 50)
    assert way.events.rest_time[0] == pytest.approx(math.sqrt(2.0), rel=1e-12)
    np.testing.assert_allclose(way.states[:, 0, -1], 0.0, atol=1e-12)


PLANE = system(
    ("x", "y"),
    {
        "acceleration.x": "-x",
        "acceleration.y": "-g",
        "events.1.falling": "y",
        "events.1.then.vy": "-0.8*vy",
        "events.2.rising": "x - 0.5",
        "events.2.then.vx": "-vx",
    },
    ("g",),
)
WALL = {"events.1.rising": "u - 0.5", "events.1.then.v": "-v"}


@pytest.mark.parametrize(
    ("kind", "lane"),
    thinned(product(["rk4", "central", "gauss4", "ab3"], ["plain", "scalar"]), 3),
)
def test_events_of_several_coordinates_are_those_of_each_alone(kind, lane):
    more = {"lane": lane, "with_series": True, "n_events": 20}
    both = go(PLANE, kind, {"g": 1.0}, (-1.0, 1.0, 0.0, 0.0), 6.0, 600, **more)
    ball = go(FALLING, kind, {"g": 1.0, "e": 0.8}, (1.0, 0.0), 6.0, 600, **more)
    struck = go(written(WALL, ()), kind, {}, (-1.0, 0.0), 6.0, 600, **more)
    np.testing.assert_allclose(both.states[1], ball.position, atol=2e-4)
    np.testing.assert_allclose(both.states[0], struck.position, atol=2e-4)
    times = np.sort([*ball.events.event_time[0], *struck.events.event_time[0]])
    count = int(both.events.event_count[0])
    assert count == ball.events.event_count[0] + struck.events.event_count[0] >= 4
    np.testing.assert_allclose(both.events.event_time[0, :count], times[:count], atol=1e-4)
    np.testing.assert_allclose(both.series.lost[0, -1], ball.series.lost[0, -1], atol=1e-4)
    assert both.gathered.ranges[0, 1].tolist() == pytest.approx([0.0, 1.0], abs=1e-2)


def beads(end):
    """Return impact times and the last positions, from rest at -1 and 1.

    The distance is a sinusoid between impacts, and the centre is one throughout.
    """
    m, gap, e = HIT.values()
    size, t, times = 2.0, 0.0, []
    while t + math.acos(gap / size) < end:
        t += math.acos(gap / size)
        times.append(t)
        size = math.hypot(gap, e * math.sqrt(size**2 - gap**2))
        # from the impact to the next turn
        t += math.acos(gap / size)
    apart, centre = size * math.cos(end - t), (1.0 - m) / (1.0 + m) * math.cos(end)
    return times, np.array([centre - apart / (1.0 + m), centre + m * apart / (1.0 + m)])


@pytest.mark.parametrize("kind", thinned(FIXED_STEP, 3))
def test_impacts_of_two_bodies_leave_a_scheme_its_order(kind):
    scheme = FIXED_STEP[kind]
    order = scheme.formal_order("x", BEADS, scheme.defaults())
    times, last = beads(7.0)
    assert len(times) == 3
    found = []
    for steps in (3200, 6400, 12800) if order == 1 else (400, 800, 1600):
        way = go(BEADS, kind, HIT, (-1.0, 1.0, 0.0, 0.0), 7.0, steps, n_events=4)
        assert way.events.event_count[0] == len(times)
        error = np.abs(way.events.event_time[0, :-1] - times).max()
        found.append(error + np.abs(way.states[:2, 0, -1] - last).max())
    rates = [math.log2(a / b) for a, b in pairwise(found)]
    assert abs(rates[-1] - order) < 0.3 or found[-1] < 1e-11, (rates, found)
    assert found[-1] < (0.05 if order == 1 else 1e-3)


def test_what_an_impact_of_two_bodies_costs_is_their_energy():
    way = go(BEADS, "gauss4", HIT, (-1.0, 1.0, 0.0, 0.0), 7.0, 800, with_series=True)
    m, gap, e = HIT.values()
    speed, lost = math.sqrt(4.0 - gap**2), 0.0
    for _ in beads(7.0)[0]:
        lost += 0.5 * m / (m + 1.0) * (1.0 - e**2) * speed**2
        speed *= e
    assert way.series.lost[0, -1] == pytest.approx(lost, rel=1e-7)


@pytest.mark.parametrize("kind", ["rk4", "central", "velocity_verlet", "gauss4", "bdf2"])
@pytest.mark.parametrize(
    ("stop", "time"),
    [
        ("y < 0", 4.0),
        ("y < x/2", 3.0),
        ("hypot(x, y) > 3", FAR),
        ("vy < -vx and y > 0", 3.0),
    ],
)
def test_a_projectile_ends_where_a_formula_of_both_coordinates_says(kind, stop, time):
    """Every scheme of order 2 has the parabola, and so the time to round-off, except that BDF2 starts by order 1."""
    names, forces, declared = FLIGHT
    model = system(names, forces | {"stop": stop}, declared)
    way = go(model, kind, {"g": 1.0}, (0.0, 0.0, 1.0, 2.0), 5.0, 512, n_events=1)
    near = 1e-4 if kind == "bdf2" else 1e-12
    assert way.events.rest_time[0] == pytest.approx(time, abs=near)
    last = time, 2.0 * time - 0.5 * time**2, 1.0, 2.0 - time
    np.testing.assert_allclose(way.states[:, 0, -1], last, atol=10 * near)


@pytest.mark.parametrize(
    ("kind", "events"),
    [*thinned(((kind, "located") for kind in FIXED_STEP), 4), ("rk4", "mesh"), ("ab3", "mesh")],
)
def test_members_and_lanes_of_a_system_have_the_same_bits(kind, events):
    scheme, count = FIXED_STEP[kind], 3
    rng = np.random.default_rng(5)
    parameters = np.array([*HIT.values()]) * rng.uniform(0.8, 1.05, (count, 3))
    initial = rng.uniform(0.5, 1.0, (count, 4)) * [-1.0, 1.0, 0.1, 0.1]
    numbers = parameters, initial, rng.uniform(0.05, 0.06, count)
    options = {**scheme.defaults(), "events": events}
    more = {"with_series": True, "n_extrema": 3, "n_events": 6}

    def runs(chosen, lane):
        own = (np.ascontiguousarray(array[chosen]) for array in numbers)
        return integrate(BEADS, scheme, options, *own, 100, 1, lane=lane, **more)

    together = runs(slice(None), "scalar")
    assert together.events.event_count.min() >= 1
    assert_same_bits(together, runs(slice(None), "plain"))
    for case in range(count):
        alone = runs(slice(case, case + 1), "scalar")
        for (name, a), (_, b) in zip(arrays(together), arrays(alone), strict=True):
            assert a[case].tobytes() == b[0].tobytes(), name


@pytest.mark.parametrize("events", TREATMENTS)
def test_lanes_have_the_same_bits(events):
    more = {"events": events, "with_series": True, "n_extrema": 5, "n_events": 30}
    plain, compiled = (
        go(BETWEEN, "ab3", STOPS, (0.0, 1.0), 12.0, 300, lane=lane, **more)
        for lane in ("plain", "scalar")
    )
    for a, b in (
        (plain.states, compiled.states),
        (plain.events.event_time, compiled.events.event_time),
        (plain.series.lost, compiled.series.lost),
    ):
        assert a.tobytes() == b.tobytes()
    assert plain.events.event_count[0] > 6


PRESSED = written(
    {
        "spring": "u",
        "force": "2 + swing*cos(t)",
        "events.1.rising": "u - 1",
        "events.1.then.v": "-e*v",
    },
    ("swing", "e"),
)
"""A body that a spring and a force press against a stop."""
LIFTED = written(
    {"force": "cos(t) - 0.5", "spring": "0", "events.1.falling": "u", "events.1.then.v": "-e*v"},
    ("e",),
)
"""A body that its force presses against a stop, lifts from it, and presses again."""
LEAVES = 2.0 * math.pi - math.pi / 3.0
MOVE_FIRST = ("forward_euler", "euler_cromer_u_first")
"""Schemes that move a position by the velocity before the step: no flight ends within one, and bounces go on."""


@pytest.mark.parametrize("kind", thinned(FIXED_STEP, 2))
def test_a_body_that_is_pressed_against_a_stop_stays_there_however_it_bounces(kind):
    dt = 20.0 / 800
    for e in (0.0, 0.05, 0.3, 0.6):
        way = go(PRESSED, kind, {"e": e, "swing": 0.1}, (0.0, 0.0), 20.0, 800)
        if kind in MOVE_FIRST and e > 0.0:
            np.testing.assert_allclose(way.position[0, -1], 1.0, atol=4.0 * dt**2)
            np.testing.assert_allclose(way.velocity[0, -1], 0.0, atol=2.0 * dt)
            continue
        np.testing.assert_allclose(way.states[:, 0, -1], (1.0, 0.0), atol=1e-12)
        # the first impact is that of u'' + u = 2 + cos(t)/10, and flights end like a geometric series
        assert 1.0 <= way.events.rest_time[0] < 1.1 + 4.0 * e / (1.0 - e)


@pytest.mark.parametrize("lane", ["plain", "scalar"])
@pytest.mark.parametrize("kind", ["rk4", "central", "gauss4", "ab3"])
def test_a_body_leaves_its_stop_with_the_order_of_the_scheme_when_its_force_turns(kind, lane):
    order = FIXED_STEP[kind].formal_order("u", LIFTED, FIXED_STEP[kind].defaults())
    rest = 0.5 * LEAVES - math.sin(LEAVES)
    wanted = math.cos(LEAVES) - math.cos(7.0) - 0.25 * (49.0 - LEAVES**2) + rest * (7.0 - LEAVES)
    found = []
    for steps in (100, 200, 400):
        way = go(LIFTED, kind, {"e": 0.0}, (0.1, 0.0), 7.0, steps, lane=lane)
        assert way.events.event_count[0] == 1.0
        assert math.isnan(way.events.rest_time[0])
        found.append(abs(way.states[0, 0, -1] - wanted))
    assert abs(math.log2(found[1] / found[2]) - order) < 0.3 or found[2] < 1e-9, found
    assert found[2] < 1e-4


def test_who_begins_at_rest_on_a_stop_stays_without_an_event():
    way = go(LIFTED, "rk4", {"e": 0.5}, (0.0, 0.0), 1.0, 32)
    assert way.position[0, -1] > 0.1
    pressed = written(
        {"spring": "0", "force": "-1", "events.1.falling": "u", "events.1.then.v": "-e*v"}, ("e",)
    )
    way = go(pressed, "rk4", {"e": 0.5}, (0.0, 0.0), 1.0, 32)
    assert way.events.event_count[0] == 0.0
    assert way.events.rest_time[0] == 0.0
    assert not way.states.any()


def test_a_kick_takes_a_body_off_its_stop():
    texts = {"spring": "0", "force": "-1", "events.1.falling": "u", "events.1.then.v": "0"}
    texts |= {"events.2.rising": "t - 2.5", "events.2.then.v": "v + 1"}
    way = go(written(texts, ()), "rk4", {}, (0.5, 0.0), 3.0, 96, n_events=4)
    np.testing.assert_allclose(way.events.event_time[0, :2], (1.0, 2.5), atol=1e-12)
    np.testing.assert_allclose(way.states[:, 0, -1], (0.5 - 0.125, 0.5), atol=1e-12)


@pytest.mark.parametrize("kind", ["rk4", "central", "newmark"])
def test_a_coordinate_at_rest_on_a_stop_does_not_stop_the_others(kind):
    forces = {"acceleration.x": "-1", "acceleration.y": "-y"}
    bounces = {"events.1.falling": "x", "events.1.then.vx": "-0.3*vx"}
    both = go(system(("x", "y"), forces | bounces, ()), kind, {}, (0.05, 1.0, 0.0, 0.0), 6.0, 256)
    assert abs(both.states[0, 0, -1]) < 1e-12
    assert both.states[1, 0, -1] == pytest.approx(math.cos(6.0), abs=1e-3)
    assert math.isnan(both.events.rest_time[0])


def test_bodies_that_go_on_together_have_one_event():
    together = {f"events.1.then.v{x}": "(vx + vy)/2" for x in "xy"}
    free = {"acceleration.x": "0", "acceleration.y": "0", "events.1.falling": "y - x"}
    model = system(("x", "y"), free | together, ())
    way = go(model, "rk4", {}, (0.0, 1.0, 1.0, -0.5), 5.0, 64)
    assert way.events.event_count[0] == 1.0
    np.testing.assert_allclose(way.states[:, 0, -1], (1.75, 1.75, 0.25, 0.25), atol=1e-12)


def test_bounces_without_end_between_two_bodies_break_the_calculation_down():
    """They would rest on each other, with a force that nobody has written."""
    heavy = {"acceleration.x": "-1", "acceleration.y": "-1"}
    heavy |= {"events.1.falling": "x", "events.1.then.vx": "-0.5*vx"}
    heavy |= {"events.2.falling": "y - x - 0.1"}
    heavy |= {"events.2.then.vx": "(vx + vy)/2 - 0.25*(vx - vy)"}
    heavy |= {"events.2.then.vy": "(vx + vy)/2 + 0.25*(vx - vy)"}
    start = 0.5, 1.0, 0.0, 0.0
    way = go(system(("x", "y"), heavy, ()), "rk4", {}, start, 4.0, 128, lane="scalar")
    assert np.isnan(way.states[:, 0, -1]).all()
    sound = way.states[:, 0, : int(np.argmax(np.isnan(way.states[0, 0])))]
    assert sound[0].min() > -1e-12
    assert (sound[1] - sound[0]).min() > 0.1 - 1e-12
