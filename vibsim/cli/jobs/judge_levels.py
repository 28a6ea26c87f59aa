"""The job ``vibsim analyse`` for the levels of a user's own solver."""

from __future__ import annotations

from argparse import Namespace
from functools import partial
from pathlib import Path

from vibsim import store
from vibsim.cli.jobs.common import COMPARED, on_record, read_all, titled, with_settings
from vibsim.core.record import Record
from vibsim.experiment.solver import restore
from vibsim.plan import Plan
from vibsim.plan.digests import analysed
from vibsim.solver import analysis


def judge_levels(plan: Plan, options: Namespace, results: Path) -> int:
    """Compare all levels; write ``convergence.nc`` and ``summary.json``."""
    experiment = restore(plan.content, plan.source_file, plan.settings)
    shards = {shard.path: partial(store.check, digest=shard.digest) for shard in plan.shards}
    read_all(options, results, shards)

    def read(member: int) -> list[Record]:
        shards = (level.shards[member] for level in plan.levels)
        return [store.read(results / shard.path, digest=shard.digest) for shard in shards]

    checks = analysis.judge_members(experiment, read)
    folder = options.out or results / plan.key
    record = titled(analysis.record(experiment, checks), f"{plan.key}: comparison of levels")
    uses = with_settings(plan, analysed(plan.content))
    summary = analysis.summarise(experiment, checks)
    with on_record(options, results, plan.key, COMPARED, plan.analysis):
        store.write(folder / "convergence.nc", record, digest=plan.analysis, provenance=uses)
        store.write_json(folder / "summary.json", summary, digest=plan.analysis)
    return 0
