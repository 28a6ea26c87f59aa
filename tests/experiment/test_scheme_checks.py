"""Checks of how schemes behave, the values that go with them, and the quantities by the centred difference."""

from __future__ import annotations

import json
from typing import Any

import pytest
from experiment_files import build, faults_of, only_fault, smallest_section
from test_experiment_faults import change_model

from vibsim.experiment import Experiment, canonical, restore
from vibsim.experiment.data import schemes_of
from vibsim.experiment.rules import values as value_rules
from vibsim.experiment.value_names import VALUES
from vibsim.models import MODELS, centred, quantities
from vibsim.schemes import FIXED_STEP, SCHEMES

REFERENCE = next(kind for kind in SCHEMES if kind not in FIXED_STEP)
SPRING: dict[str, Any] = {
    "model": {"kind": "spring"},
    "initial": {"u": 1},
    "schemes": ["central", "rk4", {"kind": "rk4", "label": "other"}, REFERENCE],
}
STABLE = {"stable": True, "schemes": ["central"], "level": 7}
CONSERVES = {"conserves": "energy", "drift": "bounded", "schemes": ["central"], "level": 7}
ACCURATE = {"accurate": "u", "relative": 1e-3, "schemes": ["central"]}
EQUAL = {"equal": ["rk4", "other"], "quantity": "v", "atol": 1e-12, "level": 7}


def spring(*checks: dict[str, Any], **changes: Any) -> Experiment:
    return build(**(SPRING | {"checks": list(checks)} | changes))


def fault_of(check: dict[str, Any], **changes: Any) -> Any:
    return only_fault(**(SPRING | {"checks": [check]} | changes))


@pytest.mark.parametrize("given", [{}, {"relative": 1.0, "absolute": 1.0}])
def test_an_accuracy_is_relative_or_absolute(given: dict[str, float]) -> None:
    fault = fault_of({"accurate": "u", **given})
    assert fault.key == "checks[0]"
    assert "exactly one of relative, absolute" in fault.rule
    assert (fault.rule.endswith("none of them")) == (not given)


@pytest.mark.parametrize("check", [STABLE, CONSERVES, EQUAL])
def test_a_check_is_kept_as_written(check: dict[str, Any]) -> None:
    claim = {"claim": "c", "that": check, "holds": False, "note": "the text errs"}
    experiment = spring(check, claim)
    plain, claimed = experiment.checks
    assert plain.kind in check
    assert plain.model_dump(mode="json", exclude_none=True) == {"id": "check_1", "at": {}, **check}
    assert claimed.that == plain.model_copy(update={"id": "check_2"})
    assert (claimed.note, claimed.holds) == ("the text errs", False)
    assert restore(json.loads(json.dumps(canonical(experiment)))) == experiment


def test_defaults_of_the_checks() -> None:
    checks = (
        {"stable": False},
        {"conserves": "energy"},
        {"equal": ["rk4", "exact"], "quantity": "u"},
    )
    for check in spring(*checks).checks:
        assert check.level is None
        assert check.case is None
    assert spring(checks[1]).checks[0].drift == "none"
    assert spring(checks[2]).checks[0].atol is None


