"""A level that overflows is a result: it is told in the verdicts, and no warning of numpy reaches the terminal."""

from __future__ import annotations

import pytest

from vibsim import Experiment, analyse, simulate, verdicts
from vibsim.schemes import SCHEMES

RUNS = {
    "steps that are too long": ({"kind": "spring", "w": 1e6}, {"u": 1.0}, 100.0),
    "an energy that is too large": ({"kind": "spring", "w": 1.0}, {"u": 1e300}, 20.0),
}


@pytest.mark.parametrize("run", RUNS)
def test_an_overflow_warns_of_nothing(run: str) -> None:
    """Of no scheme. Warnings are errors in all tests."""
    model, initial, end = RUNS[run]
    kinds = [kind for kind, scheme in SCHEMES.items() if not scheme.adaptive]
    content = {"title": run, "model": model, "initial": initial, "time": {"end": end}}
    experiment = Experiment.from_dict({**content, "levels": [4, 5, 6], "schemes": kinds})
    levels = [simulate(experiment, level) for level in experiment.levels]
    found = verdicts(experiment, analyse(experiment, levels))
    assert {result.scheme for verdict in found for result in verdict.results} == set(kinds)
