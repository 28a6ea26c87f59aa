"""A function of the user as a solver: what it returns, raises, and how it may end its process."""

from __future__ import annotations

from pathlib import Path

import pytest

from vibsim.core.errors import VibsimError
from vibsim.experiment.solver_reading import from_file
from vibsim.solver import run

MODULE = """
import ctypes, os, signal, sys, xarray

def well(h):
    return xarray.Dataset({"u": 1.0 + h**2})

def raises(h):
    raise ValueError(f"no such step, {h}")

def leaves(h):
    sys.exit(0)

def stops(h):
    ctypes.CDLL(None).exit(0)  # as STOP in Fortran

def stops_with_status(h):
    os._exit(3)

def crashes(h):
    os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("well", ""),
        ("raises", "raised ValueError: no such step, 0.2"),
        ("leaves", "raised SystemExit: 0"),
        ("stops", "ended with exit status 0 before the function returned"),
        ("stops_with_status", "ended with exit status 3 before the function returned"),
        ("crashes", "was killed by SIGKILL before the function returned"),
    ],
)
def test_a_function_may_end_its_process_and_is_told_of(
    name: str, said: str, tmp_path: Path
) -> None:
    module = f"functions_{name}"
    (tmp_path / f"{module}.py").write_text(MODULE)
    file = tmp_path / "study.yaml"
    file.write_text(
        f"title: a study\nsolver: {{python: '{module}:{name}'}}\n"
        "refine: {h: [0.2, 0.1, 0.05]}\nquantities: {u: {}}\n"
    )
    work = tmp_path / "work"
    work.mkdir()
    if not said:
        assert run.make(from_file(file), 0, 0, work)["u"].values == 1.0 + 0.2**2
        return
    with pytest.raises(VibsimError, match=said):
        run.make(from_file(file), 0, 0, work)
