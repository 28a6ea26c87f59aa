"""`vibsim.judge`: the results of any solver, in memory."""

from __future__ import annotations

import doctest
import inspect
import math
import subprocess
import sys
from collections.abc import Callable
from dataclasses import FrozenInstanceError, replace
from decimal import Decimal
from pathlib import Path
from typing import Any

import numpy as np
import pandas
import pytest
import xarray
from thinned import thinned

import vibsim
from vibsim import InputError, judge
from vibsim.convergence.study import judge as judge_module
from vibsim.core.vocabulary import REASONS

KEYS = [
    *("quantity", "status", "reason", "order", "order_low", "order_high", "h_used", "error"),
    *("error_bound", "best", "best_bound", "gci", "sentence", "advice"),
]
H = [0.2, 0.1, 0.05, 0.025, 0.0125]


def numbers(order: float, h: list[float] = H, limit: float = 3.0) -> list[float]:
    """Numbers with one pure error term."""
    return [limit + 0.7 * size**order for size in h]


def test_the_worked_examples_are_true() -> None:
    found = doctest.testmod(judge_module)
    assert found.attempted > 15
    assert found.failed == 0


def test_the_signature_is_the_public_one() -> None:
    parameters = inspect.signature(judge).parameters
    assert list(parameters) == [
        *("h", "values", "order", "at_least", "exact", "noise", "restrict", "dims", "members")
    ]
    assert [p.default for p in parameters.values()][2:] == [
        *(None, None, None, None, "subset", None, False)
    ]
    assert vibsim.convergence.judge is judge


def test_the_import_is_light() -> None:
    """Libraries and rooms that it does without take most of the time of an import."""
    program = (
        "import sys; from vibsim.convergence import judge; judge([1, 2, 4], [1.0, 2.0, 4.0]); "
        "heavy = {'xarray', 'matplotlib', 'scipy', 'pydantic', 'netCDF4', 'yaml', 'snakemake'}; "
        "assert not heavy & set(sys.modules), heavy & set(sys.modules); "
        "rooms = {'models', 'schemes', 'experiment', 'engine', 'checks'}; "
        "assert not {f'vibsim.{room}' for room in rooms} & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", program], check=True)


@pytest.mark.parametrize("order", [1.0, 2.0, 3.0, 4.0])
def test_a_pure_power_passes_with_its_order(order: float) -> None:
    verdict = judge(H, numbers(order), order=order)
    assert (verdict.status, verdict.reason) == ("PASS", "asymptotic")
    assert verdict.order == pytest.approx(order, abs=1e-5)
    assert verdict.order_low is not None
    assert verdict.order_high is not None
    assert verdict.order_low <= order <= verdict.order_high
    assert verdict.best == pytest.approx(3.0, abs=1e-5)
    assert verdict.error == pytest.approx(0.7 * H[-1] ** order, rel=0.05)
    assert verdict.error_bound is not None
    assert verdict.error_bound >= 0.7 * H[-1] ** order
    assert verdict.relative_error == pytest.approx(verdict.error / numbers(order)[-1])


@pytest.mark.parametrize(
    ("order", "intervals"),
    [(1, [64, 128, 256, 512]), (1, [32, 64, 128, 256, 512]), (2, [8, 16, 32, 64])],
)
def test_a_field_whose_errors_have_one_shape_is_judged_like_a_number(
    order: int, intervals: list[int]
) -> None:
    """A mode that decays too fast, by ``exp(-9.9 h^p)``: ratios such as 1.88 and 1.94, and nothing beside the mode."""
    h = [1.0 / n for n in intervals]
    sizes = [math.exp(-9.9 * size**order) for size in h]
    mode = np.sin(np.linspace(0.0, 2.0 * np.pi, 25))
    for values in (sizes, [size * mode for size in sizes]):
        assert judge(h, values, order=order).reason == "asymptotic"
        assert judge(h, values, order=order + 1).reason == "order_low"


@pytest.mark.parametrize("size", [1.0, 1e-200, 1e200])
def test_a_noise_of_any_size_is_part_of_the_bounds(size: float) -> None:
    verdict = judge(H, [size * number for number in numbers(2.0)], noise=1e300)
    assert verdict.reason == "exact"
    assert (verdict.error_bound or 0.0) >= 1e300
    assert (verdict.best_bound or 0.0) >= 1e300


