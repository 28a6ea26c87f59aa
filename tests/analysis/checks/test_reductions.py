"""A number of all members: the bounds hold, every verdict occurs, and a resonance curve has its closed form.

Source of the closed form: the steady state of u'' + b u' + u = cos(w t) has the amplitude
1/sqrt((1 - w^2)^2 + (b w)^2), largest at w^2 = 1 - b^2/2.
"""

from __future__ import annotations

import json
import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from whole import analysed, decided

from vibsim import verdicts
from vibsim.analysis import summarise
from vibsim.analysis.check_verdicts import Verdict
from vibsim.checks.reductions import REDUCTIONS
from vibsim.core.errors import InputError
from vibsim.experiment import Experiment
from vibsim.experiment.experiment import canonical, restore
from vibsim.experiment.value_names import OF_ONE_MEMBER, OF_THE_SAME_KIND
from vibsim.report.text.assertions import about

pytestmark = pytest.mark.usefixtures("without_series")

DAMPING = 0.4
FREQUENCIES = np.linspace(0.5, 1.5, 11)
AMPLITUDES = 1.0 / np.hypot(1.0 - FREQUENCIES**2, DAMPING * FREQUENCIES)
KEY = "model.parameters.w"
CURVE = {"value": "amplitude", "over": KEY}


def resonance(*checks: dict[str, Any], **changes: Any) -> Experiment:
    """Return driven oscillators that begin in their steady state."""
    w = FREQUENCIES
    u, v = (1.0 - w**2) * AMPLITUDES**2, DAMPING * w**2 * AMPLITUDES**2
    sweep = {KEY: w.tolist(), "initial.u": u.tolist(), "initial.v": v.tolist()}
    content: dict[str, Any] = {
        "title": "Resonance",
        "model": {
            "kind": "oscillator",
            "m": 1.0,
            "damping": f"{DAMPING}*v",
            "spring": "1.0*u",
            "force": "cos(w*t)",
            "parameters": {"w": 1.0},
        },
        "time": {"end": 20.0},
        "levels": [6, 7, 8, 9],
        "schemes": ["rk4"],
        "sweep": {"zip": sweep},
        "checks": list(checks),
    }
    return Experiment.from_dict(content | changes)


def judged(*checks: dict[str, Any], **changes: Any) -> list[Verdict]:
    found = resonance(*checks, **changes)
    convergence = analysed(found)
    return verdicts(found, convergence)


# ---- the bounds


def true_number(take: str, x: Any, key: Any) -> float:
    """Work a reduction out with the definitions of its words alone."""
    rows = sorted(zip(key.tolist(), x.tolist(), strict=True))
    numbers = [number for _, number in rows]
    pairs = list(pairwise(numbers))
    return {
        "largest": lambda: max(numbers),
        "smallest": lambda: min(numbers),
        "mean": lambda: math.fsum(numbers) / len(numbers),
        "where_largest": lambda: next(at for at, number in rows if number == max(numbers)),
        "where_smallest": lambda: next(at for at, number in rows if number == min(numbers)),
        "monotone": lambda: (
            float(all(a < b for a, b in pairs)) - float(all(a > b for a, b in pairs))
        ),
    }[take]()


@pytest.mark.parametrize("take", REDUCTIONS)
def test_true_numbers_lie_between_the_bounds_and_reach_them(take: str) -> None:
    random = np.random.default_rng(21)
    for _ in range(40):
        key = random.permutation(np.arange(5.0))
        x = random.choice([key, -key, random.normal(size=5)]) + 0.3 * random.normal(size=5)
        e = random.choice([0.0, 0.05, 0.5, 2.0], size=5)
        found = REDUCTIONS[take](x, e, key)
        tried = [true_number(take, x + s * e, key) for s in random.uniform(-1, 1, size=(200, 5))]
        corners = 2.0 * (np.arange(32)[:, None] >> np.arange(5) & 1) - 1.0
        tried += [true_number(take, x + s * e, key) for s in corners]
        assert found.value == pytest.approx(true_number(take, x, key), rel=1e-15)
        assert found.low <= min(tried) + 1e-12
        assert max(tried) <= found.high + 1e-12
        if take in ("largest", "smallest", "mean"):
            # no bound is wider than numbers within the intervals can make it
            assert (found.low, found.high) == pytest.approx((min(tried), max(tried)), abs=1e-12)
        if not e.any():
            assert found.low == found.high == pytest.approx(found.value, rel=1e-15)
            assert not found.open.any()


