"""Verdicts as a JUnit report for continuous integration: an experiment is a suite, a check is a test case.

FAIL and INCONCLUSIVE are failures, with their reasons. Missing verdicts, because a job failed or a result is damaged,
are errors.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from vibsim.cli.jobs.common import refusal
from vibsim.cli.outcome_text import Entry
from vibsim.cli.terminal import clean
from vibsim.store import write_text

JOBS = "jobs of the workflow"  # name of the suite of failed jobs


def check_place(path: Path) -> None:
    """Check before a run that the report can be written to `path`, and remove the report of an earlier run.

    Raises InputError where the folder does not exist, or `path` exists and is not a file.
    """
    rule = "" if path.parent.is_dir() else f"there is no folder {path.parent}"
    if path.exists() and not path.is_file():
        rule = "must be a file"
    if rule:
        raise refusal("--junit", path, rule)
    path.unlink(missing_ok=True)


def write(path: Path, summaries: Sequence[Entry], failures: Sequence[Entry]) -> None:
    """Write the report of a run in one step."""
    root = Element("testsuites", name="vibsim")
    for entry in summaries:
        suite = SubElement(root, "testsuite", name=f"{entry['collection']}/{entry['experiment']}")
        for check in entry["checks"]:
            _check(_case(suite, entry, check["id"]), check)
        if "error" in entry:
            case = _case(suite, entry, "verdicts")
            _problem(case, "error", "no_verdicts", str(entry["error"]))
    if failures:
        suite = SubElement(root, "testsuite", name=JOBS)
        for failure in failures:
            case = _case(suite, {"collection": "vibsim", "experiment": "jobs"}, failure["job"])
            lines = "\n".join(map(clean, failure["tail"]))
            _problem(case, "error", "failed_job", "the job failed", lines)
    for element in (*root, root):
        counts = {
            "tests": len(element.findall(".//testcase")),
            "failures": len(element.findall(".//failure")),
            "errors": len(element.findall(".//error")),
        }
        element.attrib.update({name: str(count) for name, count in counts.items()})
    ElementTree.indent(root)
    text = ElementTree.tostring(root, encoding="unicode")
    write_text(path, f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n')


def _check(case: Element, check: Entry) -> None:
    if check["status"] == "PASS":
        SubElement(case, "system-out").text = clean(check["text"])
        return
    details = "\n".join(clean(text) for text in (check["text"], check["advice"]) if text)
    message = f"{check['status']}: {check['reason']}"
    _problem(case, "failure", str(check["reason"]), message, details)


def _case(suite: Element, entry: Entry, name: str) -> Element:
    experiment = f"{entry['collection']}.{entry['experiment']}"
    return SubElement(suite, "testcase", classname=experiment, name=clean(name))


def _problem(case: Element, tag: str, kind: str, message: str, text: str = "") -> None:
    SubElement(case, tag, type=kind, message=clean(message)).text = text
