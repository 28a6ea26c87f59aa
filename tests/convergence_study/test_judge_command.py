"""``vibsim judge``: tables and netCDF files of any program, exit statuses, JSON, refusals and the page."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jsonschema
import netCDF4
import numpy as np
import pytest

from vibsim.cli import main

Capture = pytest.CaptureFixture[str]
KEYS = [
    *("quantity", "status", "reason", "order", "order_low", "order_high", "h_used", "error"),
    *("error_bound", "best", "best_bound", "gci", "sentence", "advice"),
]
SCHEMA = Path(__file__).parents[2] / "workflow/schemas/verdict.schema.json"
VALIDATOR = jsonschema.Draft202012Validator(json.loads(SCHEMA.read_text()))
H = [0.1, 0.05, 0.025, 0.0125]
TABLE = "dt,u,flux\n" + "".join(f"{h},{3 + h**2!r},{1 + h!r}\n" for h in H)


@pytest.fixture
def table(tmp_path: Path) -> Callable[..., str]:
    """Write a table and return its path."""

    def write(text: str = TABLE, name: str = "study.csv") -> str:
        path = tmp_path / name
        path.write_text(text)
        return str(path)

    return write


def entries(capsys: Capture) -> list[dict[str, Any]]:
    """The verdicts that were printed as JSON, and nothing else."""

    def refuse(word: str) -> None:
        raise AssertionError(f"{word} is no JSON")

    captured = capsys.readouterr()
    assert captured.err == ""
    content = json.loads(captured.out, parse_constant=refuse)
    assert list(content) == ["vibsim_format", "verdicts"]
    assert content["vibsim_format"] == 2
    VALIDATOR.validate(content)
    for verdict in content["verdicts"]:
        assert list(verdict) == KEYS
    found: list[dict[str, Any]] = content["verdicts"]
    return found


def test_the_schema_of_verdicts_is_one() -> None:
    VALIDATOR.check_schema(VALIDATOR.schema)


def test_a_table_that_converges_passes(table: Callable[..., str], capsys: Capture) -> None:
    assert main(["judge", table(), "--h", "dt", "--quantity", "u", "--order", "2"]) == 0
    out = capsys.readouterr().out
    assert out.startswith("PASS  asymptotic  u\n  u converges with order 2.00")
    assert out.endswith("1 quantity, 1 passed: PASS\n")


def test_values_are_written_so_that_their_differences_show(
    table: Callable[..., str], tmp_path: Path, capsys: Capture
) -> None:
    sizes = [2.0**-k for k in range(3, 12)]
    path = table("h,u\n" + "".join(f"{h},{1 + 0.3 * h**4!r}\n" for h in sizes))
    assert main(["judge", path, "--h", "h", "--order", "4", "--report", str(tmp_path)]) == 0
    lines = [line.split() for line in capsys.readouterr().out.splitlines()]
    shown = [words[1] for words in lines if len(words) > 6 and words[0][0].isdigit()]
    page = (tmp_path / "report.html").read_text()
    assert len(shown) == len(set(shown)) == len(sizes)
    assert all(text in page for text in shown)


def test_a_level_that_blew_up_does_not_fill_the_table_with_digits(
    table: Callable[..., str], capsys: Capture
) -> None:
    rows = "0.1,1.25\n0.05,1.0625\n0.025,1.015625\n0.0125,1.2345678901234567e280\n"
    assert main(["judge", table("dt,u\n" + rows), "--h", "dt"]) == 1
    assert " 1.2345679e280" in capsys.readouterr().out


def test_levels_that_are_all_the_same_have_a_table(
    table: Callable[..., str], capsys: Capture
) -> None:
    assert main(["judge", table("dt,u\n0.1,1.5\n0.05,1.5\n0.025,1.5\n"), "--h", "dt"]) == 0
    assert "0.025    1.5 " in capsys.readouterr().out


def test_without_quantities_every_other_column_is_judged(
    table: Callable[..., str], capsys: Capture
) -> None:
    assert main(["judge", table(), "--h", "dt", "--order", "2", "--json"]) == 1
    u, flux = entries(capsys)
    assert (u["quantity"], u["status"], u["reason"]) == ("u", "PASS", "asymptotic")
    assert (flux["quantity"], flux["status"], flux["reason"]) == ("flux", "FAIL", "order_low")
    assert u["order"] == pytest.approx(2.0, abs=1e-6)
    assert u["best"] == pytest.approx(3.0, abs=1e-5)
    assert u["error"] == pytest.approx(H[-1] ** 2, rel=0.05)
    assert u["h_used"] == H
    assert main(["judge", table(), "--h", "dt", "--at-least", "1"]) == 0
    assert main(["judge", table(), "--h", "dt"]) == 0


@pytest.mark.parametrize(
    "text",
    [
        "dt;u\n0,1;3,01\n0,05;3,0025\n0,025;3,000625\n",
        "dt\tu\n0.025\t3.000625\n\n0.1\t3.01\n0.05\t3.0025\n",
        '\ufeff# by hand\n " dt " , u \n#\n0.05, 3.0025\n 0.1 , 3.01\n2.5e-2,3.000625\n',
        "dt,u\r\n0.1,3.01\r\n0.05,3.0025\r\n0.025,3.000625",
    ],
    ids=["semicolons", "tabs", "comments", "carriage returns"],
)
def test_tables_are_read_as_people_write_them(
    text: str, table: Callable[..., str], capsys: Capture
) -> None:
    for name in ("a.csv", "a.tsv", "a.txt"):
        assert main(["judge", table(text, name), "--h", " dt", "--order", "2", "--json"]) == 0
        (verdict,) = entries(capsys)
        assert verdict["order"] == pytest.approx(2.0)
        assert verdict["h_used"] == [0.1, 0.05, 0.025]


@pytest.mark.parametrize(
    ("cells", "bound"),
    [
        ("1.000", 5e-4),
        ("1,000", 5e-4),
        ("0.000", 5e-4),
        ("12.50", 5e-3),
        ("1.20e+03", 5.0),
        # numbers as they are, by `repr`
        ("1.0", 0.0),
        ("0.5", 0.0),
    ],
)
def test_zeros_at_the_end_of_values_are_digits(
    cells: str, bound: float, table: Callable[..., str], capsys: Capture
) -> None:
    path = table("h;u\n" + "".join(f"{h};{cells}\n" for h in (4, 2, 1)))
    exact = f"u={float(cells.replace(',', '.'))!r}"
    # levels that were rounded to the same digits may differ
    assert main(["judge", path, "--h", "h", "--json"]) == (1 if bound else 0)
    (verdict,) = entries(capsys)
    assert verdict["reason"] == ("round_off" if bound else "exact")
    assert verdict["error_bound"] == pytest.approx(bound, abs=1e-12)
    assert verdict["best_bound"] == pytest.approx(bound, abs=1e-12)
    assert main(["judge", path, "--h", "h", "--json", "--exact", exact]) == 0
    assert entries(capsys)[0]["reason"] == "exact"
    # an exact value within half a digit is not missed
    near = f"u={float(cells.replace(',', '.')) + 0.9 * bound!r}"
    assert main(["judge", path, "--h", "h", "--json", "--exact", near]) == (1 if bound else 0)
    assert entries(capsys)[0]["reason"] == ("round_off" if bound else "exact")


def test_two_rows_are_too_few(table: Callable[..., str], capsys: Capture) -> None:
    path = table("dt,u\n0.1,1\n0.05,2\n")
    assert main(["judge", path, "--h", "dt", "--json"]) == 1
    (verdict,) = entries(capsys)
    assert (verdict["status"], verdict["reason"]) == ("INCONCLUSIVE", "too_few_levels")
    for key in ("order", "order_low", "order_high", "best", "error", "gci"):
        assert verdict[key] is None
    assert main(["judge", table("dt,u\n0.1,1\n"), "--h", "dt"]) == 1


@pytest.mark.parametrize("word", ["nan", "inf", "-Inf", "NaN"])
def test_what_is_not_finite_is_data(word: str, table: Callable[..., str], capsys: Capture) -> None:
    path = table(f"dt,u\n0.1,1\n0.05,{word}\n0.025,2\n")
    assert main(["judge", path, "--h", "dt", "--json"]) == 1
    (verdict,) = entries(capsys)
    assert (verdict["status"], verdict["reason"]) == ("FAIL", "non_finite")


@pytest.mark.parametrize(
    ("text", "arguments", "told"),
    [
        ("dt,u\n0.1,1\n0.05,\n0.025,2\n", [], "study.csv:3: u: is empty"),
        ("dt,u\n0.1,1\n0.05,x\n0.025,2\n", [], "study.csv:3: u: x: is not a number"),
        ("dt,u\n0.1,1\n\n# c\n0.05,1 2\n", [], "study.csv:5: u: 1 2: is not a number"),
        ("dt,u\n0.1,1\n0.05,2,3\n", [], "study.csv:3: has 3 cells"),
        ("dt,u\n0.1,1\n0.05\n", [], "study.csv:3: has 1 cell"),
        ("dt,u\n0.1,1\n0,2\n", [], "study.csv:3: dt: 0: must be a finite number above 0"),
        ("dt,u\n0.1,1\n-0.5,2\n", [], "study.csv:3: dt: -0.5: must be a finite number above 0"),
        ("dt,u\n0.1,1\nnan,2\n", [], "study.csv:3: dt: nan: must be a finite number above 0"),
        ("dt,u\n0.1,1\ninf,2\n", [], "study.csv:3: dt: inf: must be a finite number above 0"),
        ("dt,u\n0.1,1\n0.2,1\n0.1,2\n", [], "study.csv:4: dt: 0.1: is the step size of line 2, too"),
        ("dtt,u\n0.1,1\n", [], "study.csv: --h: dt: the table has no such column: did you mean 'dtt'?"),
        ("a,u\n0.1,1\n", [], "the table has no such column: choose from a, u"),
        ("0.1,1\n0.2,2\n", [], "study.csv:1: 0.1,1: must be the names of the columns"),
        ("0.1,1\n0.2,2\n", ["--h", "0.1"], "study.csv:1: 0.1,1: must be the names of the columns"),
        ("dt u\n0.1 1\n", [], "separate cells by commas, semicolons or tabs"),
        ("dt,dt,u\n0.1,1,2\n", [], "--h: dt: the table has more than one such column"),
        ("dt,u,u\n0.1,1,2\n", [], "--quantity: u: the table has more than one such column"),
        ("dt,,u\n0.1,1,2\n", [], "has a column without a name"),
        ("dt\n0.1\n", [], "has no column beside 'dt'"),
        ("dt,\x1b[2Ju\n0.1,1\n", [], r"'\x1b[2Ju': must be printable"),
        ("dt,u\n0.1,\x1b[2J\n", [], r"study.csv:2: u: '\x1b[2J': is not a number"),
        ("dt,u\n", [], "has no row below the names of its columns"),
        ("", [], "must not be empty"),
        ("# nothing\n\n", [], "must not be empty"),
        (TABLE, ["--quantity", "v"], "--quantity: v: the table has no such column"),
        (TABLE, ["--quantity", "dt"], "--quantity: dt: holds the step sizes"),
        (TABLE, ["--exact", "u"], "--exact: u: must be QUANTITY=VALUE"),
        (TABLE, ["--exact", "3"], "--exact: 3: must be QUANTITY=VALUE: such as u=1.5"),
        (TABLE, ["--exact", "=3"], "--exact: =3: must be QUANTITY=VALUE"),
        (TABLE, ["--exact", "v=3"], "--exact: v: is not a judged quantity"),
        (TABLE, ["--exact", "u=three"], "--exact: u=three: its value must be a finite number"),
        (TABLE, ["--exact", "u=nan"], "--exact: u=nan: its value must be a finite number"),
        (TABLE, ["--exact", "u=3", "--exact", "u=4"], "--exact: u: is given twice"),
        (TABLE, ["--restrict", "mean"], "--restrict: mean: is for fields in netCDF files"),
        (TABLE, ["--order", "2", "--at-least", "1"], "must not be given together with --order"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_refused_with_its_place(
    text: str, arguments: list[str], told: str, table: Callable[..., str], capsys: Capture
) -> None:
    for flag in ([], ["--json"]):
        assert main(["judge", table(text), "--h", "dt", *arguments, *flag]) == 2
        captured = capsys.readouterr()
        assert told in captured.err
        assert captured.out == ""
        assert "Traceback" not in captured.err


@pytest.mark.parametrize(
    "arguments",
    [
        *([], ["--h", "dt"], ["FILE"], ["FILE", "--h", ""], ["FILE", "--h", "dt", "--order", "0"]),
        *(["FILE", "--h", "dt", "--order", word] for word in ("x", "nan", "inf", "-1")),
        *(["FILE", "--h", "dt", "--noise", "-1"], ["FILE", "--h", "dt", "--at-least", "0"]),
        *(["FILE", "--h", "dt", "--restrict", "spline"], ["FILE", "--h", "dt", "--report", ""]),
    ],
    ids=str,
)
def test_a_wrong_command_line_is_refused(
    arguments: list[str], table: Callable[..., str], capsys: Capture
) -> None:
    path = table()
    with pytest.raises(SystemExit) as caught:
        main(["judge", *(path if word == "FILE" else word for word in arguments)])
    assert caught.value.code == 2
    assert capsys.readouterr().out == ""


def test_files_that_cannot_be_read_are_refused(
    tmp_path: Path, table: Callable[..., str], capsys: Capture
) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "not.nc").write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(100))
    (tmp_path / "latin.csv").write_bytes(b"dt,u\n0.1,\xe4\n")
    for name, told in (
        ("none.csv", "No such file"),
        ("", "not a regular file"),
        ("pipe", "not a regular file"),
        ("not.nc", "cannot read it"),
        ("latin.csv", "must be UTF-8"),
    ):
        path = str(tmp_path / name)
        assert main(["judge", path, "--h", "dt", "--quantity", "u"]) == 2
        captured = capsys.readouterr()
        assert captured.err.startswith(path)
        assert told in captured.err


def test_exact_values_and_noise(table: Callable[..., str], capsys: Capture) -> None:
    path = table()
    wrong = ["judge", path, "--h", "dt", "--quantity", "u", "--exact", "u=3.1", "--json"]
    assert main(wrong) == 1
    (verdict,) = entries(capsys)
    assert verdict["reason"] == "wrong_limit"
    assert verdict["error"] == pytest.approx(3 + H[-1] ** 2 - 3.1)
    assert main(["judge", path, "--h", "dt", "--exact", "u=3", "--exact", "flux=1"]) == 0
    capsys.readouterr()
    assert main(["judge", path, "--h", "dt", "--quantity", "u", "--noise", "1", "--json"]) == 0
    (verdict,) = entries(capsys)
    assert verdict["reason"] == "exact"


def test_a_report_that_cannot_be_written_hides_no_verdict(
    table: Callable[..., str], tmp_path: Path, capsys: Capture
) -> None:
    (tmp_path / "report.html").mkdir()
    command = ["judge", table(TABLE), "--h", "dt", "--quantity", "u", "--report", str(tmp_path)]
    assert main(command) == 1
    captured = capsys.readouterr()
    assert "1 quantity, 1 passed: PASS" in captured.out
    assert str(tmp_path / "report.html") in captured.err
    assert "report:" not in captured.out


@pytest.mark.parametrize("place", ["taken", "taken/report"])
def test_a_report_goes_to_a_folder(
    place: str, table: Callable[..., str], tmp_path: Path, capsys: Capture
) -> None:
    (tmp_path / "taken").write_text("a file")
    command = ["judge", table(TABLE), "--h", "dt", "--report", str(tmp_path / place)]
    assert main(command) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert "must be a folder, " in captured.err


def test_a_report_goes_to_a_folder_that_may_be_written_to(
    table: Callable[..., str],
    tmp_path: Path,
    capsys: Capture,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Root may write anywhere, so the answer of the system is another one here."""
    monkeypatch.setattr(os, "access", lambda path, mode: Path(path) != tmp_path)
    for folder in (tmp_path, tmp_path / "new" / "report"):
        assert main(["judge", table(TABLE), "--h", "dt", "--report", str(folder)]) == 2
        captured = capsys.readouterr()
        assert captured.out == ""
        assert "is write-protected" in captured.err
    assert [path.name for path in tmp_path.iterdir()] == ["study.csv"]


