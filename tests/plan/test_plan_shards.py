"""Shards and batches: where their borders are, what their digests cover, what a job makes."""

from __future__ import annotations

import itertools
import sys
import tracemalloc
from collections.abc import Callable
from pathlib import Path

import pytest

from vibsim.experiment import Experiment, cost
from vibsim.experiment.cost import level_cost
from vibsim.plan import Choice, Plan, load

Plans = Callable[..., Plan]
NO_SWEEP = "schemes: [central]"


def swept(plan_of: Plans, sweep: str, levels: str = "[5, 6, 7]", more: str = "") -> Plan:
    return plan_of(
        ("levels: [5, 6, 7]", f"levels: {levels}"),
        (NO_SWEEP, f"sweep: {{{sweep}}}\n{more}{NO_SWEEP}"),
    )


@pytest.fixture
def small_shards(monkeypatch: pytest.MonkeyPatch) -> None:
    """Make shards of at most four members."""
    monkeypatch.setattr(cost, "LARGEST_SHARD", 4)


def digests(plan: Plan) -> dict[str, str]:
    return {shard.path: shard.digest for shard in plan.shards}


def new(old: Plan, changed: Plan) -> set[tuple[str, int, int]]:
    before = digests(old)
    return {
        (shard.path.removeprefix("adhoc/tiny/"), shard.start, shard.stop)
        for shard in changed.shards
        if before.get(shard.path) != shard.digest
    }


def test_shards_are_whole_members_side_by_side(plan_of: Plans, small_shards: None) -> None:
    plan = swept(plan_of, "model.L: {linspace: [1, 2, 11]}")
    for level in plan.levels:
        assert [(s.index, s.start, s.stop) for s in level.shards] == [
            (0, 0, 4),
            (1, 4, 8),
            (2, 8, 11),
        ]
        assert [s.path[-13:] for s in level.shards] == [f"shard_000{n}.nc" for n in range(3)]


EXTENDED = {
    "list": ("model.L: [1, 2, 3, 4, 5]", "model.L: [1, 2, 3, 4, 5, 6, 7, 8, 9]"),
    "range": ("model.L: {range: [1, 5, 1]}", "model.L: {range: [1, 9, 1]}"),
    "random": (
        "sample: {method: random, n: 5, seed: 1, over: {model.L: [1, 2]}}",
        "sample: {method: random, n: 9, seed: 1, over: {model.L: [1, 2]}}",
    ),
    "sobol": (
        "sample: {method: sobol, n: 5, seed: 1, over: {model.L: [1, 2]}}",
        "sample: {method: sobol, n: 9, seed: 1, over: {model.L: [1, 2]}}",
    ),
    "outer axis": (
        "model.g: [1], initial.theta: [1, 2, 3, 4, 5]",
        "model.g: [1, 2], initial.theta: [1, 2, 3, 4, 5]",
    ),
}


@pytest.mark.parametrize(("before", "after"), EXTENDED.values(), ids=EXTENDED)
def test_members_added_at_the_end_leave_full_shards_alone(
    plan_of: Plans, small_shards: None, before: str, after: str
) -> None:
    old, extended = swept(plan_of, before), swept(plan_of, after)
    last = extended.cases
    assert new(old, extended) == {
        (f"level_0{level}/shard_000{n}.nc", start, stop)
        for level in (5, 6, 7)
        for n, start, stop in [(1, 4, 8), (2, 8, last)]
    }


def test_a_level_added_leaves_all_shards_alone(plan_of: Plans, small_shards: None) -> None:
    sweep = "model.L: {linspace: [1, 2, 6]}"
    found = new(swept(plan_of, sweep), swept(plan_of, sweep, "[5, 6, 7, 8]"))
    assert found == {("level_08/shard_0000.nc", 0, 4), ("level_08/shard_0001.nc", 4, 6)}


