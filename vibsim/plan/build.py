"""Build the plan of a validated experiment.

A digest covers exactly what a job uses: its part of the experiment in normal form, the code it runs and
the libraries that the numbers come from. Titles and checks are no part of a simulation; a level knows
nothing of the other levels but which samples it keeps.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import cache
from typing import TYPE_CHECKING, Any

from vibsim.plan import code
from vibsim.plan.batches import batches
from vibsim.plan.jobs import LevelJob, Plan
from vibsim.plan.shards import digest_of, in_numbers, is_bounded, level_jobs, load_of
from vibsim.plan.versions import DRAWING, NUMERICAL, versions
from vibsim.spec.cost import analysis_disk, analysis_memory

if TYPE_CHECKING:
    from vibsim.spec import Experiment


def build(experiment: Experiment) -> Plan:
    """Return the plan of `experiment`, which has at least one level."""
    from vibsim.spec import canonical

    content: dict[str, Any] = json.loads(json.dumps(canonical(experiment), allow_nan=False))
    levels = level_jobs(experiment, content)
    analysis = _analysis(experiment, content, levels)
    loads = [load_of(experiment, level) for level in experiment.levels]
    return Plan(
        collection=experiment.collection,
        name=experiment.name,
        title=experiment.title,
        source=experiment.source,
        cases=experiment.members,
        schemes=tuple(scheme.name for scheme in experiment.schemes),
        levels=levels,
        batches=batches(levels, len(experiment.schemes) * experiment.members),
        analysis=analysis,
        analysis_memory=analysis_memory(loads, experiment.members),
        analysis_bytes=analysis_disk(loads, experiment.members, is_bounded(experiment)),
        extrapolation=_extrapolation(content, levels),
        report=_report(content, analysis),
        content=content,
        versions=versions(NUMERICAL),
        inputs=tuple((t.file, t.content) for t in experiment.model.tables.values()),
    )


def _analysis(
    experiment: Experiment, content: Mapping[str, Any], levels: tuple[LevelJob, ...]
) -> str:
    return digest_of(
        {
            "job": "analyse",
            "levels": _digests(levels),
            "title": experiment.title,
            "checks": content.get("checks"),
            "published": content.get("published"),
            # How the members lie in the space of parameters is no number of theirs.
            "sweep": content.get("sweep"),
            "tolerance": content.get("tolerance"),
            "code": _analysis_code(),
            "versions": versions(NUMERICAL),
        }
    )


def _digests(levels: tuple[LevelJob, ...]) -> list[list[str]]:
    return [[shard.digest for shard in level.shards] for level in levels]


@cache
def _analysis_code() -> str:
    return code.used_by(
        "vibsim.analysis",
        "vibsim.spec.values",
        "vibsim.store.writing",
        "vibsim.store.level",
        "vibsim.store.summary",
    )


def extrapolated(content: Mapping[str, Any]) -> dict[str, Any]:
    """Return the part of an experiment in normal form that an extrapolation depends on and tells of."""
    return {key: value for key, value in content.items() if key not in _NOT_EXTRAPOLATED}


_NOT_EXTRAPOLATED = ("title", "source", "checks", "published", "units")


@cache
def _extrapolation_code() -> str:
    return code.used_by(
        "vibsim.analysis.extrapolation", "vibsim.store.writing", "vibsim.store.level"
    )


def _extrapolation(content: Mapping[str, Any], levels: tuple[LevelJob, ...]) -> str:
    if content.get("output") != "best":
        return ""
    return digest_of(
        {
            "job": "extrapolate",
            "levels": _digests(levels),
            "experiment": in_numbers(extrapolated(content)),
            "code": _extrapolation_code(),
            "versions": versions(NUMERICAL),
        }
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
