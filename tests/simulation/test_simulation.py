"""A level as a record: names, shapes, what every member gets, and what does not apply."""

import itertools

import numpy as np
import pytest
from thinned import thinned

from vibsim import Experiment, simulate
from vibsim.experiment.storage import FEWEST_EXTREMA, MOST_EXTREMA, extrema_kept
from vibsim.simulation import simulate_record

BASE = {
    "title": "t",
    "model": {"kind": "pendulum", "g": 2.0, "L": 0.5, "m": 3.0},
    "initial": {"theta": 1.0, "omega": 0.25},
    "time": {"end": 10.0},
    "levels": [6, 7, 8],
    "schemes": ["central", {"kind": "central", "label": "kicked", "end_velocity": "kick"}],
}


def experiment(**changes):
    return Experiment.from_dict({**BASE, **changes})


def test_a_level_has_its_public_names_and_shapes():
    data = simulate(experiment(sweep={"initial.theta": [0.5, 1.0, 3.0]}), 7)
    assert data.sizes["scheme"] == 2
    assert data.sizes["case"] == 3
    assert list(data.scheme.values) == ["central", "kicked"]
    assert list(data.initial_theta.values) == [0.5, 1.0, 3.0]
    for name in (
        "theta",
        "omega",
        "energy",
        "kinetic_energy",
        "potential_energy",
        "energy_deviation",
    ):
        assert data[name].dims == ("scheme", "case", "t")
    assert data.theta_exact.dims == ("case", "t")
    for variable in data.variables.values():
        assert variable.attrs["long_name"]
        assert variable.attrs["units"]
    assert (data.status == 0).all()
    assert (data.last_step == 128).all()
    assert data.t[-1] == 10.0


def test_energies_are_the_models_own():
    data = simulate(experiment(), 8)
    kinetic = 0.5 * 3.0 * (0.5 * data.omega) ** 2
    potential = 3.0 * 2.0 * 0.5 * (1 - np.cos(data.theta))
    np.testing.assert_allclose(data.kinetic_energy, kinetic, atol=1e-14)
    np.testing.assert_allclose(data.potential_energy, potential, atol=1e-14)
    np.testing.assert_array_equal(data.energy, data.kinetic_energy + data.potential_energy)
    np.testing.assert_array_equal(data.energy_deviation, data.energy - data.energy.isel(t=0))


def test_what_is_gathered_agrees_with_all_steps_stored():
    data = simulate(experiment(samples="all"), 8).isel(case=0)
    np.testing.assert_array_equal(data.theta_max, data.theta.max("t"))
    np.testing.assert_array_equal(data.theta_min, data.theta.min("t"))
    np.testing.assert_array_equal(data.omega_max, data.omega.max("t"))
    np.testing.assert_array_equal(
        data.energy_deviation_max_abs, abs(data.energy_deviation).max("t")
    )
    interior = abs(data.energy_deviation.isel(t=slice(None, -1))).max("t")
    np.testing.assert_array_equal(data.energy_deviation_max_abs_interior, interior)


def test_samples_do_not_change_the_numbers():
    every_step = simulate(experiment(samples="all"), 8)
    common = simulate(experiment(samples="common"), 8)
    assert common.sizes["t"] == 65
    np.testing.assert_array_equal(common.theta, every_step.theta.isel(t=slice(None, None, 4)))
    np.testing.assert_array_equal(common.t, every_step.t.isel(t=slice(None, None, 4)))
    np.testing.assert_array_equal(common.period, every_step.period)


def test_members_of_a_shard_have_the_bits_of_the_whole():
    swept = experiment(sweep={"initial.theta": {"linspace": [0.1, 3.1, 7]}, "model.g": [1.0, 4.0]})
    whole = simulate_record(swept, 7)
    for start, stop in ((0, 1), (1, 5), (5, 14)):
        part = simulate_record(swept, 7, start, stop)
        for name, variable in part.variables.items():
            axis = variable.dims.index("case")
            expected = np.take(whole[name], np.arange(start, stop), axis=axis)
            np.testing.assert_array_equal(variable.values, expected, err_msg=name)


