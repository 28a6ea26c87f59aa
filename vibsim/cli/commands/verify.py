"""``vibsim verify``: check that result files are unchanged, and that a new run gives the same bits.

Files are compared with the manifest that jobs and runs write (`vibsim.cli.made_files`). Results are recomputed by a run
in a temporary folder, and its manifest is compared with the existing files.
"""

from __future__ import annotations

import os
import re
from argparse import Namespace
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from vibsim.cli import made_files, results_folder, supervise
from vibsim.cli.chosen_plans import plans_of
from vibsim.cli.jobs.common import chosen_results, run_command
from vibsim.cli.jobs.solve import check_allowed
from vibsim.cli.made_files import BESIDE, Entry
from vibsim.cli.run import lock, reasons
from vibsim.cli.terminal import clean
from vibsim.core.errors import FileError, VibsimError
from vibsim.core.home import home
from vibsim.core.temporary import temporary_folder
from vibsim.experiment.collection import SITE
from vibsim.plan import Plan, choose

NO_RESULTS = ("logs", "benchmarks")  # folders with the logs and times of jobs, and no results
TIMESTAMP = ".snakemake_timestamp"  # file that Snakemake puts into a folder that a job made
LAST = ("convergence.nc", "summary.json", "report.html")  # files of every run that ended
_MANIFEST = re.compile(r"\w+\.\w+", re.ASCII)
"""Name of the manifest of an experiment: collection and name, neither of which contains a dot."""
SHOWN = 8  # most files that are listed by name for the same cause
_README = "README.md"  # file in the results folder of a checkout


def verify(options: Namespace) -> int:
    """Compare files with their manifest, and recompute the named experiments, except with ``--files``.

    Raises InputError where a name or an experiment file is refused, or a user's program is not allowed, and VibsimError
    where there are no results.
    """
    results, words = chosen_results(options), options.experiments
    plans: Sequence[Plan] = []
    if words and not options.files:
        plans = plans_of(words, options.settings, cached=True)
        check_allowed(plans, options.allow_commands)
    if not results.is_dir():
        raise VibsimError(f"{results}: there are no results yet")
    choices = choose(words, home(), options.settings) if words else []
    keys = [choice.key for choice in choices] or [made_files.INDEX, *experiments(results)]
    results_folder.check(results, filter(None, keys))
    with locked(results), temporary_folder() as folder:
        faults = sum(_tell_files(results, key) for key in keys)
        # experiments without results have nothing to compare with
        known = experiments(results)
        plans = [plan for plan in plans if plan.key in known]
        if plans:
            # only the progress is shown, not the verdicts
            run = [choice.word for choice in choices if choice.key in known]
            command = run_command(options, run, folder)
            status = supervise.child(command, is_heard=False)
            if status not in (0, 1):
                return status
        faults += sum(_report_recomputed(plan, results, folder) for plan in plans)
    return 1 if faults else 0


@contextmanager
def locked(results: Path) -> Iterator[None]:
    """Lock a results folder, since files that a run is making would seem damaged or missing."""
    # no run can write to a read-only folder
    descriptor = lock.hold(results) if os.access(results / ".vibsim", os.W_OK) else None
    try:
        yield
    finally:
        if descriptor is not None:
            os.close(descriptor)


def experiments(results: Path) -> list[str]:
    """Return the keys of all experiments that have a manifest or a folder, sorted."""
    manifests = made_files.path(results, made_files.INDEX).parent.glob("*.*.jsonl")
    paths = (path for path in results.glob("[!.]*/[!.]*") if path.parent.name != SITE)
    keys = {file.stem.replace(".", "/") for file in manifests if _MANIFEST.fullmatch(file.stem)}
    return sorted(keys | {path.relative_to(results).as_posix() for path in paths if path.is_dir()})