@pytest.mark.parametrize(
    ("check", "key", "rule", "hint"),
    [
        (ACCURATE | {"accurate": "uu"}, "accurate", "unknown quantity", "did you mean 'u'?"),
        (ACCURATE | {"accurate": "u_phase"}, "accurate", "unknown quantity", ""),
        (ACCURATE | {"relative": 0.0}, "relative", "must be greater than 0", ""),
        (ACCURATE | {"relative": -1}, "relative", "must be greater than 0", ""),
        (ACCURATE | {"relative": ".inf"}, "relative", "", ""),
        (ACCURATE | {"relatve": 1.0}, "relatve", "unknown key", "did you mean 'relative'?"),
        (
            ACCURATE | {"schemes": ["centrl"]},
            "schemes[0]",
            "not a scheme",
            "did you mean 'central'?",
        ),
        (
            ACCURATE | {"accurate": "u_phase_error"},
            "relative",
            "is an error itself",
            "give `absolute:`",
        ),
        (ACCURATE | {"accurate": "v_d2t"}, "schemes[0]", "has no v_d2t", ""),
        (
            ACCURATE | {"expect": {"status": "PASS", "reason": "mismatch"}},
            "expect.reason",
            "reason of status FAIL",
            "",
        ),
        (ACCURATE | {"expect": "fail"}, "expect", "must be a mapping", "{status: FAIL, reason:"),
        (ACCURATE | {"at": {"level": 6}}, "at.level", "unknown key", "there is none"),
        ({"stable": "yes"}, "stable", "must be true or false", ""),
        ({"stable": True, "scheme": "x"}, "scheme", "unknown key", "did you mean 'schemes'?"),
        (STABLE | {"schemes": ["centrl"]}, "schemes[0]", "not a scheme", "did you mean 'central'?"),
        (STABLE | {"schemes": ["rk4", "rk4"]}, "schemes[1]", "must not be repeated", ""),
        (STABLE | {"level": 3}, "level", "not a level", "nearest is 6"),
        (STABLE | {"case": 1}, "case", "must be at most 0", "there is 1 case"),
        (
            CONSERVES | {"conserves": "enrgy"},
            "conserves",
            "unknown choice",
            "did you mean 'energy'?",
        ),
        (CONSERVES | {"drift": "cubic"}, "drift", "unknown choice", "choose from none, bounded"),
        (CONSERVES | {"conserves": "energy_d2t"}, "schemes[0]", "has no energy_d2t", "rk4, other"),
        ({"equal": ["rk4"], "quantity": "u"}, "equal", "must be [scheme, another", ""),
        ({"equal": ["rk4", "other"]}, "quantity", "required key is missing", ""),
        (EQUAL | {"equal": ["rk4", "othr"]}, "equal[1]", "not a scheme", "did you mean 'other'?"),
        (EQUAL | {"equal": ["rk4", "exakt"]}, "equal[1]", "not a scheme", "did you mean 'exact'?"),
        (EQUAL | {"equal": ["exact", "rk4"]}, "equal[0]", "must be a scheme", ""),
        (EQUAL | {"equal": ["rk4", "rk4"]}, "equal[1]", "must differ from the first", ""),
        (EQUAL | {"quantity": "theta"}, "quantity", "unknown quantity", "choose from"),
        (
            EQUAL | {"equal": ["rk4", "discrete"], "quantity": "energy"},
            "quantity",
            "discrete is not defined",
            "choose from u, v",
        ),
        (
            EQUAL | {"equal": ["rk4", "exact"], "quantity": "kinetic_energy"},
            "quantity",
            "exact is not defined",
            "choose from u, v",
        ),
        (EQUAL | {"equal": [REFERENCE, "discrete"]}, "equal[0]", "chooses its own steps", ""),
        (
            EQUAL | {"equal": ["central", "rk4"], "quantity": "v_d2t"},
            "equal[0]",
            "has no v_d2t",
            "",
        ),
        (EQUAL | {"atol": -1}, "atol", "must be at least 0", ""),
    ],
)
def test_one_fault(check: dict[str, Any], key: str, rule: str, hint: str) -> None:
    """Each alone, and with the other faults of its file."""
    fault = fault_of(check)
    assert (fault.key, rule in fault.rule, hint in fault.hint) == (
        f"checks[0].{key}",
        True,
        True,
    ), fault
    more = {**SPRING, "checks": [check, {"claim": "c", "that": check}], "output": "bst"}
    found = [row.key for row in faults_of(**more)]
    assert found == sorted(found) == [f"checks[0].{key}", f"checks[1].that.{key}", "output"]


def test_a_level_cannot_be_named_before_it_is_chosen() -> None:
    for check in (STABLE, CONSERVES, EQUAL):
        fault = fault_of(check, levels=None, tolerance=1e-8)
        assert (fault.key, fault.hint) == ("checks[0].level", "leave it out")
        spring({k: v for k, v in check.items() if k != "level"}, levels=None, tolerance=1e-8)