def test_grid_of_two_keys_runs_with_the_last_key_fastest():
    data = simulate(experiment(sweep={"initial.theta": [0.5, 1.0], "model.g": [1.0, 2.0, 3.0]}), 6)
    assert list(data.initial_theta.values) == [0.5, 0.5, 0.5, 1.0, 1.0, 1.0]
    assert list(data.model_g.values) == [1.0, 2.0, 3.0, 1.0, 2.0, 3.0]
    alone = simulate(
        experiment(initial={"theta": 1.0, "omega": 0.25}, model={**BASE["model"], "g": 2.0}), 6
    )
    np.testing.assert_array_equal(data.theta.isel(case=4), alone.theta.isel(case=0))


def test_where_the_end_differs_t_is_a_fraction():
    data = simulate(experiment(sweep={"time.end": [5.0, 10.0]}), 6)
    assert data.t[-1] == 1.0
    assert list(data.end.values) == [5.0, 10.0]
    alone = simulate(experiment(time={"end": 5.0}), 6)
    np.testing.assert_array_equal(data.theta.isel(case=0), alone.theta.isel(case=0))
    np.testing.assert_array_equal(data.theta_exact.isel(case=0), alone.theta_exact.isel(case=0))


def test_an_end_in_natural_periods_is_each_members_own():
    swept = experiment(
        time={"periods": 3, "steps_per_period": 8}, sweep={"model.g": [2.0, 8.0]}, levels=[1, 2, 3]
    )
    data = simulate(swept, 2)
    np.testing.assert_allclose(data.end, 3 * 2 * np.pi / np.sqrt(np.array([2.0, 8.0]) / 0.5))
    assert data.attrs["steps"] == 3 * 8 * 4
    shard = simulate_record(swept, 2, 1, 2).to_xarray()
    np.testing.assert_array_equal(shard.t, data.t)
    np.testing.assert_array_equal(shard.theta[:, 0], data.theta[:, 1])


def test_a_member_that_overflows_is_reported_and_the_others_stand():
    unstable = experiment(
        model={"kind": "linear_pendulum"},
        time={"end": 400.0},
        levels=[7, 8, 9],
        sweep={"model.g": [1.0, 64.0]},
    )
    data = simulate(unstable, 8)
    assert data.status.values.tolist() == [[0, 1], [0, 1]]
    step = int(data.last_step.values[0, 1])
    assert 0 < step < 256
    assert data.failure_time.values[0, 1] == pytest.approx((step + 1) * 400 / 256)
    assert np.isnan(data.failure_time.values[0, 0])
    assert np.isfinite(data.theta.values[:, 0]).all()
    assert data.omega_dt.values[1] == pytest.approx(12.5)


def test_work_without_bound_is_reported_in_silence(monkeypatch):
    """The power of drag overflows while the state does not yet; a warning is an error here."""
    # a reference solution would take two seconds, and the work is that of the scheme
    monkeypatch.setattr("vibsim.experiment.storage.MOST_REFERENCES", 0)
    unstable = experiment(
        model={"kind": "oscillator", "damping": {"quadratic": 100.0}, "force": "cos(t)"},
        initial={"u": 1.0, "v": 1.0},
        time={"end": 10.0, "base_steps": 3},
        levels=[2, 3],
        schemes=["forward_euler"],
        checks=[{"converges": "u", "order": "scheme"}],
    )
    data = simulate(unstable, 2)
    assert data.status.values.tolist() == [[1]]
    assert np.isfinite(data.energy_budget.values[0, 0, 0])


def test_a_level_that_the_experiment_does_not_have_is_refused():
    with pytest.raises(ValueError, match=r"level 5 is none of \[6, 7, 8\]"):
        simulate(experiment(), 5)


def lean_experiment(**changes):
    """4200 members of 65 samples are just too many for every series to be stored."""
    sweep = {"initial.theta": {"linspace": [-3.0, 9.0, 4200]}}
    return experiment(**{"sweep": sweep, "schemes": ["central"], **changes})


