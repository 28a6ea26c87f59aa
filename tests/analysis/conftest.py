from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache

import pytest

from vibsim.convergence.error_model import hypotheses, posterior


@pytest.fixture(scope="session", autouse=True)
def all_hypotheses() -> Iterator[None]:
    """Keep the hypotheses on ladders of all tests: they ask for more orders than a job does, which keeps 48."""
    keeping = lru_cache(maxsize=200)(hypotheses.hypotheses_of.__wrapped__)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(posterior, "hypotheses_of", keeping)
        yield


@pytest.fixture
def with_series() -> None:
    """Keep series for a test that looks at them, in a file whose other tests are `without_series`."""


@pytest.fixture
def without_series(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Keep what a large sweep keeps, where verdicts alone are looked at: they take half of the work.

    Numbers and verdicts are the same as with series of the same points (`test_parts`); more points of few
    members are kept with them alone.
    """
    if "with_series" not in request.fixturenames:
        monkeypatch.setattr("vibsim.experiment.storage.LEAN", 0)
