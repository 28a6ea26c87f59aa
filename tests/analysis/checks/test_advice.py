"""Advice: every verdict that is not a PASS ends with a sentence that names a key of the experiment file."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator
from functools import cache
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from level_records import experiment, level_records, standard_error
from whole import simulated

from vibsim import Experiment
from vibsim.analysis import analyse_records, verdicts
from vibsim.checks.accurate import BASES
from vibsim.checks.fields import name_of
from vibsim.checks.notation import PLAIN
from vibsim.checks.order_context import Corner
from vibsim.checks.order_text import _Phrases, in_words
from vibsim.comparison.order_verdict import CAUSES
from vibsim.core.record import Record, Variable
from vibsim.core.vocabulary import DRIFTS, REASON_NAMES, REASONS, STATUSES
from vibsim.experiment.schema.checks import MEASURED
from vibsim.report.words import interval
from vibsim.simulation import simulate_record

pytestmark = pytest.mark.usefixtures("without_series")

SCHEMA = Path(__file__).parents[3] / "workflow/schemas/experiment.schema.json"
GOOD = {name for name, status in REASONS.items() if status == "PASS"}
KINDS: dict[str, dict[str, Any]] = {
    "converges": {"converges": "theta"},
    "accurate": {"accurate": "theta", "absolute": 2.0},
    "value": {"value": "period", "equals": 1.0},
    "best": {"value": "period", "equals": 1.0, "at": {"level": "best"}},
    "stable": {"stable": True},
    "conserves": {"conserves": "energy", "drift": "linear"},
    "equal": {"equal": ["central", "exact"], "quantity": "theta"},
}
MAKES = {
    "converges": set(REASON_NAMES) - {"match", "mismatch"},
    "accurate": set(REASON_NAMES)
    - {"asymptotic", "exact", "order_low", "order_high", "wrong_limit"},
    "value": {"match", "mismatch", "non_finite", "not_applicable"},
    "best": {"mismatch", "non_finite", "not_applicable", "pre_asymptotic"},
    "stable": {"match", "mismatch", "non_finite", "unstable"},
    "conserves": {
        "match",
        "mismatch",
        "non_finite",
        "not_applicable",
        "pre_asymptotic",
        "round_off",
    },
    "equal": {"match", "mismatch", "non_finite", "not_applicable"},
}
"""What a kind of check can find."""


def keys(node: Any) -> Iterator[str]:
    """Yield every key that the schema knows."""
    if isinstance(node, dict):
        for name, inner in node.items():
            if name == "properties":
                yield from inner
            yield from keys(inner)
    elif isinstance(node, list):
        for inner in node:
            yield from keys(inner)


KEYS = set(keys(json.loads(SCHEMA.read_text())))
OPTIONS = {"end_velocity", "arithmetic", "start", "events", "kind"}
"""Options of schemes, which the schema has in other places."""


def assert_specific(text: str) -> None:
    """Check that a sentence names a key of an experiment file, and only such."""
    assert text, "no advice"
    assert text.endswith("."), text
    named = [part for part in text.split("`")[1::2] if ":" in part]
    words = {word for part in named for word in re.findall(r"([a-z_]+):", part)}
    assert words, text
    assert words <= KEYS | OPTIONS, (text, words - KEYS)
    assert "nan" not in re.findall(r"[a-z]+", text), text
    assert text.count("`") % 2 == 0


@cache
def analysed(check: str) -> tuple[Any, Record]:
    """Return the experiment with a check, which is given as JSON, and what the analysis makes of it."""
    exp = experiment(checks=[json.loads(check)])
    return exp, analyse_records(exp, level_records(exp, standard_error))


def changed(record: Record, **values: Any) -> Record:
    """Return the Record with other numbers of its check."""
    table = dict(record.variables)
    for name, value in values.items():
        row = table[name_of("check_1", name)]
        found = np.full_like(row.values, value)
        table[name_of("check_1", name)] = Variable(row.dims, found, row.attrs)
    return Record(record.coords, table, record.attrs)


def made(kind: str, reason: str, **more: Any) -> tuple[Any, Record]:
    """Return an experiment and the Record of an analysis that found a reason."""
    exp, record = analysed(json.dumps(KINDS[kind] | more))
    code = REASON_NAMES.index(reason)
    status = STATUSES.index(REASONS[reason])
    broken = {"non_finite"} if kind not in ("converges", "accurate") else set()
    if reason in broken:
        row = record.variable("status")
        table = {
            **record.variables,
            "status": Variable(row.dims, np.ones_like(row.values), row.attrs),
        }
        record = Record(record.coords, table, record.attrs)
    if kind in {"converges", "stable"}:
        return exp, changed(record, reason=code, status=status)
    if kind == "accurate":
        is_known = reason in ("match", "mismatch")
        error = 3.0 if reason == "mismatch" else 1.0
        of_order = REASON_NAMES.index("asymptotic") if is_known else code
        basis = BASES.index("none" if reason == "not_applicable" else "extrapolated")
        numbers = {"error": error, "error_bound": error + 0.1, "order_reason": of_order}
        return exp, changed(record, basis=basis, **numbers)
    by_reason: dict[str, dict[str, Any]] = {
        "match": {"value": 1.0, "distance": 1.0, "allowed": 2.0, "drift": DRIFTS.index("linear")},
        "mismatch": {
            **{"value": 3.0, "error_bound": 0.1, "distance": 3.0, "allowed": 2.0},
            "drift": DRIFTS.index("quadratic"),
        },
        "not_applicable": {
            **{"value": np.nan, "distance": np.nan, "energy_error": np.nan},
            "drift": DRIFTS.index("unclear"),
        },
        "pre_asymptotic": {
            **{"value": 3.0, "error_bound": 9.0, "energy_error": 3.0},
            "drift": DRIFTS.index("unclear"),
        },
        "round_off": {"energy_error": 1e-14, "drift": DRIFTS.index("none")},
        "non_finite": {},
    }
    known = {n: v for n, v in by_reason[reason].items() if name_of("check_1", n) in record}
    return exp, changed(record, **known)


@pytest.mark.parametrize(
    ("kind", "reason"),
    [(kind, reason) for kind, found in MAKES.items() for reason in sorted(found)],
)
def test_every_reason_of_every_kind_of_check_ends_with_advice(kind: str, reason: str) -> None:
    exp, record = made(kind, reason)
    claim = {"claim": "it is so", "that": KINDS[kind]}
    claims = (experiment(checks=[claim | {"holds": holds}]) for holds in (True, False))
    for one in (exp, *claims):
        (found,) = verdicts(one, record)
        assert found.results[0].reason == reason
        if found.status == "PASS":
            assert found.advice == ""
        else:
            assert_specific(found.advice)


def test_every_reason_occurs() -> None:
    assert set().union(*MAKES.values()) == set(REASON_NAMES)


@pytest.mark.parametrize("expect", [{"status": "FAIL"}, {"status": "FAIL", "reason": "unstable"}])
def test_an_expectation_that_is_not_met_ends_with_advice(expect: dict[str, str]) -> None:
    for reason in sorted(MAKES["converges"]):
        (found,) = verdicts(*made("converges", reason, expect=expect))
        assert bool(found.advice) == (found.status != "PASS")
        if found.advice:
            assert_specific(found.advice)


def story(**changes: Any) -> _Phrases:
    plain: dict[str, Any] = {
        "quantity": "theta",
        "reason": "order_low",
        "order": 1.02,
        "low": 0.9,
        "high": 1.1,
        "first": 4,
        "last": 7,
        "expected": 2.0,
        "tolerance": 0.1,
        "norm": "l2",
        "levels": (4, 5, 6, 7),
        "squares": {},
        "culprit": -1,
        "omega_dt": float("nan"),
        "growth_in_words": "",
        "limit": 2.0,
        "options": {"start": "centred", "end_velocity": "kick", "arithmetic": "compensated"},
        "is_position": True,
        "scheme": "mine",
        "kind": "central",
        "promised": 2.0,
        "pulse": (1.3, 1e-4),
        "shortest": 0.1,
        "decay": 1e3,
        "parts_at": math.nan,
        "special": math.nan,
        "on_oscillator": math.inf,
        "is_zero_stable": True,
        "centred": math.nan,
        "has_promise": True,
        "table_corner": math.nan,
        "has_exact": True,
        "corner": None,
        "parts": "",
        "error": "",
        "cause": "none",
        "more": -1,
        "readable": -1,
        "compensated": -1,
        "orders": (),
        "rescaled_distance": 0.01,
        "failures": (),
        "notation": PLAIN,
        "cost": lambda levels: f"{len(levels)} levels",
    }
    made = object.__new__(_Phrases)
    vars(made).update({**plain, **changes})
    return made


def tell(context: _Phrases) -> str:
    return in_words(context).sentence


def advise(context: _Phrases) -> str:
    return in_words(context).advice


@pytest.mark.parametrize("reason", sorted(set(REASON_NAMES) - GOOD - {"mismatch"}))
def test_every_cause_ends_with_advice(reason: str) -> None:
    orders = (1.02, 4.0, math.nan, 0.1)
    promises: tuple[dict[str, float], ...] = (
        {},
        {"expected": np.inf, "promised": np.inf},
        {"promised": 1.0},
        {"promised": 4.0},
    )
    given = ({}, {"arithmetic": "three_term"}, {"tolerance": 1e-6}, {"events": "mesh"})
    for cause, order, more, options in product(CAUSES, orders, promises, given):
        if reason == "order_high" and math.isnan(order):
            continue  # an order that is too high is known
        one = story(reason=reason, cause=cause, order=order, options=options, **more)
        assert_specific(advise(one))
        assert tell(one).endswith("."), (cause, order, more, options)


@pytest.mark.parametrize(
    ("order", "told"),
    [
        (2.04, "The rescaled differences coincide."),
        (2.24, "It raises the measured order."),
        (1.75, "It lowers the measured order."),
    ],
)
def test_a_measured_order_away_from_the_one_that_dominates_is_explained(
    order: float, told: str
) -> None:
    assert told in tell(story(reason="asymptotic", order=order))


@pytest.mark.parametrize(
    ("apart", "norm", "told"),
    [
        (0.01, "linf", "The rescaled differences coincide."),
        (0.2, "linf", "The rescaled differences do not coincide yet."),
        (math.nan, "linf", ""),
        (0.01, "linf_interior", "The rescaled differences coincide."),
        (0.2, "linf_interior", ""),  # they may be apart at the last point alone
    ],
)
def test_only_differences_that_coincide_are_told_to(apart: float, norm: str, told: str) -> None:
    text = tell(story(reason="asymptotic", order=2.0, rescaled_distance=apart, norm=norm))
    assert told in text
    assert ("coincide" in text) == bool(told)


def test_what_is_predicted_is_told_with_its_cost() -> None:
    few = advise(story(reason="too_few_levels", levels=(4, 5)))
    assert few == "Add levels 6 and 7 to `levels:` (2 levels)."
    early = advise(story(reason="pre_asymptotic", more=3))
    assert early.startswith("Add levels 8 to 10 to `levels:` (3 levels); 3 more are probably")
    assert "is not known yet" in advise(story(reason="pre_asymptotic"))
    noise = story(
        reason="round_off", readable=6, compensated=20, options={"arithmetic": "three_term"}
    )
    assert "up to level 20" in advise(noise)
    assert "such as 3 to 6" in advise(noise)
    assert "central" in advise(story(promised=1.0, kind="central_backward_damping"))
    assert "backward" in tell(story(promised=1.0, kind="central_backward_damping"))


def test_levels_finer_than_those_of_the_ladder_are_not_called_coarser() -> None:
    """Noise above what rounding can make: by the prediction an order could be read beyond the finest level."""
    text = advise(story(reason="round_off", order=math.nan, last=-1, readable=9))
    assert "such as" not in text
    assert "below 7" in text
    assert_specific(text)


def test_a_scheme_of_an_order_is_not_asked_for_where_it_is_one() -> None:
    corner = Corner("the force changes", 0.5, 1.0)
    high = advise(story(reason="non_smooth", corner=corner))
    assert "or take a scheme (`schemes:`) of order 1." in high
    allowed = story(reason="non_smooth", corner=corner, promised=1.0, expected=1.0)
    assert "Order 1 is what it allows" in tell(allowed)
    low = advise(allowed)
    assert low.endswith("before t = 0.5, or choose steps that have a grid point there.")
    on_a_point = corner._replace(on_a_point=True)
    low = advise(story(reason="non_smooth", corner=on_a_point, promised=1.0, expected=1.0))
    assert low == "End the time interval (`time: end`) before t = 0.5 to see order 1."


def test_what_is_no_order_is_not_told_as_one() -> None:
    growing = tell(story(reason="pre_asymptotic", order=-4.4, low=math.nan, high=math.nan))
    assert "grow from level to level" in growing
    assert "level 7 differs in kind" in growing
    noise = tell(story(reason="round_off", order=-1.7, low=math.nan, high=math.nan))
    assert "order" not in noise
    blown_up = tell(story(reason="pre_asymptotic", order=36.2, low=math.nan, high=math.nan))
    assert "36" not in blown_up
    assert "on levels 4 to 7" in blown_up


def test_no_kind_of_check_is_left_out() -> None:
    assert set(KINDS) - {"best"} == set(MEASURED)


@pytest.mark.usefixtures("with_series")
@pytest.mark.slow
@pytest.mark.parametrize(
    ("model", "words", "advised"),
    [
        ({"force": "1/t"}, "in the first step at level 3 and at every finer one", "at t = 0"),
        ({"force": "sqrt(1.7 - t)"}, "level 6 produced one at t = 1.719", "before t = 1.719"),
        # escapes; the time follows from the integral of du/sqrt(u^2 - 1 + (u^4 - 1)/2) from 1 on
        ({"spring": "-u - u**3"}, "level 6 produced one at t = 1.5", "Finer levels will not help"),
    ],
)
def test_finer_levels_are_not_advised_where_all_of_them_fail_alike(
    model: dict[str, Any], words: str, advised: str
) -> None:
    content = {
        "title": "t",
        "model": {"kind": "oscillator", **model},
        "initial": {"u": 1.0},
        "time": {"end": 2.0},
        "levels": [3, 4, 5, 6],
        "schemes": ["rk4"],
    }
    made = Experiment.from_dict(content)
    (verdict,) = verdicts(made, analyse_records(made, simulated(made)))
    assert verdict.reason == "non_finite"
    assert words in verdict.text
    assert advised in verdict.advice
    assert "or finer" not in verdict.advice


def test_a_failure_of_coarse_levels_alone_is_placed_and_mended_by_finer_ones() -> None:
    nan = math.nan
    coarse = story(reason="non_finite", culprit=4, failures=(1.25, nan, nan, nan))
    assert "at level 4, at t = 1.25" in tell(coarse)
    assert "Start `levels:` at 5 or finer" in advise(coarse)
    moving = story(reason="non_finite", culprit=4, failures=(1.25, 2.5, 4.0, 9.0))
    assert "or finer" in advise(moving)


def test_a_number_that_needs_more_levels_than_there_are_says_so() -> None:
    exp = experiment(levels=[4, 5], checks=[{"value": "ratio", "quantity": "theta", "equals": 4.0}])
    (found,) = verdicts(exp, analyse_records(exp, level_records(exp)))
    assert (found.status, found.reason) == ("INCONCLUSIVE", "too_few_levels")
    assert (
        found.text
        == "ratio of theta does not exist here, because it needs more levels than there are."
    )
    assert found.advice == "Add finer `levels:` until there are 3."


def test_a_motion_that_escapes_is_not_told_to_take_finer_levels_alone() -> None:
    """u'' = -u + u^3 from 1.5 at rest runs away in finite time, whatever the step; see `check: converges` beside it."""
    exp = experiment(
        model={"kind": "duffing", "beta": -1.0},
        initial={"u": 1.5},
        schemes=["rk4"],
        levels=[5, 6, 7],
        time={"end": 20.0},
        checks=[{"stable": True}],
    )
    levels = {level: simulate_record(exp, level) for level in exp.levels}
    (found,) = verdicts(exp, analyse_records(exp, levels))
    assert found.reason == "non_finite"
    assert "the motion itself escapes" in found.text
    assert "`time: end`) before t = 1." in found.advice
    assert "finer" not in found.advice


PENDULUM = {"title": "t", "model": {"kind": "pendulum"}, "initial": {"theta": 1.0}}
RUN = {**PENDULUM, "time": {"end": 10.0}, "schemes": ["central"]}


@pytest.mark.usefixtures("with_series")
@pytest.mark.slow
@pytest.mark.parametrize("value", ["end", "period"])
def test_advice_on_a_number_is_right_when_it_is_followed(value: str) -> None:
    """Finer levels bring a number that is off by their error, and none that is off by more."""
    of = {"quantity": "theta"} if value == "end" else {}
    truth = _number({**of, "value": value, "at": {"level": 14}, "equals": 9.0}, [13, 14])
    check = {**of, "value": value, "equals": truth + 0.1, "atol": 1e-3}
    advice = judged({**RUN, "levels": [5, 6, 7], "checks": [check]}).advice
    assert advice.startswith("Change `equals:`")
    check = {**of, "value": value, "equals": truth, "atol": 1e-6}
    advice = judged({**RUN, "levels": [5, 6, 7], "checks": [check]}).advice
    (last,) = re.findall(r"^Add levels \d+ to (\d+) to `levels:`", advice)
    assert judged({**RUN, "levels": [5, 6, int(last)], "checks": [check]}).status == "PASS"


@pytest.mark.slow
def test_a_number_of_the_finest_level_by_its_name_asks_for_a_finer_one() -> None:
    """Levels that are added do not change a check that names its level."""
    truth = _number({"value": "period", "at": {"level": 14}, "equals": 9.0}, [13, 14])
    check = {"value": "period", "equals": truth, "atol": 1e-6}
    named = {**check, "at": {"level": 7}}
    advice = [judged({**RUN, "levels": [5, 6, 7], "checks": [c]}).advice for c in (check, named)]
    assert ["ask for one" in a for a in advice] == [False, True]


def test_a_motion_that_may_not_be_steady_yet_is_told_to_run_longer() -> None:
    model = {"kind": "oscillator", "m": 1.0, "spring": "u", "damping": "0.1*v"}
    model |= {"parameters": {"w": 2.0}, "force": "cos(w*t)"}
    forced = {"periods": 4, "steps_per_period": 8, "frequency": "model.parameters.w"}
    content = {"title": "t", "model": model, "initial": {"u": 0.0, "v": 0.0}, "time": forced}
    content |= {"levels": [2, 3, 4], "schemes": ["rk4"]}
    content["checks"] = [{"value": "steady_amplitude", "quantity": "u", "equals": 9, "atol": 1}]
    assert judged(content).advice.endswith("a longer run helps (`time: periods`).")


def test_advice_on_a_number_of_several_levels_looks_at_those_that_have_one() -> None:
    check = {"value": "observed_order", "quantity": "theta"}
    far = judged({**RUN, "levels": [6, 7, 8, 9, 10], "checks": [{**check, "above": 3.9}]})
    assert far.advice.startswith("Change `above:`")
    near = judged({**RUN, "levels": [4, 5, 6, 7, 8], "checks": [{**check, "below": 2.001}]})
    assert near.advice.startswith("Add level")


@pytest.mark.slow
def test_a_finer_level_is_asked_for_where_it_has_the_number() -> None:
    check = {"value": "at", "quantity": "theta", "atol": 1e-3, "at": {"level": 5, "step": 16}}
    truth = _number({**check, "at": {"t": 5.0}, "equals": 9.0}, [13, 14])
    verdict = judged({**RUN, "levels": [5, 6, 9], "checks": [{**check, "equals": truth}]})
    assert "`at: {level: 9, step: 256}`" in verdict.advice
    followed = {**check, "equals": truth, "at": {"level": 9, "step": 256}}
    assert judged({**RUN, "levels": [5, 6, 9], "checks": [followed]}).status == "PASS"


def judged(content: dict[str, Any]) -> Any:
    made = Experiment.from_dict(content)
    (found,) = verdicts(made, analyse_records(made, simulated(made)))
    return found


def _number(check: dict[str, Any], levels: list[int]) -> float:
    """Return the number that a check measures."""
    return float(judged({**RUN, "levels": levels, "checks": [check]}).results[0].value)


@pytest.mark.parametrize(
    ("orders", "due", "says"),
    [
        ((3.1, 2.8, 2.4), 1.0, "fall towards order 1 (3.10, 2.80, 2.40), because a higher power"),
        ((math.nan, 0.9, 1.6), 2.0, "rise towards order 2 (0.90, 1.60)"),
        ((1.6, 1.1), 2.0, "move away from order 2 (1.60, 1.10)"),
        ((1.1, 2.9, 1.4), 2.0, "do not settle (1.10, 2.90, 1.40)"),
        ((2.4,), 1.0, "which is above order 1, because a higher power"),
        ((1.1,), 2.0, ""),
        ((4.01, 4.0), 2.0, "hardly change (4.01, 4.00)"),
        ((0.9, 0.95), 2.0, "hardly change (0.90, 0.95)"),
        ((1.5, 1.8), 2.0, ""),
        ((), 2.0, ""),
    ],
)
def test_where_orders_go_is_told(orders: tuple[float, ...], due: float, says: str) -> None:
    order = next((x for x in reversed(orders)), 2.0)
    of = {"expected": due, "promised": due, "orders": orders}
    told = tell(story(reason="pre_asymptotic", order=order, **of))
    assert says in told
    assert ("From level to level" in told) == (len(says) > 0 and len(orders) > 1)


@pytest.mark.slow
def test_an_order_above_the_promised_one_is_said_to_fall_towards_it() -> None:
    """The error of Forward Euler on a pendulum is that of its growth, which a coarse step does not show."""
    check = {"converges": "theta", "order": "scheme"}
    run = {**RUN, "schemes": ["forward_euler"], "levels": [6, 7, 8], "checks": [check]}
    verdict = judged({**run, "time": {"end": 10.0}})
    assert verdict.reason == "pre_asymptotic"
    assert "The last estimate is order 1.487 on levels 6 to 8, which is above" in verdict.text
    assert "which is above order 1, because a higher power of dt still dominates" in verdict.text
    # twice as late the differences turn round from level to level, which no power does
    verdict = judged({**run, "time": {"end": 20.0}})
    assert verdict.reason == "pre_asymptotic"
    assert verdict.results[0].order is None
    assert "last estimate" not in verdict.text


def test_a_corner_is_not_blamed_for_an_order_that_the_scheme_does_not_have() -> None:
    """Quadratic damping leaves order 3 where v vanishes, but `central` has no more than 2 before that."""
    corner = Corner("the velocity v passes zero", 0.1451, 3.0)
    told = story(reason="non_smooth", order=1.892, expected=3.0, promised=2.0, corner=corner)
    assert "Scheme mine promises no more than order 2 without it" in tell(told)
    assert advise(told).startswith("Set `order: scheme`, and end the time interval")
    assert "to see order 2" in advise(told)
    kept = story(reason="non_smooth", order=-2.0, expected=4.0, promised=4.0, corner=corner)
    assert "promises no more" not in tell(kept)
    assert "last estimate" not in tell(kept)
    assert "to see order 4" in advise(kept)


@pytest.mark.slow
def test_a_scheme_that_is_exact_is_not_sent_to_coarser_levels_alone() -> None:
    """A ball in free flight is a parabola, which this scheme has to round-off on every level."""
    ball = {"title": "t", "model": {"kind": "bouncing_ball"}, "initial": {"h": 1.0}}
    check = {"converges": "h", "order": 4}
    schemes = [{"kind": "newmark", "gamma": 0.7, "beta": 0.4}]
    run = {**ball, "time": {"end": 1.0, "base_steps": 3}, "schemes": schemes, "checks": [check]}
    verdict = judged({**run, "levels": [6, 7, 8, 9, 10]})
    assert verdict.reason == "round_off"
    assert "If the coarser ones are round-off, too, the scheme is exact here" in verdict.advice


@pytest.mark.slow
def test_levels_are_started_behind_the_last_one_that_fails() -> None:
    """Heun's method on a hardening spring overflows on levels 4 and 5, at times that differ."""
    model = {"kind": "duffing", "gamma": 0.3, "omega": 1.2, "delta": 0.1}
    run = {"title": "t", "model": model, "initial": {"u": 0.1}, "time": {"end": 25.0}}
    run = {**run, "schemes": ["heun"], "checks": [{"converges": "u"}]}
    verdict = judged({**run, "levels": [4, 5, 6]})
    assert verdict.reason == "non_finite"
    assert "Start `levels:` at 6 or finer" in verdict.advice
    assert judged({**run, "levels": [6, 7, 8, 9]}).reason != "non_finite"


