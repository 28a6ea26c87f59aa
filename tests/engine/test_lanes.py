"""Every lane gives the same bits, for every scheme with every option, and every model."""

import dataclasses
import itertools
import warnings

import numpy as np
import pytest
from same_bits import arrays, assert_same_bits

from vibsim.engine import LANES, energies, integrate, lane_for
from vibsim.engine.kernel import source
from vibsim.models import MODELS
from vibsim.schemes import FIXED_STEP, SCHEMES
from vibsim.schemes.base import Flag, NumberOption, Option

CENTRAL = SCHEMES["central"]
MEMBERS = 11
DRIVEN = dataclasses.replace(
    MODELS["pendulum"],
    kind="driven",
    acceleration="-(g/L)*sin(theta) + 0.3*cos(1.7*t)",
    conservative=False,
    exact=None,
    exact_period=None,
)
DRAGGED = dataclasses.replace(
    DRIVEN,
    kind="dragged",
    acceleration="-(g/L)*sin(theta) - 0.02*omega - 0.001*omega**3 + 0.3*cos(1.7*t)",
    dissipation="(0.02 + 0.001*omega**2)*omega**2",
    driving="0.3*cos(1.7*t)*omega",
)
"""A force that depends on all that it may."""


def variants(scheme):
    """Yield every single change of an option: another word, the other flag, an end of what a number may be."""
    for option in scheme.options:
        match option:
            case Option():
                others = option.choices[1:]
            case Flag():
                others = (not option.default,)
            case NumberOption():
                others = {option.least, option.most} - {option.default}
        yield from ({**scheme.defaults(), option.name: other} for other in sorted(others))


def named(*parts):
    return "-".join(map(str, parts))


def lanes_of(scheme):
    """Return the lanes of a scheme: implicit steps have none of vector instructions."""
    return [lane for lane in LANES if scheme.explicit or lane != "blocks"]


FIRST = ("central", "rk4", "euler_cromer", "crank_nicolson")
# a kernel takes some seconds to be compiled: the others are slow
CASES = [
    pytest.param(
        DRAGGED if scheme.velocity_forces else DRIVEN,
        scheme,
        scheme.defaults(),
        id=kind,
        marks=() if kind in FIRST else pytest.mark.slow,
    )
    for kind, scheme in FIXED_STEP.items()
]
VARIED = [
    pytest.param(MODELS["pendulum"], scheme, options, id=named(kind, *options.values()))
    for kind, scheme in FIXED_STEP.items()
    for options in (scheme.defaults(), *variants(scheme))
]
SMOOTH = {kind: model for kind, model in MODELS.items() if model.events is None and model.is_alone}
"""Those with events are stepped in other lanes: `test_events`."""
MODEL_CASES = [
    pytest.param(
        model.variant(frozenset(model.optional)) if model.variant else model,
        id=kind,
        marks=() if kind in ("pendulum", "spring") else pytest.mark.slow,
    )
    for kind, model in SMOOTH.items()
]
"""Every smooth model with all of its terms."""


def members(model, count=MEMBERS, seed=7):
    """Numbers that make some members swing, some go over the top, one rest, one turn far away from home."""
    rng = np.random.default_rng(seed)
    parameters = rng.uniform(0.3, 12.0, (count, len(model.parameters)))
    usual = np.array(
        [
            [1.0, 0.0],
            [3.1, 0.0],
            [-0.5, 7.5],
            [0.2, -9.0],
            [0.0, 0.0],
            [99_999.5, 3.0],
            [-3e6, 40.0],
        ]
    )
    rows = np.arange(count) % len(usual)
    initial = usual[rows] * rng.uniform(0.9, 1.0, (count, 1))
    initial[:, 1] += 0.0  # no negative zeros that a copy might lose
    return parameters, initial, np.linspace(0.01, 0.05, count)


def run(model, numbers, lane, *, steps=240, every=8, scheme=CENTRAL, options=None, **more):
    options = options or scheme.defaults()
    more = {"with_series": True, "n_extrema": 5, **more}
    return integrate(model, scheme, options, *numbers, steps, every, lane=lane, **more)


