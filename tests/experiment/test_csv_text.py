"""Tables as people write them: separators, decimal marks, quotes, units; and what could be read in two ways."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from experiment_files import write

from vibsim.core.errors import Fault, InputError
from vibsim.experiment import Experiment

TEXT = """\
title: A road
model: {kind: vehicle, speed: 1, road: {table: road.csv, x: X, h: H}}
time: {end: 2, base_steps: 100}
levels: [0, 1, 2]
schemes: [central]
"""


def experiment(folder: Path, x: str = "x", h: str = "h") -> Path:
    return write(folder, TEXT.replace("X", x).replace("H", h))


def heights(folder: Path, text: str | bytes) -> list[float]:
    write(folder, text, "road.csv")
    loaded = Experiment.from_yaml(experiment(folder))
    return loaded.model.tables["road"].table.heights.tolist()


def fault(folder: Path, text: str | bytes, **columns: str) -> Fault:
    write(folder, text, "road.csv")
    with pytest.raises(InputError) as caught:
        Experiment.from_yaml(experiment(folder, **columns))
    (only,) = caught.value.faults
    assert only.line == 2
    return only


@pytest.mark.parametrize(
    "text",
    [
        "x,h\n0,0\n1,0.02\n2,-1.5\n",
        "x;h\n0;0\n1;0,02\n2;-1,5\n",
        "x;h\n0,0;0,0\n1,0;2,0e-2\n2,0;-1,5\n",
        "x\th\n0\t0\n1\t0,02\n2\t-1,5\n",
        'x,h\n"0","0"\n"1","0,02"\n"2","-1,5"\n',
        "\ufeffx,h\r\n\r\n# a road\r\n0,0\r\n 1 , .02 \r\n  # with a bump\r\n2,-1.5\r\n",
        "x,h\r0,0\r1,2e-2\r2,-15E-1\r",
        "x,h,\n0,0,\n1,0.02,\n2,-1.5,\n",
        "x,h\n0,0,\n1,0.02,\n2,-1.5,\n",
        '"x" , "h"\n0,0\n1,+0.02\n2,-1.5\n',
        "note;x;h\na, b;0;0\nc;1;0.02\n;2;-1.5\n",
    ],
)
def test_a_table_is_read_with_any_clear_separator_and_mark(tmp_path: Path, text: str) -> None:
    assert heights(tmp_path, text) == [0.0, 0.02, -1.5]


@pytest.mark.parametrize(
    ("text", "rule", "hint"),
    [
        (
            "x,h\n0,0\n1,0,02\n2,0\n",
            "line 3: has 3 cells between commas, and the table has 2",
            "1.5",
        ),
        ("x,h\n0,0,0,0\n1,0,0,02\n", "line 2: has 4 cells between commas", "decimal comma"),
        ("# r\nx,h\n\n0,0\n1\n2,0\n", "line 5: has 1 cell between commas", ""),
        ("x;h\n0;0\n1;2;3\n2;0\n", "line 3: has 3 cells between semicolons", ""),
        ("x,h\n0;0\n1;0\n2;0\n", "line 2: has 1 cell between commas", ""),
        (
            "x;h\n0;0\n1;0,5\n2;0.5\n",
            "decimal points (line 4) and decimal commas (line 3)",
            "points",
        ),
        (
            "x;h\n0;0\n1;1.234,5\n2;0\n",
            "line 3: '1.234,5' is not a number, in column 'h'",
            "thousands",
        ),
        (
            "x;h\n0;0\n1;1,234.5\n2;0\n",
            "line 3: '1,234.5' is not a number, in column 'h'",
            "thousands",
        ),
        ("x;h\n0;0\n1;1.234.567\n2;0\n", "line 3: '1.234.567' is not a number", "thousands"),
        ("x\th\n0\t0\n1\t1,234\n2\t0\n", "line 3: the comma may be a decimal mark", "points"),
        ('x,h\n0,0\n1,"12,345"\n2,0\n', "line 3: the comma may be a decimal mark", "points"),
        (
            "x,h\nm,m\n0,0\n1,0\n2,0\n",
            "line 2: the cell is not a number",
            "units must begin with #",
        ),
        ("x,h\n1.0D-1,0\n1,0\n2,0\n", "line 2: the cell is not a number", "write 1.0e-1"),
        ("x,h\n0,0\n1,\n2,0\n", "line 3: the cell is empty, in column 'h'", ""),
        ("x,h\n0,0\n1,1_0\n2,0\n", "line 3: the cell is not a number, in column 'h'", ""),
        ("x,h\n0,0\n1,\u0661\n2,0\n", "line 3: the cell is not a number, in column 'h'", ""),
        ("x,h\n0,0\n1,0x10\n2,0\n", "line 3: the cell is not a number, in column 'h'", ""),
        ('x,h\n0,0\n1,"2\n2,0\n', "line 4: a quoted cell must end on its line", ""),
        ('x,h\n0,0\n1,"2\n3"\n', "line 4: a quoted cell must end on its line", ""),
        ("x h\n0 0\n1 0\n2 0\n", "the table has no column 'x'", ""),
        ("x,h\n0,0\n1,\xff\n".encode("latin-1"), "must be UTF-8 text, but line 3 is none", ""),
        ("x,h\n" + "0" * 70_000 + ",0\n", "line 2: must not be longer than 65536 characters", ""),
    ],
)
def test_what_is_not_clear_is_refused_with_its_line(
    tmp_path: Path, text: str | bytes, rule: str, hint: str
) -> None:
    found = fault(tmp_path, text)
    assert rule in found.rule
    assert hint in found.hint


@pytest.mark.parametrize(
    "text",
    [
        "root:x:0:0:Secret:/root:/bin/bash\nuser:x:1:1:Secret:/:/bin/sh\n",
        "alice,Secret\nbob,Secret\n",
        "user\tpassword\talice\nbob\tSecret\t1\n",
        "id,key\n1,Secret\n2,Secret\n3,Secret\n",
        "Secret\n",
        "[core]\n\tSecret = 1\n",
    ],
)
@pytest.mark.parametrize("columns", [("x", "h"), ("id", "key")])
def test_what_a_link_leads_to_is_not_shown(
    tmp_path: Path, text: str, columns: tuple[str, str]
) -> None:
    folder = tmp_path / "mine"
    folder.mkdir()
    (folder / "road.csv").symlink_to(write(tmp_path, text, "foreign"))
    path = experiment(folder, *columns)
    with pytest.raises(InputError) as caught:
        Experiment.from_yaml(path)
    (only,) = caught.value.faults
    for word in ("Secret", "root", "alice", "bob", "user", "password", "core"):
        assert word not in only.rule + only.hint + only.value


CHILD = """
import cProfile, re, sys
from vibsim.core.errors import InputError
from vibsim.experiment import Experiment
profile = cProfile.Profile()
try:
    with profile:
        Experiment.from_yaml(sys.argv[1])
