"""The members' file: every member, every digit that is promised, empty cells, names that hold anything."""

from __future__ import annotations

import cProfile
import csv
import io
from dataclasses import replace

import numpy as np
import pytest
import samples

from vibsim.core.record import Variable
from vibsim.report.data import Results
from vibsim.report.tables import members

SWEEP = {"initial.theta": [0.1, 1.0, 3.0], "model.g": [1.0, 1000.0]}


def rows(path):
    return list(csv.DictReader(io.StringIO(path.read_text(encoding="utf-8"))))


@pytest.fixture(scope="module")
def record():
    labels = ["central", 'a, "b" nan', ",nan"]
    schemes = [{"kind": "central", "label": label} for label in labels[1:]]
    return samples.record(samples.experiment(sweep=SWEEP, schemes=["central", *schemes]))


def test_every_member_of_every_scheme_has_a_row_with_every_digit(tmp_path, record):
    members.write_csv(tmp_path / "m.csv", record)
    found = rows(tmp_path / "m.csv")
    assert len(found) == 18
    assert [row["scheme"] for row in found[::6]] == record.words("scheme")
    for i, row in enumerate(found):
        s, case = divmod(i, 6)
        assert int(row["case"]) == case
        assert float(row["initial.theta [rad]"]) == record["initial_theta"][case]
        order = record["theta_order"][s, case, 1]
        assert row["order of θ"] == ("" if np.isnan(order) else repr(float(order)))
        assert row["exact period [s]"] == repr(float(record["exact_period"][case]))
    assert any(row["order of θ"] == "" for row in found)


def test_no_order_is_written_where_the_verdict_is_undecided(tmp_path, record, monkeypatch):
    """Pages state none there: an order is at most an estimate."""
    undecided = np.zeros((3, 6), np.bool_)
    undecided[0, 0] = True
    members.write_csv(tmp_path / "m.csv", record)
    monkeypatch.setattr(Results, "is_undecided", lambda *_: undecided)
    members.write_csv(tmp_path / "n.csv", record)
    (before, *others), (after, *same) = rows(tmp_path / "m.csv"), rows(tmp_path / "n.csv")
    assert same == others
    names = ("order of θ", "order, low", "order, high")
    assert [after[name] for name in names] == ["", "", ""] != [before[name] for name in names]


def test_long_files_have_nine_digits_of_what_was_measured(tmp_path, record, monkeypatch):
    monkeypatch.setattr(members, "LISTED", 17)
    monkeypatch.setattr(members, "ROWS_AT_A_TIME", 4)
    members.write_csv(tmp_path / "m.csv", record)
    found = rows(tmp_path / "m.csv")
    assert len(found) == 18
    for i, row in enumerate(found):
        exact = float(record["exact_period"][i % 6])
        # half a unit of the ninth digit
        assert abs(float(row["exact period [s]"]) - exact) <= 0.5e-8 * 10.0 ** np.floor(
            np.log10(exact)
        )
        assert float(row["initial.theta [rad]"]) == record["initial_theta"][i % 6]
    assert members.table(record) is None
    assert "9 significant digits" in members.digits(record)


def test_the_table_and_the_file_say_the_same(tmp_path, record):
    members.write_csv(tmp_path / "m.csv", record)
    found, table = rows(tmp_path / "m.csv"), members.table(record)
    for row, cells in zip(found, table.rows, strict=True):
        for column, cell in zip(table.columns, cells, strict=True):
            text = row[column.title]
            assert text == "" if isinstance(cell, float) and np.isnan(cell) else text == str(cell)


def test_without_a_sweep_there_is_no_list():
    plain = samples.record(samples.plain())
    assert members.table(plain) is None
    assert members.digits(plain) == ""


@pytest.mark.slow
def test_many_rows_are_not_written_one_by_one(tmp_path):
    small = samples.record(samples.experiment(sweep=SWEEP))
    count = 20_000
    place = np.arange(count) % 6

    def repeated(variable):
        if "case" not in variable.dims:
            return variable
        values = np.take(variable.values, place, axis=variable.dims.index("case"))
        return Variable(variable.dims, values, variable.attrs)

    kept = {n: v for n, v in small.variables.items() if "t" not in v.dims}
    tables = ({n: repeated(v) for n, v in table.items()} for table in (small.coords, kept))
    large = replace(small, **dict(zip(("coords", "variables"), tables, strict=True)))
    with cProfile.Profile() as profile:
        members.write_csv(tmp_path / "m.csv", large)
    assert sum(entry.callcount for entry in profile.getstats()) < count / 2
    with (tmp_path / "m.csv").open() as file:
        assert sum(1 for _ in file) == count + 1