def test_theory_knows_linear_models_without_damping(monkeypatch: pytest.MonkeyPatch) -> None:
    check = {"equal": ["rk4", "discrete"], "quantity": "u"}
    spring(check)
    fault = only_fault(schemes=["rk4"], checks=[check | {"quantity": "theta"}])
    assert "only for linear models without damping, not for pendulum" in fault.rule
    names = [row.name for row in VALUES.values() if row.needs_linear]
    assert {"predicted_frequency", "predicted_growth_per_period", "discrete_error"} <= set(names)
    for name in names:
        of = {} if VALUES[name].of == "none" else {"quantity": "theta"}
        fault = only_fault(checks=[{"value": name, "below": 1, **of}])
        assert (fault.key, "linear models" in fault.rule) == ("checks[0].value", True)


def test_what_is_exact_must_be_known(monkeypatch: pytest.MonkeyPatch) -> None:
    def check(quantity: str) -> list[dict[str, Any]]:
        return [{"equal": ["rk4", "exact"], "quantity": quantity}]

    build(checks=check("theta"), schemes=["rk4"])
    monkeypatch.setattr(value_rules, "has_solution", lambda model: model.exact is not None)
    change_model(monkeypatch, exact=None)
    rk4 = {"schemes": ["rk4"]}
    assert "the exact theta" in only_fault(checks=check("theta"), **rk4).rule
    build(checks=check("energy"), **rk4)
    change_model(monkeypatch, exact=None, conservative=False)
    assert "the exact energy" in only_fault(checks=check("energy"), **rk4).rule
    fault = only_fault(checks=[{"conserves": "energy"}], **rk4)
    assert fault.rule == "the energy of pendulum is not conserved"


BOUNCES = {"events": [{"when": "u - 0.5", "then": {"v": "-v"}}]}


@pytest.mark.parametrize(
    ("section", "hint"),
    [
        ({"kind": "oscillator", "damping": {"linear": 0.1}}, "`converges: energy_budget`"),
        ({"kind": "system", "acceleration": "-u*exp(u*sin(u)**3)"}, "write its `potential`"),
        ({"kind": "system", "acceleration": "-u - 0.1*v + cos(t)"}, "energy_budget"),
        ({"kind": "system", "acceleration": "-u", **BOUNCES}, "its events may change it"),
        (
            {"kind": "system", "acceleration": "-u", "potential": "u**2/2", **BOUNCES},
            "its events may change it; the budget of energy and work is: `converges: energy_budget`",
        ),
    ],
)
def test_an_energy_that_is_not_conserved_has_what_is_in_its_place(
    section: dict[str, Any], hint: str
) -> None:
    checks = [{"conserves": "energy"}]
    fault = only_fault(checks=checks, schemes=["rk4"], model=section, initial={"u": 1.0})
    assert hint in fault.hint


@pytest.mark.parametrize("kind", [k for k in MODELS if SCHEMES["rk4"].treats(MODELS[k])])
def test_the_centred_difference_is_a_quantity_beside_an_own_velocity(kind: str) -> None:
    model = MODELS[kind]
    changes: dict[str, Any] = {"model": smallest_section(kind), "initial": {}}
    whole = build(schemes=["central", "rk4"], **changes)
    if model.events is not None:
        assert whole.quantities == quantities(model)
        fault = only_fault(checks=[{"converges": centred(model)[0]}], **changes)
        assert "across an event" in fault.rule
        return
    assert whole.quantities == quantities(model, own_velocity=True)
    assert [scheme.own_velocity for scheme in whole.schemes] == [False, True]
    alone = build(schemes=["central"], **changes)
    assert alone.quantities == quantities(model)
    assert whole.quantities[len(alone.quantities) :] == centred(model)
    for name in centred(model):
        for check in ({"converges": name}, {"value": "end", "quantity": name, "below": 1}):
            experiment = build(schemes=["central", "rk4"], checks=[check], **changes)
            assert schemes_of(experiment, experiment.checks[0])[-1] == 1
            fault = only_fault(schemes=["central"], checks=[check], **changes)
            assert "another velocity than the centred difference" in fault.rule
            assert fault.hint == f"ask for {name.removesuffix('_d2t')}"
        named = {"converges": name, "schemes": ["rk4", "central"]}
        fault = only_fault(schemes=["central", "rk4"], checks=[named], **changes)
        assert (fault.key, fault.hint) == ("checks[0].schemes[1]", "choose from rk4")


