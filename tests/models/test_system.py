"""Systems that a user writes: frequencies, energies, names; a chain against its modes."""

import itertools

import numpy as np
import pytest
from model_cases import CASES
from scipy.integrate import solve_ivp

from vibsim import Experiment, analyse, simulate
from vibsim.engine import integrate
from vibsim.formula import evaluate, parse, values
from vibsim.models import tree
from vibsim.models.shared.coordinates import MOST, coordinate_faults, name_fault
from vibsim.models.system import written
from vibsim.schemes import FIXED_STEP, SCHEMES
from vibsim.schemes.base import MOST_UNKNOWNS


def chain(count, k="k"):
    """Masses 1 between walls, held by equal springs, whose motion is known by its modes."""
    names = tuple(f"q{i}" for i in range(count))
    sides = ("0", *names, "0")
    return written(
        names,
        {
            f"acceleration.{name}": f"{k}*({sides[i]} - 2*{name} + {sides[i + 2]})"
            for i, name in enumerate(names)
        },
        ("k",),
    )


def modes(count, k):
    """Frequencies and shapes of these, from the text books."""
    j = np.arange(1, count + 1)
    shapes = np.sqrt(2.0 / (count + 1)) * np.sin(np.pi * np.outer(j, j) / (count + 1))
    return 2.0 * np.sqrt(k) * np.sin(0.5 * np.pi * j / (count + 1)), shapes


@pytest.mark.parametrize("count", [1, 2, 5, 64])
def test_frequencies_are_those_of_the_modes(count):
    model = chain(count)
    k = np.array([0.5, 2.0, 2.0])
    found = model.natural_frequency({"parameters.k": k})
    np.testing.assert_allclose(found, [modes(count, x)[0][0] for x in k], rtol=1e-11)
    if count > 1:
        found = model.highest_frequency({"parameters.k": k})
        np.testing.assert_allclose(found, [modes(count, x)[0][-1] for x in k], rtol=1e-13)


def test_velocities_that_turn_the_motion_change_its_frequencies():
    """A charge in a magnetic field on a spring: ``sqrt((B/2)^2 + k) -+ B/2``; damping that couples changes none."""
    texts = {"acceleration.x": "B*vy - k*x - c*vx + c*vy", "acceleration.y": "-B*vx - k*y + c*vx"}
    model = written(("x", "y"), texts, ("B", "k", "c"))
    b, k = np.array([1.3, 4.0, 0.0]), np.array([0.4, 1.0, 2.0])
    own = {"parameters.B": b, "parameters.k": k, "parameters.c": np.zeros(3)}
    for found, sign in ((model.natural_frequency(own), -1.0), (model.highest_frequency(own), 1.0)):
        np.testing.assert_allclose(found, np.sqrt(0.25 * b**2 + k) + sign * 0.5 * b, rtol=1e-12)
    own |= {"parameters.B": np.zeros(3), "parameters.c": np.full(3, 0.2)}
    np.testing.assert_allclose(model.natural_frequency(own), np.sqrt(k), rtol=1e-12)


@pytest.mark.parametrize(("text", "known"), [("u", False), ("-u + 1/p", True), ("0*u", False)])
def test_a_frequency_that_is_none_is_no_number(text, known):
    model = written(("u",), {"acceleration.u": text}, ("p",))
    assert np.isfinite(model.natural_frequency({"parameters.p": 1.0})) == known


@pytest.mark.parametrize("count", [2, 16])
def test_a_chain_moves_as_its_modes_do(count):
    """By a scheme of order 4, compiled, against cosines; the energy is found and is that of the springs."""
    model, k = chain(count), 1.7
    w, shapes = modes(count, k)
    start = np.zeros(count)
    start[0] = 1.0
    end, steps = 6.0, 2000
    scheme = SCHEMES["pefrl"]
    arrays = np.array([[k]]), np.array([[*start, *np.zeros(count)]]), np.array([end / steps])
    run = integrate(model, scheme, scheme.defaults(), *arrays, steps, steps, lane="scalar")
    exact = shapes @ (np.cos(w * end) * (shapes.T @ start))
    np.testing.assert_allclose(run.states[:count, 0, -1], exact, rtol=0.0, atol=1e-10)
    assert model.conservative
    states = np.random.default_rng(2).normal(size=2 * count)
    at = dict(zip((s.name for s in model.states), states, strict=True)) | {"k": k}
    stretch = np.diff([0.0, *states[:count], 0.0])
    found = evaluate(tree(model, model.potential_energy), at)
    assert found == pytest.approx(0.5 * k * np.sum(stretch**2), rel=1e-12)
    found = evaluate(tree(model, model.kinetic_energy), at)
    assert found == pytest.approx(0.5 * np.sum(states[count:] ** 2), rel=1e-12)


