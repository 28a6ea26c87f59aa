"""The job ``vibsim analyse``: compare all levels of an experiment and decide its checks."""

from __future__ import annotations

from argparse import Namespace
from typing import TYPE_CHECKING

from vibsim.cli.jobs import common
from vibsim.plan.digests import analysed

if TYPE_CHECKING:
    from vibsim.core.record import Record


def analyse(options: Namespace) -> int:
    """Compare all levels; write ``convergence.nc`` and ``summary.json``."""
    if options.out is not None:
        common.check_to_write("--out", options.out)
    plan, results = common.one_plan(options)
    common.check_digest(plan, options.digest, plan.analysis)
    if plan.has_solver:
        from vibsim.cli.jobs.judge_levels import judge_levels

        return judge_levels(plan, options, results)
    from vibsim import store
    from vibsim.analysis import analyse_parts, join_parts, keep_for_verdicts, summarise, verdicts

    experiment = plan.experiment
    folder = options.out or results / plan.key
    thin: list[Record] = []
    with common.on_record(options, results, plan.key, common.COMPARED, plan.analysis):
        with common.open_levels(plan, options, results) as levels:
            compared = analyse_parts(experiment, levels, processes=options.threads)
            parts = keep_for_verdicts(experiment, compared, thin)
            store.write_parts(
                folder / "convergence.nc",
                (common.titled(part, f"{plan.key}: comparison of levels") for part in parts),
                cases=plan.cases,
                digest=plan.analysis,
                provenance=common.with_settings(plan, analysed(plan.content)),
            )
        record = join_parts(thin)
        summary = summarise(experiment, verdicts(experiment, record), record)
        store.write_json(folder / "summary.json", summary, digest=plan.analysis)
    return 0
