"""What pictures of drifts and of equality need, beside the verdict that was made of the same numbers."""

from __future__ import annotations

import numpy as np
import pytest
from spring_runs import spring

from vibsim.checks.equal import PLACES, by_place
from vibsim.core.vocabulary import DRIFTS

RNG = np.random.default_rng(7)


@pytest.mark.parametrize("samples", [2, 5, 240, 241, 242, 5000])
def test_no_place_loses_what_is_largest_around_it(samples: int) -> None:
    values = RNG.random((3, samples))
    found = by_place(values, min(PLACES, samples))
    assert found.shape == (3, min(PLACES, samples))
    assert np.array_equal(np.max(found, axis=-1), np.max(values, axis=-1))
    # in place to half of what is between two of them
    where = np.argmax(values, axis=-1) / (samples - 1)
    places = np.argmax(found, axis=-1) / (found.shape[-1] - 1)
    assert np.max(np.abs(where - places)) <= 0.5 / (found.shape[-1] - 1) + 1e-12


def test_as_many_places_as_samples_are_the_samples() -> None:
    values = RNG.random((2, 100))
    assert np.array_equal(by_place(values, 100), values)


def test_a_place_without_a_sample_is_unknown() -> None:
    found = by_place(np.array([[1.0, 2.0, 3.0]]), 5)
    assert np.array_equal(found, [[1.0, np.nan, 2.0, np.nan, 3.0]], equal_nan=True)
    assert np.array_equal(by_place(np.array([[np.nan, 2.0]]), 2), [[np.nan, 2.0]], equal_nan=True)


def test_what_is_kept_is_what_the_verdict_was_made_of() -> None:
    run = spring(
        ["rk4", "central"],
        {"stable": True},
        {"equal": ["rk4", "exact"], "quantity": "v", "id": "first"},
        {"conserves": "energy", "drift": "linear", "schemes": ["rk4"], "level": 1},
        {"equal": ["central", "rk4"], "quantity": "u", "level": 0, "id": "second"},
        levels=(0, 1, 2),
    )
    record = run.record
    for name, scheme in (("first", 0), ("second", 1)):
        distance = record[f"check_{name}_distance_over_time"]
        assert distance.shape == (1, PLACES)
        assert np.nanmax(distance) == record[f"check_{name}_distance"][scheme, 0]
    third, second, first = record["check_check_3_window_means"][0, 0]
    k = np.log2((first - second) / (second - third))
    assert k == record["check_check_3_drift_power"][0, 0]
    assert DRIFTS[int(record["check_check_3_drift"][0, 0])] == "linear"
    assert record["check_check_3_round_off"][0, 0] < first
