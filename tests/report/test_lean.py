"""Pages of experiments that keep no series: the maps and tables are there, and the page says how to see a series."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
import samples
from thinned import thinned

from vibsim import report
from vibsim.core.record import Record, Variable
from vibsim.report.tables import members

ACROSS = {
    "initial.theta": {"linspace": [-2.9, 2.9, 10]},
    "initial.omega": {"linspace": [0.1, 2.9, 9]},
}


def lean(record, times):
    """Return what a lean analysis keeps: no series, one norm."""
    norm = record.words("norm").index("l2")

    def cut(variable):
        if "norm" not in variable.dims:
            return variable
        values = np.take(variable.values, [norm], axis=variable.dims.index("norm"))
        return Variable(variable.dims, values, variable.attrs)

    kept = {name: cut(v) for name, v in record.variables.items() if "t" not in v.dims}
    coords = {name: cut(v) for name, v in record.coords.items() if times or name != "t"}
    return Record(coords, kept, {**record.attrs, "storage": "lean"})


@pytest.mark.usefixtures("unrendered")
@pytest.mark.parametrize("times", [pytest.param(True, marks=pytest.mark.slow), False])
@pytest.mark.parametrize(
    ("sweep", "figures"),
    thinned([
        (ACROSS, {"map_theta_order_0", "map_theta_error_0", "map_period_0"}),
        ({"initial.theta": {"linspace": [0.1, 3.1, 12]}}, {"period", "amplitude", "sweep_order_theta"}),
        ({"initial.theta": [0.5, 3.0], "model.g": [1.0, 400.0, 1e6]}, {"sweep_error_theta", "period"}),
    ], 3),
)  # fmt: skip
def test_a_lean_record_makes_a_page_without_series(tmp_path, sweep, figures, times):
    exp = samples.experiment(sweep=sweep)
    whole = samples.record(exp)
    summary = samples.summary(exp, whole)
    plan = SimpleNamespace(experiment=exp)
    report.write(plan, lean(whole, times), summary, tmp_path)
    names = {path.stem for path in (tmp_path / "figures").iterdir()}
    assert figures < names
    assert not [name for name in names if name.startswith(("differences", "solution", "conserv"))]
    assert any(name.startswith("order_theta_") for name in names)
    text = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "no series over time are stored" in text
    assert ".venv/bin/vibsim run pendulum_lab/theta@" in text
    assert len((tmp_path / "tables/members.csv").read_text().splitlines()) == exp.members + 1
    # the page of the whole record has the same table; its writer alone, without the figures
    members.write_csv(tmp_path / "whole.csv", whole)
    assert (tmp_path / "whole.csv").read_bytes() == (tmp_path / "tables/members.csv").read_bytes()


@pytest.mark.slow
@pytest.mark.usefixtures("without_pictures")
def test_the_worst_members_are_listed_with_their_command(tmp_path):
    exp = samples.experiment(sweep={"model.g": {"logspace": [1.0, 1e6, 20]}})
    record = samples.record(exp)
    summary = samples.summary(exp, record)
    (check,) = summary["checks"]
    check["where"] = {"FAIL": {"text": "FAIL in 9 of 20 results, all with model.g of 300 or more"}}
    for result in check["results"]:
        result["command"] = f"vibsim run pendulum_lab/theta@{result['case']}"
    report.write(SimpleNamespace(experiment=exp), record, summary, tmp_path)
    text = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert len(check["results"]) == 10
    for result in check["results"]:
        assert f".venv/bin/vibsim run pendulum_lab/theta@{result['case']} " in text
    assert "all with g of 300 or more." in text


@pytest.mark.slow
@pytest.mark.usefixtures("unrendered")
def test_a_sweep_whose_checks_ask_about_no_order_has_a_page(tmp_path):
    check = {"value": "amplitude", "below": 4.0}
    exp = samples.experiment(sweep=ACROSS, checks=[check])
    whole = samples.record(exp)
    summary = samples.summary(exp, whole)
    record = lean(whole, False)
    of_orders = (
        "order",
        "order_low",
        "order_high",
        "status",
        "reason",
        "window_first",
        "window_last",
    )
    quantities = ("theta", "omega", "energy", "energy_deviation")
    lacking = {f"{quantity}_{name}" for quantity in quantities for name in of_orders}
    assert lacking & record.variables.keys()
    kept = {name: row for name, row in record.variables.items() if name not in lacking}
    plan = SimpleNamespace(experiment=exp)
    report.write(plan, Record(record.coords, kept, record.attrs), summary, tmp_path)
    head, *rows = (tmp_path / "tables/members.csv").read_text().splitlines()
    assert len(rows) == exp.members
    assert "amplitude" in head
    text = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "A member that runs alone has them" in text
