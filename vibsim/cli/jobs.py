"""The jobs of the workflow after the simulation, usable by hand: analyse, extrapolate, report."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vibsim.cli.common import (
    check_digest,
    one_plan,
    provenance,
    read_all,
    refusal,
    results_folder,
    titled,
)
from vibsim.errors import nearest
from vibsim.plan import Plan
from vibsim.plan.build import extrapolated

if TYPE_CHECKING:
    from vibsim.record import Record

FORMATS = ("svg", "png", "pdf")
"""Formats of figures, as in `vibsim.report.style`, which takes long to import."""
PART_BYTES = 64 * 10**6
"""Bytes of all levels together that an extrapolation reads at a time."""


def analyse(options: Namespace) -> int:
    """Compare all levels; write ``convergence.nc`` and ``summary.json``."""
    plan, results = one_plan(options)
    check_digest(plan, options.digest, plan.analysis)
    from vibsim import store
    from vibsim.analysis import analyse_parts, joined, kept, summarise, verdicts

    _check_shards(plan, options, results)
    experiment = plan.experiment
    folder = options.out or results / plan.key
    thin: list[Record] = []
    with ExitStack() as stack:
        readers = _readers(plan, results, stack)
        parts = kept(analyse_parts(experiment, readers, threads=options.threads), thin)
        used = {key: value for key, value in plan.content.items() if key != "source"}
        store.write_parts(
            folder / "convergence.nc",
            (titled(part, f"{plan.key}: comparison of levels") for part in parts),
            cases=plan.cases,
            digest=plan.analysis,
            provenance=provenance(plan, used),
        )
    record = joined(thin)
    summary = summarise(experiment, verdicts(experiment, record), record)
    store.write_json(folder / "summary.json", summary, digest=plan.analysis)
    return 0


def extrapolate(options: Namespace) -> int:
    """Extrapolate the solution over all levels; write ``best.nc``."""
    plan, results = one_plan(options)
    if plan.best is None:
        raise refusal("EXPERIMENT", options.experiment, "does not ask for `output: best`")
    check_digest(plan, options.digest, plan.extrapolation)
    from vibsim import store
    from vibsim.analysis.extrapolation import best_record

    _check_shards(plan, options, results)
    with ExitStack() as stack:
        readers = _readers(plan, results, stack)
        parts = (
            best_record(
                plan.experiment, {level: read(start, stop) for level, read in readers.items()}
            )
            for start, stop in _ranges(plan)
        )
        store.write_parts(
            options.out or results / plan.best,
            (titled(part, f"{plan.key}: extrapolated over all levels") for part in parts),
            cases=plan.cases,
            digest=plan.extrapolation,
            provenance=provenance(plan, extrapolated(plan.content)),
        )
    return 0


def _ranges(plan: Plan) -> Iterator[tuple[int, int]]:
    """Yield ranges of members whose levels fit into memory together."""
    size = max(1, PART_BYTES * plan.cases // plan.bytes)
    for start in range(0, plan.cases, size):
        yield start, min(start + size, plan.cases)


def _check_shards(plan: Plan, options: Namespace, results: Path) -> None:
    """Refuse where a level file is damaged or another job's."""
    from vibsim import store

    checks = {shard.path: partial(store.check, digest=shard.digest) for shard in plan.shards}
    read_all(options, results, checks)


def _readers(
    plan: Plan, results: Path, stack: ExitStack
) -> dict[int, Callable[[int, int], Record]]:
    """Return what reads a range of members of each level; the files were checked before."""
    from vibsim import store

    files = {
        level.level: [(results / shard.path, shard.digest) for shard in level.shards]
        for level in plan.levels
    }
    return {
        level: stack.enter_context(store.open_level(found)).read for level, found in files.items()
    }


def report(options: Namespace) -> int:
    """Write the report of one experiment, or the index over all results."""
    if options.experiment is None:
        return _index(options)
    formats = _formats(options)
    plan, results = one_plan(options)
    check_digest(plan, options.digest, plan.report)
    from vibsim import store
    from vibsim.report import write

    readers: dict[str, Callable[[Path], Any]] = {
        plan.convergence: partial(store.read, digest=plan.analysis),
        plan.summary: partial(store.read_json, digest=plan.analysis),
    }
    found = read_all(options, results, readers)
    write(
        plan,
        found[plan.convergence],
        found[plan.summary],
        options.out or results / plan.key,
        formats=formats,
        provenance=provenance(plan, plan.content) | {"digest": plan.analysis},
    )
    return 0


def _index(options: Namespace) -> int:
    """Write the page over all results, which takes none of the options of one report."""
    for name in ("digest", "discard", "formats"):
        value = getattr(options, name)
        if value:
            text = "" if value is True else value
            raise refusal(f"--{name}", text, "belongs to the report of one experiment: name it")
    from vibsim.report import write_index

    write_index(options.out or results_folder(options))
    return 0


def _formats(options: Namespace) -> list[str]:
    """Return the formats of the figures, each of them known."""
    chosen = (options.formats or "svg").split(",")
    unknown = [name for name in chosen if name not in FORMATS]
    if unknown:
        raise refusal(
            "--formats", ",".join(unknown), "unknown format", nearest(unknown[0], FORMATS)
        )
    return chosen
