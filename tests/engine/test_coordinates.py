"""Models with several coordinates: every scheme written out for vectors, against the same scheme for one coordinate."""

import dataclasses
import itertools
import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from vibsim.core.errors import SimulationError
from vibsim.engine import integrate
from vibsim.engine.text import Module, collect
from vibsim.models import MODELS
from vibsim.models.base import Damping, Parameter, State
from vibsim.native.machine import machine_code
from vibsim.schemes import FIXED_STEP, SCHEMES
from vibsim.schemes.step_numbers import vector
from vibsim.simulation.adaptive import integrate as integrate_adaptive

END, STEPS = 3.0, 60
ELASTIC = MODELS["elastic_pendulum"].variant(frozenset({"Theta"}))
DRAGGED = MODELS["elastic_pendulum"].variant(frozenset({"Theta", "gamma"}))
START = (0.5, 0.2, 0.3, -0.4)

PARAMETERS = (Parameter("k", 1.0, "1", "stiffness"), Parameter("c", 1.0, "1", "stiffness"))
ALONE = dataclasses.replace(
    MODELS["spring"],
    kind="alone",
    states=(State("a", "1", "place"), State("va", "1", "speed")),
    parameters=PARAMETERS,
    acceleration="-k*a - c*a**3 + 0.1*cos(t)",
    kinetic_energy="0.5*va**2",
    potential_energy="0.5*k*a**2 + 0.25*c*a**4",
    linear=False,
    conservative=False,
    exact=None,
    exact_period=None,
    natural_frequency=lambda p: np.sqrt(p["k"]),
    scales=None,
)
"""One coordinate."""
SIDE_BY_SIDE = dataclasses.replace(
    ALONE,
    kind="side_by_side",
    states=(
        *(State(name, "1", "place") for name in ("a", "b", "z")),
        *(State(name, "1", "speed") for name in ("va", "vb", "vz")),
    ),
    further_accelerations=("-k*b - c*b**3 + 0.1*cos(t)", "-k*z - c*z**3 + 0.1*cos(t)"),
    kinetic_energy="0.5*(va**2 + vb**2 + vz**2)",
    potential_energy="0.5*k*a**2 + 0.25*c*a**4",
)
"""Three times the same, which know nothing of each other."""
STARTS = ((1.0, 0.0), (-0.4, 0.9), (0.0, 1.7))


def run(model, kind, initial, *, steps=STEPS, end=END, parameters=None, lane="plain", **more):
    scheme = SCHEMES[kind]
    options = {**scheme.defaults(), **more.pop("options", {})}
    named = parameters or {}
    row = [named.get(p.name, p.default) for p in model.parameters]
    arrays = np.array([row], dtype=float), np.array([initial]), np.array([end / steps])
    return integrate(model, scheme, options, *arrays, steps, 1, lane=lane, **more)


@pytest.mark.parametrize(
    ("kind", "changed"),
    [
        pytest.param(kind, changed, marks=pytest.mark.slow if changed else ())
        for kind, scheme in FIXED_STEP.items()
        for changed in ({}, *({o.name: word} for o in scheme.words for word in o.choices[1:]))
    ],
)
def test_coordinates_that_know_nothing_of_each_other_move_as_each_would_alone(kind, changed):
    scheme = SCHEMES[kind]
    numbers = {"parameters": {"k": 1.3, "c": 0.6}}
    together = [*(u for u, _ in STARTS), *(v for _, v in STARTS)]
    found = run(SIDE_BY_SIDE, kind, together, options=changed, **numbers).states[:, 0]
    for i, start in enumerate(STARTS):
        alone = run(ALONE, kind, start, options=changed, **numbers).states[:, 0]
        if scheme.explicit:
            assert found[[i, i + 3]].tobytes() == alone.tobytes()
        else:
            # an iteration ends when all coordinates have settled
            np.testing.assert_allclose(found[[i, i + 3]], alone, rtol=0.0, atol=1e-14)


@pytest.mark.parametrize("frequency_correction", [False, True])
def test_a_corrected_frequency_is_that_of_every_coordinate(frequency_correction):
    options = {"frequency_correction": frequency_correction}
    together = [*(u for u, _ in STARTS), *(v for _, v in STARTS)]
    found = run(SIDE_BY_SIDE, "central", together, options=options).states[:, 0]
    for i, start in enumerate(STARTS):
        alone = run(ALONE, "central", start, options=options).states[:, 0]
        assert found[[i, i + 3]].tobytes() == alone.tobytes()


