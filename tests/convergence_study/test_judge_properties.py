"""What a verdict does not depend on: units, signs, the order of levels, dimensions of no length."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from vibsim import LadderVerdict, judge
from vibsim.convergence.differences import orders_of_steps, target_ratio
from vibsim.core.array_types import Floats

FACTORS = st.floats(1.3, 3.0)
POWERS = st.floats(0.5, 5.0)
SIGNS = st.sampled_from([1.0, -1.0])


def sizes(factors: list[float]) -> list[float]:
    return np.cumprod([1.0, *(1.0 / f for f in factors)]).tolist()


def facts(verdict: LadderVerdict) -> tuple[object, ...]:
    return verdict.status, verdict.reason, verdict.order, verdict.order_low, verdict.order_high


MEMBERS = 6
LADDERS = st.tuples(
    st.lists(FACTORS, min_size=2, max_size=5),
    POWERS,
    st.lists(st.floats(-2.0, 2.0), min_size=MEMBERS, max_size=MEMBERS),
)
"""Factors between steps, a power, and what each of some members has of the next power."""
Ladders = tuple[list[float], float, list[float]]


def levels_of(ladders: Ladders) -> tuple[list[float], float, list[Floats]]:
    """Return the steps, the order, and the values of all members at each step."""
    factors, p, second = ladders
    h = sizes(factors)
    return h, p, [5.0 + x**p + np.array(second) * x ** (p + 1) for x in h]


@pytest.mark.slow
@settings(max_examples=5, deadline=None)
@given(LADDERS, st.randoms(use_true_random=False))
def test_the_order_of_levels_does_not_matter(ladders: Ladders, random: object) -> None:
    h, p, values = levels_of(ladders)
    places = list(range(len(h)))
    random.shuffle(places)  # type: ignore[attr-defined]
    mixed = judge([h[i] for i in places], [values[i] for i in places], order=p, members=True)
    assert mixed == judge(h, values, order=p, members=True)


@pytest.mark.slow
@settings(max_examples=5, deadline=None)
@given(LADDERS, st.integers(-60, 60), SIGNS)
def test_units_and_signs_do_not_matter(ladders: Ladders, power: int, sign: float) -> None:
    h, p, values = levels_of(ladders)
    verdicts = judge(h, values, order=p, members=True)
    scale = sign * 2.0**power
    of_scaled = judge(h, [scale * x for x in values], order=p, members=True)
    in_other_units = judge([4.0 * x for x in h], values, order=p, members=True)
    for verdict, scaled, other_units in zip(verdicts, of_scaled, in_other_units, strict=True):
        assert facts(scaled) == facts(verdict)
        for name in ("error", "best"):
            one, other = getattr(verdict, name), getattr(scaled, name)
            assert (one is None) == (other is None)
            if one is not None:
                assert other == scale * one
        assert scaled.gci == verdict.gci
        assert other_units.reason == verdict.reason


@pytest.mark.slow
@settings(max_examples=5, deadline=None)
@given(LADDERS)
def test_a_number_is_a_field_of_one_point_and_a_member_is_judged_as_alone(ladders: Ladders) -> None:
    h, p, values = levels_of(ladders)
    verdict = judge(h, [float(x[-1]) for x in values], order=p)
    assert facts(judge(h, [x[-1:, None] for x in values], order=p)) == facts(verdict)
    assert judge(h, values, order=p, members=True)[-1] == verdict


@settings(max_examples=100, deadline=None)
@given(st.floats(-20.0, 20.0), FACTORS, FACTORS)
def test_the_order_of_three_levels_solves_their_equation(
    order: float, first: float, second: float
) -> None:
    h = np.array(sizes([first, second]))
    ratio = target_ratio(np.array(order), (-np.log2(h)).tolist())
    assert orders_of_steps(ratio[None], h)[0] == pytest.approx(order, abs=1e-9)


@pytest.mark.slow
@settings(max_examples=5, deadline=None)
@given(st.integers(1, 6).flatmap(lambda n: arrays(np.float64, (n, MEMBERS), elements=st.floats())))
def test_no_numbers_break_it(values: Floats) -> None:
    h = [0.5**k for k in range(len(values))]
    for more in ({}, {"order": 2.0}, {"at_least": 1.0, "noise": 1e-3}, {"exact": 1.0}):
        verdicts = judge(h, list(values), members=True, **more)
        for verdict, own in zip(verdicts, values.T, strict=True):
            assert verdict.status in ("PASS", "FAIL", "INCONCLUSIVE")
            if not np.all(np.isfinite(own)):
                assert verdict.reason == "non_finite"
            assert str(verdict)
            for value in verdict.to_dict().values():
                assert not isinstance(value, float) or np.isfinite(value)
    assert judge(h, values[:, 0].tolist(), exact=1.0) == verdicts[0]