def test_another_order_fails() -> None:
    low = judge(H, numbers(1.0), order=2)
    assert (low.status, low.reason) == ("FAIL", "order_low")
    assert "instead of 2" in low.sentence
    assert low.advice
    high = judge(H, numbers(2.0), order=1)
    assert (high.status, high.reason) == ("FAIL", "order_high")


def test_an_order_may_be_a_lower_bound_or_unknown() -> None:
    assert judge(H, numbers(2.0), at_least=1).status == "PASS"
    assert judge(H, numbers(2.0), at_least=2).status == "PASS"
    assert judge(H, numbers(1.0), at_least=2).reason == "order_low"
    assert judge(H, numbers(2.0)).status == "PASS"


def test_a_lower_bound_passes_where_the_order_passes() -> None:
    """The Runge-Kutta method SSP3 on the equations of Lotka and Volterra, with 8 to 128 steps."""
    h = [1 / n for n in (8, 16, 32, 64, 128)]
    values = [1.2364949626620536, 1.2384785350941918, 1.2387089710775914]
    values += [1.238736455804971, 1.2387398025097935]
    assert [x.status for x in (judge(h, values, order=3), judge(h, values, at_least=3))] == [
        "PASS",
        "PASS",
    ]
    assert judge(h, values, at_least=4).reason == "order_low"


def test_levels_may_come_in_any_order_and_ratio() -> None:
    h = [0.13, 0.4, 0.05, 0.22, 0.31]
    verdict = judge(h, numbers(2.0, h), order=2)
    assert verdict.status == "PASS"
    assert verdict.order == pytest.approx(2.0, abs=1e-9)
    assert [level.h for level in verdict.levels] == sorted(h, reverse=True)
    other = [h[i] for i in (3, 1, 4, 0, 2)]
    assert judge(other, numbers(2.0, other), order=2) == verdict


def test_three_levels_give_the_order_of_their_equation() -> None:
    h, u = [0.3, 0.17, 0.1], [1.31, 1.12, 1.07]
    verdict = judge(h, u, order=1)
    p = verdict.order
    assert p is not None
    measured = (u[0] - u[1]) / (u[1] - u[2])
    assert (h[0] ** p - h[1] ** p) / (h[1] ** p - h[2] ** p) == pytest.approx(measured, rel=1e-9)
    best = u[2] - (u[1] - u[2]) * h[2] ** p / (h[1] ** p - h[2] ** p)
    assert verdict.best == pytest.approx(best, rel=1e-9)
    size = abs((u[1] - u[2]) / u[2])
    assert verdict.gci == pytest.approx(1.25 * size / ((h[1] / h[2]) ** p - 1), rel=1e-9)


def test_fewer_than_three_levels_decide_nothing() -> None:
    for count in (1, 2):
        verdict = judge(H[:count], numbers(2.0)[:count], order=2)
        assert (verdict.status, verdict.reason) == ("INCONCLUSIVE", "too_few_levels")
        assert verdict.order is None
        assert verdict.best is None
        assert verdict.h_used == ()
        assert verdict.advice


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_a_number_that_is_not_finite_fails(bad: float) -> None:
    values = numbers(2.0)
    values[1] = bad
    verdict = judge(H, values, order=2)
    assert (verdict.status, verdict.reason) == ("FAIL", "non_finite")
    assert "h = 0.1" in verdict.sentence
    assert verdict.order == pytest.approx(2.0), "four levels are left, and three give an estimate"
    for count in (1, 3):
        assert judge(H[:count], [bad] * count).reason == "non_finite"
    values[1], values[4] = 3.0, bad
    assert judge(H, values, order=2).error is None, "the finest level has none"


def test_round_off_is_exact_and_noise_moves_the_floor() -> None:
    equal = judge(H, [2.0, 2.0 + 4e-16, 2.0, 2.0, 2.0 - 4e-16], order=2)
    assert (equal.status, equal.reason) == ("PASS", "exact")
    noisy = [2.0, 2.003, 1.998, 2.001, 2.0]
    assert judge(H, noisy, order=2, noise=0.01).reason == "exact"
    assert "stated noise" in judge(H, noisy, order=2, noise=0.01).sentence
    assert judge(H, noisy, order=2).reason != "exact"
    single = [np.float32(2.0 + 1e-7 * k) for k in range(5)]
    assert judge(H, single, order=2).reason == "exact", "single precision has its own round-off"
    assert judge(H, [float(x) for x in single], order=2).reason == "exact", "it is recognised"
    assert judge(H, [2.0 + 1e-7 * k for k in range(5)], order=2).reason != "exact"


