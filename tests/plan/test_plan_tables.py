"""What runs again when a table changes: all that uses its numbers, and nothing for a comment or another name."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from vibsim.core.errors import InputError
from vibsim.plan import Choice, Plan, load

TEXT = """\
title: A road
model: {kind: vehicle, speed: 5, road: {table: road.csv}}
time: {end: 2, base_steps: 100}
levels: [0, 1, 2]
output: best
schemes: [central]
"""
ROWS = [f"{i / 10:g},{(i * i) % 7 / 100:g}" for i in range(101)]


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "bumpy.yaml"
    path.write_text(TEXT)
    put(path, ROWS)
    return path


def put(file: Path, rows: list[str], name: str = "road.csv", head: str = "x,h") -> None:
    (file.parent / name).write_text("\n".join([head, *rows]) + "\n")


def plan(file: Path, cached: bool = False) -> Plan:
    return load(Choice("adhoc", file), cached=cached)


def digests(made: Plan) -> tuple[object, ...]:
    return (*(shard.digest for shard in made.shards), made.extrapolation, made.analysis)


def test_a_comment_leaves_the_report_as_well(file: Path) -> None:
    before = plan(file)
    put(file, ["# measured in May", *ROWS])
    after = plan(file)
    assert after.report == before.report
    assert after.inputs != before.inputs


def test_other_numbers_run_everything_again(file: Path) -> None:
    before = digests(plan(file))
    put(file, [*ROWS[:50], "5,0.123", *ROWS[51:]])
    assert not set(before) & set(digests(plan(file)))


def test_the_same_numbers_run_nothing_again(file: Path) -> None:
    before = digests(plan(file))
    put(file, ["# measured in May", *(f" {row}" for row in ROWS)])
    assert digests(plan(file)) == before
    put(file, ROWS, "other.csv", "place,height")
    file.write_text(TEXT.replace("road.csv", "other.csv, x: place, h: height"))
    assert digests(plan(file)) == before


def test_a_kept_plan_knows_its_table(
    file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("VIBSIM_CACHE_DIR", str(tmp_path / "cache"))
    kept = plan(file, cached=True)
    with monkeypatch.context() as patch:
        patch.setattr("vibsim.plan.build.build", None)
        assert plan(file, cached=True) == kept
    put(file, [*ROWS[:50], "5,0.123", *ROWS[51:]])
    assert digests(plan(file, cached=True)) != digests(kept)
    (file.parent / "road.csv").unlink()
    with pytest.raises(InputError, match="there is no such file"):
        plan(file, cached=True)


def test_a_table_that_changes_during_a_run_is_refused(file: Path) -> None:
    made = plan(file)
    put(file, [*ROWS[:50], "5,0.123", *ROWS[51:]])
    with pytest.raises(InputError, match="other numbers"):
        _ = made.experiment


def test_a_plan_holds_no_number_of_a_table_but_its_digest(file: Path) -> None:
    table = plan(file).content["model"]["tables"]["road"]
    assert sorted(table) == ["file", "is_met", "numbers", "place", "value"]
    assert table["file"] == "road.csv"
    assert len(json.dumps(table)) < 300
