"""The grid convergence index: printed examples, and numbers that are negative, pass zero or do not converge."""

from __future__ import annotations

import numpy as np
import pytest

from vibsim.analysis import analyse_records
from vibsim.convergence.extrapolation.gci import CLASSES, classify, index, of_order, relative
from vibsim.experiment import Experiment
from vibsim.simulation import simulate_record

LEVELS = (4, 5, 6)


def kind(*values: float, floor: float = 1e-15, levels: tuple[int, ...] | None = None) -> str:
    u = np.array(values)[None]
    levels = levels or tuple(range(4, 4 + len(values)))
    return CLASSES[int(classify(u, levels, np.full(u.shape, floor))[0])]


def of(*values: float, order: float = 2.0, levels: tuple[int, ...] | None = None) -> float:
    u = np.array(values)[None]
    levels = levels or tuple(range(4, 4 + len(values)))
    kinds = classify(u, levels, np.full(u.shape, 1e-15))
    return float(index(u, levels, np.array([order]), kinds)[0])


def test_the_tutorial_on_grid_convergence_is_reproduced() -> None:
    """Pressure recovery on three grids: p = 1.786170, GCI 0.103083 % (NPARC Alliance, Examining Spatial Grid
    Convergence; the index over the number)."""
    coarse, medium, fine = 0.961780, 0.968540, 0.970500
    seen = np.log2((medium - coarse) / (fine - medium))
    assert seen == pytest.approx(1.786170, abs=1e-6)
    found = of_order(np.array(fine - medium), 1, seen, seen)
    assert found / fine == pytest.approx(0.00103083, rel=1e-5)


def test_the_factor_is_one_and_a_quarter_where_the_order_is_the_promised_one() -> None:
    """F |u_fine - u_coarse|/(2^p - 1), by hand."""
    u = [1 + 0.3 * 4.0**-level for level in LEVELS]
    assert of(*u) == pytest.approx(1.25 * (u[1] - u[2]) / 3)
    # the observed order is 1, and the promised one is 2
    u = [1 + 0.3 * 2.0**-level for level in LEVELS]
    assert of(*u) == pytest.approx(3 * (u[1] - u[2]) / 1)
    # it is 3: no more than the promised one is used
    u = [1 + 0.3 * 8.0**-level for level in LEVELS]
    assert of(*u) == pytest.approx(3 * (u[1] - u[2]) / 3)
    # two levels
    assert of(1.4, 1.1) == pytest.approx(3 * 0.3 / 3)
    assert np.isnan(of(1.4))


def test_levels_need_not_follow_each_other() -> None:
    levels = (4, 6, 7)
    u = [1 + 0.3 * 4.0**-level for level in levels]
    assert of(*u, levels=levels) == pytest.approx(1.25 * (u[1] - u[2]) / 3)
    u = [1 + 0.3 * 4.0**-level for level in (4, 5, 7)]
    assert of(*u, levels=(4, 5, 7)) == pytest.approx(1.25 * (u[1] - u[2]) / 15)


@pytest.mark.parametrize("shift", [0.0, -1.0, -1.0 - 0.3 * 4.0**-6, 5.0])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_neither_sign_nor_a_shift_changes_the_index(shift: float, sign: float) -> None:
    u = [sign * (1 + 0.3 * 4.0**-level + shift) for level in LEVELS]
    assert of(*u) == pytest.approx(1.25 * 0.3 * (4.0**-5 - 4.0**-6) / 3, rel=1e-10)


def test_it_is_relative_only_away_from_zero() -> None:
    gci, scale = np.array([0.01, 0.01, 0.01, 0.01]), np.array([1.0, 1.0, 1.0, 1.0])
    value = np.array([0.5, -0.5, 0.04, 0.0])
    found = relative(gci, value, scale)
    np.testing.assert_allclose(found[:2], 0.02)
    assert np.isnan(found[2:]).all()
    # an error as large as the number
    assert np.isnan(relative(np.array([0.6]), np.array([0.5]), np.array([0.5])))[0]


