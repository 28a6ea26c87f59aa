"""Texts of a user in tables: no spreadsheet and no LaTeX runs them, and numbers stay numbers."""

from __future__ import annotations

import csv
import io
import re

import pytest

from vibsim.report.tables.latex import to_latex
from vibsim.report.tables.table import Cell, Column, Table, to_csv

FORMULAS = [
    "=1+1",
    "+1+1",
    "-1+1",
    "@SUM(A1)",
    "\t=1+1",
    "\r=1",
    '=HYPERLINK("http://a.b","c")',
    "-cmd|' /C calc'!A0",
    "\uff1d1+1",
]
TEXTS = [
    r"\input{secret}",
    r"\write18{touch x}",
    "a & b \\\\ c",
    "50 % of $x$ #1 x_0 {y} ~ ^",
    "^^5cinput",
    "a\nb\r\n\nc\td",
]


def table(*cells: Cell, header: str = "x") -> Table:
    return Table("t", header, (Column(header),), tuple((cell,) for cell in cells))


def read_back(text: str) -> list[str]:
    return [row[0] for row in csv.reader(io.StringIO(text, newline=""))]


@pytest.mark.parametrize("text", FORMULAS)
def test_a_spreadsheet_runs_no_text(text: str) -> None:
    assert read_back(to_csv(table(text, header=text))) == ["'" + text.replace("\r", "\n")] * 2


def test_numbers_and_plain_texts_stay_as_they_are() -> None:
    cells: list[Cell] = [-1.5, 3, "-1.5", "+2e-3", "-inf", "a=b", "", "1 - 2", "'quoted'", -0.0]
    found = read_back(to_csv(table(*cells)))
    assert found == [
        "x",
        "-1.5",
        "3",
        "-1.5",
        "+2e-3",
        "-inf",
        "a=b",
        "",
        "1 - 2",
        "'quoted'",
        "-0.0",
    ]
    assert to_csv(table(-1.5)) == "x\n-1.5\n"


@pytest.mark.parametrize("text", TEXTS)
def test_latex_runs_no_text(text: str) -> None:
    made = to_latex(table(text, header=text))
    plain = to_latex(table("?", header="?"))
    left = made
    for known in (r"\textbackslash{}", r"\textasciitilde{}", r"\textasciicircum{}"):
        left = left.replace(known, "")
    left = re.sub(r"\\[&%$#_{}]", "", left)
    # nothing is left that LaTeX would act on, but what every table has
    for sign in "\\{}&$#_%~^":
        assert left.count(sign) == plain.count(sign), sign
    assert len(made.splitlines()) == len(plain.splitlines())
