"""The making of a level by a solver of the user, for the job ``simulate``; a command runs only where it is allowed."""

from __future__ import annotations

import shutil
from collections.abc import Iterable
from pathlib import Path

from vibsim.cli.failure import sentence
from vibsim.cli.jobs.common import provenance, titled
from vibsim.core.errors import Fault, InputError, VibsimError
from vibsim.plan import Plan, ShardJob
from vibsim.plan.digests import solved

FLAG = "--allow-commands"


def check_allowed(plans: Iterable[Plan], allowed: bool) -> None:
    """Refuse to run commands and functions of experiment files that nobody has allowed.

    Raises
    ------
    InputError
        With every one of them.
    """
    rule = "a program of the user runs only where it is allowed"
    faults = [
        Fault(plan.file, 0, "solver", plan.command, rule, f"run with {FLAG} if you trust this file")
        for plan in plans
        if plan.command and not allowed
    ]
    if faults:
        raise InputError(faults)


def make(plan: Plan, level: int, job: ShardJob, path: Path, threads: int) -> None:
    """Make one level of one member and write it.

    Raises
    ------
    VibsimError
        With the level and the member.
    """
    from vibsim import store
    from vibsim.experiment.solver import restore
    from vibsim.solver import level_output, run

    experiment = restore(plan.content, plan.source_file, plan.settings)
    values = {**experiment.sizes_of(level), **experiment.parameters_of(job.start)}
    words = ", ".join(f"{name} = {value}" for name, value in values.items())
    member = "" if experiment.sweep is None else f", member {job.start}"
    name = f"{plan.key}, level {level}{member} ({words})"
    print(name, flush=True)
    work = path.absolute().with_name(f".{path.name}.work")
    shutil.rmtree(work, ignore_errors=True)
    try:
        work.mkdir(parents=True)
        found = run.make(experiment, level, job.start, work, threads)
        record = level_output.record(experiment, level, job.start, found)
        uses = {**solved(experiment, level, job.start), "level": level, "case": job.start}
        record = titled(record, f"{plan.key}: level {level}")
        store.write(path, record, digest=job.digest, provenance=provenance(plan, uses))
    except (VibsimError, MemoryError, OSError) as error:
        # the folder is gone when somebody reads this
        raise VibsimError(f"{name}: {sentence(error).replace(f'{work}/', '')}") from error
    finally:
        shutil.rmtree(work, ignore_errors=True)
