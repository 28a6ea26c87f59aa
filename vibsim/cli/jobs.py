"""The jobs of the workflow, usable by hand: simulate, analyse, report.

A job reads the plan of its experiment and refuses when it is not the plan that it was started for. It
reads no file without its digest; one that is damaged or another job's is named and never used.
"""

from __future__ import annotations

import sys
from argparse import Namespace
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import vibsim
from vibsim.cli.deleted import delete
from vibsim.errors import Fault, FileError, InputError, VibsimError, nearest
from vibsim.plan import Plan, checkout, choose, load

if TYPE_CHECKING:
    from vibsim.record import Record

FORMATS = ("svg", "png", "pdf")
"""Formats of figures, as in `vibsim.report.style`, which takes long to import."""


def simulate(options: Namespace) -> int:
    """Simulate one shard of one level."""
    plan, _ = _plan(options)
    levels = [level.level for level in plan.levels]
    if options.level not in levels:
        raise _refusal("--level", options.level, f"must be one of {', '.join(map(str, levels))}")
    shards = plan.level(options.level).shards
    if not 0 <= options.shard < len(shards):
        raise _refusal("--shard", options.shard, f"must be from 0 to {len(shards) - 1}")
    job = shards[options.shard]
    _check(plan, options.digest, job.digest)
    from vibsim import store
    from vibsim.plan.build import simulated
    from vibsim.simulation import simulate_record

    record = simulate_record(plan.experiment, options.level, job.start, job.stop)
    uses = {**simulated(plan.content), "level": options.level, "cases": [job.start, job.stop]}
    store.write(
        options.out,
        _titled(record, f"{plan.key}: level {options.level}"),
        digest=job.digest,
        provenance=_provenance(plan, uses),
    )
    return 0


def analyse(options: Namespace) -> int:
    """Compare all levels; write ``convergence.nc`` and ``summary.json``."""
    plan, results = _plan(options)
    _check(plan, options.digest, plan.analysis)
    from vibsim import store
    from vibsim.analysis import analyse_records, summarise, verdicts

    read = {shard.path: partial(store.read, digest=shard.digest) for shard in plan.shards}
    shards = _read_all(options, results, read)
    records = {
        level.level: store.join([shards[shard.path] for shard in level.shards])
        for level in plan.levels
    }
    experiment = plan.experiment
    convergence = analyse_records(experiment, records)
    summary = summarise(experiment, verdicts(experiment, convergence), convergence)
    folder = options.out or results / plan.key
    used = {key: value for key, value in plan.content.items() if key != "source"}
    store.write(
        folder / "convergence.nc",
        _titled(convergence, f"{plan.key}: comparison of levels"),
        digest=plan.analysis,
        provenance=_provenance(plan, used),
    )
    store.write_json(folder / "summary.json", summary, digest=plan.analysis)
    return 0


def report(options: Namespace) -> int:
    """Write the report of one experiment, or the index over all results."""
    if options.experiment is None:
        return _index(options)
    formats = _formats(options)
    plan, results = _plan(options)
    _check(plan, options.digest, plan.report)
    from vibsim import store
    from vibsim.report import write

    readers: dict[str, Callable[[Path], Any]] = {
        plan.convergence: partial(store.read, digest=plan.analysis),
        plan.summary: partial(store.read_json, digest=plan.analysis),
    }
    found = _read_all(options, results, readers)
    write(
        plan,
        found[plan.convergence],
        found[plan.summary],
        options.out or results / plan.key,
        formats=formats,
        provenance=_provenance(plan, plan.content) | {"digest": plan.analysis},
    )
    return 0


def _index(options: Namespace) -> int:
    """Write the page over all results, which takes none of the options of one report."""
    for name in ("digest", "discard", "formats"):
        value = getattr(options, name)
        if value:
            text = "" if value is True else value
            raise _refusal(f"--{name}", text, "belongs to the report of one experiment: name it")
    from vibsim.report import write_index

    write_index(options.out or results_folder(options))
    return 0


def results_folder(options: Namespace) -> Path:
    """Return the results folder that was asked for, else that of the checkout."""
    folder: Path = options.results or checkout() / "results"
    if folder.exists() and not folder.is_dir():
        raise _refusal("--results", folder, "must be a folder, this is a file")
    return folder.absolute()


def _formats(options: Namespace) -> list[str]:
    """Return the formats of the figures, each of them known."""
    chosen = (options.formats or "svg").split(",")
    unknown = [name for name in chosen if name not in FORMATS]
    if unknown:
        raise _refusal(
            "--formats", ",".join(unknown), "unknown format", nearest(unknown[0], FORMATS)
        )
    return chosen


def _plan(options: Namespace) -> tuple[Plan, Path]:
    results = results_folder(options)
    choices = choose([options.experiment], checkout())
    if len(choices) != 1:
        raise _refusal("EXPERIMENT", options.experiment, "must be one experiment, not a collection")
    return load(choices[0], results), results


def _check(plan: Plan, wanted: str | None, found: str) -> None:
    if wanted is not None and wanted != found:
        rule = "the experiment or the code changed after this job was planned; run again"
        raise InputError([Fault(plan.file, 0, "", "", rule)])


def _refusal(key: str, value: Any, rule: str, hint: str = "") -> InputError:
    return InputError([Fault("command line", 0, key, str(value), rule, hint)])


def _read_all(
    options: Namespace, results: Path, readers: Mapping[str, Callable[[Path], Any]]
) -> dict[str, Any]:
    """Read every file, and only then refuse: a run makes all that are bad again in one go."""
    found: dict[str, Any] = {}
    errors: list[FileError] = []
    for path, read in readers.items():
        try:
            found[path] = read(results / path)
        except FileError as error:
            errors.append(error)
    if errors:
        kept = _discard(errors, results) if options.discard else []
        raise VibsimError("\n".join([*map(str, errors), *kept]))
    return found


def _discard(errors: Sequence[FileError], results: Path) -> list[str]:
    """Delete every bad file; return why some could not be."""
    kept: list[str] = []
    for bad in errors:
        try:
            delete(bad, results)
        except VibsimError as error:
            kept.append(str(error))
    return kept


def _titled(record: Record, title: str) -> Record:
    return replace(record, attrs={**record.attrs, "title": title})


def _provenance(plan: Plan, uses: dict[str, Any]) -> dict[str, Any]:
    python = ".".join(map(str, sys.version_info[:3]))
    versions = {"vibsim": vibsim.__version__, "python": python, **plan.versions}
    return {"experiment": uses, "versions": versions}