def compare(results: Path, key: str) -> tuple[int, dict[str, str]]:
    """Compare every file of an experiment, or of the index (`made_files.INDEX`), with the manifest; change nothing.

    Return the number of files in the manifest, and the problems by path relative to `results`.
    """
    folder = results / key
    known, is_intact = made_files.read(results, key)
    existing = set(_files(folder, is_top=key == made_files.INDEX))
    if not known and not existing:
        return 0, {key or "index.html": "there are no results yet: run it first"}
    texts = {name: _problem(folder / name, entry) for name, entry in known.items()}
    if is_intact:
        rule = "is not in the manifest: no job that ended made it"
        texts |= dict.fromkeys(existing - known.keys(), rule)
        for name in made_files.OVER_ALL if key == made_files.INDEX else LAST:
            texts.setdefault(name, "is not made yet: the last run did not end")
    if LAST[-1] not in existing:
        # the report job writes figures and tables before the page
        begun = [name for name in texts if name.startswith(BESIDE) and (folder / name).exists()]
        texts |= {name: texts[name] and "is of a report that was not finished" for name in begun}
    problems = {(Path(key) / name).as_posix(): text for name, text in sorted(texts.items()) if text}
    if not is_intact:
        manifest = made_files.path(results, key)
        state = "is damaged" if manifest.exists() else "is missing"
        number = len(existing - known.keys())
        text = f"the manifest {state}, so {number} files cannot be compared; run again"
        problems[manifest.relative_to(results).as_posix()] = text
    return len(known), problems


def _problem(file: Path, known: Entry) -> str:
    try:
        if not file.exists():
            return "is missing"
        return "" if made_files.content(file) == known.digest else made_files.CHANGED
    except OSError as error:
        return f"cannot be read: {error.strerror}"
    except FileError as error:
        return error.reason


def _files(folder: Path, *, is_top: bool) -> Iterator[str]:
    """Yield the paths, relative to `folder`, of all results of an experiment, or with `is_top` of all other files."""
    for parent, folders, names in os.walk(folder):
        inner = Path(parent).relative_to(folder)
        if is_top:
            outer = [] if inner.parts else folders  # enter collections, but not experiments
            folders[:] = [name for name in outer if not name.startswith(".") and name != SITE]
        elif not inner.parts:
            folders[:] = [name for name in folders if name not in NO_RESULTS]
        paths = ((inner / name).as_posix() for name in names if name != TIMESTAMP)
        yield from (path for path in paths if not (is_top and path == _README))


def _tell_files(results: Path, key: str) -> int:
    """Print the problems with the files of an experiment, and return their number."""
    number, problems = compare(results, key)
    for path, text in problems.items():
        print(clean(f"{path}: {text}"), flush=True)
    if not problems:
        print(clean(f"{key or 'index'}: all {number} files are as they were written"), flush=True)
    return len(problems)


def _report_recomputed(plan: Plan, results: Path, folder: Path) -> int:
    """Print which recomputed files differ from the existing ones, and why; return their number."""
    causes = differences(plan, results, folder)
    for cause, names in causes.items():
        # data before pages, tables and figures
        names.sort(key=lambda name: (not name.endswith(".nc"), name))
        more = f" and {len(names) - SHOWN} more" if len(names) > SHOWN else ""
        listed = ", ".join(names[:SHOWN]) + more
        print(clean(f"{plan.key}: recomputed, other bytes ({cause}): {listed}"))
    if not causes:
        number = len(made_files.load(folder, plan.key))
        print(clean(f"{plan.key}: recomputed, all {number} files have the same bytes"))
    return sum(map(len, causes.values()))


def differences(plan: Plan, results: Path, folder: Path) -> dict[str, list[str]]:
    """Return by cause the files of `results` that differ from those just made in `folder`."""
    made, known = made_files.load(folder, plan.key), made_files.load(results, plan.key)
    causes: dict[str, list[str]] = {}
    for path in plan.files:
        name = path.removeprefix(f"{plan.key}/")
        if name not in made:
            causes.setdefault("its job failed", []).append(name)
    for name, entry in sorted(made.items()):
        if _problem(results / plan.key / name, entry):
            cause = _cause(plan, results, known.get(name), entry, name)
            causes.setdefault(cause, []).append(name)
    return causes


def _cause(plan: Plan, results: Path, known: Entry | None, again: Entry, name: str) -> str:
    """Return why a recomputed file differs from the existing one."""
    from vibsim.store.reading import read_provenance

    if known is None:
        return "the manifest does not have it"
    if problem := _problem(results / plan.key / name, known):
        return problem
    if change := reasons.why(plan, results):
        return change
    try:
        versions = reasons.versions(plan, read_provenance(results / plan.convergence))
    except FileError:
        versions = []
    if versions:
        return "; ".join(map(str, versions))
    if known.job and known.job != again.job:
        return "the title, or the code or the libraries that draw pages changed"
    if known.machine and known.machine != again.machine:
        return f"made on another machine ({known.machine}; this is {again.machine})"
    return "input, versions, code and machine are the same"
