"""What all jobs of the workflow share.

A job reads the plan of its experiment and refuses when it is not the plan that it was started for. It
reads no file without its digest; one that is damaged or another job's is named and never used.
"""

from __future__ import annotations

import sys
from argparse import Namespace
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import vibsim
from vibsim.cli import made_files, results_folder
from vibsim.cli.chosen_plans import one_plan_of
from vibsim.core.errors import Fault, FileError, InputError, VibsimError
from vibsim.core.home import default_results
from vibsim.core.set_option import OPTION
from vibsim.plan import Plan

if TYPE_CHECKING:
    from vibsim.core.record import Record

COMPARED = ("convergence.nc", "summary.json")
"""Files that a comparison of levels writes."""


def chosen_results(options: Namespace) -> Path:
    """Return the results folder that was asked for, else the default one."""
    folder: Path = options.results or default_results()
    check_folder("--results", folder)
    return folder.absolute()


def check_folder(option: str, folder: Path) -> None:
    """Refuse what is no folder, and cannot become one: a file, or a place within one."""
    try:
        there = next(path for path in (folder, *folder.absolute().parents) if path.exists())
        is_folder = there.is_dir()
    except OSError as error:
        # a name that is too long, a folder on the way that may not be entered
        rule = f"cannot be used: {error.strerror}"
        raise refusal(option, f"{str(folder)[:80]} ...", rule) from None
    if not is_folder:
        this = "this" if there == folder else there
        raise refusal(option, folder, f"must be a folder, {this} is a file")


def one_plan(options: Namespace) -> tuple[Plan, Path]:
    """Return the plan of the experiment of a job, and the results folder."""
    results = chosen_results(options)
    plan = one_plan_of(options.experiment, options.settings)
    results_folder.check_folders(results, plan.key)
    return plan, results


def check_digest(plan: Plan, wanted: str | None, found: str) -> None:
    """Refuse to do another job than the one that was planned."""
    if wanted is not None and wanted != found:
        rule = "the experiment or the code changed after this job was planned; run again"
        raise InputError([Fault(plan.file, 0, "", "", rule)])


def refusal(key: str, value: Any, rule: str, hint: str = "") -> InputError:
    """Return the error of a command line."""
    return InputError([Fault("command line", 0, key, str(value), rule, hint)])


def run_command(options: Namespace, experiments: Sequence[str], results: Path | None) -> list[str]:
    """Return the words of ``vibsim run`` with those options of another command that both have."""
    words = ["run", *experiments]
    words += ["--results", str(results)] if results else []
    words += ["--cores", str(options.cores)] if options.cores else []
    words += [word for text in options.settings for word in (OPTION, text)]
    return words + ["--allow-commands"] * options.allow_commands


@contextmanager
def on_record(
    options: Namespace, results: Path, key: str, names: Sequence[str], job: str = ""
) -> Iterator[None]:
    """Take files off the manifest while a job makes them, and put them back when it has; not those of ``--out``.

    A job that is killed leaves none then that seems changed.
    """
    if options.out is not None:
        yield
        return
    made_files.withdraw(results, key, names)
    yield
    made_files.add(results, key, names, job)


def read_all(
    options: Namespace, results: Path, readers: Mapping[str, Callable[[Path], Any]]
) -> dict[str, Any]:
    """Read every file, and only then refuse: a run makes all that are bad again in one go."""
    found: dict[str, Any] = {}
    problems: list[str] = []
    for path, read in readers.items():
        try:
            found[path] = read(results / path)
        except FileError as error:
            problems.append(str(error))
            if options.discard:
                try:
                    results_folder.delete(error, results)
                except VibsimError as obstacle:
                    problems.append(str(obstacle))
    if problems:
        raise VibsimError("\n".join(problems))
    return found


def titled(record: Record, title: str) -> Record:
    """Return `record` with the title that its file needs."""
    return replace(record, attrs={**record.attrs, "title": title})


def provenance(plan: Plan, uses: dict[str, Any]) -> dict[str, Any]:
    """Return what a file says of its making."""
    python = ".".join(map(str, sys.version_info[:3]))
    versions = {"vibsim": vibsim.__version__, "python": python, **plan.versions}
    return {"experiment": uses, "versions": versions}


def with_settings(plan: Plan, uses: dict[str, Any]) -> dict[str, Any]:
    """Return what a file says of its making that also tells which settings the command line had."""
    return provenance(plan, uses) | ({"settings": list(plan.settings)} if plan.settings else {})


def check_levels(plan: Plan, options: Namespace, results: Path) -> None:
    """Check all level files; VibsimError where files are damaged or another job's."""
    from vibsim import store

    checks = {shard.path: partial(store.check, digest=shard.digest) for shard in plan.shards}
    read_all(options, results, checks)


@contextmanager
def open_levels(
    plan: Plan, options: Namespace, results: Path
) -> Iterator[dict[int, Callable[[int, int], Record]]]:
    """Check all level files, and open them; yield what reads a range of members of each level.

    Raises
    ------
    VibsimError
        Where files are damaged or another job's.
    """
    from vibsim import store

    check_levels(plan, options, results)
    with ExitStack() as stack:
        yield {
            level.level: stack.enter_context(
                store.open_level([(results / shard.path, shard.digest) for shard in level.shards])
            ).read
            for level in plan.levels
        }