@pytest.mark.parametrize(
    "same",
    [
        "model.L: {linspace: [1, 3, 3]}",
        "model.L: {range: [1, 3, 1]}",
        "zip: {model.L: [1, 2, 3]}",
        "model.L: [1.0, '1 + 1', 3]",
    ],
)
def test_the_same_values_written_otherwise_are_the_same_simulations(
    plan_of: Plans, same: str
) -> None:
    assert new(swept(plan_of, "model.L: [1, 2, 3]"), swept(plan_of, same)) == set()


@pytest.mark.parametrize(
    "other",
    ["model.L: [1, 2, 3.0000000000000004]", "model.g: [1, 2, 3]", "model.L: [1, 3, 2]"],
)
def test_other_values_or_another_key_are_other_simulations(plan_of: Plans, other: str) -> None:
    assert len(new(swept(plan_of, "model.L: [1, 2, 3]"), swept(plan_of, other))) == 3


def test_words_are_told_apart(plan_of: Plans) -> None:
    key = "schemes.central.start"
    old = swept(plan_of, f"{key}: [centred, first_order]")
    assert new(old, swept(plan_of, f"{key}: [centred, first_order]")) == set()
    assert len(new(old, swept(plan_of, f"{key}: [first_order, centred]"))) == 3


def test_an_end_of_its_own_for_each_member_changes_every_shard(
    plan_of: Plans, small_shards: None
) -> None:
    """The time of a file is then a fraction of the end, also where its own members end together."""
    old = swept(plan_of, "time.end: [20, 20, 20, 20]")
    extended = swept(plan_of, "time.end: [20, 20, 20, 20, 21]")
    assert len(new(old, extended)) == 6


def test_the_size_of_a_shard_knows_nothing_of_the_number_of_members(plan_of: Plans) -> None:
    every = "samples: {every: 32}\n"
    sizes = [
        [
            level.shards[0].stop
            for level in swept(
                plan_of, f"model.L: {{linspace: [1, 2, {n}]}}", "[16, 20, 24]", every
            ).levels
        ]
        for n in (5000, 7000)
    ]
    assert sizes[0][1:] == sizes[1][1:]


@pytest.mark.parametrize("level", range(0, 31, 3))
@pytest.mark.parametrize("schemes", [1, 3])
@pytest.mark.parametrize("samples", [17, 1025, 2**20])
def test_a_shard_is_some_seconds_in_bounded_memory(level: int, schemes: int, samples: int) -> None:
    load = cost.LevelCost(schemes, 2**level, samples, 6, work=schemes)
    members = load.shard
    assert members & (members - 1) == 0
    work = members * schemes * 2**level * cost.MANY_SECONDS
    held = members * load.held
    if members > 1:
        assert work <= cost.SHARD_SECONDS
        assert held <= cost.SHARD_BYTES
    if members < cost.LARGEST_SHARD:
        assert 2 * work > cost.SHARD_SECONDS or 2 * held > cost.SHARD_BYTES


def test_more_evaluations_take_more_time_and_so_smaller_shards() -> None:
    ladder = [cost.work(evaluations, True) for evaluations in (1, 2, 4)]
    ladder += [cost.work(evaluations, False) for evaluations in (1, 2)]
    loads = [cost.LevelCost(1, 2**10, 17, 3, work=w, iterated=i) for w, i in ladder]
    for one, other in itertools.pairwise(loads):
        assert one.seconds(1) < other.seconds(1)
        assert one.seconds(2**16) < other.seconds(2**16)
        assert one.shard >= other.shard
    assert loads[0].shard == cost.LevelCost(1, 2**10, 17, 3, work=1.0).shard
    assert loads[0].shard > loads[-1].shard


def test_members_that_are_stepped_one_by_one_take_more_time_and_so_smaller_shards() -> None:
    for explicit, alone in itertools.product((True, False), (2.0, cost.EVENTFUL)):
        free, bound = (cost.work(1, explicit, factor) for factor in (None, alone))
        loads = [cost.LevelCost(1, 2**10, 17, 3, work=w, iterated=i) for w, i in (free, bound)]
        assert loads[0].seconds(2**16) < loads[1].seconds(2**16)
        assert loads[0].shard >= loads[1].shard


