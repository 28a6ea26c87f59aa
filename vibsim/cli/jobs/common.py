"""Functions that the jobs of the workflow share.

A job loads the plan of its experiment and refuses to run if this is not the plan that it was started for. It checks the
digest of every file that it reads; a file that is damaged or from another job is reported and never used.
"""

from __future__ import annotations

import os
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
from vibsim.core.set_option import ALLOW, OPTION
from vibsim.plan import Plan

if TYPE_CHECKING:
    from vibsim.core.record import Record

COMPARED = ("convergence.nc", "summary.json")  # files that the analysis writes


def chosen_results(options: Namespace) -> Path:
    """Return the results folder of the option ``--results``, or the default one."""
    folder: Path = options.results or default_results()
    check_folder("--results", folder)
    return folder.absolute()


def check_folder(option: str, folder: Path) -> Path:
    """Refuse a path that is not a folder and cannot become one: a file, or a path below a file.

    Return the nearest folder at or above it that exists.
    """
    try:
        existing = next(path for path in (folder, *folder.absolute().parents) if path.exists())
        is_folder = existing.is_dir()
    except OSError as error:
        # e.g. the name is too long, or a parent folder may not be entered
        rule = f"cannot be used: {error.strerror}"
        raise refusal(option, f"{str(folder)[:80]} ...", rule) from None
    if not is_folder:
        this = "this" if existing == folder else existing
        raise refusal(option, folder, f"must be a folder, {this} is a file")
    return existing


def check_to_write(option: str, folder: Path) -> None:
    """Refuse a path that is no folder to write to; the error comes before the work."""
    existing = check_folder(option, folder)
    if not os.access(existing, os.W_OK | os.X_OK):
        this = "this folder" if existing == folder else existing
        raise refusal(option, folder, f"must be a folder to write to, {this} is write-protected")


def one_plan(options: Namespace) -> tuple[Plan, Path]:
    """Return the plan of a job's experiment, and the results folder."""
    results = chosen_results(options)
    plan = one_plan_of(options.experiment, options.settings)
    results_folder.check_folders(results, plan.key)
    return plan, results


def check_digest(plan: Plan, expected: str | None, actual: str) -> None:
    """Refuse to run a job if its digest is not the expected one; None accepts any."""
    if expected is not None and expected != actual:
        rule = "the experiment or the code changed after this job was planned; run again"
        raise InputError([Fault(plan.file, 0, "", "", rule)])


def refusal(key: str, value: Any, rule: str, hint: str = "") -> InputError:
    """Return the error for an invalid command-line argument."""
    return InputError([Fault("command line", 0, key, str(value), rule, hint)])


def run_command(options: Namespace, experiments: Sequence[str], results: Path | None) -> list[str]:
    """Return the arguments of ``vibsim run``, with the options that it shares with another command."""
    words = ["run", *experiments]
    words += ["--results", str(results)] if results else []
    words += ["--cores", str(options.cores)] if options.cores else []
    words += [word for text in options.settings for word in (OPTION, text)]
    return words + [ALLOW] * options.allow_commands


@contextmanager
def on_record(
    options: Namespace, results: Path, key: str, names: Sequence[str], job: str = ""
) -> Iterator[None]:
    """Remove the manifest entries of files while a job makes them, and add new ones after that; not with ``--out``.

    So no file of a killed job seems changed.
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
    """Read all files before reporting errors, so that a run makes all bad files again at once."""
    contents: dict[str, Any] = {}
    problems: list[str] = []
    for path, read in readers.items():
        try:
            contents[path] = read(results / path)
        except FileError as error:
            problems.append(str(error))
            if options.discard:
                try:
                    results_folder.delete(error, results)
                except VibsimError as obstacle:
                    problems.append(str(obstacle))
    if problems:
        raise VibsimError("\n".join(problems))
    return contents


def titled(record: Record, title: str) -> Record:
    """Return `record` with a title, which every stored record needs."""
    return replace(record, attrs={**record.attrs, "title": title})


def provenance(plan: Plan, uses: dict[str, Any]) -> dict[str, Any]:
    """Return the provenance of a file: the settings and versions that its job used."""
    python = ".".join(map(str, sys.version_info[:3]))
    versions = {"vibsim": vibsim.__version__, "python": python, **plan.versions}
    return {"experiment": uses, "versions": versions}


def with_settings(plan: Plan, uses: dict[str, Any]) -> dict[str, Any]:
    """Return the provenance of a file that also records the settings of the command line."""
    return provenance(plan, uses) | ({"settings": list(plan.settings)} if plan.settings else {})


@contextmanager
def open_levels(
    plan: Plan, options: Namespace, results: Path
) -> Iterator[dict[int, Callable[[int, int], Record]]]:
    """Check and open all level files; yield for each level a function that reads members start..stop-1.

    Raises VibsimError where a file is damaged or from another job.
    """
    from vibsim import store

    with ExitStack() as stack:
        levels = {job.level: stack.enter_context(store.open_level([])) for job in plan.levels}
        checks = {
            shard.path: partial(levels[job.level].add, digest=shard.digest)
            for job in plan.levels
            for shard in job.shards
        }
        read_all(options, results, checks)
        yield {number: level.read for number, level in levels.items()}
