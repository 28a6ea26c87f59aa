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

from vibsim.experiment.cost import analysis_disk, analysis_memory
from vibsim.plan import code_digest
from vibsim.plan.batches import batches
from vibsim.plan.digested_part import analysed, extrapolated, in_numbers
from vibsim.plan.jobs import LevelJob, Plan
from vibsim.plan.shards import digest_of, is_bounded, level_jobs
from vibsim.plan.versions import DRAWING, NUMERICAL, versions

if TYPE_CHECKING:
    from vibsim.experiment import Experiment


def build(experiment: Experiment) -> Plan:
    """Return the plan of `experiment`, which has at least one level."""
    from vibsim.experiment import canonical
    from vibsim.experiment.level_counts import load_of

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
