"""Theory beside measurement, and what is made with the centred difference of the position as velocity."""

from __future__ import annotations

import numpy as np
import pytest
from level_records import experiment, level_records
from spring_runs import PERIODS, STEPS, judged, spring

from vibsim.analysis import analyse_records
from vibsim.core.record import Record, Variable
from vibsim.experiment.storage import FEWEST_EXTREMA
from vibsim.schemes import FIXED_STEP
from vibsim.simulation.level import simulate_record

SCHEMES = ["central", "rk2", "rk4", "crank_nicolson", "euler_cromer", "backward_euler"]


def test_growth_frequency_and_phase_error_are_the_predicted_ones() -> None:
    run = spring(list(FIXED_STEP), {"stable": True, "schemes": ["rk4"]}, levels=(1,))
    record = run.record
    p = float(record["omega_dt"][0, 0])
    growth, frequency, phase = (
        (record[f"measured_{name}"][:, 0, 0], record[f"theory_{name}"][:, 0, 0])
        for name in ("growth", "frequency", "phase_error")
    )
    # the height of a parabola is off by p^4/24 at most, the time of a zero of the velocity by dt p^2; where the motion
    # decays a parabola is off by the decay over a step, squared
    height, time = 2 * p**4 / 24 / (PERIODS - 2), p**3 / (PERIODS - 1)
    for i, name in enumerate(FIXED_STEP):
        decay = abs(np.log(growth[1][i])) * p * p
        logs = np.log(growth[0][i]), np.log(growth[1][i])
        assert logs[0] == pytest.approx(logs[1], abs=height + decay), name
        assert frequency[0][i] / frequency[1][i] == pytest.approx(1.0, abs=time), name
        assert phase[0][i] == pytest.approx(phase[1][i], abs=time), name


def test_a_run_without_a_period_has_no_measured_growth() -> None:
    """Beyond the limit the pendulum turns over more than once in a step, and the times of its turns fall back."""
    of = experiment(
        model={"kind": "pendulum"},
        initial={"theta": 1.0},
        time={"end": 20.0},
        levels=[2, 9],
        schemes=["central"],
        checks=[{"converges": "theta", "order": 2}],
    )
    levels = {level: simulate_record(of, level) for level in of.levels}
    assert float(levels[2]["period"][0, 0]) < 0
    record = analyse_records(of, levels)
    unstable, stable = record["measured_growth"][0, 0]
    assert np.isnan(unstable)
    assert stable == pytest.approx(1.0, abs=1e-3)


def test_values_are_those_of_the_record() -> None:
    names = {
        "growth_per_period": "measured_growth",
        "predicted_growth_per_period": "theory_growth",
        "frequency": "measured_frequency",
        "predicted_frequency": "theory_frequency",
        "phase_error_per_period": "measured_phase_error",
        "predicted_phase_error": "theory_phase_error",
        "force_evaluations": "force_evaluations_total",
        "accepted_steps": "work_steps",
    }
    run = spring(SCHEMES, *[{"value": name, "above": -1e300} for name in names], levels=(0, 1))
    for i, name in enumerate(names.values()):
        assert np.array_equal(
            run.record[f"check_check_{i + 1}_value"], run.record[name][..., -1]
        ), name
    w = 2 * np.pi
    error = spring(["central"], {"value": "error_of_frequency", "above": 0.0}).verdicts[0]
    frequency = float(spring(["central"]).record["measured_frequency"][0, 0, 0])
    assert error.results[0].value == pytest.approx(frequency / w - 1, rel=1e-9)


def test_the_phase_error_of_the_centred_scheme_grows_linearly() -> None:
    # B (19): w~ = 2/dt asin(w dt/2), so that peak m comes early by m (P - P~)
    (verdict,) = spring(["central"], {"value": "phase_error_slope", "above": 0.0}).verdicts
    p = 2 * np.pi * PERIODS / STEPS
    ratio = 2 * np.arcsin(p / 2) / p
    value = verdict.results[0].value
    assert value is not None
    # a parabola misses the time of a peak by less than p^3 steps, which changes its sign from peak to peak
    assert value == pytest.approx(1 - 1 / ratio, abs=p**4 / (2 * np.pi))


