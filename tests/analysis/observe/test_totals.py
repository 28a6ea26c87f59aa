"""Reductions over time and the response to disturbances: the same bits in any company, and right ones."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vibsim.convergence import differences
from vibsim.models import MODELS
from vibsim.observe import sensitivity as responses

Floats = np.ndarray


@given(st.integers(1, 200), st.integers(1, 5), st.integers(0, 2**32 - 1))
@settings(max_examples=60, deadline=None)
def test_a_total_depends_on_neither_company_nor_layout(points: int, cases: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    values = rng.normal(size=(2, cases, points)) * 10.0 ** rng.integers(-8, 8, (2, cases, points))
    together = differences.total(differences.laid_out(values))
    assert together.tobytes() == differences.total(values).tobytes()
    for case in range(cases):
        alone = differences.total(values[:1, case : case + 1])
        assert alone.tobytes() == together[:1, case : case + 1].tobytes()
    # pairwise: the error grows with the logarithm of the number of points
    bound = np.finfo(float).eps * (np.log2(points) + 2) * np.abs(values).sum(axis=-1)
    assert np.all(np.abs(together - values.sum(axis=-1)) <= bound)


@pytest.mark.parametrize("other", [1e200, 1e-200, np.nan, np.inf, 0.0])
def test_a_neighbour_out_of_range_changes_no_bit_of_a_norm(other: float) -> None:
    rng = np.random.default_rng(1)
    values = rng.normal(size=(50, 33)) * 10.0 ** rng.uniform(-100, 100, (50, 1))
    spacing = np.full(50, 0.3)
    alone = differences.norm(values, "l2", spacing)
    values = np.concatenate([values, np.full((1, 33), other)])
    together = differences.norm(values, "l2", np.full(51, 0.3))
    assert together[:50].tobytes() == alone.tobytes()


def motions(kind: str) -> tuple[Any, Floats, dict[str, Floats], dict[str, Floats]]:
    rng = np.random.default_rng(2)
    count = 200
    t = np.broadcast_to(np.linspace(0.0, 20.0, 33), (count, 33))
    initial = {
        "theta": rng.uniform(-3.1, 3.1, (count, 1)),
        "omega": rng.uniform(-2.5, 2.5, (count, 1)),
    }
    parameters = {n: rng.uniform(0.5, 2.0, (count, 1)) for n in ("g", "L", "m")}
    return MODELS[kind], t, initial, parameters


@pytest.mark.parametrize("kind", ["pendulum", "linear_pendulum"])
def test_the_response_by_formula_is_that_of_trying(kind: str) -> None:
    model, t, initial, parameters = motions(kind)
    found, doubtful = responses._linear(model, t, initial, parameters, None)
    tried = responses._by_trial(model, t, initial, parameters)
    assert not doubtful.any()
    # a disturbance of 1e-12 leaves three digits of a response, fewer where the motion itself is ill-conditioned
    ordinary = tried < 1e3
    assert ordinary.sum() > 100
    assert found[ordinary] == pytest.approx(tried[ordinary], rel=0.02)
    ratio = found / tried
    assert ratio.min() > 0.5
    assert ratio.max() < 2.0


def test_a_start_next_to_an_equilibrium_is_tried() -> None:
    model, t, initial, parameters = motions("pendulum")
    initial["theta"][:3], initial["omega"][:3] = [[0.0], [np.pi], [3.1415926]], 0.0
    _, doubtful = responses._linear(model, t, initial, parameters, None)
    assert doubtful[:3].all()
    assert not doubtful[3:].any()