@pytest.mark.parametrize(
    ("model", "scheme", "options"),
    [*CASES, *(pytest.param(*case.values, id=case.id, marks=pytest.mark.slow) for case in VARIED)],
)
def test_lanes_give_the_same_bits(model, scheme, options):
    numbers = members(model)
    plain, *others = (
        run(model, numbers, lane, scheme=scheme, options=options) for lane in lanes_of(scheme)
    )
    for other in others:
        assert_same_bits(plain, other)
    assert np.isfinite(plain.position).all()


@pytest.mark.parametrize("steps", [2, 3, 64])
@pytest.mark.parametrize("model", MODEL_CASES)
def test_short_runs_with_every_step_stored_have_the_same_bits(model, steps):
    numbers = members(model)
    plain, *others = (run(model, numbers, lane, steps=steps, every=1) for lane in LANES)
    for other in others:
        assert_same_bits(plain, other)


@pytest.mark.parametrize("count", [1, 7, 63, 64, 65, 2100])
@pytest.mark.parametrize("threads", [1, 2, 7])
def test_neither_block_nor_thread_changes_a_member(count, threads):
    model = MODELS["pendulum"]
    numbers = members(model, count)
    one_by_one = run(model, numbers, "scalar", steps=96)
    for lane in ("scalar", "blocks"):
        assert_same_bits(one_by_one, run(model, numbers, lane, steps=96, threads=threads))


@pytest.mark.parametrize("model", MODEL_CASES)
@pytest.mark.parametrize("lane", LANES)
def test_a_member_alone_has_the_bits_it_has_among_others(model, lane):
    numbers = members(model)
    together = run(model, numbers, lane)
    for i in range(MEMBERS):
        alone = run(model, [array[i : i + 1] for array in numbers], lane)
        for (name, a), (_, b) in zip(arrays(alone), arrays(together), strict=True):
            assert a.tobytes() == b[i : i + 1].tobytes(), name


@pytest.mark.slow
@pytest.mark.parametrize("lane", LANES)
@pytest.mark.parametrize("kind", ["central", "rk4"])
@pytest.mark.parametrize("more", [{"with_series": False, "n_extrema": 0}, {"n_extrema": 0}])
def test_what_is_kept_changes_nothing_else(lane, kind, more):
    model, scheme = MODELS["pendulum"], SCHEMES[kind]
    numbers = members(model)
    lean, whole = (run(model, numbers, lane, scheme=scheme, **m) for m in (more, {}))
    assert lean.extrema is None
    wanted = dict(arrays(whole))
    for name, array in arrays(lean):
        assert array.tobytes() == wanted[name].tobytes(), name


def test_a_large_sweep_takes_no_step_more_than_it_needs():
    """Nothing of the centred difference enters the kernel of a scheme whose velocity it is, nor what is not kept."""
    for kind, words in (("central", {"d2t", "turned("}), ("rk4", {"turned("})):
        scheme = SCHEMES[kind]
        for lane in LANES:
            text = source(MODELS["pendulum"], scheme.stepper(scheme.defaults()), lane)
            assert not [word for word in words if word in text]


@pytest.mark.parametrize("lane", LANES)
@pytest.mark.parametrize("model", MODEL_CASES)
def test_without_gathering_the_states_are_the_same(model, lane):
    numbers = members(model)
    bare = run(model, numbers, lane, with_gathered=False, with_series=False, n_extrema=0)
    assert bare.gathered is None
    whole = run(model, numbers, "plain")
    for name in ("position", "velocity", "last_step"):
        assert getattr(bare, name).tobytes() == getattr(whole, name).tobytes(), name


