"""Every formula of the analysis against fields whose expansion is known exactly."""

from __future__ import annotations

import numpy as np
import pytest

from vibsim.comparison.rescaled_differences import (
    coincidence,
    error_factor,
    masked_ratio,
    proportionality,
)
from vibsim.convergence import differences
from vibsim.core.vocabulary import NORMS

T = np.linspace(0.0, 3.0, 31)
E2, E4 = np.sin(2 * T) + 0.3, np.cos(T) * T
ONE = np.array([T[1]])


def computed(level: int, p: float = 2.0) -> np.ndarray:
    """A solution with error exact - u = h^p e2 + h^(p+2) e4, at h = 2^-level; the exact one is 0.7."""
    h = 2.0**-level
    return (0.7 - h**p * E2 - h ** (p + 2) * E4)[None]


@pytest.mark.parametrize("p", [1.0, 2.0, 3.0, 4.0])
@pytest.mark.parametrize("gap", [1, 2, 3])
def test_estimate_is_the_error_up_to_the_next_power(p: float, gap: int) -> None:
    level = 6
    error = 0.7 - computed(level, p)
    estimate = error_factor(p, gap) * (computed(level, p) - computed(level + gap, p))
    leading = 2.0 ** (-level * p) * np.max(np.abs(E2))
    defect = np.max(np.abs(estimate - error))
    # with h^2 e4 beside e2: |defect| = h^(p+2) |e4| (1 - 2^-(2 gap)) 2^(-p gap) / (1 - 2^(-p gap))
    expected = 2.0 ** (-level * (p + 2)) * np.max(np.abs(E4))
    expected *= 2.0 ** (-p * gap) * (1 - 2.0 ** (-2 * gap)) / (1 - 2.0 ** (-p * gap))
    assert defect == pytest.approx(expected, rel=1e-6, abs=1e-15)
    assert defect < 0.01 * leading


def test_error_factor_is_minus_four_thirds_for_order_two() -> None:
    assert error_factor(2.0, 1) == pytest.approx(-4 / 3, rel=1e-15)
    assert error_factor(np.array([1.0, 4.0]), 1) == pytest.approx([-2.0, -16 / 15])


def test_difference_has_the_sign_of_the_lecture() -> None:
    # u_l - u_(l+1) = -3/4 h^2 e2 (pendulum lecture, 2.5, with the sign of the errata)
    d = computed(10) - computed(11)
    assert d[0] == pytest.approx(-0.75 * 2.0**-20 * E2, rel=1e-4, abs=1e-10)


@pytest.mark.parametrize("levels", [(6, 7, 8), (6, 8, 10), (5, 6, 8), (3, 6, 7), (2, 7, 9)])
@pytest.mark.parametrize("p", [-1.5, 0.0, 0.5, 1.0, 2.0, 4.0])
def test_order_inverts_target_ratio(levels: tuple[int, int, int], p: float) -> None:
    h = [2.0 ** (-p * level) for level in levels]
    ratio = differences.target_ratio(p, levels)
    if p:
        assert ratio == pytest.approx((h[0] - h[1]) / (h[1] - h[2]), rel=1e-10)
    found = differences.order_of_ratio(np.array([ratio, 0.0, -1.0, np.nan, np.inf]), levels)
    assert found[0] == pytest.approx(p, abs=1e-12)
    assert np.all(np.isnan(found[1:]))


def test_order_of_an_impossible_ratio_is_nan() -> None:
    # gaps 3 and 1: no order gives a ratio of 2^-300, nor of 2^300
    assert np.all(np.isnan(differences.order_of_ratio(np.array([2.0**-300, 2.0**300]), (3, 6, 7))))


def test_norms_by_hand() -> None:
    e = np.array([[3.0, -1.0, 0.0, 2.0, -7.0]])
    dt = np.array([0.5])
    by_hand = {"l1": 6.5, "l2": np.sqrt(0.5 * 63), "linf": 7.0, "linf_interior": 3.0}
    assert set(by_hand) == set(NORMS)
    for kind, value in by_hand.items():
        assert differences.norm(e, kind, dt) == pytest.approx([value])
    assert differences.norm(e, "linf_interior", dt, end_included=False) == pytest.approx([7.0])


def test_norms_take_the_step_of_each_member() -> None:
    e = np.ones((2, 3, 4))
    dt = np.array([0.1, 0.2, 0.4])
    assert differences.norm(e, "l1", dt) == pytest.approx(np.broadcast_to(4 * dt, (2, 3)))
    assert differences.norm(e, "l2", dt) == pytest.approx(np.broadcast_to(2 * np.sqrt(dt), (2, 3)))


@pytest.mark.parametrize("size", [1e200, 1e-200])
def test_norms_neither_overflow_nor_vanish(size: float) -> None:
    assert differences.norm(np.full((1, 4), size), "l2", np.ones(1)) == pytest.approx([2 * size])


