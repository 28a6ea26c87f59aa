"""Experiment files for the tests of `vibsim.experiment`."""

from __future__ import annotations

import cProfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from vibsim.cli.list_entry import needed
from vibsim.core.errors import Fault, InputError
from vibsim.experiment import Experiment
from vibsim.models import MODELS

GOOD = """\
title: A pendulum
model: {kind: pendulum}
initial: {theta: 1.0}
time: {end: 20.0}
levels: {from: 6, to: 9}
schemes: [central]
"""


@contextmanager
def calls_at_most(most: int) -> Iterator[None]:
    """Check how many functions of Python are called: that is work, whatever else the machine does."""
    with cProfile.Profile(builtins=False) as profile:
        yield
    assert sum(entry.callcount for entry in profile.getstats()) <= most


def content(**changes: Any) -> dict[str, Any]:
    """Return a good experiment as a dictionary, with `changes`; None takes a section out."""
    data: dict[str, Any] = {
        "title": "A pendulum",
        "model": {"kind": "pendulum"},
        "initial": {"theta": 1.0},
        "time": {"end": 20.0},
        "levels": {"from": 6, "to": 9},
        "schemes": ["central"],
    }
    return {key: value for key, value in (data | changes).items() if value is not None}


def build(**changes: Any) -> Experiment:
    return Experiment.from_dict(content(**changes))


def faults_of(**changes: Any) -> tuple[Fault, ...]:
    """Return the faults of the good experiment with `changes`."""
    with pytest.raises(InputError) as caught:
        build(**changes)
    return caught.value.faults


def only_fault(**changes: Any) -> Fault:
    faults = faults_of(**changes)
    assert len(faults) == 1, "\n".join(map(str, faults))
    return faults[0]


def write(folder: Path, text: str | bytes, name: str = "case.yaml") -> Path:
    path = folder / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def file_faults(folder: Path, text: str | bytes) -> tuple[Fault, ...]:
    with pytest.raises(InputError) as caught:
        Experiment.from_yaml(write(folder, text))
    return caught.value.faults


def smallest_section(kind: str) -> dict[str, str]:
    """Return a section `model` with what must be written alone."""
    return {"kind": kind, **{field.name: field.default for field in needed(MODELS[kind])}}
