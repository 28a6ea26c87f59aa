"""Limits of single numbers: exact where the expansion ends, with a bound that holds where it does not.

The table that the calibration prints with ``-s`` stands in ``docs/method.md``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pytest
from synthetic import FAMILIES, groups

from vibsim.convergence.extrapolation.numbers import limit, observed_order

HELD_OUT = 2
TUNED = (1, 3)
COVERS = 0.95
EPSILON = 2.0**-52
ROUNDING = 2.0 * EPSILON
"""What a number of size 1 is known to."""
GROWTH = {"compensated": 0.0, "increment": 0.5, "three_term": 1.5}
NOTHING_TO_SEE = {"saturated", "unexpected_floor"}
"""Families whose single numbers show too little: levels that are all wrong by as much, noise that nothing predicts."""


def ladder(levels: Sequence[int], *terms: tuple[float, float], value: float = -0.7) -> np.ndarray:
    h = 2.0 ** -np.array(levels, dtype=float)
    return value + sum(c * h**p for c, p in terms)


def run(
    u: np.ndarray,
    levels: Sequence[int],
    p: float = 2.0,
    even: bool = False,
    floor: float | np.ndarray = 1e-15,
) -> tuple[float, float, int, int]:
    values = np.asarray(u)[None]
    found = limit(values, levels, np.array([p]), np.array([even]), np.full(values.shape, floor))
    first, last = int(found.first[0]), int(found.last[0])
    return float(found.value[0]), float(found.bound[0]), first, last


def test_an_order_that_one_triple_shows_by_accident_is_not_taken() -> None:
    """The tip of a driven beam: its error changes its sign between the finest levels, which looks like order 4."""
    errors = [2.0504690056e-3, 2.5803187497e-4, 1.1129076578e-5, -5.9336753499e-6]
    value, bound, *_ = run(np.array(errors) - 0.7, (1, 2, 3, 4), even=True)
    assert abs(value + 0.7) <= bound


def test_orders_on_their_way_to_the_promised_one_are_not_taken() -> None:
    """How Backward Euler damps a motion over 34 s: orders 0.26, 0.63, then 1; one triple alone shows 1/2."""
    values = [0.231817926, 0.444982614, 0.622882106, 0.737446925]
    value, bound, *_ = run(np.array(values), (7, 8, 9, 10), 1.0)
    assert abs(value - 0.873909) <= bound
    # the end of a run with Euler-Cromer: its finest triple has order 4
    value, bound, *_ = run(np.array([0.39767, 0.40201, 0.40228]), (6, 7, 8), 1.0)
    assert bound > 2.0 * abs(0.40228 - 0.40201)


def test_an_entry_is_further_off_than_the_finest_level_says() -> None:
    """An end of generalized_alpha on coarse levels; the truth is beyond what the finest level contradicts by."""
    values = [-0.08771, 0.27388, 0.37447, 0.34738]
    value, bound, *_ = run(np.array(values), (3, 4, 5, 6), 2.0)
    assert abs(value - 0.3302) <= bound


@pytest.mark.parametrize("levels", [(3, 4, 5, 6), (3, 5, 6, 8), (2, 3, 4, 5, 6, 7)])
@pytest.mark.parametrize(("p", "even"), [(1.0, False), (2.0, True), (4.0, True), (3.0, False)])
def test_two_powers_are_taken_away(levels: tuple[int, ...], p: float, even: bool) -> None:
    u = ladder(levels, (0.3, p), (0.1, p + (2 if even else 1)))
    value, bound, first, last = run(u, levels, p, even)
    finest = abs(u[-1] + 0.7)
    assert abs(value + 0.7) < 0.01 * finest + 1e-14
    assert abs(value + 0.7) <= bound < finest + 1e-13
    assert first < last


@pytest.mark.parametrize("levels", [(3, 4, 6, 7, 9), (2, 4, 5, 6, 8, 9)])
@pytest.mark.parametrize(("p", "even"), [(1.0, False), (2.0, True), (1.5, False)])
def test_powers_are_taken_away_exactly_whatever_the_gaps(
    levels: tuple[int, ...], p: float, even: bool
) -> None:
    """Where errors have three powers, the fourth row has none of them: what is left is rounding."""
    step = 2 if even else 1
    u = ladder(levels, (0.3, p), (0.1, p + step), (-0.2, p + 2 * step))
    value, bound, *_ = run(u, levels, p, even)
    assert abs(value + 0.7) < 1e-14
    assert abs(value + 0.7) <= bound


def test_the_order_that_the_levels_show_is_taken() -> None:
    levels = (4, 5, 6, 7, 8)
    u = ladder(levels, (0.3, 2.0), (0.1, 4.0))
    value, bound, *_ = run(u, levels, p=1.0)
    assert abs(value + 0.7) <= bound < 1e-2 * abs(u[-1] + 0.7)


def test_one_and_two_levels() -> None:
    value, bound, *_ = run(ladder((5,), (0.3, 2.0)), (5,))
    assert value == ladder((5,), (0.3, 2.0))[0]
    assert np.isnan(bound)
    u = ladder((5, 6), (0.3, 2.0))
    value, bound, first, last = run(u, (5, 6))
    assert (value, first, last) == (u[-1], 1, 1)
    assert bound == pytest.approx(4 * abs(u[1] - u[0]), rel=1e-10)


def test_levels_that_move_apart_bound_nothing() -> None:
    for u in ([1.0, 1.1, 1.3, 1.7], [1.0, 1.1, 0.8, 1.6], [1.0, 1.1, np.nan, np.nan]):
        value, bound, *_ = run(np.array(u), (4, 5, 6, 7))
        assert np.isnan(bound)
        assert np.array_equal(value, u[-1], equal_nan=True)


@pytest.mark.parametrize("levels", [(4, 5, 6, 7), (4, 6, 7, 11), (4, 5, 9)])
def test_levels_that_hardly_approach_each_other_bound_nothing(levels: tuple[int, ...]) -> None:
    log = np.array(levels) * 1.4
    for u in (log, ladder(levels, (0.3, 0.05))):
        assert np.isnan(run(u, levels)[1])
    value, bound, *_ = run(ladder(levels, (0.3, 0.5), (0.1, 1.5)), levels)
    assert abs(value + 0.7) <= bound


def test_levels_that_approach_each_other_raggedly_are_bounded_by_their_range() -> None:
    """Three times the range of five levels, if the last two changes are below half of those before."""
    levels = (4, 5, 6, 7, 8)
    value, bound, *_ = run(np.array([1.0, 1.8, 1.3, 1.35, 1.15]), levels)
    assert (value, bound) == (1.15, pytest.approx(3 * 0.8))
    assert np.isnan(run(np.array([0.0, 0.3, 0.35, 0.65, 0.7]), levels)[1])


def test_it_stops_at_round_off() -> None:
    levels = tuple(range(6, 24))
    rng = np.random.default_rng(5)
    u = ladder(levels, (0.3, 2.0), (0.1, 4.0)) + 1e-13 * rng.normal(size=len(levels))
    value, bound, *_ = run(u, levels, even=True, floor=1e-13)
    assert abs(value + 0.7) <= bound
    # constant but for rounding
    same = np.full(len(levels), -0.7) + 1e-15 * rng.normal(size=len(levels))
    value, bound, *_ = run(same, levels)
    assert abs(value + 0.7) <= bound < 1e-13


def test_coarse_levels_that_failed_are_left_out() -> None:
    levels = (2, 3, 4, 5, 6, 7)
    u = ladder(levels, (0.3, 2.0), (0.1, 3.0))
    u[:2] = np.nan
    value, bound, first, _ = run(u, levels)
    assert first >= 2
    assert abs(value + 0.7) <= bound < 1e-4


def test_neither_sign_nor_scale_nor_neighbours_matter() -> None:
    levels = (4, 5, 6, 7)
    rows = np.stack([ladder(levels, (c, 2.0), (0.2, 3.0)) for c in (0.3, -1.0, 0.05)])
    p, even = np.full(3, 2.0), np.zeros(3, dtype=bool)
    floor = np.full(rows.shape, 1e-15)
    whole = limit(rows, levels, p, even, floor)
    mirrored = limit(-4.0 * rows, levels, p, even, 4.0 * floor)
    np.testing.assert_array_equal(mirrored.value, -4.0 * whole.value)
    np.testing.assert_array_equal(mirrored.bound, 4.0 * whole.bound)
    alone = limit(rows[1:2], levels, p[1:2], even[1:2], floor[1:2])
    assert alone.value[0] == whole.value[1]
    assert alone.bound[0] == whole.bound[1]


def test_the_observed_order_is_that_of_the_finest_clean_triple() -> None:
    levels = (4, 5, 6, 7, 8)
    u = ladder(levels, (1.0, 2.0))
    floor = np.full(5, 1e-15)
    assert observed_order(u, levels, floor) == pytest.approx(2.0, abs=1e-9)
    u[-1] += 1.0
    floor[-1] = 1.0
    assert observed_order(u, levels, floor) == pytest.approx(2.0, abs=1e-9)
    assert np.isnan(observed_order(u, levels, np.full(5, 1.0)))


# calibration


@dataclass(frozen=True)
class Tried:
    """One ladder of numbers, and what was said of it."""

    family: str
    count: int
    error: float
    """Of the best value."""
    bound: float
    finest: float
    """Error of the finest level."""

    @property
    def known(self) -> bool:
        """Whether a bound was stated."""
        return bool(np.isfinite(self.bound))

    @property
    def held(self) -> bool:
        """Whether the error is within the bound."""
        return self.error <= self.bound + ROUNDING


def tried(seed: int) -> list[Tried]:
    """Take numbers at the end and at random times of every synthetic ladder.

    Of three in ten ladders the promised order is drawn at random, whatever the ladder has.
    """
    rng = np.random.default_rng(100 + seed)
    found = []
    for group in groups(seed):
        steps = 2.0 ** np.array(group.levels)
        floor = EPSILON * np.maximum(0.5 * steps ** GROWTH[group.arithmetic], 1.0)
        rows = []
        for one in group.ladders:
            times = [-1]
            if one.family != "scalar":
                times += list(rng.integers(1, group.points + 1, size=4))
            errors = one.errors[:, times].T
            value = rng.uniform(-1.0, 1.0)
            p = one.order if np.isfinite(one.order) else min(one.orders)
            p = float(rng.choice([1, 2, 4])) if rng.random() < 0.3 else p
            rows += [(one.family, value, p, error) for error in errors]
        families, value, p, errors = (np.array(column) for column in zip(*rows, strict=True))
        best = limit(
            value[:, None] - errors,
            group.levels,
            p,
            families == "even",
            np.broadcast_to(floor, errors.shape),
        )
        off, finest = np.abs(best.value - value), np.abs(errors[:, -1])
        numbers = (column.tolist() for column in (families, off, best.bound, finest))
        for family, *of_one in zip(*numbers, strict=True):
            found.append(Tried(family, len(group.levels), *of_one))
    print(table(found))
    return found


def table(found: list[Tried]) -> str:
    """Return what was found of every family, and of all."""
    rows = ["| family | numbers | known | coverage | bound / error | bound / error of the finest |"]
    rows.append("|---|---|---|---|---|---|")
    for name in [*FAMILIES, "all"]:
        part = [one for one in found if name in ("all", one.family)]
        known = [one for one in part if one.known]
        rows.append(
            f"| {name} | {len(part)} | {len(known) / len(part):.2f} | {coverage(known):.3f} | "
            f"{width(known, 'error'):.3g} | {width(known, 'finest'):.2g} |"
        )
    return "\n".join(rows)


def coverage(known: list[Tried]) -> float:
    return float(np.mean([one.held for one in known]))


def width(known: list[Tried], over: str) -> float:
    return float(np.median([one.bound / max(getattr(one, over), EPSILON) for one in known]))


@pytest.fixture(scope="module")
def held_out() -> list[Tried]:
    return tried(HELD_OUT)


@pytest.mark.slow
def test_bounds_hold_in_95_percent_of_a_large_random_set(held_out: list[Tried]) -> None:
    known = [one for one in held_out if one.known]
    assert len(held_out) > 10_000
    assert len(known) > 0.9 * len(held_out)
    assert coverage(known) >= COVERS
    for family in set(FAMILIES) - NOTHING_TO_SEE:
        part = [one for one in known if one.family == family]
        assert coverage(part) >= COVERS - 2 * np.sqrt(COVERS * (1 - COVERS) / len(part)), family


@pytest.mark.parametrize("count", [2, 3, 4, 5, 6, 8])
def test_bounds_hold_whatever_the_number_of_levels(held_out: list[Tried], count: int) -> None:
    part = [one for one in held_out if one.known and one.count == count]
    assert coverage(part) >= COVERS - 2 * np.sqrt(COVERS * (1 - COVERS) / len(part))


@pytest.mark.slow
def test_bounds_hold_where_levels_were_left_out() -> None:
    """The same ladders, with one or two levels less, so that their gaps differ."""
    rng = np.random.default_rng(79)
    held = []
    for group in groups(HELD_OUT):
        count = len(group.levels)
        if count < 4:
            continue
        kept = np.sort(rng.choice(count, size=max(3, count - rng.integers(1, 3)), replace=False))
        levels = tuple(np.array(group.levels)[kept].tolist())
        if len(set(np.diff(levels))) == 1:
            continue
        floor = EPSILON * np.maximum(
            0.5 * (2.0 ** np.array(levels)) ** GROWTH[group.arithmetic], 1.0
        )
        errors = np.array([one.errors[kept][:, -1] for one in group.ladders])
        p = [one.order if np.isfinite(one.order) else min(one.orders) for one in group.ladders]
        even = np.array([one.family == "even" for one in group.ladders])
        floors = np.broadcast_to(floor, errors.shape)
        best = limit(0.37 - errors, levels, np.array(p), even, floors)
        known = np.isfinite(best.bound)
        held += (np.abs(best.value - 0.37) <= best.bound + ROUNDING)[known].tolist()
    assert len(held) > 1000
    assert np.mean(held) >= COVERS


def test_bounds_are_narrow_on_clean_ladders(held_out: list[Tried]) -> None:
    clean = [o for o in held_out if o.family == "clean_two_term" and o.known and o.count > 3]
    assert width(clean, "finest") < 0.01
    assert width([one for one in held_out if one.known and one.count == 4], "finest") < 0.25


@pytest.mark.slow
def test_the_tuned_half_has_the_same_rates() -> None:
    assert coverage([one for seed in TUNED for one in tried(seed) if one.known]) >= COVERS