@pytest.mark.parametrize(
    ("names", "formulas", "potential", "is_conservative"),
    [
        (("u",), {"acceleration.u": "mu*(1 - u**2)*v - u"}, "u**2/2", False),
        (("u",), {"acceleration.u": "-sin(u)"}, "1 - cos(u)", True),
        (("u",), {"acceleration.u": "(cos(t) - 2*u)/mu"}, "u**2/mu", False),
        (("u",), {"force.u": "cos(t) - 2*u", "mass.u": "mu"}, "u**2", False),
        (("u",), {"acceleration.u": "-(1 + mu*cos(t))*u"}, "u**2/2", False),
        (("u",), {"acceleration.u": "-cos(t)*u"}, "0", False),
        (("x", "y"), {"acceleration.x": "-2*x*y", "acceleration.y": "-x**2 - y"}, "x**2*y + y**2/2", True),
        # around the origin: no energy has such a force
        (("x", "y"), {"acceleration.x": "-y", "acceleration.y": "x"}, "0", False),
        (("x", "y"), {"acceleration.x": "vy", "acceleration.y": "-vx"}, "0", True),
        (
            ("x", "y"),
            {"force.x": "exp(-x) - exp(x - y)", "force.y": "exp(x - y) - exp(y)"},
            "exp(-x) + exp(x - y) + exp(y) - 3",
            True,
        ),
        (("x", "y"), {"force.x": "mu*sin(y - x)", "force.y": "mu*sin(x - y)"}, "mu*(1 - cos(x - y))", True),
        (("x", "y"), {"force.x": "-tanh(2*x + y)*2", "force.y": "-tanh(2*x + y)"}, "log(cosh(2*x + y))", True),
        (
            ("x", "y"),
            {"force.x": "y - x", "force.y": "x - y - mu*vy", "mass.x": "2", "mass.y": "mu"},
            "(x - y)**2/2",
            False,
        ),
        (
            ("x", "y"),
            {"force.x": "mu*(y - x)**3 - x", "force.y": "-mu*(y - x)**3 + (mu - 2*y)**2"},
            "mu*(x - y)**4/4 + x**2/2 + ((mu - 2*y)**3 - mu**3)/6",
            True,
        ),
        # what acts late, for a short time, far away or fast only
        (("u",), {"acceleration.u": "-u + where(t > 5, 1, 0)"}, "u**2/2", False),
        (("u",), {"acceleration.u": "-u + heaviside(t - 700) - heaviside(t - 700.001)"}, "u**2/2", False),
        (("u",), {"acceleration.u": "-u - v*max(abs(u) - 2, 0)"}, "u**2/2", False),
        (("u",), {"acceleration.u": "-u - mu*v*(u > 20 and u < 21)"}, "u**2/2", False),
        (("u",), {"acceleration.u": "-u - mu*sign(v)*max(abs(v) - 2, 0)"}, "u**2/2", False),
        (("x", "y"), {"acceleration.x": "-x - y*max(x - 2, 0)", "acceleration.y": "-y"}, "0", False),
        (("u",), {"acceleration.u": "-u - 3*max(u - 2, 0)"}, "u**2/2 + 3*max(u - 2, 0)**2/2", True),
        (
            ("x", "y"),
            {"acceleration.x": "vy*(t > 5)", "acceleration.y": "-vx*(t > 5)"},
            "0",
            True,
        ),
    ],
)  # fmt: skip
def test_the_energy_is_found_where_there_is_one(names, formulas, potential, is_conservative):
    model = written(names, formulas, ("mu",))
    rng = np.random.default_rng(4)
    at = {state.name: rng.normal(size=9) for state in model.states} | {"mu": 0.7, "t": 0.3}
    found = values(tree(model, model.potential_energy), at)
    expected = values(parse(potential, at), at)
    np.testing.assert_allclose(np.broadcast_to(found, 9), expected + np.zeros(9), rtol=1e-11)
    assert model.conservative == is_conservative