@pytest.mark.parametrize("take", REDUCTIONS)
def test_what_is_taken_is_listed_as_the_kind_of_number_that_it_is(take: str) -> None:
    """Units, digits, figures and the member that a sentence names follow from these lists."""
    random = np.random.default_rng(22)
    x, key = random.normal(size=(30, 5)) + 9.0, np.arange(5.0)
    found = np.array([REDUCTIONS[take](row, 0.0 * row, key).value for row in x])
    shifted = np.array([REDUCTIONS[take](row + 2.0, 0.0 * row, key).value for row in x])
    assert np.allclose(shifted, found + 2.0) == (take in OF_THE_SAME_KIND)
    assert np.all(np.any(x == found[:, None], axis=1)) == (take in OF_ONE_MEMBER)


# ---- the closed form


def test_a_resonance_curve_has_its_closed_form() -> None:
    top = int(np.argmax(AMPLITUDES))
    rows = {
        "largest": float(AMPLITUDES[top]),
        "smallest": float(AMPLITUDES.min()),
        "mean": float(AMPLITUDES.mean()),
        "where_largest": float(FREQUENCIES[top]),
        "where_smallest": 1.5,
        "monotone": 0.0,
    }
    checks = [
        CURVE | {"take": take, "equals": number, "rtol": 1e-3} for take, number in rows.items()
    ]
    for verdict, number in zip(judged(*checks), rows.values(), strict=True):
        assert (verdict.status, verdict.reason) == ("PASS", "match"), verdict.text
        facts = verdict.results[0].facts
        assert facts["low"] <= number <= facts["high"] or math.isclose(number, facts["low"])
        assert facts["high"] - facts["low"] < 1e-3
        assert facts["members"] == len(FREQUENCIES)
        assert sum(verdict.counts.values()) == 1


@pytest.mark.parametrize("last", [5, 9])
def test_numbers_of_one_level_are_taken_as_they_are(last: int) -> None:
    one = {"level": last}
    found = resonance(CURVE | {"take": "mean", "above": 0, "at": one}, levels=[3, 4, last])
    convergence = analysed(found)
    (verdict,) = verdicts(found, convergence)
    facts = verdict.results[0].facts
    own = convergence["check_check_1_value"].values[0]
    assert facts["value"] == pytest.approx(float(np.mean(own)), rel=1e-15)
    assert facts["error_bound"] == 0.0


# ---- verdicts and words


def words_of(take: str, **asked: float) -> tuple[str, str, str, str]:
    levels = asked.pop("levels", None)
    changes = {} if levels is None else {"levels": levels}
    (verdict,) = judged(CURVE | {"take": take, **asked}, **changes)
    return verdict.status, verdict.reason, verdict.text, verdict.advice


