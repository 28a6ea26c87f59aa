"""The table of events, level by level."""

from __future__ import annotations

import pytest
import samples

from vibsim.report.tables import levels

BALL = {"kind": "bouncing_ball", "g": 2.0, "restitution": 0.5}


def rows(**changes):
    given = {"model": BALL, "initial": {"h": 1.0}, "time": {"end": 4.0}, "levels": [4, 5, 6]}
    experiment = samples.experiment(**given | changes)
    found = levels.events(samples.record(experiment))
    assert found is not None
    names = [column.header for column in found.columns]
    return [dict(zip(names, row, strict=True)) for row in found.rows]


def test_impacts_of_a_ball():
    """It falls for 1, and is then in the air for 1, 1/2, 1/4, ... until it rests."""
    found = rows(schemes=["rk4"])
    assert [row["level"] for row in found] == [4, 5, 6]
    for row in found:
        assert row["first"] == pytest.approx(1.0, abs=1e-12)
        assert row["last"] == pytest.approx(row["at rest from"], abs=1e-12)
    change = [row["last, less that of the next finer level"] for row in found]
    assert change[:2] == pytest.approx([0.0, 0.0], abs=1e-12)
    assert change[2] is None


def test_events_that_differ_in_number_are_not_compared():
    found = rows(schemes=[{"kind": "rk4", "events": "mesh"}], initial={"h": 1.0}, time={"end": 1.6})
    counts = [row["events"] for row in found]
    change = [row["last, less that of the next finer level"] for row in found]
    for i in range(2):
        assert (change[i] is None) == (counts[i] != counts[i + 1])
        if change[i] is not None:
            assert change[i] == found[i]["last"] - found[i + 1]["last"] != 0.0
    assert set(change) != {None}


def test_a_row_for_every_member():
    found = rows(schemes=["rk4"], sweep={"initial.h": [1.0, 2.25]})
    assert [row["first"] for row in found] == pytest.approx([1.0] * 3 + [1.5] * 3)
    assert {row["member"] for row in found} == {"initial.h = 1 m", "initial.h = 2.25 m"}


def test_smooth_motions_have_none():
    assert levels.events(samples.record(samples.experiment(levels=[4, 5, 6]))) is None


def test_a_ball_that_meets_no_ground_has_none():
    experiment = samples.experiment(
        model=BALL, initial={"h": 9.0}, time={"end": 1.0}, levels=[4, 5, 6]
    )
    assert levels.events(samples.record(experiment)) is None