def of_dim(record, dim):
    return {name for name, variable in record.variables.items() if dim in variable.dims}


def test_a_large_sweep_stores_states_and_the_energys_deviation_only():
    record = simulate_record(lean_experiment(), 6)
    assert record.attrs["storage"] == "lean"
    assert of_dim(record, "t") == {"theta", "omega", "energy_deviation"}
    assert not of_dim(record, "extremum")
    assert "theta_exact" not in record
    assert "energy_deviation_d2t_max_abs" not in record
    assert simulate_record(experiment(), 6).attrs["storage"] == "series"


def test_a_large_sweep_stores_what_its_checks_ask_for():
    checks = [{"converges": "potential_energy", "order": 2}]
    assert "potential_energy" in simulate_record(lean_experiment(checks=checks), 6)


def test_the_energy_of_samples_is_that_of_every_step():
    record = simulate_record(lean_experiment(samples="common"), 6)
    largest = np.max(np.abs(record["energy_deviation"]), axis=-1)
    np.testing.assert_array_equal(largest, record["energy_deviation_max_abs"])


def test_a_large_sweep_has_the_largest_deviation_by_the_centred_difference():
    record = simulate_record(lean_experiment(schemes=["rk4"]), 6)
    assert of_dim(record, "t") == {"theta", "omega", "energy_deviation"}
    assert np.isfinite(record["energy_deviation_d2t_max_abs"]).all()


@pytest.mark.parametrize(
    ("check", "name"),
    [
        ({"converges": "energy_deviation_d2t", "order": 2}, "energy_deviation_d2t"),
        ({"converges": "omega_d2t", "order": 2}, "omega_d2t"),
        (
            {"value": "running_max", "quantity": "energy_deviation", "below": 1},
            "energy_deviation_running_max",
        ),
        (
            {"conserves": "energy_d2t", "drift": "bounded"},
            "energy_deviation_d2t_running_max",
        ),
    ],
)
def test_a_large_sweep_stores_of_the_centred_difference_what_its_checks_ask_for(check, name):
    record = simulate_record(lean_experiment(schemes=["rk4"], checks=[check]), 6)
    assert record.attrs["storage"] == "lean"
    assert name in of_dim(record, "t")
    assert record[name].shape == record["theta"].shape


def both(**changes):
    """A scheme that has a velocity of its own, and one whose velocity is the centred difference."""
    return experiment(schemes=["central", "rk4"], **changes)


CENTRED = ("omega_d2t", "energy_d2t", "energy_deviation_d2t", "energy_deviation_d2t_running_max")


def test_both_energies_are_stored_and_named():
    data = simulate(both(), 7)
    for name in (*CENTRED, "energy_deviation_running_max"):
        assert data[name].dims == ("scheme", "case", "t")
        assert data[name].attrs["units"] == {"omega_d2t": "rad s-1"}.get(name, "J")
    for name in CENTRED:
        assert data[name].sel(scheme="central").isnull().all()
    rk4 = data.sel(scheme="rk4").isel(case=0)
    inner = slice(1, -1)
    for name in ("omega_d2t", "energy_d2t", "energy_deviation_d2t"):
        assert rk4[name][inner].notnull().all()
        assert rk4[name][[0, -1]].isnull().all()
    kinetic = 0.5 * 3.0 * (0.5 * rk4.omega_d2t) ** 2
    np.testing.assert_allclose(rk4.energy_d2t, kinetic + rk4.potential_energy, rtol=1e-15)
    np.testing.assert_array_equal(rk4.energy_deviation_d2t, rk4.energy_d2t - rk4.energy_initial)
    largest = abs(rk4.energy_deviation_d2t).max()
    assert rk4.energy_deviation_d2t_max_abs == largest
    assert rk4.energy_deviation_d2t_running_max[-1] == largest
    assert rk4.energy_deviation_running_max[-1] == rk4.energy_deviation_max_abs
    assert np.isnan(data.energy_deviation_d2t_max_abs.sel(scheme="central")).all()


