"""Growth and frequency from the recurrence that the steps of a linear problem satisfy."""

import numpy as np
import pytest
from spring_runs import spring
from thinned import thinned

from vibsim import Experiment, analyse, simulate, theory, verdicts
from vibsim.engine import integrate
from vibsim.models import MODELS
from vibsim.observe import oscillation
from vibsim.observe.member_block import block_of
from vibsim.observe.oscillation import fit_recurrence
from vibsim.observe.thresholds import LEAST_STEPS
from vibsim.schemes import FIXED_STEP
from vibsim.simulation import simulate_record

SPRING = MODELS["spring"]

N = np.arange(201)


@pytest.mark.parametrize("growth", [0.5, 0.99, 1.0, 1.0 + 1e-9, 1.3, 4.0])
@pytest.mark.parametrize("angle", [0.01, 0.7, 2.0, 3.1])
def test_a_pair_of_roots_is_found_to_round_off(growth, angle):
    found = fit_recurrence(growth**N * np.cos(angle * N + 0.3))
    tolerance = 1e-13 / np.sin(angle) ** 2
    assert float(found.log_growth) == pytest.approx(np.log(growth), abs=tolerance)
    assert float(found.angle) == pytest.approx(angle, abs=tolerance)


def test_two_real_roots_give_the_larger_one():
    """Beyond the limit of centred differences the sign changes at every step."""
    found = fit_recurrence((-1.1) ** N + 0.5 * (-1 / 1.1) ** N)
    assert float(found.log_growth) == pytest.approx(np.log(1.1), rel=1e-6)
    assert float(found.angle) == np.pi


@pytest.mark.parametrize(
    "run",
    [
        np.zeros(50),
        np.cos(0.1 * N) ** 3,
        np.full(50, np.nan),
        np.arange(LEAST_STEPS, dtype=float),
    ],
    ids=["rest", "another motion", "failed", "too short"],
)
def test_what_is_no_such_recurrence_gives_nothing(run):
    found = fit_recurrence(run)
    assert np.isnan(found.log_growth)
    assert np.isnan(found.angle)


@pytest.mark.parametrize("kind", FIXED_STEP)
def test_a_short_run_gives_nothing_or_all_digits(kind):
    """Nothing while parasitic roots are in it; short runs are the beginning of a long one."""
    scheme, p = FIXED_STEP[kind], np.array([0.05, 0.1, 0.3, 1.0])
    stepper = scheme.stepper(scheme.defaults())
    initial, parameters = np.tile([1.0, 0.0], (len(p), 1)), np.ones((len(p), 1))
    run = integrate(SPRING, scheme, scheme.defaults(), parameters, initial, p, 200, 1)
    growth, angle = theory.dominant(stepper, p)
    log = np.log(growth) * p / (2 * np.pi)
    has_parasites = np.any(theory.roots(stepper, p).parasitic != 0)
    for steps in (8, 12, 16, 24, 32, 64, 200):
        found = fit_recurrence(run.position[:, : steps + 1])
        seen = np.isfinite(found.angle)
        assert has_parasites or np.all(seen)
        np.testing.assert_array_less((np.abs(found.angle - angle) * p)[seen], 1e-13)
        np.testing.assert_array_less((np.abs(found.log_growth - log) * p)[seen], 1e-13)


def test_where_peaks_take_its_place_the_record_says_so():
    """BDF2 with 16 steps: a parasitic root is still in them."""
    time = {"end": 8.0, "base_steps": 16}
    record = spring(["bdf2"], model={"kind": "spring", "w": 1.0}, time=time).record
    assert "peaks" in record.variable("measured_frequency").attrs["method"]


@pytest.mark.parametrize("p", [0.7236, 0.8])
def test_what_is_predicted_is_of_the_dominant_root(p):
    """And the same in the check: of AB3 it is a parasitic one there."""
    time = {"end": 1500 * p, "base_steps": 1500}
    model = {"kind": "spring", "w": 1.0}
    run = spring(["ab3"], {"stable": p < 0.7237}, model=model, time=time)
    for name in ("growth", "frequency", "phase_error"):
        measured, predicted = (run.record[f"{who}_{name}"].item() for who in ("measured", "theory"))
        assert predicted == pytest.approx(measured, rel=1e-9), name
    assert run.verdicts[0].status == "PASS"
    assert run.record["check_check_1_predicted_growth"].item() == run.record["theory_growth"].item()


@pytest.mark.parametrize("kind", thinned(FIXED_STEP, 3))
@pytest.mark.parametrize("w", [0.8, 2.0])
def test_measured_growth_and_frequency_are_those_of_theory(kind, w):
    """Without interpolation: to round-off over (w dt)^2, at w dt = 0.1 and 0.25."""
    scheme = FIXED_STEP[kind]
    stepper = scheme.stepper(scheme.defaults())
    record = spring(
        [kind], model={"kind": "spring", "w": w}, time={"end": 40.0, "base_dt": 0.125}
    ).record
    p = w * 0.125
    found = theory.roots(stepper, p)
    growth, frequency = (float(record[f"measured_{q}"][0, 0, 0]) for q in ("growth", "frequency"))
    assert growth == pytest.approx(float(np.exp(found.log_growth * 2 * np.pi / p)), rel=1e-10)
    assert frequency == pytest.approx(w * float(found.angle) / p, rel=1e-10)


@pytest.mark.parametrize(
    "scheme", ["central", "rk4", "ab3", "bdf2", "euler_cromer", "newmark", "gauss4"]
)
def test_a_constant_force_moves_the_place_of_rest_alone(scheme: str) -> None:
    """Steps, growth and frequency are those about 0; without this no step was that of the scheme."""
    found = []
    for rest in (0.0, 0.75):
        made = Experiment.from_dict(
            {
                "title": "t",
                "model": {
                    "kind": "system",
                    "coordinates": {"x": {"acceleration": f"-4*x + {4 * rest}"}},
                },
                "initial": {"x": rest + 0.5, "vx": 0.3},
                "time": {"end": 30.0, "base_steps": 240},
                "levels": [0, 1],
                "schemes": [scheme],
                "checks": [
                    {"equal": [scheme, "discrete"], "quantity": name} for name in ("x", "vx")
                ],
            }
        )
        levels = {level: simulate_record(made, level) for level in made.levels}
        block = block_of(made, levels)
        found.append(
            [f(block, 1)[0, 0] for f in (oscillation.growth_per_period, oscillation.frequency)]
        )
        judged = verdicts(made, analyse(made, [simulate(made, level) for level in made.levels]))
        assert [row.status for row in judged] == ["PASS", "PASS"]
    assert found[1] == pytest.approx(found[0], rel=1e-10)
