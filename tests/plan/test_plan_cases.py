from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from vibsim import plan
from vibsim.spec.sampling import SMALL


def experiment(**changes: Any) -> Any:
    """Return a stand-in with what the plan of members and samples reads."""
    base = changes.pop("base", 1)
    content = {
        "levels": (6, 7, 9),
        "schemes": ("central",),
        "sweep": None,
        "samples": "auto",
        "steps": lambda level: base * 2**level,
    }
    return SimpleNamespace(**{**content, **changes})


def sweep(*axes: tuple[str, tuple[float, ...]]) -> Any:
    return SimpleNamespace(axes=axes, count=int(np.prod([len(values) for _, values in axes])))


def test_without_a_sweep_there_is_one_member_and_no_column() -> None:
    assert plan.count(experiment()) == 1
    assert plan.columns(experiment(), 0, 1) == {}


def test_a_grid_runs_through_its_last_key_first() -> None:
    grid = experiment(sweep=sweep(("initial.theta", (0.1, 0.2)), ("model.g", (1.0, 2.0, 3.0))))
    found = plan.columns(grid, 0, 6)
    assert plan.count(grid) == 6
    np.testing.assert_array_equal(found["initial.theta"], [0.1, 0.1, 0.1, 0.2, 0.2, 0.2])
    np.testing.assert_array_equal(found["model.g"], [1, 2, 3, 1, 2, 3])


def test_members_do_not_depend_on_the_range_that_is_asked() -> None:
    grid = experiment(sweep=sweep(("a", tuple(range(5))), ("b", tuple(range(7)))))
    whole = plan.columns(grid, 0, 35)
    for start, stop in ((0, 1), (3, 11), (34, 35), (12, 12)):
        part = plan.columns(grid, start, stop)
        for key, values in part.items():
            np.testing.assert_array_equal(values, whole[key][start:stop])


@pytest.mark.parametrize("samples", ["auto", "common", "all", 1, 2, 3, 6, 7, 1000])
@pytest.mark.parametrize("base", [1, 3, 7])
def test_the_common_grid_and_the_end_are_always_kept(samples: str | int, base: int) -> None:
    e = experiment(samples=samples, base=base)
    for level in e.levels:
        every = plan.sampling(e, level)
        kept = set(range(0, e.steps(level) + 1, every))
        common = e.steps(level) // e.steps(e.levels[0])
        assert set(range(0, e.steps(level) + 1, common)) <= kept
        assert e.steps(level) in kept
        if isinstance(samples, int):
            assert set(range(0, e.steps(level) + 1, samples)) <= kept
        if samples == "all":
            assert every == 1
        if samples == "common":
            assert every == common


def test_auto_keeps_everything_while_it_is_small() -> None:
    members = 10
    steps = SMALL // members - 1
    small = experiment(levels=(0, 1), base=steps // 2, sweep=sweep(("a", tuple(range(members)))))
    assert members * (small.steps(1) + 1) <= SMALL
    assert plan.sampling(small, 1) == 1
    large = experiment(levels=(0, 1), base=steps, sweep=small.sweep)
    assert plan.sampling(large, 1) == 2
    assert plan.sampling(large, 0) == 1
