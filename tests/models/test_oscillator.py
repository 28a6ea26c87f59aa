"""The oscillator of a user's formulas: exact and manufactured solutions, what it recognises, its parameters."""

import itertools
import math

import mpmath
import numpy as np
import pytest

from vibsim.formula import ExpressionError, derivative, parse, values
from vibsim.models import MODELS, tree
from vibsim.models.oscillator import Written, written
from vibsim.models.shared.mechanical import damping_of

EPS = np.finfo(float).eps
DAMPINGS = ("0", "c*v", "c*abs(v)*v", "c*v + v**3", "c*tanh(v)", "b*v", "b*abs(v)*v")
SPRINGS = ("u", "k*u", "k*u + u**3", "sin(u)", "tanh(k*u) - 0.1*u")
EXACT = ("t", "2 - 3*t", "k*cos(2*t)", "exp(-t/5)*sin(3*t)", "t**3 - k*t", "1/(1 + t**2)")


def oscillator(declared="k c", **formulas):
    return written(formulas, tuple(declared.split()))


def numbers(model, **more):
    """Return a value for every parameter, by its key."""
    given = {"m": 1.7, "k": 2.3, "c": 0.4, "b": 0.6, **more}
    return {row.key: given.get(row.name, 1.3) for row in model.parameters}


def by_name(model, parameters):
    return {row.name: parameters[row.key] for row in model.parameters}


def true_motion(t, m, b, k, u_0, v_0):
    """Solve ``m u'' + b u' + k u = 0`` by its characteristic roots, with 60 digits."""
    with mpmath.workdps(60):
        m, b, k, t, u_0, v_0 = map(mpmath.mpf, (m, b, k, t, u_0, v_0))
        half = b / (2 * m)
        root = mpmath.sqrt(mpmath.mpc(k / m - half**2))
        even = mpmath.exp(-half * t) * mpmath.cos(root * t)
        odd = mpmath.exp(-half * t) * (mpmath.sin(root * t) / root if root else t)
        u = u_0 * even + (v_0 + half * u_0) * odd
        v = v_0 * even - (half * v_0 + k / m * u_0) * odd
        return float(mpmath.re(u)), float(mpmath.re(v))


NEAR = (0.0, 1e-15, -1e-15, 1e-12, -1e-12, 1e-9, -1e-9, 1e-6, -1e-6)
FACTORS = (0.0, 1e-9, 0.1, 0.9, *(1.0 + d for d in NEAR), 1.1, 5.0, 1e3, 1e6, -0.3, -1.0, -2.0)


@pytest.mark.parametrize("factor", FACTORS)
@pytest.mark.parametrize(("m", "k"), [(1.0, 1.0), (2.5, 0.7), (0.3, 40.0), (4.0, 9.0)])
def test_exact_solution_of_every_damping_has_all_its_digits(factor, m, k):
    """Below, at and above critical damping, ``b_c = 2 sqrt(m k)``, and where the damping drives."""
    b = factor * 2.0 * math.sqrt(m * k)
    model = oscillator("k", spring="k*u", damping="b*v")
    parameters = numbers(model, m=m, b=b, k=k)
    w = math.sqrt(k / m)
    # up to many decay times of the slow motion; a damping that drives lets it grow
    slow = max(1.0, 2.0 * factor)
    growth = abs(min(factor, 0.0)) + math.sqrt(max(factor**2 - 1.0, 0.0)) * (factor < 0.0)
    for wt, (u_0, v_0) in itertools.product((0.0, 1e-9, 0.5, 3.0, 8.0), ((1.3, 0.0), (-0.4, 2.0))):
        t = wt * slow / w
        found = model.exact(np.array([t]), {"u": u_0, "v": v_0}, parameters)
        u, v = true_motion(t, m, b, k, u_0, v_0)
        size = math.sqrt(k * u_0**2 + m * v_0**2) * math.exp(growth * wt)
        # a rounding of the roots changes the phase, and the growth, by that times wt
        least = 10.0 * EPS * (1.0 + wt) * (1.0 + growth) * size
        assert found["u"][0] == pytest.approx(u, rel=0.0, abs=least / math.sqrt(k))
        assert found["v"][0] == pytest.approx(v, rel=0.0, abs=least / math.sqrt(m))