BY_MASSES = {
    "mass.a.a": "(m1 + m2)*l1**2",
    "mass.a.b": "m2*l1*l2*cos(a - b)",
    "mass.b": "m2*l2**2",
    "force.a": "-(m1 + m2)*g*l1*sin(a)",
    "force.b": "-m2*g*l2*sin(b)",
}


def test_masses_of_two_coordinates_give_the_accelerations_that_are_known():
    """The double pendulum, whose accelerations and energies another case writes out."""
    case = CASES["system-double_pendulum"]
    model = written(("a", "b"), BY_MASSES, case.declared)
    rng = np.random.default_rng(8)
    at = {s.name: rng.normal(size=50) for s in model.states}
    at |= {name: rng.uniform(0.5, 2.0, 50) for name in case.declared}
    formulas = zip(model.accelerations, case.model.accelerations, strict=True)
    for own, known in (*formulas, (model.kinetic_energy, case.model.kinetic_energy)):
        expected = values(tree(case.model, known), at)
        np.testing.assert_allclose(values(tree(model, own), at), expected, rtol=1e-12, atol=1e-12)
    still = dict.fromkeys(("a", "b"), np.zeros(1))
    found, known = (
        values(tree(m, m.potential_energy), at) - values(tree(m, m.potential_energy), at | still)
        for m in (model, case.model)
    )
    np.testing.assert_allclose(found, known, rtol=1e-12, atol=1e-12)
    assert model.conservative


def test_a_cart_with_two_pendulums_moves_as_its_equations_say():
    """Three coordinates with masses in common, and one alone whose mass depends on its position."""
    model = written(
        ("x", "b", "c", "z"),
        {
            "mass.x.x": "m",
            "mass.b.x": "cos(b)",
            "mass.x.c": "2*cos(c)",
            "mass.c": "2",
            "mass.z": "1 + z**2",
            "force.x": "-vx",
            "force.b": "-sin(b)",
            "force.c": "-2*sin(c)",
            "force.z": "-z",
        },
        ("m",),
    )
    rng, m = np.random.default_rng(9), 4.0
    for _ in range(20):
        q, w = rng.normal(size=(2, 4))
        at = dict(zip((s.name for s in model.states), (*q, *w), strict=True)) | {"m": m}
        cb, cc, sb, sc = np.cos(q[1]), np.cos(q[2]), np.sin(q[1]), np.sin(q[2])
        matrix = [[m, cb, 2 * cc], [cb, 1.0, 0.0], [2 * cc, 0.0, 2.0]]
        right = -w[0] + sb * w[1] ** 2 + 2 * sc * w[2] ** 2, -sb, -2 * sc
        # a bead on the parabola y = z^2/2
        bead = -q[3] * (1.0 + w[3] ** 2) / (1.0 + q[3] ** 2)
        expected = [*np.linalg.solve(matrix, right), bead]
        found = [evaluate(tree(model, a), at) for a in model.accelerations]
        np.testing.assert_allclose(found, expected, rtol=1e-11, atol=1e-12)
        assert evaluate(tree(model, model.dissipation), at) == pytest.approx(w[0] ** 2, abs=1e-10)


def test_a_free_body_in_polar_coordinates_moves_along_a_straight_line():
    """``r = sqrt(1 + t^2)``, ``a = atan t``: the mass of one coordinate depends on the other."""
    model = written(("r", "a"), {"mass.a": "r**2", "force.r": "0", "force.a": "0"}, ())
    for t in (0.3, -2.0):
        square = 1.0 + t * t
        at = {"r": np.sqrt(square), "a": np.arctan(t), "vr": t / np.sqrt(square), "va": 1 / square}
        found = [evaluate(tree(model, a), at) for a in model.accelerations]
        np.testing.assert_allclose(found, [square**-1.5, -2 * t / square**2], rtol=1e-14)


