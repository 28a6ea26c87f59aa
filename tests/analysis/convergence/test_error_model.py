"""The error model on ladders of which the truth is known: every verdict, any step sizes, and how often it is right."""

from __future__ import annotations

import datetime
import math
from dataclasses import dataclass, fields, replace
from itertools import pairwise, product
from pathlib import Path

import numpy as np
import pytest
from counts import HEAD, tally
from synthetic import COUNTS, EPSILON, TOLERANCE, Group, groups
from thinned import thinned

from vibsim.convergence import assessment, likely_powers
from vibsim.convergence.assessment import Assessment, Decision, assess, decide
from vibsim.convergence.error_model import kernel, likelihood, priors
from vibsim.convergence.error_model.hypotheses import ExpectedOrder, hypotheses_of
from vibsim.convergence.error_model.ladder import Ladder
from vibsim.convergence.error_model.matrices import (
    form,
    inverse,
    level_differences,
    noise_of_rows,
    outer,
    packed,
)
from vibsim.convergence.error_model.posterior import MOST_HYPOTHESES, MOST_TABLES, posterior
from vibsim.convergence.question import Question
from vibsim.core.array_types import Floats
from vibsim.core.vocabulary import REASON_NAMES, REASONS

HALVED = 0.1 * 0.5 ** np.arange(4)
UNEVEN = np.array([0.1, 0.07, 0.04, 0.03, 0.01])
T = np.linspace(0.0, 1.0, 41)
SHAPE, OTHER_SHAPE = np.sin(5.0 * T), T * np.cos(3.0 * T)
HELD_OUT = 2
"""A seed of which no number of the model was set."""


def ladder(
    h: Floats,
    values: list[float] | list[Floats],
    *,
    exact: float | Floats | None = None,
    noise: float | Floats | None = None,
) -> Ladder:
    """Return the ladder of one quantity, with the rounding of double precision as its noise."""
    u = [np.atleast_1d(np.asarray(value, dtype=float)) for value in values]
    rows = [a - b for a, b in pairwise(u)]
    if exact is not None:
        rows.append(u[-1] - exact)
    x = np.array(rows)
    size = math.sqrt(np.mean(u[-1] ** 2))
    floor = np.full((1, len(u)), EPSILON * size if noise is None else noise)
    gram = (x @ x.T / x.shape[1])[None]
    return Ladder(h, gram, floor, np.array([x.shape[1] == 1]), exact is not None)


def numbers(h: Floats, *terms: tuple[float, float]) -> list[float]:
    """Return ``1 + sum of c h^p`` for every step."""
    return [1.0 + sum(c * x**p for c, p in terms) for x in h]


def series(h: Floats, *terms: tuple[float, float, Floats]) -> list[Floats]:
    return [np.cos(T) + sum(c * x**p * shape for c, p, shape in terms) for x in h]


def found(a: Assessment) -> tuple[str, str]:
    reason = REASON_NAMES[a.reason[0]]
    return REASONS[reason], reason


