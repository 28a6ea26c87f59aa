"""Which settings differ, in the words of an experiment file."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st

from vibsim.cli.setting_changes import Change, differences
from vibsim.experiment import Experiment, canonical
from vibsim.experiment.solver_reading import from_file
from vibsim.plan.digests import analysed

CONTENT: dict[str, Any] = {
    "title": "one",
    "model": {"kind": "oscillator", "m": 2.0, "damping": {"linear": 0.3}, "spring": "u"},
    "initial": {"u": 1.0},
    "time": {"end": 5.0},
    "levels": [4, 5, 6],
    "schemes": ["central", {"kind": "newmark", "label": "trapezoidal"}],
    "checks": [{"id": "order", "converges": "u", "order": 2}],
    "sweep": {"model.m": [1.0, 2.0]},
}


def normal(**more: Any) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(
        json.dumps(canonical(Experiment.from_dict({**CONTENT, **more})))
    )
    return found


def test_settings_of_a_solver_have_the_names_of_its_file(tmp_path: Path) -> None:
    def content(levels: list[int], kappa: list[int]) -> dict[str, Any]:
        file = tmp_path / "heat.yaml"
        file.write_text(
            "title: heat\nsolver: {command: 'heat {h} {kappa} {output}'}\nquantities: {T: {}}\n"
            f"refine: {{levels: {levels}, h: 1/2**level}}\nsweep: {{kappa: {kappa}}}\n"
        )
        return analysed(from_file(file).content)

    changes = differences(content([1, 2, 3], [1, 2]), content([1, 2, 4], [1, 3]))
    assert list(map(str, changes)) == [
        "sweep.kappa: [1.0, 2.0] -> [1.0, 3.0]",
        "refine.levels: 1 to 3 -> 1, 2, 4",
        "refine.h: [0.5, 0.25, 0.125] -> [0.5, 0.25, 0.0625]",
    ]


@pytest.mark.parametrize(
    ("more", "told"),
    [
        ({}, []),
        ({"levels": [5, 6, 7]}, ["levels: 4 to 6 -> 5 to 7"]),
        ({"levels": [4, 6, 8]}, ["levels: 4 to 6 -> 4, 6, 8"]),
        ({"time": {"end": 6.0}}, ["time.end: 5.0 -> 6.0"]),
        (
            {"model": {**CONTENT["model"], "damping": {"linear": 0.5}}},
            ["model.damping.linear: 0.3 -> 0.5"],
        ),
        ({"model": {**CONTENT["model"], "spring": "u + u**3"}}, ["model.spring: u -> u + u**3"]),
        (
            {"schemes": [{"kind": "central", "start": "first_order"}, CONTENT["schemes"][1]]},
            ["schemes.central.start: centred -> first_order"],
        ),
        ({"schemes": ["central"]}, ["schemes.trapezoidal: removed"]),
        (
            {"checks": [*CONTENT["checks"], {"id": "more", "converges": "v", "order": 2}]},
            ["checks.more: added"],
        ),
        (
            {"checks": [{"id": "order", "converges": "u", "order": 1}]},
            ["checks.order.order: 2.0 -> 1.0"],
        ),
        (
            {"checks": [{"id": "order", "value": "end", "quantity": "u", "below": 2}]},
            ["checks.order.kind: converges -> value"],
        ),
        ({"sweep": {"model.m": [1.0, 3.0]}}, ["sweep.model.m: [1.0, 2.0] -> [1.0, 3.0]"]),
    ],
)
def test_a_changed_setting_has_its_name_in_the_file(more: dict[str, Any], told: list[str]) -> None:
    assert list(map(str, differences(normal(), normal(**more)))) == told


def test_a_long_value_is_not_shown_and_none_obeyed() -> None:
    assert str(Change("model.road", "a" * 64, "b")) == "model.road: changed"
    (found,) = differences({"title": "a"}, {"title": "\033[2J"})
    assert "\033" not in str(found)


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(max_size=3),
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(
            st.sampled_from(
                ["model", "kind", "tables", "schemes", "name", "id", "sweep", "keys", "values"]
            ),
            inner,
            max_size=3,
        )
    ),
    max_leaves=12,
)


@pytest.mark.slow
@hypothesis_settings(max_examples=100, deadline=None)
@given(st.dictionaries(st.sampled_from(["model", "schemes", "checks", "sweep"]), JSON), JSON)
def test_content_of_any_form_is_compared(old: dict[str, Any], new: Any) -> None:
    """A results folder may come from somebody else."""
    wanted = new if isinstance(new, dict) else {"model": new}
    for change in differences(old, wanted):
        assert str(change)
    assert differences(old, old) == []