def test_finer_levels_of_an_extrapolated_number_are_not_asked_for_one_by_one() -> None:
    """The levels may still change the number by more than its bound; `best` stays what is asked for."""
    check = {"value": "frequency", "at": {"level": "best"}, "equals": 1.3000001, "atol": 1e-13}
    model = {"kind": "spring", "w": 1.3}
    run = {**RUN, "model": model, "initial": {"u": 1.0}, "time": {"end": 20.0}, "samples": "all"}
    verdict = judged({**run, "schemes": ["rk4"], "levels": [6, 7, 8, 9], "checks": [check]})
    assert verdict.reason == "mismatch"
    assert verdict.advice.startswith("Add level")
    assert "ask for one" not in verdict.advice


def test_nothing_is_readable_of_a_motion_that_does_not_move() -> None:
    ball = {"title": "t", "model": {"kind": "bouncing_ball"}, "initial": {"h": 0.0}}
    run = {**ball, "time": {"end": 5.0}, "schemes": ["rk4"], "levels": [5, 6, 7, 8]}
    verdict = judged({**run, "checks": [{"converges": "h"}]})
    assert "level 40" not in verdict.advice


@pytest.mark.parametrize(
    ("low", "high", "ends"),
    [
        (1.98, 2.02, "between 1.980 and 2.020"),
        (1.99974, 2.00018, "between 1.9997 and 2.0002"),
        (1.999999, 2.000001, "between 1.999999 and 2.000001"),
    ],
)
def test_the_ends_of_an_interval_are_told_apart(low: float, high: float, ends: str) -> None:
    told = story(reason="asymptotic", order=2.0, low=low, high=high)
    assert f"order 2.000 ({ends}) on levels 4 to 7" in tell(told)
    assert interval((low, high)) == ends.removeprefix("between ").replace(" and ", " to ")