@pytest.mark.slow
def test_every_verdict_occurs_and_says_the_finding() -> None:
    status, reason, text, _ = words_of("largest", below=3)
    assert (status, reason) == ("PASS", "match")
    head = f"The largest amplitude over 11 members is 2.500000001 m, at {KEY} = 1, with an error of at most"
    assert text.startswith(head)
    assert text.endswith("; it is below 3 m.")
    status, reason, text, advice = words_of("largest", below=1)
    assert (status, reason) == ("FAIL", "mismatch")
    assert text.endswith("; it is not below 1 m.")
    assert advice == "Change `below:`, `model:` or `sweep:`."
    status, reason, text, advice = words_of("largest", equals=2.5, atol=1e-9)
    assert (status, reason) == ("INCONCLUSIVE", "pre_asymptotic")
    assert (
        "; it may or may not be equal to 2.5 within 1e-09 m, because 1 of 11 members is not "
        in text
    )
    assert text.endswith(f" resolved well enough ({KEY} = 1).")
    assert advice.startswith("Add levels 10 and 11 to `levels:` (")
    status, reason, text, _ = words_of("where_largest", equals=1.2)
    assert (status, text) == (
        "FAIL",
        f"The largest amplitude over 11 members is at {KEY} = 1; it is not equal to 1.2 within 1.2e-09.",
    )
    status, _, text, _ = words_of("monotone", equals=1)
    assert status == "FAIL"
    assert text == (
        f"amplitude neither rises nor falls throughout with {KEY} over 11 members; it turns at {KEY} = 1; "
        "asked is that it rises."
    )


def test_a_number_that_stays_does_not_turn() -> None:
    content = {
        "title": "a ball with 3, 2, 2 and 2 bounces",
        "model": {"kind": "bouncing_ball", "g": 9.81},
        "initial": {"h": 1.0},
        "time": {"end": 1.2, "base_steps": 12},
        "levels": [1, 2, 3],
        "schemes": ["rk4"],
        "sweep": {"model.restitution": [0.5, 0.6, 0.7, 0.8]},
        "checks": [
            {"value": "event_count", "over": "cases", "take": "monotone", "equals": -1},
        ],
    }
    experiment = Experiment.from_dict(content)
    (verdict,) = decided(experiment)
    assert "; it is the same beside model.restitution = 0.6; asked is that it falls" in verdict.text


@pytest.mark.slow
def test_members_that_decide_and_are_not_resolved_leave_it_open() -> None:
    # so coarse that the neighbours of the peak may be higher
    status, reason, text, _ = words_of("where_largest", equals=1.0, levels=[3, 4, 5])
    assert (status, reason) == ("INCONCLUSIVE", "pre_asymptotic"), text
    assert "members are not resolved well enough" in text
    # a member that does not decide may be as coarse as it likes
    status, _, text, _ = words_of("where_largest", below=1.45, levels=[4, 5, 6])
    assert status == "PASS", text
    # one level shows no error
    status, reason, text, _ = words_of("mean", below=2, levels=[9])
    assert (status, reason) == ("INCONCLUSIVE", "too_few_levels")


def test_a_member_that_breaks_down_leaves_no_number_of_all() -> None:
    model = {"kind": "oscillator", "spring": "u**3", "m": 1.0}
    (verdict,) = judged(
        {
            "value": "end",
            "quantity": "u",
            "over": "initial.u",
            "take": "largest",
            "below": 5,
            "at": {"level": 4},
        },
        model=model,
        time={"end": 40.0},
        levels=[4, 5, 6],
        schemes=["forward_euler"],
        sweep={"initial.u": [0.001, 1.0, 50.0]},
    )
    assert (verdict.status, verdict.reason) == ("FAIL", "non_finite")
    assert "cannot be taken together: at initial.u = 1, " in verdict.text
    assert verdict.results[0].case == 1


@pytest.mark.slow
def test_claims_and_schemes_have_a_result_each() -> None:
    claim = {
        "claim": "the peak is at 1",
        "that": CURVE | {"take": "where_largest", "equals": 1.0},
        "holds": True,
    }
    wrong = {"claim": "it rises", "that": CURVE | {"take": "monotone", "equals": 1}, "holds": False}
    found = judged(claim, wrong, schemes=["rk4", "heun"])
    assert [verdict.status for verdict in found] == ["PASS", "PASS"]
    assert [sum(verdict.counts.values()) for verdict in found] == [2, 2]
    assert "Both results passed. The hardest is scheme" in found[0].text
    assert "case" not in found[0].text


