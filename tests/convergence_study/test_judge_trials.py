"""Studies in which an independent user saw a wrong or useless verdict."""

from __future__ import annotations

import math
from itertools import product
from typing import Any

import numpy as np
import pytest
import xarray
from thinned import thinned

from vibsim import InputError, judge

H = [0.1, 0.05, 0.025, 0.0125]
T = np.linspace(0.0, 1.0, 17)
SHAPE, OTHER = np.sin(3.0 * T), np.cos(7.0 * T)


def on_grids(counts: list[int], power: float) -> list[xarray.DataArray]:
    grids = [np.linspace(0.0, 1.0, n + 1) for n in counts]
    return [
        xarray.DataArray(np.sin(np.pi * x) * (1 + (1 / (len(x) - 1)) ** power), {"x": x}, ["x"])
        for x in grids
    ]


def test_grids_that_share_their_ends_only_are_refused() -> None:
    counts = [10, 14, 23, 37]
    with pytest.raises(InputError, match=r"have 2 of the 11 points.*3 are needed.*linear or cubic"):
        judge([1 / n for n in counts], on_grids(counts, 1.0), order=2)


def test_a_verdict_says_which_part_of_the_points_is_compared() -> None:
    counts = [12, 18, 27 * 2]
    verdict = judge([1 / n for n in counts], on_grids(counts, 2.0), order=2)
    assert "have 7 of the 13 points of the coarsest one in common along x" in verdict.sentence


@pytest.mark.parametrize("noise", [1e-4, 1e-3, 4e-3])
def test_stated_noise_does_not_excuse_differences_that_fall(noise: float) -> None:
    verdict = judge(H, [1 + h for h in H], order=2, noise=noise)
    assert verdict.status != "PASS"


def test_finer_levels_are_not_advised_where_they_would_show_noise() -> None:
    values = [1 + h**2 for h in H]
    assert "finer level" in judge(H, [1 + 20 * h**2 + h for h in H], order=2).advice
    verdict = judge(H, values, order=2, noise=1e-3)
    assert (verdict.status, verdict.reason) == ("INCONCLUSIVE", "round_off")
    assert "The finest differences of u look like the stated noise" in verdict.sentence
    assert verdict.advice == "Use coarser levels, or compute u with less noise."


def test_finer_levels_are_not_advised_where_they_would_show_round_off() -> None:
    """RK4 on u' = u (1 - u) with 50 to 1600 steps per unit: the last difference is 40 units of the last digit."""
    values = [
        *(0.45085306019019267, 0.4508530603674143, 0.45085306037854034),
        *(0.4508530603792373, 0.4508530603792806, 0.4508530603792843),
    ]
    verdict = judge([0.02 * 2.0**-k for k in range(6)], values)
    assert verdict.reason == "round_off"
    assert "The finest differences of u look like round-off" in verdict.sentence
    assert verdict.advice == "Use coarser levels, or compute u with less noise."


@pytest.mark.parametrize("scattered", [8.0, 250.0])
@pytest.mark.parametrize("away", [0.0, 250.0])
def test_levels_that_differ_by_added_up_rounding_show_round_off(
    away: float, scattered: float
) -> None:
    """All levels are about `away` units of the last digit from the exact value, and `scattered` from each other."""
    units = away + scattered * np.array([0.6, 1.7, 0.1, 0.6, 0.9])
    levels = (math.e * (1.0 + 2.0**-52 * units)).tolist()
    verdict = judge([0.1 * 0.5**k for k in range(5)], levels, order=2, exact=math.e)
    assert (verdict.status, verdict.reason) == ("INCONCLUSIVE", "round_off")
    assert verdict.advice == "Use coarser levels, or compute u with less noise."


@pytest.mark.parametrize("values", [[1.7197, 1.7186, 1.7184, 1.7183], [1.72, 1.719, 1.718, 1.718]])
def test_printed_values_with_too_few_digits_hide_the_order(values: list[float]) -> None:
    """The trapezoidal rule for exp(x) from 0 to 1, of order 2."""
    verdict = judge([0.1, 0.05, 0.025, 0.0125], values, order=2)
    assert verdict.status == "INCONCLUSIVE"
    assert verdict.advice == "Use coarser levels, or give u with more digits."
    assert verdict.order_low is not None
    assert verdict.order_high is not None
    assert verdict.order_low <= 2.0 <= verdict.order_high


@pytest.mark.parametrize(
    ("values", "said", "end"),
    [
        ([-1.6267, -1.6271, -1.627], "change sign", ", or judge another quantity."),
        ([4.2, 3.7, 3.3, 3.1, 2.7], "contradict", "."),
        ([2.5581, 2.5582, 2.5583], "not show a settled order yet (the last estimate is 0)", "."),
        ([1.13, 1.12, 1.1], "grow towards the finer levels", "."),
    ],
)
def test_no_finer_levels_where_values_have_few_digits(
    values: list[float], said: str, end: str
) -> None:
    verdict = judge([0.1 * 2.0**-k for k in range(len(values))], values)
    assert verdict.status == "INCONCLUSIVE"
    assert said in verdict.sentence
    assert verdict.advice.lower().endswith(f"use coarser levels, or give u with more digits{end}")


