"""Extrapolation: exact where the expansion ends, and a bound that holds where it does not."""

from __future__ import annotations

import numpy as np
import pytest
from ladders import random_truth, shape_in_time
from reference_pendulum import pendulum

from vibsim.convergence.extrapolation.series import extrapolate_series

T = np.linspace(0.0, 20.0, 65)
LADDERS = [(3, 4, 5), (3, 5, 6), (2, 5, 6), (3, 4, 5, 6), (3, 5, 6, 9), (2, 4, 5, 6, 8)]


def ladder(levels: tuple[int, ...], terms: list[tuple[float, np.ndarray]]) -> list[np.ndarray]:
    fields = []
    for level in levels:
        error = sum(2.0 ** (-level * p) * e for p, e in terms)
        fields.append((np.cos(T) - np.asarray(error))[None, None])
    return fields


def run(
    fields: list[np.ndarray], levels: tuple[int, ...], p: float, even: bool
) -> tuple[np.ndarray, np.ndarray]:
    return extrapolate_series(fields, levels, np.array([p]), np.array([even]))


@pytest.mark.parametrize("levels", LADDERS)
@pytest.mark.parametrize(("p", "gap"), [(1, 1), (2, 1), (2, 2), (4, 2)])
def test_two_powers_are_removed_exactly(levels: tuple[int, ...], p: int, gap: int) -> None:
    rng = np.random.default_rng(1)
    terms = [(float(p), shape_in_time(rng)), (float(p + gap), shape_in_time(rng))]
    value, bound = run(ladder(levels, terms), levels, p, even=gap == 2)
    assert value[0, 0] == pytest.approx(np.cos(T), abs=1e-14)
    assert np.all(bound >= 0)


def test_two_levels_remove_one_power_and_one_level_none() -> None:
    rng = np.random.default_rng(2)
    terms = [(2.0, shape_in_time(rng))]
    value, bound = run(ladder((3, 5), terms), (3, 5), 2, even=True)
    assert value[0, 0] == pytest.approx(np.cos(T), abs=1e-14)
    finest = ladder((3, 5), terms)[1]
    assert bound[0, 0] == pytest.approx(np.maximum.accumulate(np.abs(np.cos(T) - finest[0, 0])))
    value, bound = run(ladder((3,), terms), (3,), 2, even=True)
    assert np.array_equal(value, ladder((3,), terms)[0])
    assert np.all(np.isnan(bound))


@pytest.mark.parametrize("quantity", ["theta", "omega", "dE"])
@pytest.mark.parametrize("trap", [{}, {"first": True}, {"backward": True}])
@pytest.mark.parametrize("count", [3, 4, 5])
def test_the_bound_holds_for_the_pendulum_sound_or_trapped(
    quantity: str, trap: dict[str, bool], count: int
) -> None:
    levels = tuple(range(7, 7 + count))
    fields = [u[None, None] for u in pendulum(levels, quantity, **trap)]
    exact = pendulum((17, 18), quantity)
    best = exact[1] + (exact[1] - exact[0]) / 3
    value, bound = run(fields, levels, 2, even=False)
    assert np.all(np.abs(value[0, 0] - best) <= bound[0, 0] + 1e-9)
    if not trap and quantity == "theta":
        finest_error = np.max(np.abs(fields[-1][0, 0] - best))
        assert np.max(np.abs(value[0, 0] - best)) < 0.02 * finest_error
        assert np.max(bound) < 0.2 * finest_error


def test_the_bound_holds_for_random_ladders() -> None:
    rng = np.random.default_rng(3)
    held = []
    for _ in range(300):
        truth = random_truth(rng)
        fields = [u[None, None] for u in truth.fields]
        value, bound = run(fields, truth.levels, truth.orders[0], even=False)
        noise = 20 * truth.floor[-3:].max()
        held.append(np.all(np.abs(value[0, 0] - truth.exact) <= bound[0, 0] + noise))
    assert np.mean(held) > 0.9


def test_the_bound_sees_one_bad_point() -> None:
    rng = np.random.default_rng(4)
    end = np.zeros_like(T)
    end[-1] = 0.05
    terms = [(2.0, shape_in_time(rng)), (4.0, shape_in_time(rng)), (3.0, end)]
    levels = (2, 3, 4, 5)
    value, bound = run(ladder(levels, terms), levels, 2, even=True)
    assert np.all(np.abs(value[0, 0] - np.cos(T)) <= bound[0, 0])