def test_a_faulty_scheme_says_nothing_of_quantities() -> None:
    found = faults_of(schemes=["centrl"], checks=[{"converges": "energy_d2t"}])
    assert [fault.key for fault in found] == ["schemes[0]"]


def test_checks_that_name_no_scheme_leave_out_those_without_levels() -> None:
    checks: list[dict[str, Any]] = [
        {"converges": "u"},
        {"converges": "energy_deviation_d2t"},
        {"converges": "u", "schemes": [REFERENCE]},
        {"value": "end", "quantity": "u", "below": 1},
        {"value": "end", "quantity": "u", "below": 1, "at": {"scheme": REFERENCE}},
        {"stable": True},
        {"conserves": "energy_d2t"},
        {"conserves": "energy", "schemes": ["central", REFERENCE]},
        {"equal": ["other", REFERENCE], "quantity": "u"},
        {"claim": "c", "that": {"stable": True, "schemes": ["other"]}},
    ]
    experiment = spring(*checks)
    assert [schemes_of(experiment, check) for check in experiment.checks] == [
        (0, 1, 2),
        (1, 2),
        (3,),
        (0, 1, 2),
        (3,),
        (0, 1, 2),
        (1, 2),
        (0, 3),
        (2, 3),
        (2,),
    ]


@pytest.mark.parametrize("name", VALUES)
def test_a_value_can_be_asked_for_where_it_exists(name: str) -> None:
    row = VALUES[name]
    check: dict[str, Any] = {"value": name, "below": 1}
    if row.of != "none":
        check["quantity"] = "energy_deviation" if row.of in ("running", "deviation") else "u"
    at: dict[str, Any] = {"step": 39} if row.needs_time else {}
    if "event" in row.at:
        at = {"event": 3}
    if row.needs_events:
        assert "spring has no events" in fault_of(check | {"at": at}).rule
        build(
            checks=[check | {"at": at}],
            model={"kind": "sliding_box"},
            initial={"u": 1},
            schemes=["rk4"],
        )
        return
    if row.needs_force:
        assert "time names no frequency" in fault_of(check).rule
        spring(check, time={"periods": 3, "steps_per_period": 8, "frequency": "model.w"})
        return
    spring(check | {"at": at}, samples="all")
    if "step" in row.at:
        spring(check | {"at": {"step": 39}}, samples="all")
        fault = fault_of(check | {"at": {"step": 39}}, samples="common")
        assert (fault.key, fault.hint) == ("checks[0].at.step", "nearest are 32 and 40")
    if "scheme" in row.at:
        adaptive = check | {"at": at | {"scheme": REFERENCE}}
        if row.fixed_step:
            fault = fault_of(adaptive)
            assert "a scheme that chooses its own steps" in fault.rule
        else:
            spring(adaptive, samples="all")


def test_a_running_maximum_is_of_a_deviation() -> None:
    for quantity in ("energy_deviation", "energy_deviation_d2t"):
        spring({"value": "running_max", "quantity": quantity, "below": 1, "at": {"t": 20}})
    fault = fault_of({"value": "running_max", "quantity": "u", "below": 1})
    assert fault.hint == "choose from energy_deviation, energy_deviation_d2t"


def test_a_member_alone_keeps_the_checks_that_concern_it() -> None:
    rows = [STABLE, CONSERVES, EQUAL]
    checks = [
        {"id": f"c{i}_{case}", **row, "case": case} for i, row in enumerate(rows) for case in (0, 1)
    ]
    one = spring(*checks, sweep={"model.w": [1, 2]}).alone(1)
    assert [check.id for check in one.checks] == ["c0_1", "c1_1", "c2_1"]
    assert [check.case for check in one.checks] == [None] * 3
    assert one.checks == spring(*({"id": f"c{i}_1", **row} for i, row in enumerate(rows))).checks


def test_every_kind_of_check_says_what_it_is_about() -> None:
    checks = spring(
        STABLE, CONSERVES, EQUAL, {"conserves": "energy_d2t"}, {"converges": "u"}
    ).checks
    about = [None, "energy_deviation", "v", "energy_deviation_d2t", "u"]
    assert [check.measured.about for check in checks] == about
