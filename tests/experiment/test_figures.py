"""Figures of a source in an experiment file: read, refused with a place, and no part of a simulation or an analysis."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
import yaml

from vibsim.core.errors import InputError
from vibsim.experiment import Experiment
from vibsim.experiment.experiment import canonical, restore
from vibsim.experiment.schema.figures import KINDS, OVER_TIME
from vibsim.plan.build import build as build_plan

SERIES = {"source": "a text, figure 1", "shows": "over_time"}


def build(*figures: Any, **changes: Any) -> Experiment:
    content = {
        "title": "Figures",
        "model": {"kind": "spring", "w": 1.0},
        "initial": {"u": 1.0},
        "time": {"end": 4.0},
        "levels": [5, 6, 7],
        "schemes": ["central"],
        "figures": list(figures),
    }
    return Experiment.from_dict(content | changes, name="figures", collection="tests")


SWEEP = {"sweep": {"model.w": [1.0, 2.0], "initial.u": [1.0, 2.0]}}


def test_the_normal_form_keeps_the_figures_and_has_none_without() -> None:
    full = SERIES | {"quantities": ["u", "energy"], "until": "pi", "beside": {"a": "w*t"}}
    experiment = build(full)
    assert restore(json.loads(json.dumps(canonical(experiment)))) == experiment
    assert hash(experiment) != hash(build())
    assert "figures" not in canonical(build())


def test_figures_are_no_part_of_a_simulation_or_an_analysis() -> None:
    plain, other = (build_plan(build(*rows, output="best")) for rows in ((), (SERIES,)))
    for name in ("analysis", "extrapolation"):
        assert getattr(plain, name) == getattr(other, name)
    assert [shard.digest for shard in plain.shards] == [shard.digest for shard in other.shards]
    assert plain.report != other.report


def test_a_member_alone_is_not_divided_by_members() -> None:
    asked = [SERIES | {"panels": "model.w", "each": "initial.u"}, SERIES | {"panels": "level"}]
    first, second = build(*asked, **SWEEP).alone(1).figures
    assert (first.panels, first.each, second.panels) == (None, None, "level")


@pytest.mark.parametrize(
    ("figure", "changes", "key", "rule", "hint"),
    [
        ({"source": "a", "shows": "over_tim"}, {}, "[0].shows", "", "over_time"),
        ({"shows": "path"}, {}, "[0].source", "is missing", ""),
        (SERIES | {"quantities": ["v", "energi"]}, {}, "[0].quantities[1]", "unknown quantity", "energy"),
        (SERIES | {"panels": "levels"}, {}, "[0].panels", "unknown part", "level"),
        (SERIES | {"panels": "member"}, {}, "[0].panels", "unknown part", "level"),
        (SERIES | {"each": "model.w"}, {}, "[0].each", "unknown part", "there is no sweep"),
        (SERIES | {"each": "model.W"}, SWEEP, "[0].each", "unknown part", "model.w"),
        (SERIES | {"panels": "level", "quantities": ["u", "v"]}, {}, "[0].panels", "left out", ""),
        (SERIES | {"until": -1.0}, {}, "[0].until", "greater than 0", ""),
        (SERIES | {"beside": {"a": "wt"}}, {}, "[0].beside.a", "", "w"),
        ({"source": "a", "shows": "path", "until": 2.0}, {}, "[0].until", "belongs to", ""),
    ],
)  # fmt: skip
def test_what_an_experiment_has_not_is_refused(
    figure: Any, changes: Any, key: str, rule: str, hint: str
) -> None:
    with pytest.raises(InputError) as caught:
        build(figure, **changes)
    (fault,) = caught.value.faults
    assert fault.key == f"figures{key}"
    assert rule in fault.rule
    assert hint in fault.hint


def test_the_documentation_names_everything_that_a_figure_may_show() -> None:
    text = (Path(__file__).parents[2] / "docs/experiment-file.md").read_text(encoding="utf-8")
    section = text.partition("\n## figures\n")[2].partition("\n## ")[0]
    assert [name for name in (*KINDS, *OVER_TIME) if f"`{name}`" not in section] == []
    found = yaml.safe_load(section.partition("```yaml\n")[2].partition("```")[0])
    Experiment.from_dict({"title": "Figures"} | found, name="figures", collection="tests")
