from __future__ import annotations

import tracemalloc
from decimal import Decimal, localcontext
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from thinned import thinned

from vibsim.analysis import analyse_records, verdicts
from vibsim.experiment import Experiment, storage, sweep_columns
from vibsim.experiment.storage import SMALL
from vibsim.schemes import SCHEMES
from vibsim.simulation import simulate_record


def experiment(**changes: Any) -> Experiment:
    content = {
        "title": "A pendulum",
        "model": {"kind": "pendulum"},
        "initial": {"theta": 1.0},
        "time": {"end": 20.0, "base_steps": changes.pop("base", 1)},
        "levels": [6, 7, 9],
        "schemes": ["central"],
    }
    return Experiment.from_dict({**content, **changes})


def test_without_a_sweep_there_is_one_member_and_no_column() -> None:
    assert experiment().members == 1
    assert sweep_columns.columns(experiment(), 0, 1) == {}


def test_a_grid_runs_through_its_last_key_first() -> None:
    grid = experiment(sweep={"initial.theta": [0.1, 0.2], "model.g": [1.0, 2.0, 3.0]})
    found = sweep_columns.columns(grid, 0, 6)
    assert grid.members == 6
    np.testing.assert_array_equal(found["initial.theta"], [0.1, 0.1, 0.1, 0.2, 0.2, 0.2])
    np.testing.assert_array_equal(found["model.g"], [1, 2, 3, 1, 2, 3])


def test_members_do_not_depend_on_the_range_that_is_asked() -> None:
    sweep = {
        "model.L": {"linspace": [1, 5, 5]},
        "initial.theta": {"linspace": [0.1, 3.0, 7]},
    }
    grid = experiment(sweep=sweep)
    whole = sweep_columns.columns(grid, 0, 35)
    for start, stop in ((0, 1), (3, 11), (34, 35), (12, 12)):
        part = sweep_columns.columns(grid, start, stop)
        for key, values in part.items():
            np.testing.assert_array_equal(values, whole[key][start:stop])


LINE = {"linspace": [0.1, 0.7, 7]}
SAMPLE = {"n": 37, "seed": 5, "over": {"model.g": [1, 2], "initial.omega": [-1, 3]}}
METHODS = ["latin_hypercube", "sobol", "random"]
SWEEPS: list[dict[str, Any]] = [
    {"model.L": [3.0, 1.0, 2.0], "initial.theta": LINE, "model.m": [1.0, 2.0]},
    {"initial.theta": {"logspace": [0.1, 3.0, 50]}, "model.L": {"range": [1, 2, 0.3]}},
    {"zip": {"model.L": {"range": [1, 7, 1]}, "initial.theta": LINE}, "model.m": [1.0, 2.0]},
    {"schemes.central.start": ["first_order", "centred"], "initial.theta": LINE},
    *({"sample": SAMPLE | {"method": method}} for method in METHODS),
    *({"model.m": [1.0, 2.0], "sample": SAMPLE | {"method": m}, "model.L": [1]} for m in METHODS),
]


@pytest.mark.parametrize("sweep", thinned(SWEEPS, 2))
def test_every_range_of_members_is_that_part_of_the_whole(sweep: dict[str, Any]) -> None:
    grid = experiment(sweep=sweep)
    whole = sweep_columns.columns(grid, 0, grid.members)
    assert {len(values) for values in whole.values()} == {grid.members}
    for start in range(grid.members + 1):
        for stop in {start, start + 1, start + 5, start + 9, grid.members}:
            part = sweep_columns.columns(grid, start, min(stop, grid.members))
            assert list(part) == list(whole)
            for key, values in part.items():
                np.testing.assert_array_equal(values, whole[key][start:stop])


def one(rule: Any, key: str = "initial.theta") -> NDArray[np.float64]:
    grid = experiment(levels=[1], sweep={key: rule})
    return sweep_columns.columns(grid, 0, grid.members)[key]


def test_a_line_is_its_formula_with_exact_ends() -> None:
    first, last, n = 0.7, 0.1, 1001
    assert first + (last - first) != last
    found = one({"linspace": [first, last, n]})
    inner = [first + (last - first) * i / (n - 1) for i in range(n - 1)]
    assert list(found) == [*inner, last]


@pytest.mark.parametrize(
    ("first", "last", "n"),
    [(1.0, 1024.0, 11), (0.1, 3.0, 200), (5e-324, 1.7e308, 50), (7.0, 1e-3, 33), (2.0, 2.0, 5)],
)
def test_powers_are_rounded_once(first: float, last: float, n: int) -> None:
    """Found another way, with 200 digits: the logarithm is linear, each value is worked out by itself."""
    found = one({"logspace": [first, last, n]})
    assert (found[0], found[-1], len(found)) == (first, last, n)
    with localcontext() as context:
        context.prec = 200
        low, high = Decimal(first).ln(), Decimal(last).ln()
        exact = [float((low + (high - low) * i / (n - 1)).exp()) for i in range(n)]
    np.testing.assert_array_equal(found[1:-1], exact[1:-1])


