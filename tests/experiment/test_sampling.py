"""Which steps are stored: bounded for large sweeps, and never fewer than a curve needs."""

from __future__ import annotations

from itertools import product

import pytest

from vibsim.experiment.storage import FEWEST_INTERVALS, LARGE, LEAN, SMALL, is_lean, stride


@pytest.mark.parametrize("coarsest", [2, 16, 48, 64, 1000, 1024, 2**20])
def test_auto_keeps_as_much_as_it_may(coarsest: int) -> None:
    for trajectories, finer in product((1, 10, 10**3, 10**5, 10**6, 10**7), (0, 1, 5)):
        as_much_as_it_may(coarsest, trajectories, finer)


def as_much_as_it_may(coarsest: int, trajectories: int, finer: int) -> None:
    steps = coarsest << finer
    every = stride("auto", coarsest, steps, trajectories)
    if trajectories * (steps + 1) <= SMALL:
        assert every == 1
        return
    assert steps % every == 0
    thinning, rest = divmod(every, steps // coarsest)
    assert rest == 0
    assert thinning & (thinning - 1) == 0
    intervals = steps // every
    if thinning > 1:
        assert intervals >= FEWEST_INTERVALS
        assert trajectories * (2 * intervals + 1) > LARGE, "half as many would have done"
    if trajectories * (intervals + 1) > LARGE:
        assert intervals % 2 or intervals // 2 < FEWEST_INTERVALS


@pytest.mark.parametrize("finer", [1, 4])
def test_all_levels_keep_the_same_times_once_they_are_large(finer: int) -> None:
    kept = {64 * 2**n // stride("auto", 64, 64 * 2**n, 10**6) for n in (0, finer)}
    assert kept == {16}


def test_what_is_asked_for_is_kept() -> None:
    assert stride("common", 64, 256, 10**7) == 4
    assert stride("all", 64, 256, 10**7) == 1
    assert stride(8, 64, 256, 10**7) == 8


def test_an_experiment_is_lean_from_its_coarsest_level_on() -> None:
    members = LEAN // 65
    for samples in ("auto", "common"):
        assert not is_lean(samples, 64, members)
        assert is_lean(samples, 64, members + 1)
    assert not is_lean("all", 64, 10**7)
    assert not is_lean(8, 64, 10**7)
