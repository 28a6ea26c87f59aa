from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from vibsim.plan import Choice, Plan, load
from vibsim.plan.jobs import from_json, to_json

from .conftest import TEXT

Plans = Callable[..., Plan]


def digests(plan: Plan) -> tuple[dict[int, str], str, str]:
    return (
        {level.level: level.shards[0].digest for level in plan.levels},
        plan.analysis,
        plan.report,
    )


NOTHING = {
    "comment": ("title:", "# a comment\ntitle:"),
    "spelling": ("end: 20.0", "end: 2.0e+1"),
    "whole": ("g: 1.0", "g: 1"),
    "order": ("theta: 1.0, omega: 0.0", "omega: 0.0, theta: 1.0"),
    "default": (", omega: 0.0", ""),
    "ladder": ("levels: [5, 6, 7]", "levels: {from: 5, to: 7}"),
    "formula": ("end: 20.0", "end: 4*5"),
    "unit": ("end: 20.0", "end: 20e3 ms"),
}


@pytest.mark.parametrize("change", NOTHING.values(), ids=NOTHING)
def test_writing_the_same_otherwise_changes_nothing(
    plan_of: Plans, change: tuple[str, str]
) -> None:
    assert digests(plan_of(change)) == digests(plan_of())


@pytest.mark.parametrize("change", [("A tiny", "Another"), ("nowhere", "somewhere")])
def test_title_and_source_change_the_report_alone(plan_of: Plans, change: tuple[str, str]) -> None:
    levels, analysis, report = digests(plan_of())
    changed = digests(plan_of(change))
    assert changed[:2] == (levels, analysis)
    assert changed[2] != report


def test_a_check_changes_the_analysis_and_the_report(plan_of: Plans) -> None:
    levels, analysis, report = digests(plan_of())
    changed = digests(plan_of(("order: scheme", "order: 2")))
    assert changed[0] == levels
    assert changed[1] != analysis
    assert changed[2] != report


@pytest.mark.parametrize("levels", ["[5, 6, 7, 8]", "[5, 6, 7, 9, 10]", "[5, 6]"])
def test_other_levels_leave_the_old_ones_alone(plan_of: Plans, levels: str) -> None:
    old, analysis, _ = digests(plan_of())
    new, changed, _ = digests(plan_of(("[5, 6, 7]", levels)))
    assert all(old[level] == digest for level, digest in new.items() if level in old)
    assert changed != analysis


def test_a_coarser_level_matters_only_where_it_changes_the_samples(plan_of: Plans) -> None:
    old, _, _ = digests(plan_of())
    new, _, _ = digests(plan_of(("[5, 6, 7]", "[4, 5, 6, 7]")))
    assert {level: new[level] for level in old} == old
    common = ("schemes:", "samples: common\nschemes:")
    old, _, _ = digests(plan_of(common))
    new, _, _ = digests(plan_of(common, ("[5, 6, 7]", "[4, 5, 6, 7]")))
    assert not {new[level] for level in old} & set(old.values())


SIMULATION = {
    "parameter": ("g: 1.0", "g: 1.0000000000000002"),
    "other parameter": ("L: 1.0", "L: 2.0"),
    "model": ("kind: pendulum", "kind: linear_pendulum"),
    "initial": ("theta: 1.0", "theta: 1.1"),
    "time": ("end: 20.0", "end: 21.0"),
    "scheme option": ("[central]", "[{kind: central, start: first_order}]"),
    "scheme name": ("[central]", "[{kind: central, label: mine}]"),
    "sweep": ("schemes:", "sweep: {model.m: [1.0, 2.0]}\nschemes:"),
}


@pytest.mark.parametrize("change", SIMULATION.values(), ids=SIMULATION)
def test_what_a_simulation_uses_changes_every_level(
    plan_of: Plans, change: tuple[str, str]
) -> None:
    old, analysis, _ = digests(plan_of())
    new, changed, _ = digests(plan_of(change))
    assert not set(old.values()) & set(new.values())
    assert changed != analysis


def test_another_version_of_a_library_changes_every_level(
    plan_of: Callable[..., Plan], monkeypatch: pytest.MonkeyPatch
) -> None:
    before = {shard.digest for shard in plan_of().shards}
    monkeypatch.setattr("vibsim.plan.versions._installed", lambda: {"numpy": "0.1"})
    assert before.isdisjoint(shard.digest for shard in plan_of().shards)


