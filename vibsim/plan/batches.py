"""Which files one job makes: the start of a job costs as much as many cheap levels."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from vibsim.experiment.cost import JOB_SECONDS
from vibsim.plan.jobs import Batch, LevelJob
from vibsim.plan.shards import digest_of

CHEAP_SECONDS = 2.0
"""Work that one job does at most where it makes several levels."""
CHEAP_BYTES = 400 * 10**6
"""Bytes that such a job writes at most."""
DIVISIBLE_SECONDS = 0.5
"""Work from which a second thread is worth its start."""
DIVISIBLE_MEMBERS = 128
"""Trajectories from which threads have something to share."""


def batches(levels: Sequence[LevelJob], trajectories: int) -> tuple[Batch, ...]:
    """Return the jobs that make `levels`, each file in one of them.

    Parameters
    ----------
    levels
        From coarse to fine.
    trajectories
        Number of schemes times number of members.
    """
    found: list[Batch] = []
    for group in _groups(levels):
        shards = range(len(group[0].shards))
        found.extend(_batch(group, shard, trajectories) for shard in shards)
    return tuple(found)


def batch_digest(files: Sequence[str]) -> str:
    """Return the digest of a job from those of its files: that of the file where there is one."""
    return files[0] if len(files) == 1 else digest_of({"job": "simulate", "files": list(files)})


def _groups(levels: Sequence[LevelJob]) -> Iterator[list[LevelJob]]:
    """Put levels together that are divided alike, while one job can make all of them cheaply."""
    group: list[LevelJob] = []
    for level in levels:
        if group and not _is_cheap([*group, level]):
            yield group
            group = []
        group.append(level)
    if group:
        yield group


def _is_cheap(group: Sequence[LevelJob]) -> bool:
    borders = {(level.shards[0].stop, len(level.shards)) for level in group}
    share = group[0].shards[0].stop / group[0].shards[-1].stop
    return (
        len(borders) == 1
        and share * sum(level.seconds - level.shared for level in group) <= CHEAP_SECONDS
        and share * sum(level.bytes for level in group) <= CHEAP_BYTES
    )


def _batch(group: Sequence[LevelJob], index: int, trajectories: int) -> Batch:
    whole = group[0].shards[-1].stop
    shard = group[0].shards[index]
    once = group[0].shared + sum(level.seconds - level.shared for level in group)
    work = once * (shard.stop - shard.start) / whole
    return Batch(
        levels=tuple(level.level for level in group),
        shard=index,
        digest=batch_digest([level.shards[index].digest for level in group]),
        seconds=round(JOB_SECONDS + work, 3),
        memory=max(level.memory for level in group),
        is_divisible=len(group[0].shards) == 1
        and work > DIVISIBLE_SECONDS
        and trajectories >= DIVISIBLE_MEMBERS,
    )