@pytest.mark.parametrize("k", [0.0, -0.8])
@pytest.mark.parametrize("b", [0.0, 0.6, 5.0])
def test_exact_solution_without_a_restoring_spring(k, b):
    model = oscillator("k", spring="k*u", damping="b*v")
    parameters = numbers(model, m=1.4, b=b, k=k)
    for t in (0.0, 0.3, 4.0):
        found = model.exact(np.array([t]), {"u": 0.5, "v": -0.2}, parameters)
        u, v = true_motion(t, 1.4, b, k, 0.5, -0.2)
        size = abs(u) + abs(v) + 1.0
        assert found["u"][0] == pytest.approx(u, rel=0.0, abs=30 * EPS * size)
        assert found["v"][0] == pytest.approx(v, rel=0.0, abs=30 * EPS * size)
    assert np.isnan(model.natural_frequency(parameters))


def test_exact_solutions_broadcast_over_members():
    model = oscillator("k", spring="k*u", damping="b*v")
    factor = np.array([[0.2], [1.0], [3.0]])
    parameters = {"m": 1.5, "parameters.k": 2.0, "damping.linear": factor * 2 * math.sqrt(3.0)}
    initial = {"u": np.array([[1.0], [0.5], [2.0]]), "v": 0.0}
    t = np.linspace(0, 4, 7)
    found = model.exact(t, initial, parameters)
    for i in range(3):
        alone = {**parameters, "damping.linear": float(parameters["damping.linear"][i, 0])}
        one = model.exact(t, {"u": float(initial["u"][i, 0]), "v": 0.0}, alone)
        for name in ("u", "v"):
            assert found[name].shape == (3, 7)
            assert found[name][i].tobytes() == one[name].tobytes()


@pytest.mark.parametrize(
    ("formulas", "has_one"),
    [
        ({}, True),
        ({"spring": "k*u", "damping": "c*v"}, True),
        ({"damping": "c*abs(v)*v"}, False),
        ({"damping": "c*sign(v)"}, False),
        ({"spring": "u**3"}, False),
        ({"spring": "u + 1"}, False),
        ({"force": "cos(t)"}, True),
        ({"force": "t*cos(t)"}, False),
        ({"force": "cos(t**2)"}, False),
        ({"force": "cos(t)*exp(-c*t)/(1 + c) + 2*sinh(3*t)**2", "damping": "c*v"}, True),
        ({"force": "cos(t)", "spring": "u**3"}, False),
        ({"exact": "cos(t)", "spring": "u**3", "damping": "c*sign(v)"}, True),
    ],
)
def test_which_formulas_have_an_exact_solution(formulas, has_one):
    assert (oscillator(**formulas).exact is not None) == has_one


@pytest.mark.parametrize("exact", EXACT)
@pytest.mark.parametrize("damping", DAMPINGS)
def test_manufactured_force_leaves_no_residual(exact, damping):
    """``m u'' + f(u') + s(u) = F(t)`` along the exact solution, with the second derivative of its formula."""
    t = np.linspace(0.0, 5.0, 41)
    for spring in SPRINGS:
        model = oscillator(exact=exact, damping=damping, spring=spring)
        own = Written({"exact": exact, "damping": damping, "spring": spring}, ("k", "c"))
        parameters = numbers(model)
        known = by_name(model, parameters)
        motion = model.exact(t, {}, parameters)
        u, v = motion["u"], motion["v"]
        at = {**known, "t": t, "u": u, "v": v}
        formula = parse(exact, ("t", *known))
        speed = derivative(formula, "t")
        parts = [
            known["m"] * np.broadcast_to(values(derivative(speed, "t"), known | {"t": t}), t.shape),
            values(own.damping, at),
            values(own.spring, at),
            -values(own.force, at),
        ]
        scale = 1.0 + sum(np.abs(part) for part in parts)
        assert np.max(np.abs(sum(parts)) / scale) <= 20 * EPS
        # and the acceleration is that of the solution
        acceleration = np.broadcast_to(values(tree(model, model.acceleration), at), t.shape)
        assert np.max(np.abs(acceleration - parts[0] / known["m"]) / scale) <= 40 * EPS


@pytest.mark.parametrize("exact", EXACT)
def test_velocity_of_a_manufactured_solution_is_its_slope(exact):
    model = oscillator(exact=exact)
    parameters = numbers(model)
    step = 1e-4
    for t in (0.3, 1.1, 2.9):
        motion = model.exact(t + step * np.array([-2.0, -1.0, 0.0, 1.0, 2.0]), {}, parameters)
        u = motion["u"]
        slope = (8 * (u[3] - u[1]) - (u[4] - u[0])) / (12 * step)
        # error of the difference, step^4 u^(5)/30, and of its round-off
        assert slope == pytest.approx(motion["v"][2], abs=1e-14 * 3**5 + 20 * EPS * 40 / step)


