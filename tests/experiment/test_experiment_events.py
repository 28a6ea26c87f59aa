"""The option `events`, and what is refused where a motion is not smooth."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from experiment_files import build, only_fault

from vibsim import analyse, simulate, verdicts
from vibsim.experiment import Experiment
from vibsim.models.events import Crossings
from vibsim.report.text.experiment_file import text
from vibsim.schemes import FIXED_STEP

BOX: dict[str, Any] = {"model": {"kind": "sliding_box"}, "initial": {"u": 1.0}}
BALL: dict[str, Any] = {"model": {"kind": "bouncing_ball"}, "initial": {"h": 1.0}}
FRICTION = {"kind": "oscillator", "damping": {"coulomb": 0.1}}


@pytest.mark.parametrize("kind", FIXED_STEP)
def test_every_scheme_with_equal_steps_locates_events_or_leaves_them_to_the_mesh(kind: str) -> None:
    schemes = [kind, {"kind": kind, "label": "trap", "events": "mesh"}]
    for model in (BOX["model"], BALL["model"], FRICTION):
        made = build(model=model, initial={}, schemes=schemes)
        assert [scheme.options["events"] for scheme in made.schemes] == ["located", "mesh"]
        assert not made.own_velocity


def test_smooth_models_have_no_such_option() -> None:
    assert "events" not in build(schemes=["rk4"]).schemes[0].options
    for model in ({"kind": "pendulum"}, {"kind": "oscillator", "damping": "0.1*sign(v)"}):
        scheme = {"kind": "rk4", "events": "mesh"}
        fault = only_fault(model=model, initial={}, schemes=[scheme])
        assert (fault.key, fault.value) == ("schemes[0].events", "mesh")
        assert "has no events here: its motion is smooth" in fault.rule
        assert "sliding_box, bouncing_ball" in fault.hint


def test_the_treatment_of_events_can_be_swept() -> None:
    sweep = {"schemes.rk4.events": ["located", "mesh"]}
    made = build(**BOX, schemes=["rk4"], sweep=sweep)
    assert [made.alone(case).schemes[0].options["events"] for case in (0, 1)] == ["located", "mesh"]
    fault = only_fault(schemes=["rk4"], sweep=sweep)
    assert fault.rule == "cannot be swept"
    fault = only_fault(**BOX, schemes=["rk4"], sweep={"schemes.rk4.events": ["grid"]})
    assert "located, mesh" in fault.hint


@pytest.mark.parametrize(
    ("changes", "key", "rule"),
    [
        (BOX | {"schemes": ["rk4", "dop853"]}, "schemes[1]", "its own steps across events"),
        (BOX | {"schemes": [{"kind": "rk4", "events": "grid"}]}, "schemes[0].events", "unknown"),
        (BALL | {"initial": {"h": -0.1}}, "initial.h", "must be at least 0"),
        (
            BALL | {"sweep": {"initial.h": [1.0, -1.0]}},
            "sweep.initial.h[1]",
            "must be at least 0",
        ),
        (
            BALL | {"model": {"kind": "bouncing_ball", "restitution": 1.1}},
            "model.restitution",
            "must be at most 1",
        ),
        (
            BALL | {"sweep": {"model.restitution": [0.5, 1.5]}},
            "sweep.model.restitution[1]",
            "must be at most 1",
        ),
        (BOX | {"model": {"kind": "sliding_box", "mu": -1}}, "model.mu", "must be at least 0"),
        (BOX | {"checks": [{"conserves": "energy"}]}, "checks[0]", "is not conserved"),
    ],
)
def test_one_fault(changes: dict[str, Any], key: str, rule: str) -> None:
    fault = only_fault(**{"schemes": ["rk4"], **changes})
    assert (fault.key, rule in fault.rule) == (key, True), fault


OWN: dict[str, Any] = {"kind": "oscillator", "parameters": {"gap": 0.5}}
STRUCK = OWN | {"events": [{"when": "u - gap", "rising": True, "then": {"v": "-0.8*v"}}]}


def with_event(**event: Any) -> dict[str, Any]:
    return {"model": OWN | {"events": [{"when": "u - gap", **event}]}}


def test_events_and_a_stop_are_read_and_written_back(tmp_path: Path) -> None:
    kicked = {"when": "sin(t)", "then": {"u": "u/2", "v": 1}}
    model = STRUCK | {"events": [*STRUCK["events"], kicked], "stop": "u < -2 or v > 9"}
    made = build(model=model, initial={}, schemes=["rk4"])
    rows = made.model.definition.events
    assert isinstance(rows, Crossings)
    assert [(row.direction, row.ends) for row in rows.rows] == [(1, False), (0, False), (-1, True)]
    assert "v -> -0.8*v where u - gap rises to 0" in made.model.definition.equation
    path = tmp_path / "again.yaml"
    path.write_text(text(made), encoding="utf-8")
    again = Experiment.from_yaml(path)
    assert again.model == made.model
    assert made.schemes[0].options["events"] == "located"


@pytest.mark.parametrize(
    ("changes", "key", "rule"),
    [
        (with_event(when="u - gapp"), "model.events[0].when", "unknown name 'gapp'"),
        (with_event(when="u > gap"), "model.events[0].when", "and no comparison"),
        (with_event(when="mod(t, 2) - 1"), "model.events[0].when", "must not jump, as mod does"),
        (with_event(when="u + abs(sign(v))"), "model.events[0].when", "must not jump, as sign"),
        (with_event(when="u*(v > 0)"), "model.events[0].when", "as a comparison by > does"),
        (with_event(when="gap"), "model.events[0].when", "never changes: it names neither t nor"),
        (with_event(when="gap**2 + abs(u)"), "model.events[0].when", "never crosses 0: it has one"),
        (with_event(when="cos(t) - 1"), "model.events[0].when", "or touches 0 and turns back"),
        (with_event(then={"w": "0"}), "model.events[0].then.w", "unknown state"),
        (with_event(then={"v": "-w"}), "model.events[0].then.v", "unknown name 'w'"),
        (with_event(falling=False), "model.events[0].falling", "the event would never happen"),
        (with_event(falling=False, rising=False), "model.events[0].falling", "would never happen"),
        (with_event(rising="yes"), "model.events[0].rising", "must be true or false"),
        ({"model": OWN | {"events": [{"then": {}}]}}, "model.events[0].when", "is missing"),
        ({"model": OWN | {"events": STRUCK["events"] * 9}}, "model.events", "more than 8 entries"),
        ({"model": OWN | {"stop": "u"}}, "model.stop", "must be a comparison"),
        ({"model": OWN | {"stop": "u == 0"}}, "model.stop", "must not compare by == or !="),
        ({"model": OWN | {"stop": "gap < 0"}}, "model.stop", "never changes"),
        ({"model": OWN | {"stop": "u > gap"}}, "model.stop", "already holds at the start"),
        ({"model": STRUCK | {"damping": {"coulomb": 0.1}}}, "model.damping.coulomb", "or a stop"),
        ({"model": STRUCK | {"exact": "sin(t)"}, "initial": {}}, "model.exact", "or a stop"),
        ({"model": STRUCK, "scaled": True}, "scaled", "its events are formulas in the units"),
        ({"model": STRUCK, "schemes": ["rk4", "dop853"]}, "schemes[1]", "its own steps across"),
    ],
)
def test_what_is_wrong_with_events_is_said(changes: dict[str, Any], key: str, rule: str) -> None:
    fault = only_fault(**{"initial": {"u": 1.0}, "schemes": ["rk4"], **changes})
    assert fault.key == key
    assert rule in f"{fault.rule}: {fault.hint}"


PLANE: dict[str, Any] = {
    "kind": "system",
    "coordinates": ["x", "y"],
    "acceleration": {"x": "-x", "y": "-y"},
}


def test_events_of_a_system_are_read_and_written_back(tmp_path: Path) -> None:
    struck = {"when": "y - x", "falling": True, "then": {"vx": "vy", "vy": "vx"}}
    model = PLANE | {"events": [struck], "stop": "x > 2 and vy > 2"}
    made = build(model=model, initial={"x": -1.0, "y": 1.0}, schemes=["rk4"])
    equation = made.model.definition.equation
    assert "vx -> vy, vy -> vx where y - x falls to 0, end where x > 2 and vy > 2" in equation
    path = tmp_path / "again.yaml"
    path.write_text(text(made), encoding="utf-8")
    assert Experiment.from_yaml(path).model == made.model


@pytest.mark.parametrize(
    ("changes", "key", "rule"),
    [
        ({"stop": "z < 0"}, "model.stop", "unknown name 'z'"),
        ({"stop": "x < 2"}, "model.stop", "already holds at the start"),
        ({"events": [{"when": "u"}]}, "model.events[0].when", "unknown name 'u'"),
        ({"events": [{"when": "1"}]}, "model.events[0].when", "names neither t nor a state"),
        ({"events": [{"when": "x", "then": {"v": 1}}]}, "model.events[0].then.v", "unknown state"),
        ({"stop": "y < 0", "exact": {"x": "sin(t)", "y": "1"}}, "model.exact", "or a stop"),
    ],
)
def test_what_is_wrong_with_events_of_a_system_is_said(
    changes: dict[str, Any], key: str, rule: str
) -> None:
    fault = only_fault(model=PLANE | changes, initial={}, schemes=["rk4"])
    assert fault.key == key
    assert rule in f"{fault.rule}: {fault.hint}"


@pytest.mark.parametrize(
    ("check", "key", "rule"),
    [
        ({"value": "event_time"}, "checks[0].at", "needs the number of an event"),
        ({"value": "event_time", "at": {"event": 0}}, "checks[0].at.event", "at least 1"),
        ({"value": "event_time", "at": {"event": 513}}, "checks[0].at.event", "at most 512"),
        ({"value": "event_time", "at": {"event": 1.5}}, "checks[0].at.event", "whole number"),
        ({"value": "rest_time", "at": {"event": 1}}, "checks[0].at.event", "takes no event"),
    ],
)
def test_the_number_of_an_event_is_checked(check: dict[str, Any], key: str, rule: str) -> None:
    fault = only_fault(**BOX, schemes=["rk4"], checks=[check | {"below": 1.0}])
    assert fault.key == key
    assert rule in fault.rule, fault


def test_a_stop_that_holds_at_the_start_of_one_member_names_it() -> None:
    sweep = {"initial.u": [-1.0, -0.2, 0.4]}
    fault = only_fault(model=OWN | {"stop": "u + gap > 0"}, initial={}, sweep=sweep)
    assert fault.key == "model.stop"
    assert "where initial.u = -0.2" in fault.rule
    # on the border the motion may go in, or not
    for v, is_refused in ((-1.0, True), (1.0, False)):
        changes: dict[str, Any] = {"model": OWN | {"stop": "u < 0"}, "initial": {"v": v}}
        if is_refused:
            assert only_fault(**changes).key == "model.stop"
        else:
            build(**changes)


def test_a_faulty_event_beside_the_model_has_one_fault() -> None:
    """The equation was made of it all the same, with a second fault at a key that no file has."""
    model = {"kind": "system", "acceleration": "-u"}
    fault = only_fault(model=model, initial={}, schemes=["rk4"], events=[{"when": "3 mm"}])
    assert fault.key == "events[0].when"


@pytest.mark.parametrize(
    "model",
    [
        {"kind": "oscillator", "spring": "u"},
        {"kind": "system", "coordinates": ["u", "z"], "acceleration": {"u": "-u", "z": "-2*z"}},
    ],
)
def test_the_energy_of_a_motion_with_counted_events_is_conserved(model):
    counted = {**model, "events": [{"when": "u"}]}
    content = {"title": "x", "initial": {"u": 1.0}, "time": {"end": 30.0, "base_steps": 300}}
    rest = {"levels": [0, 1, 2], "schemes": ["velocity_verlet"]}
    experiment = Experiment.from_dict(
        {
            **{**content, **rest, "model": counted},
            "checks": [
                {"conserves": "energy", "drift": "bounded"},
                {"converges": "energy_deviation", "order": "scheme"},
                {"equal": ["velocity_verlet", "exact"], "quantity": "u", "atol": 0.01},
                {"value": "event_count", "equals": 10},
            ],
        }
    )
    data = [simulate(experiment, level) for level in experiment.levels]
    assert [row.status for row in verdicts(experiment, analyse(experiment, data))] == ["PASS"] * 4