@pytest.mark.parametrize(("kind", "factor"), [("elastic_pendulum", 2.0), ("pendulum", 0.0)])
def test_several_coordinates_are_stepped_one_by_one(kind: str, factor: float) -> None:
    content = {
        "title": "t",
        "source": "s",
        "model": {"kind": kind},
        "time": {"end": 1.0},
        "levels": [5, 6, 7],
        "schemes": ["central"],
    }
    load = level_cost(Experiment.from_dict(content, name="n", collection="c"), 7)
    assert (load.work, load.iterated) == ((0.0, factor) if factor else (1.0, 0.0))


def test_every_file_is_made_by_one_job(plan_of: Plans, small_shards: None) -> None:
    for plan in (
        plan_of(),
        swept(plan_of, "model.L: [1, 2]"),
        swept(plan_of, "model.L: {linspace: [1, 2, 11]}"),
    ):
        made = [shard.path for batch in plan.batches for shard in plan.made_by(batch)]
        assert sorted(made) == sorted(shard.path for shard in plan.shards)


def test_cheap_levels_share_a_job_and_dear_ones_do_not(plan_of: Plans) -> None:
    ladder = ("[5, 6, 7]", "[5, 6, 7, 26, 27, 28]")
    common = (NO_SWEEP, "samples: common\n" + NO_SWEEP)
    batches = plan_of(ladder, common).batches
    assert [batch.levels for batch in batches] == [(5, 6, 7, 26), (27,), (28,)]
    assert all(not batch.is_divisible for batch in batches), "one member cannot be divided"
    assert batches[1].digest == plan_of(ladder, common).level(27).shards[0].digest


def test_one_heavy_shard_of_many_members_takes_all_threads(plan_of: Plans) -> None:
    plan = swept(plan_of, "model.L: {linspace: [1, 2, 200]}", "[5, 6, 20]", "samples: common\n")
    assert [(b.levels, b.is_divisible) for b in plan.batches] == [((5, 6, 20), True)]
    many = swept(plan_of, "model.L: {linspace: [1, 2, 3000]}", "[5, 6, 20]", "samples: common\n")
    assert [b.is_divisible for b in many.batches] == [False] * len(many.batches)
    assert len(many.level(20).shards) > 1


def test_an_extrapolated_solution_is_planned_where_it_is_asked_for(plan_of: Plans) -> None:
    assert plan_of().best is None
    plan = plan_of((NO_SWEEP, "output: best\n" + NO_SWEEP))
    assert plan.best == "adhoc/tiny/best.nc"
    assert plan.best in plan.files
    assert digests(plan) == digests(plan_of())
    # which names the file
    assert plan.report != plan_of().report
    other = plan_of((NO_SWEEP, "output: best\n" + NO_SWEEP), ("[5, 6, 7]", "[5, 6]"))
    assert other.extrapolation != plan.extrapolation


def test_planning_takes_as_much_work_for_a_million_members_as_for_a_hundred(plan_of: Plans) -> None:
    grid = "initial.theta: {linspace: [0, 3, %d]}, initial.omega: {linspace: [0, 3, %d]}"

    def calls(points: int) -> int:
        number = 0

        def count(_frame: object, _event: str, _argument: object) -> None:
            nonlocal number
            number += 1

        file = Path(swept(plan_of, grid % (points, points), "[6, 7, 8, 9]").file)
        sys.setprofile(count)
        try:
            assert load(Choice("adhoc", file)).cases == points**2
        finally:
            sys.setprofile(None)
        return number

    few = min(calls(10), calls(10))
    assert calls(1000) < 2 * few


def test_a_cached_plan_of_a_million_members_needs_no_array(
    plan_of: Plans, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("VIBSIM_CACHE_DIR", str(tmp_path / "cache"))
    file = Path(swept(plan_of, "model.L: {linspace: [1, 2, 1000000]}").file)
    built = load(Choice("adhoc", file), cached=True)
    tracemalloc.start()
    try:
        assert load(Choice("adhoc", file), cached=True) == built
        # one number for each member would be 8 MB
        assert tracemalloc.get_traced_memory()[1] < 4_000_000
    finally:
        tracemalloc.stop()
