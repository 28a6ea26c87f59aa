"""Keys of the experiment file: time, levels, samples, schemes, sweeps."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray

from vibsim import Experiment, simulate

from .door import Content, build, outcome

BASE: Content = {
    "model": {"kind": "pendulum"},
    "initial": {"theta": 1.0},
    "time": {"end": 6.0},
    "levels": [3, 4],
    "schemes": ["central"],
}


def level(change: Content, number: int = 3) -> xarray.Dataset:
    return simulate(build({**BASE, **change}), number)


TIMES: dict[str, tuple[Content, int, float, int]] = {
    # what is written, level, end, number of steps
    "end": ({"end": 6.0}, 3, 6.0, 8),
    "formula": ({"end": "2*pi"}, 3, 2 * np.pi, 8),
    "base_steps": ({"end": 6.0, "base_steps": 5}, 3, 6.0, 40),
    "base_dt": ({"end": 6.0, "base_dt": 0.5}, 3, 6.0, 96),
    # small oscillations with g = L = 1 take 2 pi
    "periods": ({"periods": 3, "steps_per_period": 4}, 3, 6 * np.pi, 96),
}


@pytest.mark.parametrize("name", TIMES)
def test_a_level_has_base_steps_times_two_to_the_level(name: str) -> None:
    time, number, end, steps = TIMES[name]
    t = level({"time": time}, number)["t"]
    assert t.attrs["units"] == "s"
    np.testing.assert_allclose(t.values, np.linspace(0.0, end, steps + 1), rtol=1e-14, atol=1e-15)
    assert t.values[0] == 0.0


@pytest.mark.parametrize(
    ("written", "levels"),
    [({"from": 4, "to": 7}, (4, 5, 6, 7)), ([4, 5, 6], (4, 5, 6)), ([4, 6, 8], (4, 6, 8))],
)
def test_levels_are_a_range_or_a_list(written: Any, levels: tuple[int, ...]) -> None:
    assert build({**BASE, "levels": written}).levels == levels


def test_level_0_is_allowed_where_it_has_two_steps() -> None:
    change = {"levels": [0, 1], "time": {"end": 1.0, "base_steps": 2}}
    assert level(change, 0).sizes["t"] == 3


def test_levels_need_not_follow_each_other() -> None:
    """Norms rest on 4^2 between neighbours here, and the order is still 2."""
    found = outcome({**BASE, "levels": [5, 7, 9], "checks": [{"converges": "theta", "order": 2}]})
    assert found.reasons() == [("PASS", "asymptotic")]


SAMPLES: dict[str, tuple[Any, int]] = {
    "auto": ("auto", 64),
    "all": ("all", 64),
    "common": ("common", 8),
    "every": ({"every": 4}, 16),
}


@pytest.mark.parametrize("name", SAMPLES)
def test_samples_choose_what_is_stored_and_change_no_number(name: str) -> None:
    written, intervals = SAMPLES[name]
    change = {"levels": [3, 6], "samples": written}
    some, every = level(change, 6), level({**change, "samples": "all"}, 6)
    assert some.sizes["t"] == intervals + 1
    stride = 64 // intervals
    for state in ("theta", "omega"):
        np.testing.assert_array_equal(some[state].values, every[state].values[..., ::stride])
    for number in ("theta_max", "theta_min", "energy_deviation_max_abs"):
        np.testing.assert_array_equal(some[number].values, every[number].values)


def test_a_scheme_is_named_by_its_label_or_its_kind() -> None:
    data = level({"schemes": ["rk4", {"kind": "central", "label": "mine"}, {"kind": "heun"}]})
    assert [str(name) for name in data["scheme"].values] == ["rk4", "mine", "heun"]


# -- sweeps ----------------------------------------------------------------------------------------------------------

AXES: dict[str, tuple[Any, list[float]]] = {
    "list": ([0.1, 0.5, 0.2], [0.1, 0.5, 0.2]),
    "formulas": (["pi/6", "pi/3"], [np.pi / 6, np.pi / 3]),
    "linspace": ({"linspace": [0.1, 1.1, 5]}, [0.1, 0.35, 0.6, 0.85, 1.1]),
    "logspace": ({"logspace": [0.1, 1.6, 5]}, [0.1, 0.2, 0.4, 0.8, 1.6]),
    "range": ({"range": [0.1, 0.5, 0.1]}, [0.1, 0.2, 0.3, 0.4, 0.5]),
    "range that misses its end": ({"range": [0.1, 0.55, 0.1]}, [0.1, 0.2, 0.3, 0.4, 0.5]),
    "range that falls": ({"range": [0.5, 0.2, -0.1]}, [0.5, 0.4, 0.3, 0.2]),
}


@pytest.mark.parametrize("name", AXES)
def test_an_axis_has_its_values(name: str) -> None:
    written, values = AXES[name]
    data = level({"sweep": {"initial.theta": written}})
    assert data["initial_theta"].dims == ("case",)
    np.testing.assert_allclose(data["initial_theta"].values, values, rtol=1e-14)
    np.testing.assert_array_equal(data["case"].values, np.arange(len(values)))
    np.testing.assert_array_equal(data["theta"].isel(scheme=0, t=0), data["initial_theta"])


def test_several_keys_make_a_grid_whose_last_varies_fastest() -> None:
    data = level({"sweep": {"model.L": [1.0, 2.0], "initial.theta": [0.1, 0.2, 0.3]}})
    np.testing.assert_array_equal(data["model_L"], [1.0, 1.0, 1.0, 2.0, 2.0, 2.0])
    np.testing.assert_array_equal(data["initial_theta"], [0.1, 0.2, 0.3] * 2)


def test_keys_under_zip_move_together_as_one_axis() -> None:
    zipped = {"initial.theta": [0.1, 0.2], "initial.omega": {"linspace": [1.0, 2.0, 2]}}
    data = level({"sweep": {"zip": zipped, "model.L": [1.0, 2.0]}})
    np.testing.assert_array_equal(data["initial_theta"], [0.1, 0.1, 0.2, 0.2])
    np.testing.assert_array_equal(data["initial_omega"], [1.0, 1.0, 2.0, 2.0])
    np.testing.assert_array_equal(data["model_L"], [1.0, 2.0, 1.0, 2.0])


@pytest.mark.parametrize("method", ["sobol", "latin_hypercube", "random"])
def test_a_sample_lies_in_its_box_and_depends_on_its_seed_alone(method: str) -> None:
    def points(seed: int) -> np.ndarray[Any, Any]:
        over = {"initial.theta": [0.5, 1.5], "model.L": [1.0, 3.0]}
        sample = {"method": method, "n": 8, "seed": seed, "over": over}
        data = level({"sweep": {"sample": sample}})
        return np.array([data["initial_theta"].values, data["model_L"].values])

    one = points(1)
    assert one.shape == (2, 8)
    for row, (low, high) in zip(one, [(0.5, 1.5), (1.0, 3.0)], strict=True):
        assert np.all((row >= low) & (row <= high))
        assert len(set(row)) == 8
        if method != "random":
            # one point in each of eight strips
            strips = np.floor((row - low) / (high - low) * 8)
            assert sorted(strips) == list(range(8))
    np.testing.assert_array_equal(points(1), one)
    assert np.any(points(2) != one)


def test_options_of_schemes_can_be_swept() -> None:
    schemes = ["central", {"kind": "central", "label": "trap"}, "hht"]
    sweep = {"schemes.trap.start": ["centred", "first_order"], "schemes.hht.alpha": [-0.3, 0.0]}
    data = level({"schemes": schemes, "sweep": sweep})
    assert [str(word) for word in data["schemes_trap_start"].values] == [
        "centred",
        "centred",
        "first_order",
        "first_order",
    ]
    np.testing.assert_array_equal(data["schemes_hht_alpha"], [-0.3, 0.0, -0.3, 0.0])
    theta = data["theta"].isel(t=-1)
    np.testing.assert_array_equal(theta.sel(scheme="trap")[:2], theta.sel(scheme="central")[:2])
    assert np.all(theta.sel(scheme="trap")[2:].values != theta.sel(scheme="central")[2:].values)


def test_where_ends_differ_t_is_a_fraction() -> None:
    data = level({"sweep": {"time.end": [2.0, 4.0]}})
    np.testing.assert_allclose(data["t"].values, np.linspace(0.0, 1.0, 9), rtol=1e-15)
    assert data["end"].dims == ("case",)
    np.testing.assert_array_equal(data["end"].values, [2.0, 4.0])


def test_a_member_has_the_bits_that_it_has_alone() -> None:
    """In the sweep, in a sweep of another size, and by itself."""
    values = np.linspace(0.1, 3.0, 130).tolist()
    schemes = ["central", "rk4"]
    swept = level({"schemes": schemes, "sweep": {"initial.theta": values}})
    part = level({"schemes": schemes, "sweep": {"initial.theta": values[64:70]}})
    alone = level({"schemes": schemes, "initial": {"theta": values[66]}})
    for name in ("theta", "omega", "energy", "period", "theta_max", "energy_deviation_max_abs"):
        one = alone[name].isel(case=0).values
        np.testing.assert_array_equal(swept[name].isel(case=66).values, one, err_msg=name)
        np.testing.assert_array_equal(part[name].isel(case=2).values, one, err_msg=name)


def test_a_file_is_read_as_a_mapping_is(tmp_path: Path) -> None:
    path = tmp_path / "small.yaml"
    path.write_text(
        "# yaml-language-server: $schema=../../workflow/schemas/experiment.schema.json\n"
        "title: T\nsource: S\nmodel: {kind: pendulum}\ninitial: {theta: 1.}\n"
        "time: {end: 6e0}\nlevels: {from: 3, to: 4}\nschemes: [central]\n"
    )
    one, other = simulate(Experiment.from_yaml(path), 4), level({}, 4)
    np.testing.assert_array_equal(one["theta"], other["theta"])