def test_levels_without_an_order_are_not_said_to_fit_one() -> None:
    """They differ by a few units in the last place, and all miss the exact value by more."""
    values = [1.0 + k * 2.0**-52 for k in (40, 13, 24, 4, 26)]
    verdict = judge([0.6, 0.3, 0.15, 0.075, 0.0375], values, order=5, exact=1.0 - 250 * 2.0**-52)
    assert verdict.order is None
    assert "unknown" not in verdict.sentence + verdict.advice


def test_constant_levels_are_exact_with_no_error() -> None:
    verdict = judge(H, [2.0] * 5)
    assert (verdict.reason, verdict.gci) == ("exact", 0.0)
    assert judge(H, [0.0] * 5).reason == "exact"


def test_exact_values_show_a_wrong_limit_and_true_errors() -> None:
    right = judge(H, numbers(2.0), order=2, exact=3.0)
    assert right.status == "PASS"
    assert right.error == pytest.approx(0.7 * H[-1] ** 2, rel=1e-9)
    assert [level.error for level in right.levels] == pytest.approx([0.7 * h**2 for h in H])
    wrong = judge(H, numbers(2.0), order=2, exact=3.2)
    assert (wrong.status, wrong.reason) == ("FAIL", "wrong_limit")
    assert wrong.error == pytest.approx(numbers(2.0)[-1] - 3.2)
    assert wrong.best == pytest.approx(3.0, abs=1e-4)


def test_the_sign_of_an_error_is_computed_minus_exact() -> None:
    below = judge(H, [3.0 - 0.7 * h**2 for h in H], order=2)
    assert below.error == pytest.approx(-0.7 * H[-1] ** 2, rel=0.05)


def test_huge_and_tiny_values_have_the_same_verdict() -> None:
    for factor in (1e300, 1e-300, -1e-3):
        verdict = judge(H, [factor * x for x in numbers(2.0)], order=2)
        assert verdict.status == "PASS", factor
        assert verdict.error == pytest.approx(factor * 0.7 * H[-1] ** 2, rel=0.05)


def test_a_coarse_level_that_blew_up_does_not_hide_the_others() -> None:
    for size in (1e30, 1e200, 1e306):
        verdict = judge([0.4, *H], [size, *numbers(2.0)])
        assert verdict.order == pytest.approx(2.0, abs=1e-5), size
        assert verdict.best == pytest.approx(3.0, abs=1e-4)


def test_numbers_of_cells_in_place_of_step_sizes_are_suspected() -> None:
    verdict = judge([1 / h for h in H], numbers(2.0), order=2)
    assert verdict.status != "PASS"
    assert verdict.order == pytest.approx(-2.0, abs=1e-5)
    assert "not a number of cells or steps" in verdict.advice


def test_levels_upside_down_are_suspected_and_not_called_round_off() -> None:
    steps = (0.1, 0.05, 0.025, 0.0125)
    grids = [np.linspace(0.0, 1.0, round(1 / h) + 1) for h in steps]
    fields = [
        xarray.DataArray(np.sin(3 * x) * (1 + h**2), {"x": x}, ["x"])
        for h, x in zip(steps, grids, strict=True)
    ]
    verdict = judge(steps, fields[::-1], restrict="linear")
    assert verdict.status == "INCONCLUSIVE"
    assert "grow towards the finer levels" in verdict.sentence
    assert "that each level has its own" in verdict.advice


def test_three_levels_have_an_order_and_a_best_value_whatever_the_status() -> None:
    h, u = [0.4, 0.2, 0.1], [1.0, 0.7, 0.69]
    for more in ({}, {"order": 1.0}, {"order": 2.0}, {"noise": 0.1}, {"exact": 2.0}):
        verdict = judge(h, u, **more)
        if verdict.reason != "exact":
            assert verdict.order == pytest.approx(np.log2(30))
            assert verdict.best == pytest.approx(0.69 - 0.01 / 29)


