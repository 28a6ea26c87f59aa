"""The files of each level: ranges of members, with a digest of everything that their numbers depend on.

The border between two files depends on the cost of one member at that level alone, and a digest covers the values of
its own members, not the text of the sweep: members added at the end, or the same values written otherwise, leave all
full files as they are.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping
from functools import cache
from typing import TYPE_CHECKING, Any

from vibsim.plan import code_digest
from vibsim.plan.cases import sampling
from vibsim.plan.digested_part import in_numbers, simulated, values_digest
from vibsim.plan.jobs import LevelJob, ShardJob, shard_path
from vibsim.plan.versions import NUMERICAL, versions

if TYPE_CHECKING:
    from vibsim.experiment import Experiment


def digest_of(content: Mapping[str, Any]) -> str:
    """Return the SHA-256 of `content` as JSON with sorted keys."""
    text = json.dumps(content, sort_keys=True, allow_nan=False, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


def is_bounded(experiment: Experiment) -> bool:
    """Tell whether `experiment` is so large that its storage is bounded."""
    from vibsim.experiment import stored_series

    return stored_series.is_bounded(experiment)


def _series(experiment: Experiment) -> tuple[str, ...]:
    """Name the series that are kept of every scheme and member."""
    from vibsim.experiment.stored_series import stored_series

    return stored_series(experiment)


def level_jobs(experiment: Experiment, content: Mapping[str, Any]) -> tuple[LevelJob, ...]:
    """Return the files of every level.

    Parameters
    ----------
    experiment
        With at least one level.
    content
        The same in normal form.
    """
    values = cache(lambda start, stop: values_digest(experiment, start, stop))
    return tuple(_level(experiment, content, level, values) for level in experiment.levels)


def _level(
    experiment: Experiment,
    content: Mapping[str, Any],
    level: int,
    values: Callable[[int, int], str],
) -> LevelJob:
    # what only asks for digests needs neither models nor schemes
    from vibsim.experiment.level_counts import load_of

    load, members = load_of(experiment, level), experiment.members
    every = sampling(experiment, level)
    shared = digest_of(
        {
            "job": "simulate",
            "experiment": [experiment.collection, experiment.name],
            "uses": in_numbers(simulated(content)),
            "level": level,
            "steps": load.steps,
            "every": every,
            "series": [*_series(experiment), "lean" if is_bounded(experiment) else "all"],
            "extrema": load.extrema,
            "own ends": experiment.end_varies,
            "code": _simulation_code(experiment),
            "versions": versions(NUMERICAL),
        }
    )
    folder, is_swept = f"{experiment.collection}/{experiment.name}", experiment.sweep is not None

    def shard(index: int) -> ShardJob:
        start, stop = index * load.shard, min((index + 1) * load.shard, members)
        path = shard_path(folder, level, index if is_swept else None)
        own = {"shared": shared, "cases": [start, stop], "values": values(start, stop)}
        return ShardJob(index, start, stop, path, digest_of(own))

    return LevelJob(
        level=level,
        steps=load.steps,
        every=every,
        member_steps=load.schemes * members * load.steps,
        bytes=load.disk(members),
        seconds=round(load.seconds(members), 3),
        shared=round(members * load.own, 3),
        memory=load.memory(min(members, load.shard)),
        shards=tuple(map(shard, range(load.shards(members)))),
    )


def _simulation_code(experiment: Experiment) -> str:
    return code_of(experiment.model.kind, tuple(sorted({s.kind for s in experiment.schemes})))


@cache
def code_of(model: str, schemes: tuple[str, ...]) -> str:
    """Return the digest of the code that a simulation can run: of all models and schemes, its own."""
    from vibsim.models import MODELS
    from vibsim.schemes import SCHEMES

    homes = [
        code_digest.home(MODELS[model], "vibsim.models"),
        *(code_digest.home(SCHEMES[kind], "vibsim.schemes") for kind in schemes),
    ]
    used = code_digest.used_by("vibsim.cli.jobs.simulate", *(module for module, _ in homes))
    return digest_of({"used": used, "entries": homes})
