"""Products of cases, of which `make test` takes some and the slow tests the rest."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import pytest


def thinned(cases: Iterable[Any], every: int) -> list[Any]:
    """Mark all cases as slow but one in `every`.

    A product whose last factor has n choices, n and `every` without a common divisor, so keeps every choice of each
    factor: the pairs change, as on a diagonal.
    """
    found, count = [], 0
    for case in cases:
        one = case
        if not hasattr(case, "marks"):
            one = pytest.param(*(case if isinstance(case, tuple) else (case,)))
        if not one.marks:
            if count % every:
                one = pytest.param(*one.values, id=one.id, marks=pytest.mark.slow)
            count += 1
        found.append(one)
    return found
