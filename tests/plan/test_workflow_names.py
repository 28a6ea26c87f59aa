"""The rules of the workflow: what a reader of Snakemake's output sees."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from vibsim.plan import Names, Plan

SWEPT = "levels: [5, 6, 7]\nsweep: {initial.theta: {linspace: [0.1, 1, 300]}}"


def rules(*plans: Plan) -> list[str]:
    names = Names({plan.key: plan for plan in plans}, Path("results"))
    return [simulation.rule for simulation in names.simulations]


def test_a_rule_says_experiment_and_levels(plan_of: Callable[..., Plan]) -> None:
    assert rules(plan_of()) == ["simulate_adhoc__tiny__levels_05_07"]
    assert rules(plan_of(("[5, 6, 7]", "[5, 6, 28]"))) == [
        "simulate_adhoc__tiny__levels_05_06",
        "simulate_adhoc__tiny__level_28",
    ]
    # the shards of a level are jobs of one rule
    assert rules(plan_of(("levels: [5, 6, 7]", SWEPT))) == ["simulate_adhoc__tiny__levels_05_07"]


@pytest.mark.parametrize("names", [("b", "b_2"), ("a__b", "a", "a__level_05")])
def test_every_rule_has_a_name_of_its_own(
    plan_of: Callable[..., Plan], names: tuple[str, ...]
) -> None:
    found = rules(*(plan_of(name=name) for name in names))
    assert len(set(found)) == len(names)
    assert all(map(str.isidentifier, found))


def test_names_that_are_the_same_are_numbered(plan_of: Callable[..., Plan]) -> None:
    """``a__b/c`` and ``a/b__c``: the same letters, another experiment."""
    plan = plan_of()
    alike = [replace(plan, collection=a, name=b) for a, b in (("a__b", "c"), ("a", "b__c"))]
    assert rules(*alike) == [
        "simulate_a__b__c__levels_05_07",
        "simulate_a__b__c__levels_05_07__2",
    ]
