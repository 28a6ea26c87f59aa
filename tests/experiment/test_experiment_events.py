"""The option `events`, and what is refused where a motion is not smooth."""

from __future__ import annotations

from typing import Any

import pytest
from experiment_files import build, only_fault

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
