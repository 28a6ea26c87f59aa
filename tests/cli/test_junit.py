"""The JUnit report: what continuous integration counts."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import jsonschema
import pytest

from vibsim.cli import json_schemas, main
from vibsim.cli.chosen_plans import plans_of
from vibsim.cli.run import junit, outcome
from vibsim.cli.run.snakemake import Job

from .test_outcome_text import check, entry


def written(tmp_path: Path, *rows: dict[str, Any], failures: Any = ()) -> ElementTree.Element:
    junit.write(tmp_path / "report.xml", rows, failures)
    return ElementTree.parse(tmp_path / "report.xml").getroot()


def test_statuses_become_what_continuous_integration_counts(tmp_path: Path) -> None:
    undecided = check("c", "INCONCLUSIVE", reason="pre_asymptotic")
    lost = {**entry(name="lost", error="summary.json: damaged"), "status": "FAIL"}
    failure = {"job": "analyse a/x", "log": "x.log", "tail": ["first", "second"]}
    root = written(
        tmp_path, entry(check("a"), check("b", "FAIL"), undecided), lost, failures=[failure]
    )
    told = {name: root.get(name) for name in ("tests", "failures", "errors")}
    assert told == {"tests": "5", "failures": "2", "errors": "2"}
    suites = {suite.get("name"): suite for suite in root}
    assert list(suites) == ["adhoc/tiny", "adhoc/lost", junit.JOBS]
    tiny = suites["adhoc/tiny"]
    assert [tiny.get(name) for name in ("tests", "failures", "errors")] == ["3", "2", "0"]
    cases = {case.get("name"): case for case in tiny}
    assert cases["a"].find("failure") is None
    failed = cases["b"].find("failure")
    assert failed is not None
    assert (failed.get("type"), failed.get("message")) == ("order_low", "FAIL: order_low")
    assert failed.text == "theta does something.\nUse another start."
    open_one = cases["c"].find("failure")
    assert open_one is not None
    assert open_one.get("message") == "INCONCLUSIVE: pre_asymptotic"
    error = suites["adhoc/lost"].find("testcase/error")
    assert error is not None
    assert error.get("message") == "summary.json: damaged"
    job = suites[junit.JOBS].find("testcase/error")
    assert job is not None
    assert job.text == "first\nsecond"


def test_what_xml_cannot_hold_is_left_out(tmp_path: Path) -> None:
    row = check("<&>", "FAIL", text="\x00\x1b[2J <b> \ud800 & ]]>", advice="")
    (suite,) = written(tmp_path, entry(row))
    (case,) = suite
    assert case.get("name") == "<&>"
    assert (case[0].text or "").split() == ["[2J", "<b>", "&", "]]>"]


def test_a_place_where_nothing_can_be_written_is_refused_first(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    results = tmp_path / "results"
    for place, told in ((tmp_path / "none/x.xml", "there is no folder"), (tmp_path, "a file")):
        command = ["run", "theta_convergence", "--results", str(results), "--junit", str(place)]
        assert main(command) == 2
        assert told in capsys.readouterr().err
        assert main([*command, "--dry-run"]) == 2
    assert not results.exists()


def test_the_report_of_an_earlier_run_does_not_stay(tmp_path: Path) -> None:
    old = tmp_path / "report.xml"
    old.write_text("<testsuites/>")
    junit.check_place(old)
    assert not old.exists()


def test_an_experiment_without_a_summary_is_as_its_schema_says(tmp_path: Path) -> None:
    (plan,) = plans_of(["theta_convergence"], cached=True)
    summaries = [outcome.collect(plan, tmp_path)]
    job = Job("analyse", ("a/x/convergence.nc",), "none.log", "lost")
    failures = outcome.failed_jobs([job], [], tmp_path)
    assert failures[0]["tail"] == ["lost"]
    content = json.loads(outcome.as_json(summaries, failures, tmp_path))
    assert content["experiments"][0]["error"]
    jsonschema.validate(content, json_schemas.run())