def treated(model):
    return [kind for kind, scheme in FIXED_STEP.items() if scheme.treats(model)]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("model", "kind"),
    [
        pytest.param(model, kind, id=f"{name}-{kind}")
        for name, model in (("free", ELASTIC), ("dragged", DRAGGED))
        for kind in treated(model)
    ],
)
def test_compiled_and_plain_give_the_same_bits(model, kind):
    numbers = {"parameters": {"gamma": 0.3}, "with_series": True, "n_extrema": 8}
    plain, compiled = (
        run(model, kind, START, lane=lane, **numbers) for lane in ("plain", "scalar")
    )
    assert plain.states.tobytes() == compiled.states.tobytes()
    for part in ("gathered", "series", "extrema"):
        one, other = getattr(plain, part), getattr(compiled, part)
        for field in dataclasses.fields(one):
            a, b = getattr(one, field.name), getattr(other, field.name)
            assert (a is None and b is None) or np.array_equal(a, b, equal_nan=True), field.name


def test_what_is_gathered_is_that_of_all_points():
    found = run(DRAGGED, "rk4", START, parameters={"gamma": 0.3}, with_series=True)
    states, dt = found.states[:, 0], END / STEPS
    np.testing.assert_array_equal(found.gathered.ranges[0, :, 0], states.min(axis=1))
    np.testing.assert_array_equal(found.gathered.ranges[0, :, 1], states.max(axis=1))
    sums = dt * np.abs(states).sum(axis=1), np.sqrt(dt * (states**2).sum(axis=1))
    np.testing.assert_allclose(found.gathered.norms[0].T, sums, rtol=1e-13)
    centred = (states[:2, 2:] - states[:2, :-2]) / (2 * dt)
    np.testing.assert_allclose(found.series.velocities_d2t[0][:, 1:-1], centred, rtol=1e-13)
    assert np.isnan(found.series.velocities_d2t[0][:, [0, -1]]).all()

    def energy(x, y, vx, vy, beta=0.9):
        pulled = math.hypot(x, 1 - y) - beta
        return 0.5 * (vx**2 + vy**2) + 0.5 * beta / (1 - beta) * pulled**2 + beta * y

    own = np.array([energy(*state) for state in states.T])
    assert found.gathered.deviation[0] == pytest.approx(np.max(np.abs(own - own[0])), rel=1e-12)
    by_d2t = [energy(*states[:2, n], *centred[:, n - 1]) for n in range(1, STEPS)]
    largest = np.max(np.abs(np.array(by_d2t) - own[0]))
    assert found.gathered.deviation_d2t[0] == pytest.approx(largest, rel=1e-12)


@pytest.mark.parametrize("stride", [3, 20, STEPS])
def test_samples_of_a_stride_are_those_of_every_step(stride):
    whole = run(DRAGGED, "rk4", START, with_series=True)
    scheme = SCHEMES["rk4"]
    row = np.array([[p.default for p in DRAGGED.parameters]])
    arrays = row, np.array([START]), np.array([END / STEPS])
    thinned = integrate(DRAGGED, scheme, {}, *arrays, STEPS, stride, with_series=True)
    assert thinned.states.tobytes() == np.ascontiguousarray(whole.states[..., ::stride]).tobytes()


@pytest.mark.parametrize("kind", ["dop853", "lsoda", "radau"])
def test_adaptive_schemes_take_several_coordinates(kind):
    row = np.array([[0.9, 30.0, 0.0, 0.2]])
    scheme = SCHEMES[kind]
    options = {**scheme.defaults(), "tolerance": 1e-10}
    arrays = row, np.array([START]), np.array([END / STEPS])
    found = integrate_adaptive(DRAGGED, scheme, options, *arrays, STEPS, 1).states[:, 0]

    def right(t, s):
        length, speed = math.hypot(s[0], s[1] - 1), math.hypot(s[2], s[3])
        pull = 0.9 / 0.1 * (1 - 0.9 / length)
        drag = 0.2 / 0.9 * speed
        return s[2], s[3], -pull * s[0] - drag * s[2], -pull * (s[1] - 1) - 0.9 - drag * s[3]

    t = np.linspace(0, END, STEPS + 1)
    exact = solve_ivp(right, (0, END), START, method="DOP853", t_eval=t, rtol=1e-13, atol=1e-14).y
    np.testing.assert_allclose(found, exact, rtol=0.0, atol=2e-8)


