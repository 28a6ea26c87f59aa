"""Build the plan of a validated experiment.

A digest covers exactly what a job uses: its part of the experiment in normal form, the code it runs and
the libraries that the numbers come from. Titles and checks are no part of a simulation; a level knows
nothing of the other levels but the stride of its samples.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from functools import cache
from typing import TYPE_CHECKING, Any

from vibsim.plan import code
from vibsim.plan.cases import count, sampling
from vibsim.plan.jobs import LevelJob, Plan, ShardJob, shard_path
from vibsim.plan.versions import DRAWING, NUMERICAL, versions

if TYPE_CHECKING:
    from vibsim.spec import Experiment

_NOT_SIMULATED = ("title", "source", "checks", "levels", "samples")
_SECONDS_PER_STEP = 30e-9
_SECONDS_PER_JOB = 0.6
_SERIES = 6
"""Stored series of one scheme and member: the states and the energies."""


def build(experiment: Experiment) -> Plan:
    """Return the plan of `experiment`."""
    from vibsim.spec import canonical

    content: dict[str, Any] = json.loads(json.dumps(canonical(experiment), allow_nan=False))
    levels = tuple(_level(experiment, content, level) for level in experiment.levels)
    analysis = _analysis(experiment, content, levels)
    return Plan(
        collection=experiment.collection,
        name=experiment.name,
        title=experiment.title,
        source=experiment.source,
        cases=count(experiment),
        schemes=tuple(scheme.name for scheme in experiment.schemes),
        levels=levels,
        analysis=analysis,
        report=_report(content, analysis),
        content=content,
        versions=versions(NUMERICAL),
        file=str(experiment.file or ""),
    )


def digest_of(content: Mapping[str, Any]) -> str:
    """Return the SHA-256 of `content` as JSON with sorted keys."""
    text = json.dumps(content, sort_keys=True, allow_nan=False, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


def simulated(content: Mapping[str, Any]) -> dict[str, Any]:
    """Return the part of an experiment in normal form that a simulation uses."""
    return {key: value for key, value in content.items() if key not in _NOT_SIMULATED}


def _level(experiment: Experiment, content: Mapping[str, Any], level: int) -> LevelJob:
    steps, every, cases = experiment.steps(level), sampling(experiment, level), count(experiment)
    is_swept = experiment.sweep is not None
    path = shard_path(f"{experiment.collection}/{experiment.name}", level, 0 if is_swept else None)
    digest = digest_of(
        {
            "job": "simulate",
            "experiment": [experiment.collection, experiment.name],
            "uses": simulated(content),
            "level": level,
            "steps": steps,
            "every": every,
            "cases": [0, cases],
            "code": _simulation_code(experiment),
            "versions": versions(NUMERICAL),
        }
    )
    members = len(experiment.schemes) * cases
    return LevelJob(
        level=level,
        steps=steps,
        every=every,
        member_steps=members * steps,
        bytes=8 * _SERIES * members * (steps // every + 1) + 20_000,
        seconds=round(members * steps * _SECONDS_PER_STEP + _SECONDS_PER_JOB, 3),
        shards=(ShardJob(0, 0, cases, path, digest),),
    )


def _simulation_code(experiment: Experiment) -> str:
    return _code_of(experiment.model.kind, tuple(sorted({s.kind for s in experiment.schemes})))


@cache
def _code_of(model: str, schemes: tuple[str, ...]) -> str:
    from vibsim.models import MODELS
    from vibsim.schemes import SCHEMES

    return code.used_by(
        "vibsim.engine",
        "vibsim.simulation",
        "vibsim.store.netcdf",
        "vibsim.plan.cases",
        "vibsim.spec.members",
        "vibsim.spec.sampling",
        code.home(MODELS[model], "vibsim.models"),
        *(code.home(SCHEMES[kind], "vibsim.schemes") for kind in schemes),
    )


def _analysis(
    experiment: Experiment, content: Mapping[str, Any], levels: tuple[LevelJob, ...]
) -> str:
    return digest_of(
        {
            "job": "analyse",
            "levels": [[shard.digest for shard in level.shards] for level in levels],
            "title": experiment.title,
            "checks": content.get("checks"),
            "code": _analysis_code(),
            "versions": versions(NUMERICAL),
        }
    )


@cache
def _analysis_code() -> str:
    return code.used_by(
        "vibsim.analysis",
        "vibsim.spec.values",
        "vibsim.store.netcdf",
        "vibsim.store.summary",
        "vibsim.store.shards",
    )


def _report(content: Mapping[str, Any], analysis: str) -> str:
    return digest_of(
        {
            "job": "report",
            "analysis": analysis,
            "experiment": content,
            "code": report_code(),
            "versions": versions(DRAWING),
        }
    )


@cache
def report_code() -> str:
    """Return the digest of the code and the templates of the reports."""
    return code.of_folder("vibsim.report")
