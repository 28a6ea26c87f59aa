"""Growth, frequency, stability and order: theory against runs, and against what is published."""

import math

import numpy as np
import pytest
from scheme_variants import VARIANTS
from thinned import thinned

from vibsim import theory
from vibsim.engine import integrate
from vibsim.models import MODELS
from vibsim.observe.oscillation import fit_recurrence
from vibsim.schemes import FIXED_STEP, SCHEMES
from vibsim.schemes.base import LOW_STARTS

SPRING = MODELS["spring"]
LIMITS = {
    "central": 2.0,
    "velocity_verlet": 2.0,
    "position_verlet": 2.0,
    "euler_cromer": 2.0,
    "euler_cromer_u_first": 2.0,
    "forward_euler": 0.0,
    "rk2": 0.0,
    "heun": 0.0,
    "ab2": 0.0,
    "rk3": math.sqrt(3.0),
    "rk4": 2.0 * math.sqrt(2.0),
    **dict.fromkeys(["backward_euler", "crank_nicolson", "bdf2", "newmark"], math.inf),
    **dict.fromkeys(["hht", "generalized_alpha", "gauss4"], math.inf),
}


def stepper(kind, **options):
    scheme = SCHEMES[kind]
    return scheme.stepper({**scheme.defaults(), **options})


def growth(method, p):
    """Return the factor by which the amplitude of the principal pair grows in a step."""
    return np.exp(theory.roots(method, p).log_growth)


def run(scheme, options, p, steps):
    p = np.atleast_1d(p)
    starts = np.tile([1.0, 0.3], (len(p), 1))
    return integrate(
        SPRING,
        scheme,
        options,
        np.ones((len(p), 1)),
        starts,
        p,
        steps,
        1,
        lane="plain",
        with_gathered=False,
    )


@pytest.mark.parametrize(("scheme", "options"), VARIANTS)
def test_measured_growth_and_frequency_are_those_of_theory(scheme, options):
    """Measured as the recurrence with two terms that a computed trajectory obeys once parasitic roots are gone."""
    p = np.array([0.07, 0.3])
    skip, steps = 150, 600
    u = run(scheme, options, p, steps).position[:, skip:]
    method = scheme.stepper(options)
    for case, (grown, angle) in enumerate(
        zip(growth(method, p), theory.roots(method, p).angle, strict=True)
    ):
        size = grown ** np.arange(u.shape[1] - 2)
        columns = np.stack([u[case, 1:-1] / size, u[case, :-2] / size], axis=1)
        (trace, minus), *_ = np.linalg.lstsq(columns, u[case, 2:] / size, rcond=None)
        # a rounding enters with its quotient by the square of the angle
        tolerance = 1e-13 / angle**2
        assert math.sqrt(-minus) == pytest.approx(grown, abs=tolerance)
        measured = math.acos(trace / (2 * math.sqrt(-minus)))
        assert measured == pytest.approx(angle, abs=tolerance)


@pytest.mark.parametrize(("kind", "limit"), LIMITS.items())
def test_published_limits(kind, limit):
    scheme = SCHEMES[kind]
    found = theory.stability_limit(scheme, scheme.defaults())
    assert found == pytest.approx(limit, rel=1e-12)


def test_limits_that_are_published_to_some_digits():
    def limit(kind):
        return theory.stability_limit(SCHEMES[kind], SCHEMES[kind].defaults())

    assert limit("ab3") == pytest.approx(0.7236, abs=5e-5)
    assert limit("yoshida4") == pytest.approx(1.5734, abs=5e-5)


# Newmark damps where gamma > 1/2; a root at -1 leaves the circle at (gamma/2 - beta)^(-1/2)
CROSSINGS = [
    ("ab3", {}, 12 / (5 * math.sqrt(11))),
    ("rkn4", {}, 2.58651889451956),
    ("newmark", {"beta": 0.0, "gamma": 0.75}, 0.375**-0.5),
    ("newmark", {"beta": 0.25, "gamma": 0.6}, 0.05**-0.5),
]


@pytest.mark.parametrize(("kind", "options", "limit"), CROSSINGS)
def test_a_root_that_crosses_the_circle_gives_the_limit_to_rounding(kind, options, limit):
    scheme = SCHEMES[kind]
    found = theory.stability_limit(scheme, {**scheme.defaults(), **options})
    assert found == pytest.approx(limit, rel=1e-14)


@pytest.mark.parametrize(("gap", "rel"), [(1e-6, 1e-10), (1e-7, 1e-12), (1e-11, 1e-6)])
def test_limits_far_beyond_any_use_are_found(gap, rel):
    beta = round(0.25 - gap, 12)
    limit = theory.stability_limit(SCHEMES["newmark"], {"beta": beta, "gamma": 0.5})
    assert limit == pytest.approx(gap**-0.5, rel=rel)