def test_an_interval_without_a_width_is_not_told() -> None:
    assert "order 2.000 on levels 4 to 7" in tell(
        story(reason="asymptotic", order=2.0, low=2.0, high=2.0)
    )
    assert interval((2.0, 2.0)) == "2.000"


@pytest.mark.parametrize("kind", ["forward_euler", "central"])
@pytest.mark.usefixtures("with_series")
def test_as_many_finer_levels_are_asked_for_as_the_measured_changes_need(kind: str) -> None:
    """A number whose error halves from level to level needs more of them than one whose error falls to a quarter."""
    check = {"value": "end", "quantity": "theta", "equals": -0.7, "atol": 3e-5}
    model = {"kind": "linear_pendulum", "g": 1.0, "L": 1.0}
    run = {**RUN, "model": model, "initial": {"theta": 1.0}, "time": {"end": math.acos(-0.7)}}
    run |= {"schemes": [kind], "checks": [check]}
    first = 8 if kind == "forward_euler" else 3
    advice = judged({**run, "levels": [first, first + 1, first + 2]}).advice
    (named,) = re.findall(r"^Add levels? ([\w ]+) to `levels:`", advice)
    last = max(map(int, re.findall(r"\d+", named)))
    # the last three levels decide
    assert judged({**run, "levels": [last - 2, last - 1, last]}).status == "PASS", advice
    assert judged({**run, "levels": [last - 3, last - 2, last - 1]}).status == "FAIL", advice