def test_powers_of_two_are_exact() -> None:
    assert list(one({"logspace": [1, 1024, 11]})) == [2.0**i for i in range(11)]


def test_a_range_is_its_formula_and_grows_at_its_end() -> None:
    found = one({"range": [0.1, 2.0, 0.1]})
    assert list(found) == [0.1 + i * 0.1 for i in range(20)]
    longer = one({"range": [0.1, 3.0, 0.1]})
    np.testing.assert_array_equal(longer[:20], found)
    assert list(one({"range": [1, 0, -0.25]})) == [1, 0.75, 0.5, 0.25, 0]


@pytest.mark.parametrize("method", ["sobol", "random"])
def test_points_that_are_added_leave_the_first_ones_alone(method: str) -> None:
    few, many = (
        sweep_columns.columns(
            experiment(sweep={"sample": SAMPLE | {"method": method, "n": n}}), 0, n
        )
        for n in (37, 300)
    )
    for key, values in few.items():
        np.testing.assert_array_equal(many[key][:37], values)


@pytest.mark.parametrize("method", METHODS)
def test_points_fill_their_box(method: str) -> None:
    def draw(seed: int, n: int = 2**12) -> dict[str, NDArray[np.float64]]:
        sample = SAMPLE | {"method": method, "n": n, "seed": seed}
        return sweep_columns.columns(experiment(levels=[1], sweep={"sample": sample}), 0, n)

    found, again, other = draw(5), draw(5), draw(6)
    bounds = SAMPLE["over"]
    assert isinstance(bounds, dict)
    unit = []
    for key, (low, high) in bounds.items():
        np.testing.assert_array_equal(found[key], again[key])
        assert np.mean(found[key] == other[key]) < 0.01
        assert low <= found[key].min() <= found[key].max() <= high
        unit.append((found[key] - low) / (high - low))
    # 2^12 independent numbers: the mean of each has a standard deviation of 12^(-1/2)/64, a count of
    # 2^8 in a sixteenth of the square one of 16, the correlation one of 1/64; five of each are allowed
    assert np.abs(np.mean(unit, axis=1) - 0.5).max() < 5 / 64 / np.sqrt(12)
    counts = np.histogram2d(*unit, bins=4, range=[[0, 1], [0, 1]])[0]
    assert np.abs(counts - 2**8).max() <= 5 * 16
    assert abs(np.corrcoef(unit)[0, 1]) < 5 / 64
    if method != "random":
        # each of 2^12 strips of either axis holds one point
        strips = np.floor(np.array(unit) * 2**12).astype(int)
        assert [len(set(row)) for row in strips] == [2**12] * 2


def test_random_numbers_are_those_of_the_generator() -> None:
    """Row by row from one stream, whatever numpy does with it later: pinned."""
    grid = experiment(sweep={"sample": SAMPLE | {"method": "random"}})
    found = sweep_columns.columns(grid, 0, 37)
    drawn = np.random.Generator(np.random.Philox(key=5)).random((37, 2))
    np.testing.assert_array_equal(found["model.g"], 1.0 + drawn[:, 0])
    np.testing.assert_array_equal(found["initial.omega"], -1.0 + 4.0 * drawn[:, 1])


@pytest.mark.parametrize(
    "sweep",
    [
        {"model.g": {"linspace": [1, 2, 10**6]}},
        {"model.g": {"logspace": [1, 2, 10**6]}},
        {"model.g": {"range": [1, 2, 1e-6]}},
        {"model.g": {"linspace": [1, 2, 10**3]}, "model.L": {"logspace": [1, 2, 10**3]}},
        {"sample": SAMPLE | {"method": "sobol", "n": 10**6}},
        {"sample": SAMPLE | {"method": "random", "n": 10**6}},
    ],
)
def test_a_few_of_a_million_members_take_no_memory(sweep: dict[str, Any]) -> None:
    """A column of all of them takes 8 MB."""
    grid = experiment(levels=[1], sweep=sweep)
    sweep_columns.columns(grid, 0, 1)
    tracemalloc.start()
    found = sweep_columns.columns(grid, 999_980, 10**6)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert {len(values) for values in found.values()} == {20}
    assert peak < 300_000


