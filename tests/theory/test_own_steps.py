"""Theory of steps that somebody else wrote: they iterate, round, and grow in ways that no scheme of vibsim does."""

import math
from dataclasses import replace

import pytest

from vibsim import Experiment, analyse, simulate, theory, verdicts
from vibsim.cli.commands.theory import theory_rows
from vibsim.core.errors import SimulationError, VibsimError
from vibsim.schemes import FIXED_STEP, Scheme, Stepper
from vibsim.schemes.code_generation import self_starting
from vibsim.schemes.orders import same_orders


def until_small(state, t, dt, p, acceleration):
    """Solve the equation of Crank and Nicolson by iteration, which converges for w dt < 2."""
    u, v = state
    x, change = u, 1.0
    while abs(change) > 1e-12:
        y = u + dt * v + 0.25 * dt * dt * (acceleration(u, v, t, p) + acceleration(x, v, t + dt, p))
        change = y - x
        x = y
    return (x, v + 0.5 * dt * (acceleration(u, v, t, p) + acceleration(x, v, t + dt, p))), v


def until_lost(state, t, dt, p, acceleration):
    """Compare with 1 what is far smaller: a loop that ends in 16 digits, and not in 32."""
    u, v = state
    small = 1.0
    while 1.0 + small * dt != 1.0:
        small = 0.9 * small
    return (u + dt * v, v + dt * acceleration(u, v, t, p)), v


def own(step):
    stepper = self_starting(step)
    return Scheme(
        kind=step.__name__,
        title="of a test",
        source="a test",
        family="own",
        stepper=lambda options: stepper,
        orders=lambda options: same_orders(2),
    )


def test_where_a_loop_does_not_end_there_is_no_theory():
    stepper = own(until_small).stepper({})
    alone = theory.roots(stepper, [0.5, 0.6]).log_growth
    beside = theory.roots(stepper, [0.5, 2.0]).log_growth
    assert abs(alone[0]) < 1e-11
    assert abs(beside[0]) < 1e-11
    assert math.isnan(beside[1])
    u, v = theory.rounding_bound(stepper, 1.0, [0.5, 2.0], 1.0, 0.0, 8)
    assert u[0] < 1e-12
    assert u[1] == v[1] == math.inf


@pytest.mark.slow
def test_a_loop_that_does_not_end_limits_the_step():
    assert 1.8 < theory.stability_limit(own(until_small), {}) < 2.0


def test_a_loop_that_32_digits_do_not_end_is_refused():
    with pytest.raises(VibsimError, match="the theory of the step until_lost cannot be computed"):
        theory.roots(own(until_lost).stepper({}), [0.5])


ROOT = 0.28867513459481287


def gauss_by_iteration(state, t, dt, p, acceleration):
    """Make twelve iterations of Gauss's method, which leaves a growth of the order of (w dt)^14 per step."""
    u, v = state
    a_1 = a_2 = acceleration(u, v, t, p)
    v_1 = v_2 = v
    for _ in range(12):
        x_1 = u + dt * (0.25 * v_1 + (0.25 - ROOT) * v_2)
        x_2 = u + dt * ((0.25 + ROOT) * v_1 + 0.25 * v_2)
        w_1 = v + dt * (0.25 * a_1 + (0.25 - ROOT) * a_2)
        w_2 = v + dt * ((0.25 + ROOT) * a_1 + 0.25 * a_2)
        v_1, v_2 = w_1, w_2
        a_1 = acceleration(x_1, w_1, t + (0.5 - ROOT) * dt, p)
        a_2 = acceleration(x_2, w_2, t + (0.5 + ROOT) * dt, p)
    return (u + dt * 0.5 * (v_1 + v_2), v + dt * 0.5 * (a_1 + a_2)), v


SPLIT = 536870913.0


