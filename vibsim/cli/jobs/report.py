"""The job ``vibsim report``: write the report of an experiment, or the index of all results."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from vibsim.cli import made_files
from vibsim.cli.jobs import common
from vibsim.core.errors import nearest
from vibsim.core.vocabulary import FIGURE_FORMATS
from vibsim.experiment import citation


def report(options: Namespace) -> int:
    """Write the report of one experiment, or the index of all results."""
    if options.out is not None:
        common.check_to_write("--out", options.out)
    if options.experiment is None:
        return _index(options)
    formats = _formats(options)
    plan, results = common.one_plan(options)
    common.check_digest(plan, options.digest, plan.report)
    from vibsim import store
    from vibsim.report import write

    if plan.has_solver:
        from vibsim.report.page.solver import write
    readers: dict[str, Callable[[Path], Any]] = {
        plan.convergence: partial(store.read, digest=plan.analysis),
        plan.summary: partial(store.read_json, digest=plan.analysis, name=plan.key),
    }
    contents = common.read_all(options, results, readers)
    summary = contents[plan.summary]
    heading = {"title": plan.title, "source": citation.fields(plan.source)}
    if summary != summary | heading:
        summary |= heading
        if options.out is None:
            # No number depends on title and source: if they change, the analysis does not run again.
            with common.on_record(options, results, plan.key, ["summary.json"], plan.analysis):
                store.write_json(results / plan.summary, summary, digest=plan.analysis)
    with common.on_record(options, results, plan.key, ["report.html"], plan.report):
        write(
            plan,
            contents[plan.convergence],
            summary,
            options.out or results / plan.key,
            formats=formats,
            provenance=common.with_settings(plan, plan.content) | {"digest": plan.analysis},
        )
    return 0


def _index(options: Namespace) -> int:
    """Write the index of all results; options of a single report are refused."""
    for name in ("digest", "discard", "formats"):
        value = getattr(options, name)
        if value:
            text = "" if value is True else value
            raise common.refusal(
                f"--{name}", text, "belongs to the report of one experiment: name it"
            )
    from vibsim.report import write_index

    results = common.chosen_results(options)
    with common.on_record(options, results, made_files.INDEX, made_files.OVER_ALL):
        write_index(options.out or results)
    return 0


def _formats(options: Namespace) -> list[str]:
    """Return the formats of the figures; refuse unknown ones."""
    chosen = (options.formats or "svg").split(",")
    unknown = [name for name in chosen if name not in FIGURE_FORMATS]
    if unknown:
        hint = nearest(unknown[0], FIGURE_FORMATS)
        raise common.refusal("--formats", ",".join(unknown), "unknown format", hint)
    return chosen
