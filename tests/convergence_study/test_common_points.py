"""How levels are brought to common points: subsets, averages of cells, interpolation, in any dimension."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import xarray
from numpy.typing import NDArray

from vibsim import InputError, LadderVerdict, judge
from vibsim.convergence.study.restriction import polynomials

Array = NDArray[np.float64]
COUNTS = [8, 16, 32, 64]
H = [1.0 / n for n in COUNTS]


def nodes(n: int) -> Array:
    return np.linspace(0.0, 1.0, n + 1)


def centres(n: int) -> Array:
    return (np.arange(n) + 0.5) / n


def wave(x: Array, h: float, order: float) -> Array:
    """A smooth function with a smooth error of one power."""
    return np.asarray(np.sin(3 * x) + np.cos(5 * x) * h**order)


def levels(
    points: Callable[[int], Array], power: float, counts: list[int] = COUNTS, **more: Any
) -> LadderVerdict:
    h = [1.0 / n for n in counts]
    values = [
        xarray.DataArray(wave(points(n), 1.0 / n, power), {"x": points(n)}, ["x"], name="T")
        for n in counts
    ]
    return judge(h, values, **more)


def arrays(points: Callable[[int], Array], order: float, counts: list[int] = COUNTS) -> list[Array]:
    return [wave(points(n), 1.0 / n, order) for n in counts]


def test_points_from_end_to_end_nest_by_their_number() -> None:
    verdict = judge(H, arrays(nodes, 2.0), order=2)
    assert verdict.status == "PASS"
    assert verdict.order == pytest.approx(2.0)
    assert verdict.values.shape == (4, 9)
    irregular = [4, 8, 24, 48]
    verdict = judge([1 / n for n in irregular], arrays(nodes, 2.0, irregular), order=2)
    assert verdict.order == pytest.approx(2.0)


def test_points_of_a_periodic_grid_nest_by_their_number() -> None:
    values = arrays(lambda n: np.arange(n) / n, 2.0)
    assert judge(H, values, order=2).status == "PASS"
    cells = judge(H, arrays(centres, 2.0), order=2)
    assert cells.status != "PASS", "centres of cells have no points in common"
    assert "restrict: mean" in cells.advice


def test_numbers_of_points_that_do_not_nest_are_refused() -> None:
    counts = [32, 52, 84]
    h = [1 / n for n in counts]
    with pytest.raises(InputError, match=r"axis 0: lengths \[33, 53, 85\].*restrict: linear"):
        judge(h, arrays(nodes, 2.0, counts), order=2)
    assert judge(h, arrays(nodes, 2.0, counts), order=2, restrict="cubic").status == "PASS"


def test_coordinates_say_which_points_are_common() -> None:
    verdict = levels(nodes, 2.0, order=2)
    assert verdict.status == "PASS"
    assert verdict.quantity == "T"
    assert np.array_equal(verdict.coords["x"], nodes(8))
    # thirds and halves: only the points of the common divisor
    some = levels(nodes, 2.0, [4, 6, 8], order=2)
    assert some.coords["x"].tolist() == [0.0, 0.5, 1.0]
    assert some.order == pytest.approx(2.0)
    # an odd factor has the centres in common
    odd = levels(centres, 2.0, [4, 12, 36], order=2)
    assert np.allclose(odd.coords["x"], centres(4))
    assert odd.status == "PASS"


def test_coordinates_may_differ_by_rounding_only() -> None:
    def shifted(by: float) -> Callable[[int], Array]:
        return lambda n: nodes(n) + (by / n if n == 16 else 0.0)

    assert levels(shifted(1e-10), 2.0, order=2).values.shape == (4, 9)
    with pytest.raises(InputError, match="no point in common"):
        levels(shifted(1e-8), 2.0, order=2)
    with pytest.raises(InputError, match="no point in common"):
        levels(centres, 2.0, order=2)

    def accumulated(n: int) -> Array:
        t = np.zeros(n + 1)
        for k in range(n):
            t[k + 1] = t[k] + 1.0 / n
        return t

    assert levels(accumulated, 2.0, [10, 100, 1000], order=2).values.shape == (3, 11)


def test_coordinates_may_descend_or_be_single_precision() -> None:
    assert levels(lambda n: nodes(n)[::-1], 2.0, order=2).status == "PASS"
    single = [
        xarray.DataArray(wave(nodes(n), 1 / n, 2), {"x": nodes(n).astype("f4")}, ["x"])
        for n in (10, 20, 30)
    ]
    assert judge([0.1, 0.05, 1 / 30], single, order=2).values.shape == (3, 11)


def test_averages_of_cells_are_exact_for_averages() -> None:
    def average(n: int, order: float) -> Array:
        edges = nodes(n)
        means = -np.diff(np.cos(3 * edges)) / 3 * n
        return np.asarray(means + np.diff(np.sin(5 * edges)) / 5 * n * (1 / n) ** order)

    for order in (1.0, 2.0, 3.0):
        verdict = judge(H, [average(n, order) for n in COUNTS], order=order, restrict="mean")
        assert verdict.status == "PASS"
        assert verdict.order == pytest.approx(order)
    coarse = [xarray.DataArray(average(n, 2.0), {"x": centres(n)}, ["x"], name="T") for n in COUNTS]
    exact = judge(H, coarse, order=2, restrict="mean", exact=lambda x: np.sin(3 * x))
    assert exact.status == "PASS", "the function is averaged over the cells"
    edges = nodes(8)
    part = (np.sin(5 * edges[1:]) - np.sin(5 * edges[:-1])) / 5 * 8 * H[-1] ** 2
    assert exact.error == pytest.approx(np.sqrt(np.mean(part**2)), rel=1e-6)
    with pytest.raises(InputError, match="must be a multiple"):
        judge([1, 0.5, 0.3], [np.ones(8), np.ones(16), np.ones(20)], restrict="mean")


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "own"), [("linear", 2), ("cubic", 4)])
def test_an_order_is_not_believed_from_that_of_the_interpolation_on(kind: str, own: int) -> None:
    counts = [16, 37, 83, 190, 431]
    h = [1 / n for n in counts]
    below = judge(h, arrays(nodes, 1.0, counts), order=1, restrict=kind)
    assert below.status == "PASS"
    above = judge(h, arrays(nodes, own + 1.0, counts), order=own + 1, restrict=kind)
    assert above.status == "INCONCLUSIVE"
    if above.order is not None and above.order >= own - 0.1:
        assert above.reason == "not_applicable"
        assert f"{kind} interpolation to common points has order {own}" in above.sentence
    assert judge(h, arrays(nodes, 5.0, counts), restrict=kind).status == "INCONCLUSIVE"


def test_interpolation_is_by_the_points_on_either_side() -> None:
    """Two of them as numpy's; four as the cubic through them, which is exact for x^3."""
    random = np.random.default_rng(4)
    points, targets = np.sort(random.uniform(0.0, 1.0, 12)), random.uniform(0.3, 0.7, 30)
    values = random.normal(size=12)
    weights, indices, _ = polynomials(targets, points, 2, 0.0)
    found = np.sum(weights * values[indices], axis=1)
    np.testing.assert_allclose(found, np.interp(targets, points, values), rtol=1e-12)
    weights, indices, _ = polynomials(targets, points, 4, 0.0)
    behind = np.searchsorted(points, targets)
    np.testing.assert_array_equal(indices, behind[:, None] + np.array([-2, -1, 0, 1]))
    np.testing.assert_allclose(np.sum(weights * points[indices] ** 3, axis=1), targets**3)