def verlet_in_single_precision(state, t, dt, p, acceleration):
    """Round position and velocity to 24 bits after each step."""
    u, v = state
    a = acceleration(u, v, t, p)
    x = u + dt * v + 0.5 * dt * dt * a
    w = v + 0.5 * dt * (a + acceleration(x, v, t + dt, p))
    x = x * SPLIT - (x * SPLIT - x)
    w = w * SPLIT - (w * SPLIT - w)
    return (x, w), v


def judged(scheme, levels, *checks):
    experiment = Experiment(
        model="spring",
        parameters={"w": 2.0},
        initial={"u": 1.0, "v": 0.5},
        schemes=[scheme],
        time={"end": 20.0},
        levels=levels,
        checks=[*checks],
    )
    runs = [simulate(experiment, level) for level in experiment.levels]
    return verdicts(experiment, analyse(experiment, runs))


@pytest.mark.parametrize(
    ("step", "order", "limit"),
    [(gauss_by_iteration, 4, 0.0), (verlet_in_single_precision, 2, 2.0)],
)
def test_growth_that_no_run_can_see_is_no_instability(step, order, limit):
    scheme = own(step)
    assert theory.stability_limit(scheme, {}) == pytest.approx(limit, rel=1e-9)
    checks = {"converges": "u", "order": order}, {"stable": True}
    assert [v.status for v in judged(scheme, [6, 7, 8], *checks)] == ["PASS", "PASS"]


OUTER, INNER = 1.3512071919596578, -1.7024143839193153


def suzuki_yoshida(state, t, dt, p, acceleration):
    """Make a step of order 4 from coefficients of 16 digits, whose sum is 1 only to rounding."""
    u, v = state
    for c in (OUTER, INNER, OUTER):
        u = u + 0.5 * c * dt * v
        v = v + c * dt * acceleration(u, v, t, p)
        u = u + 0.5 * c * dt * v
    return (u, v), state[1]


def test_coefficients_of_16_digits_have_the_series_of_the_exact_ones():
    mine, exact = own(suzuki_yoshida), FIXED_STEP["yoshida4"]
    rows = [dict(theory_rows(scheme, scheme.defaults(), 3)) for scheme in (mine, exact)]
    names = ("amplitude", "frequency", "phase")
    assert [rows[0][name] for name in names] == [rows[1][name] for name in names]
    checks = [{"converges": f"u_{part}_error", "order": 4} for part in ("phase", "amplitude")]
    for verdict in judged(mine, [7, 8, 9], *checks):
        assert verdict.status == "PASS"


OLDER = 0.3310585786300049
NEWER = 1.0 + OLDER


def two_step(state, t, dt, p, acceleration):
    """Make a step of order 1 whose two weights of old values differ by 1 only to rounding."""
    u, v, u_before, v_before = state
    a, rest = acceleration(u, v, t, p), dt * (1.0 - OLDER)
    x = NEWER * u - OLDER * u_before + rest * v
    return (x, NEWER * v - OLDER * v_before + rest * a, u, v), v


def test_weights_of_16_digits_that_sum_to_1_leave_no_error_without_a_power_of_dt():
    def start(variant, u, v, dt, p, acceleration):
        return u + dt * v, v + dt * acceleration(u, v, 0.0, p), u, v

    stepper = Stepper(start, two_step)
    scheme = replace(own(two_step), stepper=lambda options: stepper)
    error = dict(theory_rows(scheme, {}, 3))["error"]
    assert error.startswith("u(t) - u_n = I (-")
    assert " p t w cos(t w)" in error.partition("+")[0]
    phase, amplitude = theory.part_orders(stepper, 0.0, 1.0, 0.0)
    assert (float(phase), float(amplitude)) == (2.0, 1.0)


def test_a_step_that_compares_numbers_has_no_series_and_the_order_of_its_position():
    scheme = own(until_small)
    with pytest.raises(theory.NoSeriesError, match="compares numbers"):
        theory.part_orders(scheme.stepper({}), 0.0, 1.0, 0.0)
    assert dict(theory_rows(scheme, {}, 3))["formulas"].startswith("not written: the step compares")
    (verdict,) = judged(scheme, [6, 7, 8], {"converges": "u_phase_error", "order": "scheme"})
    assert verdict.status == "PASS"