def test_several_sizes_are_refined_together() -> None:
    dx = [10 * h for h in H]
    verdict = judge({"dt": H, "dx": dx}, numbers(2.0), order=2)
    assert verdict.status == "PASS"
    assert verdict.size_name == "dt"
    assert "in proportion" not in verdict.sentence
    back = judge({"dt": H[::-1], "dx": dx[::-1]}, numbers(2.0)[::-1], order=2)
    assert (back.status, back.order, back.sentence) == ("PASS", verdict.order, verdict.sentence)
    squares = judge({"dx": dx, "dt": [h * h for h in H]}, numbers(2.0), order=2)
    assert squares.status == "PASS"
    assert "counts powers of dx; dt is refined with it, not in proportion" in squares.sentence
    with pytest.raises(InputError, match=r"h\['dx'\].*must decrease from level to level, as dt"):
        judge({"dt": H, "dx": [1.0, 0.5, 0.6, 0.2, 0.1]}, numbers(2.0))


def test_members_have_verdicts_of_their_own() -> None:
    values = [np.array([3 + h**2, 2 + h, np.nan if h == H[0] else 1.0 + h**2, 1.0]) for h in H]
    found = judge(H, values, order=2, members=True)
    assert [v.reason for v in found] == ["asymptotic", "order_low", "non_finite", "exact"]
    assert found[0] == judge(H, [float(v[0]) for v in values], order=2)
    fields = [np.stack([np.outer(x, x), 2 * np.outer(x, x)]) * (1 + h) for h, x in series()]
    both = judge(H, fields, order=1, members=True)
    assert [v.status for v in both] == ["PASS", "PASS"]
    assert both[1].error == pytest.approx(2 * both[0].error)
    with pytest.raises(InputError, match="members"):
        judge(H, numbers(2.0), members=True)
    with pytest.raises(InputError, match=r"axis 0.*same points"):
        judge(H, [np.ones(3)] * 4 + [np.ones(5)], members=True)


def series() -> list[tuple[float, Any]]:
    """Step sizes with their points from 0 to 1."""
    return [(h, np.linspace(0.0, 1.0, round(2 / h) + 1)) for h in H]


def test_a_verdict_is_frozen_and_has_the_keys_of_the_contract() -> None:
    verdict = judge(H, numbers(2.0), order=2)
    content = verdict.to_dict()
    assert list(content) == KEYS
    assert content["h_used"] == list(verdict.h_used)
    with pytest.raises(FrozenInstanceError):
        verdict.status = "FAIL"  # type: ignore[misc]
    field = judge(H, [np.sin(x) * (1 + h**2) for h, x in series()], order=2).to_dict()
    assert field["best"] is None
    assert field["best_bound"] is None
    assert field["status"] == "PASS"


def test_the_sentence_says_order_error_and_bound() -> None:
    sentence = judge(H, numbers(2.0), order=2).sentence
    assert sentence.startswith("u converges with order 2.00")
    assert ", as expected." in sentence
    assert "The error of the finest level is 1.1e-4 (0.0036 %), at most 1." in sentence
    assert "The extrapolated value is 3.0000" in sentence


def test_a_measured_order_away_from_the_one_that_dominates_is_explained() -> None:
    x = np.linspace(0, 1, 33)
    steps = 2.0 ** -np.arange(5)
    for size, told in ((-3.0, "It raises"), (3.0, "It lowers"), (0.1, "")):
        fields = [h**2 * np.sin(3 * x) + size * h**4 * np.cos(5 * x) for h in steps]
        found = judge(steps, fields, order=2)
        assert found.status == "PASS"
        assert told in found.sentence
        assert ("the measured order" in found.sentence) == bool(told)


@pytest.mark.parametrize(
    ("ulps", "reason"), [(4, "exact"), (60, "round_off"), (4000, "wrong_limit")]
)
def test_rounding_that_adds_up_is_no_wrong_limit(ulps: int, reason: str) -> None:
    """Simpson's rule on a cubic, and RK4 with 4000 steps, end some ten units of the last digit away."""
    values = [0.7357588823428847] * 3
    assert judge(H[:3], values, order=4, exact=values[0] + ulps * 1.1e-16).reason == reason


