"""What is measured at every step against the same formulas in numpy, on trajectories of which every step is stored."""

import dataclasses
import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vibsim.engine import LANES, energies, extrema, extrema_of, integrate, observed
from vibsim.models import MODELS
from vibsim.schemes import FIXED_STEP, SCHEMES

STEPS = 240
KEPT = 7
ROUND_OFF = 2.0**-52
KINDS = [kind for kind, s in FIXED_STEP.items() if s.stepper(s.defaults()).own_velocity]
OWN = ["rk4", "forward_euler"]
UNFIT = {"washing_machine", "duffing", "elastic_pendulum"}
"""One is driven, so that no member rests; one overflows by Forward Euler from here; one has two coordinates (see
`test_coordinates`)."""
EVERY = [
    pytest.param(model, id=kind, marks=() if kind == "pendulum" else pytest.mark.slow)
    for kind, model in MODELS.items()
    if model.events is None and model.loaded is None and kind not in UNFIT
]


def members(model, count=6, seed=3):
    """Some that swing, some that go over the top, one that rests."""
    rng = np.random.default_rng(seed)
    parameters = rng.uniform(0.5, 2.0, (count, len(model.parameters)))
    initial = np.array([[1.0, 0.0], [3.0, 0.5], [-0.5, 7.5], [0.2, -1.0], [0.0, 0.0], [2.0, 0.1]])
    return parameters, initial[:count], np.linspace(0.04, 0.09, count)


def run(model, kind, numbers, lane="plain", *, every=1, steps=STEPS, **more):
    scheme = SCHEMES[kind]
    more = {"with_series": True, "n_extrema": KEPT, **more}
    return integrate(model, scheme, scheme.defaults(), *numbers, steps, every, lane=lane, **more)


def deviation(model, numbers, position, velocity, initial):
    """Energy at every step, less that at the start."""
    states = np.array([position, velocity])
    kinetic, potential = energies(model, numbers[0], numbers[2], 1, states, lane="plain")
    return kinetic + potential - initial


def centred(u, dt):
    """Return ``(u^(n+1) - u^(n-1))/(2 dt)``, NaN at either end."""
    v = np.full(u.shape, np.nan)
    v[:, 1:-1] = (u[:, 2:] - u[:, :-2]) / (2.0 * dt[:, None])
    return v


def minmax(t, u):
    """Return all maxima and minima as the text's program does (B, section 3.5), as points (t, u)."""
    peaks, troughs = [], []
    for n in range(1, len(u) - 1):
        if u[n - 1] < u[n] > u[n + 1]:
            peaks.append((t[n], u[n]))
        if u[n - 1] > u[n] < u[n + 1]:
            troughs.append((t[n], u[n]))
    return peaks, troughs


@pytest.mark.parametrize("lane", LANES)
@pytest.mark.parametrize("kind", OWN)
@pytest.mark.parametrize("model", EVERY)
def test_the_energy_by_the_centred_difference_is_that_of_all_points(model, kind, lane):
    numbers = members(model)
    runs = run(model, kind, numbers, lane)
    check_energies(model, numbers, runs)


@pytest.mark.parametrize("kind", KINDS)
def test_every_scheme_with_a_velocity_of_its_own_has_both(kind):
    model = MODELS["pendulum"]
    numbers = members(model)
    check_energies(model, numbers, run(model, kind, numbers))


def check_energies(model, numbers, runs):
    kinetic, potential = energies(model, numbers[0], numbers[2], 1, runs.states, lane="plain")
    initial = (kinetic + potential)[:, :1]
    v = centred(runs.position, numbers[2])
    # two roundings of the difference quotient, one each way
    np.testing.assert_allclose(runs.series.velocities_d2t[:, 0], v, rtol=2 * ROUND_OFF)
    given = runs.series.velocities_d2t[:, 0]
    by_d2t = np.abs(deviation(model, numbers, runs.position, given, initial))
    assert np.array_equal(np.max(by_d2t[:, 1:-1], axis=1), runs.gathered.deviation_d2t)
    wanted = np.maximum.accumulate(by_d2t[:, 1:-1], axis=1)
    running = runs.series.deviation_d2t_running
    assert np.array_equal(running[:, 1:-1], wanted)
    assert np.isnan(running[:, 0]).all()
    assert np.array_equal(running[:, -1], running[:, -2])
    by_own = np.abs(kinetic + potential - initial)
    wanted = np.maximum.accumulate(by_own, axis=1)
    assert np.array_equal(runs.series.deviation_running, wanted)


