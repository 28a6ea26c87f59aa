"""What every test process does first."""

from __future__ import annotations

import gc
import os
import sys
from functools import cache

import pytest

from vibsim.cli import arguments

# Without compiled modules beside the sources every worker rewrites the assertions of 200 files, and every job of a
# workflow compiles 300 modules: 20 s and 0.5 s. Copies of the package that tests change are in folders of their own.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False

# Each worker has a core. The threads of numpy's matrix products wait for the next product in a loop, which takes the
# core of the other worker: with them the tests of the error model cost four times as much.
os.environ["OPENBLAS_NUM_THREADS"] = "1"

# No test outlives the machine that it runs on, so that nothing need wait until a file is on its disk: some ms each.
os.fsync = lambda descriptor: None


def pytest_collection_finish() -> None:
    """Let the garbage collector look at what tests make, and at that less often: it took 5 % of all work."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(50_000, 20, 1000)


@pytest.fixture(scope="session", autouse=True)
def one_parser() -> None:
    """Make the parser of the command line once: it takes 8 ms, and no command changes it."""
    arguments.parser = cache(arguments.parser)


@pytest.fixture
def with_series() -> None:
    """Keep series for a test that looks at them, in a file whose other tests are `without_series`."""


@pytest.fixture
def without_series(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Keep what a large sweep keeps, where verdicts alone are looked at: they take half of the work.

    Numbers and verdicts are the same as with series of the same points (`analysis/test_parts`); more points of few
    members are kept with them alone.
    """
    if "with_series" not in request.fixturenames:
        monkeypatch.setattr("vibsim.experiment.storage.LEAN", 0)