def test_running_maxima_at_a_time_and_at_the_end() -> None:
    half = {"t": PERIODS / 2}
    checks = [
        {"value": "running_max", "quantity": "energy_deviation", "at": half, "above": 0.0},
        {"value": "running_max", "quantity": "energy_deviation", "above": 0.0},
        {"value": "relative_running_max", "quantity": "energy_deviation_d2t", "above": 0.0},
        {"value": "max_abs", "quantity": "energy_deviation_d2t", "above": 0.0},
        {"value": "relative_energy_error_d2t", "above": 0.0},
    ]
    run = spring(["rk4", "central"], *checks)
    level = run.levels[0]
    found = np.array([run.record[f"check_check_{i}_value"][:, 0] for i in range(1, 6)])
    deviation = np.abs(level["energy_deviation"][0, 0])
    assert found[0, 0] == np.max(deviation[: STEPS // 2 + 1])
    assert found[1, 0] == np.max(deviation)
    initial = float(level["energy_initial"][0, 0])
    centred = np.nanmax(np.abs(level["energy_deviation_d2t"][0, 0]))
    assert found[2, 0] == pytest.approx(centred / initial, rel=1e-12)
    assert found[3, 0] == pytest.approx(centred, rel=1e-12)
    assert found[4, 0] == found[2, 0]
    # of the centred scheme that is its own velocity
    own = float(level["energy_deviation_max_abs_interior"][1, 0])
    assert np.isnan(found[2, 1])
    assert found[4, 1] == own / float(level["energy_initial"][1, 0])


CENTRED = ("v_d2t", "energy_d2t", "energy_deviation_d2t")


def test_the_centred_velocity_is_compared_like_any_other_quantity() -> None:
    checks = [{"converges": name} for name in CENTRED]
    run = spring(["central", "rk4"], *checks, levels=(0, 1, 2, 3))
    for verdict, name in zip(run.verdicts, CENTRED, strict=True):
        assert [result.scheme for result in verdict.results] == ["rk4"]
        assert (verdict.status, verdict.reason) == ("PASS", "asymptotic")
        # the position has order 4: what remains is the error of [D_2t u]
        assert verdict.results[0].order == pytest.approx(2.0, abs=0.05), name
        difference = run.record[f"{name}_difference"]
        assert np.all(np.isnan(difference[..., [0, -1]]))
        assert np.all(np.isfinite(difference[1, ..., 1:-1]))
        assert np.all(np.isnan(difference[0]))
        errors = run.record[f"{name}_error_norm"]
        assert np.all(np.isfinite(errors[1]))
        assert np.all(np.isnan(errors[0]))
    # the levels themselves are left as they were
    assert np.isnan(run.levels[3]["v_d2t"][1, 0, 0])


def test_the_norms_of_a_centred_quantity_are_those_of_its_inner_points() -> None:
    run = spring(["rk4"], {"converges": "v_d2t"}, levels=(0, 1, 2))
    level = run.levels[0]
    error = (level["v_exact"] - level["v_d2t"][0])[0, 1:-1]
    spacing = PERIODS / STEPS
    norms = run.record.words("norm")
    expected = {
        "l1": spacing * np.sum(np.abs(error)),
        "l2": np.sqrt(spacing * np.sum(error**2)),
        "linf": np.max(np.abs(error)),
        "linf_interior": np.max(np.abs(error)),
    }
    for name, value in expected.items():
        found = run.record["v_d2t_error_norm"][0, 0, 0, norms.index(name)]
        assert found == pytest.approx(value, rel=1e-12)


def test_extrema_and_running_maxima_of_all_levels_stand_side_by_side() -> None:
    run = spring(["rk4"], levels=(0, 1, 2))
    record = run.record
    assert record.variable("peak_time").dims == ("scheme", "case", "level", "extremum")
    count = record["peak_count"][0, 0]
    assert np.array_equal(np.sum(np.isfinite(record["peak_time"][0, 0]), axis=-1), count)
    running = record["energy_deviation_running_max"]
    assert running.shape[2:] == (3, len(record["t"]))
    assert np.all(np.diff(running, axis=-1) >= 0)
    fine = run.levels[2]["energy_deviation_running_max"][0, 0, ::4]
    assert np.array_equal(running[0, 0, 2], fine)


def test_a_nonlinear_model_has_measurements_and_no_theory() -> None:
    exp = experiment(model={"kind": "pendulum"})
    record = analyse_records(exp, level_records(exp))
    for name in ("growth", "frequency", "phase_error"):
        assert np.all(np.isnan(record[f"theory_{name}"]))
        assert np.all(np.isfinite(record[f"measured_{name}"]))
    assert np.array_equal(record["stability_limit"], [[2.0]])


def test_theory_and_drift_of_a_member_do_not_depend_on_its_neighbours() -> None:
    sweep = {"model.w": [1.0, 2.0, 4.0, 6.0]}
    time = {"end": 20.0, "base_steps": 200}
    whole = spring(["rk4", "central"], sweep=sweep, time=time, levels=(0, 1))
    for case, w in enumerate(sweep["model.w"]):
        alone = spring(
            ["rk4", "central"], model={"kind": "spring", "w": w}, time=time, levels=(0, 1)
        )
        for name in ("theory_growth", "theory_frequency", "measured_growth", "energy_drift_rate"):
            together, own = whole.record[name][:, case], alone.record[name][:, 0]
            assert np.array_equal(together, own, equal_nan=True), name


def test_numbers_of_peaks_rest_on_those_that_every_member_keeps() -> None:
    names = ("growth_per_period", "amplitude_error", "phase_error_slope")
    time = {"end": 4.0 * FEWEST_EXTREMA, "base_steps": 160 * FEWEST_EXTREMA}
    run = spring(["rk2"], *[{"value": name, "above": -9.0} for name in names], time=time)
    level = run.levels[0]
    assert level["peak"].shape[-1] > FEWEST_EXTREMA

    def cut(variable: Variable, size: int) -> Variable:
        kept = variable.values[..., :size] if "extremum" in variable.dims else variable.values
        return Variable(variable.dims, kept, variable.attrs)

    few = {name: cut(v, FEWEST_EXTREMA) for name, v in level.variables.items()}
    found = judged(run.experiment, {0: Record(level.coords, few, level.attrs)})
    values = [verdict.results[0].value for verdict in run.verdicts]
    assert None not in values
    assert [verdict.results[0].value for verdict in found.verdicts] == values