@pytest.mark.parametrize("lane", LANES)
@pytest.mark.parametrize("every", [1, 3, 8, 60, STEPS])
@pytest.mark.parametrize("kind", ["central", pytest.param("rk4", marks=pytest.mark.slow)])
def test_samples_of_any_stride_are_those_of_every_step(kind, every, lane):
    # with damping, so that the work of forces is sampled as well
    model = MODELS["pendulum"].variant(frozenset({"drag"}))
    numbers = members(model)
    whole, thinned = (run(model, kind, numbers, lane, every=n) for n in (1, every))
    for field in dataclasses.fields(whole.series):
        one, other = (getattr(runs.series, field.name) for runs in (whole, thinned))
        if one is None:
            # what events cost, which this model has not
            assert other is None
            continue
        sampled = np.ascontiguousarray(one[..., ::every])
        assert sampled.tobytes() == np.ascontiguousarray(other).tobytes(), field.name
    for field in dataclasses.fields(whole.extrema):
        one, other = (getattr(runs.extrema, field.name) for runs in (whole, thinned))
        assert one.tobytes() == other.tobytes(), field.name


@pytest.mark.parametrize("lane", LANES)
@pytest.mark.parametrize("kind", ["central", "rk4"])
@pytest.mark.parametrize("model", EVERY)
def test_extrema_are_those_of_the_texts_program(model, kind, lane):
    numbers = members(model)
    runs = run(model, kind, numbers, lane)
    for case, dt in enumerate(numbers[2]):
        found = minmax(np.arange(STEPS + 1) * dt, runs.position[case])
        for name, points in zip(("peak", "trough"), found, strict=True):
            check_extrema(runs, case, name, points, dt)
        # and those that are found in the positions alone
        alone = extrema_of(runs.position[case], float(dt))
        for field in dataclasses.fields(alone):
            one, other = getattr(alone, field.name)[0], getattr(runs.extrema, field.name)[case]
            if one.ndim:
                one, other = one[:KEPT], other[: len(one)]
            assert np.array_equal(one, other, equal_nan=True)
    # the member at rest has none
    assert runs.extrema.peak_count[4] == runs.extrema.trough_count[4] == 0
    assert runs.extrema.peak_count.max() > 1


def check_extrema(runs, case, name, points, dt):
    def kept(end):
        return getattr(runs.extrema, f"{name}{end}")[case]

    assert kept("_count") == len(points)
    points = points[:KEPT]
    rest = slice(len(points), None)
    for end in ("_time", "", "_time_grid", "_grid"):
        assert np.isnan(kept(end)[rest]).all()
    for i, (t, u) in enumerate(points):
        assert (kept("_time_grid")[i], kept("_grid")[i]) == (t, u)
        n = round(t / dt)
        c = np.polyfit([-1.0, 0.0, 1.0], runs.position[case, n - 1 : n + 2], 2)
        top = -c[1] / (2 * c[0])
        # differences of the positions carry their round-off, relative to the curvature
        noise = 8 * ROUND_OFF * max(abs(u), 1.0)
        assert kept("_time")[i] == pytest.approx(t + top * dt, abs=noise / abs(c[0]) * dt)
        assert kept("")[i] == pytest.approx(np.polyval(c, top), abs=noise / abs(c[0]))


def test_interpolated_extrema_converge_as_the_parabola_does():
    """On cos(t), where u''' vanishes at a peak: time to dt^3, height to dt^4, wherever the grid lies."""
    errors = []
    for n in (50, 100, 200, 400):
        dt = 2.0 * np.pi / n
        kept, counts = room(2)
        # a third of a step off the grid at every resolution
        u = [np.cos((i - n / 2 + 1 / 3) * dt) for i in range(n)]
        walk(u, kept, counts, dt)
        assert counts[0, extrema.PEAK_COUNT] == 1
        top = (n / 2 - 1 / 3) * dt
        errors.append([abs(kept[0, 0, 0] - top), abs(kept[1, 0, 0] - 1.0)])
    orders = np.log2(np.array(errors)[:-1] / np.array(errors)[1:])
    np.testing.assert_allclose(orders[-1], [3.0, 4.0], atol=0.05)


def room(size):
    return np.full((extrema.N_KEPT, 1, size), np.nan), np.zeros(
        (1, extrema.N_COUNTS_KEPT), np.int64
    )


