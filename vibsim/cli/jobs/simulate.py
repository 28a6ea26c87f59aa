"""The job ``vibsim simulate``: one shard of one level, or of several cheap levels one after the other.

A file that is intact and up to date is kept, and a level that fails does not stop the others: Snakemake repeats a whole
job, and files that it has already made need not be made twice.
"""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from vibsim.cli.failure import sentence
from vibsim.cli.jobs.common import check_digest, on_record, one_plan, provenance, refusal, titled
from vibsim.core.errors import FileError, VibsimError
from vibsim.plan import Plan, ShardJob
from vibsim.plan.digests import batch_digest


def simulate(options: Namespace) -> int:
    """Simulate one shard of a level into a given file, or of several levels into the files of the plan."""
    plan, results = one_plan(options)
    jobs = _jobs(plan, options.level, options.shard)
    check_digest(plan, options.digest, batch_digest([job.digest for job in jobs]))
    make = _make
    if plan.has_solver:
        from vibsim.cli.jobs import solve

        solve.check_allowed([plan], options.allow_commands)
        make = solve.make
    if options.out is not None:
        if len(jobs) > 1:
            raise refusal("--out", options.out, "is one file, and cannot hold several levels")
        make(plan, options.level[0], jobs[0], options.out, options.threads)
        return 0
    failed = []
    for level, job in zip(options.level, jobs, strict=True):
        path = results / job.path
        if is_made(path, job):
            print(f"{job.path}: is up to date", flush=True)
            continue
        name = Path(job.path).relative_to(plan.key).as_posix()
        try:
            with on_record(options, results, plan.key, [name], job.digest):
                make(plan, level, job, path, options.threads)
        except Exception as error:
            where = "" if isinstance(error, VibsimError) else f"{_named(plan, level, job)}: "
            failed.append(f"{where}{sentence(error)}")
    if failed:
        raise VibsimError("\n".join(failed))
    return 0


def _jobs(plan: Plan, levels: Sequence[int], shard: int) -> list[ShardJob]:
    known = [level.level for level in plan.levels]
    for level in levels:
        if level not in known:
            raise refusal("--level", level, f"must be one of {', '.join(map(str, known))}")
        last = len(plan.level(level).shards) - 1
        if not 0 <= shard <= last:
            raise refusal("--shard", shard, f"must be from 0 to {last}")
    return [plan.level(level).shards[shard] for level in levels]


def is_made(path: Path, job: ShardJob) -> bool:
    """Tell whether a file exists, is intact and was made by `job`."""
    from vibsim import store

    with suppress(FileError):
        if path.exists():
            store.check(path, digest=job.digest)
            return True
    return False


def _make(plan: Plan, level: int, job: ShardJob, path: Path, threads: int) -> None:
    """Simulate the members of a file and write it; an error names the level and the members."""
    from vibsim import store
    from vibsim.plan.digests import simulated, values_digest
    from vibsim.simulation import simulate_record

    # if the process is killed, the last line of its log shows where
    print(_named(plan, level, job), flush=True)
    experiment = plan.experiment
    uses = {
        **simulated(plan.content),
        "level": level,
        "cases": [job.start, job.stop],
        "swept": list(experiment.sweep.keys) if experiment.sweep else [],
        "values": values_digest(experiment, job.start, job.stop),
    }
    try:
        record = simulate_record(experiment, level, job.start, job.stop, threads=threads)
        record = titled(record, f"{plan.key}: level {level}")
        store.write(path, record, digest=job.digest, provenance=provenance(plan, uses))
    except (VibsimError, MemoryError, OSError) as error:
        raise VibsimError(f"{_named(plan, level, job)}: {sentence(error)}") from error


def _named(plan: Plan, level: int, job: ShardJob) -> str:
    members = f"members {job.start} to {job.stop - 1}" if job.stop - job.start > 1 else ""
    return f"{plan.key}, level {level}, {members or f'member {job.start}'}"