def test_no_two_jobs_share_a_digest(plan_of: Plans) -> None:
    plans = [plan_of(), plan_of(name="other")]
    found = [d for p in plans for d in (*digests(p)[0].values(), p.analysis, p.report)]
    assert len(set(found)) == len(found)


def test_the_place_of_the_file_is_no_part_of_the_digests(plan_of: Plans, tmp_path: Path) -> None:
    here = plan_of()
    there = tmp_path / "there" / "tiny.yaml"
    there.parent.mkdir()
    there.write_bytes(Path(here.file).read_bytes())
    assert digests(load(Choice("adhoc", there))) == digests(here)


def test_paths_follow_the_contract(plan_of: Plans) -> None:
    assert [s.path for s in plan_of().shards] == [f"adhoc/tiny/level_0{n}.nc" for n in (5, 6, 7)]
    swept = plan_of(("schemes:", "sweep: {initial.theta: [0.5, 1.0]}\nschemes:"))
    assert swept.cases == 2
    assert swept.shards[0].path == "adhoc/tiny/level_05/shard_0000.nc"
    assert [(s.start, s.stop) for s in swept.shards] == [(0, 2)] * 3


def test_a_setting_has_the_levels_of_an_edit_and_results_that_tell_of_it(
    plan_of: Plans,
) -> None:
    plain, other = plan_of(), plan_of(("g: 1.0", "g: 1.5"))
    file = Path(plan_of().file)
    given = load(Choice("adhoc", file, settings=("model.g=1.5",)), cached=True)
    assert digests(given)[0] == digests(other)[0] != digests(plain)[0]
    assert given.content == other.content
    assert (given.analysis, given.report) != (other.analysis, other.report)
    assert given.experiment.settings == given.settings == ("model.g=1.5",)
    # a plan that is kept is one of its settings
    assert load(Choice("adhoc", file), cached=True) == plain
    assert load(Choice("adhoc", file, settings=("model.g=1.5",)), cached=True) == given
    assert from_json(to_json(given), given.file, given.key) == given


def test_a_plan_survives_json(plan_of: Plans) -> None:
    plan = plan_of(("schemes:", "sweep: {initial.theta: [0.5, 1.0]}\nschemes:"))
    text = to_json(plan)
    assert from_json(text, plan.file, plan.key) == plan
    assert json.loads(text)["file"] == ""


def at(*keys: str | int) -> Callable[[Any, Any], None]:
    """Return what changes the value at a place of a plan."""

    def change(data: Any, value: Any) -> None:
        for key in keys[:-1]:
            data = data[key]
        data[keys[-1]] = value

    return change


SHELL = "; touch X; true"
SHARD = ("levels", 1, "shards", 1)
FOREIGN = [
    (("name",), "../tiny"),
    (("collection",), "other"),
    (("analysis",), SHELL),
    (("report",), "0" * 63),
    (("extrapolation",), "0" * 64 + "\n"),
    (("batches", 0, "digest"), "A" * 64),
    ((*SHARD, "digest"), SHELL),
    ((*SHARD, "path"), "adhoc/tiny/../../level_12/shard_0001.nc"),
    ((*SHARD, "path"), "/tmp/shard_0001.nc"),
    ((*SHARD, "path"), "adhoc/tiny/level_12/shard_0000.nc"),
    ((*SHARD, "index"), 0),
    (("levels", 1, "level"), "6"),
    (("levels", 1, "level"), True),
    (("levels", 1, "memory"), 1.5),
    (("levels",), {}),
    (("batches", 0, "levels"), [12, SHELL]),
    (("batches", 0, "levels"), [12, 66]),
    (("batches", 0, "shard"), SHELL),
    (("batches", 0, "shard"), -1),
    (("batches", 0, "shard"), 10**6),
    (("batches", 0, "seconds"), "1"),
    (("batches", 0, "is_divisible"), 1),
    (("batches", 0, "more"), 1),
    (("inputs",), [["a", "b", "c"]]),
    (("inputs",), [["a", 1]]),
    (("versions", "numpy"), 1),
    (("content",), []),
    (("title",), None),
    (("cases",), None),
    (("more",), 1),
]


