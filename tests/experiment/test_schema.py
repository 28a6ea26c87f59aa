"""The JSON Schema that editors use says what the loader does."""

from __future__ import annotations

import runpy
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from experiment_files import build, content, faults_of
from jsonschema import Draft202012Validator
from pydantic import TypeAdapter, ValidationError
from test_experiment import EXAMPLE
from test_experiment_faults import CASES

from vibsim.experiment.schema.document import schema
from vibsim.experiment.schema.fields import Section, by_form
from vibsim.experiment.yaml.parse import parse
from vibsim.models import MODELS
from vibsim.schemes import SCHEMES

ROOT = Path(__file__).resolve().parents[2]
main = runpy.run_path(str(ROOT / "workflow" / "schemas.py"))["main"]


@cache
def validator() -> Draft202012Validator:
    return Draft202012Validator(schema())


def test_kept_schemas_are_current() -> None:
    assert main(["--check"]) == 0


def test_check_tells_whether_they_are_current(tmp_path: Path) -> None:
    assert main(["--check"], tmp_path) == 1
    assert main([], tmp_path) == 0
    assert main(["--check"], tmp_path) == 0
    (tmp_path / "summary.schema.json").write_text("{}")
    assert main(["--check"], tmp_path) == 1


def test_schema_is_a_schema() -> None:
    Draft202012Validator.check_schema(schema())


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"levels": [6, 7]},
        {"schemes": ["central", {"kind": "central", "label": "x", "start": "first_order"}]},
        {"time": {"periods": 3, "steps_per_period": 8}},
        {"time": {"end": "2*pi", "base_dt": "pi"}},
        {"sweep": {"model.g": [1, "2*pi"], "model.L": {"linspace": [1, 2, 3]}}},
        {"sweep": {"model.g": {"logspace": ["pi/2", 2, 3]}, "model.L": {"range": [1, 2, 0.1]}}},
        {"sweep": {"zip": {"model.g": [1, 2], "schemes.central.start": ["centred", "centred"]}}},
        {"sweep": {"schemes.central.start": ["first_order", "centred"]}},
        {"sweep": {"sample": {"method": "sobol", "n": 4, "seed": 1, "over": {"model.g": [1, 2]}}}},
        {"levels": None, "tolerance": "1e-10"},
        {"units": {"rod": "4.9 m", "score": 20}, "model": {"kind": "pendulum", "L": "1 rod"}},
        {"initial": {"theta": "30 deg"}, "time": {"end": "2 min", "base_dt": "1 s"}},
        {"sweep": {"model.L": ["1 m", 2], "model.g": {"linspace": ["1 m/s^2", 2, 3]}}},
        {"scaled": True},
        {"output": "best"},
        {"samples": {"every": 2}},
        {"checks": [{"value": "error_l2", "quantity": "theta", "below": 1, "at": {"best": True}}]},
    ],
)
def test_accepts_what_the_loader_accepts(changes: dict[str, Any]) -> None:
    validator().validate(content(**changes))
    build(**changes)


@pytest.mark.parametrize(
    "changes",
    [
        {"levels": None},
        {"tolerance": 1e-10},
        {"sweep": {"schemes.central.start": ["late"]}},
        {"sweep": {"sample": {"method": "sobol", "n": 4, "over": {"model.g": [1, 2]}}}},
        {"sweep": {"sample": {"method": "sobol", "n": 4, "seed": -1, "over": {"model.g": [1, 2]}}}},
    ],
)
def test_refuses_what_the_loader_refuses(changes: dict[str, Any]) -> None:
    assert not validator().is_valid(content(**changes))
    faults_of(**changes)


LINE = {"x_i": {"acceleration": "x_(i+1) - x_i"}}


