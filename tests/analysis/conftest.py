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