def test_what_noise_explains_has_a_bound_and_not_the_error_0() -> None:
    verdict = judge(H, [1.001, 1.002, 0.9995, 1.0], order=2, noise=1e-3)
    assert verdict.reason == "exact"
    assert verdict.error_bound is not None
    assert verdict.error_bound >= 1e-3
    assert "The error of the finest level is at most" in verdict.sentence


@pytest.mark.parametrize(
    ("values", "more", "reason"),
    [
        ([0.31] * 3, {}, "round_off"),
        ([0.308712] * 4, {"order": 2}, "round_off"),
        ([[0.31, 0.32, 0.45]] * 3, {"at_least": 1}, "round_off"),
        # whole numbers from 100 on count as rounded
        ([312] * 3, {}, "round_off"),
        ([0.31] * 3, {"exact": 0.3123}, "round_off"),
        ([0.31] * 3, {"exact": 0.31}, "exact"),
        ([0.31] * 3, {"noise": 0.005}, "exact"),
        # a solver that does not use the step size makes the same levels
        ([np.pi] * 3, {}, "round_off"),
        ([[np.pi, 0.1 + 0.2]] * 3, {"order": 2}, "round_off"),
        ([np.float32(0.1)] * 3, {}, "round_off"),
        ([np.pi] * 3, {"exact": np.pi}, "exact"),
        ([np.pi, np.pi, np.nextafter(np.pi, 4)], {}, "exact"),
        ([3, 3, 3], {}, "exact"),
    ],
)
def test_levels_that_are_the_same_do_not_pass(
    values: list[Any], more: dict[str, Any], reason: str
) -> None:
    verdict = judge([0.1, 0.05, 0.025, 0.0125][: len(values)], values, **more)
    assert verdict.reason == reason
    if reason == "round_off":
        assert verdict.sentence.startswith(
            "All levels of u are the same to the last digit that they have, so they do not show its order."
        )
        assert "Check that the solver used h. If it did, use coarser levels, or " in verdict.advice


@pytest.mark.parametrize(
    ("value", "end"), [(0.31, "give u with more digits."), (np.pi, "state the exact value.")]
)
def test_levels_that_are_the_same_are_told_what_would_show_more(value: float, end: str) -> None:
    assert judge(H[:3], [value] * 3).advice.endswith(end)


def test_levels_that_are_the_same_are_doubted() -> None:
    verdict = judge(H, [1.5, 1.5, 1.5, 1.5], order=2)
    assert verdict.reason == "exact"
    assert (
        "All levels are the same to the last digit. Check that the solver used h."
        in verdict.sentence
    )


@pytest.mark.parametrize(
    ("count", "rounding"), [(4, 0.0), (4, 1e-12), (5, 0.0), (5, 1e-12), (6, 0.0)]
)
@pytest.mark.parametrize("shape", [1.0, np.sin(np.arange(9.0))])
def test_a_finest_level_copied_from_the_one_before_does_not_pass(
    count: int, shape: float | np.ndarray, rounding: float
) -> None:
    h = [0.1 * 0.5**k for k in range(count)]
    values = [2.0 + shape * x**2 for x in h]
    assert judge(h, values, order=2).status == "PASS"
    verdict = judge(h, [*values[:-1], values[-2] * (1.0 + rounding)], order=2)
    assert verdict.status == "INCONCLUSIVE"
    same = f"The levels h = {h[-2]:g} and {h[-1]:g} are the same to the last digit."
    assert (same in verdict.sentence) == (rounding == 0.0)


@pytest.mark.parametrize("power", [1, 2])
def test_an_order_far_from_the_measured_one_does_not_pass_either_if_none_is_expected(
    power: int,
) -> None:
    """The finest level ran with another step than the one stated: order 1 passed with a measured order of 0.38."""
    x, true = np.linspace(0.0, 1.0, 21), [0.1 * 0.5**k for k in range(5)]
    shape, other = np.sin(2.0 * x), np.cos(4.0 * x)
    values = [np.cos(x) + shape * k**power + 0.02 * other * k ** (power + 1) for k in true]
    assert judge(true, values).status == "PASS"
    stated = [*true[:-1], 1.3 * true[-1]]
    verdict = judge(stated, values)
    assert verdict.order is not None
    assert verdict.order < power - 0.4
    assert (verdict.status, verdict.reason) == ("INCONCLUSIVE", "pre_asymptotic")


def test_an_order_says_behind_which_level_it_is_not_seen() -> None:
    h = [0.1 * 0.5**k for k in range(6)]
    values = [np.sin(np.arange(9.0)) * (1.0 + x**2) for x in h]
    told = "The levels finer than h = 0.00625 do not show this order."
    assert told not in judge(h, values, order=2).sentence
    too_long = 0.5 * (h[-2] + h[-1])
    values[-1] = np.sin(np.arange(9.0)) * (1.0 + too_long**2)
    assert told in judge(h, values, order=2).sentence


