"""Energies, outputs and the energy budget against what is known of them exactly, through the whole analysis."""

import numpy as np
import pytest

from vibsim import Experiment, analyse, simulate, verdicts

pytestmark = pytest.mark.usefixtures("without_series")

DRIVEN = {
    "title": "t",
    "model": {"kind": "circuit", "L": 0.5, "R": 0.3, "C": 0.8, "voltage": "2*sin(1.7*t)"},
    "initial": {"i": 1.0, "di_dt": -0.5},
    "time": {"end": 6.0, "base_steps": 3},
    "levels": [6, 7, 8, 9],
    "schemes": ["rk4", "crank_nicolson"],
}
QUANTITIES = ("capacitor_voltage", "energy", "energy_deviation", "kinetic_energy", "energy_budget")


def run(**changes):
    experiment = Experiment.from_dict({**DRIVEN, **changes})
    levels = {level: simulate(experiment, level) for level in experiment.levels}
    return experiment, levels, analyse(experiment, list(levels.values()))


@pytest.mark.usefixtures("with_series")
def test_what_follows_from_the_exact_states_is_known_as_well():
    checks = [{"converges": q, "order": "scheme"} for q in QUANTITIES]
    checks += [
        {"value": "error_linf", "quantity": q, "at": {"scheme": "rk4", "level": 9}, "below": 1e-6}
        for q in QUANTITIES
    ]
    experiment, levels, convergence = run(checks=checks)
    for verdict in verdicts(experiment, convergence):
        assert verdict.status == "PASS", verdict.text
    exact = convergence["capacitor_voltage_exact"].values[0]
    t = convergence["t"].values
    every = (len(levels[6]["t"]) - 1) // (len(t) - 1)
    i, rate = (levels[6][f"{name}_exact"].values[0][::every] for name in ("i", "di_dt"))
    np.testing.assert_allclose(exact, 2 * np.sin(1.7 * t) - 0.5 * rate - 0.3 * i, atol=1e-14)
    assert np.all(convergence["energy_budget_exact"].values == 0.0)


@pytest.mark.usefixtures("with_series")
def test_the_work_of_forces_is_that_of_a_fine_quadrature():
    """Simpson's rule over the exact motion at many times."""
    _, levels, _ = run()
    n = 6 * 2**10
    t = np.linspace(0.0, 6.0, n + 1)
    experiment = Experiment.from_dict(DRIVEN)
    model = experiment.model.definition
    i = model.exact(t, experiment.initial, experiment.model.parameters)["i"]
    weights = np.where(np.arange(n + 1) % 2 == 1, 4.0, 2.0) * (6.0 / n / 3.0)
    weights[[0, -1]] /= 2.0
    taken, given = weights @ (0.3 * i * i), weights @ (2.0 * np.sin(1.7 * t) * i)
    finest = levels[9].sel(scheme="rk4")
    assert float(finest["dissipated_energy"][0, -1]) == pytest.approx(taken, abs=3e-8)
    assert float(finest["work_done"][0, -1]) == pytest.approx(given, abs=3e-8)
    assert (finest["dissipated_energy"][0, 0], finest["work_done"][0, 0]) == (0.0, 0.0)


@pytest.mark.usefixtures("with_series")
def test_a_wrong_power_does_not_pass():
    """Half of the damping's power is missing from the budget: it converges, but not to 0."""
    experiment, levels, _ = run(checks=[{"converges": "energy_budget", "order": "scheme"}])
    wrong = []
    for data in levels.values():
        data = data.copy(deep=True)
        data["energy_budget"] = data["energy_budget"] - 0.5 * data["dissipated_energy"]
        wrong.append(data)
    (verdict,) = verdicts(experiment, analyse(experiment, wrong))
    assert (verdict.status, verdict.reason) == ("FAIL", "wrong_limit")


def test_extrema_of_outputs_are_those_of_their_samples():
    at = {"scheme": "rk4", "level": 9}
    experiment, levels, convergence = run(
        checks=[
            {"id": which, "value": which, "quantity": "capacitor_voltage", "at": at, "below": 100}
            for which in ("min", "max")
        ]
    )
    series = levels[9].sel(scheme="rk4")["capacitor_voltage"].values
    found = {verdict.id: verdict.results[0].value for verdict in verdicts(experiment, convergence)}
    assert found == {"min": series.min(), "max": series.max()}


def test_terms_that_vanish_are_no_part_of_the_equation():
    model = {"kind": "pendulum", "drag": 0.0}
    free = Experiment.from_dict({**DRIVEN, "model": model, "initial": {"theta": 1.0}})
    assert free.model.definition.conservative
    assert "energy_budget" not in free.quantities
    dragged = {**DRIVEN, "model": {**model, "drag": 0.1}, "initial": {"theta": 1.0}}
    swept = {**DRIVEN, "model": model, "sweep": {"model.drag": [0.0, 0.2]}, "initial": {}}
    for content in (dragged, swept):
        experiment = Experiment.from_dict(content)
        assert not experiment.model.definition.conservative
        assert {"energy_budget", "drag_force"} <= set(experiment.quantities)
    alone = Experiment.from_dict(swept).alone(0)
    assert alone.model.parameters["drag"] == 0.0
    assert not alone.model.definition.conservative


@pytest.mark.usefixtures("with_series")
def test_the_budget_is_known_no_better_than_the_energy():
    """Its own size is an error, relative to which nothing is round-off."""
    _, levels, convergence = run(checks=[{"converges": "energy_budget", "order": "scheme"}])
    energy = float(levels[9]["energy"].max())
    floor = convergence["energy_budget_floor"].values
    assert np.all(floor >= 1e-17 * energy)


@pytest.mark.slow
@pytest.mark.parametrize("norm", ["l2", "linf"])
def test_a_single_level_without_an_exact_solution_has_its_numbers_and_no_order(norm):
    # no row at all whose directions could be compared
    experiment, _, convergence = run(
        model={"kind": "elastic_pendulum", "beta": 0.9, "Theta": 40, "gamma": 0.05},
        initial={},
        time={"end": 25},
        levels=[9],
        schemes=["rk4"],
        checks=[{"value": "period", "above": 0}, {"converges": "x", "norm": norm}],
    )
    value, order = verdicts(experiment, convergence)
    assert (value.status, value.reason) == ("PASS", "match")
    assert (order.status, order.reason) == ("INCONCLUSIVE", "too_few_levels")
