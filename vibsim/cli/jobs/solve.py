"""The job ``vibsim simulate`` for a user's own solver; a program runs only where the command line allows it."""

from __future__ import annotations

import shutil
from collections.abc import Iterable
from pathlib import Path

from vibsim.cli.failure import sentence
from vibsim.cli.jobs.common import provenance, titled
from vibsim.core.errors import Fault, InputError, VibsimError
from vibsim.core.set_option import ALLOW
from vibsim.plan import Plan, ShardJob
from vibsim.plan.digests import solved


def check_allowed(plans: Iterable[Plan], allowed: bool) -> None:
    """Refuse all commands and functions of experiment files unless the command line allows them."""
    rule = "a program of the user runs only where it is allowed"
    faults = [
        Fault(
            plan.file, 0, "solver", plan.command, rule, f"run with {ALLOW} if you trust this file"
        )
        for plan in plans
        if plan.command and not allowed
    ]
    if faults:
        raise InputError(faults)


def make(plan: Plan, level: int, job: ShardJob, path: Path, threads: int) -> None:
    """Run the solver for one member at one level and write its result; an error names both."""
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
        output = run.make(experiment, level, job.start, work, threads)
        record = level_output.record(experiment, level, job.start, output)
        uses = {**solved(experiment, level, job.start), "level": level, "case": job.start}
        record = titled(record, f"{plan.key}: level {level}")
        store.write(path, record, digest=job.digest, provenance=provenance(plan, uses))
    except (VibsimError, MemoryError, OSError) as error:
        # the working folder is deleted before anybody reads the message
        raise VibsimError(f"{name}: {sentence(error).replace(f'{work}/', '')}") from error
    finally:
        shutil.rmtree(work, ignore_errors=True)