def walk(u, kept, counts, dt):
    """Judge every inner point, as the loops do."""
    behind = [u[0], *u]
    for n in range(1, len(u)):
        points = (behind[n - 1], u[n - 1], u[n])
        if extrema.is_turned(*points):
            extrema.note_turned(kept, counts, 0, n - 1, dt, *points)


def plateaus(u):
    """Return peaks and troughs as (first step, last step), a plateau taken as one point."""
    steps = [0, *(n for n in range(1, len(u)) if u[n] != u[n - 1]), len(u)]
    flat = [(a, b - 1) for a, b in itertools.pairwise(steps)]
    height = [u[a] for a, _ in flat]
    found = ([], [])
    for i in range(1, len(flat) - 1):
        if height[i - 1] < height[i] > height[i + 1]:
            found[0].append(flat[i])
        if height[i - 1] > height[i] < height[i + 1]:
            found[1].append(flat[i])
    return found


@given(st.lists(st.integers(-2, 2), min_size=3, max_size=40))
def test_a_plateau_is_one_extremum_where_lower_ground_lies_on_both_sides(values):
    u = [float(value) for value in values]
    kept, counts = room(len(u))
    walk(u, kept, counts, 1.0)
    for row, count, found in zip(
        (0, extrema.OF_A_KIND),
        (extrema.PEAK_COUNT, extrema.TROUGH_COUNT),
        plateaus(u),
        strict=True,
    ):
        assert counts[0, count] == len(found)
        for i, (first, last) in enumerate(found):
            assert kept[row + extrema.TIME_GRID, 0, i] == first
            assert kept[row + extrema.HEIGHT_GRID, 0, i] == u[first]
            time, height = kept[row, 0, i], kept[row + extrema.HEIGHT, 0, i]
            if last > first:
                assert time == (first + last) / 2
            assert first - 0.5 <= time <= last + 0.5
            assert abs(height - u[first]) <= 0.5
            assert (height >= u[first]) == (row == 0) or height == u[first]


@pytest.mark.parametrize("lane", LANES)
@pytest.mark.parametrize("kind", OWN)
@pytest.mark.parametrize("every", [1, 2, 3])
def test_of_a_member_that_fails_all_ends_with_its_last_sound_point(kind, every, lane):
    """Its velocity by the centred difference, which rests on the next point, ends one point before."""
    model = MODELS["spring"]
    numbers = np.array([[40.0], [1.1], [9.0]]), np.ones((3, 2)), np.ones(3)
    runs = run(model, kind, numbers, lane, every=1)
    last = runs.last_step
    assert last[1] == STEPS if kind == "rk4" else last[1] <= STEPS
    assert (last[[0, 2]] < STEPS).all()
    with np.errstate(over="ignore", invalid="ignore"):
        v = centred(runs.position, numbers[2])
    for case, good in enumerate(last):
        series = {
            f.name: getattr(runs.series, f.name)[case]
            for f in dataclasses.fields(runs.series)
            if getattr(runs.series, f.name) is not None
            if getattr(runs.series, f.name) is not None
        }
        for values in series.values():
            assert np.isnan(values[..., good + 1 :]).all()
        np.testing.assert_array_equal(np.isnan(series["velocities_d2t"][0]), np.isnan(v[case]))
        running = series["deviation_d2t_running"]
        assert np.isfinite(running[1 : good + 1]).all()
        assert running[good] == running[good - 1] == runs.gathered.deviation_d2t[case]
        found = minmax(np.arange(good + 1.0), runs.position[case, : good + 1])
        for name, points in zip(("peak", "trough"), found, strict=True):
            assert getattr(runs.extrema, f"{name}_count")[case] == len(points)
    thinned = run(model, kind, numbers, lane, every=every)
    for name in series:
        one, other = (getattr(r.series, name) for r in (runs, thinned))
        sampled = one[..., ::every].copy()
        assert sampled.tobytes() == other.tobytes(), name


def test_a_member_that_fails_within_its_first_steps_has_no_centred_difference():
    model = MODELS["spring"]
    numbers = np.array([[1e160], [1e80]]), np.ones((2, 2)), np.ones(2)
    for lane in LANES:
        runs = run(model, "rk4", numbers, lane)
        assert (runs.last_step < 2).all()
        assert np.isnan(runs.gathered.deviation_d2t).all()
        assert np.isnan(runs.series.velocities_d2t[:, 0]).all()
        assert np.isnan(runs.series.deviation_d2t_running).all()
        assert not runs.extrema.peak_count.any()