def test_interpolation_at_points_of_a_level_changes_nothing() -> None:
    for kind in ("linear", "cubic"):
        verdict = judge(H, arrays(nodes, 4.0), order=4, restrict=kind)
        assert verdict.status == "PASS", "the points are common, so that nothing is interpolated"
        assert verdict.values.shape == (4, COUNTS[0] + 1)
        assert verdict.order == pytest.approx(4.0, abs=1e-6)


def test_an_interpolation_needs_points_and_a_common_range() -> None:
    far = [xarray.DataArray(np.ones(9), {"x": nodes(8) + shift}, ["x"]) for shift in (0, 2, 4)]
    with pytest.raises(InputError, match="cover no common range"):
        judge([3, 2, 1], far, restrict="linear")
    with pytest.raises(InputError, match="needs 4 points"):
        judge([3, 2, 1], [np.ones(2), np.ones(3), np.ones(5)], restrict="cubic")
    half = [xarray.DataArray(wave(x, h, 2), {"x": x}, ["x"]) for x, h in (
        (nodes(40), 1 / 4), (nodes(60) * 0.51, 1 / 6), (nodes(90), 1 / 9))]  # fmt: skip
    assert judge([1 / 4, 1 / 6, 1 / 9], half, restrict="cubic").values.shape == (3, 21)


def plane(n: int, m: int, h: float) -> xarray.DataArray:
    x, y = nodes(n), nodes(m)
    values = np.sin(x)[:, None] * np.cos(y) + h**2 * np.exp(x)[:, None] * y
    return xarray.DataArray(values, {"x": x, "y": y}, ["x", "y"], name="T")