def test_bounds_hold_where_rounding_in_single_precision_adds_up() -> None:
    """Euler's method for u' = -k u with up to 2048 steps of float32."""

    def euler(k: float, n: int) -> np.float32:
        u, part = np.float32(1.0), np.float32(k / n)
        for _ in range(n):
            u -= part * u
        return u

    counts, missed = (256, 512, 1024, 2048), 0
    for k in np.linspace(0.3, 2.3, 12):
        found = judge([1.0 / n for n in counts], [euler(k, n) for n in counts])
        assert found.best is not None
        assert found.best_bound is not None
        missed += abs(found.best - np.exp(-k)) > found.best_bound
    assert missed == 0


@pytest.mark.parametrize("points", [1, 101])
def test_stated_noise_is_that_of_all_levels(points: int) -> None:
    """Many steps of first order, each half the noise of two levels, are no noise."""
    rng = np.random.default_rng(20)
    h = np.linspace(0.1, 0.07, 7)
    drifting = [np.full(points, 1.0 + 0.5 * x) for x in h]
    assert judge(h, drifting, order=2, noise=0.0025).reason != "exact"
    noisy = [1.0 + rng.normal(scale=0.0025, size=points) for _ in h]
    assert judge(h, noisy, order=2, noise=0.0025).reason == "exact"


def test_sizes_near_the_ends_of_double_precision_have_no_finer_one() -> None:
    advice = [judge([4 * s, 2 * s, s], [1.0, 2.0, 7 / 3], order=2).advice for s in (1.0, 5e-324)]
    assert advice == ["Add a finer level, such as h = 0.5.", "Add a finer level."]


def test_every_reason_has_a_sentence() -> None:
    from vibsim.convergence.study.sentences import SENTENCES, Setting, describe

    # levels alone do not show these; `not_applicable` is a case of the interpolation
    others = {"match", "mismatch", "unstable", "non_smooth", "not_applicable"}
    cases = {"interpolation", "growing", "blown_up", "rounded", "same", "contradicted", "logarithm"}
    assert set(SENTENCES) == REASONS.keys() - others | cases
    for reason, status in REASONS.items():
        if reason in others:
            continue
        for count in (1, 2, 3):
            levels = judge((0.4, 0.2, 0.1)[:count], [np.nan] * count).levels
            facts = replace(
                judge([0.1], [1.0]),
                quantity="flux",
                status=status,
                reason=reason,
                order=1.5,
                levels=levels,
            )
            sentence, advice = describe(facts, Setting())
            assert "flux" in sentence
            assert sentence.endswith(".")
            assert bool(advice) == (status != "PASS")
            assert "None" not in sentence + advice
            assert "{" not in sentence + advice


def test_a_verdict_prints_as_a_table_with_a_picture() -> None:
    lines = str(judge(H, numbers(2.0), order=2)).splitlines()
    assert lines[0] == "PASS  asymptotic  u"
    assert lines[-6].split()[:2] == ["h", "value"]
    bars = [line.count("#") for line in lines[-5:]]
    assert bars == sorted(bars, reverse=True)
    assert bars[0] > bars[-2] > bars[-1] == 0
    assert max(map(len, lines)) <= 100


def test_a_verdict_becomes_a_dataset() -> None:
    verdict = judge(H, [np.sin(x) * (1 + h**2) for h, x in series()], order=2)
    data = verdict.to_xarray()
    assert data["values"].dims == ("h", "axis 0")
    assert data.attrs["status"] == "PASS"
    assert data["order"].values[0] == pytest.approx(2.0)
    assert np.allclose(data["best_values"], np.sin(np.linspace(0, 1, 11)), atol=1e-5)
    assert set(judge(H, numbers(2.0)).to_xarray().dims) == {"h"}


