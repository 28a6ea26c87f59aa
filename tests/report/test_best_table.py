"""The table of best values: both error bars, told apart, and rounded to what is known."""

from __future__ import annotations

import csv
import io
import re
from dataclasses import replace

import numpy as np
import pytest
import samples

from vibsim.analysis import analyse_records
from vibsim.core.record import Record
from vibsim.report import choice, words
from vibsim.report.data import Results
from vibsim.report.tables import best
from vibsim.report.tables.latex import to_latex
from vibsim.report.tables.table import to_csv
from vibsim.simulation import simulate_record


def table(exp: object) -> tuple[Record, best.Table]:
    record = samples.record(exp)
    found = best.table(record, choice.members(record, "theta"))
    assert found is not None
    return record, found


def rows(found: best.Table) -> dict[str, dict[str, str]]:
    return {row["number"]: row for row in csv.DictReader(io.StringIO(to_csv(found)))}


def test_every_number_is_that_of_the_record() -> None:
    record, found = table(samples.plain())
    row = rows(found)["period [s]"]
    assert float(row["finest level"]) == record["period"][0, 0, -1]
    assert float(row["best value"]) == record["period_richardson"][0, 0]
    assert float(row["bound"]) == record["period_richardson_error"][0, 0]
    assert float(row["GCI"]) == record["period_gci"][0, 0]
    exact = float(record["exact_period"][0])
    assert float(row["true error"]) == abs(float(row["best value"]) - exact)
    assert float(row["true error"]) <= float(row["bound"])
    assert row["convergence"] == "monotone"
    assert re.fullmatch(r"\d+ to 9", row["levels"])
    end = rows(found)["θ at the end [rad]"]
    assert float(end["true error"]) == abs(float(end["best value"]) - record["theta_exact"][0, -1])


def test_values_are_read_with_the_digits_that_are_known() -> None:
    _, found = table(samples.plain())
    read = next(row for row in found.text_rows() if row[0] == "period [s]")
    place = [column.header for column in found.columns].index("best value")
    assert re.fullmatch(r"6\.6999\d{3,4}", read[place])
    assert read[place + 1].startswith("1.3·10")


def test_what_is_unknown_is_said() -> None:
    record, _ = table(samples.plain())
    bound = record.variables["period_richardson_error"]
    record.variables["period_richardson_error"] = replace(bound, values=np.nan * bound.values)
    found = best.table(record, choice.members(record, "theta"))
    assert found is not None
    assert any("unknown" in row for row in found.text_rows())
    assert rows(found)["period [s]"]["bound"] == ""


def test_one_level_has_no_table_and_a_sweep_names_its_members() -> None:
    exp = samples.plain(levels=[9])
    record = samples.record(exp)
    assert best.table(record, choice.members(record, "theta")) is None
    _, found = table(samples.swept(4))
    assert "member" in [column.header for column in found.columns]


def test_a_lean_record_has_period_and_amplitude() -> None:
    exp = samples.swept(4)
    levels = {level: simulate_record(exp, level) for level in exp.levels}
    lean = {
        level: Record(row.coords, row.variables, {**row.attrs, "storage": "lean"})
        for level, row in levels.items()
    }
    record = Results.of(exp, analyse_records(exp, lean))
    found = best.table(record, choice.members(record, "theta"))
    assert found is not None
    assert {row[0] for row in found.rows} == {"period [s]", "amplitude [rad]"}
    assert not {"GCI", "order"} & {column.header for column in found.columns}


def test_latex_has_every_row() -> None:
    _, found = table(samples.several())
    text = to_latex(found)
    assert text.count(r"\\") == len(found.rows) + 1
    assert "nan" not in text


@pytest.mark.parametrize(
    ("value", "error", "text"),
    [
        (6.69997481, 1.3e-6, "6.6999748"),
        (-0.958786, 3.6e-4, "−0.95879"),
        (123.456, 20.0, "123"),
        (0.0, 1e-3, "0.0000"),
        (1.0, 0.0, "1"),
        (1.0, float("nan"), "1"),
        (2.5e-7, 0.0, "2.5·10⁻⁷"),
        (0.000123456789012345, 1.2e-15, "1.234567890123·10⁻⁴"),
        (-1.5e300, 2.5e295, "−1.500000·10³⁰⁰"),
        (0.123456789012345, 4.5e-14, "0.123456789012345"),
    ],
)
def test_rounding(value: float, error: float, text: str) -> None:
    assert best.rounded(value, error).text == text


def test_what_is_never_negative_and_may_be_zero_is_said_to_be_below_its_bound() -> None:
    """The levels leave no energy error, so that its limit is -1e-8 with a larger bound."""
    _, found = table(samples.plain())
    header = [column.header for column in found.columns]
    place = header.index("best value")
    read = next(row for row in found.text_rows() if row[0].startswith("max |E"))
    held = float(next(row for row in found.rows if str(row[0]).startswith("max |E"))[place])
    bound = float(next(row for row in found.rows if str(row[0]).startswith("max |E"))[place + 1])
    assert held < 0.0
    assert read[place] == f"below {words.ceiling(held + bound)}"
    assert best.best("min", -1e-8, 1e-6).text == "−1·10⁻⁸"


@pytest.mark.parametrize(
    ("size", "text"), [(4.653e-7, "4.7·10⁻⁷"), (1.0, "1.0"), (9.95e3, "1.0·10⁴")]
)
def test_two_digits_that_are_not_less(size: float, text: str) -> None:
    assert words.ceiling(size) == text


def test_a_period_of_a_motion_that_has_none_is_left_out_unless_it_is_asked_for() -> None:
    driven = samples.experiment(
        model={"kind": "duffing", "delta": 0.1, "alpha": 1.0, "beta": 0.04, "gamma": 1.0, "omega": 1.0},
        initial={"u": 0.0, "v": 0.0}, schemes=["rk4"],
    )  # fmt: skip
    record = samples.record(driven)
    shown = choice.members(record, "u")
    found = [row[0] for row in best.table(record, shown).rows]
    assert not [
        name for name in found if name.startswith(("period", "growth", "angular frequency"))
    ]
    assert any(name.startswith("amplitude") for name in found)
    asked = [row[0] for row in best.table(record, shown, ["period"]).rows]
    assert [name for name in asked if name not in found] == ["period [s]"]
