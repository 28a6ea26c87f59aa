"""Read one member at one level from a results folder."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vibsim.cli import outcome_text
from vibsim.cli.jobs.common import refusal
from vibsim.core.errors import DamagedFileError, VibsimError, nearest
from vibsim.core.home import typed
from vibsim.plan import Plan, ShardJob

if TYPE_CHECKING:
    from vibsim.core.record import Record

OUTDATED = "note: these results were made before the experiment or vibsim changed; run the experiment again"


def are_outdated(plan: Plan, summary: Mapping[str, Any]) -> bool:
    """Tell whether a summary was made before the experiment or vibsim changed."""
    return summary.get("digest") != plan.analysis


def summary_of(plan: Plan, results: Path) -> Mapping[str, Any] | None:
    """Return the summary of an experiment; None if there is none yet."""
    from vibsim import store

    path = results / plan.summary
    return store.read_json(path, name=plan.key) if path.exists() else None


def decisive(plan: Plan, summary: Mapping[str, Any] | None) -> tuple[int, str | None]:
    """Return the member and the scheme that decide the verdict; the first ones without a verdict on this file."""
    rows = [] if summary is None or are_outdated(plan, summary) else summary["checks"]
    check = outcome_text.decisive(rows)
    if check is None or not check["results"]:
        return 0, None
    result = check["results"][0]
    return result["case"], result["scheme"]


def made(plan: Plan, results: Path, case: int, word: str) -> tuple[list[int], list[int]]:
    """Return all levels of a plan, and those whose file with member `case` exists.

    Raises InputError where there is no such member, and VibsimError where no level exists; `word` is the experiment's
    name on the command line.
    """
    if not 0 <= case < plan.cases:
        raise refusal("--case", case, f"must be from 0 to {plan.cases - 1}")
    levels = [level.level for level in plan.levels]
    existing = [level for level in levels if (results / _shard(plan, level, case).path).is_file()]
    if not existing:
        problem = (
            f"there are no results yet: {typed(plan.command_to_run(word))} (looked in {results})"
        )
        raise VibsimError(f"{plan.key}: {problem}")
    return levels, existing


def check_level(level: int, levels: Sequence[int]) -> None:
    """Refuse a level that the experiment does not have."""
    if level not in levels:
        raise refusal("--level", level, f"must be one of {', '.join(map(str, levels))}")


def of_level(plan: Plan, results: Path, level: int, case: int) -> Record:
    """Return the Record of one member at one level."""
    shard = _shard(plan, level, case)
    return read(results / shard.path, case - shard.start)


def is_outdated(plan: Plan, record: Record, level: int, case: int) -> bool:
    """Tell whether a level was made before the experiment or vibsim changed."""
    return record.attrs.get("digest") != _shard(plan, level, case).digest


def read(path: Path, place: int) -> Record:
    """Return member number `place` of a level file, counted within the file."""
    from vibsim import store

    with ExitStack() as stack:
        try:
            level = stack.enter_context(store.open_level([(path, None)]))
        except DamagedFileError:
            # a level of a user's solver has no members; a file that is damaged is refused here, too
            return store.read(path)
        if not 0 <= place < level.cases:
            raise refusal("--case", place, f"{path}: must be from 0 to {level.cases - 1}")
        return level.read(place, place + 1)


def series(record: Record) -> list[str]:
    """Return the names of the time series in a level."""
    over_time = ("scheme", "case", "t")
    return [name for name, row in record.variables.items() if row.dims == over_time]


def chosen(option: str, wanted: str | None, names: Sequence[str]) -> str:
    """Return the name that the user chose with `option`, by default the first one."""
    if wanted is None:
        return names[0]
    if wanted not in names:
        raise refusal(option, wanted, "is not in this experiment", nearest(wanted, names))
    return wanted


def _shard(plan: Plan, level: int, case: int) -> ShardJob:
    """Return the job that makes the file of a member at a level."""
    return next(shard for shard in plan.level(level).shards if shard.start <= case < shard.stop)
