"""The command line: what it prints and how it ends."""

from __future__ import annotations

import json
from pathlib import Path

import jsonschema
import pytest

import vibsim as package
from vibsim import analyse, simulate

from .conftest import Runs
from .door import FORMAT, ROOT, build, strict_json, vibsim

PUBLIC = {
    "Experiment",
    "InputError",
    "Verdict",
    "VibsimError",
    "__version__",
    "analyse",
    "best",
    "judge",
    "simulate",
    "verdicts",
}

CHECKS = {"converges", "claim", "stable", "conserves", "equal", "value"}
NAMES = """
    end at min max max_abs max_abs_interior max_abs_ratio max_abs_interior_ratio running_max
    relative_running_max period period_grid exact_period period_error frequency error_of_frequency
    predicted_frequency phase_error_per_period predicted_phase_error phase_error_slope amplitude
    amplitude_error growth_factor growth_per_period predicted_growth_per_period
    relative_energy_error relative_energy_error_d2t event_count first_event_time last_event_time
    rest_time accepted_steps force_evaluations stability_limit exact_degree error_l1 error_l2
    error_linf error_linf_interior error_rate second_difference_fraction discrete_error
    error_estimate_defect observed_order ratio coincidence richardson_error
"""
VALUES = set(NAMES.split())


def test_the_package_has_its_public_names() -> None:
    assert set(package.__all__) >= PUBLIC
    for name in PUBLIC:
        assert getattr(package, name) is not None


def test_a_run_ends_with_0_where_everything_passes_and_with_1_where_it_does_not(
    runs: Runs,
) -> None:
    assert runs.exit_code("passing") == 0
    assert runs.exit_code("mixed") == 1


def test_a_run_prints_its_outcome_as_json(runs: Runs) -> None:
    for name, status in (("passing", "PASS"), ("mixed", "FAIL")):
        printed = strict_json(runs.printed(name))
        assert printed["vibsim_format"] == FORMAT
        assert printed["status"] == status
        for one in printed["experiments"]:
            stored = runs.folder / name / "adhoc" / one["experiment"] / "summary.json"
            assert strict_json(stored.read_text())["checks"] == one["checks"]


def test_what_is_printed_as_json_has_a_published_schema(runs: Runs, tmp_path: Path) -> None:
    schema = {
        name: json.loads((ROOT / f"workflow/schemas/{name}.schema.json").read_text())
        for name in ("run", "plan")
    }
    for name in ("passing", "mixed"):
        jsonschema.validate(strict_json(runs.printed(name)), schema["run"])
    dry = vibsim("run", runs.file("swept"), "--results", tmp_path / "new", "--dry-run", "--json")
    jobs = strict_json(dry.stdout)
    assert jobs["jobs"]
    jsonschema.validate(jobs, schema["run"])
    planned = vibsim("plan", "--json", runs.file("swept"), runs.file("tiny"))
    jsonschema.validate(strict_json(planned.stdout), schema["plan"])
    for content, name in ((jobs, "run"), (strict_json(runs.printed("mixed")), "run")):
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate({**content, "unknown": 1}, schema[name])


def test_a_second_run_makes_nothing_again(runs: Runs, tmp_path: Path) -> None:
    made = {
        path: (path.stat().st_mtime_ns, path.stat().st_ino)
        for path in (runs.passing / "adhoc").rglob("*")
        if path.is_file() and path.suffix in {".nc", ".json", ".html", ".svg", ".csv"}
    }
    runs.run("passing", 2, "tiny")
    assert runs.exit_code("passing") == 0
    for path, before in made.items():
        assert (path.stat().st_mtime_ns, path.stat().st_ino) == before, path


def test_a_dry_run_writes_nothing(runs: Runs, tmp_path: Path) -> None:
    new = tmp_path / "new"
    ended = vibsim("run", runs.file("tiny"), "--results", new, "--dry-run", cwd=tmp_path)
    assert ended.returncode == 0
    for level in (6, 7, 8):
        assert f"level_0{level}.nc" in ended.stdout
    assert not new.exists()


def test_the_list_of_checks_names_every_kind_and_every_value() -> None:
    lines = vibsim("list", "checks").stdout.splitlines()
    assert {line.split()[0] for line in lines if line and line[0] != " "} >= CHECKS
    assert {line.split()[0] for line in lines if line.startswith("  ")} >= VALUES


def test_a_plan_tells_steps_and_costs_before_anything_runs(runs: Runs, tmp_path: Path) -> None:
    ended = vibsim("plan", "--json", runs.file("swept"), "--results", tmp_path / "none")
    assert ended.returncode == 0
    (plan,) = strict_json(ended.stdout)
    assert [level["steps"] for level in plan["levels"]] == [64, 128, 256]
    assert plan["total"]["member_steps"] == 3 * (64 + 128 + 256)
    for name in ("bytes", "memory", "seconds", "jobs"):
        assert plan["total"][name] > 0
    assert not (tmp_path / "none").exists()


def test_levels_and_comparison_can_be_made_by_hand(runs: Runs, tmp_path: Path) -> None:
    results = ["--results", tmp_path]
    assert vibsim("simulate", runs.file("tiny"), "--level", 6, 7, 8, *results).returncode == 0
    assert vibsim("analyse", runs.file("tiny"), *results).returncode == 0
    for name in ("level_06.nc", "level_08.nc", "convergence.nc", "summary.json"):
        made = (tmp_path / "adhoc/tiny" / name).read_bytes()
        assert made == (runs.mixed / "adhoc/tiny" / name).read_bytes(), name


@pytest.mark.parametrize(
    "arguments",
    [[], ["fly"], ["list", "planets"], ["run", "--cores", "0"], ["run", "no_such_experiment"]],
    ids=str,
)
def test_a_wrong_command_line_ends_with_2(arguments: list[str]) -> None:
    ended = vibsim(*arguments)
    assert ended.returncode == 2
    assert ended.stderr
    assert "Traceback" not in ended.stderr


def test_two_files_of_one_name_are_refused(runs: Runs, tmp_path: Path) -> None:
    other = tmp_path / "tiny.yaml"
    other.write_text(runs.file("tiny").read_text())
    ended = vibsim("run", runs.file("tiny"), other, "--results", tmp_path / "results")
    assert ended.returncode == 2
    assert str(other) in ended.stderr
    assert str(runs.file("tiny")) in ended.stderr


def test_a_level_that_the_experiment_has_not_is_refused(runs: Runs, tmp_path: Path) -> None:
    out = tmp_path / "out.nc"
    ended = vibsim("simulate", runs.file("tiny"), "--level", 3, "--out", out)
    assert ended.returncode == 2
    assert not out.exists()
    with pytest.raises(ValueError, match="3"):
        simulate(build({**CONTENT, "levels": [4, 5]}), 3)


CONTENT = {
    "model": {"kind": "spring"},
    "initial": {"u": 1.0},
    "time": {"end": 1.0},
    "levels": [4, 5],
    "schemes": ["central"],
}


def test_levels_of_another_problem_are_refused() -> None:
    one, other = build(CONTENT), build({**CONTENT, "model": {"kind": "spring", "w": 2.0}})
    with pytest.raises(package.VibsimError):
        analyse(one, [simulate(one, 4), simulate(other, 5)])
