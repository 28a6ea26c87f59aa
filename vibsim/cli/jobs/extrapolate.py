"""The job ``vibsim extrapolate``: extrapolate the solution of an experiment over all its levels."""

from __future__ import annotations

from argparse import Namespace

from vibsim.cli.jobs import common
from vibsim.plan.digests import extrapolated

PART_BYTES = 64 * 10**6  # bytes, over all levels, that an extrapolation reads at a time


def extrapolate(options: Namespace) -> int:
    """Extrapolate the solution over all levels; write ``best.nc``."""
    plan, results = common.one_plan(options)
    if plan.best is None:
        raise common.refusal("EXPERIMENT", options.experiment, "does not have `output: best`")
    common.check_digest(plan, options.digest, plan.extrapolation)
    from vibsim import store
    from vibsim.comparison.best_solution import best_record

    size = max(1, PART_BYTES * plan.cases // plan.bytes)
    with (
        common.on_record(options, results, plan.key, ["best.nc"], plan.extrapolation),
        common.open_levels(plan, options, results) as levels,
    ):
        ranges = ((i, min(i + size, plan.cases)) for i in range(0, plan.cases, size))
        parts = (
            best_record(plan.experiment, {level: read(*cases) for level, read in levels.items()})
            for cases in ranges
        )
        store.write_parts(
            options.out or results / plan.best,
            (common.titled(part, f"{plan.key}: extrapolated over all levels") for part in parts),
            cases=plan.cases,
            digest=plan.extrapolation,
            provenance=common.provenance(plan, extrapolated(plan.content)),
        )
    return 0