def test_a_bar_of_elements_with_consistent_masses_has_its_frequencies():
    """64 coordinates, each of which has a mass in common with its neighbours, as linear elements give them.

    M_ii = 2/3, M_ij = 1/6 and the stiffness (2, -1) in units of an element have
    ``w^2 = 6 (1 - cos(k pi/65))/(2 + cos(k pi/65))``.
    """
    names = [f"x_{i}" for i in range(1, 65)]
    formulas = {}
    for left, name, right in zip(["0", *names], names, [*names[1:], "0"], strict=False):
        formulas |= {f"mass.{name}": "2*m/3", f"force.{name}": f"k*({left} - 2*{name} + {right})"}
        formulas |= {f"mass.{name}.{right}": "m/6"} if right != "0" else {}
    model = written(tuple(names), formulas, ("m", "k"))
    own = {"parameters.m": np.array([1.0, 4.0]), "parameters.k": np.array(9.0)}
    phase = np.cos(np.pi * np.arange(1, 65) / 65)
    expected = 3.0 * np.sqrt(6.0 * (1.0 - phase) / (2.0 + phase))
    np.testing.assert_allclose(model.natural_frequency(own), expected[0] / [1.0, 2.0], rtol=1e-11)
    np.testing.assert_allclose(model.highest_frequency(own), expected[-1] / [1.0, 2.0], rtol=1e-11)
    assert model.conservative


@pytest.mark.parametrize("kind", SCHEMES)
def test_a_scheme_takes_masses_where_it_takes_the_accelerations(kind):
    """Masses that depend on positions bring forces that depend on velocities."""
    case = CASES["system-double_pendulum"]
    masses = written(("a", "b"), BY_MASSES, case.declared)
    assert SCHEMES[kind].treats(masses) == SCHEMES[kind].treats(case.model)


def test_what_feeds_the_motion_of_van_der_pol_is_negative_damping():
    model = written(("u",), {"acceleration.u": "mu*(1 - u**2)*v - u"}, ("mu",))
    at = {"u": 0.5, "v": 2.0, "mu": 0.7}
    power = evaluate(tree(model, model.dissipation), at)
    assert power == pytest.approx(-0.7 * (1 - 0.25) * 4.0, rel=1e-14)
    assert model.driving is None


@pytest.mark.parametrize(
    ("x", "y", "superposed"),
    [
        ("-2*x + y", "x - y", True),
        ("-x + p*vy", "-y - p*vx", True),
        ("-x**3", "-y", False),
        ("-x", "-y - vy", False),
        ("-x", "-sign(y)", False),
    ],
)
def test_a_sum_of_linear_motions_has_their_energy(x, y, superposed):
    """On it the energy of RK4 is of order 5, and that of Gauss's method exact."""
    model = written(("x", "y"), {"acceleration.x": x, "acceleration.y": y}, ("p",))
    assert model.superposed == superposed
    orders = [SCHEMES[kind].formal_order("energy", model, {}) for kind in ("rk4", "gauss4")]
    assert orders == ([5.0, np.inf] if superposed else [4.0, 4.0])
    if not superposed:
        return
    drifts = []
    for kind, steps in (("rk4", 40), ("rk4", 80), ("gauss4", 40)):
        arrays = np.array([[0.4]]), np.array([[1.0, 0.2, -0.3, 0.5]]), np.array([6.0 / steps])
        run = integrate(model, SCHEMES[kind], {}, *arrays, steps, 1)
        drifts.append(run.gathered.deviation[0])
    assert np.log2(drifts[0] / drifts[1]) == pytest.approx(5.0, abs=0.1)
    assert drifts[2] < 1e-14


COMPILED = ("system-van_der_pol", "system-mathieu", "system-double_pendulum", "system-chain")


@pytest.mark.slow
@pytest.mark.parametrize("name", COMPILED)
@pytest.mark.parametrize("kind", FIXED_STEP)
def test_compiled_and_plain_give_the_same_bits(name, kind):
    case, scheme = CASES[name], SCHEMES[kind]
    if not scheme.treats(case.model):
        assert case.model.velocity not in ("vmath",)
        return
    lanes = ["plain", "scalar"]
    if case.coordinates == 1 and scheme.explicit:
        lanes.append("blocks")
    runs = [case.run(scheme, 64, lane=lane, with_series=True, n_extrema=4) for lane in lanes]
    for one, other in itertools.pairwise(runs):
        assert one.states.tobytes() == other.states.tobytes()
        np.testing.assert_array_equal(one.gathered.ranges, other.gathered.ranges)
        np.testing.assert_array_equal(one.series.deviation_running, other.series.deviation_running)


