"""Experiments of the default run have the verdicts and the numbers that were recorded in ``golden.json``."""

from __future__ import annotations

import json
import math
from typing import Any

import pytest

from .golden import EXPERIMENTS, FILE, facts, values
from .test_contract_commands import VALUES

GOLDEN = json.loads(FILE.read_text())
RECORDED = GOLDEN["experiments"]


def test_what_is_recorded_is_what_is_compared() -> None:
    assert set(RECORDED) == set(EXPERIMENTS)


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_facts_are_those_that_were_recorded(name: str) -> None:
    """Words exactly; numbers to 1e-9 of them, and to 1e-12 where they are round-off."""
    found, recorded = facts(name), RECORDED[name]
    for key in ("id", "status", "reason", "counts"):
        assert [one[key] for one in found] == [one[key] for one in recorded]
    for one, other in zip(found, recorded, strict=True):
        assert flat(one) == pytest.approx(flat(other), rel=1e-9, abs=1e-12, nan_ok=True)


def test_every_value_that_a_check_may_name_is_the_number_it_was() -> None:
    found = values()
    assert set(GOLDEN["values"]) == VALUES
    assert all(value is not None for value in GOLDEN["values"].values())
    assert found == pytest.approx(GOLDEN["values"], rel=1e-9, abs=1e-12)


def flat(one: dict[str, Any]) -> dict[str, float]:
    """All numbers of a check by name, NaN where there is none."""
    numbers = {
        f"{one['id']} {name} {place}": value
        for name, row in one["numbers"].items()
        for place, value in enumerate(row)
    }
    values = {f"{one['id']} value {scheme}": value for scheme, value in one["values"].items()}
    return {k: math.nan if v is None else v for k, v in {**numbers, **values}.items()}