def test_a_verdict_is_drawn(tmp_path: Path) -> None:
    file = tmp_path / "picture.png"
    figure = judge(H, numbers(2.0), order=2).plot(file)
    assert file.stat().st_size > 5000
    assert len(figure.axes) == 1
    (axes,) = figure.axes
    assert axes.get_xscale() == axes.get_yscale() == "log"
    assert any("slope 2 (expected)" in text.get_text() for text in axes.get_legend().get_texts())
    of_series = judge(H, [np.sin(x) * (1 + h**2) for h, x in series()], order=2).plot()
    assert len(of_series.axes) == 2
    curves = [line.get_ydata() for line in of_series.axes[1].lines]
    assert np.allclose(curves[0], curves[-1], rtol=1e-6), "rescaled differences coincide"
    for values in ([1.0], [2.0] * 5, [np.nan] * 5, [1e300, -1e300, 1e300]):
        judge(H[: len(values)], values).plot(file)


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ({"h": [0.2, 0.1]}, "h: .*has 2 step sizes for 5 levels"),
        ({"h": 0.1}, "h: .*must be a list"),
        ({"h": [0.2, 0.1, 0.05, 0.025, 0.0]}, r"h\[4\]: 0.0: must be a finite number above 0"),
        ({"h": [0.2, 0.1, 0.05, 0.025, -1.0]}, r"h\[4\]: -1.0: must be a finite number above 0"),
        ({"h": [0.2, 0.1, 0.05, 0.025, np.nan]}, r"h\[4\]: nan: must be a finite number above 0"),
        ({"h": [0.2, 0.1, 0.05, 0.025, "x"]}, r"h\[4\]: x: must be a finite number above 0"),
        ({"h": [0.2, 0.1, 0.05, 0.025, True]}, r"h\[4\]: True: must be a finite number above 0"),
        ({"h": [0.2, 0.1, 0.05, 0.025, 0.1]}, r"h\[4\]: 0.1: is the step size of level 1, too"),
        ({"h": {}}, "must name at least one size"),
        ({"values": 3.0}, "values: float: must be a list"),
        ({"values": "abc"}, "values: str: must be a list"),
        ({"values": [], "h": []}, "at least one level"),
        ({"values": ["a", "b", "c", "d", "e"]}, r"values\[0\]: a: must hold numbers"),
        ({"values": [1j, 2j, 3j, 4j, 5j]}, r"values\[0\].*must be real"),
        ({"values": [pandas.Series([1.0, 2.0], [0.0, 0.1])] * 5}, r"Series: .*value.to_xarray\(\)"),
        ({"values": [np.empty(0)] * 5}, r"values\[0\].*must not be empty"),
        ({"values": [1.0, 2.0, 3.0, 4.0, np.ones(3)]}, "has the dimensions axis 0, the coarsest"),
        ({"order": 0}, "order: 0.0: must be a finite number above 0"),
        ({"order": np.inf}, "order: inf: must be a finite number above 0"),
        ({"order": "2"}, "order: 2: must be a finite number above 0"),
        ({"at_least": -1}, "at_least: -1.0: must be a finite number above 0"),
        ({"order": 2, "at_least": 1}, "must not be given together with at_least"),
        ({"noise": -1.0}, "noise: -1.0: must be a finite number from 0"),
        ({"restrict": "nearest"}, "restrict: nearest: must be one of subset, mean, linear, cubic"),
        ({"restrict": None}, "restrict: None: must be one of subset"),
        ({"exact": np.nan}, "exact: values: must be finite"),
        ({"exact": [1.0, 2.0]}, r"exact: values: has shape \(2,\), and the common points have \(\)"),
        ({"exact": np.cos}, "exact.*is a function, and the values have no coordinates"),
        ({"exact": "pi"}, "exact: pi: must hold numbers"),
    ],
    ids=str,
)  # fmt: skip
def test_faulty_arguments_are_refused_in_a_sentence(arguments: dict[str, Any], told: str) -> None:
    whole = {"h": H, "values": numbers(2.0), **arguments}
    with pytest.raises(InputError, match=told):
        judge(**whole)


def test_a_dataset_with_one_variable_is_taken_and_another_refused() -> None:
    levels = [xarray.Dataset({"T": ("x", np.sin(x) * (1 + h))}, {"x": x}) for h, x in series()]
    assert judge(H, levels, order=1).quantity == "T"
    with pytest.raises(InputError, match="is a dataset of 2 variables"):
        judge(H, [level.assign(S=level["T"]) for level in levels])
    # xarray names an array after the task of dask
    unnamed = [xarray.DataArray(level["T"].chunk().data) for level in levels]
    assert judge(H, unnamed, order=1).quantity == "u"