def test_three_levels_that_may_fall_by_accident_fit_one_order() -> None:
    verdict = judge(H[:3], [1 + x**0.35 for x in H[:3]], order=0.35)
    assert "They fit order 0.35 alone, but may do so by accident." in verdict.sentence
    # the end of y' = -a y + r sin(y) + 1 with a lagged source, with 7, 9, 18 and 36 steps
    values = [0.8814824049983081, 0.8839508104324965, 0.8883471669912358, 0.8905836043651053]
    verdict = judge([1 / 7, 1 / 9, 1 / 18, 1 / 36], values, order=1)
    assert "They fit orders 0.98 to 1.00 alone, but may do so by accident." in verdict.sentence


def test_the_finer_level_of_an_advice_counts() -> None:
    """A level closer than a factor of 1.4 would be left out."""
    for ratio, finer in ((1.2, 0.05), (1.39, 0.05), (1.5, 0.1 / 1.5), (2.0, 0.05), (4.0, 0.025)):
        found = judge([0.1 * ratio, 0.1], [1.1, 1.05])
        assert found.advice == f"Add a level, such as h = {finer:.6g}."


def test_noise_is_not_said_to_grow_where_the_finest_difference_is_small() -> None:
    """The mean of exp(x) over 100, 400, ..., 102400 random x."""
    values = [1.72637, 1.70333, 1.71357, 1.71491, 1.71975, 1.71868]
    found = judge([0.1 * 2.0**-k for k in range(6)], values, order=1, exact=np.e - 1)
    assert found.status == "INCONCLUSIVE"
    assert "grow" not in found.sentence


@pytest.mark.parametrize("h", [H, H[:3], [0.1, 0.07, 0.03]])
@pytest.mark.parametrize("order", [None, 2.0])
def test_an_exact_value_beside_a_clear_limit_is_missed(h: list[float], order: float | None) -> None:
    values = [1 + 0.7 * x**2 for x in h]
    assert judge(h, values, order=order).status == "PASS"
    assert judge(h, values, order=order, exact=1.0).status == "PASS"
    assert judge(h, values, order=order, exact=1.001).reason == "wrong_limit"


def test_two_powers_below_the_expected_one_are_not_that_one() -> None:
    h = [0.1, 0.05, 0.025, 0.0125]
    values = [1 + x + 0.4 * x**0.5 for x in h]
    assert judge(h, values, order=2).reason == "order_low"
    assert judge(h, values, at_least=0.5).status == "PASS"


@pytest.mark.slow
def test_printed_bounds_hold() -> None:
    """The bounds of sentences are not below those of the numbers."""
    rng = np.random.default_rng(3)
    for _ in range(60):
        p, size = rng.choice([1.0, 2.0, 4.0]), 10.0 ** rng.uniform(-3, 3)
        verdict = judge(H, [size * (2 + h**p + 0.3 * h ** (p + 1)) for h in H], order=p)
        if "at most " not in verdict.sentence:
            continue
        stated = float(verdict.sentence.split("at most ")[1].split()[0].rstrip("."))
        assert verdict.error_bound is not None
        assert stated >= verdict.error_bound * (1 - 1e-12)
        assert stated <= 1.2 * verdict.error_bound


def test_what_is_not_settled_says_the_orders_that_are_possible() -> None:
    verdict = judge(H, [1 + h + 10 * h**2 for h in H], order=2)
    assert verdict.reason == "pre_asymptotic"
    assert "They are consistent with orders from 1.00 to 2.00." in verdict.sentence


def test_an_exact_value_may_be_any_distance_away() -> None:
    for size, exact in ((1e-200, 1.0), (1e-100, 1e300)):
        verdict = judge(H, [size * (1 + h * h) for h in H], exact=exact, order=2)
        assert (verdict.status, verdict.reason) == ("FAIL", "wrong_limit")


@pytest.mark.parametrize("limit", thinned([1.23456, -3.21987], 2))
@pytest.mark.parametrize("digits", [4, 5, 6])
@pytest.mark.parametrize("order", [1, 2, 4])
def test_bounds_hold_of_printed_numbers(limit: float, digits: int, order: int) -> None:
    """A table shows 4 to 6 digits of values whose limit is known."""
    h = [0.2 * 0.5**k for k in range(6)]
    values = [float(f"{limit + 0.7 * x**order + 0.3 * x ** (order + 1):.{digits}g}") for x in h]
    for asked in (None, order):
        verdict = judge(h, values, order=asked)
        assert verdict.error_bound is not None
        assert verdict.best is not None
        assert verdict.best_bound is not None
        assert abs(values[-1] - limit) <= verdict.error_bound
        assert abs(verdict.best - limit) <= verdict.best_bound
        said = "rounding of the values to their last digit" in verdict.sentence
        assert said or verdict.error_bound > 5.0 * 10.0 ** (1 - digits)
    unprinted = judge(h, [limit + 0.7 * x**order for x in h])
    assert "last digit" not in unprinted.sentence


LOGARITHMIC = {
    "integral of x log x": [
        -sum(x * math.log(1 / x) for x in np.arange(1, n) / n) / n for n in (8, 16, 32, 64, 128)
    ],
    "number": [2.0 - 0.3 * h**2 * math.log(h) for h in 0.25 * 0.5 ** np.arange(6)],
    "field": [
        np.cos(T) + SHAPE * h**2 * math.log(h) + 0.4 * OTHER * h**2
        for h in 0.25 * 0.5 ** np.arange(6)
    ],
}


