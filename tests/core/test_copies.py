"""Verdicts and errors are data: copied, pickled, and sent from one process to another, they stay as they are."""

from __future__ import annotations

import importlib
import pickle
import pkgutil
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from copy import deepcopy
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import vibsim
from vibsim import Experiment, analyse, simulate, verdicts
from vibsim.checks.fields import Field
from vibsim.checks.outcome import Outcome, Results
from vibsim.core.errors import (
    DamagedFileError,
    Fault,
    FileError,
    InputError,
    SimulationError,
    StaleFileError,
    VibsimError,
)
from vibsim.experiment.schema.unit_text import UnitError
from vibsim.formula import ExpressionError
from vibsim.native.source import NativeError
from vibsim.schemes.step_numbers import EndlessStepError

FAULTS = [
    Fault("b.yaml", 3, "model.g", "-1", "must be positive", "write 9.81"),
    Fault("a.yaml", 0, "", "", "is empty"),
]
ERRORS = [
    VibsimError("a message"),
    SimulationError("a message"),
    NativeError("a message"),
    InputError(iter(FAULTS)),
    FileError(Path("level_04.nc"), "is too short"),
    DamagedFileError(Path("level_04.nc"), "is too short"),
    StaleFileError(Path("level_04.nc"), "belongs to another job"),
    ExpressionError("a b", 2, "expected an operator", "write a*b"),
    UnitError("unknown unit", "did you mean 'm'?"),
    UnitError("unknown unit"),
    EndlessStepError("a loop of the step does not end"),
]
COPIES: list[Callable[[Any], Any]] = [deepcopy, lambda item: pickle.loads(pickle.dumps(item))]


def every_kind(base: type) -> Iterator[type]:
    yield base
    for one in base.__subclasses__():
        yield from every_kind(one)


def test_every_error_is_among_the_examples() -> None:
    for module in pkgutil.walk_packages(vibsim.__path__, "vibsim."):
        if not module.name.endswith("__main__"):
            importlib.import_module(module.name)
    ours = {kind for kind in every_kind(VibsimError) if kind.__module__.startswith("vibsim.")}
    assert ours == {type(error) for error in ERRORS}


@pytest.mark.parametrize("copy", COPIES, ids=["deepcopy", "pickle"])
@pytest.mark.parametrize("error", ERRORS, ids=lambda error: type(error).__name__)
def test_a_copy_of_an_error_says_the_same(
    error: VibsimError, copy: Callable[[VibsimError], VibsimError]
) -> None:
    other = copy(error)
    assert type(other) is type(error)
    assert str(other) == str(error) != ""
    assert vars(other) == vars(error)


def test_the_message_of_refused_input_has_every_fault_in_order() -> None:
    error = InputError(iter(FAULTS))
    assert error.faults == tuple(sorted(FAULTS))
    assert str(error) == ("a.yaml: is empty\nb.yaml:3: model.g: -1: must be positive: write 9.81")


def judged(end: float) -> list[vibsim.Verdict]:
    experiment = Experiment.from_dict(
        {
            "title": "pendulums",
            "model": {"kind": "pendulum"},
            "initial": {"theta": 1.0},
            "time": {"end": end},
            "levels": [5, 6, 7, 8],
            "schemes": ["central", "rk4"],
            "sweep": {"initial.theta": [0.5, 1.0, 3.0]},
            "checks": [
                {"converges": "theta"},
                {"value": "period_error", "below": 1e-9},
                {"conserves": "energy", "drift": "bounded"},
                {"stable": True},
                {"equal": ["central", "exact"], "quantity": "theta", "atol": 1e-3},
                {"claim": "c", "that": {"value": "end", "quantity": "theta", "below": 9}},
            ],
        }
    )
    return verdicts(
        experiment, analyse(experiment, [simulate(experiment, n) for n in experiment.levels])
    )


@pytest.fixture(scope="module")
def found() -> list[vibsim.Verdict]:
    return judged(10.0)


@pytest.mark.parametrize("copy", COPIES, ids=["deepcopy", "pickle"])
def test_a_copy_of_a_verdict_is_equal(
    found: list[vibsim.Verdict], copy: Callable[[Any], Any]
) -> None:
    other = copy(found)
    assert other == found
    for a, b in zip(other, found, strict=True):
        assert list(a.results) == list(b.results)
        assert a.results[:2] == b.results[:2]
        # a copy can be copied
        assert copy(a) == a


@pytest.mark.slow
def test_verdicts_and_errors_come_from_another_process(found: list[vibsim.Verdict]) -> None:
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        assert pool.submit(judged, 10.0).result() == found
        error = pool.submit(judged, -1.0).exception()
    assert isinstance(error, InputError)
    assert [fault.key for fault in error.faults] == ["time.end"]


def test_the_results_of_a_large_sweep_are_pickled_as_arrays() -> None:
    members = 10**5
    shape, numbers = (1, members), np.arange(float(members))[None]
    small = np.zeros(shape, dtype=np.int8)
    outcome = Outcome(
        schemes=["central"],
        scheme_index=[0],
        cases=np.arange(members),
        case_index=np.arange(members),
        status=small,
        reason=small,
        compared=small,
        away=numbers,
        facts={"order": (Field("order"), numbers)},
    )
    results = Results(outcome)
    assert results[0].case == members - 1  # ranked, which is not sent along
    text = pickle.dumps(results)
    # three arrays of 8 bytes and three of 1 byte
    assert len(text) < 32 * members
    assert pickle.loads(text)[:3] == results[:3]