except InputError as error:
    print(error.faults[0].rule)
print(sum(entry.callcount for entry in profile.getstats()))
print(re.search(r"VmHWM:\\s*(\\d+)", open("/proc/self/status").read())[1])
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("line", "count", "rule"),
    [
        ("# nothing but words\n", 3_000_000, "2097152 lines"),
        ("# nothing but words, and that on each of a million lines\n", 1_000_000, ""),
        ("1,", 30_000_000, "line 2: must not be longer"),
        ("\r\n", 30_000_000, "2097152 lines"),
        ("1,2\n", 15_000_000, "2097152 lines"),
    ],
)
def test_a_large_table_takes_two_calls_a_line_and_300_mb_at_most(
    tmp_path: Path, line: str, count: int, rule: str
) -> None:
    write(tmp_path, b"x,h\n" + line.encode() * count + b"0,0\n1,0\n2,0\n", "road.csv")
    done = subprocess.run(
        [sys.executable, "-c", CHILD, str(experiment(tmp_path))],
        capture_output=True,
        text=True,
        check=True,
    )
    *told, calls, kilobytes = done.stdout.splitlines()
    assert [rule in line for line in told] == [True] * bool(rule)
    # a million lines need two million
    assert int(calls) < 3_000_000
    assert int(kilobytes) < 300_000


@pytest.mark.parametrize("cell", ["0.1 m", "5%", "1_0"])
def test_a_number_with_more_in_its_cell_is_no_row_of_units(tmp_path: Path, cell: str) -> None:
    assert fault(tmp_path, f"x,h\n{cell},0\n1,0\n2,0\n").hint == ""
