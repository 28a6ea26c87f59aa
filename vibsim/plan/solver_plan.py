"""Build the plan of an experiment with the user's own solver.

The digest of a level covers what decides its numbers: the command with its arguments, or the function with sizes and
parameters, and the content of all files that these depend on. It does not cover the code of vibsim, which only stores
what the solver wrote: a solver may run for hours.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

from vibsim.core import regular_files
from vibsim.core.vocabulary import FORMAT
from vibsim.experiment.solver import NO_MODULE, SolverExperiment
from vibsim.plan import code_digest
from vibsim.plan.build import job_digest, level_digests
from vibsim.plan.digests import analysed, digest_of, solved
from vibsim.plan.jobs import Batch, LevelJob, Plan, ShardJob, shard_path
from vibsim.plan.versions import DRAWING, NUMERICAL, versions

MEGABYTE = 10**6
ANALYSIS_MEMORY = 500 * MEGABYTE
"""Memory of an analysis [bytes]: a guess, since the sizes of the fields are unknown until the solver has run."""

_level = partial(LevelJob, steps=0, every=1, member_steps=0, bytes=0, seconds=0.0, shared=0.0)
"""A level of the user's solver: the number of steps and the cost are unknown."""


def build(experiment: SolverExperiment) -> Plan:
    """Return the plan of `experiment`.

    Raises
    ------
    InputError
        Where a file or a module that the levels depend on cannot be found.
    """
    content: dict[str, Any] = json.loads(json.dumps(experiment.content, allow_nan=False))
    solver, resources = experiment.solver, experiment.resources
    inputs = {name: _digest(experiment, name) for name in solver.inputs}
    module = solver.text.partition(":")[0] if solver.kind == "python" else ""
    package = _code(experiment, module) if module else ""
    memory = resources.mem_mb * MEGABYTE
    files: dict[str, str] = {}
    levels = []
    for level in experiment.levels:
        if solver.kind == "files":
            paths = [experiment.path(level, member) for member in range(experiment.members)]
            digests = {path: _digest(experiment, path) for path in paths}
            files |= digests
            member_inputs = [{"file": digests[path]} for path in paths]
        else:
            member_inputs = [inputs] * experiment.members
        shards = _shards(experiment, level, member_inputs, package)
        levels.append(_level(level=level, memory=memory, shards=shards))
    upstream = level_digests(levels, experiment.settings)
    analysis = job_digest("judge_levels", analysed(content), upstream)
    return Plan(
        collection=experiment.collection,
        name=experiment.name,
        title=experiment.title,
        source=experiment.source,
        cases=experiment.members,
        schemes=(),
        levels=tuple(levels),
        batches=tuple(
            Batch(
                levels=(level.level,),
                shard=shard.index,
                digest=shard.digest,
                seconds=0.0,
                memory=level.memory,
                is_divisible=False,
                threads=resources.threads,
                runtime=resources.runtime,
            )
            for level in levels
            for shard in level.shards
        ),
        analysis=analysis,
        analysis_memory=ANALYSIS_MEMORY,
        process_memory=0,
        analysis_bytes=0,
        extrapolation="",
        report=job_digest(
            "solver", content, {"analysis": analysis}, DRAWING, package="vibsim.report.page"
        ),
        content=content,
        versions=versions(NUMERICAL),
        inputs=tuple((files or inputs).items()),
        packages=((code_digest.MODULE, module, package),) if package else (),
    )


def _shards(
    experiment: SolverExperiment, level: int, inputs: Sequence[Mapping[str, str]], code: str
) -> tuple[ShardJob, ...]:
    """Return the jobs of a level, one for each member, from the digests of its input files and of the solver's code."""
    key = f"{experiment.collection}/{experiment.name}"
    shards = []
    for member, files in enumerate(inputs):
        uses = {"uses": solved(experiment, level, member), "inputs": files, "code": code}
        digest = digest_of({"job": "solve", "format": FORMAT, **uses})
        number = None if experiment.sweep is None else member
        path = shard_path(key, level, number)
        shards.append(ShardJob(member, member, member + 1, path, digest))
    return tuple(shards)


def _digest(experiment: SolverExperiment, name: str) -> str:
    """Return the digest of a file in the folder of the experiment file."""
    try:
        return regular_files.digest(experiment.folder / name)
    except (OSError, ValueError) as error:
        rule = f"cannot be read ({getattr(error, 'strerror', None) or error})"
        raise experiment.refused(f"solver.{experiment.solver.kind}", name, rule) from None


def _code(experiment: SolverExperiment, module: str) -> str:
    """Return the digest of the package that contains a module, without importing it."""
    digest = code_digest.of_module(module, experiment.folder)
    if not digest:
        raise experiment.refused("solver.python", module, NO_MODULE)
    return digest