@pytest.mark.parametrize("p", [0.5, 0.7, 0.7236, 0.8])
def test_a_long_run_is_left_with_the_dominant_root(p):
    """Of AB3 that is a parasitic one from w dt = 0.68 on."""
    scheme = SCHEMES["ab3"]
    most, angle = theory.dominant(scheme.stepper({}), p)
    found = fit_recurrence(run(scheme, {}, p, 1500).position[0])
    assert np.exp(found.log_growth * 2 * np.pi / p) == pytest.approx(most, rel=1e-10)
    assert found.angle == pytest.approx(angle, rel=1e-10)
    assert (most > growth(scheme.stepper({}), p) ** (2 * np.pi / p) * 1.1) == (p > 0.68)


@pytest.mark.parametrize("beta", [0.0, 1 / 12, 1 / 6, 0.2, 0.25, 0.3])
def test_the_limit_of_newmark_follows_beta(beta):
    limit = theory.stability_limit(SCHEMES["newmark"], {"beta": beta, "gamma": 0.5})
    assert limit == pytest.approx(1 / math.sqrt(0.25 - beta) if beta < 0.25 else math.inf)


@pytest.mark.parametrize(("scheme", "options"), thinned(VARIANTS, 2))
def test_runs_stay_bounded_below_the_limit_and_grow_above_it(scheme, options):
    limit = theory.stability_limit(scheme, options)
    if limit == 0:
        assert growth(scheme.stepper(options), 1e-3) > 1
        return
    if limit == math.inf:
        assert np.nanmax(np.abs(run(scheme, options, 300.0, 2000).position)) < 1e4
        return
    runs = run(scheme, options, limit * np.array([0.999, 1.01]), 4000)
    assert np.max(np.abs(runs.position[0])) < 200
    assert runs.last_step[1] < 4000 or np.max(np.abs(runs.position[1])) > 1000


@pytest.mark.parametrize(("scheme", "options"), thinned(VARIANTS, 4))
def test_the_declared_orders_are_those_of_the_exact_discrete_solution(scheme, options):
    """On the linear problem, without rounding: position, velocity and energy."""
    names = ("u", "v", "energy_deviation")
    errors = {name: [] for name in names}
    for steps in (4096, 8192):
        t, n = np.linspace(0.0, 6.0, 65), np.arange(65) * (steps // 64)
        u, v = theory.discrete(scheme.stepper(options), 1.0, 6.0 / steps, 1.0, 0.4, n)
        exact_u, exact_v = np.cos(t) + 0.4 * np.sin(t), 0.4 * np.cos(t) - np.sin(t)
        energy = (u * u + v * v) / 2 - (1.0 + 0.4**2) / 2
        for name, error in zip(names, (u - exact_u, v - exact_v, energy), strict=True):
            errors[name].append(np.max(np.abs(error)))
    is_trap = options.get("start") in LOW_STARTS
    for name in names:
        promised = scheme.formal_order(name, SPRING, options)
        coarse, fine = errors[name]
        if promised == math.inf:
            assert coarse < 1e-14
        elif fine > 1e-13:
            assert math.log2(coarse / fine) == pytest.approx(1 if is_trap else promised, abs=0.02)
        else:
            # too small to tell: no more than the order says
            assert coarse < 10 * (6.0 / 4096) ** promised


def test_the_text_on_the_centred_scheme():
    method = stepper("central")
    p = np.array([1e-4, 0.2, 1.0, 1.9, 2.0])
    # (18)
    np.testing.assert_allclose(theory.roots(method, p).angle, 2 * np.arcsin(p / 2), rtol=1e-15)
    # dt = 0.1 and w = 2 pi: the period is 0.98307, and peaks come 0.0169 early (errata)
    early = theory.phase_error_per_period(method, 0.2 * np.pi)
    assert 1 - early == pytest.approx(0.98307, abs=5e-6)
    # section 4.6: 0.36 P at the limit
    assert theory.phase_error_per_period(method, 2.0) == pytest.approx(1 - 2 / np.pi)


def test_weak_growth_is_not_lost_in_rounding():
    """Nor in that of the coefficients: with floats for 1/6 and 1/3 that of RK4 is 0.4 percent off."""
    p = 1e-3
    rk4, rk2 = (theory.roots(stepper(kind), p).log_growth for kind in ("rk4", "rk2"))
    assert rk4 == pytest.approx(-(p**6) / 144, rel=1e-6, abs=0)
    assert rk2 == pytest.approx(p**4 / 8, rel=1e-5, abs=0)
    assert abs(theory.roots(stepper("yoshida4"), p).log_growth) < 1e-30


@pytest.mark.parametrize("scheme", FIXED_STEP.values(), ids=FIXED_STEP)
def test_the_radius_is_that_of_the_matrix(scheme):
    method = scheme.stepper(scheme.defaults())
    p = np.array([[0.1, 0.5], [1.1, 2.5]])
    matrix = theory.amplification(method, p).matrix.rounded
    largest = np.abs(np.linalg.eigvals(matrix)).max(axis=-1)
    found = np.maximum(growth(method, p), theory.roots(method, p).parasitic)
    np.testing.assert_allclose(found, largest, rtol=1e-7)
