"""One member at one level, from the files of a results folder."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vibsim.cli.jobs.common import refusal
from vibsim.core.errors import VibsimError, nearest
from vibsim.core.home import called
from vibsim.core.set_option import command_to_run
from vibsim.plan import Plan, ShardJob

if TYPE_CHECKING:
    from vibsim.core.record import Record

OUTDATED = "note: these results were made before the experiment or vibsim changed; run it again for new ones"


def are_outdated(plan: Plan, summary: Mapping[str, Any]) -> bool:
    """Say whether verdicts are of another state of the experiment or of vibsim than the present one."""
    return summary.get("digest") != plan.analysis


def made(plan: Plan, results: Path, case: int, word: str) -> tuple[list[int], list[int]]:
    """Return all levels of a plan, and those of which the file with a member is there.

    InputError where there is no such member; VibsimError where no level is there: `word` is what the user called it.
    """
    if not 0 <= case < plan.cases:
        raise refusal("--case", case, f"must be from 0 to {plan.cases - 1}")
    levels = [level.level for level in plan.levels]
    found = [level for level in levels if (results / _shard(plan, level, case).path).is_file()]
    if not found:
        problem = f"there are no results yet: {called(command_to_run(word))} (looked in {results})"
        raise VibsimError(f"{plan.key}: {problem}")
    return levels, found


def check_level(level: int, levels: Sequence[int]) -> None:
    """Refuse a level that the experiment does not have."""
    if level not in levels:
        raise refusal("--level", level, f"must be one of {', '.join(map(str, levels))}")


def of_level(plan: Plan, results: Path, level: int, case: int) -> Record:
    """Return one member at one level."""
    shard = _shard(plan, level, case)
    return read(results / shard.path, case - shard.start)


def is_outdated(plan: Plan, record: Record, level: int, case: int) -> bool:
    """Say whether a level was made before the experiment or vibsim changed."""
    return record.attrs.get("digest") != _shard(plan, level, case).digest


def read(path: Path, place: int) -> Record:
    """Return one member of a level file, by its place in it."""
    from vibsim import store

    try:
        store.check(path)
        with store.open_level([(path, None)]) as level:
            if not 0 <= place < level.cases:
                raise refusal("--case", place, f"{path}: must be from 0 to {level.cases - 1}")
            return level.read(place, place + 1)
    except KeyError:
        # a level of a solver of the user need not have members
        return store.read(path)


def series(record: Record) -> list[str]:
    """Return the names of what a level has over time."""
    over_time = ("scheme", "case", "t")
    return [name for name, row in record.variables.items() if row.dims == over_time]


def chosen(option: str, wanted: str | None, names: Sequence[str]) -> str:
    """Return the name that was asked for, else the first one."""
    if wanted is None:
        return names[0]
    if wanted not in names:
        raise refusal(option, wanted, "is not in this experiment", nearest(wanted, names))
    return wanted


def _shard(plan: Plan, level: int, case: int) -> ShardJob:
    """Return the file of a member at a level."""
    return next(shard for shard in plan.level(level).shards if shard.start <= case < shard.stop)