@pytest.mark.parametrize("exact", EXACT)
def test_the_motion_starts_on_the_exact_solution(exact):
    model = oscillator(exact=exact, damping="b*v", spring="k*u + u**3")
    parameters = numbers(model, k=np.array([[0.5], [1.0], [2.0]]))
    start = model.start(parameters)
    motion = model.exact(np.zeros(1), {}, parameters)
    for name in ("u", "v"):
        assert start[name].shape == (3, 1)
        assert start[name].tobytes() == motion[name].tobytes()
    assert oscillator(spring="k*u").start is None


NAMES = ("v", "k", "c", "m")


def is_same(rate, expected):
    known = {"k": 2.3, "c": 0.4, "m": 1.7}
    return math.isclose(values(rate, known), values(parse(expected, known), known), rel_tol=4 * EPS)


@pytest.mark.parametrize(
    ("text", "kind", "rate"),
    [
        ("v", "linear", "1"),
        ("c*v", "linear", "c"),
        ("v*c/2", "linear", "c/2"),
        ("-v", "linear", "-1"),
        ("c*v + k*v", "linear", "c + k"),
        ("(c*k)*(2*v - v/2)", "linear", "c*k*1.5"),
        ("c*v**1", "linear", "c"),
        ("where(k > 1, v, 2*v)", "linear", "1"),
        ("abs(v)*v", "quadratic", "1"),
        ("v*abs(v)", "quadratic", "1"),
        ("c*abs(v)*v", "quadratic", "c"),
        ("v*c*abs(v)*k", "quadratic", "c*k"),
        ("(c/2)*(v*abs(v))", "quadratic", "c/2"),
        ("abs(v)*v/2", "quadratic", "0.5"),
        ("abs(v)*v*c/k", "quadratic", "c/k"),
        ("-(c*v*abs(v))", "quadratic", "-c"),
    ],
)
def test_simple_damping_is_recognised(text, kind, rate):
    found = damping_of(parse(text, NAMES))
    assert found is not None
    assert found[0] == kind
    assert "v" not in found[1].names
    assert is_same(found[1], rate)
    model = oscillator(damping=text)
    assert model.damping.kind == kind
    at = {"m": 1.7, "k": 2.3, "c": 0.4, "u": 0.3, "v": -1.2, "t": 0.0}
    rest, whole, over_mass = (
        float(values(tree(model, formula), at))
        for formula in (oscillator().acceleration, model.acceleration, model.damping.rate)
    )
    force = over_mass * at["v"] * (abs(at["v"]) if kind == "quadratic" else 1.0)
    assert rest - force == pytest.approx(whole, rel=1e-14)
    assert rest == pytest.approx(-at["u"] / at["m"], rel=1e-14)


@pytest.mark.parametrize(
    "text",
    [
        "v**2",
        "v**3",
        "c*v + abs(v)*v",
        "c*sign(v)",
        "c*(v > 0)",
        "where(v > 0, v, 2*v)",
        "where(v > 0, 0, c)",
        "max(v, 0)",
        "c + v",
        # 0 for these or those values of the parameters
        "v + (m - 0.7)",
        "v + where(k > 5, 1, 0)",
        "v + max(k - 3, 0)",
        "c",
        "abs(v)",
        "abs(v)*abs(v)*v",
        "abs(v)*v*v",
        "v/abs(v)",
        "abs(v)*v/(1 + v**2)",
        "v*heaviside(v)",
        "v + floor(v)",
        "c*v - ceil(v)*c*0",
        "round(v)*v",
        "mod(v, 2)",
        "v*mod(v, 1)",
        "v if v > 0 else 0",
        "v if -1 < v < 1 else v",
        "v*(v > 0 or v < 0)",
        "erf(v)",
        "hypot(v, 0)",
        "sin(v)",
        "0.1*v + tanh(v)",
    ],
)
def test_other_damping_is_none_of_the_simple_kinds(text):
    assert damping_of(parse(text, NAMES)) is None
    model = oscillator(damping=text)
    assert model.damping is None
    assert not model.conservative
    assert model.exact is None


@pytest.mark.parametrize("text", ["0", "-0", "0.0"])
def test_no_damping_is_none(text):
    model = oscillator(damping=text)
    assert (model.damping, model.conservative) == (None, True)
    assert "v" not in tree(model, model.acceleration).names


