"""Where the jobs of a run are done: on this machine, or where an executor of Snakemake sends them."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib.util import find_spec
from pathlib import Path
from pkgutil import iter_modules

from vibsim.cli import resources
from vibsim.cli.jobs.common import refusal
from vibsim.core.errors import nearest
from vibsim.core.home import home
from vibsim.core.processes import usable_cores
from vibsim.plan import Plan
from vibsim.plan.workflow_names import GROUP, together

PLUG_IN = "snakemake_executor_plugin_"
PROFILES = ("config.yaml", "config.v8+.yaml", "config.v9+.yaml")
"""Names that the file of a profile may have."""
SHIPPED = ("slurm", "generic")
"""The profiles in ``workflow/profiles``: one for the executor of its name, and one for any other."""
CONFIGURED = ("cores", "overhead", "here")
"""What a profile configures of vibsim: the cores of a job, the megabytes of the executor's processes beside it, and the
seconds of work that are no jobs but done here."""


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
        allowed = str(options.cores or usable_cores())
        memory = f"mem_mb={resources.megabytes(plans)}"
        return Executor(["--cores", allowed, "--resources", memory, *options.handed])
    arguments: list[str] = []
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
    config = _numbers(shipped / "generic", "config") | _numbers(folder, "config")
    if GROUP in (groups := _numbers(folder, "group-components")):
        seconds = [batch.seconds for plan in plans for batch in plan.batches]
        groups[GROUP] = together(seconds, groups[GROUP])
        arguments += ["--group-components", *(f"{name}={many}" for name, many in groups.items())]
    if options.cores:
        arguments += ["--cores", str(options.cores)]
        config["cores"] = options.cores
    return Executor([*arguments, *options.handed], config, is_remote=True)


def _folder(profile: Path, shipped: Path) -> Path:
    """Return the folder of a profile that is named: a folder, else the shipped one of that name."""
    found = [profile.absolute(), *([shipped / profile] if str(profile) in SHIPPED else [])]
    for folder in found:
        if any((folder / file).is_file() for file in PROFILES):
            return folder
    rule = f"must be {' or '.join(SHIPPED)}, or a folder with the file {PROFILES[0]}"
    raise refusal("--profile", profile, rule)


def _numbers(folder: Path, option: str) -> dict[str, int]:
    """Return what the profile in a folder says of an option of Snakemake, as a mapping or as ``KEY=VALUE``."""
    import yaml

    file = next(folder / name for name in PROFILES if (folder / name).is_file())
    try:
        found = (yaml.safe_load(file.read_text()) or {}).get(option) or {}
        pairs = found.items() if isinstance(found, dict) else (row.split("=", 1) for row in found)
        # others of `config` are no concern of vibsim, and may be of any type
        return {key: int(value) for key, value in pairs if option != "config" or key in CONFIGURED}
    except (OSError, ValueError, AttributeError, TypeError, yaml.YAMLError) as error:
        keys = f"{' and '.join(CONFIGURED)} in `config`" if option == "config" else f"`{option}`"
        rule = f"cannot be read: {keys} must be whole numbers"
        raise refusal("--profile", file, rule, str(error).splitlines()[0]) from None


def _check_name(name: str) -> None:
    if find_spec(PLUG_IN + name.replace("-", "_")) is not None:
        return
    found = (row.name for row in iter_modules() if row.name.startswith(PLUG_IN))
    known = [module.removeprefix(PLUG_IN).replace("_", "-") for module in found]
    package = f"snakemake-executor-plugin-{name}"
    rule = f"there is no such executor; it comes with the package {package}"
    raise refusal("--executor", name, rule, nearest(name, sorted(known)))
