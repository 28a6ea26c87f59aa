"""Whatever the core decides of a ladder has words, numbers that JSON has, a table and a picture."""

from __future__ import annotations

import json

import numpy as np
import pytest

from vibsim import judge
from vibsim.convergence.assessment import Assessment
from vibsim.convergence.error_model.ladder import Ladder
from vibsim.convergence.study import outcomes
from vibsim.convergence.study.sentences import SENTENCES
from vibsim.core.vocabulary import REASON_NAMES, REASONS

H = [0.4, 0.2, 0.1, 0.05]


def decided(ladder: Ladder, reason: str, *, known: bool) -> Assessment:
    """An assessment with all of its numbers, or with none."""
    shape, n = ladder.numbers.shape, len(ladder.h)
    number = np.full(shape, 1.5 if known else np.nan)
    weights = np.full((*shape, n), 0.0 if known else np.nan)
    weights[..., -1] += 1.0
    return Assessment(
        reason=np.full(shape, REASON_NAMES.index(reason), dtype=np.int8),
        order=number,
        low=0.5 * number,
        high=2.0 * number,
        first=np.full(shape, 1 if known else -1),
        last=np.full(shape, n - 1 if known else -1),
        error=1e-3 * number,
        error_bound=2e-3 * number,
        weights=weights,
        best_bound=1e-3 * number,
        contradicted=np.full(shape, known),
        logarithm=number,
    )


@pytest.mark.parametrize("known", [True, False], ids=["numbers", "none"])
@pytest.mark.parametrize("reason", [name for name in REASON_NAMES if name in SENTENCES])
def test_every_assessment_has_a_verdict(
    reason: str, known: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        outcomes, "assess", lambda ladder, asked: decided(ladder, reason, known=known)
    )
    falling = [1.0, 1.5, 1.75, 1.875]
    swinging = [1.0, 2.0, 1.5, 1.75]
    constant = [2.0, 2.0, 2.0, 2.0]
    series = [np.array([x, 2 * x, 3 * x]) for x in falling]
    asked = ({}, {"order": 2.0}, {"at_least": 1.0}, {"exact": 2.5}, {"noise": 1e-3})
    kinds = (falling, swinging, constant, series)
    # every kind of values and every question, in other pairs for every reason
    first = 2 * REASON_NAMES.index(reason) + known
    for i, more in enumerate(asked):
        values = kinds[(first + i) % 4]
        verdict = judge(H, values, **more)
        # levels that differ by less than the stated noise show noise
        is_hidden = reason == "pre_asymptotic" and values is constant and "noise" in more
        stated = "round_off" if is_hidden else reason
        assert (verdict.status, verdict.reason) == (REASONS[stated], stated)
        assert verdict.sentence.endswith(".")
        assert bool(verdict.advice) == (verdict.status != "PASS")
        json.dumps(verdict.to_dict(), allow_nan=False)
        assert str(verdict)
        if known:
            assert verdict.order == 1.5
            assert verdict.h_used == (0.2, 0.1, 0.05)
            assert verdict.error_bound is not None
        elif values is falling and reason != "exact":
            assert verdict.order == pytest.approx(1.0), "three levels give an estimate"
            assert verdict.best == pytest.approx(2.0)
            assert verdict.h_used == (0.2, 0.1, 0.05)
        elif values is constant:
            assert verdict.order is None
            assert verdict.h_used == ()
        verdict.to_xarray()
        if i == 0:  # pictures take most of the time
            assert verdict.plot().axes
