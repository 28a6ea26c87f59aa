"""Tables beside an experiment file: what is read of them, and every way in which one can be at fault."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
import pytest
from experiment_files import write

from vibsim.core.errors import Fault, InputError
from vibsim.experiment import Experiment, canonical, restore
from vibsim.experiment.tables import file as table_file
from vibsim.experiment.tables.content import TableError
from vibsim.experiment.tables.file import EVEN, read
from vibsim.models.table import Table

HEIGHTS = [0.02 * (i % 7) ** 2 for i in range(101)]
ROWS = [f"{i / 10:g},{h:g}" for i, h in enumerate(HEIGHTS)]
TEXT = """\
title: A road
model: {kind: vehicle, speed: 5, road: ROAD}
time: {end: 2, base_steps: 100}
levels: [0, 1, 2]
schemes: [central]
"""


def lines(*rows: str) -> str:
    return "\n".join(rows) + "\n"


def table(folder: Path, rows: list[str], head: str = "x,h") -> Path:
    return write(folder, lines(head, *rows), "road.csv")


def road(folder: Path, text: str = "{table: road.csv}", more: str = "") -> Experiment:
    return Experiment.from_yaml(write(folder, TEXT.replace("ROAD", text) + more))


def only_fault(folder: Path, text: str = "{table: road.csv}", more: str = "") -> Fault:
    with pytest.raises(InputError) as caught:
        road(folder, text, more)
    (fault,) = caught.value.faults
    return fault


def test_a_table_is_read_as_it_is_written(tmp_path: Path) -> None:
    rows = [f"{row.split(',')[1]} , 7,{row.split(',')[0]}" for row in ROWS]
    text = "\r\n".join(["\ufeff# a road", "h, note ,x", "", *rows[:3], "  # a bump", *rows[3:]])
    write(tmp_path, text, "road.csv")
    found = road(tmp_path).model.tables["road"].table
    assert (found.first, found.points) == (0.0, 101)
    assert found.spacing == pytest.approx(0.1, rel=1e-15)
    assert found.heights.tolist() == [float(f"{h:g}") for h in HEIGHTS]


@pytest.mark.parametrize(
    ("head", "first"), [("place,z", True), ("t,x", True), ("h,place", False), ("z,x", False)]
)
def test_of_two_columns_one_holds_the_places(tmp_path: Path, head: str, *, first: bool) -> None:
    """Times come first, even before a column that is called x, as the measured displacement of a base."""
    rows = ROWS if first else [",".join(reversed(row.split(","))) for row in ROWS]
    table(tmp_path, rows, head)
    assert road(tmp_path).model.tables["road"].table.heights.tolist() == pytest.approx(HEIGHTS)
    table(tmp_path, [*rows[:5], *rows[6:]], head)
    place = head.split(",")[0 if first else 1]
    assert f"line 7: '{place}' must be equally spaced" in only_fault(tmp_path).rule


@pytest.mark.parametrize("form", ["NETCDF4", "NETCDF3_CLASSIC"])
def test_a_road_in_a_netcdf_file_is_the_same_road(tmp_path: Path, form: Any) -> None:
    table(tmp_path, ROWS)
    with netCDF4.Dataset(tmp_path / "road.nc", "w", format=form) as file:
        file.createDimension("point", 101)
        for name, values in (("place", np.arange(101) / 10), ("height", HEIGHTS)):
            variable = file.createVariable(name, "f8", ("point",))
            variable[:] = [float(f"{v:g}") for v in values]
            variable.units = "m"
    by_text = road(tmp_path)
    by_file = road(tmp_path, "{table: road.nc, x: place, h: height}")
    assert by_file.model.tables["road"].table == by_text.model.tables["road"].table
    assert by_file.model.definition is by_text.model.definition
    fault = only_fault(tmp_path, "{table: road.nc, x: place, h: heigth}")
    assert (fault.key, fault.hint) == ("model.road.h", "did you mean 'height'?")


def test_places_may_be_rounded_but_not_moved(tmp_path: Path) -> None:
    x = np.arange(101) / 7
    rounded = [f"{place:.5f},0" for place in x]
    assert read(table(tmp_path, rounded), ("x", "h"), ("x", "h"))[0].points == 101
    x[50] += 2 * EVEN / 7
    with pytest.raises(TableError, match="line 52: 'x' must be equally spaced"):
        read(table(tmp_path, [f"{place:.9f},0" for place in x]), ("x", "h"), ("x", "h"))


@pytest.mark.parametrize(
    ("rows", "rule", "hint"),
    [
        (ROWS[:40] + ROWS[41:], "line 42: 'x' must be equally spaced, but is 0.2", "0.1 apart"),
        ([*ROWS[:5], "0.5,nan", *ROWS[6:]], "line 7: 'h' is nan, and must be finite", ""),
        ([*ROWS[:5], "inf,1", *ROWS[6:]], "line 7: 'x' is inf, and must be finite", ""),
        ([*ROWS[:5], "0.5,high", *ROWS[6:]], "line 7: the cell is not a number, in column 'h'", ""),
        (
            [*ROWS[:5], "0.5", *ROWS[6:]],
            "line 7: has 1 cell between commas, and the table has 2 columns",
            "",
        ),
        ([*ROWS[:5], "0.5,", *ROWS[6:]], "line 7: the cell is empty, in column 'h'", ""),
        (ROWS[:2], "must have at least 3 points, has 2", ""),
        ([], "must have at least 3 points, has 0", ""),
        (ROWS[:9] + ROWS[3:4] + ROWS[9:], "line 11: 'x' must increase, but is 0.8 and then", ""),
        (ROWS[3:], "must begin at 0 or below, where the motion starts; it begins at 0.3", ""),
        (ROWS[:51], "the table ends at 5 m, but the motion comes to 10 m", "at least 101 points"),
        (["0,1e308", "5,-1e308", "10,1e308"], "second differences are too large", ""),
    ],
)
def test_rows_at_fault(tmp_path: Path, rows: list[str], rule: str, hint: str) -> None:
    table(tmp_path, rows)
    fault = only_fault(tmp_path)
    assert (fault.line, fault.key, fault.value) == (2, "model.road.table", "road.csv")
    assert rule in fault.rule
    assert hint in fault.hint


@pytest.mark.parametrize(
    ("text", "key", "rule", "hint"),
    [
        ("{table: raod.csv}", "table", "there is no such file", "did you mean 'road.csv'?"),
        ("{table: away/road.csv}", "table", "no such file", "there is no such folder"),
        ("{table: road.txt}", "table", "must end with .csv or .nc", ""),
        ("{table: folder.csv}", "table", "is a folder", ""),
        ("{table: pipe.csv}", "table", "not a regular file", ""),
        ("{table: noise.csv}", "table", "must be UTF-8 text, but line 1 is none", ""),
        ("{table: noise.nc}", "table", "the netCDF library cannot read it", ""),
        ("{table: header.nc}", "table", "the netCDF library cannot read it", ""),
        ("{table: counts.nc}", "table", "the netCDF library cannot read it", ""),
        ("{table: empty.csv}", "table", "must not be empty", ""),
        ("{table: large.csv}", "table", "must not be larger than 64 MiB", ""),
        ("{table: /road.csv}", "table", "relative to the folder of the experiment file", ""),
        ("{table: road.csv, h: hh}", "h", "the table has no column 'hh'", "did you mean 'h'?"),
        ("{table: road.csv, h: x}", "h", "must be another column than 'x'", ""),
        ("{table: twice.csv}", "h", "more than one column 'h'", ""),
        ("{table: 3}", "table", "must be text", ""),
        ("{x: a}", "table", "required key is missing", ""),
        ("{table: road.csv, formula: x}", "formula", "unknown key", "choose from table, x, h"),
        ("{table: road.csv, tabel: x}", "tabel", "unknown key", "did you mean 'table'?"),
    ],
)
def test_sections_at_fault(tmp_path: Path, text: str, key: str, rule: str, hint: str) -> None:
    table(tmp_path, ROWS)
    (tmp_path / "folder.csv").mkdir()
    os.mkfifo(tmp_path / "pipe.csv")
    noise = np.random.default_rng(1).bytes(3000)
    write(tmp_path, b"\xff" + noise, "noise.csv")
    write(tmp_path, noise, "noise.nc")
    write(tmp_path, b"\x89HDF\r\n\x1a\n" + noise, "header.nc")
    # 2^31 dimensions: the library would take all memory
    write(tmp_path, b"CDF\x01" + bytes(4) + b"\0\0\0\x0a\x7f\xff\xff\xff" + noise, "counts.nc")
    write(tmp_path, "", "empty.csv")
    write(tmp_path, lines("x,h,h", *(f"{row},0" for row in ROWS)), "twice.csv")
    with (tmp_path / "large.csv").open("wb") as file:
        file.truncate(2**26 + 1)
    fault = only_fault(tmp_path, text)
    assert fault.key == f"model.road.{key}"
    assert rule in fault.rule
    assert hint in fault.hint


def test_a_path_as_a_formula_is_told_apart(tmp_path: Path) -> None:
    fault = only_fault(tmp_path, "road.csv")
    assert (fault.key, fault.hint) == ("model.road", "for a table write {table: road.csv}")


def test_too_many_points_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(table_file, "MOST_POINTS", 100)
    table(tmp_path, ROWS)
    assert "must not have more than 100 points" in only_fault(tmp_path).rule


@pytest.mark.parametrize(
    ("sweep", "rule"),
    [
        ("model.speed: [1, 12, 6]", "comes to 24 m (model.speed = 12)"),
        (
            "zip: {model.speed: [1, 20], time.end: [20, 0.5]}",
            "20 m (model.speed = 1, time.end = 20)",
        ),
    ],
)
def test_every_member_needs_its_road(tmp_path: Path, sweep: str, rule: str) -> None:
    table(tmp_path, ROWS)
    assert rule in only_fault(tmp_path, more=f"sweep:\n  {sweep}\n").rule
    road(tmp_path, more="sweep:\n  zip: {model.speed: [1, 20], time.end: [10, 0.5]}\n")


@pytest.mark.parametrize("key", ["model.road", "model.road.table", "model.road.h"])
def test_a_table_cannot_be_swept(tmp_path: Path, key: str) -> None:
    table(tmp_path, ROWS)
    fault = only_fault(tmp_path, more=f"sweep:\n  {key}: [1, 2]\n")
    assert fault.key == f"sweep.{key}"
    assert fault.rule.startswith("cannot be swept: every member has the same")


def test_a_reference_and_no_scales(tmp_path: Path) -> None:
    table(tmp_path, ROWS)
    road(tmp_path, more="checks: [{value: error_l2, quantity: u, below: 1}]\n")
    assert "no scaled equation" in only_fault(tmp_path, more="scaled: true\n").rule


@pytest.mark.parametrize(
    ("speed", "steps", "sweep", "first", "is_met"),
    [
        (5, 100, "", 0.0, True),
        (5, 300, "", 0.0, True),
        (5, 50, "", 0.0, False),
        (5, 70, "", 0.0, False),
        (5, 100, "", -0.1, True),
        (5, 100, "", -0.05, False),
        (5, 200, "", -0.05, True),
        (0, 7, "", 0.0, True),
        (5, 100, "sweep: {model.speed: [5, 2.5]}", 0.0, True),
        (5, 100, "sweep: {model.speed: [5, 2.6]}", 0.0, False),
        (5, 100, "sweep: {zip: {model.speed: [1, 2], time.end: [10, 5]}}", 0.0, True),
        (5, 100, "sweep: {model.m: [1, 2]}", 0.0, True),
    ],
)
def test_steps_that_meet_the_points(
    tmp_path: Path, speed: float, steps: int, sweep: str, first: float, is_met: bool
) -> None:
    x = first + np.arange(103) / 10
    table(tmp_path, [f"{place:.10g},{place % 0.7:g}" for place in x])
    text = TEXT.replace("ROAD", "{table: road.csv}").replace("speed: 5", f"speed: {speed}")
    text = text.replace("base_steps: 100", f"base_steps: {steps}") + sweep
    found = Experiment.from_yaml(write(tmp_path, text))
    assert found.model.tables["road"].is_met is is_met
    lookup = found.model.definition.lookup
    assert lookup is not None
    assert lookup.is_met is is_met


def test_levels_and_members_alone_are_asked_again(tmp_path: Path) -> None:
    table(tmp_path, ROWS)
    found = road(tmp_path, more="sweep: {model.speed: [5, 2.6]}\n")
    assert not found.model.tables["road"].is_met
    assert found.alone(0).model.tables["road"].is_met
    assert not found.alone(1).model.tables["road"].is_met
    text = TEXT.replace("ROAD", "{table: road.csv}").replace("levels: [0, 1, 2]", "tolerance: 1e-6")
    chosen = Experiment.from_yaml(
        write(tmp_path, text.replace("base_steps: 100", "base_steps: 50"))
    )
    assert not chosen.model.tables["road"].is_met
    assert chosen.with_levels([1, 2, 3]).model.tables["road"].is_met


def test_what_is_kept_of_an_experiment_is_restored(tmp_path: Path) -> None:
    file = table(tmp_path, ROWS)
    found = road(tmp_path)
    content = json.loads(json.dumps(canonical(found)))
    assert restore(content, found.file) == found
    assert hash(restore(content, found.file)) == hash(found)
    assert restore(content, found.file).model.definition is found.model.definition
    # a comment changes no number
    file.write_text("# a note\n" + file.read_text())
    assert restore(content, found.file).model.definition is found.model.definition
    table(tmp_path, [*ROWS[:-1], "10,9"])
    with pytest.raises(InputError, match="has other numbers than when the experiment was read"):
        restore(content, found.file)
    file.unlink()
    with pytest.raises(InputError, match="there is no such file"):
        restore(content, found.file)


def test_between_the_points() -> None:
    """The cubic meets the heights, and its second derivative is the line between the second differences."""
    from vibsim.engine.formulas import looked_up

    heights = np.random.default_rng(2).normal(size=9)
    one = Table(-0.3, 0.2, heights)
    x = one.first + one.spacing * np.arange(9)
    for i in range(9):
        assert looked_up(one.rows, x[i])[0] == pytest.approx(heights[i], abs=1e-14)
    assert one.bends[0] == one.bends[1]
    assert one.bends[-1] == one.bends[-2]
    step = 1e-3
    for place in np.linspace(-0.29, 1.29, 40):
        left = np.floor((place - step - one.first) / one.spacing)
        h = [looked_up(one.rows, place + k * step)[0] for k in (-1, 0, 1)]
        q = looked_up(one.rows, place)[1]
        assert q == pytest.approx(np.interp(place, x, one.bends), abs=1e-10)
        if left == np.floor((place + step - one.first) / one.spacing):
            assert (h[0] - 2 * h[1] + h[2]) / step**2 == pytest.approx(q, abs=1e-6)


def test_a_scaled_run_is_refused_for_its_table_and_not_for_its_spring(tmp_path: Path) -> None:
    table(tmp_path, ROWS)
    fault = only_fault(
        tmp_path, "{table: road.csv}, spring: k*u, parameters: {k: 4}", "scaled: true\n"
    )
    assert fault.key == "scaled"
    assert "table" in fault.rule
    assert "spring" not in fault.rule


def on_points(folder: Path, rows: list[str], time: str, more: str = "") -> Experiment:
    table(folder, rows)
    text = TEXT.replace("ROAD", "{table: road.csv}").replace("{end: 2, base_steps: 100}", time)
    return Experiment.from_yaml(write(folder, text + more))


@pytest.mark.parametrize("behind", [0, 30])
def test_steps_end_at_the_points_at_every_speed(tmp_path: Path, behind: int) -> None:
    """Of the table of 10 m, `behind` spacings lie behind the start."""
    rows = [f"{i / 10 - behind / 10:g},{h:g}" for i, h in enumerate(HEIGHTS)]
    sweep = "sweep: {model.speed: [0.7, 5, 12.3]}\n"
    found = on_points(tmp_path, rows, "{steps_per_point: 3}", sweep)
    assert found.time.base_steps == 3 * (100 - behind)
    assert found.end_varies
    assert found.model.tables["road"].is_met
    speeds = np.array([0.7, 5.0, 12.3])
    ends = found.natural_end({**found.model.parameters, "speed": speeds})
    np.testing.assert_allclose(speeds * ends, 10.0 - behind / 10, rtol=1e-14)
    assert restore(canonical(found), found.file) == found


@pytest.mark.parametrize(
    ("rows", "time", "more", "rule"),
    [
        (ROWS, "{steps_per_point: 1, end: 2}", "", "together with steps_per_point"),
        (ROWS, "{steps_per_point: 0}", "", "at least 1"),
        (ROWS, "{steps_per_point: 1}", "sweep: {model.speed: [2, 0]}", "where model.speed = 0"),
        ([f"{i / 10 - 0.05:g},0" for i in range(9)], "{steps_per_point: 1}", "", "a point at 0"),
        (["-2,0", "-1,1", "0,0"], "{steps_per_point: 1}", "", "points behind it"),
    ],
)
def test_steps_from_point_to_point_are_refused_where_there_are_none(
    tmp_path: Path, rows: list[str], time: str, more: str, rule: str
) -> None:
    with pytest.raises(InputError) as caught:
        on_points(tmp_path, rows, time, more)
    (fault,) = caught.value.faults
    assert rule in fault.rule
    assert fault.line > 0


def test_steps_from_point_to_point_need_a_table(tmp_path: Path) -> None:
    time = "time: {steps_per_point: 1}"
    text = TEXT.replace("ROAD", "0.1*sin(x)").replace("time: {end: 2, base_steps: 100}", time)
    with pytest.raises(InputError, match="needs a model with a table"):
        Experiment.from_yaml(write(tmp_path, text))