@pytest.mark.slow
def test_other_swept_keys_are_fixed_by_value() -> None:
    sweep = {"initial.u": [0.5, 1.0, 2.0], "model.m": [1.0, 4.0]}
    row = {"value": "end", "quantity": "u", "over": "initial.u", "take": "largest"}
    model = {"kind": "oscillator", "m": 1.0, "spring": "1.0*u"}
    # u = u(0) cos(t/sqrt(m))
    for mass in (1.0, 4.0):
        ends = [u * math.cos(5.0 / math.sqrt(mass)) for u in (0.5, 1.0, 2.0)]
        asked = {"equals": max(ends), "rtol": 1e-6, "at": {"model.m": mass}}
        (verdict,) = judged(row | asked, model=model, sweep=sweep, time={"end": 5.0})
        assert verdict.status == "PASS", verdict.text
        assert verdict.results[0].facts["at"] == (2.0 if mass == 1.0 else 0.5)
        assert verdict.text.startswith(f"With model.m = {mass:g}: The largest u at the end over 3")
    with pytest.raises(InputError, match=r"model\.m varies, too: name its value"):
        resonance(row | {"below": 1}, model=model, sweep=sweep)


REFUSED = {
    "no take": ({"over": KEY, "below": 1}, "take: required key is missing"),
    "no over": ({"take": "mean", "below": 1}, "over: required key is missing"),
    "take": ({"over": KEY, "take": "largst", "below": 1}, "did you mean 'largest'?"),
    "key": ({"over": "model.parameters.v", "take": "mean", "below": 1}, f"did you mean '{KEY}'?"),
    "fixed": ({"over": KEY, "take": "mean", "below": 1, "at": {KEY: 1}}, "is fixed by `at:`"),
    "together": (
        {"over": KEY, "take": "mean", "below": 1, "at": {"initial.u": 0.0}},
        "over: model.parameters.w: moves together with initial.u",
    ),
    "case": ({"over": KEY, "take": "mean", "below": 1, "at": {"case": 1}}, "is fixed by `at:`"),
    "direction": ({"over": KEY, "take": "monotone", "equals": 2}, "takes `equals: 1` (it rises)"),
    "border": ({"over": KEY, "take": "monotone", "above": 0}, "takes `equals: 1` (it rises)"),
}


@pytest.mark.parametrize(("keys", "told"), REFUSED.values(), ids=REFUSED)
def test_what_cannot_be_taken_is_refused(keys: dict[str, Any], told: str) -> None:
    with pytest.raises(InputError) as error:
        resonance({"value": "amplitude"} | keys)
    assert told in str(error.value)


def test_without_a_sweep_there_is_nothing_to_take() -> None:
    with pytest.raises(InputError, match="is not a swept key with numbers: there is no sweep"):
        resonance(CURVE | {"take": "mean", "below": 1}, sweep=None)


def test_it_is_stored_summed_up_and_left_out_of_a_member_alone() -> None:
    found = resonance(
        CURVE | {"take": "largest", "below": 3, "id": "top"},
        {"converges": "u"},
        CURVE | {"take": "monotone", "equals": 1, "id": "way"},
    )
    assert restore(json.loads(json.dumps(canonical(found)))) == found
    assert found.checks[0].at.level == "best"  # type: ignore[union-attr]
    assert [check.kind for check in found.alone(2).checks] == ["converges"]
    convergence = analysed(found)
    entry, _, way = summarise(found, verdicts(found, convergence), convergence)["checks"]
    assert way["expected"] == "rising"
    (result,) = entry["results"]
    assert result["case"] == 5
    assert result["values"][KEY] == 1.0
    assert result["facts"]["at"] == 1.0
    assert found.notes == ()
    assert about(found.checks[0]).startswith("Largest amplitude over w at")