@pytest.mark.parametrize(
    ("text", "is_linear"),
    [
        ("u", True),
        ("k*u", True),
        ("u*k/3 - u", True),
        ("-u", True),
        ("sqrt(k)*u", True),
        ("where(k > 1, u, 2*u)", True),
        ("0", True),
        ("u**3", False),
        ("u + 1", False),
        ("k", False),
        ("sign(u)", False),
        ("u + (u > 1)", False),
        ("u + heaviside(u)", False),
        ("u + floor(u)", False),
        ("u - ceil(u)", False),
        ("u*round(u)", False),
        ("mod(u, 1)", False),
        ("u*mod(u, 1)", False),
        ("u*mod(5, u)", False),
        ("u if u > 0 else u", False),
        ("u*(0 < u < 1)", False),
        ("erf(u)", False),
        ("cbrt(u)", False),
        ("hypot(u, 0)", False),
        ("u*floor(k)", True),
        ("u*mod(k, 2)*heaviside(k)", True),
        ("u if 1 < k < 3 and not k == 2 else 2*u", True),
        ("u*hypot(k, 1)/erf(k)", True),
        ("where(u < 1, u, 2*u - 1)", False),
        ("where(u < 0, 0, 1)", False),
        ("u + m - 0.7", False),
        ("u + where(k > 5, 1, 0)", False),
        ("abs(u)", False),
        ("sin(u)", False),
        ("max(u, 2*u)", False),
    ],
)
def test_linear_springs(text, is_linear):
    model = oscillator(spring=text)
    assert model.linear == is_linear
    assert (model.exact is not None) == is_linear
    assert (model.exact_period is not None) == is_linear


@pytest.mark.parametrize(
    ("formulas", "is_conservative"),
    [
        ({}, True),
        ({"spring": "u**3"}, True),
        ({"force": "0", "damping": "0"}, True),
        ({"damping": "b*v"}, False),
        ({"damping": "c*sign(v)"}, False),
        ({"force": "cos(t)"}, False),
        ({"force": "1"}, False),
        ({"exact": "cos(t)"}, False),
    ],
)
def test_what_is_conservative(formulas, is_conservative):
    assert oscillator(**formulas).conservative == is_conservative


@pytest.mark.parametrize(
    "spring",
    [
        *(*SPRINGS, "k*abs(u)*u", "u/(20 + u**2)", "sinh(k*u)"),
        *("erf(u) + asinh(u/2)", "expm1(k*u/5)", "cbrt(u)", "mod(u, 0.5)", "k*max(u - 0.5, 0)"),
        *("u + 2*heaviside(u - 0.8)", "floor(2*u) + ceil(u) - round(u)", "atanh(u/3)"),
        *("atan(k*u)", "e**u - 1", "2**(-u/3)", "u/sqrt(1 + u**2)", "u*log1p(u**2)"),
    ],
)
def test_slope_of_the_potential_is_the_spring(spring):
    """By the formula's own derivative: the quadrature's too is a formula."""
    model = oscillator(spring=spring)
    known = by_name(model, numbers(model))
    slope = derivative(tree(model, model.potential_energy), "u")
    u = np.array([-2.1, -0.7, -1e-3, 1e-3, 0.2, 0.9, 1.9])
    force = values(parse(spring, ("u", *known)), {**known, "u": u})
    np.testing.assert_allclose(values(slope, {**known, "u": u}), force, rtol=1e-12)


@pytest.mark.parametrize(
    ("spring", "energy"),
    [
        # two springs across the motion, of length 0.7 at rest: B, section 10.7, seen from the side
        ("4*u*(1 - 0.7/hypot(0.7, u))", lambda u: 2 * (u**2 / (mpmath.hypot(u, 0.7) + 0.7)) ** 2),
        ("u/sqrt(1 + u**2)", lambda u: u**2 / (mpmath.sqrt(1 + u**2) + 1)),
        ("u/(1 + u**2)", lambda u: mpmath.log1p(u**2) / 2),
        ("atan(u)", lambda u: u * mpmath.atan(u) - mpmath.log1p(u**2) / 2),
        ("2**u - 1", lambda u: mpmath.expm1(u * mpmath.log(2)) / mpmath.log(2) - u),
        ("u*log1p(u**2)", lambda u: ((1 + u**2) * mpmath.log1p(u**2) - u**2) / 2),
    ],
)
def test_springs_with_poles_beside_the_axis_have_their_energy(spring, energy):
    """From small amplitudes, where a difference would cancel, to large ones, where a plain rule fails."""
    model = oscillator(spring=spring)
    found = tree(model, model.potential_energy)
    with mpmath.workdps(40):
        for u in (1e-3, -0.3, 1.0, 20.0, -100.0):
            right = float(energy(mpmath.mpf(u)))
            assert float(values(found, {"u": u})) == pytest.approx(right, rel=2e-12), u


