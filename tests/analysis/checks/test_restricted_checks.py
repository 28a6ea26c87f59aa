"""A check that names swept values is about the members that have them, and about no others."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from whole import analysed

from vibsim import verdicts
from vibsim.analysis.check_verdicts import Verdict
from vibsim.core.errors import InputError
from vibsim.experiment import Experiment
from vibsim.experiment.experiment import canonical, restore

pytestmark = pytest.mark.usefixtures("without_series")

LENGTHS = [1.0, 1.25, 1.5, 1.75, 2.0]
ANGLES = [0.1, 0.2]
PLAIN: dict[str, Any] = {
    "title": "Linear pendulums",
    "model": {"kind": "linear_pendulum", "g": 1.0},
    "time": {"end": 10.0},
    "levels": [7, 8, 9],
    "schemes": ["central", {"kind": "central", "label": "late", "start": "first_order"}],
    "sweep": {"model.L": {"linspace": [1, 2, 5]}, "initial.theta": ANGLES},
}


def experiment(*checks: dict[str, Any], **changes: Any) -> Experiment:
    return Experiment.from_dict(PLAIN | {"checks": list(checks)} | changes)


def judged(*checks: dict[str, Any], **changes: Any) -> list[Verdict]:
    found = experiment(*checks, **changes)
    convergence = analysed(found)
    return verdicts(found, convergence)


KINDS: dict[str, dict[str, Any]] = {
    "value": {"value": "end", "quantity": "theta", "below": 1.0},
    "converges": {"converges": "theta", "order": "scheme"},
    "accurate": {"accurate": "theta", "relative": 0.1},
    "stable": {"stable": True},
    "conserves": {"conserves": "energy", "drift": "bounded"},
    "equal": {"equal": ["central", "late"], "quantity": "theta", "atol": 1.0},
}


@pytest.mark.slow
def test_every_kind_of_check_is_about_the_named_members() -> None:
    rows = [
        row | {"at": at}
        for row in KINDS.values()
        for at in ({"model.L": 1.25}, {"initial.theta": 0.2}, {"model.L": 2, "initial.theta": 0.1})
    ]
    cases = [{2, 3}, {1, 3, 5, 7, 9}, {8}] * len(KINDS)
    for verdict, expected in zip(judged(*rows), cases, strict=True):
        assert {result.case for result in verdict.results} == expected
        schemes = 1 if verdict.kind == "equal" else 2
        assert sum(verdict.counts.values()) == schemes * len(expected)


@pytest.mark.slow
def test_a_member_by_its_values_has_the_verdict_of_its_number() -> None:
    own = KINDS["value"] | {"equals": 0.5, "atol": 1e-3}
    del own["below"]
    for length in LENGTHS:
        case = 2 * LENGTHS.index(length)
        end = 0.1 * np.cos(np.sqrt(1.0 / length) * 10.0)
        one, other = judged(
            own
            | {
                "equals": float(end),
                "at": {"model.L": length, "initial.theta": 0.1, "scheme": "central"},
            },
            own | {"equals": float(end), "at": {"case": case, "scheme": "central"}},
        )
        assert (one.status, one.results[0]) == (other.status, other.results[0])
        assert one.status == "PASS"
        assert one.text == f"With model.L = {length:g}, initial.theta = 0.1: {other.text}"
    (all_,) = judged({"stable": True, "at": {"model.L": 1.5}})
    assert all_.text.startswith("All 4 results with model.L = 1.5 passed.")


PLACES = {
    "between": (
        {"model.L": 1.3},
        "model.L: 1.3: not a value of the sweep: nearest are 1.25 and 1.5",
    ),
    "below": ({"model.L": 0.2}, "model.L: 0.2: not a value of the sweep: nearest is 1"),
    "above": ({"model.L": 7}, "model.L: 7: not a value of the sweep: nearest is 2"),
    "key": ({"model.l": 1}, "model.l: 1: unknown key: did you mean 'model.L'?"),
    "not swept": ({"model.g": 1}, "model.g: 1: unknown key: did you mean 'model.L'?"),
    "short": ({"L": 1}, "L: 1: unknown key: choose from"),
    "word": ({"model.L": "long"}, "model.L: long: not a value of the sweep: choose from 1.0, 1.25"),
    "list": ({"model.L": [1]}, "model.L: [1]: must be a number"),
    "unit": ({"model.L": "2 kg"}, "model.L: 2 kg: must be a length [m], but kg is a mass"),
}


@pytest.mark.parametrize(("at", "told"), PLACES.values(), ids=PLACES)
@pytest.mark.parametrize("kind", KINDS)
def test_other_values_are_refused_with_the_nearest(
    kind: str, at: dict[str, Any], told: str
) -> None:
    with pytest.raises(InputError) as error:
        experiment(KINDS[kind] | {"at": at})
    (line,) = str(error.value).splitlines()
    assert f"checks[0].at.{told}" in line


def test_values_and_a_case_number_are_not_given_together() -> None:
    for kind in ("value", "stable", "conserves", "equal"):
        at = {"model.L": 2}
        row = KINDS[kind] | ({"at": at | {"case": 1}} if kind == "value" else {"case": 1, "at": at})
        with pytest.raises(InputError, match="must not be given together with case"):
            experiment(row)


def test_keys_that_vary_together_are_named_together() -> None:
    sweep = {"zip": {"model.L": [1, 2, 3], "initial.theta": [0.3, 0.2, 0.1]}}
    (found,) = judged({"stable": True, "at": {"model.L": 2, "initial.theta": 0.2}}, sweep=sweep)
    assert {result.case for result in found.results} == {1}
    with pytest.raises(InputError, match=r"no member has this together with model\.L"):
        experiment({"stable": True, "at": {"model.L": 2, "initial.theta": 0.3}}, sweep=sweep)


def test_words_units_and_formulas_name_members() -> None:
    sweep = {"schemes.central.start": ["centred", "first_order"], "initial.theta": ["60 degree", 1]}
    rows = [
        {"stable": True, "schemes": ["central"], "at": {"schemes.central.start": "first_order"}},
        {"stable": True, "schemes": ["central"], "at": {"initial.theta": "60 degree"}},
        {"stable": True, "schemes": ["central"], "at": {"initial.theta": "pi/3"}},
    ]
    found = judged(*rows, sweep=sweep, schemes=["central"])
    cases = [{result.case for result in verdict.results} for verdict in found]
    assert cases == [{2, 3}, {0, 2}, {0, 2}]


def test_a_member_alone_keeps_the_checks_that_speak_of_it() -> None:
    rows = [row | {"id": kind, "at": {"model.L": 1.25}} for kind, row in KINDS.items()]
    found = experiment(*rows, {"id": "all", "stable": True})
    assert restore(json.loads(json.dumps(canonical(found)))) == found
    assert [check.id for check in found.alone(3).checks] == [*KINDS, "all"]
    assert all(not check.measured.swept for check in found.alone(3).checks)
    assert [check.id for check in found.alone(4).checks] == ["all"]


def test_a_printed_number_may_name_its_member_by_values() -> None:
    ends = [f"{0.2 * np.cos(10 / np.sqrt(length)):.2f}" for length in LENGTHS]
    table: dict[str, Any] = {
        "title": "Ends",
        "value": "end",
        "quantity": "theta",
        "rows": [
            {
                "scheme": "central",
                "at": {"model.L": length, "initial.theta": 0.2},
                "printed": printed,
            }
            for length, printed in zip(LENGTHS, ends, strict=True)
        ],
    }
    found = judged(published=[table])
    assert [verdict.status for verdict in found] == ["PASS"] * len(LENGTHS)
    assert [verdict.results[0].case for verdict in found] == [1, 3, 5, 7, 9]
    assert "model.L 1.25, initial.theta 0.2" in found[1].text
    table["rows"][0]["at"] = {"model.L": 1.1}
    with pytest.raises(
        InputError, match=r"rows\[0\]\.at\.model\.L: 1\.1: not a value of the sweep"
    ):
        experiment(published=[table])