@pytest.mark.slow
def test_the_report_is_one_page_with_the_verdicts_beside_it(
    table: Callable[..., str], tmp_path: Path, capsys: Capture
) -> None:
    folder = tmp_path / "new" / "report"
    text = TABLE.replace("flux", "<b>flux</b>")
    command = ["judge", table(text), "--h", "dt", "--order", "2", "--report", str(folder)]
    assert main(command) == 1
    assert f"report: {folder}/report.html" in capsys.readouterr().out
    assert sorted(path.name for path in folder.iterdir()) == ["report.html", "verdict.json"]
    assert main([*command, "--json"]) == 1
    printed = capsys.readouterr().out
    assert json.loads(printed) == json.loads((folder / "verdict.json").read_text())
    page = (folder / "report.html").read_text()
    assert page.count("<svg") == 2
    assert "slope 2 (expected)" in page
    assert "&lt;b&gt;flux&lt;/b&gt;" in page
    assert "<b>flux" not in page
    assert not re.search(r"(src|href)=[\"'](?!#)", page), "the page needs no other file"
    assert "None" not in page
    first = page
    assert main(command) == 1
    assert (folder / "report.html").read_text() == first


def write(path: Path, n: int, form: str = "NETCDF4", power: float = 2.0) -> str:
    """Write a level as another program would: a field over y and x, with and without coordinates."""
    with netCDF4.Dataset(path, "w", format=form) as file:
        for name, size in (("y", 5), ("x", n + 1), ("cell", n), ("one", 1)):
            file.createDimension(name, size)
        file.dx = 1.0 / n
        file.solver = "mine"
        file.createVariable("dt", "f8", ("one",))[:] = 0.5 / n
        x, y = np.linspace(0, 1, n + 1), np.linspace(0, 2, 5)
        file.createVariable("x", "f8", ("x",))[:] = x
        file.createVariable("y", "f8", ("y",))[:] = y
        values = np.exp(y)[:, None] * (np.sin(x) + np.cos(x) * n**-power)
        file.createVariable("T", "f8", ("y", "x"))[:] = values
        centres = (np.arange(n) + 0.5) / n
        edges = np.linspace(0, 1, n + 1)
        average = n * (np.diff(-np.cos(edges)) + np.diff(np.sin(edges)) * n**-power)
        points = file.createVariable("place", "f8", ("cell",))
        points[:] = centres
        cells = file.createVariable("C", "f8", ("cell",))
        cells[:] = average
        cells.coordinates = "place"
        file.createVariable("flux", "f8", ())[...] = 2.0 + n**-power
        if form == "NETCDF4":
            inner = file.createGroup("inner")
            inner.createVariable("T", "f8", ("x",))[:] = np.sin(x) + n**-power
    return str(path)