@pytest.mark.parametrize(
    ("repeat", "is_sound"),
    [
        ({"i": [1, 5]}, True),
        ({"n": 16, "i": LINE}, True),
        ({"n": 16, "i": {"x_i": {"force": "-x_i", "mass": 2}}}, True),
        ({"i": 5}, False),
        ({"i": [1, 2, 3]}, False),
        ({"n": 16}, False),
        ({"n": 16, "i": 5}, False),
        ({"n": 16, "i": LINE, "j": LINE}, False),
        ({"n": 16, "i": {"x_i": {"speed": 1}}}, False),
    ],
)
def test_repeats_are_indices_or_one_chain(repeat: dict[str, Any], is_sound: bool) -> None:
    coordinates = {} if "n" in repeat else {"coordinates": {"x_{i}": {"acceleration": "-x_{i}"}}}
    model = {"kind": "system", **coordinates, "repeat": repeat}
    changes = {"model": model, "initial": {"x_1": 1}, "checks": []}
    assert validator().is_valid(content(**changes)) == is_sound
    if is_sound:
        build(**changes)
    else:
        faults_of(**changes)


def test_accepts_the_first_example() -> None:
    validator().validate(parse(EXAMPLE.encode(), "example").data)


@pytest.mark.parametrize("collection", ["pendulum_lab", "showcase"])
def test_accepts_every_experiment_that_is_shipped(collection: str) -> None:
    for file in (ROOT / "configs" / collection).glob("*.yaml"):
        validator().validate(parse(file.read_bytes(), file.name).data)


def test_knows_the_states_of_models_and_not_those_of_systems() -> None:
    spring = content(model={"kind": "spring"}, initial={"u": 1})
    assert validator().is_valid(spring)
    assert not validator().is_valid(spring | {"initial": {"height": 1}})
    system = content(model={"kind": "system", "coordinates": ["height"]}, initial={"height": 1})
    assert validator().is_valid(system)
    assert not validator().is_valid(system | {"initial": {"height": [1]}})


BY_SHAPE = ("unknown key", "required key", "unknown choice", "must be a mapping", "must be a list")


def test_refuses_what_has_a_wrong_shape() -> None:
    for changes, _, rule, *_ in CASES:
        needs_model = rule == "required key is missing" and "checks" in changes
        if rule.startswith(BY_SHAPE) and not (needs_model and "value" in changes["checks"][0]):
            assert not validator().is_valid(content(**changes)), changes


def _properties(node: Any) -> list[tuple[str, dict[str, Any]]]:
    found: list[tuple[str, dict[str, Any]]] = []
    if isinstance(node, dict):
        found += list(node.get("properties", {}).items())
        # a condition describes nothing
        parts = (value for key, value in node.items() if key not in ("if", "then"))
        found += [row for value in parts for row in _properties(value)]
    elif isinstance(node, list):
        found += [row for value in node for row in _properties(value)]
    return found


def test_every_key_is_described() -> None:
    assert [name for name, row in _properties(schema()) if not row.get("description")] == []


def test_choices_follow_the_registries() -> None:
    kinds = {row["const"] for name, row in _properties(schema()) if name == "kind"}
    assert kinds == {*MODELS, *SCHEMES}
    sections = {d["properties"]["kind"]["const"]: d["properties"] for d in _of_kinds()}
    for kind, scheme in SCHEMES.items():
        defaults = {name: row.get("default") for name, row in sections[kind].items()}
        assert scheme.defaults().items() <= defaults.items()


class _Marked(Section):
    mode: int


FORMS = {
    "rows": tuple[tuple[int, ...], ...],
    "row": tuple[int, ...],
    "mapping": dict[str, int],
    "mode": _Marked,
    "other": str | int,
}


@pytest.mark.parametrize(
    ("written", "meant"),
    [
        ([[1], [2]], ((1,), (2,))),
        ([1, 2], (1, 2)),
        ([], ()),
        ({"a": 1}, {"a": 1}),
        ({"mode": 1}, _Marked(mode=1)),
        ("text", "text"),
        (3, 3),
    ],
)
def test_the_form_of_what_is_written_chooses_its_type(written: Any, meant: Any) -> None:
    assert TypeAdapter(by_form(FORMS)).validate_python(written) == meant


def test_a_form_without_a_type_is_refused() -> None:
    rows = {name: kind for name, kind in FORMS.items() if name in ("rows", "mapping")}
    for written in ([1], "text", 3):
        with pytest.raises(ValidationError, match="tag"):
            TypeAdapter(by_form(rows)).validate_python(written)


def _of_kinds() -> list[dict[str, Any]]:
    return [d for d in schema()["$defs"].values() if "kind" in d.get("properties", {})]
