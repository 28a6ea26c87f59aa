"""Ladders of any solver: the command ``vibsim judge`` and the function `vibsim.judge`."""

from __future__ import annotations

import json
from pathlib import Path

import netCDF4
import numpy as np
import pytest

from vibsim import InputError, judge

from .door import FORMAT, REASONS, ROOT, strict_json, vibsim

KEYS = [
    *("quantity", "status", "reason", "order", "order_low", "order_high", "h_used", "error"),
    *("error_bound", "best", "best_bound", "gci", "sentence", "advice"),
]
H = [0.2, 0.1, 0.05, 0.025]


@pytest.fixture
def table(tmp_path: Path) -> Path:
    path = tmp_path / "study.csv"
    rows = [f"{h},{3 + h**2!r},{1 + h!r}" for h in (H[2], H[0], H[3], H[1])]
    path.write_text("# rows in any order\n\n dt , u,v\n" + "\n".join(rows) + "\n")
    return path


def test_a_table_has_a_verdict_for_each_column(table: Path, tmp_path: Path) -> None:
    ended = vibsim("judge", table, "--h", "dt", "--order", 2, "--json", cwd=tmp_path)
    assert ended.returncode == 1
    assert ended.stderr == ""
    content = strict_json(ended.stdout)
    assert list(content) == ["vibsim_format", "verdicts"]
    assert content["vibsim_format"] == FORMAT
    u, v = content["verdicts"]
    for verdict in (u, v):
        assert list(verdict) == KEYS
        assert verdict["reason"] in REASONS[verdict["status"]]
        assert verdict["sentence"]
    assert (u["status"], v["status"], v["reason"]) == ("PASS", "FAIL", "order_low")
    assert u["order"] == pytest.approx(2.0, abs=0.01)
    assert u["order_low"] <= 2.0 <= u["order_high"]
    assert u["best"] == pytest.approx(3.0, abs=1e-5)
    assert u["error"] == pytest.approx(H[-1] ** 2, rel=0.05)
    assert u["h_used"][-1] == H[-1]
    assert vibsim("judge", table, "--h", "dt", "--at-least", 1).returncode == 0


def test_what_is_refused_ends_with_2_and_says_where(table: Path) -> None:
    table.write_text("dt;u\n0.1;1\n0.05;\n0.02;3\n")
    ended = vibsim("judge", table, "--h", "dt", "--json")
    assert (ended.returncode, ended.stdout) == (2, "")
    for word in (str(table), "3", "u", "is empty"):
        assert word in ended.stderr
    assert "Traceback" not in ended.stderr
    table.write_text("dt;u\n0.1;1\n0.05;nan\n0.02;3\n")
    ended = vibsim("judge", table, "--h", "dt", "--json")
    assert ended.returncode == 1
    assert strict_json(ended.stdout)["verdicts"][0]["reason"] == "non_finite"


def test_files_of_levels_are_judged_and_reported(tmp_path: Path) -> None:
    files = []
    for n in (8, 16, 32, 64):
        files.append(tmp_path / f"run_{n}.nc")
        with netCDF4.Dataset(files[-1], "w", format="NETCDF3_CLASSIC") as file:
            file.createDimension("x", n + 1)
            file.dt = 1.0 / n
            x = np.linspace(0.0, 1.0, n + 1)
            file.createVariable("x", "f8", ("x",))[:] = x
            file.createVariable("T", "f8", ("x",))[:] = np.sin(x) + np.exp(x) / n**2
    common = ["--quantity", "T", "--order", 2, "--report", tmp_path / "page"]
    for size in ("dt", "0.125,0.0625,0.03125,0.015625"):
        ended = vibsim("judge", *files, "--h", size, *common, "--json")
        assert ended.returncode == 0
        (verdict,) = strict_json(ended.stdout)["verdicts"]
        assert verdict["best"] is None
        assert verdict["order"] == pytest.approx(2.0, abs=0.01)
        stored = strict_json((tmp_path / "page/verdict.json").read_text())
        assert stored["verdicts"] == [verdict]
        assert "<svg" in (tmp_path / "page/report.html").read_text()


def test_the_function_takes_numbers_arrays_and_members() -> None:
    verdict = judge(H, [3 + h**2 for h in H], order=2)
    assert (verdict.status, verdict.reason) == ("PASS", "asymptotic")
    assert list(verdict.to_dict()) == KEYS
    json.dumps(verdict.to_dict(), allow_nan=False)
    few = judge(H[:2], [1.0, 2.0])
    assert (few.reason, few.order) == ("too_few_levels", None)
    assert judge(H, [2.0] * 4).reason == "exact"
    both = judge(H, [np.array([3 + h**2, 3 + h]) for h in H], order=2, members=True)
    assert [one.status for one in both] == ["PASS", "FAIL"]
    assert judge({"dt": H, "dx": H}, [3 + h**2 for h in H], order=2).status == "PASS"
    with pytest.raises(InputError):
        judge(H[:3], [3 + h**2 for h in H])


def test_the_schema_of_the_verdicts_is_published() -> None:
    schema = json.loads((ROOT / "workflow/schemas/verdict.schema.json").read_text())
    assert schema["properties"]["verdicts"]["items"]["required"] == KEYS