@pytest.mark.parametrize("name", LOGARITHMIC)
def test_a_power_times_a_logarithm_is_no_lower_order(name: str) -> None:
    values = LOGARITHMIC[name]
    h = [0.25 * 0.5**k for k in range(len(values))]
    for asked in ({}, {"order": 2}, {"at_least": 2}):
        verdict = judge(h, values, **asked)
        assert (verdict.status, verdict.reason) == ("INCONCLUSIVE", "pre_asymptotic")
        assert "fit an error like h^2 log h" in verdict.sentence
        assert "add a finer level" not in verdict.advice.lower()
    assert judge(h, values, at_least=1.5).status == "PASS"
    assert judge(h, values, order=3).reason == "order_low"
    assert judge(h, values, order=1).reason == "order_high"
    # nor is it an order between
    assert judge(h, values, order=1.8).status == "INCONCLUSIVE"


def test_a_first_power_times_a_logarithm_is_written_without_it() -> None:
    verdict = judge(
        [0.25 * 0.5**k for k in range(6)],
        [2.0 - h * math.log(h) for h in [0.25 * 0.5**k for k in range(6)]],
    )
    assert "fit an error like h log h" in verdict.sentence


@pytest.mark.parametrize("p", [2 / 3, 4 / 3, 5 / 3])
@pytest.mark.parametrize("part", [-0.08, 0.02, 0.08])
def test_a_power_of_a_corner_passes_beside_whole_powers(p: float, part: float) -> None:
    """The order of a re-entrant corner, with `part` of the error on the finest level in the next whole power."""
    q = math.floor(p) + 1
    sizes = [2.0**k for k in range(4, -1, -1)]
    values = [np.cos(T) + 1e-3 * (SHAPE * x**p + part * OTHER * x**q) for x in sizes]
    assert judge([0.01 * x for x in sizes], values, order=p).reason == "asymptotic"


def test_bounds_hold_where_rounding_adds_up() -> None:
    """Simpson's rule for cos(w x) from 0 to 1 with 40 to 2560 intervals, whose sum rounds more than a stored number."""
    w = np.linspace(2.0, 12.0, 60)
    counts = [40 * 2**k for k in range(7)]

    def simpson(n: int) -> np.ndarray:
        weights = np.ones(n + 1)
        weights[1:-1:2], weights[2:-1:2] = 4.0, 2.0
        return np.sum(weights * np.cos(w[:, None] * np.arange(n + 1) / n), axis=1) / (3 * n)

    found = judge([1 / n for n in counts], [simpson(n) for n in counts], order=4, members=True)
    exact = np.sin(w) / w
    errors = [abs((v.best or 0.0) - value) for v, value in zip(found, exact, strict=True)]
    missed = [error > (v.best_bound or 0.0) for v, error in zip(found, errors, strict=True)]
    assert sum(missed) <= 1


@pytest.mark.parametrize("value", [0.0, 1.0, 0.25, 65.0, 0.0625, 1.0 / 3.0])
def test_equal_levels_that_may_be_exact_are_not_taken_for_printed_numbers(value: float) -> None:
    verdict = judge(H, [value] * 4)
    assert verdict.error_bound is not None
    assert verdict.error_bound <= 4e-16 * max(value, 1.0)


@pytest.mark.parametrize(
    ("levels", "exact", "within"),
    [
        ([1.68] * 3, 1.6804941, 0.0051),  # Simpson's rule, printed with three digits
        ([0.3] * 3, 0.34, 0.051),
        ([215.0, 215.0, 214.0, 214.0, 214.0], 214.4, 3.0),  # counted
        ([335.0] * 3, 334.527, 0.51),
        (
            [176804.0, 109774.0, 93022.0, 88835.0, 87788.0],
            87439.52,
            1.1,
        ),  # rounded to whole numbers
        ([8.0379364312, 8.2336581816, 8.2336581816, 8.2336581816], 8.2352, 0.6),  # of grid points
        (
            [0.9978456732198741] * 2 + [0.9999999884786189] * 4,
            1.0,
            0.005,
        ),  # the same place on four grids
        ([2e-32, 6e-32, 0.5, 0.5], 0.3, 0.51),  # round-off is no step
    ],
)
def test_values_that_come_in_steps_are_no_better_than_a_step(
    levels: list[float], exact: float, within: float
) -> None:
    h = [0.5**k for k in range(len(levels))]
    verdict = judge(h, levels)
    assert verdict.best is not None
    assert verdict.best_bound is not None
    assert abs(verdict.best - exact) <= verdict.best_bound <= within
    assert ("come in steps" in verdict.sentence) == (
        levels[0] in (8.0379364312, 0.9978456732198741, 2e-32)
    )
    assert judge(h, levels, exact=exact).reason != "wrong_limit"