@pytest.mark.usefixtures("with_series")
def test_a_number_that_would_take_too_many_finer_levels_asks_for_another_scheme() -> None:
    check = {"value": "end", "quantity": "theta", "equals": -0.7, "atol": 1e-15}
    model = {"kind": "linear_pendulum", "g": 1.0, "L": 1.0}
    run = {**RUN, "model": model, "initial": {"theta": 1.0}, "time": {"end": math.acos(-0.7)}}
    advice = judged({**run, "levels": [8, 9, 10], "checks": [check]}).advice
    assert advice.startswith("Take a scheme of higher order (`schemes:`)")
    assert advice.endswith("It would take more than 12 finer levels.")


def test_a_number_of_an_adaptive_scheme_asks_for_a_smaller_tolerance() -> None:
    """Its error comes from the tolerance alone: the model and the exact value are right."""
    made = Experiment.from_dict(
        {
            "title": "x",
            "model": {"kind": "spring"},
            "initial": {"u": 1.0},
            "time": {"end": 20.0},
            "levels": [4, 5, 6],
            "schemes": ["rk4", {"kind": "radau", "tolerance": 1e-4}],
            "checks": [
                {
                    "value": "end",
                    "quantity": "u",
                    "at": {"scheme": "radau"},
                    "equals": math.cos(20.0),
                    "atol": 1e-9,
                }
            ],
        }
    )
    (verdict,) = verdicts(made, analyse_records(made, simulated(made)))
    assert verdict.status == "FAIL"
    assert verdict.advice.startswith(
        "Give scheme radau a smaller `tolerance:`, or change `equals:`"
    )