COUNTS = [10, 20, 40, 80]


LISTED = ",".join(str(1 / n) for n in reversed(COUNTS))


@pytest.mark.parametrize(
    ("form", "sizes"),
    [("NETCDF4", ["dx", LISTED]), ("NETCDF3_CLASSIC", ["dt"]), ("NETCDF3_64BIT_OFFSET", ["dx"])],
)
def test_files_of_other_programs_are_judged(
    form: str, sizes: list[str], tmp_path: Path, capsys: Capture
) -> None:
    files = [write(tmp_path / f"run_{n}.nc", n, form) for n in COUNTS]
    command = ["judge", *reversed(files), "--order", "2", "--quantity", "T", "flux", "--json"]
    for size in sizes:
        assert main([*command, "--h", size]) == 0
        field, flux = entries(capsys)
        assert field["quantity"] == "T"
        assert field["order"] == pytest.approx(2.0, abs=1e-6)
        assert field["best"] is None
        assert flux["best"] == pytest.approx(2.0, abs=1e-5)
        factor = 0.5 if size == "dt" else 1.0
        assert field["h_used"] == pytest.approx([factor / n for n in COUNTS])


@pytest.mark.slow
def test_a_limit_that_is_known_and_a_report_are_of_files_too(
    tmp_path: Path, capsys: Capture
) -> None:
    files = [write(tmp_path / f"run_{n}.nc", n) for n in COUNTS]
    command = ["judge", *files, "--h", "dx", "--quantity"]
    report = ["--report", str(tmp_path / "r")]
    assert main([*command, "T", "flux", "--order", "2", "--exact", "flux=2", *report]) == 0
    assert "<svg" in (tmp_path / "r/report.html").read_text()