def test_many_members_are_judged_one_by_one() -> None:
    """They are worked out sixteen at a time."""
    rng = np.random.default_rng(5)
    limit = rng.normal(size=100)
    values = [limit + h**2 for h in H]
    found = judge(H, values, order=2, members=True)
    assert len(found) == 100
    for member in (0, 15, 16, 99):
        assert found[member] == judge(H, [float(x[member]) for x in values], order=2)


def gauss(n: int) -> float:
    """Return the integral of exp(-x^2) from 0 to 1 by Gauss's rule of five points on n intervals."""
    nodes, weights = np.polynomial.legendre.leggauss(5)
    x = (np.arange(n)[:, None] + (nodes + 1.0) / 2.0) / n
    return float(np.sum(np.exp(-x * x) * weights / 2.0) / n)


def simpson(n: int) -> float:
    x = np.linspace(0.0, 1.0, 2 * n + 1)
    return float(np.exp(-x * x) @ [1, *[4, 2] * (n - 1), 4, 1]) / (6 * n)


def midpoint(n: int) -> float:
    return float(np.mean(np.exp(-(((np.arange(n) + 0.5) / n) ** 2))))


def compound(n: int) -> float:
    """Return exp(1) as Euler's method has it, for u' = u."""
    return float((1.0 + 1.0 / n) ** n)


ERF = 0.5 * math.sqrt(math.pi) * math.erf(1.0)


@pytest.mark.parametrize("count", thinned(range(4, 13), 4))
@pytest.mark.parametrize("order", [None, 2, 4, 1])
def test_more_levels_of_a_number_make_no_worse_bound(order: int | None, count: int) -> None:
    rules = {2: midpoint, 4: simpson, 1: compound}
    asked = [rules[order]] if order else [*rules.values()]
    cells = [16 * 2**k for k in range(count)]
    values = np.array([[rule(n) for rule in asked] for n in cells])
    found = judge([1 / n for n in cells], values, order=order, members=True)
    for rule, finest, verdict in zip(asked, values[-1], found, strict=True):
        error = finest - (math.e if rule is compound else ERF)
        bound = verdict.error_bound or math.nan
        assert abs(error) <= bound
        # until round-off, which adds up in sums
        if abs(error) > 100 * np.finfo(float).eps:
            assert bound <= 1.2 * abs(error)


def test_bounds_hold_where_the_finest_levels_are_noisy() -> None:
    """Noise that nothing predicts, of a tenth to ten times the error at the level where it begins."""
    rng = np.random.default_rng(712)
    made: dict[int, list[Any]] = {}
    for _ in range(60):
        count, p = int(rng.integers(7, 12)), float(rng.choice([1, 2, 4]))
        h = 0.5 ** np.arange(count)
        a, b, noisy = rng.normal(), rng.normal(), int(rng.integers(1, 4))
        values = 1.0 + a * h**p + b * h ** (p + 1.0)
        size = abs(a) * h[-noisy] ** p * 10.0 ** rng.uniform(-1.0, 1.0)
        values[-noisy:] += size * rng.normal(size=noisy)
        made.setdefault(count, []).append(values)
    held = [
        abs(values[-1] - 1.0) <= verdict.error_bound
        for count, rows in made.items()
        for values, verdict in zip(
            rows, judge(0.5 ** np.arange(count), np.transpose(rows), members=True), strict=True
        )
        if verdict.error_bound is not None
    ]
    assert len(held) > 40
    assert np.mean(held) >= 0.95


@pytest.mark.parametrize("digits", [4, 6, 8, 10, 12, 14])
@pytest.mark.parametrize(("rule", "reason"), [(gauss, "exact"), (simpson, "asymptotic")])
def test_an_exact_value_that_is_written_with_few_digits_is_no_wrong_limit(
    rule: Callable[[int], float], reason: str, digits: int
) -> None:
    cells = [8, 16, 32, 64]
    values = [rule(n) for n in cells]
    exact = float(f"{ERF:.{digits}g}")
    verdict = judge([1 / n for n in cells], values, exact=exact, order=4)
    assert (verdict.status, verdict.reason) == ("PASS", reason)
    said = "agree with all digits of the exact value" in verdict.sentence
    assert said >= (abs(values[-1] - ERF) < abs(exact - ERF))
    assert abs(values[-1] - (ERF if said else exact)) <= verdict.error_bound


