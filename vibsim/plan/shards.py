"""The files of each level: ranges of members, with a digest of everything that their numbers depend on.

The border between two files depends on the cost of one member at that level alone, and a digest covers the values of
its own members, not the text of the sweep: members added at the end, or the same values written otherwise, leave all
full files as they are.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Callable, Mapping
from functools import cache
from typing import TYPE_CHECKING, Any

from vibsim.plan import code
from vibsim.plan.cases import columns, sampling
from vibsim.plan.jobs import LevelJob, ShardJob, shard_path
from vibsim.plan.versions import NUMERICAL, versions
from vibsim.spec.cost import COUPLED, EVENTFUL, Load, work

if TYPE_CHECKING:
    from vibsim.models import Model
    from vibsim.spec import Experiment

_NOT_SIMULATED = (
    *("title", "source", "checks", "levels", "samples", "sweep"),
    *("output", "tolerance", "published", "units"),
)


def digest_of(content: Mapping[str, Any]) -> str:
    """Return the SHA-256 of `content` as JSON with sorted keys."""
    text = json.dumps(content, sort_keys=True, allow_nan=False, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


def simulated(content: Mapping[str, Any]) -> dict[str, Any]:
    """Return the part of an experiment in normal form that every member shares."""
    return {key: value for key, value in content.items() if key not in _NOT_SIMULATED}


def in_numbers(content: Mapping[str, Any]) -> dict[str, Any]:
    """Return a part of an experiment in normal form with the numbers of its tables alone, wherever they stand."""
    model = content["model"]
    if "tables" not in model:
        return dict(content)
    tables = {name: table["numbers"] for name, table in model["tables"].items()}
    return {**content, "model": {**model, "tables": tables}}


def _alone(model: Model) -> float | None:
    """Return what a step takes of a model whose members are stepped one by one (`vibsim.spec.cost.work`)."""
    if model.events is not None:
        return EVENTFUL
    return COUPLED if model.coordinates > 1 or model.lookup is not None else None


def load_of(experiment: Experiment, level: int) -> Load:
    """Return what one member of `experiment` costs at `level`."""
    from vibsim.models import has_solution
    from vibsim.schemes import SCHEMES
    from vibsim.spec.series import extrema_kept

    model, steps = experiment.model.definition, experiment.steps(level)
    lean = is_bounded(experiment)
    trajectories = len(experiment.schemes) * experiment.members
    kinds = [SCHEMES[experiment.schemes[i].kind] for i in experiment.ladder]
    works = [work(kind.force_evaluations, kind.explicit, _alone(model)) for kind in kinds]
    return Load(
        schemes=len(experiment.schemes),
        steps=steps,
        samples=steps // sampling(experiment, level) + 1,
        series=len(_series(experiment)),
        exact=len(model.states) if has_solution(model) and not lean else 0,
        work=sum(explicit for explicit, _ in works),
        iterated=sum(iterated for _, iterated in works),
        extrema=0 if lean else extrema_kept(steps, trajectories),
        d2t=experiment.own_velocity or not lean,
        own=_own_seconds(experiment),
    )


def _own_seconds(experiment: Experiment) -> float:
    """Return the seconds that schemes which choose their own steps take of a member that is not swept."""
    from vibsim.schemes import SCHEMES
    from vibsim.schemes.adaptive import seconds

    model = experiment.model.definition
    turns = experiment.time.end * float(model.natural_frequency(experiment.model.parameters))
    return sum(
        seconds(scheme.kind, float(scheme.options["tolerance"]), turns / (2.0 * math.pi))
        for scheme in experiment.schemes
        if SCHEMES[scheme.kind].adaptive
    )


def is_bounded(experiment: Experiment) -> bool:
    """Tell whether `experiment` is so large that its storage is bounded."""
    from vibsim.spec import series

    return series.is_bounded(experiment)


def _series(experiment: Experiment) -> tuple[str, ...]:
    """Name the series that are kept of every scheme and member."""
    from vibsim.spec.series import stored_series

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


def values_digest(experiment: Experiment, start: int, stop: int) -> str:
    """Return the SHA-256 of the swept keys and their values for members start..stop-1; empty without a sweep."""
    if experiment.sweep is None:
        return ""
    digest = hashlib.sha256()
    for key, values in columns(experiment, start, stop).items():
        words = values.dtype.kind == "U"
        digest.update(f"{key} {'words' if words else 'numbers'}\n".encode())
        digest.update(json.dumps(values.tolist()).encode() if words else values.tobytes())
    return digest.hexdigest()


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
    """Return the digest of the code that a simulation runs.

    What works out the members, their ends and their samples is no part of it: what comes out is in the digest itself.
    """
    from vibsim.models import MODELS
    from vibsim.schemes import SCHEMES

    return code.used_by(
        "vibsim.engine",
        "vibsim.simulation",
        "vibsim.store.writing",
        code.home(MODELS[model], "vibsim.models"),
        *(code.home(SCHEMES[kind], "vibsim.schemes") for kind in schemes),
    )