@pytest.mark.slow
def test_fields_are_brought_to_common_points(tmp_path: Path, capsys: Capture) -> None:
    files = [write(tmp_path / f"run_{n}.nc", n) for n in (10, 20, 40)]
    common = ["judge", *files, "--h", "dx", "--order", "2"]
    assert main([*common, "--quantity", "C"]) == 2
    told = capsys.readouterr().err
    assert (
        f"{files[0]} and 2 more: C: cell: coordinates: the levels have no point in common" in told
    )
    assert "use restrict: linear or cubic, or mean" in told
    assert main([*common, "--quantity", "C", "--restrict", "mean"]) == 0
    assert main([*common, "--quantity", "C", "--restrict", "cubic"]) == 0
    assert main([*common, "--quantity", "inner/T"]) == 0
    capsys.readouterr()
    assert main([*common, "--quantity", "C", "--restrict", "linear", "--json"]) == 1
    (verdict,) = entries(capsys)
    assert (verdict["status"], verdict["reason"]) == ("INCONCLUSIVE", "not_applicable")


def test_step_sizes_in_different_units_are_refused(tmp_path: Path, capsys: Capture) -> None:
    files = [write(tmp_path / f"run_{n}.nc", n) for n in COUNTS]
    for file, unit in zip(files[1:], ("s", "s", "ms"), strict=True):
        with netCDF4.Dataset(file, "a") as dataset:
            dataset["dt"].units = unit
    assert main(["judge", *files[:3], "--h", "dt", "--quantity", "T", "--order", "2"]) == 0
    capsys.readouterr()
    assert main(["judge", *files, "--h", "dt", "--quantity", "T"]) == 2
    told = f"{files[3]}: dt: has the unit ms, in {files[1]} it has s: give all levels the same"
    assert told in capsys.readouterr().err