def test_options_come_in_groups() -> None:
    schemes = ["central", {"kind": "central", "label": "trap", "arithmetic": "increment"}]
    start, velocity = ["first_order", "centred", "first_order"], ["kick", "kick", "backward"]
    together = {"schemes.trap.start": start, "schemes.trap.end_velocity": velocity}
    grid = experiment(schemes=schemes, sweep={"zip": together, "model.g": [1.0, 2.0]})
    columns = sweep_columns.columns(grid, 1, 6)
    base = dict(grid.schemes[1].options)
    ((options, members),) = sweep_columns.option_groups(grid, 0, columns)
    assert options == grid.schemes[0].options
    assert list(members) == [0, 1, 2, 3, 4]
    groups = sweep_columns.option_groups(grid, 1, columns)
    expected = [
        ({**base, "start": "first_order", "end_velocity": "kick"}, [0]),
        ({**base, "start": "centred", "end_velocity": "kick"}, [1, 2]),
        ({**base, "start": "first_order", "end_velocity": "backward"}, [3, 4]),
    ]
    assert [(dict(options), list(members)) for options, members in groups] == expected
    types = {name: type(value) for name, value in SCHEMES["central"].defaults().items()}
    for options, _ in groups:
        assert {name: type(value) for name, value in options.items()} == types


def test_without_swept_options_there_is_one_group() -> None:
    ((options, members),) = sweep_columns.option_groups(experiment(), 0, {})
    assert options == experiment().schemes[0].options
    assert list(members) == [0]
    swept = experiment(sweep={"model.g": [1.0, 2.0]})
    ((_, members),) = sweep_columns.option_groups(swept, 0, sweep_columns.columns(swept, 0, 2))
    assert list(members) == [0, 1]
    assert [
        len(m) for _, m in sweep_columns.option_groups(swept, 0, sweep_columns.columns(swept, 1, 1))
    ] == [0]


@pytest.mark.parametrize("samples", ["auto", "common", "all"])
@pytest.mark.parametrize("base", [1, 3, 7])
def test_the_common_grid_and_the_end_are_always_kept(samples: str, base: int) -> None:
    e = experiment(samples=samples, base=base)
    for level in e.levels:
        every = storage.sampling(e, level)
        kept = set(range(0, e.steps(level) + 1, every))
        common = e.steps(level) // e.steps(e.levels[0])
        assert set(range(0, e.steps(level) + 1, common)) <= kept
        assert e.steps(level) in kept
        if samples == "all":
            assert every == 1
        if samples == "common":
            assert every == common


@pytest.mark.parametrize(("base", "n"), [(1, 1), (1, 16), (3, 3), (3, 24), (7, 7 * 64)])
def test_every_nth_step_is_every_nth_step_of_each_level(base: int, n: int) -> None:
    e = experiment(samples={"every": n}, base=base)
    assert [storage.sampling(e, level) for level in e.levels] == [n] * 3


@pytest.mark.parametrize(("base", "n"), [(3, 3), (1, 8), (5, 10)])
def test_levels_with_every_nth_step_are_compared_where_they_meet(base: int, n: int) -> None:
    """The comparison is that of a run which stores every step, at every n-th of its times."""
    check = {"converges": "theta", "order": 2, "tolerance": 0.2}
    at = {"value": "at", "quantity": "theta", "at": {"step": 2 * n, "level": 9}, "below": 10}
    best = {"value": "end", "quantity": "theta", "at": {"best": True}, "below": 10}
    found, verdict = {}, {}
    for samples in ("all", {"every": n}):
        e = experiment(samples=samples, base=base, levels=[6, 7, 8, 9], checks=[check, at, best])
        records = {level: simulate_record(e, level) for level in e.levels}
        found[str(samples)] = analyse_records(e, records)
        verdict[str(samples)] = verdicts(e, found[str(samples)])
    whole, part = found.values()
    assert len(part["t"]) == base * 64 // n + 1
    np.testing.assert_array_equal(part["t"], whole["t"][::n])
    for name in ("theta_difference", "theta_error", "theta_richardson"):
        np.testing.assert_array_equal(part[name], whole[name][..., ::n])
    for name in ("check_check_2_value", "check_check_3_value"):
        np.testing.assert_array_equal(part[name], whole[name])
    assert [[v.status for v in one] for one in verdict.values()] == [["PASS"] * 3] * 2


def test_auto_keeps_everything_while_it_is_small() -> None:
    members = 10
    steps = SMALL // members - 1
    sweep = {"model.L": {"linspace": [1, 2, members]}}
    small = experiment(levels=[0, 1], base=steps // 2, sweep=sweep)
    assert members * (small.steps(1) + 1) <= SMALL
    assert storage.sampling(small, 1) == 1
    large = experiment(levels=[0, 1], base=steps, sweep=sweep)
    assert storage.sampling(large, 1) == 2
    assert storage.sampling(large, 0) == 1