@pytest.mark.parametrize("kind", NORMS)
def test_norm_of_nan_is_nan_and_of_zero_is_zero(kind: str) -> None:
    e = np.array([[0.0, np.nan, 1.0], [0.0, 0.0, 0.0]])
    found = differences.norm(e, kind, np.ones(1))
    assert np.isnan(found[0])
    assert found[1] == 0.0


def test_ratio_is_masked_at_zero_crossings_and_right_elsewhere() -> None:
    d = [computed(level) - computed(level + 1) for level in (9, 10)]
    ratio = masked_ratio(*d)[0]
    assert np.nanmax(np.abs(ratio - 4.0)) < 0.01
    crossing = (np.abs(E2) < 0.05 * np.max(np.abs(E2))) & (T < 2.5)
    assert np.any(crossing)
    assert np.all(np.isnan(ratio[crossing]))
    assert np.mean(np.isfinite(ratio)) > 0.7


def test_ratio_follows_a_growing_error_from_its_start() -> None:
    growing = (np.exp(4 * T) * np.sin(9 * T))[None]
    ratio = masked_ratio(4 * growing, growing)
    assert np.mean(np.isfinite(ratio[0, 1:10])) > 0.5
    assert np.nanmax(np.abs(ratio - 4)) < 1e-12


def test_ratio_of_nothing_is_nan_without_a_warning() -> None:
    zero = np.zeros((2, 5))
    assert np.all(np.isnan(masked_ratio(zero, zero)))
    nan = np.full((2, 5), np.nan)
    assert np.all(np.isnan(masked_ratio(nan, np.ones((2, 5)))))
    assert np.all(np.isnan(masked_ratio(np.full((1, 3), np.inf), np.ones((1, 3)))))


def test_ratio_is_masked_under_the_floor() -> None:
    d = np.full((1, 4), 5e-13)
    assert np.all(np.isnan(masked_ratio(4 * d, d, floor=1e-13)))
    assert np.all(masked_ratio(4 * d, d, floor=1e-14) == 4.0)


def test_coincidence_and_proportionality() -> None:
    d = E2[None]
    assert coincidence(4 * d, d, np.array([4.0])) == pytest.approx([0.0], abs=1e-15)
    assert coincidence(2 * d, d, np.array([4.0])) == pytest.approx([1.0])
    assert proportionality(-3 * d, d) == pytest.approx([-3.0])
    mixed = 2 * E2 + 0.1 * E4
    expected = np.sum(mixed * E2) / np.sum(E2 * E2)
    assert proportionality(mixed[None], d) == pytest.approx([expected])
    assert coincidence(0 * d, 0 * d, np.array([4.0])) == [0.0]
    assert np.isnan(coincidence(0 * d, d, np.array([4.0])))[0]
    assert np.isnan(proportionality(d, 0 * d))[0]


def test_cosines_measure_the_angle_in_their_own_norm() -> None:
    a, b = np.array([[1.0, 0.0, 0.0]]), np.array([[1.0, 0.1, 0.0]])
    found = differences.cosines([a, b, 5 * a, -b], "l2")[0]
    turned = np.cos(np.arctan(0.1))
    np.testing.assert_allclose(
        found,
        [
            [1.0, turned, 1.0, -turned],
            [turned, 1.0, turned, -1.0],
            [1.0, turned, 1.0, -turned],
            [-turned, -1.0, -turned, 1.0],
        ],
        rtol=1e-15,
    )
    # only the end differs: linf_interior does not see it, and what is largest sees it by the power of its size
    c = np.array([[1.0, 0.0, 0.5]])
    of_end = 0.5 ** (1 + differences.PEAKS)
    for kind, cosine in (("linf_interior", 1.0), ("linf", 1.0 / np.hypot(1.0, of_end))):
        assert differences.cosines([a, c], kind)[0, 0, 1] == pytest.approx(cosine, abs=1e-15)
    assert np.all(differences.cosines([a, c], "linf_interior", end_included=False)[0, 0, 1] < 1.0)
    np.testing.assert_array_equal(
        differences.cosines([a, 0 * a], "l2")[0], [[1.0, 0.0], [0.0, 0.0]]
    )


@pytest.mark.parametrize("kind", NORMS)
def test_no_cosine_depends_on_sizes_or_on_other_members(kind: str) -> None:
    rows = [np.stack([E2, E4]), np.stack([E4, E2 + 0.1 * E4])]
    found = differences.cosines(rows, kind)
    for factor in (1e200, 1e-200):
        scaled = differences.cosines([rows[0], factor * rows[1]], kind)
        np.testing.assert_allclose(scaled, found, rtol=1e-14)
    alone = differences.cosines([row[:1] for row in rows], kind)
    np.testing.assert_array_equal(alone, found[:1])


def test_the_last_change_is_at_least_half_of_the_one_before() -> None:
    numbers = np.array([[9.0, 4.0, 1.0], [4.0, 1.0, 1.5], [1.0, 4.0, 4.0]])
    assert differences.last_change(numbers).tolist() == [3.0, 1.5, 1.5]
    assert differences.last_change(numbers[:, 1:]).tolist() == [3.0, 0.5, 0.0]
    assert np.all(np.isnan(differences.last_change(numbers[:, 2:])))
