"""Tables: digits for reading, every digit for computing, nothing that LaTeX or HTML would take for a command."""

from __future__ import annotations

import csv
import io
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vibsim.report.tables import table
from vibsim.report.tables.table import Column, Table
from vibsim.report.text import words


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


def test_latex_is_booktabs_and_escaped():
    text = table.to_latex(_table((r"a_b & \input{x} 50% #1 $x^2~", 1.5e-12, 2.0)))
    assert r"\toprule" in text
    assert r"\caption{Orders of 100 \% \& more}" in text
    assert (
        r"a\_b \& \textbackslash{}input\{x\} 50\% \#1 \$x\textasciicircum{}2\textasciitilde{}"
        in text
    )
    assert r"1.500$\cdot$10$^{-12}$" in text
    assert r"\begin{tabular}{lrr}" in text


def test_latex_has_no_letter_that_pdflatex_does_not_know():
    for text in (
        "m √s",
        "φ(u)",
        "[D₂ₜu]",
        "x₁₀",
        "“a”",
        "θ′ ≤ 10⁻³ … ∞",
        "1\N{NARROW NO-BREAK SPACE}024 × ω²",
    ):
        assert table.escape(text).isascii(), text
    assert table.escape("10⁻³ m √s") == r"10$^{-3}$ m $\surd$s"


@given(st.text())
def test_latex_escapes_every_special_character(text):
    bare = table.escape(text)
    for token in table._SPECIAL.values():
        bare = bare.replace(token, "")
    assert not set("&%#_~^\\") & set(_without_powers(bare))


def _without_powers(text):
    import re

    return re.sub(r"\$\^\{-?[-0-9]*\}\$", "", text)


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