@pytest.mark.slow
def test_names_of_users_are_no_names_of_kernels():
    """Words that the text of a kernel, Python or C has for something else."""
    names = ("p", "math", "samples", "int", "vector", "stats", "double", "_u"[1:], "state", "run")
    formulas = {f"acceleration.{name}": f"-({i} + p**2)*{name}" for i, name in enumerate(names, 1)}
    model = written(names, formulas, ())
    plain = [f"x{i}" for i in range(len(names))]
    same = {f"acceleration.{x}": f"-({i} + x0**2)*{x}" for i, x in enumerate(plain, 1)}
    start = np.linspace(0.1, 1.0, 2 * len(names))[None]
    scheme = SCHEMES["rk4"]
    runs = [
        integrate(m, scheme, {}, np.empty((1, 0)), start, np.array([0.1]), 20, 1, lane=lane)
        for m in (model, written(tuple(plain), same, ()))
        for lane in ("plain", "scalar")
    ]
    assert len({run.states.tobytes() for run in runs}) == 1


def test_schemes_are_refused_where_their_equations_are_too_many():
    few, many = chain(MOST_UNKNOWNS // 2), chain(MOST)
    refused = {kind for kind, scheme in SCHEMES.items() if not scheme.treats(many)}
    assert refused == {kind for kind, s in FIXED_STEP.items() if not s.explicit}
    assert all(scheme.treats(few) for scheme in SCHEMES.values())


def test_names_of_files_are_refused():
    """Every variable that is not one of a state, and whatever would become one behind a word of a state."""
    experiment = Experiment.from_dict(
        {
            "title": "t",
            "model": {"kind": "system", "acceleration": {"q": "-q - 0.1*vq"}, "coordinates": ["q"],
                      "outputs": {"twice": "2*q"}},
            "initial": {"q": 1.0},
            "time": {"end": 20.0, "base_steps": 64},
            "levels": [0, 1, 2],
            "schemes": ["rk4", "dop853"],
            "sweep": {"initial.q": [1.0, 2.0]},
        }
    )  # fmt: skip
    levels = [simulate(experiment, level) for level in experiment.levels]
    names = {
        str(name) for data in (*levels, analyse(experiment, levels)) for name in data.variables
    }
    own = {name for name in names if name.partition("_")[0] in ("q", "vq", "twice")}
    suffixes = {name.partition("_")[2] for name in own}
    others = names - own
    assert len(others) > 40
    stems = {name.removesuffix(f"_{suffix}") for name in others for suffix in suffixes}
    assert {name for name in others | stems if not name_fault(name)} == set()
    assert not any(map(name_fault, ("q", "omega", "x", "theta_1", "force", "size", "z2")))


@pytest.mark.parametrize(
    "names", [("x", "x"), ("x", "vx"), ("vx", "x"), ("x", "x_min"), ("x_min", "x"), ("t",), ("e",)]
)
def test_names_that_cannot_be_told_apart_are_refused(names):
    assert any(coordinate_faults(names))


def test_what_drives_and_what_damps_are_told_apart():
    """A pumped pendulum on a driven cart, with damping: against the integrals of both powers."""
    model = {
        **{"kind": "system", "coordinates": ["x", "q"], "parameters": {"c": 0.2, "d": 0.1}},
        "mass": {"x": {"x": 3, "q": "cos(q)"}, "q": 1},
        "force": {"x": "-4*x - c*vx + cos(1.3*t)", "q": "-(2 + 0.3*sin(t))*sin(q) - d*vq"},
    }
    run = {"title": "t", "model": model, "initial": {"q": 1.0}, "time": {"end": 10.0}}
    run |= {"levels": [10], "schemes": ["rk4"], "checks": [{"stable": True}]}

    def rates(t, y):
        x, q, vx, vq = y[:4]
        mass = [[3, np.cos(q)], [np.cos(q), 1]]
        push, pump = np.cos(1.3 * t), -0.3 * np.sin(t) * np.sin(q)
        pull = -4 * x - 0.2 * vx + push + np.sin(q) * vq**2
        a = np.linalg.solve(mass, [pull, -2 * np.sin(q) + pump - 0.1 * vq])
        return [vx, vq, *a, 0.2 * vx**2 + 0.1 * vq**2, push * vx + pump * vq]

    known = solve_ivp(rates, (0, 10), [0, 1.0, 0, 0, 0, 0], rtol=1e-11, atol=1e-12).y[:, -1]
    level = simulate(Experiment.from_dict(run), 10)
    found = [float(level[name][0, 0, -1]) for name in ("x", "q", "dissipated_energy", "work_done")]
    assert found == pytest.approx(known[[0, 1, 4, 5]], abs=1e-6)