def test_a_written_potential_is_taken():
    model = oscillator(spring="u", potential="0.5*u**2 + 3")
    assert values(tree(model, model.potential_energy), {"u": 2.0}) == 5.0


@pytest.mark.parametrize(
    ("spring", "stiffness"),
    [("k*u", 2.3), ("k*u + u**3", 2.3), ("sin(3*u)", 3.0), ("tanh(k*u) - u", 1.3)],
)
def test_natural_frequency_is_that_of_small_oscillations(spring, stiffness):
    model = oscillator(spring=spring, damping="b*v")
    parameters = numbers(model)
    assert model.natural_frequency(parameters) == pytest.approx(math.sqrt(stiffness / 1.7))
    many = {**parameters, "m": np.array([1.0, 4.0])}
    np.testing.assert_allclose(
        model.natural_frequency(many), np.sqrt(stiffness / np.array([1.0, 4.0]))
    )


@pytest.mark.parametrize("spring", ["u**3", "-u", "0", "sign(u)", "floor(u)", "u**0.5 - u"])
def test_without_small_oscillations_there_is_no_frequency(spring):
    model = oscillator(spring=spring)
    w = float(model.natural_frequency(numbers(model)))
    assert math.isnan(w) or (spring == "u**0.5 - u" and math.isinf(w))


def test_equal_formulas_are_one_model():
    formulas = {"spring": "k*u", "damping": "b*v", "force": "cos(t)"}
    model = written(formulas, ("k",))
    assert written(dict(reversed(formulas.items())), ("k",)) is model
    assert written(formulas, ("k", "c")) is not model
    assert written({**formulas, "force": "sin(t)"}, ("k",)) is not model
    assert written({}, ()).acceleration == MODELS["oscillator"].acceleration


def test_parameters_stand_in_order_with_their_places():
    model = written({"spring": "z*u", "damping": "b*abs(v)*v"}, ("z", "a"))
    assert [row.name for row in model.parameters] == ["m", "b", "z", "a"]
    keys = ["m", "damping.quadratic", "parameters.z", "parameters.a"]
    assert [row.key for row in model.parameters] == keys
    assert [row.unit for row in model.parameters] == ["kg", "kg m-1", "1", "1"]
    linear = written({"damping": "b*v"}, ())
    assert [row.key for row in linear.parameters] == ["m", "damping.linear"]
    own = written({"damping": "b*v"}, ("b",))
    assert [row.key for row in own.parameters] == ["m", "parameters.b"]


def test_a_declared_b_is_the_users_own():
    model = written({"damping": "c*v", "spring": "b*u"}, ("b", "c"))
    assert [row.key for row in model.parameters] == ["m", "parameters.b", "parameters.c"]
    at = {"m": 2.0, "b": 3.0, "c": 5.0, "u": 1.0, "v": 1.0, "t": 0.0}
    assert values(tree(model, model.acceleration), at) == -4.0


@pytest.mark.parametrize(
    ("formulas", "told"),
    [
        ({}, "m u'' + u = 0"),
        (
            {"spring": "k*u", "damping": "c*v", "force": "cos(2*t)"},
            "m u'' + c*u' + k*u = cos(2*t)",
        ),
        ({"spring": "-u"}, "m u'' - u = 0"),
        (
            {"spring": "u > 1", "damping": "v < 0 or v > k"},
            "m u'' + max(u' < 0, u' > k) + (u > 1) = 0",
        ),
        ({"exact": "cos(t)"}, "m u'' + u = F(t), with F such that u = cos(t)"),
    ],
)
def test_equation_is_written_out(formulas, told):
    assert oscillator(**formulas).equation == told


def test_no_name_is_taken_for_the_velocity_in_the_equation():
    told = "m u'' + heaviside(u')*u' + u = 0"
    assert oscillator(damping="heaviside(v)*v").equation == told
    model = written({"damping": "visc*v"}, ("visc",))
    assert model.equation == "m u'' + visc*u' + u = 0"


@pytest.mark.parametrize("field", ["spring", "damping", "force", "exact", "potential"])
def test_a_formula_names_what_its_field_allows(field):
    foreign = {"spring": "t", "damping": "u", "force": "u", "exact": "v", "potential": "t"}[field]
    with pytest.raises(ExpressionError, match=f"unknown name '{foreign}'"):
        oscillator(**{field: foreign})