def test_files_that_do_not_fit_are_refused(tmp_path: Path, capsys: Capture) -> None:
    files = [write(tmp_path / f"run_{n}.nc", n) for n in (10, 20, 40)]
    other = tmp_path / "table.csv"
    other.write_text(TABLE)
    empty = tmp_path / "empty.nc"
    netCDF4.Dataset(empty, "w").close()
    quantity = ["--quantity", "T"]
    for arguments, told in (
        ([*files, "--h", "dx"], f"{files[0]}: --quantity: must name the variables to be judged: choose from"),
        ([*files, "--h", "dz", *quantity], f"{files[0]}: --h: dz: is neither an attribute nor"),
        ([*files, "--h", "solver", *quantity], f"{files[0]}: solver: mine: must be a number"),
        ([*files, "--h", "x", *quantity], f"{files[0]}: --h: x: has 11 values, and must have one"),
        ([*files, "--h", "0.1,0.05", *quantity], "--h: 0.1,0.05: has 2 step sizes for 3 files"),
        ([*files, "--h", "0.1,b,c", *quantity], "must be a name, or numbers separated by commas"),
        ([*files, "--h", "0.1,0.05,0.1", *quantity], f"{files[2]}: h: 0.1: is the step size of {files[0]}, too"),
        ([*files, "--h", "0.1,0.05,-1", *quantity], f"{files[2]}: h: -1: must be a finite number above 0"),
        ([*files, "--h", "-.1,0.05,0.02", *quantity], f"{files[0]}: h: -0.1: must be a finite number above 0"),
        ([*files, files[0], "--h", "dx", *quantity], f"{files[0]}: is named twice"),
        ([*files[:2], files[0], "--h", "0.1,0.05,0.025", *quantity], f"{files[0]}: is named twice"),
        ([*files, "--h", "dx", "--quantity", "t"], f"{files[0]}: --quantity: t: the file has no such variable"),
        ([*files, str(empty), "--h", "dx", *quantity], f"{empty}: --h: dx: is neither"),
        ([*files, str(other), "--h", "dx", *quantity], f"{other}: is not a netCDF file"),
    ):  # fmt: skip
        assert main(["judge", *arguments]) == 2
        captured = capsys.readouterr()
        assert told in captured.err
        assert captured.out == ""


