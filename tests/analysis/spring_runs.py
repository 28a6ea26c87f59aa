"""Runs of the spring with schemes from the registry, or with one that is put there for a test."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import pytest

from vibsim.analysis import Verdict, analyse_records, summarise, verdicts
from vibsim.core.record import Record
from vibsim.experiment import Experiment
from vibsim.schemes import SCHEMES, Scheme
from vibsim.simulation import simulate_record

PERIODS = 10
STEPS = 400
"""Steps at level 0: 40 per period, w dt = 0.157."""


@dataclass(frozen=True)
class Run:
    """What came of an experiment."""

    experiment: Experiment
    levels: dict[int, Record]
    record: Record
    verdicts: list[Verdict]
    summary: dict[str, Any]


def spring(
    schemes: Sequence[Any], *checks: dict[str, Any], levels: Sequence[int] = (0,), **more: Any
) -> Run:
    """Run the spring with w = 2 pi over ten periods, and judge it."""
    data: dict[str, Any] = {
        "title": "test",
        "model": {"kind": "spring", "w": "2*pi"},
        "initial": {"u": 1.0},
        "time": {"end": float(PERIODS), "base_steps": STEPS},
        "levels": list(levels),
        "schemes": list(schemes),
        "samples": "all",
        "checks": list(checks),
    }
    experiment = Experiment.from_dict({**data, **more})
    records = {level: simulate_record(experiment, level) for level in experiment.levels}
    return judged(experiment, records)


def judged(experiment: Experiment, levels: dict[int, Record]) -> Run:
    """Judge the Records of an experiment's levels."""
    record = analyse_records(experiment, levels)
    found = verdicts(experiment, record)
    summary = summarise(experiment, found, record)
    assert json.loads(json.dumps(summary, allow_nan=False)) == summary
    return Run(experiment, levels, record, found, summary)


def registered(monkeypatch: pytest.MonkeyPatch, scheme: Scheme) -> None:
    """Put a scheme into the registry, wherever that was imported."""
    known = MappingProxyType({**SCHEMES, scheme.kind: scheme})
    for name, module in list(sys.modules.items()):
        if name.startswith("vibsim") and getattr(module, "SCHEMES", None) is SCHEMES:
            monkeypatch.setattr(module, "SCHEMES", known)
