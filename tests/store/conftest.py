from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from vibsim import store
from vibsim.core.record import Record, Variable

DIGEST = "d" * 64


def build(seed: int = 1, cases: int = 3, points: int = 9) -> Record:
    """Return a record with everything that files have: texts, flags, empty axes, swept values."""
    rng = np.random.default_rng(seed)
    name = {"long_name": "a name"}
    number = {"long_name": "a number", "units": "1"}
    angle = {"long_name": "angle", "units": "rad"}
    coords = {
        "scheme": Variable(("scheme",), np.array(["central", "größer"]), name),
        "case": Variable(("case",), np.arange(cases), number),
        "t": Variable(("t",), np.linspace(0, 20, points), {"long_name": "time", "units": "s"}),
        "initial_theta": Variable(
            ("case",), rng.random(cases), {**angle, "sweep_key": "initial.theta"}
        ),
        "level": Variable(("level",), np.array([6, 7]), number),
        "steps": Variable(("level",), np.array([64, 2**40]), number),
        "triple": Variable(("triple",), np.array([], dtype=np.int64), number),
        "norm": Variable(("norm",), np.array(["l1", "l2"]), name),
    }
    flags = {"long_name": "status", "flag_values": [0, 1], "flag_meanings": "ok non_finite"}
    theta = rng.standard_normal((2, cases, points))
    theta[1, 0, 3:] = np.nan
    theta[0, 0, :3] = [np.inf, -np.inf, -0.0]
    variables = {
        "theta": Variable(("scheme", "case", "t"), theta, angle),
        "ratio": Variable(("case", "triple", "t"), np.zeros((cases, 0, points)), number),
        "status": Variable(("scheme", "case"), np.zeros((2, cases), np.int8), flags),
        "norms": Variable(("scheme", "norm"), rng.random((2, 2)), number),
        "scalar": Variable((), np.array(0.25), number),
    }
    attrs = {"title": "a title", "level": 6, "fraction": 0.5, "list": [1, 2, 3]}
    return Record(coords, variables, attrs)


@pytest.fixture
def record() -> Record:
    return build()


@pytest.fixture
def file(tmp_path: Path, record: Record) -> Path:
    path = tmp_path / "level_06.nc"
    store.write(path, record, digest=DIGEST, provenance={"experiment": {"model": "pendulum"}})
    return path