def until_both_agree(state, t, dt, p, acceleration):
    """Solve the equations of the midpoint rule by iteration."""
    u, v = state
    x, w, change = u, v, 1.0
    while change > 1e-13:
        a = acceleration(0.5 * (u + x), 0.5 * (v + w), t + 0.5 * dt, p)
        y, z = u + 0.5 * dt * (v + w), v + dt * a
        change = abs(y - x) + abs(z - w)
        x, w = y, z
    return (x, w), v


def test_the_rounding_of_an_iteration_is_no_growth_at_every_step():
    assert 1.0 < theory.stability_limit(own(until_both_agree), {}) < 2.0


def start_by_heun(variant, u, v, dt, p, acceleration):
    a = acceleration(u, v, 0.0, p)
    v_1 = v + dt * a
    a_1 = acceleration(u + dt * v, v_1, dt, p)
    return u + 0.5 * dt * (v + v_1), v + 0.5 * dt * (a + a_1), u, v, a


def step_of_dahlquist(state, t, dt, p, acceleration):
    """Make a step of the explicit method of two steps of the highest order, whose parasitic root is -5."""
    u, v, u_before, v_before, a_before = state
    a = acceleration(u, v, t, p)
    x = 5.0 * u_before - 4.0 * u + dt * (4.0 * v + 2.0 * v_before)
    w = 5.0 * v_before - 4.0 * v + dt * (4.0 * a + 2.0 * a_before)
    return (x, w, u, v, a), v


@pytest.mark.parametrize("levels", [[5, 6, 7], [9, 10, 11]])
def test_finer_levels_are_not_advised_where_they_grow_more(levels):
    stepper = Stepper(start_by_heun, step_of_dahlquist)
    scheme = Scheme(
        kind="dahlquist",
        title="of a test",
        source="Hairer, Norsett and Wanner I, section III.3",
        family="multistep",
        stepper=lambda options: stepper,
        orders=lambda options: same_orders(3),
    )
    assert not theory.is_zero_stable(stepper)
    found = judged(scheme, levels, {"converges": "u", "order": 3}, {"stable": True})
    assert [v.status == "PASS" for v in found] == [False, False]
    for verdict in found:
        assert "Finer levels will not help" in verdict.advice
        assert "or finer" not in verdict.advice


def test_every_scheme_of_vibsim_is_zero_stable():
    assert all(theory.is_zero_stable(s.stepper(s.defaults())) for s in FIXED_STEP.values())


def step_by_direction(state, t, dt, p, acceleration):
    """Compare the velocity with 0, which vectors do not allow."""
    u, v = state
    ahead = v + dt * acceleration(u, v, t, p) if v > 0.0 else v
    return (u + dt * ahead, ahead), v


@pytest.mark.parametrize("level", [4, 17], ids=["plain", "compiled"])
def test_a_step_that_has_no_meaning_for_vectors_is_refused_with_the_name_of_its_scheme(level):
    experiment = Experiment(
        model={"kind": "system", "coordinates": ["x", "y"], "acceleration": {"x": "-x", "y": "-y"}},
        initial={"x": 1.0},
        schemes=[own(step_by_direction)],
        time={"end": 1.0},
        levels=[level],
    )
    with pytest.raises(SimulationError, match="scheme step_by_direction: its step fails: "):
        simulate(experiment, level)


def test_a_step_with_a_root_1_of_higher_multiplicity_has_no_series():
    def start(variant, u, v, dt, p, acceleration):
        return u + dt * v, v, u, u - dt * v

    def step(state, t, dt, p, acceleration):
        u, v, before, first = state
        return (3.0 * u - 3.0 * before + first, v, u, before), v

    with pytest.raises(theory.NoSeriesError, match="does not tend to w"):
        theory.part_orders(Stepper(start, step), 0.0, 1.0, 0.0)
