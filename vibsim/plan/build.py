"""Build the plan of a validated experiment.

A digest covers exactly what a job uses: its part of the experiment in normal form, the code it runs and
the libraries that the numbers come from. Titles and checks are no part of a simulation; a level knows
nothing of the other levels but which samples it keeps. The start of a job costs as much as many cheap
levels, which share one.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache
from typing import Any

from vibsim.experiment import Experiment, canonical
from vibsim.experiment.cost import JOB_SECONDS, analysis_disk, analysis_memory, load_of
from vibsim.experiment.storage import is_bounded, sampling, stored_series
from vibsim.plan import code_digest
from vibsim.plan.digests import (
    analysed,
    batch_digest,
    digest_of,
    extrapolated,
    in_numbers,
    simulated,
    values_digest,
)
from vibsim.plan.jobs import Batch, LevelJob, Plan, ShardJob, shard_path
from vibsim.plan.versions import DRAWING, NUMERICAL, versions


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
            "series": [*stored_series(experiment), "lean" if is_bounded(experiment) else "all"],
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


def build(experiment: Experiment) -> Plan:
    """Return the plan of `experiment`, which has at least one level."""
    content: dict[str, Any] = json.loads(json.dumps(canonical(experiment), allow_nan=False))
    levels = level_jobs(experiment, content)
    analysis = _analysis(content, levels)
    loads = [load_of(experiment, level) for level in experiment.levels]
    return Plan(
        collection=experiment.collection,
        name=experiment.name,
        title=experiment.title,
        source=experiment.source,
        cases=experiment.members,
        schemes=tuple(scheme.name for scheme in experiment.schemes),
        levels=levels,
        batches=batches(levels, experiment.trajectories),
        analysis=analysis,
        analysis_memory=analysis_memory(loads, experiment.members),
        analysis_bytes=analysis_disk(loads, experiment.members, is_bounded(experiment)),
        extrapolation=_extrapolation(content, levels),
        report=_report(content, analysis),
        content=content,
        versions=versions(NUMERICAL),
        inputs=tuple((t.file, t.content) for t in experiment.model.tables.values()),
    )


def _analysis(content: Mapping[str, Any], levels: tuple[LevelJob, ...]) -> str:
    return digest_of(
        {
            "job": "analyse",
            "levels": _digests(levels),
            "experiment": in_numbers(analysed(content)),
            "code": _code("analyse"),
            "versions": versions(NUMERICAL),
        }
    )


def _digests(levels: tuple[LevelJob, ...]) -> list[list[str]]:
    return [[shard.digest for shard in level.shards] for level in levels]


def _extrapolation(content: Mapping[str, Any], levels: tuple[LevelJob, ...]) -> str:
    if content.get("output") != "best":
        return ""
    return digest_of(
        {
            "job": "extrapolate",
            "levels": _digests(levels),
            "experiment": in_numbers(extrapolated(content)),
            "code": _code("extrapolate"),
            "versions": versions(NUMERICAL),
        }
    )


def _report(content: Mapping[str, Any], analysis: str) -> str:
    return digest_of(
        {
            "job": "report",
            "analysis": analysis,
            "experiment": content,
            "code": _code("report"),
            "versions": versions(DRAWING),
        }
    )


@cache
def _code(command: str) -> str:
    """Return the digest of the code that a job after the simulation can run."""
    return code_digest.used_by(f"vibsim.cli.jobs.{command}")