@pytest.mark.parametrize(("place", "value"), FOREIGN)
def test_what_is_no_plan_of_the_experiment_is_refused(
    plan_of: Plans, place: tuple[str | int, ...], value: Any
) -> None:
    sweep = "sweep: {initial.theta: {linspace: [0.5, 1.0, 1000000]}}\nschemes:"
    plan = plan_of(("schemes:", sweep), ("levels: [5, 6, 7]", "levels: [5, 12]"))
    assert from_json(to_json(plan), plan.file, plan.key) == plan
    data = json.loads(to_json(plan))
    at(*place)(data, value)
    with pytest.raises(ValueError, match=r"tiny|type|list|mapping|fields"):
        from_json(json.dumps(data), plan.file, plan.key)


def test_a_tolerance_changes_what_depends_on_it(tmp_path: Path) -> None:
    def plan(*changes: tuple[str, str]) -> Plan:
        text = TEXT.replace("levels: [5, 6, 7]", "tolerance: 1e-5\noutput: best")
        for old, new in changes:
            assert old in text
            text = text.replace(old, new)
        file = tmp_path / "tiny.yaml"
        file.write_text(text)
        return load(Choice("adhoc", file), resolve=lambda e: e.with_levels((5, 6, 7)))

    first = plan()
    other = plan(("1e-5", "1e-6"))
    assert digests(other)[0] == digests(first)[0]
    assert other.extrapolation != first.extrapolation
    assert other.analysis != first.analysis
    for told in (
        ("A tiny", "Another"),
        ("source: nowhere", "source: b"),
        ("order: scheme", "order: 2"),
    ):
        assert plan(told).extrapolation == first.extrapolation
    assert plan(("theta: 1.0", "theta: 1.1")).extrapolation != first.extrapolation


def test_the_experiment_of_a_plan_knows_its_file_and_its_word(
    plan_of: Plans, tmp_path: Path
) -> None:
    plan = plan_of(("schemes:", "sweep: {initial.theta: [0.5, 1.0]}\nschemes:"))
    assert plan.experiment.word == "tiny.yaml", "no path of a machine"
    alone = load(Choice("adhoc", Path(plan.file), 1))
    assert alone.experiment.file == Path(plan.file)
    assert alone.experiment.word == "tiny.yaml@1"
    other = Path(plan.file).rename(tmp_path / "tiny.yml")
    assert load(Choice("adhoc", other)).experiment.word == "tiny.yml"
    other.rename(plan.file)
    assert load(Choice("lab", Path(plan.file))).experiment.word == "lab/tiny"
    assert load(Choice("lab", Path(plan.file), 1)).experiment.word == "lab/tiny@1"
    assert replace(plan, file="").experiment.word == "tiny.yaml"


def test_the_experiment_comes_back_without_its_file(plan_of: Plans) -> None:
    from vibsim.experiment import Experiment

    claim = (
        "  - {claim: c, source: s, that: {value: end, quantity: theta, below: 2}, holds: true}\n"
    )
    plan = plan_of(
        ("checks:\n", "checks:\n" + claim),
        ("schemes:", "sweep: {initial.theta: [0.5, 1.0]}\nschemes:"),
    )
    expected = Experiment.from_yaml(plan.file, collection="adhoc")
    Path(plan.file).unlink()
    assert replace(plan).experiment == expected


@pytest.mark.parametrize(
    ("change", "touched"),
    [
        (("[0.4, 0.2, 0.1]", "[0.4, 0.3, 0.1]"), {(1, 0), (1, 1)}),
        (("[1, 2]", "[1, 3]"), {(0, 1), (1, 1), (2, 1)}),
        (("[x]", "[y]"), {(level, member) for level in range(3) for member in range(2)}),
        (("order: 2", "order: 1"), set()),
    ],
)
def test_a_function_that_solves_runs_again_where_its_arguments_change(
    tmp_path: Path, change: tuple[str, str], touched: set[tuple[int, int]]
) -> None:
    (tmp_path / "my_solver.py").write_text("def solve(h, a): ...\n")
    text = (
        "title: t\nsolver: {python: 'my_solver:solve'}\nrefine: {h: [0.4, 0.2, 0.1]}\nsweep: {a: [1, 2]}\n"
        "quantities: {u: {coordinates: [x]}}\nchecks: [{converges: u, order: 2}]\n"
    )
    file = tmp_path / "own.yaml"

    def levels(text: str) -> dict[tuple[int, int], str]:
        file.write_text(text)
        plan = load(Choice("adhoc", file))
        return {(row.level, job.index): job.digest for row in plan.levels for job in row.shards}

    before, after = levels(text), levels(text.replace(*change))
    assert {key for key in before if before[key] != after[key]} == touched