@pytest.mark.parametrize(
    ("values", "word"),
    [
        ((1.4, 1.1, 1.0), "monotone"),
        ((-1.4, -1.1, -1.0), "monotone"),
        ((0.2, -0.1, -0.2), "monotone"),
        ((1.4, 0.9, 1.0), "oscillating"),
        ((0.2, -0.1, 0.05), "oscillating"),
        ((1.0, 1.1, 1.4), "monotone_divergence"),
        ((1.0, 1.1, 0.8), "oscillating_divergence"),
        ((1.0, 1.0 + 1e-16, 1.0), "round_off"),
        ((1.0, np.nan, 1.0), "unknown"),
        ((1.4, 1.1), "unknown"),
        # the finest triple above round-off
        ((1.4, 1.1, 1.0, 1.0 + 1e-16), "monotone"),
    ],
)
def test_classes_of_convergence(values: tuple[float, ...], word: str) -> None:
    assert kind(*values) == word


@pytest.mark.parametrize("order", [0.5, 1.0])
def test_gaps_between_levels_do_not_make_a_class(order: float) -> None:
    """Of order 1/2 the difference of levels 5 and 7 is larger than that of 4 and 5."""
    u = [1 + 0.3 * 2.0 ** (-order * level) for level in (4, 5, 7)]
    assert kind(*u, levels=(4, 5, 7)) == "monotone"


def test_three_levels_that_do_not_converge_get_three_times_their_range() -> None:
    assert of(1.4, 0.9, 1.0) == pytest.approx(3 * 0.5)
    assert of(1.0, 1.1, 0.8) == pytest.approx(3 * 0.3)


def test_four_levels_that_do_not_converge_get_the_index_of_their_fit() -> None:
    """Of one exponent, 1/2: numpy's straight line in h^(1/2), with four numbers less the three that are fitted."""
    u, x = np.array([1.0, 1.3, 1.1, 1.25]), 2.0 ** (-0.5 * np.arange(4.0))
    slope, limit = np.polyfit(x, u, 1)
    residual = u - limit - slope * x
    sigma, error = np.sqrt(np.sum(residual**2) / (4 - 3)), abs(slope) * x[-1]
    typical = np.ptp(u) / 3
    assert sigma > typical
    expected = 3 * sigma / typical * (error + sigma + abs(residual[-1]))
    assert of(*u, order=0.5) == pytest.approx(expected, rel=1e-12)


@pytest.mark.slow
def test_a_fit_covers_noisy_levels() -> None:
    """Of levels that scatter about the limit, the index bounds the error of the finest one."""
    rng = np.random.default_rng(7)
    levels = tuple(range(4, 9))
    h = 2.0 ** -np.array(levels, dtype=float)
    held = []
    for _ in range(400):
        u = 2.0 + 0.5 * h**2 + 0.003 * rng.normal(size=len(h))
        held.append(of(*u) >= abs(u[-1] - 2.0))
    assert np.mean(held) >= 0.95


def test_numbers_that_are_equal_have_no_index() -> None:
    assert of(1.0, 1.0, 1.0) == 0.0
    assert of(1.0, 1.0, 1.0, 1.0) == 0.0
    assert of(1.3, 1.1, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0) == 0.0


def test_a_series_has_an_index_at_every_time_that_does_not_vanish_with_the_difference() -> None:
    """Pendulum: it bounds the true error of the finest level, at the times at which the levels cross as well."""
    experiment = Experiment.from_dict(
        {
            "title": "test",
            "model": {"kind": "pendulum"},
            "initial": {"theta": 1.0},
            "time": {"end": 20.0},
            "levels": [6, 7, 8, 9],
            "schemes": ["central"],
        }
    )
    records = {level: simulate_record(experiment, level) for level in experiment.levels}
    record = analyse_records(experiment, records)
    found = record["theta_gci"][0, 0]
    error = np.abs(record["theta_exact"][0] - record["theta_finest"][0, 0])
    assert np.all(found >= error)
    norm = record.words("norm").index("l2")
    difference = record["theta_difference_norm"][0, 0, -1, norm]
    assert record["theta_gci_norm"][0, 0, norm] == pytest.approx(1.25 * difference / 3)
    assert record["theta_gci_norm"][0, 0, norm] >= record["theta_error_norm"][0, 0, -1, norm]
