"""Digests of jobs, and the part of an experiment that each kind of job uses and records in its file."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from vibsim.experiment import Experiment
    from vibsim.experiment.solver import SolverExperiment


def simulated(content: Mapping[str, Any]) -> dict[str, Any]:
    """Return the part of an experiment in normal form that the simulations of all its members share."""
    unused = "title source checks levels samples sweep output tolerance published figures units"
    return _without(content, unused)


def extrapolated(content: Mapping[str, Any]) -> dict[str, Any]:
    """Return the part of an experiment in normal form that an extrapolation uses and records."""
    return _without(content, "title source checks published figures units")


def analysed(content: Mapping[str, Any]) -> dict[str, Any]:
    """Return the part of an experiment in normal form that an analysis uses and records."""
    unused = "title source output figures units"
    return _without(content, "title source solver resources" if "solver" in content else unused)


def solved(experiment: SolverExperiment, level: int, member: int) -> dict[str, Any]:
    """Return what a level of the user's own solver uses and records, besides files and code."""
    solver = experiment.solver
    marks = {name: f"{{{name}}}" for name in ("output", "output.nc", "output.csv", "threads")}
    call: Any = solver.text
    if solver.kind == "command":
        call = experiment.arguments(level, member, marks)
    elif solver.kind == "files":
        call = experiment.path(level, member)
    return {
        solver.kind: call,
        "sizes": experiment.sizes_of(level),
        "parameters": experiment.parameters_of(member),
        "quantities": {
            name: None if row.coordinates is None else list(row.coordinates)
            for name, row in experiment.quantities.items()
        },
    }


def _without(content: Mapping[str, Any], keys: str) -> dict[str, Any]:
    return {key: value for key, value in content.items() if key not in keys.split()}


def in_numbers(content: Mapping[str, Any]) -> dict[str, Any]:
    """Return `content` with each table reduced to its numbers, without its file and columns."""
    model = dict(content["model"])
    if "tables" in model:
        model["tables"] = {name: table["numbers"] for name, table in model["tables"].items()}
    if "structure" in model:
        arrays = {
            name: {key: value for key, value in array.items() if key not in ("file", "columns")}
            for name, array in model["structure"]["arrays"].items()
        }
        model["structure"] = {**model["structure"], "arrays": arrays}
    return {**content, "model": model}


def values_digest(experiment: Experiment, start: int, stop: int) -> str:
    """Return the SHA-256 of the swept keys and their values for members start..stop-1; empty without a sweep."""
    if experiment.sweep is None:
        return ""
    from vibsim.experiment.sweep_columns import columns

    digest = hashlib.sha256()
    for key, values in columns(experiment, start, stop).items():
        words = values.dtype.kind == "U"
        digest.update(f"{key} {'words' if words else 'numbers'}\n".encode())
        digest.update(json.dumps(values.tolist()).encode() if words else values.tobytes())
    return digest.hexdigest()


def digest_of(content: Mapping[str, Any]) -> str:
    """Return the SHA-256 of `content` as JSON with sorted keys."""
    text = json.dumps(content, sort_keys=True, allow_nan=False, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


def batch_digest(files: Sequence[str]) -> str:
    """Return the digest of a job from the digests of its files; for a single file they are the same."""
    return files[0] if len(files) == 1 else digest_of({"job": "simulate", "files": list(files)})