def test_fields_of_two_dimensions_are_compared_at_common_points() -> None:
    fields = [plane(n, n // 2, 1 / n) for n in COUNTS]
    verdict = judge(H, fields, order=2)
    assert verdict.status == "PASS"
    assert verdict.values.shape == (4, 9, 5)
    assert verdict.to_dict()["best"] is None
    assert judge(H, [field.values for field in fields], order=2).order == pytest.approx(
        verdict.order
    )
    swapped = [field.T if i % 2 else field for i, field in enumerate(fields)]
    assert judge(H, swapped, order=2).order == pytest.approx(verdict.order)
    known = judge(H, fields, order=2, exact=lambda x, y: np.sin(x) * np.cos(y))
    assert known.status == "PASS"
    by_name = judge(H, fields, order=2, exact=lambda y, x: np.sin(x) * np.cos(y))
    assert by_name == known, "arguments named like the coordinates may come in any order"
    by_place = judge(H, fields, order=2, exact=lambda a, b: np.sin(a) * np.cos(b))
    assert by_place == known, "others come in the order of the dimensions"
    x, y = nodes(8), nodes(4)
    size = np.sqrt(np.mean((H[-1] ** 2 * np.exp(x)[:, None] * y) ** 2))
    assert known.error == pytest.approx(size)
    given = xarray.DataArray(np.sin(x)[:, None] * np.cos(y), {"x": x, "y": y}, ["x", "y"])
    assert judge(H, fields, order=2, exact=given.T).error == pytest.approx(size)
    assert judge(H, fields, order=2, exact=given.values).error == pytest.approx(size)
    fine = plane(64, 32, 0.0)
    assert judge(H, fields, order=2, exact=fine).error == pytest.approx(size)
    with pytest.raises(InputError, match=r"must be a function of x, y, takes \(t\)"):
        judge(H, fields, exact=lambda t: t)
    with pytest.raises(InputError, match="exact: coordinates x: must be given at the 9 common"):
        judge(H, fields, exact=given.assign_coords(x=x + 0.1))


def test_dimensions_that_are_not_refined_must_agree() -> None:
    fields = [plane(n, 4, 1 / n) for n in COUNTS]
    assert judge(H, fields, order=2, dims=["x"]).status == "PASS"
    with pytest.raises(InputError, match=r"x: lengths .*none of `dims`"):
        judge(H, fields, order=2, dims=["y"])
    with pytest.raises(InputError, match="dims: z: is no dimension of the values, which have x, y"):
        judge(H, fields, dims=["z"])
    moved = [field.assign_coords(y=nodes(4) + h) for field, h in zip(fields, H, strict=True)]
    with pytest.raises(InputError, match="y: coordinates: must be the same on every level"):
        judge(H, moved, dims=["x"])


def test_labels_and_times_are_coordinates_too() -> None:
    names = ["north", "south"]
    fields = [
        xarray.DataArray(
            np.stack([wave(nodes(n), 1 / n, 2)] * 2),
            {"place": names, "x": nodes(n)},
            ["place", "x"],
        )
        for n in COUNTS
    ]
    assert judge(H, fields, order=2).status == "PASS"
    fields[1] = fields[1].assign_coords(place=["north", "west"])
    with pytest.raises(InputError, match="place"):
        judge(H, fields, order=2)
    days = [
        xarray.DataArray(
            wave(nodes(n), 1 / n, 2),
            {"t": np.datetime64("2020-01-01T00:00:00", "ns") + np.arange(n + 1) * np.timedelta64(3600 * 64 // n, "s")},
            ["t"],
        )
        for n in COUNTS
    ]  # fmt: skip
    assert judge(H, days, order=2).status == "PASS"
    calendars = [
        day.assign_coords(
            t=xarray.date_range("2000-02-27", periods=n + 1, freq=f"{64 // n}h", calendar="noleap")
        )
        for n, day in zip(COUNTS, days, strict=True)
    ]
    assert judge(H, calendars, order=2).status == "PASS"


def test_other_dimensions_are_refused() -> None:
    a, b = plane(8, 4, 1.0), plane(16, 8, 0.5)
    with pytest.raises(InputError, match="has the dimensions x, z, the coarsest level has x, y"):
        judge([1.0, 0.5], [a, b.rename(y="z")])
    with pytest.raises(InputError, match="level 1 has none, others do"):
        judge([1.0, 0.5], [a, b.drop_vars("x")])


def test_missing_values_are_not_finite() -> None:
    values = [np.ma.masked_greater(x, 1.5) for x in arrays(nodes, 2.0)]
    values[2] = np.ma.array(values[2], mask=np.arange(33) == 8)
    verdict = judge(H, values, order=2)
    assert verdict.reason == "non_finite"
    assert "h = 0.03125" in verdict.sentence


def test_linear_interpolation_that_may_hide_an_order_is_named() -> None:
    cells, levels = (12, 18, 27, 40, 60), []
    for n in cells:
        x = (np.arange(n) + 0.5) / n
        values = np.sin(2.0 * x) + np.exp(-x) + (1.0 + 0.3 * np.cos(2.0 * x)) / n
        levels.append(xarray.DataArray(values, {"x": x}, ["x"]))
    h = [1.0 / n for n in cells]
    verdict = judge(h, levels, order=1, restrict="linear")
    assert verdict.status == "INCONCLUSIVE"
    assert verdict.advice.endswith("may hide the order. Use restrict: cubic.")
    cubic = judge(h, levels, order=1, restrict="cubic")
    assert (cubic.status, cubic.advice) == ("PASS", "")


@pytest.mark.parametrize(("kind", "counts"), [("f8", (4000, 8000, 16000)), ("f4", (90, 180, 360))])
def test_times_summed_step_by_step_are_the_same_on_all_levels(
    kind: str, counts: tuple[int, ...]
) -> None:
    """After n sums of t + dt a time is off by up to n units of its last digit."""
    levels = []
    for n in counts:
        t = np.cumsum(np.array([0.0, *[10.0 / n] * n], dtype=kind), dtype=kind)
        u = np.sin(np.linspace(0.0, 3.0, n + 1)) * (1 + n**-2.0)
        levels.append(xarray.DataArray(u, {"t": t}, ["t"], name="u"))
    verdict = judge([1 / n for n in counts], levels, order=2)
    assert "in common" not in verdict.sentence


@pytest.mark.parametrize("times", [(0.0, 0.3, 0.6), (0.3,)])
@pytest.mark.parametrize("dims", [None, ["x"]])
def test_an_exact_function_is_averaged_only_where_the_levels_are(
    times: tuple[float, ...], dims: list[str] | None
) -> None:
    """Cell averages in x at times that all levels have: an average over time misses the exact solution."""
    t, levels = np.array(times), []
    for n in COUNTS:
        means = -np.diff(np.cos(2 * nodes(n))) / 2 * n * (1 + n**-2.0)
        field = np.exp(-t)[:, None] * means
        levels.append(xarray.DataArray(field, {"t": t, "x": centres(n)}, ["t", "x"]))

    def exact(t: np.ndarray, x: np.ndarray) -> np.ndarray:
        return np.exp(-t) * np.sin(2 * x)

    verdict = judge(H, levels, order=2, restrict="mean", dims=dims, exact=exact)
    assert verdict.status == "PASS"


def test_means_need_cells_of_one_width_within_the_coarse_ones() -> None:
    counts = [8, 16, 32, 64]

    def field(n: int, edges: np.ndarray) -> xarray.DataArray:
        x = 0.5 * (edges[1:] + edges[:-1])
        values = (np.cos(edges[:-1]) - np.cos(edges[1:])) / np.diff(edges) + n**-2.0 * np.exp(x)
        return xarray.DataArray(values, {"x": x}, ["x"])

    def judged(*levels: xarray.DataArray) -> LadderVerdict:
        return judge([1 / n for n in counts], levels, order=2, restrict="mean", exact=np.sin)

    even = [field(n, np.linspace(0.0, 1.0, n + 1)) for n in counts]
    assert judged(*even).status == "PASS"
    rounded = [one.assign_coords(x=np.round(one.x, 6)) for one in even]
    assert judged(*rounded).status == "PASS"
    stretched = [field(n, np.linspace(0.0, 1.0, n + 1) ** 2) for n in counts]
    wider = [even[0], *(field(n, np.linspace(0.0, 1.3, n + 1)) for n in counts[1:])]
    nodes = [one.assign_coords(x=np.arange(n) / n) for one, n in zip(even, counts, strict=True)]
    for levels in (stretched, wider, nodes, [*even[:2], even[2][::-1], even[3]]):
        with pytest.raises(InputError, match="mean needs cells of one width"):
            judged(*levels)


@pytest.mark.parametrize("lengths", [(9, 17, 33, 1), (1, 3, 1, 2), (65, 33, 17, 9)])
def test_a_finer_level_has_no_fewer_points(lengths: tuple[int, ...]) -> None:
    with pytest.raises(InputError, match="must not have fewer points"):
        judge(H, [np.ones(n) for n in lengths])