PRINTED = {
    "forward_euler": ("1.120e8", "1.788e4", "1.374e2"),
    "rk2": ("6.152e-1", "6.250e-2", "7.631e-3"),
    "rk4": ("3.510e-2", "8.288e-3", "2.058e-3"),
    "euler_cromer": ("2.530e-2", "6.206e-3", "1.544e-3"),
}


@pytest.mark.parametrize("kind", PRINTED)
def test_the_tables_of_the_text_are_by_the_centred_difference(kind):
    """B, sections 6.2 and 7.1: w = 2 pi, I = 1, T = 10; relative to ``w^2 I^2/2``."""
    w = 2.0 * np.pi
    for steps, printed in zip((200, 400, 800), PRINTED[kind], strict=True):
        numbers = np.array([[w]]), np.array([[1.0, 0.0]]), np.array([10.0 / steps])
        runs = run(MODELS["spring"], kind, numbers, steps=steps)
        mantissa, exponent = printed.split("e")
        unit = 10.0 ** (int(exponent) - len(mantissa) + 2)
        measured = runs.gathered.deviation_d2t[0] / (0.5 * w * w)
        assert measured == pytest.approx(float(printed), abs=0.5 * unit)


@pytest.mark.parametrize("lane", LANES)
@pytest.mark.parametrize("kind", ["euler_cromer", "euler_cromer_u_first"])
@pytest.mark.parametrize("start", SCHEMES["euler_cromer"].words[0].choices)
def test_peaks_lie_where_the_positions_turn_whenever_the_velocity_is(kind, start, lane):
    """The velocity of Euler-Cromer is half a step away: peaks by it would be dt/2 early or late, and off by dt."""
    scheme, p, steps = SCHEMES[kind], 0.2, 2000
    found = integrate(
        MODELS["spring"],
        scheme,
        {**scheme.defaults(), "start": start},
        np.array([[1.0]]),
        np.array([[0.7, 0.0]]),
        np.array([p]),
        steps,
        1,
        lane=lane,
    )
    # u^n = A cos(n th + phase) with sin(th/2) = p/2; the start is no peak that was computed
    angle = 2.0 * np.arcsin(0.5 * p)
    basis = np.stack([np.cos(angle * np.arange(steps + 1)), np.sin(angle * np.arange(steps + 1))])
    (a, b), *_ = np.linalg.lstsq(basis.T, found.position[0], rcond=None)
    period = 2.0 * np.pi / angle * p
    first = np.arctan2(b, a) / angle * p % period
    count = np.floor((steps * p - max(first, p)) / period)
    whole = found.gathered
    assert whole.period_count[0] in (count, count - 1)
    assert whole.period[0] == pytest.approx(period, abs=0.01 * p / count)
    before, u, ahead = found.position[0, :-2], found.position[0, 1:-1], found.position[0, 2:]
    peaks, several = np.flatnonzero((before < u) & (u > ahead)), int(whole.period_count[0])
    on_grid = (peaks[-1] - peaks[-1 - several]) * p / several
    assert whole.period_grid[0] == pytest.approx(on_grid, rel=1e-12)
    # half a step late a peak would be p^2/8 higher or lower than its parabola says, and a velocity off by p/2 more
    for height in (whole.first_peak[0], whole.last_peak[0], -whole.last_trough[0]):
        assert height == pytest.approx(np.hypot(a, b), rel=p * p / 8.0)


@pytest.mark.parametrize("lane", ["plain", "scalar"])
def test_formulas_that_share_parts_keep_their_values(lane):
    """A formula behind another one must not write to its result, however many parts it works out once."""
    model = MODELS["pendulum"]
    parts = (
        "sin(theta)*sin(theta) + cos(omega)*cos(omega) + exp(t)*exp(t) + sinh(theta)*sinh(theta)"
    )
    formulas = ("1.0 + theta", "2.0 + omega", "3.0 + t", parts, "4.0*theta", parts)
    states = np.array([[[0.3, 0.4]], [[0.1, -0.2]]])
    given = np.ones((1, len(model.parameters))), np.array([0.5])
    found = observed(model, formulas, *given, 1, states, lane=lane)
    theta, omega, t = states[0, 0], states[1, 0], np.array([0.0, 0.5])
    whole = np.sin(theta) ** 2 + np.cos(omega) ** 2 + np.exp(t) ** 2 + np.sinh(theta) ** 2
    wanted = [1 + theta, 2 + omega, 3 + t, whole, 4 * theta, whole]
    np.testing.assert_allclose(found[:, 0], wanted, rtol=1e-14)