@pytest.mark.parametrize("counts", [[4 * 2**k for k in range(6)], [9, 14, 21, 32, 47, 70, 106]])
def test_a_power_that_no_expansion_has_may_drift_on_the_way_to_the_limit(counts: list[int]) -> None:
    """The midpoint rule for x^(3/4) (1 - 1.5 x): errors in h^(7/4) and h^2 look like order 1.84."""
    centres = [(np.arange(n) + 0.5) / n for n in counts]
    values = [float(np.mean(x**0.75 * (1.0 - 1.5 * x))) for x in centres]
    verdict = judge([1.0 / n for n in counts], values)
    assert verdict.reason == "asymptotic"
    assert abs(verdict.best - (1.0 / 1.75 - 1.5 / 2.75)) <= verdict.best_bound


def test_a_field_of_three_decimals_is_exact_to_these() -> None:
    fields = [np.round(np.cos(2.0 * np.linspace(0.0, 1.0, n)), 3) for n in (11, 21, 41)]
    verdict = judge([0.1, 0.05, 0.025], fields)
    assert verdict.error_bound == pytest.approx(5e-4)


@pytest.mark.parametrize("order", [None, 2.0 / 3.0])
def test_differences_that_grow_decide_nothing(order: float | None) -> None:
    """Of h^(2/3) and h^(4/3) with opposite signs, as beside a corner: a power 1/2 beside another fits them, too."""
    n = [24, 32, 48, 96, 128, 192]
    values = [1.0 + 0.04324188 * (24 / k) ** (2 / 3) - 0.03568779 * (24 / k) ** (4 / 3) for k in n]
    verdict = judge([1 / k for k in n], values, order=order)
    assert (verdict.status, verdict.reason) == ("INCONCLUSIVE", "pre_asymptotic")
    assert verdict.error_bound is None


@pytest.mark.parametrize(
    "blown_up", [[0.24, 0.25, 6e21, -3e138], [0.24, 0.23, 0.25, -70.0], [1.0, -5.0, 1e5, -1e30]]
)
def test_an_unstable_solver_is_told_of_and_has_no_error(blown_up: list[float]) -> None:
    """The differences change their sign, so that there is no order."""
    shape = np.array([1.0, 0.9, 1.1])
    exact = 0.2 * shape
    for values, truth in ((blown_up, 0.2), ([x * shape for x in blown_up], exact)):
        verdict = judge(H, values, order=2)
        assert (verdict.status, verdict.order) == ("INCONCLUSIVE", None)
        assert (verdict.error, verdict.error_bound, verdict.best) == (None, None, None)
        assert ("as with an unstable solver" in verdict.sentence) == (abs(blown_up[-1]) > 1e3)
        assert "grow" in verdict.sentence
        assert "finer level" not in verdict.advice or abs(blown_up[-1]) < 1e3
        known = judge(H, values, order=2, exact=truth)
        assert known.status != "PASS"
        assert known.error is not None
        assert abs(known.error) > 60.0


def test_growth_in_the_window_comes_before_what_contradicts_it() -> None:
    verdict = judge(H, [1.0, 3.0, 1e5, 1e30], order=2)
    assert "as with an unstable solver" in verdict.sentence
    assert "contradict" not in verdict.sentence


def test_a_number_that_is_zero_on_all_coarser_levels_tells_of_no_unstable_solver() -> None:
    """Such as a number of events: the coarse levels see none."""
    verdict = judge(H, [0.0, 0.0, 0.0, 3.0], order=2)
    assert (verdict.status, verdict.error, verdict.best) == ("INCONCLUSIVE", None, None)
    assert "unstable solver" not in verdict.sentence
    assert "The differences of u grow" in verdict.sentence


def test_a_small_difference_by_chance_is_no_growth() -> None:
    """Of noise, and of an error that vanishes at one level."""
    noisy = judge(H, [1.0001, 1.0000, 1.00001, 1.0021], order=2, noise=1e-3)
    crossing = judge(H[:3], [1.0100, 1.0101, 1.0051], order=2)
    for verdict in (noisy, crossing):
        assert "unstable" not in verdict.sentence
    assert noisy.error_bound is not None


