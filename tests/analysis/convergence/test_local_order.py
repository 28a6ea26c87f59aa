"""The order as a function of time: manufactured differences whose order is known at every time, and real runs."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from spring_runs import spring

from vibsim.analysis import analyse_records
from vibsim.comparison.local_order import box_sum, local_order, window_points
from vibsim.experiment import Experiment
from vibsim.simulation import simulate_record

END, POINTS = 40.0, 801
T = np.linspace(0.0, END, POINTS)
WINDOW = window_points(np.array([np.pi]), np.array([END / (POINTS - 1)]), POINTS)
"""Half a period of sin(t)."""


def order_of(error: Any, floor: float = 0.0, end_included: bool = False, **more: Any) -> Any:
    """Return the local order of solutions with the given error(h) at three levels, each of shape (t,)."""
    u = [error(2.0**-level) for level in range(3)]
    first, second = ((a - b)[None, None] for a, b in pairwise(u))
    floors = np.full((1, 1), floor), np.full((1, 1), floor)
    found = local_order(first, second, (0, 1, 2), floors, WINDOW, end_included, **more)
    return [part[0, 0] for part in found]


@pytest.mark.parametrize("p", [1.0, 2.0, 2.5, 4.0])
def test_one_power_has_its_order_at_every_time_through_all_sign_changes(p: float) -> None:
    order, low, high = order_of(lambda h: h**p * T * np.sin(T))
    assert np.isfinite(order).all()
    assert np.abs(order - p).max() < 1e-12
    # the interval is that of the shapes: one shape, no width
    assert np.abs(low - p).max() < 1e-6
    assert np.abs(high - p).max() < 1e-6


def test_a_size_that_changes_by_decades_does_not_matter() -> None:
    for growth in (-1.0, 1.0):
        order, *_ = order_of(lambda h, r=growth: h**2 * np.exp(r * T) * np.sin(T))
        assert np.abs(order - 2.0).max() < 1e-9


def test_one_order_before_a_time_and_another_after_it() -> None:
    order, low, high = order_of(lambda h: np.where(T < 20.0, h, h**2) * np.sin(T))
    away = T - 20.0
    before, after = away < -np.pi / 2 - 0.1, away > np.pi / 2 + 0.1
    assert np.abs(order[before] - 1.0).max() < 1e-12
    assert np.abs(order[after] - 2.0).max() < 1e-12
    between = ~(before | after)
    assert np.all((order[between] > 1.0 - 1e-9) & (order[between] < 2.0 + 1e-9))
    assert np.all(low <= order)
    assert np.all(order <= high)


def test_two_powers_of_different_shapes_widen_the_interval_where_they_are_of_one_size() -> None:
    # order 1 in the middle, order 2 elsewhere
    hump = np.exp(-0.5 * ((T - 20.0) / 2.0) ** 2)
    order, low, high = order_of(lambda h: 3.0 * h * hump * np.cos(T) + h**2 * np.sin(T))
    middle, far = np.abs(T - 20.0) < 0.5, np.abs(T - 20.0) > 10.0
    assert np.abs(order[middle] - 1.0).max() < 0.2
    assert np.abs(order[far] - 2.0).max() < 1e-3
    width = high - low
    assert np.nanmax(width[far]) < 1e-3
    mixed = (np.abs(T - 20.0) > 2.0) & (np.abs(T - 20.0) < 6.0)
    assert np.max(width[mixed]) > 0.5


def test_a_higher_power_beside_the_first_fades_as_the_step_is_halved() -> None:
    def at(level: int) -> float:
        scale = 2.0**-level
        order, *_ = order_of(
            lambda h: (scale * h) ** 2 * np.sin(T) + 0.3 * (scale * h) ** 3 * np.cos(2 * T)
        )
        return float(np.abs(order - 2.0).max())

    first, second, third = at(1), at(2), at(3)
    assert first > 1.8 * second > 1.8 * 1.8 * third


def test_noise_is_a_gap_below_its_floor_and_a_wide_interval_near_it() -> None:
    rng = np.random.default_rng(5)
    level = 1e-9
    noise = {2.0**-k: level * rng.standard_normal(POINTS) for k in range(3)}

    def error(h: float) -> Any:
        return h**2 * np.exp(-T) * np.sin(T) + noise[h]

    order, low, high = order_of(error, floor=4 * level)
    clean, lost = T < 8.0, T > 22.0
    assert np.abs(order[clean] - 2.0).max() < 1e-3
    assert np.isnan(order[lost]).all()
    assert np.isnan(low[lost]).all()
    between = (T > 17.0) & np.isfinite(order)
    assert np.all(high[between] - low[between] > 0.1)
    # what is stated holds
    assert np.all((low <= 2.0) & (high >= 2.0) | np.isnan(order) | (np.abs(order - 2.0) < 1e-3))


def test_differences_that_vanish_or_are_not_finite_have_no_order() -> None:
    order, low, high = order_of(lambda h: 0.0 * T)
    assert np.isnan([order, low, high]).all()
    order, *_ = order_of(lambda h: np.where(T > 20.0, np.nan, h**2 * np.sin(T)))
    assert np.isnan(order[T > 20.0]).all()
    assert np.isfinite(order[T < 15.0]).all()


def test_unrelated_differences_have_an_unbounded_interval() -> None:
    order, low, high = order_of(lambda h: np.sin(T / h))
    inner = slice(50, -50)
    assert np.all(np.isinf(low[inner]) & np.isinf(high[inner]) | np.isnan(order[inner]))


def test_the_last_point_stands_for_itself() -> None:
    def error(h: float) -> Any:
        found = h**2 * T * np.cos(T)
        found[-1] = 30.0 * h
        return found

    order, *_ = order_of(error, end_included=True)
    assert order[-1] == pytest.approx(1.0, abs=1e-12)
    assert np.abs(order[:-1] - 2.0).max() < 1e-12


def test_a_last_point_at_a_zero_crossing_has_the_order_of_those_before_it() -> None:
    order, *_ = order_of(
        lambda h: h**2 * np.sin(T - END) + h**3 * 1e-3 * np.cos(T), end_included=True
    )
    assert order[-1] == pytest.approx(order[-2], abs=1e-12)


def test_levels_that_are_not_neighbours() -> None:
    first, second = (
        (2.0 ** (-2 * a) - 2.0 ** (-2 * b)) * np.sin(T)[None, None] for a, b in ((0, 1), (1, 3))
    )
    zero = np.zeros((1, 1))
    order, *_ = local_order(first, second, (0, 1, 3), (zero, zero), WINDOW, False)
    assert np.abs(order - 2.0).max() < 1e-9


def test_a_member_has_the_same_bits_alone_and_among_others() -> None:
    rng = np.random.default_rng(1)
    first, second = rng.standard_normal((2, 3, 5, POINTS))
    counts = np.array([3, 21, 63, 63, 401])
    zero = np.zeros((3, 5))
    together = local_order(first, second, (0, 1, 2), (zero, zero), counts)
    for case in range(5):
        one = slice(case, case + 1)
        none = zero[:, one]
        alone = local_order(first[:, one], second[:, one], (0, 1, 2), (none, none), counts[one])
        for a, b in zip(together, alone, strict=True):
            np.testing.assert_array_equal(a[:, one], b)


@pytest.mark.parametrize("count", [1, 3, 5, 7, 21, 63])
def test_sums_over_windows(count: int) -> None:
    values = np.random.default_rng(2).integers(0, 1000, 100).astype(float)
    expected = np.convolve(values, np.ones(count), mode="same")
    np.testing.assert_array_equal(box_sum(values, count), expected)


def local(run: Any, quantity: str) -> tuple[Any, Any]:
    """Return the local order of the finest triple of the first scheme and member, and its times."""
    return run.record["t"], run.record[f"{quantity}_local_order"][0, 0, -1]


def test_a_first_order_start_is_of_first_order_everywhere() -> None:
    more = {"time": {"end": 2.0, "base_steps": 640}}
    run = spring([{"kind": "central", "start": "first_order"}], levels=[0, 1, 2, 3], **more)
    _, order = local(run, "u")
    assert np.isfinite(order).all()
    assert np.abs(order - 1.0).max() < 0.1


def test_a_right_scheme_is_of_its_order_everywhere() -> None:
    run = spring(["central", "rk4"], levels=[0, 1, 2, 3])
    for scheme, p in ((0, 2.0), (1, 4.0)):
        for name in ("u", "v"):
            order = run.record[f"{name}_local_order"][scheme, 0, -1]
            assert np.abs(order - p).max() < 0.1


def test_a_one_sided_end_velocity_shows_at_the_last_point_only() -> None:
    data = {
        "title": "test",
        "model": {"kind": "pendulum"},
        "initial": {"theta": 1.0},
        "time": {"end": 20.0},
        "levels": [9, 10, 11, 12],
        "schemes": [{"kind": "central", "end_velocity": "backward"}],
    }
    experiment = Experiment.from_dict(data)
    records = {level: simulate_record(experiment, level) for level in experiment.levels}
    record = analyse_records(experiment, records)
    order = record["omega_local_order"][0, 0, -1]
    assert order[-1] == pytest.approx(1.0, abs=0.06)
    assert np.abs(order[:-1] - 2.0).max() < 0.05


@pytest.mark.slow
def test_a_stop_left_to_the_mesh_lowers_the_order_behind_it() -> None:
    data = {
        "title": "test",
        "model": {"kind": "sliding_box", "m": 1.0, "k": 1.0, "mu": 0.1, "alpha": 0.5, "g": 1.0},
        "initial": {"u": 1.0, "v": 0.0},
        "time": {"end": 6.0},
        "levels": {"from": 6, "to": 13},
        "schemes": [{"kind": "rk2", "events": "mesh"}, {"kind": "rk2", "label": "located"}],
    }
    experiment = Experiment.from_dict(data)
    records = {level: simulate_record(experiment, level) for level in experiment.levels}
    record = analyse_records(experiment, records)
    t, event = record["t"], float(record["first_event_time"][1, 0, -1])
    before, behind = t < event - np.pi / 2, t > event + np.pi / 2
    on_mesh, located = record["u_local_order"][:, 0]
    assert np.abs(located - 2.0).max() < 0.15
    assert np.abs(located[:, :-1] - 2.0).max() < 0.1
    assert np.abs(on_mesh[:, before] - 2.0).max() < 0.05
    # where the stop lies in a step is another part of it at each level, so that the order behind it is an accident
    found = on_mesh[:, behind].mean(axis=1)
    assert found.min() < 0.5
    assert np.ptp(found) > 1.0
