"""Where the jobs of a run are done: on this machine, or where an executor of Snakemake sends them."""

from __future__ import annotations

import os
from argparse import Namespace
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib.util import find_spec
from pathlib import Path
from pkgutil import iter_modules

from vibsim.cli import resources
from vibsim.cli.jobs.common import refusal
from vibsim.core.errors import nearest
from vibsim.plan import Plan

PLUG_IN = "snakemake_executor_plugin_"
PROFILES = ("config.yaml", "config.v8+.yaml", "config.v9+.yaml")
"""Names that the file of a profile may have."""
OVERHEAD = 500
"""Megabytes for the executor's own processes beside a job: 140 in a batch step of SLURM, 350 in a job step."""
RETRIES = 2
"""How often a job is tried again, with more memory each time, where a scheduler may have killed it."""


@dataclass(frozen=True)
class Executor:
    """What Snakemake is told of where jobs run."""

    arguments: Sequence[str]
    config: Mapping[str, int] = field(default_factory=dict)
    """What `vibsim.cli.workflow.names_of` takes beside experiments."""
    is_remote: bool = False
    """Whether jobs run in other processes than those of this command, which it must cancel."""


def chosen(options: Namespace, plans: Sequence[Plan], results: Path) -> Executor:
    """Return the executor that a command line asks for; this machine must have room for what runs here.

    Raises
    ------
    InputError
        Where there is no such executor or profile, or not enough room.
    """
    name, profile = options.executor, options.profile
    if not name and not profile:
        if options.jobs:
            raise refusal("--jobs", options.jobs, "belongs to --executor", "give --cores")
        resources.check(plans, results)
        cores = str(options.cores or len(os.sched_getaffinity(0)))
        memory = f"mem_mb={resources.megabytes(plans)}"
        return Executor(["--cores", cores, "--resources", memory, *options.handed])
    arguments: list[str] = []
    if name:
        _check_name(name)
        if not options.jobs and not profile:
            raise refusal("--executor", name, "needs --jobs N", "the jobs that it has at once")
        arguments += ["--executor", name]
    if profile:
        if not any((profile / file).is_file() for file in PROFILES):
            rule = f"must be a folder with the file {PROFILES[0]}"
            raise refusal("--profile", profile, rule)
        arguments += ["--profile", str(profile.absolute())]
    if options.jobs:
        arguments += ["--jobs", str(options.jobs)]
    arguments += ["--retries", str(RETRIES), *options.handed]
    config = {"cores": options.cores or 1, "overhead": OVERHEAD}
    return Executor(arguments, config, is_remote=True)


def _check_name(name: str) -> None:
    if find_spec(PLUG_IN + name.replace("-", "_")) is not None:
        return
    found = (row.name for row in iter_modules() if row.name.startswith(PLUG_IN))
    known = [module.removeprefix(PLUG_IN).replace("_", "-") for module in found]
    package = f"snakemake-executor-plugin-{name}"
    rule = f"there is no such executor; it comes with the package {package}"
    raise refusal("--executor", name, rule, nearest(name, sorted(known)))