def test_a_level_that_does_not_fit_is_named_by_its_file(tmp_path: Path, capsys: Capture) -> None:
    files = [write(tmp_path / f"run_{n}.nc", n) for n in (40, 20, 10)]
    with netCDF4.Dataset(files[0], "a") as file:
        file["T"].units = "m"
    with netCDF4.Dataset(files[2], "a") as file:
        file["T"].units = "K"
    assert main(["judge", *files, "--h", "dx", "--quantity", "T"]) == 2
    told = f"T: {files[0]}: T: has the unit m, the coarsest level has K"
    assert told in capsys.readouterr().err


def test_a_packed_variable_is_known_to_its_spacing(tmp_path: Path, capsys: Capture) -> None:
    """All levels round to the same integer, although their errors differ."""
    files = [str(tmp_path / f"run_{n}.nc") for n in (10, 20, 40)]
    for name, n in zip(files, (10, 20, 40), strict=True):
        with netCDF4.Dataset(name, "w") as file:
            file.dx = 1.0 / n
            variable = file.createVariable("T", "i2")
            variable.scale_factor, variable.add_offset = 0.0123, 0.5
            variable[...] = 1.0 + 0.1 / n**2
    assert main(["judge", *files, "--h", "dx", "--quantity", "T", "--json"]) == 1
    (verdict,) = entries(capsys)
    assert verdict["reason"] == "round_off"
    assert verdict["error_bound"] == pytest.approx(0.0123 / 2)
    assert "rounding of the values" in verdict["sentence"]


