"""Tables: digits for reading, every digit for computing, nothing that HTML would take for a command."""

from __future__ import annotations

import csv
import io
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vibsim.report import words
from vibsim.report.tables import table
from vibsim.report.tables.table import Column, Table


def _table(*rows):
    columns = (Column("scheme"), Column("difference", "rad", "norm"), Column("order", form="order"))
    return Table("orders", "Orders of 100 % & more", columns, rows)


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_csv_keeps_every_digit(value):
    rows = list(csv.reader(io.StringIO(table.to_csv(_table(("a", value, 2.0))))))
    assert rows[0] == ["scheme", "difference [rad]", "order"]
    assert float(rows[1][1]) == value


def test_csv_leaves_what_does_not_apply_empty():
    text = table.to_csv(_table(('a, "b"', math.nan, None)))
    assert list(csv.reader(io.StringIO(text)))[1] == ['a, "b"', "", ""]


def test_norms_of_a_column_have_a_power_of_ten_where_one_needs_it():
    near = _table(("a", 0.5, 2.0), ("b", 2.0, 2.0))
    far = _table(("a", 0.5, 2.0), ("b", 2e-6, 2.0))
    assert [row[1] for row in near.text_rows()] == ["0.5000", "2.000"]
    assert [row[1] for row in far.text_rows()] == ["5.000·10⁻¹", "2.000·10⁻⁶"]


def test_a_row_of_the_wrong_length_is_refused():
    with pytest.raises(ValueError, match="3 cells"):
        _table(("a", 1.0))


@pytest.mark.parametrize(
    ("value", "form", "text"),
    [
        (None, "norm", "–"), (math.nan, "order", "–"), (math.inf, "norm", "∞"), (0.0, "norm", "0"),
        (1.23456e-7, "norm", "1.235·10⁻⁷"), (-1.23456e-7, "norm", "−1.235·10⁻⁷"), (0.0123456, "norm", "0.01235"),
        (123456.0, "norm", "1.235·10⁵"), (1.99999, "order", "2.000"), (-0.5, "order", "−0.500"),
        (1048576, "integer", "1\N{NARROW NO-BREAK SPACE}048\N{NARROW NO-BREAK SPACE}576"),
        (20.0, "step", "20"), (0.3125, "step", "0.3125"), (20 / 2**26, "step", "2.98023·10⁻⁷"),
        (1.0, "full", "1.000000000"), (0.9958006771243681, "full", "0.9958006771"), (9999.6, "norm", "1.000·10⁴"),
    ],
)  # fmt: skip
def test_numbers_are_written_for_reading(value, form, text):
    assert words.number(value, form) == text