def test_step_sizes_of_few_digits_are_suspected_where_they_may_move_the_order() -> None:
    cells = [15, 30, 60, 120]
    values = [midpoint(n) for n in cells]
    rounded = [0.067, 0.033, 0.017, 0.0083]
    known = judge(rounded, values, order=2, exact=ERF)
    assert known.status == "PASS"
    assert "higher order is still seen" not in known.sentence
    assert "step sizes were rounded" in known.sentence
    unknown = judge(rounded, values, order=2)
    assert unknown.status == "INCONCLUSIVE"
    assert unknown.advice.startswith("Give h with more digits")
    assert "rounded" not in judge([1 / n for n in cells], values, order=2).sentence
    assert "rounded" not in judge([0.4, 0.2, 0.1], [1.3, 1.2, 1.15], order=2).sentence


def test_zeros_at_the_end_of_an_exact_value_are_digits_where_they_are_seen() -> None:
    h = [0.1, 0.05, 0.025, 0.0125]
    values = [
        -0.44357554757127554,
        -0.4461202306407154,
        -0.4467527962921832,
        -0.4469107056676419,
    ]
    verdict = judge(h, values, order=2, exact=Decimal("-0.4470"))
    assert verdict.status == "PASS"
    assert "agree with all digits of the exact value" in verdict.sentence
    assert judge(h, values, order=2, exact=Decimal("-0.44700")).reason == "wrong_limit"
    assert judge(h, values, order=2, exact=-0.4470).reason == "wrong_limit"


@pytest.mark.parametrize("exact", [0.7469, 0.746825, 0.74682414, 0.7, 0.75])
def test_an_exact_value_that_differs_in_its_last_digit_is_a_wrong_limit(exact: float) -> None:
    cells = [8, 16, 32, 64]
    verdict = judge([1 / n for n in cells], [simpson(n) for n in cells], exact=exact)
    assert verdict.reason == "wrong_limit"


@pytest.mark.parametrize("count", [4, 5, 6])
def test_the_interval_of_an_order_that_is_no_multiple_of_a_half_holds_it(count: int) -> None:
    # as at the corners of a domain: a second power behind the first moves the measured order
    powers = ((4 / 3, 2.0), (2 / 3, 4 / 3), (5 / 3, 2.0), (1.25, 2.25))
    cases = [(p, q, part) for p, q in powers for part in (-0.2, -0.1, 0.05, 0.3)]
    h = 0.1 * 0.5 ** np.arange(count)
    values = [1.0 + 0.7 * h**p + part * h**q for p, q, part in cases]
    found = judge(h, np.transpose(values), members=True)
    for (p, *_), verdict in zip(cases, found, strict=True):
        if verdict.status == "PASS":
            assert verdict.order_low <= p <= verdict.order_high


@pytest.mark.parametrize("count", [3, 4, 5])
@pytest.mark.parametrize("order", [None, 1.0])
def test_of_levels_that_do_not_approach_each_other_no_error_is_stated(
    order: float | None, count: int
) -> None:
    h = 0.1 * 0.5 ** np.arange(count)
    grows, falls = (judge(h, values, order=order) for values in (np.log(1.0 / h), 1.0 + h**0.5))
    assert grows.status == "INCONCLUSIVE"
    assert (grows.error, grows.best) == (None, None)
    assert "error of the finest level" not in grows.text
    assert falls.error == pytest.approx(h[-1] ** 0.5, rel=0.05)


@pytest.mark.parametrize("order", [2, 3, 4])
def test_an_error_that_rises_again_contradicts_the_levels_before(order: int) -> None:
    """The finest level is wrong by ten times the error of the one before, and by another shape."""
    t = np.linspace(0.0, 1.0, 65)
    h = [1 / 64, 1 / 128, 1 / 256, 1 / 512]
    errors = [(64 * x) ** order * np.sin(3 * t) * t for x in h]
    errors[-1] = 10 * (64 * h[-2]) ** order * t * np.cos(5 * t)
    values = [1.0 + 1e-3 * error for error in errors]
    assert judge(h, values, order=order, exact=np.ones(65)).reason == "pre_asymptotic"
    # an error that stays may be a floor
    values[-1] = 1.0 + 0.1 * (values[-1] - 1.0)
    assert judge(h, values, order=order, exact=np.ones(65)).status == "PASS"