PASSES, FAILS, OPEN = "PASS", "FAIL", "INCONCLUSIVE"
RNG = np.random.default_rng(5)
TABLE = {
    "a value that is not finite": (ladder(HALVED, [1.0, math.nan, 1.0, 1.0]), 2.0, (FAILS, "non_finite")),
    "two levels": (ladder(HALVED[:2], [1.1, 1.05]), 2.0, (OPEN, "too_few_levels")),
    "nothing but rounding": (ladder(HALVED, [1.0, 1.0 + 2e-16, 1.0, 1.0]), 2.0, (PASSES, "exact")),
    "nothing but the given noise": (
        ladder(HALVED, [1.001, 1.002, 0.999, 1.0], noise=2e-3), 2.0, (PASSES, "exact"),
    ),
    "the same number, but not the exact one": (
        ladder(HALVED, [1.0, 1.0, 1.0, 1.0], exact=0.9), 2.0, (FAILS, "wrong_limit"),
    ),
    "another limit": (
        ladder(HALVED, series(HALVED, (1.0, 2.0, SHAPE)), exact=np.cos(T) + 0.1), 2.0, (FAILS, "wrong_limit"),
    ),
    "the order, of numbers": (ladder(HALVED, numbers(HALVED, (1.0, 2.0))), 2.0, (PASSES, "asymptotic")),
    "the order, of series": (
        ladder(HALVED, series(HALVED, (1.0, 2.0, SHAPE), (0.5, 3.0, OTHER_SHAPE))), 2.0, (PASSES, "asymptotic"),
    ),
    "the order and the limit": (
        ladder(HALVED, series(HALVED, (1.0, 2.0, SHAPE)), exact=np.cos(T)), 2.0, (PASSES, "asymptotic"),
    ),
    "a lower order": (ladder(HALVED, series(HALVED, (1.0, 1.0, SHAPE))), 2.0, (FAILS, "order_low")),
    "a higher order": (ladder(HALVED, series(HALVED, (1.0, 4.0, SHAPE))), 2.0, (FAILS, "order_high")),
    "two powers of one size": (
        ladder(HALVED, series(HALVED, (1.0, 2.0, SHAPE), (0.03, 1.0, OTHER_SHAPE))), 2.0, (OPEN, "pre_asymptotic"),
    ),
    "errors that change their sign": (
        ladder(HALVED, series(HALVED * np.array([1, -1, 1, -1.0]), (1.0, 1.0, SHAPE))), 2.0, (OPEN, "oscillating"),
    ),
    "noise": (
        ladder(HALVED, [np.cos(T) + 1e-13 * RNG.normal(size=T.size) for _ in HALVED]), 2.0, (OPEN, "round_off"),
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", TABLE)
def test_every_row_of_the_table_of_decisions(case: str) -> None:
    given, order, expected = TABLE[case]
    assert found(assess(given, Question(order))) == expected


@pytest.mark.parametrize("h", [HALVED, UNEVEN], ids=["halved", "uneven"])
@pytest.mark.parametrize("p", [0.5, 1.0, 4 / 3, 1.786, 2.0, 3.0, 4.0, 6.0])
def test_any_power_on_any_step_sizes(p: float, h: Floats) -> None:
    values = numbers(h, (0.3, p))
    a = assess(ladder(h, values, noise=1e-15), Question(p))
    assert found(a) == (PASSES, "asymptotic")
    assert a.order[0] == pytest.approx(p, abs=1e-4)
    assert a.low[0] <= p + 1e-4
    assert a.high[0] >= p - 1e-4
    best = a.weights[0] @ np.array(values)
    assert abs(best - 1.0) <= a.best_bound[0]
    assert a.error[0] == pytest.approx(0.3 * h[-1] ** p, rel=0.01)
    assert 0.3 * h[-1] ** p <= a.error_bound[0]


def test_three_levels_have_the_order_and_the_extrapolation_of_their_equation() -> None:
    """The grid study of the NASA tutorial: order 1.786170, extrapolated pressure recovery 0.971300."""
    h = np.array([4.0, 2.0, 1.0])
    values = [0.96178, 0.96854, 0.97050]
    a = assess(ladder(h, values), Question())
    assert a.order[0] == pytest.approx(1.786170, abs=1e-6)
    assert a.weights[0] @ np.array(values) == pytest.approx(0.971300, abs=1e-6)
    assert found(a) == (OPEN, "pre_asymptotic")


def test_without_an_expectation_any_order_will_do() -> None:
    given = ladder(HALVED, series(HALVED, (1.0, 3.0, SHAPE)))
    assert found(assess(given, Question())) == (PASSES, "asymptotic")
    assert found(assess(given, Question(at_least=2.0))) == (PASSES, "asymptotic")
    assert found(assess(given, Question(at_least=4.0))) == (FAILS, "order_low")


def test_a_scheme_is_given_the_benefit_of_its_promise() -> None:
    """Three numbers with the order 2.007 are enough for a promised order of 2, but not without a promise."""
    h = np.array([4.0, 2.0, 1.0])
    given = ladder(h, [1.0 + 0.01 * (1.0 + 4.02), 1.0 + 0.01, 1.0])
    assert found(assess(given, Question(2.0))) == (PASSES, "asymptotic")
    assert found(assess(given, Question())) == (OPEN, "pre_asymptotic")


LOWER_PARTS = {
    "numbers": None,
    "own shape": np.sqrt(T) * np.cos(9.0 * T),
    "same shape": SHAPE,
    "opposite shape": -SHAPE,
}


def of_all(ladders: list[Ladder], question: Question) -> list[tuple[str, str]]:
    """Return what is found of ladders of the same steps, which costs little more than that of one."""
    rows = {name: np.concatenate([getattr(one, name) for one in ladders]) for name in ROWS}
    a = assess(replace(ladders[0], **rows), question)
    return [(REASONS[reason], reason) for reason in (REASON_NAMES[j] for j in a.reason)]


ROWS = ("gram", "floor", "numbers")


@pytest.mark.parametrize("levels", thinned([4, 5, 6], 3))
@pytest.mark.parametrize(
    ("lower", "order", "shares"),
    [
        (1.0, 2.0, (0.01, 0.03, 0.08, 0.12, 0.2, 0.3, 0.5, 1.0)),
        (2.0, 4.0, (0.08, 0.12, 1.0)),
    ],
)
def test_a_part_of_lower_order_counts_from_a_tenth_on(
    lower: float, order: float, shares: tuple[float, ...], levels: int
) -> None:
    """A first-order start leaves such a part, say; a share is its size at the finest level."""
    h = 0.4 * 0.5 ** np.arange(levels)
    cases, given = list(product(LOWER_PARTS, shares)), []
    for kind, share in cases:
        size = share * h[-1] ** (order - lower)
        if kind == "numbers":
            given.append(ladder(h, numbers(h, (1.0, order), (size, lower))))
        else:
            shape = LOWER_PARTS[kind] * np.linalg.norm(SHAPE) / np.linalg.norm(LOWER_PARTS[kind])
            given.append(ladder(h, series(h, (0.5, order, SHAPE), (0.5 * size, lower, shape))))
    for (kind, share), verdict in zip(cases, of_all(given, Question(order)), strict=True):
        expected = (PASSES, "asymptotic") if share < 0.1 else (OPEN, "pre_asymptotic")
        assert verdict == expected, (kind, share)


@pytest.mark.parametrize(
    ("known", "h"),
    thinned([(True, 0.25 ** np.arange(8)), *((k, 0.5 ** np.arange(14)) for k in (True, False))], 3),
)
@pytest.mark.parametrize(
    ("expected", "verdict"), [(4.0, (PASSES, "asymptotic")), (2.0, (FAILS, "order_high"))]
)
def test_a_power_that_shows_below_the_predicted_noise_counts(
    expected: float, verdict: tuple[str, str], known: bool, h: Floats
) -> None:
    """Noise that is predicted to grow like N^1.5 hides the finer levels, but they fall on, by another power."""
    exact, noise = 0.0 * SHAPE if known else None, 1e-13 * h**-1.5
    given = [
        ladder(h, [x**4 * SHAPE + share * x**2 * OTHER_SHAPE for x in h], exact=exact, noise=noise)
        for share in (0.0, 1e-6)
    ]
    assert of_all(given, Question(expected)) == [verdict, (OPEN, "pre_asymptotic")]


def falling(*powers: float) -> list[Floats]:
    """Return levels of one shape whose differences have these orders."""
    sizes = [2.0 ** sum(powers[k:]) for k in range(len(powers) + 1)]
    return [sum(sizes[k:]) * SHAPE for k in range(len(sizes) + 1)]


@pytest.mark.parametrize(
    ("values", "exact", "expected", "verdict"),
    [
        (falling(3.501, 3.501), None, 2.0, (FAILS, "order_high")),
        (falling(4.5, 3.501), None, 2.0, (OPEN, "pre_asymptotic")),
        (falling(3.501, 3.501), -SHAPE, 2.0, (FAILS, "wrong_limit")),
        (falling(6.0, 3.501), -SHAPE, 2.0, (OPEN, "pre_asymptotic")),
    ],
    ids=["four levels", "three of four", "limit of four levels", "limit of three of four"],
)
def test_three_levels_behind_others_that_do_not_fit_may_fall_like_a_power_by_accident(
    values: list[Floats], exact: Floats | None, expected: float, verdict: tuple[str, str]
) -> None:
    given = ladder(HALVED[: len(values)], values, exact=exact)
    assert found(assess(given, Question(expected))) == verdict


def test_three_such_levels_pass_where_an_exact_solution_confirms_them() -> None:
    values = [0.694, 0.749, 0.9362, 0.9848]
    assert found(assess(ladder(HALVED, values, exact=1.0), Question(2.0))) == (PASSES, "asymptotic")
    assert found(assess(ladder(HALVED, values), Question(2.0))) == (OPEN, "pre_asymptotic")


@pytest.mark.parametrize(("step", "reason"), [(1.6, "exact"), (1.8, "round_off")])
def test_stated_noise_limits_the_distance_of_the_two_levels_furthest_apart(
    step: float, reason: str
) -> None:
    """Two levels have the noise 2, of which 2 times 1.25 is allowed for: 4.8 is within it, and 5.4 is not."""
    given = ladder(HALVED, [3 * step, 2 * step, step, 0.0], noise=1.0)
    assert found(assess(given, Question(2.0, is_noise_stated=True)))[1] == reason


def test_an_order_that_two_powers_only_explain_passes_when_it_is_measured() -> None:
    h = 0.1 * 0.5 ** np.arange(6)
    values = numbers(h, (1.0, 2.5), (0.0345 / h[4] ** 2, 4.5))
    coarse = assess(ladder(h[:5], values[:5]), Question(2.5))
    assert coarse.order == pytest.approx(3.0, abs=0.001)
    assert found(coarse) == ("INCONCLUSIVE", "pre_asymptotic")
    assert found(assess(ladder(h[:5], values[:5]), Question(at_least=2.5)))[0] == "PASS"
    assert found(assess(ladder(h, values), Question(2.5))) == ("PASS", "asymptotic")


@pytest.mark.parametrize(
    ("question", "met"),
    [
        (Question(2.0, by_theory=True), [1.6, 1.8, 2.4]),
        (Question(2.0), [1.8]),
        (Question(at_least=2.0), [1.8, 2.4, 2.6]),
        (Question(), [1.8]),
    ],
)
def test_orders_of_a_theory_are_one_apart(question: Question, met: list[float]) -> None:
    orders = np.array([1.4, 1.6, 1.8, 2.4, 2.6, np.nan])
    assert orders[question.is_met_by(orders, np.full(6, 2.0))].tolist() == met


def test_levels_without_a_measured_order_do_not_pass() -> None:
    """A high power, with errors off by factors, explained errors that alternate and fall fast."""
    h = 1.5 ** -np.arange(7.0)
    values = [np.cos(T) + 0.01 * (-1 / 30.0) ** k * SHAPE for k in range(7)]
    a = assess(ladder(h, values), Question(at_least=1.5))
    assert np.isnan(a.order[0])
    assert found(a) == ("INCONCLUSIVE", "pre_asymptotic")


@pytest.mark.parametrize("factor", [1e-30, 1e30])
def test_units_do_not_matter(factor: float) -> None:
    usual = series(UNEVEN, (1.0, 2.0, SHAPE), (0.5, 3.0, OTHER_SHAPE))
    one, other = (
        assess(ladder(h, [f * u for u in usual]), Question(2.0))
        for h, f in ((UNEVEN, 1.0), (1e3 * UNEVEN, factor))
    )
    assert found(one) == found(other)
    np.testing.assert_allclose(other.error, factor * one.error, rtol=1e-6)
    np.testing.assert_allclose(other.weights, one.weights, rtol=1e-6)


@pytest.mark.parametrize("kind", ["two_shapes", "factors", "factors_with_shape"])
def test_rounding_of_steep_differences_is_no_evidence(kind: str) -> None:
    """Behind levels that have blown up, what rows have across the last one may be rounded to less than nothing."""
    rows = np.array([1e7, 1e3, 1.0])
    gram = np.outer(rows, rows)[None]
    rounded = gram * (1.0 - np.diag([1e-16, 0.0, 0.0]))
    none = np.empty((1, 0))
    found = getattr(hypotheses_of((8.0, 4.0, 2.0, 1.0), ExpectedOrder(6.0)), kind)
    for table in found if isinstance(found, list) else [found]:
        apart = table.orthogonal_forms is not None
        one, other = (
            likelihood.weigh_table(
                table,
                likelihood.window_rows(g, np.array([2.0]), split=apart),
                none,
                np.array([-np.inf]),
            )[0]
            for g in (gram, rounded)
        )
        assert other == pytest.approx(one, abs=1e-6)


def test_levels_with_another_limit_have_their_own_order() -> None:
    a = assess(ladder(HALVED, numbers(HALVED, (1.0, 2.0)), exact=1.001), Question(2.0))
    assert found(a) == (FAILS, "wrong_limit")
    assert a.low[0] == pytest.approx(2.0, abs=0.05)
    assert a.high[0] == pytest.approx(2.0, abs=0.05)


@pytest.mark.slow
def test_the_bound_of_noise_is_as_large_as_the_noise() -> None:
    for seed in range(20):
        rng = np.random.default_rng(seed)
        h = 0.1 * 0.5 ** np.arange(6)
        values = [np.cos(T) + 1e-3 * rng.normal(size=T.size) for _ in h]
        a = assess(ladder(h, values), Question(2.0))
        true = rms(values[-1] - np.cos(T))
        assert true / 3.0 < a.error_bound[0] < 100.0 * true, seed


@pytest.mark.slow
def test_many_levels_can_be_judged() -> None:
    """More than a table of logarithms would hold."""
    h = 0.1 * 0.9 ** np.arange(101)
    given = ladder(h, series(h, (1.0, 2.0, SHAPE)))
    assert found(assess(given, Question(2.0))) == (PASSES, "asymptotic")


def test_a_wrong_limit_is_told_whatever_order_is_expected() -> None:
    values = series(HALVED, (1.0, 1.0, SHAPE))
    for order in (1.0, 2.0):
        given = ladder(HALVED, values, exact=np.cos(T) + 0.3)
        assert found(assess(given, Question(order))) == (FAILS, "wrong_limit")


def test_probabilities_add_up_to_one() -> None:
    for exact, promise in product(
        (None, np.cos(T)), (None, ExpectedOrder(2.0), ExpectedOrder(2.0, True))
    ):
        p = posterior(ladder(HALVED, series(HALVED, (1.0, 2.0, SHAPE)), exact=exact), promise)
        whole = p.expansion + p.alternating + p.scattered + p.noise
        assert whole == pytest.approx(1.0, abs=1e-9)
        assert np.all(p.mixed >= -1e-9)


@pytest.mark.parametrize("known", [True, False], ids=["exact", "unknown"])
def test_a_ladder_is_judged_the_same_alone_and_among_others(known: bool) -> None:
    """Bit by bit, so that sweeps may be divided at will."""
    group = next(g for g in groups(7, size=20) if len(g.levels) == 5 and g.known == known)
    given, _ = of_group(group)

    def in_full(ladder: Ladder) -> Assessment:
        return assess(ladder, Question(2.0))

    def quickly(ladder: Ladder) -> Decision:
        return decide(ladder, Question(2.0))

    for judge in (in_full, quickly):
        among = vars(judge(given))
        for i in range(3):
            one = slice(i, i + 1)
            alone = Ladder(given.h, given.gram[one], given.floor[one], given.numbers[one], known)
            for name, values in vars(judge(alone)).items():
                np.testing.assert_array_equal(values[0], among[name][i], err_msg=name)


def test_orders_of_other_ladders_do_not_count() -> None:
    """How much is near a power is looked up at the same powers, whatever orders the other ladders have."""
    h = 0.1 * 0.5 ** np.arange(5)
    rows = np.array(
        [np.cumprod([1.0, *(0.5**p for p in ps)]) for ps in ((1.88, 1.83, 2.14), (1.95, 2.0, 2.05))]
    )
    gram = rows[:, :, None] * rows[:, None]
    found = []
    for count in (1, 2):
        floor, is_number = np.full((count, 5), 1e-15), np.full(count, fill_value=False)
        given = Ladder(h, gram[:count], floor, is_number, exact_known=False)
        found.append(likely_powers.most_near_a_power(posterior(given, ExpectedOrder(4.0)))[0])
    assert found[0] == found[1]


def test_the_compiled_loop_has_the_bits_of_its_text(monkeypatch: pytest.MonkeyPatch) -> None:
    for given in (
        ladder(HALVED, numbers(HALVED, (1.0, 2.0), (0.1, 3.0))),
        ladder(HALVED, series(HALVED, (1.0, 2.0, SHAPE), (0.5, 3.0, OTHER_SHAPE))),
    ):
        compiled = assess(given, Question(2.0))
        with monkeypatch.context() as plain:
            plain.setattr(likelihood, "compiled_kernel", lambda: kernel.kernel)
            by_text = assess(given, Question(2.0))
        for name, values in vars(by_text).items():
            np.testing.assert_array_equal(vars(compiled)[name], values, err_msg=name)


# ---- What is left out


def test_a_window_has_no_more_tables_and_hypotheses_than_what_is_left_out_is_shared_among() -> None:
    kinds = hypotheses_of((4.0, 2.0, 1.0), ExpectedOrder(4 / 3))._asdict()
    del kinds["any_power_log_bound"]
    tables = [t for kind in kinds.values() for t in (kind if isinstance(kind, list) else [kind])]
    # and any power
    assert len(tables) + 1 <= MOST_TABLES
    assert sum(len(table.pair) for table in tables) + len(priors.OFFSETS) <= MOST_HYPOTHESES


@pytest.mark.parametrize("left_out", [1e-3, 1e-11])
@pytest.mark.parametrize("known", [True, False], ids=["exact", "unknown"])
def test_no_more_is_left_out_than_may_be(known: bool, left_out: float) -> None:
    """Bounds that were too small would leave out what counts; ladders of every kind, with hardly anything left out."""
    for group in groups(HELD_OUT, 10, 10):
        if not 3 <= len(group.levels) <= 6 or group.known != known:
            continue
        given, _ = of_group(group)
        whole, part = (posterior(given, ExpectedOrder(2.0), left_out=x) for x in (1e-250, left_out))
        for name in (
            "dominant",
            "lowest",
            "highest",
            "window",
            "noise",
            "scattered",
            "alternating",
        ):
            off = np.abs(getattr(part, name) - getattr(whole, name))
            assert np.max(off) <= left_out, name


@pytest.mark.slow
@pytest.mark.parametrize("expected", [None, 2.0])
def test_a_decision_is_that_of_the_whole_posterior(expected: float | None) -> None:
    for group in groups(HELD_OUT, 9, 12):
        given, _ = of_group(group)
        quick, whole = decide(given, Question(expected)), assess(given, Question(expected))
        for field in fields(Decision):
            np.testing.assert_array_equal(
                getattr(quick, field.name), getattr(whole, field.name), err_msg=field.name
            )


def test_a_quick_decision_asks_as_much_of_three_levels_as_a_whole_one() -> None:
    """Orders of three levels that are more and more away from the one that theory promises."""
    levels = [falling(4.5, 2.0 + away) for away in np.linspace(0.0, 0.004, 200)]
    rows = np.stack([np.diff(np.array(values), axis=0) for values in levels])
    gram = rows @ np.swapaxes(rows, 1, 2) / rows.shape[2]
    floor, numbers = np.full((len(gram), 4), EPSILON), np.zeros(len(gram), dtype=bool)
    given = Ladder(HALVED[:4], gram, floor, numbers, exact_known=False)
    quick = decide(given, Question(2.0, by_theory=True))
    whole = assess(given, Question(2.0, by_theory=True))
    assert len(np.unique(whole.reason)) == 2
    np.testing.assert_array_equal(quick.reason, whole.reason)


def test_a_clear_decision_needs_no_second_posterior(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(assessment, "_assess_block")
    for exact in (None, np.cos(T)):
        values = series(HALVED, (1.0, 2.0, SHAPE), (0.5, 4.0, OTHER_SHAPE))
        for order, expected in ((2.0, "asymptotic"), (4.0, "order_low")):
            given = ladder(HALVED, values, exact=exact)
            assert REASON_NAMES[decide(given, Question(order)).reason[0]] == expected


@pytest.mark.parametrize("known", [True, False], ids=["exact", "unknown"])
def test_the_inverse_of_one_power_is_that_of_its_covariance(
    known: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    # the inverse of a usual covariance would lose too many digits
    monkeypatch.setattr(priors, "MISFIT", 0.1)
    sizes = np.array([5.0, 3.0, 1.0, 0.0] if known else [7.0, 5.0, 3.0, 1.0])
    powers, points = np.array([[0.5, 1.9, 4.0]]), np.array([[2.0]])
    rows = np.random.default_rng(1).normal(size=(3, 9)) * np.array([[9.0], [3.0], [1.0]])
    gram = (rows @ rows.T)[None]
    errors = sizes ** powers[..., None]
    c = level_differences(errors)
    precision, log_det = inverse(outer(c, c) + noise_of_rows((priors.MISFIT * errors) ** 2))
    trace = np.sum(form(precision) * packed(gram)[:, None], axis=-1)
    log, gains, square = likelihood.single_power(sizes, powers, gram, points)
    expected = likelihood.scale_free(trace, log_det, points, 3)
    np.testing.assert_allclose(log, expected, rtol=1e-9)
    if not known:
        path = np.einsum("lpij,lpj->lpi", precision, c)
        left = 1.0 - np.sum(path * c, axis=-1)
        np.testing.assert_allclose(gains, path, rtol=1e-9)
        of_path = np.einsum("lpi,lij,lpj->lp", path, gram, path)
        np.testing.assert_allclose(square, of_path + trace / 3 * left, rtol=1e-9)


# ---- How often it is right


@dataclass(frozen=True)
class Counts:
    """Verdicts on ladders that were judged by their true order and by others."""

    judged: int
    right: int
    false_pass: int
    mixed_pass: int
    false_fail: int
    left_open: int
    decidable: int
    intervals: float
    errors: float
    best: float
    """Parts of the ladders that pass whose order, error and limit are within what is stated."""


def of_group(group: Group) -> tuple[Ladder, Floats]:
    """Return the ladders of a group, and their true errors, shape (ladder, level, t)."""
    errors = np.array([one.errors for one in group.ladders])
    rows = np.diff(errors, axis=1)
    if group.known:
        rows = np.concatenate([rows, -errors[:, -1:]], axis=1)
    gram = rows @ np.swapaxes(rows, 1, 2) / rows.shape[2]
    points = np.count_nonzero(
        np.abs(rows[:, -1]) > 1e-3 * np.max(np.abs(rows[:, -1]), axis=-1, keepdims=True), axis=-1
    )
    floor = np.full(errors.shape[:2], EPSILON)
    return Ladder(2.0 ** -np.array(group.levels), gram, floor, points <= 2, group.known), errors


def rms(values: Floats) -> float:
    return math.sqrt(np.mean(values**2))


def counted(
    seed: int, number: int = 42, size: int = 12, orders: tuple[float, ...] = (1.0, 2.0, 3.0, 4.0)
) -> Counts:
    total = dict.fromkeys(
        ("judged", "right", "false_pass", "mixed_pass", "false_fail", "left_open", "decidable"), 0
    )
    within = []
    for group in groups(seed, number, size):
        if len(group.levels) < 3:
            continue
        given, errors = of_group(group)
        for p in orders:
            a = assess(given, Question(p))
            total["judged"] += len(group.ladders)
            for i, one in enumerate(group.ladders):
                reason, mine = REASON_NAMES[a.reason[i]], abs(one.order - p) <= TOLERANCE
                status = REASONS[reason]
                passed = status == PASSES and reason != "exact"
                total["right"] += passed and mine
                total["mixed_pass"] += passed and math.isnan(one.order)
                total["false_pass"] += passed and not mine and not math.isnan(one.order)
                total["false_fail"] += status == FAILS and mine
                total["decidable"] += mine and one.decidable
                total["left_open"] += mine and one.decidable and status == OPEN
                if passed and mine:
                    within.append(
                        (
                            a.low[i] - 1e-9 <= one.order <= a.high[i] + 1e-9,
                            rms(errors[i, -1]) <= a.error_bound[i],
                            rms(a.weights[i] @ errors[i]) <= a.best_bound[i],
                        )
                    )
    return Counts(
        **total, **dict(zip(("intervals", "errors", "best"), np.mean(within, axis=0), strict=True))
    )


def check(c: Counts, days: int = 1) -> None:
    """Compare with what may go wrong: a false verdict in a thousand, a decidable ladder in ten left open.

    The margin is that of as many ladders as so many days have.
    """
    assert c.right > 0.12 * c.judged
    assert c.false_pass <= 0.002 * c.judged, c
    assert c.false_fail <= 0.002 * c.judged, c
    assert c.mixed_pass <= 0.004 * c.judged, c
    assert c.left_open <= 0.12 * c.decidable, c
    margin = 2.0 * math.sqrt(0.05 * 0.95 / (days * c.right))
    assert min(c.intervals, c.errors, c.best) >= 0.95 - margin, c


@pytest.mark.slow
def test_pipeline_and_error_model_are_counted_on_the_same_ladders(tmp_path: Path) -> None:
    pipeline, model = tally(HELD_OUT, tmp_path, number=5, size=6)
    assert pipeline.decidable == model.decidable > 0
    assert pipeline.judged == model.judged > 100
    assert pipeline.right > 0 < model.right
    for one in (pipeline, model):
        # few levels have no false verdict
        assert (one.false_pass, one.false_fail) == (0, 0)
        assert len(one.row().split("|")) == HEAD.splitlines()[0].count("|") - 3


def test_verdicts_on_random_ladders_are_right() -> None:
    """Up to 8 levels, of which most ladders are; the slow test has more levels, groups and ladders."""
    c = counted(HELD_OUT, number=11)
    print(c)
    check(c)


@pytest.mark.slow
def test_verdicts_on_the_ladders_of_today_are_right() -> None:
    """Some of each number of levels, others every day."""
    seed = datetime.datetime.now(tz=datetime.UTC).toordinal()
    c = counted(seed, number=len(COUNTS), size=55)
    print(seed, c)
    check(c, days=3)