def test_missing_values_of_a_file_are_not_finite(tmp_path: Path, capsys: Capture) -> None:
    files = [write(tmp_path / f"run_{n}.nc", n) for n in (10, 20, 40)]
    with netCDF4.Dataset(files[1], "a") as file:
        file["T"][2, 2] = np.ma.masked
    assert main(["judge", *files, "--h", "dx", "--quantity", "T", "--json"]) == 1
    (verdict,) = entries(capsys)
    assert verdict["reason"] == "non_finite"


@pytest.mark.slow
def test_our_own_levels_are_judged_too(tmp_path: Path, capsys: Capture) -> None:
    file = tmp_path / "tiny.yaml"
    file.write_text(
        "title: tiny\nmodel: {kind: spring}\ninitial: {u: 1.0}\ntime: {end: 4.0}\n"
        "levels: [5, 6, 7]\nschemes: [central]\n"
    )
    results = ["--results", str(tmp_path)]
    assert main(["simulate", str(file), "--level", "5", "6", "7", *results]) == 0
    capsys.readouterr()
    levels = [str(tmp_path / f"adhoc/tiny/level_0{level}.nc") for level in (5, 6, 7)]
    sizes = ["--h", "0.125,0.0625,0.03125"]
    assert main(["judge", *levels, *sizes, "--quantity", "u", "--order", "2"]) == 0


def test_a_table_is_judged_without_heavy_libraries(table: Callable[..., str]) -> None:
    program = (
        "import sys\nfrom vibsim.cli import main\n"
        f"assert main(['judge', {table()!r}, '--h', 'dt']) == 0\n"
        "heavy = {'xarray', 'netCDF4', 'numba', 'snakemake', 'matplotlib', 'pydantic', 'yaml', 'scipy'}\n"
        "assert not heavy & set(sys.modules), heavy & set(sys.modules)"
    )  # fmt: skip
    subprocess.run([sys.executable, "-c", program], check=True, capture_output=True)


def test_the_command_needs_no_checkout(table: Callable[..., str], tmp_path: Path) -> None:
    path = table()
    command = [sys.executable, "-P", "-m", "vibsim", "judge", path, "--h", "dt", "--json"]
    ended = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (ended.returncode, ended.stderr) == (0, "")
    assert len(json.loads(ended.stdout)["verdicts"]) == 2