def test_without_a_velocity_of_its_own_nothing_is_stored_of_the_centred_difference():
    record = simulate_record(experiment(), 7)
    assert not [name for name in CENTRED if name in record]
    assert "energy_deviation_running_max" in record


@pytest.mark.parametrize("samples", ["all", "common", {"every": 32}])
def test_extrema_do_not_depend_on_what_is_stored(samples):
    data = simulate(both(samples=samples), 8).isel(case=0)
    every_step = simulate(both(samples="all"), 8).isel(case=0)
    for kind in ("peak", "trough"):
        for name in ("_time", "", "_time_grid", "_grid"):
            assert data[kind + name].dims == ("scheme", "extremum")
            np.testing.assert_array_equal(data[kind + name], every_step[kind + name])
        assert (data[f"{kind}_count"] == np.isfinite(data[kind]).sum("extremum")).all()
    assert data.sizes["extremum"] == MOST_EXTREMA
    largest = every_step.theta[:, 1:-1].max("t")
    np.testing.assert_array_equal(data.peak_grid.max("extremum"), largest)


def test_among_many_members_fewer_extrema_are_kept_and_all_are_counted():
    assert extrema_kept(1) == MOST_EXTREMA
    assert extrema_kept(10**6) == FEWEST_EXTREMA
    swept = experiment(
        sweep={"model.g": {"linspace": [1, 2, 2000]}},
        time={"end": 100.0},
        schemes=["central"],
        levels=[7, 8],
        samples="all",
    )
    record = simulate_record(swept, 8)
    assert record["peak"].shape == (1, 2000, 64)
    assert record["peak_count"].max() < 64


@pytest.mark.parametrize("make", [lean_experiment, experiment, both])
@pytest.mark.parametrize("shards", thinned([1, 2, 7], 2))
@pytest.mark.parametrize("threads", [1, 2])
def test_shards_and_threads_change_no_bit(make, shards, threads):
    whole = make() if make is lean_experiment else make(sweep={"model.L": {"range": [0.5, 2, 0.1]}})
    together = simulate_record(whole, 7)
    edges = np.linspace(0, whole.members, shards + 1).astype(int)
    for start, stop in itertools.pairwise(edges):
        part = simulate_record(whole, 7, int(start), int(stop), threads=threads)
        for name, variable in {**together.variables, **together.coords}.items():
            axis = variable.dims.index("case") if "case" in variable.dims else None
            wanted = variable.values
            if axis is not None:
                wanted = np.take(wanted, np.arange(start, stop), axis=axis)
            assert part[name].tobytes() == np.ascontiguousarray(wanted).tobytes(), name


def test_a_member_alone_has_the_bits_it_has_in_the_sweep():
    whole = experiment(sweep={"initial.theta": [0.5, 1.0, 3.0], "model.L": [0.5, 2.0]})
    together = simulate_record(whole, 8)
    for case in range(whole.members):
        alone = simulate_record(whole.alone(case), 8)
        for name, variable in alone.variables.items():
            if "case" not in variable.dims:
                continue
            axis = variable.dims.index("case")
            wanted = np.take(together[name], [case], axis=axis)
            assert variable.values.tobytes() == np.ascontiguousarray(wanted).tobytes(), name


def test_a_swept_option_of_a_scheme_is_the_options_of_the_members():
    starts = ["first_order", "centred", "first_order"]
    swept = experiment(
        schemes=["central", {"kind": "central", "label": "other"}],
        sweep={"zip": {"schemes.other.start": starts, "initial.theta": [1.0, 1.0, 2.0]}},
    )
    together = simulate_record(swept, 6)
    assert together.words("schemes_other_start") == starts
    for case, start in enumerate(starts):
        theta = [1.0, 1.0, 2.0][case]
        alone = simulate_record(
            experiment(
                initial={"theta": theta, "omega": 0.25},
                schemes=["central", {"kind": "central", "label": "other", "start": start}],
            ),
            6,
        )
        for name in ("theta", "omega", "energy_deviation", "period", "status"):
            assert (
                alone[name].tobytes() == np.ascontiguousarray(together[name][:, [case]]).tobytes()
            )
