"""Where the jobs of a run are executed: on this machine, or through an executor plug-in of Snakemake."""

from __future__ import annotations

import subprocess
from argparse import Namespace
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib.util import find_spec
from pathlib import Path
from pkgutil import iter_modules
from typing import Any

from vibsim.cli import resources
from vibsim.cli.jobs.common import refusal
from vibsim.core.errors import InputError, nearest
from vibsim.core.home import home
from vibsim.core.processes import usable_cores
from vibsim.plan import Plan
from vibsim.plan.workflow_names import GROUP, group_size

PLUG_IN = "snakemake_executor_plugin_"
PROFILES = ("config.yaml", "config.v8+.yaml", "config.v9+.yaml")  # names of the file of a profile
SHIPPED = ("slurm", "generic")  # in ``workflow/profiles``: for SLURM, and for any other executor
CONFIGURED = ("cores", "overhead", "here")
"""Settings of vibsim in a profile: cores of a job, memory of the executor's own processes [MB], and the total time of
analyses and pages up to which they run here and not as jobs [s]."""


@dataclass(frozen=True)
class Executor:
    """Options of Snakemake that say where jobs run."""

    arguments: Sequence[str]
    config: Mapping[str, int] = field(default_factory=dict)  # for `vibsim.cli.workflow.names_of`
    is_remote: bool = False  # whether jobs run elsewhere, so that an interrupt must cancel them
    is_extended: bool = False  # whether arguments are the user's own, and may name plug-ins


def chosen(options: Namespace, plans: Sequence[Plan], results: Path) -> Executor:
    """Return the executor that the command line requests.

    Raises InputError where the executor or profile does not exist, or this machine has too little memory or disk for
    local jobs.
    """
    name, profile = options.executor, options.profile
    if not name and not profile:
        if options.jobs:
            raise refusal("--jobs", options.jobs, "belongs to --executor", "give --cores")
        resources.check(plans, results)
        allowed = str(options.cores or usable_cores())
        memory = f"mem_mb={resources.megabytes(plans)}"
        arguments = ["--cores", allowed, "--resources", memory, *options.for_snakemake]
        return Executor(arguments, is_extended=bool(options.for_snakemake))
    arguments = []
    if name:
        _check_name(name)
        arguments += ["--executor", name]
    shipped = home() / "workflow/profiles"
    folder = shipped / (name if name in SHIPPED else "generic")
    if profile:
        folder = _folder(profile, shipped)
    arguments += ["--profile", str(folder)]
    if options.jobs:
        arguments += ["--jobs", str(options.jobs)]
    if (name or _read(folder).get("executor")) == "slurm":
        arguments += _status_command()
    config = _numbers(shipped / "generic", "config") | _numbers(folder, "config")
    if GROUP in (groups := _numbers(folder, "group-components")):
        seconds = [batch.seconds for plan in plans for batch in plan.batches]
        groups[GROUP] = group_size(seconds, groups[GROUP])
        arguments += ["--group-components", *(f"{name}={many}" for name, many in groups.items())]
    if options.cores:
        arguments += ["--cores", str(options.cores)]
        config["cores"] = options.cores
    return Executor([*arguments, *options.for_snakemake], config, is_remote=True)


def _folder(profile: Path, shipped: Path) -> Path:
    """Return the folder of a profile, given as a folder or as the name of a shipped profile."""
    candidates = [profile.absolute(), *([shipped / profile] if str(profile) in SHIPPED else [])]
    for folder in candidates:
        if any((folder / file).is_file() for file in PROFILES):
            return folder
    rule = f"must be {' or '.join(SHIPPED)}, or a folder with the file {PROFILES[0]}"
    raise refusal("--profile", profile, rule)


def _numbers(folder: Path, option: str) -> dict[str, int]:
    """Return the value of an option in the profile in a folder, written as a mapping or as a list of ``KEY=VALUE``."""
    value = _read(folder).get(option) or {}
    try:
        pairs = value.items() if isinstance(value, dict) else (row.split("=", 1) for row in value)
        # other keys of `config` are not for vibsim, and may have any type
        return {key: int(value) for key, value in pairs if option != "config" or key in CONFIGURED}
    except (ValueError, AttributeError, TypeError) as error:
        keys = f"{' and '.join(CONFIGURED)} in `config`" if option == "config" else f"`{option}`"
        raise _unreadable(folder, f"{keys} must be whole numbers", error) from None


def _read(folder: Path) -> dict[str, Any]:
    import yaml

    try:
        profile = yaml.safe_load(_file(folder).read_text()) or {}
    except (OSError, ValueError, yaml.YAMLError) as error:
        raise _unreadable(folder, "it must be YAML", error) from None
    if not isinstance(profile, dict):
        raise _unreadable(folder, "it must be a mapping", type(profile).__name__)
    return profile


def _file(folder: Path) -> Path:
    return next(folder / name for name in PROFILES if (folder / name).is_file())


def _unreadable(folder: Path, rule: str, why: object) -> InputError:
    return refusal("--profile", _file(folder), f"cannot be read: {rule}", str(why).splitlines()[0])


def _status_command() -> list[str]:
    """Return the option to query SLURM by squeue if sacct fails (no accounting), since the executor would retry it."""
    try:
        command = ["sacct", "--noheader", "--allocations", "--starttime", "now"]
        ended = subprocess.run(command, capture_output=True, check=False, timeout=60)
    except (OSError, subprocess.TimeoutExpired):
        return []
    return ["--slurm-status-command", "squeue"] if ended.returncode else []


def _check_name(name: str) -> None:
    if find_spec(PLUG_IN + name.replace("-", "_")) is not None:
        return
    modules = (row.name for row in iter_modules() if row.name.startswith(PLUG_IN))
    known = [module.removeprefix(PLUG_IN).replace("_", "-") for module in modules]
    package = f"snakemake-executor-plugin-{name}"
    rule = f"there is no such executor; it comes with the package {package}"
    raise refusal("--executor", name, rule, nearest(name, sorted(known)))