@pytest.mark.parametrize("beta", [0.9, 0.999, 1 - 1e-6])
def test_a_pendulum_that_hangs_at_rest_stays_there(beta):
    """Exercise 22b, to the last bit, however stiff the wire is."""
    for kind in treated(ELASTIC):
        found = run(ELASTIC, kind, (0.0,) * 4, parameters={"beta": beta})
        assert not found.states.any()


def test_a_stiff_wire_keeps_its_digits():
    """The force from 40 digits, at a place where L - 1 is as small as 1 - beta."""
    from mpmath import mp, mpf, sqrt

    from vibsim.formula import evaluate
    from vibsim.models import tree

    mp.dps = 40
    for beta, angle in itertools.product((0.9, 1 - 1e-4, 1 - 1e-8), (0.1, 1.0, 3.0)):
        length = 1 + 0.7 * (1 - beta)
        x, y = length * math.sin(angle), 1 - length * math.cos(angle)
        at = {"x": x, "y": y, "vx": 0.0, "vy": 0.0, "t": 0.0, "beta": beta, "gamma": 0.0}
        at |= {"Theta": 0.0, "epsilon": 0.0}
        found = [evaluate(tree(ELASTIC, formula), at) for formula in ELASTIC.accelerations]
        b, u, w = mpf(beta), mpf(x), mpf(y)
        exact = sqrt(u * u + (w - 1) ** 2)
        pull = b / (1 - b) * (1 - b / exact)
        wanted = float(-pull * u), float(-pull * (w - 1) - b)
        # the rounding of x and y themselves is magnified by 1/(1 - beta), that of the formula is not
        np.testing.assert_allclose(found, wanted, rtol=0.0, atol=2e-15 / (1 - beta) + 1e-15)


def product_of_vectors(state, t, dt, p, acceleration):
    u, v = state
    return (u * v, v), v


def compared_vectors(state, t, dt, p, acceleration):
    u, v = state
    if u < v:
        return (u, v), v
    return (v, u), v


def number_and_vector(state, t, dt, p, acceleration):
    u, v = state
    return (u + dt, v), v


def number_over_vector(state, t, dt, p, acceleration):
    u, v = state
    return (dt / u, v), v


def number_less_vector(state, t, dt, p, acceleration):
    u, v = state
    return (dt - u, v), v


def quotient_of_vectors(state, t, dt, p, acceleration):
    u, v = state
    return (u / v, v), v


MEANINGLESS = [
    product_of_vectors,
    compared_vectors,
    number_and_vector,
    number_over_vector,
    number_less_vector,
    quotient_of_vectors,
]
CALL = """\
@entry
def kernel(x):
    step((vector(x[0], x[1]), vector(x[0], x[1])), 0.0, x[0], x)
"""


@pytest.mark.parametrize("function", MEANINGLESS)
def test_what_has_no_meaning_for_vectors_is_refused(function):
    state = vector(1.0, 2.0), vector(1.0, 2.0)
    with pytest.raises(SimulationError, match="multiplies or compares two vectors"):
        function(state, 0.0, 0.1, (), None)
    module = Module("kernel")
    collect(module, function, "step", {})
    module.put("kernel", CALL)
    with pytest.raises(SimulationError, match=r"no such operation|not a number"):
        machine_code(module.text, "kernel", "f1")


def test_blocks_are_for_one_coordinate():
    with pytest.raises(SimulationError, match="several coordinates"):
        run(ELASTIC, "rk4", START, lane="blocks")


def test_quadratic_damping_across_the_motion_is_centred():
    """The geometric mean, which is exact for one coordinate, would be of order 1: see `vibsim.schemes.central`."""
    assert Damping("quadratic", "gamma/beta") == DRAGGED.damping
    errors = []
    for steps in (200, 400, 800):
        numbers = {"steps": steps, "parameters": {"gamma": 1.0}}
        fine = run(DRAGGED, "rk4", START, **numbers).states[:2, 0, -1]
        errors.append(
            np.max(np.abs(run(DRAGGED, "central", START, **numbers).states[:2, 0, -1] - fine))
        )
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.05)
    assert np.log2(errors[1] / errors[2]) == pytest.approx(2.0, abs=0.05)


@pytest.mark.parametrize("initial", [(0.5, 0.2), (0.5, 0.2, 0.3), (0.5,) * 6])
def test_every_state_has_an_initial_value(initial):
    """Compiled code would read what stands beside."""
    with pytest.raises(ValueError, match=r"have the shape \(1, 4\)"):
        run(ELASTIC, "rk4", initial)
