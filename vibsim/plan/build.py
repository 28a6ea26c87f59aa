"""Build the plan of a validated experiment.

A digest covers exactly what a job uses: its part of the experiment in normal form, the code it runs and the versions of
the numerical libraries. A simulation does not depend on titles or checks, and a level depends on the other levels only
through the choice of stored samples. Starting a job costs as much as many cheap levels, so cheap levels share a job.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cache
from typing import Any

from vibsim.core.registry import Registry, offers
from vibsim.experiment import Experiment, canonical
from vibsim.experiment.cost import (
    JOB_SECONDS,
    analysis_memory,
    analysis_written,
    level_cost,
    process_memory,
)
from vibsim.experiment.storage import is_bounded, sampling, stored_series
from vibsim.models import MODELS
from vibsim.plan import code_digest, forecast
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
from vibsim.schemes import SCHEMES

CHEAP_SECONDS = 2.0
"""Limit on the work of a job that makes several levels [s]."""
CHEAP_BYTES = 400 * 10**6
"""Limit on the bytes that such a job writes."""
DIVISIBLE_SECONDS = 0.5
"""Work above which a second thread pays [s]."""
DIVISIBLE_MEMBERS = 128
"""Fewest trajectories for which several threads pay."""


def build(experiment: Experiment) -> Plan:
    """Return the plan of `experiment`, which has at least one level."""
    content: dict[str, Any] = json.loads(json.dumps(canonical(experiment), allow_nan=False))
    packages = tuple(_offered(experiment.model.kind, _kinds(experiment)))
    dists = [offers(group)[kind].dist for group, kind, _ in packages]
    values = cache(lambda start, stop: values_digest(experiment, start, stop))
    levels = tuple(_level(experiment, content, level, values) for level in experiment.levels)
    groups, trajectories = _groups(levels), experiment.trajectories
    costs = [level_cost(experiment, level) for level in experiment.levels]
    upstream = level_digests(levels, experiment.settings)
    analysis = job_digest("analyse", in_numbers(analysed(content)), upstream)
    reference = round(forecast.reference_seconds(experiment), 3)
    extrapolation = ""
    if experiment.output == "best":
        extrapolation = job_digest(
            "extrapolate", in_numbers(extrapolated(content)), level_digests(levels)
        )
    return Plan(
        collection=experiment.collection,
        name=experiment.name,
        title=experiment.title,
        source=experiment.source,
        cases=experiment.members,
        schemes=tuple(scheme.name for scheme in experiment.schemes),
        levels=levels,
        batches=tuple(
            _batch(group, shard, trajectories)
            for group in groups
            for shard in range(len(group[0].shards))
        ),
        analysis=analysis,
        analysis_memory=analysis_memory(costs, experiment.members)
        + forecast.other_memory(experiment, costs),
        process_memory=process_memory(costs, experiment.members),
        analysis_bytes=analysis_written(costs, experiment.members, is_bounded(experiment)),
        extrapolation=extrapolation,
        report=job_digest("report", content, {"analysis": analysis}, DRAWING),
        content=content,
        # versions of packages are recorded for provenance alone: their digests decide what runs again
        versions={**versions(NUMERICAL), **{dist.name: dist.version for dist in dists if dist}},
        notes=experiment.notes + forecast.notes(reference, experiment.model.kind),
        inputs=experiment.model.files,
        packages=packages,
        reference_seconds=reference,
        other_seconds=round(forecast.other_seconds(experiment, costs), 3),
    )


def level_digests(levels: Iterable[LevelJob], settings: Sequence[str] = ()) -> dict[str, Any]:
    """Return the digests of the levels that a job reads, and the command-line settings that its results name."""
    digests = {"levels": [[shard.digest for shard in level.shards] for level in levels]}
    return {**digests, "settings": list(settings)} if settings else digests


def job_digest(
    name: str,
    content: Mapping[str, Any],
    upstream: Mapping[str, Any],
    libraries: tuple[str, ...] = NUMERICAL,
    package: str = "vibsim.cli.jobs",
) -> str:
    """Return the digest of a job that runs after the simulation, from what it uses and the digests of `upstream` jobs.

    The job runs the module `name` of `package`.
    """
    content = {"job": name, "experiment": content, "code": _code(name, package)}
    return digest_of({**content, **upstream, "versions": versions(libraries)})


@cache
def _code(name: str, package: str = "vibsim.cli.jobs") -> str:
    return code_digest.used_by(f"{package}.{name}")


@cache
def code_of(model: str, schemes: tuple[str, ...]) -> str:
    """Return the digest of the code that a simulation with this model and these schemes can run."""
    entries = [
        code_digest.home(MODELS[model], "vibsim.models"),
        *(code_digest.home(SCHEMES[kind], "vibsim.schemes") for kind in schemes),
    ]
    used = code_digest.used_by("vibsim.cli.jobs.simulate", *(module for module, _ in entries))
    content = {"used": used, "entries": entries}
    packages = [digest for _, _, digest in _offered(model, schemes)]
    if packages:
        # a package may import any module of vibsim
        content |= {"packages": packages, "vibsim": code_digest.everything()}
    return digest_of(content)


def _offered(model: str, schemes: tuple[str, ...]) -> Iterator[tuple[str, str, str]]:
    """Yield group, kind and digest of the model and of each scheme that an installed package offers."""
    pairs: list[tuple[Registry[Any], str]] = [
        (MODELS, model),
        *((SCHEMES, kind) for kind in schemes),
    ]
    for registry, kind in pairs:
        if kind not in registry.built_in:
            yield registry.group, kind, code_digest.of_offer(registry.group, kind)


def _kinds(experiment: Experiment) -> tuple[str, ...]:
    return tuple(sorted({scheme.kind for scheme in experiment.schemes}))


def _level(
    experiment: Experiment,
    content: Mapping[str, Any],
    level: int,
    values: Callable[[int, int], str],
) -> LevelJob:
    """Return the jobs of a level; `values` returns the digest of the swept values of members start..stop-1."""
    cost, members = level_cost(experiment, level), experiment.members
    every = sampling(experiment, level)
    kinds = _kinds(experiment)
    shared = digest_of(
        {
            "job": "simulate",
            "experiment": [experiment.collection, experiment.name],
            "uses": in_numbers(simulated(content)),
            "level": level,
            "steps": cost.steps,
            "every": every,
            "series": [*stored_series(experiment), "lean" if is_bounded(experiment) else "all"],
            "extrema": cost.extrema,
            "events": cost.events,
            "own ends": experiment.end_varies,
            "code": code_of(experiment.model.kind, kinds),
            "versions": versions(NUMERICAL),
        }
    )
    folder, is_swept = f"{experiment.collection}/{experiment.name}", experiment.sweep is not None

    def shard(index: int) -> ShardJob:
        start, stop = index * cost.shard, min((index + 1) * cost.shard, members)
        path = shard_path(folder, level, index if is_swept else None)
        uses = {"shared": shared, "cases": [start, stop], "values": values(start, stop)}
        return ShardJob(index, start, stop, path, digest_of(uses))

    return LevelJob(
        level=level,
        steps=cost.steps,
        every=every,
        member_steps=cost.schemes * members * cost.steps,
        bytes=cost.written(members),
        seconds=round(cost.seconds(members), 3),
        shared=round(members * cost.shared, 3),
        memory=cost.memory(min(members, cost.shard)),
        shards=tuple(map(shard, range(cost.shards(members)))),
    )


def _groups(levels: Sequence[LevelJob]) -> Iterator[list[LevelJob]]:
    """Group successive levels that have the same shards, as long as one job can make the whole group cheaply."""
    group: list[LevelJob] = []
    for level in levels:
        if group and not _is_cheap([*group, level]):
            yield group
            group = []
        group.append(level)
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
    """Return the job that makes shard number `index` of the levels in `group`."""
    shards = group[0].shards
    once = group[0].shared + sum(level.seconds - level.shared for level in group)
    work = once * (shards[index].stop - shards[index].start) / shards[-1].stop
    is_heavy = work > DIVISIBLE_SECONDS and trajectories >= DIVISIBLE_MEMBERS
    return Batch(
        levels=tuple(level.level for level in group),
        shard=index,
        digest=batch_digest([level.shards[index].digest for level in group]),
        seconds=round(JOB_SECONDS + work, 3),
        memory=max(level.memory for level in group),
        is_divisible=len(shards) == 1 and is_heavy,
    )