@pytest.mark.parametrize("lane", LANES)
@pytest.mark.parametrize("with_gathered", [True, False])
def test_a_member_that_overflows_ends_and_the_others_go_on(lane, with_gathered):
    """On the linear model w dt = 4 multiplies the solution by -13.9 each step."""
    model = MODELS["linear_pendulum"]
    parameters = np.array([[1.0, 1.0, 1.0], [16.0, 1.0, 1.0], [1.0, 1.0, 1.0]])
    initial = np.array([[1.0, 0.0]] * 3)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        numbers = (parameters, initial, np.ones(3))
        more = {} if with_gathered else {"with_gathered": False, "with_series": False}
        runs = run(model, numbers, lane, steps=400, every=1, **more)
    failed = runs.last_step[1]
    assert 0 < failed < 400
    assert list(runs.last_step[[0, 2]]) == [400, 400]
    assert np.isfinite(runs.position[1, : failed + 1]).all()
    assert np.isnan(runs.position[1, failed + 1 :]).all()
    growth = runs.position[1, 50] / runs.position[1, 49]
    # the double root of x^2 + 14 x + 1 = 0
    assert growth == pytest.approx(-7.0 - np.sqrt(48.0), rel=1e-12)
    assert np.isfinite(runs.position[[0, 2]]).all()


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["central", "rk4"])
@pytest.mark.parametrize("when", ["at once", "on the way", "at the end"])
def test_members_that_fail_have_the_same_bits_in_every_lane(when, kind):
    model = MODELS["linear_pendulum"]
    parameters, initial, _ = members(model, 70)
    initial = np.ones_like(initial)
    parameters[:, :2] = 1.0
    slowly = {"central": 5.09, "rk4": 10.6}[kind]
    parameters[[3, 64], 0] = {"at once": 1e300, "on the way": 16.0, "at the end": slowly}[when]
    numbers, more = (parameters, initial, np.ones(70)), {"steps": 400, "every": 4}
    scheme = SCHEMES[kind]
    plain, *others = (run(model, numbers, lane, scheme=scheme, **more) for lane in LANES)
    failed = plain.last_step[[3, 64]]
    assert (failed < 400).all()
    for other in others:
        assert_same_bits(plain, other)


@pytest.mark.parametrize(
    "acceleration",
    [
        pytest.param("-(g/L)*sin(theta)*exp(-0.01*t)", marks=pytest.mark.slow),
        pytest.param(
            "-(g/L)*where(sin(2*theta) < 0.5, theta, tanh(theta))", marks=pytest.mark.slow
        ),
        pytest.param("-(g/L)*sign(theta)*abs(theta)**1.5", marks=pytest.mark.slow),
        pytest.param("-max(sin(theta), cos(t))*g", marks=pytest.mark.slow),
        pytest.param(
            "-g*theta/L + where(theta > 0.1, sqrt(theta), log(1 + theta**2))",
            marks=pytest.mark.slow,
        ),
        "-(theta if -1 < theta < 1 or not theta < 3 else erf(theta)) - hypot(t, theta)*mod(t, 1e-269*g)",
        pytest.param("(theta < 0 and t > 0) - (theta > 0)", marks=pytest.mark.slow),
        pytest.param("theta < 0 or theta < -1", marks=pytest.mark.slow),
        pytest.param("-g*(heaviside(sin(theta)) - 0.5) - cbrt(theta)", marks=pytest.mark.slow),
        pytest.param("floor(t) + ceil(theta) - round(L*theta)*atanh(t)", marks=pytest.mark.slow),
        pytest.param("expm1(-t) - asinh(theta)*erfc(theta)", marks=pytest.mark.slow),
        pytest.param("-log1p(theta**2)*log10(g)*log2(L)*acosh(theta)", marks=pytest.mark.slow),
    ],
)
def test_formulas_with_branches_and_other_functions_have_the_same_bits(acceleration):
    """Some members are out of the range of the fast functions, where a comparison must not hide it."""
    model = dataclasses.replace(MODELS["pendulum"], acceleration=acceleration)
    numbers = members(model, 70)
    plain, *others = (run(model, numbers, lane, steps=64) for lane in LANES)
    for other in others:
        assert_same_bits(plain, other)


def test_a_condition_is_a_number_in_every_lane():
    """As a truth value it would have no -0."""
    model = dataclasses.replace(MODELS["pendulum"], potential_energy="-(theta < -9e9)")
    parameters, _, dt = members(model)
    states = np.ones((2, MEMBERS, 3))
    for lane in LANES:
        _, potential = energies(model, parameters, dt, 1, states, lane=lane)
        assert np.signbit(potential).all()


@pytest.mark.parametrize("lane", LANES)
def test_energies_of_samples_are_those_that_were_gathered(lane):
    """The largest deviation over all stored steps is the gathered one, to the last bit."""
    model = MODELS["pendulum"]
    numbers = members(model)
    runs = run(model, numbers, lane, every=1)
    kinetic, potential = energies(model, numbers[0], numbers[2], 1, runs.states, lane=lane)
    energy = kinetic + potential
    deviation = np.abs(energy - energy[:, :1])
    assert np.array_equal(np.max(deviation, axis=1), runs.gathered.deviation)
    assert np.array_equal(np.max(deviation[:, :-1], axis=1), runs.gathered.deviation_interior)
    for series, low_high in (
        (runs.position, runs.gathered.ranges[:, 0]),
        (runs.velocity, runs.gathered.ranges[:, 1]),
    ):
        assert np.array_equal(np.min(series, axis=1), low_high[:, 0])
        assert np.array_equal(np.max(series, axis=1), low_high[:, 1])


