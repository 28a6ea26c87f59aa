"""Digests: of an experiment the part that a job uses, which its file tells of too; of a job its files."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from vibsim.experiment import Experiment

_NOT_ANALYSED = ("title", "source", "output", "units")
_NOT_EXTRAPOLATED = ("title", "source", "checks", "published", "units")
_NOT_SIMULATED = (
    *("title", "source", "checks", "levels", "samples", "sweep"),
    *("output", "tolerance", "published", "units"),
)


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


def extrapolated(content: Mapping[str, Any]) -> dict[str, Any]:
    """Return the part of an experiment in normal form that an extrapolation depends on and tells of."""
    return {key: value for key, value in content.items() if key not in _NOT_EXTRAPOLATED}


def analysed(content: Mapping[str, Any]) -> dict[str, Any]:
    """Return the part of an experiment in normal form that an analysis depends on and tells of."""
    return {key: value for key, value in content.items() if key not in _NOT_ANALYSED}


def digest_of(content: Mapping[str, Any]) -> str:
    """Return the SHA-256 of `content` as JSON with sorted keys."""
    text = json.dumps(content, sort_keys=True, allow_nan=False, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


def batch_digest(files: Sequence[str]) -> str:
    """Return the digest of a job from those of its files: that of the file where there is one."""
    return files[0] if len(files) == 1 else digest_of({"job": "simulate", "files": list(files)})
