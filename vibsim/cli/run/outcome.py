"""What a run has found: every experiment and every check, as a table or as JSON."""

from __future__ import annotations

import json
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from vibsim.cli import results_folder
from vibsim.core.errors import FileError
from vibsim.core.vocabulary import FORMAT, worst
from vibsim.plan import Plan
from vibsim.store import read_json

_LOG_LINES = 12


@dataclass(frozen=True)
class Failure:
    """A job that failed, with the end of its log."""

    job: str
    log: str
    tail: tuple[str, ...]


@dataclass(frozen=True)
class Finding:
    """The summary of an experiment, or why there is none."""

    plan: Plan
    summary: Mapping[str, Any] | None
    problem: str

    @property
    def status(self) -> str:
        """Status of the whole experiment; one without a summary has failed."""
        return str(self.summary["status"]) if self.summary else "FAIL"


def collect(plan: Plan, results: Path) -> Finding:
    """Read the summary of an experiment; delete one that is damaged or outdated."""
    path = results / plan.summary
    if not path.is_file():
        return Finding(plan, None, "did not finish: it has no summary")
    try:
        return Finding(plan, read_json(path, digest=plan.analysis, name=plan.key), "")
    except FileError as error:
        results_folder.delete(error, results)
        return Finding(plan, None, f"summary.json: {error.reason}")


def tail(path: Path) -> tuple[str, ...]:
    """Return the last lines of a log."""
    try:
        lines = path.read_text(errors="replace").splitlines()
    except OSError:
        return ()
    return tuple(line for line in lines if line.strip())[-_LOG_LINES:]


def status(findings: Sequence[Finding], failures: Sequence[Failure]) -> str:
    """Return the status of the whole run: PASS where every check passed and every job ended well."""
    return worst([finding.status for finding in findings] + ["FAIL"] * bool(failures))


def as_json(findings: Sequence[Finding], failures: Sequence[Failure], results: Path) -> str:
    """Return the outcome as JSON text."""
    content = {
        "vibsim_format": FORMAT,
        "status": status(findings, failures),
        "results": str(results),
        "experiments": [_entry(finding) for finding in findings],
        "failed_jobs": [asdict(failure) for failure in failures],
    }
    return json.dumps(content, indent=1, ensure_ascii=False)


def _entry(finding: Finding) -> dict[str, Any]:
    if finding.summary is not None:
        return dict(finding.summary)
    plan = finding.plan
    return {
        "collection": plan.collection,
        "experiment": plan.name,
        "title": plan.title,
        "status": finding.status,
        "checks": [],
        "failures": [],
        "error": finding.problem,
    }


def as_text(
    findings: Sequence[Finding], failures: Sequence[Failure], columns: int
) -> Iterator[str]:
    """Yield the lines of the table, the failed jobs and the count of all checks.

    Parameters
    ----------
    findings, failures
        What was found.
    columns
        Width of the terminal: a check that passed has one line, any other its whole text.
    """
    for finding in findings:
        yield f"{finding.plan.key}  {finding.status}"
        if finding.summary is None:
            yield f"  {finding.problem}"
        else:
            yield from _checks(finding.summary["checks"], columns)
    for failure in failures:
        yield f"\nfailed: {failure.job} (log: {failure.log})"
        yield from (f"  {line}" for line in failure.tail)
    checks = [check["status"] for f in findings if f.summary for check in f.summary["checks"]]
    counted = "1 experiment" if len(findings) == 1 else f"{len(findings)} experiments"
    passed = f"{checks.count('PASS')} of {len(checks)} checks passed"
    yield f"\n{counted}, {passed}: {status(findings, failures)}"


def _checks(checks: Sequence[Mapping[str, Any]], columns: int) -> Iterator[str]:
    fields = ("status", "reason", "id")
    rows = [[str(check[field] or "") for field in fields] for check in checks]
    widths = [max(len(row[i]) for row in rows) for i in range(3)]
    for row, check in zip(rows, checks, strict=True):
        head = "  " + "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True))
        if check["status"] == "PASS":
            room = max(columns - len(head) - 2, 30)
            yield f"{head}  {textwrap.shorten(check['text'], room, placeholder=' ...')}"
            continue
        yield head.rstrip()
        for text in filter(None, (check["text"], check["advice"])):
            yield textwrap.indent(textwrap.fill(text, max(columns - 6, 30)), " " * 6)