@pytest.mark.parametrize("lane", LANES)
def test_norms_are_those_of_all_points(lane):
    model = MODELS["pendulum"]
    numbers = members(model)
    runs = run(model, numbers, lane, every=1)
    for series, norms in (
        (runs.position, runs.gathered.norms[:, 0]),
        (runs.velocity, runs.gathered.norms[:, 1]),
    ):
        l1 = numbers[2] * np.sum(np.abs(series), axis=1)
        l2 = np.sqrt(numbers[2] * np.sum(series**2, axis=1))
        # a sum of n terms one after the other is off by n/2 units in the last place at most
        np.testing.assert_allclose(norms[:, 0], l1, rtol=240 * 2.0**-53)
        np.testing.assert_allclose(norms[:, 1], l2, rtol=240 * 2.0**-53)


@pytest.mark.slow
def test_the_kernel_contains_no_contraction_and_no_foreign_call():
    for model, scheme, lane in itertools.product(SMOOTH.values(), FIXED_STEP.values(), LANES):
        text = source(model, scheme.stepper(scheme.defaults()), lane)
        assert "fastmath" not in text
        assert "fma" not in text
        assert "import" not in text.replace("import math", "")
        called = {part.split("(")[0] for part in text.split("math.")[1:]}
        # square roots, absolute values and scaling are exact or correctly rounded everywhere
        assert {name.split()[0].strip(":,)") for name in called} <= {
            "sqrt", "inf", "nan", "ldexp", "frexp", "copysign",
        }  # fmt: skip


def test_the_lane_follows_from_the_size_of_the_work():
    assert lane_for(1, 2**9) == "plain"
    assert lane_for(8, 2**9) == "plain"
    assert lane_for(1, 2**22) == "scalar"
    assert lane_for(2**10, 2**9) == "blocks"
    assert lane_for(1, 2**13) == "plain"
    assert lane_for(1, 2**13, step_work=12.0) == "scalar", (
        "a step that costs twelve is compiled earlier"
    )


def test_a_model_of_several_coordinates_or_with_events_is_compiled_earlier(monkeypatch):
    """In plain Python their steps take ten times as long as those of the pendulum."""
    lanes, rk4 = [], SCHEMES["rk4"]

    def lane_seen(*args, **more):
        lanes.append(lane_for(*args, **more))
        return lanes[-1]

    monkeypatch.setattr("vibsim.engine.trajectories.lane_for", lane_seen)
    for kind in ("pendulum", "elastic_pendulum", "sliding_box"):
        model = MODELS[kind]
        start = np.full((1, len(model.states)), 0.1)
        parameters = np.array([[p.default for p in model.parameters]])
        integrate(model, rk4, rk4.defaults(), parameters, start, np.array([0.001]), 2**14, 2**10)
    assert lanes == ["plain", "scalar", "scalar"]


@pytest.mark.parametrize("model", MODEL_CASES)
def test_values_beyond_all_sense_have_the_same_bits_and_raise_nothing(model):
    """Angles that do not resolve a turn, speeds that overflow, infinite forces."""
    initial = np.array([[1e16, 0.0], [1e308, 1e5], [-1e12, 1e13], [1.0, 1e200], [1e-310, 0.0]])
    parameters = np.ones((5, len(model.parameters)))
    numbers = (parameters, initial, np.full(5, 0.1))
    plain, *others = (run(model, numbers, lane, steps=64) for lane in LANES)
    for other in others:
        assert_same_bits(plain, other)
    assert not (plain.gathered.period <= 0.0).any()


@pytest.mark.slow
def test_division_by_zero_is_no_error_in_any_lane():
    model = dataclasses.replace(MODELS["pendulum"], acceleration="-1/theta + L/(theta - theta)")
    numbers = members(model, 5)
    plain, *others = (run(model, numbers, lane, steps=64) for lane in LANES)
    assert (plain.last_step < 64).all()
    for other in others:
        assert_same_bits(plain, other)