@pytest.mark.parametrize("number", [True, False])
def test_values_that_were_packed_into_integers_are_known_to_their_spacing(number: bool) -> None:
    """Errors of order 1, 2 and 4 that come near the spacing of the packed values; those of a norm below it."""
    rng = np.random.default_rng(1)
    missed, hidden = 0, 0
    for _ in range(24):
        counts = [10, 20, 40, 80][: rng.choice([3, 4])]
        order = rng.choice([1, 2, 4])
        a, b, size = rng.uniform([1, 1, 0.05], [8, 8, 0.5])
        part = 10 ** rng.uniform(*((-1.0, 0.5) if number else (0.0, 2.0)))
        spacing = 1.2345678 * part * size * (10 / counts[-1]) ** order
        levels = []
        for n in counts:
            x = np.linspace(0.0, 1.0, n + 1)[n // 2 if number else 0 :: n if number else 1]
            u = np.sin(a * x) + size * np.cos(b * x) * (10 / n) ** order
            level = xarray.DataArray(spacing * np.round((u - 0.3) / spacing) + 0.3, {"x": x}, ["x"])
            level.encoding = {"dtype": "int16", "scale_factor": spacing, "add_offset": 0.3}
            levels.append(level)
        verdict = judge([1 / n for n in counts], levels, order=order)
        truth = np.sin(a * levels[0].x)
        exact = judge([1 / n for n in counts], levels, order=order, exact=truth)
        assert verdict.status != "FAIL"
        assert exact.error is not None
        if verdict.error_bound is not None:
            missed += abs(exact.error) > verdict.error_bound
            hidden += verdict.error_bound < spacing / 2.0
    assert missed == hidden == 0


def test_stated_noise_misses_an_exact_value_no_more_often_than_it_differs() -> None:
    """Three levels of normal noise about it: one in 200 is further away."""
    values = 1.0 + 1e-3 * np.random.default_rng(4).normal(size=(400, 3)).T
    found = judge([0.4, 0.2, 0.1], values, exact=np.ones(400), noise=1e-3, members=True)
    assert sum(one.reason == "wrong_limit" for one in found) <= 6


def test_averages_of_cells_taken_for_points_are_told_of_in_a_pass() -> None:
    """Cells begin at other points on each level, which is an error of order 1 of its own."""
    counts = [10, 20, 40, 80]
    cells = [np.sin(2.0 * (np.arange(n) + 0.5) / n) * (1.0 + 0.3 / n**2) for n in counts]
    around = [np.cos(2.0 * np.pi * np.arange(n) / n) * (1.0 + 0.3 / n**2) for n in counts]
    h, told = [1 / n for n in counts], "taken for those of a periodic grid"
    for asked in ({}, {"order": 1}, {"at_least": 1}):
        verdict = judge(h, cells, **asked)
        assert verdict.status == "PASS"
        assert told in verdict.sentence
    assert told not in judge(h, around, order=2).sentence


@pytest.mark.parametrize("kind", ["linear", "cubic"])
def test_averages_of_cells_interpolated_as_points_from_end_to_end_are_told_of(kind: str) -> None:
    """Values of cells of a method of order 2 have an order of 1 there, which must not be blamed on the method."""
    counts, told = [8, 16, 32, 64], "taken for points from end to end"
    cells = [np.sin(np.pi * (np.arange(n) + 0.5) / n) * (1.0 + 1.0 / n**2) for n in counts]
    h = [1 / n for n in counts]
    verdict = judge(h, cells, order=2, restrict=kind)
    assert verdict.status != "PASS"
    assert told in verdict.advice
    assert judge(h, cells, order=2, restrict="mean").status == "PASS"
    points = [np.sin(np.linspace(0.0, np.pi, n)) * (1.0 + 1.0 / n**2) for n in (9, 14, 21, 31)]
    whole = judge([1 / 8, 1 / 13, 1 / 20, 1 / 30], points, order=2, restrict=kind)
    assert told not in whole.sentence + whole.advice


def test_a_low_order_behind_a_higher_one_is_explained() -> None:
    """Two shapes: -12 times the part of order 4 is of order 2 at the finest level, and the estimate is above 4."""
    h, x = [0.2 * 0.5**k for k in range(6)], np.linspace(0.0, 1.0, 20)
    shape, other = np.sin(3 * x), np.sin(3 * x) + 0.3 * np.cos(5 * x)
    values = [x + shape * k**4 - 12.0 * other * h[-1] ** 2 * k**2 for k in h]
    verdict = judge(h, values, order=4)
    assert verdict.reason == "order_low"
    assert verdict.order is not None
    assert verdict.order > 4.0
    assert "Another part still raises the measured order." in verdict.sentence
    low = judge(h, [x + shape * k**2 for k in h], order=4)
    assert low.reason == "order_low"
    assert "Another part" not in low.sentence


@pytest.mark.parametrize(
    ("values", "exact"),
    [
        ([1.235, 1.235, 1.235], 1.2346),
        ([1.4, 1.4, 1.4, 1.4], 1.3988),
        ([3.11, 3.22, 3.28, 3.32, 3.33], 3.345),
    ],
)
def test_printed_numbers_do_not_miss_what_they_were_rounded_from(
    values: list[float], exact: float
) -> None:
    h = [0.2 * 0.5**k for k in range(len(values))]
    assert judge(h, values, exact=exact).status != "FAIL"
    assert judge(h, values, exact=exact + 0.1).reason == "wrong_limit"
    assert judge(h[:3], [3.0, 3.0, 3.0], exact=3.001).reason == "wrong_limit"


@pytest.mark.parametrize(
    ("h", "values", "asked"),
    [
        ([0.18, 0.06, 0.02], [0.260, 0.263, 0.264], {"order": 2}),  # of 0.2638 - 0.12 h^2
        ([0.18, 0.06, 0.02], [0.260, 0.263, 0.264], {"order": 1}),
        ([0.18, 0.06, 0.02], [0.260, 0.263, 0.264], {}),
        ([0.2, 0.1, 0.05, 0.025], [0.366, 0.357, 0.355, 0.354], {"order": 1}),
        ([0.2, 0.05, 0.0125], [0.678, 0.656, 0.654], {"order": 2, "exact": 0.6538}),
        ([0.2, 0.1, 0.05], [0.3692, 0.3626, 0.3612], {"order": 2, "exact": 0.36082}),
        (
            [0.2, 0.2 / 3, 0.2 / 9, 0.2 / 27],
            [-0.627, -0.652, -0.657, -0.658],
            {"order": 1, "exact": -0.6589844},
        ),
    ],
)
def test_no_order_is_read_off_rounded_digits(
    h: list[float], values: list[float], asked: dict[str, float]
) -> None:
    """Half a unit of the last digit makes 1 of these orders, or 2."""
    assert judge(h, values, **asked).status == "INCONCLUSIVE"


def test_an_order_that_rounding_does_not_change_passes_with_an_interval_that_holds_it() -> None:
    h = [0.4, 0.2, 0.1, 0.05]
    verdict = judge(h, [round(1.0 + 0.52 * x**2, 4) for x in h], order=2)
    assert verdict.status == "PASS"
    assert verdict.order_low <= 2.0 <= verdict.order_high


@pytest.mark.parametrize("printed", [False, True])
def test_single_precision_that_is_stored_as_double_is_recognised(printed: bool) -> None:
    """The errors of RK4 for u' = -u end in the rounding of single precision."""
    h = [0.2 * 0.5**k for k in range(6)]
    exact = [math.exp(-2.0)]
    levels = []
    for x in h:
        factor = 1.0 - x + x**2 / 2.0 - x**3 / 6.0 + x**4 / 24.0
        single = np.float32(factor ** round(2.0 / x))
        levels.append(float(str(single)) if printed else float(single))
    verdict = judge(h, levels, order=4)
    assert abs(levels[-1] - exact[0]) <= verdict.error_bound
    assert judge(h, levels, order=4, exact=exact[0]).reason != "wrong_limit"


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_a_value_that_is_not_finite_counts_wherever_it_is(bad: float) -> None:
    """Also at a point that no other level has; of members, in the one that has it."""
    levels = [np.sin(np.linspace(0.0, 1.0, n + 1)) * (1.0 + 1.0 / n**2) for n in (10, 20, 40, 80)]
    h = [1 / 10, 1 / 20, 1 / 40, 1 / 80]
    assert judge(h, levels, order=2).status == "PASS"
    both = [xarray.DataArray(np.stack([u, u]), dims=("case", "x")) for u in levels]
    both[-1][1, 3] = bad
    levels[-1][3] = bad
    assert judge(h, levels, order=2).reason == "non_finite"
    found = judge(h, both, order=2, members=True)
    assert [one.reason for one in found] == ["asymptotic", "non_finite"]


def test_masked_cells_are_not_advised_to_be_left_out_with_all_levels() -> None:
    levels = [u.where(abs(u.x - 0.5) > 0.2) for u in on_grids([10, 20, 40], 2.0)]
    verdict = judge(H[:3], levels, order=2)
    assert verdict.reason == "non_finite"
    assert "leave these points out" in verdict.advice
    assert "leave these levels out" in judge(H[:3], [math.nan] * 3).advice


@pytest.mark.parametrize(
    ("count", "known", "shape"),
    thinned(product([5, 6], [False, True], [np.ones(1), np.linspace(0.5, 1.0, 6)]), 3),
)
def test_a_finest_level_that_contradicts_the_others_is_not_set_aside(
    count: int, known: bool, shape: Any
) -> None:
    """The last run stopped a step early, say: an order of the others is no verdict on all."""
    h, off = [0.1 / 2**k for k in range(count)], np.array([[1e-2], [1.0], [-1.0]])
    exact = np.tile(shape, (len(off), 1))
    values = [exact * (1.0 + x**2 + 0.3 * x**3) + (off if x == h[-1] else 0.0) for x in h]
    if shape.size == 1:
        exact, values = exact[:, 0], [value[:, 0] for value in values]
    questions: list[dict[str, float]] = [{"order": 2.0}, {"at_least": 2.0}, {}, {"order": 1.0}]
    for verdict in (
        verdict
        for question in questions
        for verdict in judge(h, values, exact=exact if known else None, members=True, **question)
    ):
        assert verdict.status == "INCONCLUSIVE"
        assert "but finer ones contradict them" in verdict.sentence
        assert verdict.advice.startswith("Check the step size, the last step and the input")


def test_noise_that_ends_a_window_is_no_contradiction() -> None:
    h = [0.1 / 2**k for k in range(7)]
    values = [1.0 + x**2 + 5e-6 * math.sin(2.3e4 * x) for x in h]
    verdict = judge(h, values, order=2)
    assert (verdict.status, verdict.h_used[-1] > h[-1]) == ("PASS", True)
    assert "do not show this order" in verdict.sentence


@pytest.mark.parametrize("limit", [0.1022, 10.02, 0.2022])
def test_numbers_of_as_many_digits_are_known_to_those_of_the_finest_level(limit: float) -> None:
    """From 0.097 to 0.102 the last of five digits changes its place: a unit of the coarsest level is too small."""
    h = [3.0**-k for k in range(4)]
    truths = limit * (1.0 + 1e-4 * np.random.default_rng(8).uniform(-20.0, 20.0, 20))
    values = [[float(f"{true * (1.0 - 0.045 * x**2):.5g}") for true in truths] for x in h]
    found = judge(h, np.array(values), order=2, members=True)
    for true, finest, verdict in zip(truths, values[-1], found, strict=True):
        if verdict.status == "PASS":
            assert abs(verdict.best - true) <= verdict.best_bound
            assert abs(finest - true) <= verdict.error_bound


@pytest.mark.parametrize("question", [{}, {"at_least": 1.0}, {"order": 2.0}])
@pytest.mark.parametrize("exact", [0.2635, -100.0])
def test_an_exact_value_far_from_all_levels_is_missed_whatever_the_order(
    question: dict[str, float], exact: float
) -> None:
    """A wave equation whose coefficient is 2 % too large: the levels show an order, but not surely which."""
    h = [1.0 / n for n in (20, 60, 180, 540)]
    values = [0.29915139, 0.29491939, 0.29445536, 0.29440035]
    assert judge(h, values, exact=exact, **question).reason == "wrong_limit"


def test_an_exact_value_may_be_far_from_levels_that_do_not_approach_each_other() -> None:
    """Levels that have only begun to fall may go anywhere."""
    assert judge([1.0, 0.5, 0.25, 0.125], [0.0, 1.0, 2.0, 2.5], exact=100.0).status != "FAIL"


@pytest.mark.parametrize("printed", [10.5, 10.4, 0.125])
def test_a_number_is_no_wrong_limit_of_what_is_printed_like_it(printed: float) -> None:
    places = len(str(printed).partition(".")[2])
    exact = printed - 0.4 * 10.0**-places
    assert judge([0.16, 0.08, 0.04, 0.02], [printed] * 4, order=2, exact=exact).status != "FAIL"


COUNTS = [20, 24, 29, 35, 41, 50, 60, 72]
SIDE_BY_SIDE = {
    # implicit and explicit Euler for u'' + w^2 u = 0 and y' = 4 y: counts, values, what is expected
    "implicit_7": (COUNTS, lambda n: ((1 - 7j / n) ** -n).real, 1.0),
    "explicit_8.5": (COUNTS, lambda n: ((1 + 8.5j / n) ** n).real, 1.0),
    "explicit_10": (COUNTS, lambda n: ((1 + 10j / n) ** n).real, 2.0),
    "growth": (list(range(10, 22)), lambda n: (1 + 4 / n) ** n, 1.0),
    "rational": ([10, 15, 20, 25, 30, 40], lambda n: (10 / n) ** 2 / (1 + 20 / n), 2.0),
}
"""Levels side by side, each far from an asymptotic range; their orders seemed sure for their many differences."""


@pytest.mark.parametrize("name", SIDE_BY_SIDE)
def test_levels_side_by_side_make_no_order_sure(name: str) -> None:
    counts, value, order = SIDE_BY_SIDE[name]
    values = [value(n) for n in counts]
    for asked in ({"order": order}, {}):
        found = judge([1.0 / n for n in counts], values, **asked)
        assert found.status == "INCONCLUSIVE"


def test_a_verdict_says_how_many_levels_it_leaves_out() -> None:
    counts = [20, 25, 30, 40, 50, 60, 80]
    found = judge([1.0 / n for n in counts], [1.0 + (20 / n) ** 2 for n in counts], order=2)
    assert (found.status, len(found.levels)) == ("PASS", 7)
    assert found.h_used == pytest.approx((1 / 20, 1 / 30, 1 / 50, 1 / 80))
    assert "The verdict leaves out 3 of 7 levels" in found.sentence
    # noise tells of itself on all levels
    noise = np.random.default_rng(5).normal(scale=0.3, size=7)
    values = [1.0 + (20 / n) ** 2 * (1.0 + e) for n, e in zip(counts, noise, strict=True)]
    assert "leaves out" not in judge([1.0 / n for n in counts], values, order=2).sentence


def test_levels_that_move_apart_miss_no_limit() -> None:
    values = [
        *(1.677165945215565, 1.7554101183002653, 1.7648010281805395, 1.7659316291133815),
        *(1.765308192756225, 1.7642746950669002, 1.7631931516643038),
    ]
    found = judge([1 / (13 * k) for k in range(1, 8)], values, exact=1.740340983574077)
    assert found.reason == "pre_asymptotic"


@pytest.mark.parametrize("kind", ["subset", "cubic"])
def test_coordinates_that_number_the_points_are_told_of(kind: str) -> None:
    """Point 3 of 32 is no place of its own: the levels of a method of order 2 agree at point 0 alone."""
    counts, told = [8, 16, 32, 64], "have the same spacing on all levels"
    placed = on_grids(counts, 2.0)
    numbered = [u.assign_coords(x=np.arange(u.size)) for u in placed]
    h = [1 / n for n in counts]
    assert told in judge(h, numbered, order=2, restrict=kind).advice
    assert told not in judge(h, placed, order=1, restrict=kind).advice


def test_an_exact_function_that_takes_no_arrays_is_told_how_it_is_called() -> None:
    levels = on_grids([10, 20, 40], 2.0)
    with pytest.raises(InputError, match=r"raised TypeError .* use np\.sin instead of math\.sin"):
        judge([0.1, 0.05, 0.025], levels, exact=lambda x: math.sin(math.pi * x))
