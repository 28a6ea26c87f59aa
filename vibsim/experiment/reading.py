"""The ways into an experiment: a file, or its content as a dictionary."""

from __future__ import annotations

import re
from collections.abc import Mapping
from numbers import Integral, Real
from pathlib import Path
from typing import Any

from vibsim.core.errors import Fault, InputError
from vibsim.experiment.build import Place, build
from vibsim.experiment.collection import collection_of
from vibsim.experiment.data import AnyExperiment
from vibsim.experiment.faults import Report, shorten
from vibsim.experiment.schema.document import Document
from vibsim.experiment.schema.fields import IDENTIFIER
from vibsim.experiment.yaml.parse import MAX_DEPTH, Source, read

MAX_NAME = 100
MAX_REPEATS = 20
"""Snakemake takes a name that ends in so many repetitions for a rule that feeds itself."""

_PERIODIC = re.compile(rf"(.+)\1{{{MAX_REPEATS - 1}}}$")
_NAME_RULE = "must consist of a to z, 0 to 9 and _"


def from_file(
    kind: type[AnyExperiment], path: Path, collection: str | None, configs: Path | None
) -> AnyExperiment:
    """Read the experiment file at `path`; see `vibsim.experiment.Experiment.from_yaml`."""
    source = read(path, list(Document.model_fields))
    return _build(kind, source, Place(collection or collection_of(path, configs), path.stem, path))


def from_content(
    kind: type[AnyExperiment], data: Mapping[str, Any], name: str, collection: str
) -> AnyExperiment:
    """Build an experiment from `data`; see `vibsim.experiment.Experiment.from_dict`."""
    return _build(kind, Source(name, _plain(data, name)), Place(collection, name))


def _build(kind: type[AnyExperiment], source: Source, place: Place) -> AnyExperiment:
    report = Report(source)
    _check_names(place, report)
    return build(kind, source, place, report)


def _check_names(place: Place, report: Report) -> None:
    for what, text in (("experiment", place.name), ("collection", place.collection)):
        named = f"the name of the {what}, '{shorten(text)}',"
        if not re.fullmatch(IDENTIFIER, text):
            report.add((), f"{named} {_NAME_RULE}")
        elif len(text) > MAX_NAME:
            report.add((), f"{named} must not be longer than {MAX_NAME} characters")
        elif _PERIODIC.search(text):
            report.add((), f"{named} must not end with {MAX_REPEATS} times the same")


def _plain(data: Any, name: str, depth: int = 0) -> Any:
    """Return `data` with Python's own numbers, lists and dictionaries."""
    if depth > MAX_DEPTH:
        rule = f"must not nest deeper than {MAX_DEPTH} levels"
        raise InputError([Fault(name, 0, "", "", rule)])
    if isinstance(data, Mapping):
        return {str(key): _plain(value, name, depth + 1) for key, value in data.items()}
    if isinstance(data, list | tuple):
        return [_plain(value, name, depth + 1) for value in data]
    if hasattr(data, "tolist"):
        return _plain(data.tolist(), name, depth + 1)
    if isinstance(data, bool):
        return data
    if isinstance(data, Integral):
        return int(data)
    return float(data) if isinstance(data, Real) else data
