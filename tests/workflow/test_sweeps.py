"""Sweeps through the workflow: shards, members added at the end, one member alone."""

from __future__ import annotations

import html
import json
import os
from pathlib import Path

import pytest
from forked import vibsim

from vibsim import store
from vibsim.analysis import analyse_records
from vibsim.experiment import Experiment
from vibsim.simulation import simulate_record

from .conftest import TEXT, Place

# One member at level 23 is 25 ms of work, so that a shard has 128 of them: with a stride that keeps 17 samples.
LARGE = TEXT.replace("levels: [6, 7, 8, 9]", "levels: [4, 5, 23]\nsamples: common")


def write(place: Place, sweep: str, text: str = TEXT) -> None:
    place.file.parent.mkdir(exist_ok=True)
    place.file.write_text(text.replace("time:", f"sweep: {{{sweep}}}\ntime:"))


@pytest.fixture
def empty(tmp_path: Path) -> Place:
    return Place(tmp_path)


@pytest.mark.slow
def test_shards_of_a_level_are_jobs_of_their_own(empty: Place) -> None:
    write(empty, "model.L: {linspace: [1, 2, 300]}", LARGE)
    shards = [f"level_23/shard_000{n}" for n in range(3)]
    cheap = ["level_04/shard_0000", "level_05/shard_0000"]
    assert sorted(empty.jobs()) == sorted([*cheap, *shards, "analyse", "report", "index"])


@pytest.fixture
def small_shards(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Make shards of at most four members in every process."""
    path = tmp_path / "small/sitecustomize.py"
    path.parent.mkdir()
    path.write_text("from vibsim.experiment import cost\ncost.LARGEST_SHARD = 4\n")
    paths = [str(path.parent), *filter(None, [os.environ.get("PYTHONPATH")])]
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(paths))
    # a fork of this process does not read it
    monkeypatch.setattr("vibsim.experiment.cost.LARGEST_SHARD", 4)


def shards(*numbers: int) -> set[str]:
    return {f"level_0{level}/shard_000{n}" for level in (6, 7, 8, 9) for n in numbers}


@pytest.mark.slow
def test_shards_are_made_by_jobs_of_several_levels_and_give_the_same_numbers(
    empty: Place, small_shards: None
) -> None:
    write(empty, "model.L: {range: [1, 6, 1]}")
    ended = empty.run()
    assert ended.returncode == 0, ended.stdout + ended.stderr
    assert "simulate adhoc/tiny level_06/shard_0001.nc to level_09/shard_0001.nc" in ended.stderr
    assert (empty.tiny / "logs/level_06_to_09_shard_0001.log").is_file()
    experiment = Experiment.from_yaml(empty.file)
    records = {level: simulate_record(experiment, level) for level in (6, 7, 8, 9)}
    for level, record in records.items():
        files = [(empty.tiny / f"level_0{level}/shard_000{n}.nc", None) for n in (0, 1)]
        with store.open_level(files) as found:
            assert found.cases == 6
            for name in record.variables:
                assert found.read()[name].tobytes() == record[name].tobytes(), name
    compared = analyse_records(experiment, records)
    stored = store.read(empty.tiny / "convergence.nc")
    for name, variable in compared.variables.items():
        if variable.values.dtype.kind == "f":
            assert stored[name].tobytes() == variable.values.tobytes(), name


@pytest.mark.slow
def test_only_the_shard_that_was_not_full_and_the_new_ones_are_made(
    empty: Place, small_shards: None
) -> None:
    write(empty, "model.L: {range: [1, 6, 1]}")
    assert empty.run().returncode == 0
    write(empty, "model.L: {range: [1, 9, 1]}")
    rest = {"analyse", "report", "index"}
    assert set(empty.jobs()) == shards(1, 2) | rest
    write(empty, "model.L: {range: [1, 6, 1]}", TEXT.replace("8, 9]", "8, 9, 10]"))
    finer = {f"level_10/shard_000{n}" for n in (0, 1)}
    assert set(empty.jobs()) == finer | rest


@pytest.mark.slow
def test_members_added_at_the_end_are_what_is_new(empty: Place) -> None:
    write(empty, "initial.theta: [0.5, 1.0]")
    assert empty.run().returncode == 0
    before = empty.content()
    write(empty, "initial.theta: {range: [0.5, 1.0, 0.5]}")
    assert set(empty.jobs()) <= {"analyse", "report", "index"}, "no level file has other values"
    write(empty, "initial.theta: [0.5, 1.0, 1.5]")
    levels = {f"level_0{n}/shard_0000" for n in (6, 7, 8, 9)}
    assert set(empty.jobs()) == levels | {"analyse", "report", "index"}
    write(empty, "initial.theta: [0.5, 1.0]")
    assert empty.run().returncode == 0
    assert empty.content() == before


@pytest.mark.slow
def test_one_member_alone_is_run_and_has_then_nothing_to_do(empty: Place) -> None:
    write(empty, "initial.theta: [0.5, 1.0]")
    alone = Path(f"{empty.file}@1")
    ended = empty.run(files=[alone])
    assert ended.returncode == 0, ended.stdout + ended.stderr
    assert (empty.results / "adhoc/tiny_case_1/level_06.nc").is_file()
    assert "PASS  adhoc/tiny_case_1" in ended.stdout
    assert empty.jobs(files=[alone]) == []


@pytest.mark.slow
def test_one_member_alone_is_an_experiment_of_its_own(empty: Place) -> None:
    write(empty, "initial.theta: [0.5, 1.0]")
    alone = Path(f"{empty.file}@1")
    ended = empty.run("--dry-run", files=[alone])
    assert ended.returncode == 0, ended.stdout + ended.stderr
    assert "simulate adhoc/tiny_case_1 level_06.nc" in ended.stdout
    assert "report adhoc/tiny_case_1" in ended.stdout
    ended = vibsim("simulate", alone, "--level", 6, "--results", empty.results)
    assert ended.returncode == 0, ended.stdout + ended.stderr
    assert (empty.results / "adhoc/tiny_case_1/level_06.nc").is_file()
    ended = empty.run(files=[Path(f"{empty.file}@2")])
    assert ended.returncode == 2
    assert "from 0 to 1" in ended.stderr
    ended = vibsim("plan", "--json", alone)
    (plan,) = json.loads(ended.stdout)
    assert (plan["name"], plan["cases"]) == ("tiny_case_1", 1)


@pytest.mark.slow
def test_a_tolerance_that_a_member_does_not_reach_is_told(empty: Place) -> None:
    tolerance = "tolerance: 1e-4\noutput: best"
    text = TEXT.replace("levels: [6, 7, 8, 9]", tolerance)
    text = text.replace("schemes: [central]", "schemes: [{kind: central, end_velocity: kick}]")
    write(empty, "initial.omega: {linspace: [1.2, 2.2, 40]}", text)
    ended = empty.run()
    assert ended.returncode == 1, ended.stdout + ended.stderr
    assert "FAIL  mismatch  tolerance" in ended.stdout
    assert "FAIL in 1 of 40 results" in ended.stdout
    summary = json.loads((empty.tiny / "summary.json").read_text())
    verdict = summary["checks"][-1]
    assert verdict["kind"] == "tolerance"
    worst = verdict["results"][0]
    assert worst["command"] == "vibsim run tiny.yaml@22"
    page = (empty.tiny / "report.html").read_text()
    assert "The error bound is beyond the tolerance, in 1 of 40 members" in page
    assert "Error of the extrapolated solution" in page
    assert "at most 0.0001" in page
    assert f".venv/bin/{worst['command']}" in html.unescape(page)
    best = store.read(empty.tiny / "best.nc")
    assert best["reached"][0].tolist() == [int(case != 22) for case in range(40)]
    # alone, with the ladder of the sweep, it has the same numbers
    word = worst["command"].removeprefix("vibsim run ")
    ended = vibsim("run", word, "--results", empty.results, cwd=empty.file.parent)
    assert ended.returncode == 1, ended.stderr
    alone = store.read(empty.results / "adhoc/tiny_case_22/best.nc")
    for name in ("theta", "omega", "theta_error", "omega_error", "reached"):
        assert alone[name][:, 0].tobytes() == best[name][:, 22].tobytes(), name
    one = store.read(empty.results / "adhoc/tiny_case_22/convergence.nc")
    of_sweep = store.read(empty.tiny / "convergence.nc")
    assert (
        one["omega_best_error"][0, 0]
        == of_sweep["omega_best_error"][0, 22]
        == worst["facts"]["error_bound"]
    )


@pytest.mark.slow
def test_a_member_that_fails_costs_no_other(empty: Place) -> None:
    """A member that overflows is a result with a status; the others are as without it."""
    write(empty, "initial.omega: [0.1, 1.0e+200, 0.2]")
    levels = ("--level", 6, 7, 8, 9)
    for job in (("simulate", empty.file, *levels), ("analyse", empty.file)):
        ended = vibsim(*job, "--results", empty.results)
        assert ended.returncode == 0, ended.stdout + ended.stderr
    record = store.read(empty.tiny / "level_06/shard_0000.nc")
    assert record["status"][0].tolist() == [0, 1, 0]
    write(empty, "initial.omega: [0.1, 0.2]")
    assert (
        vibsim(
            *("simulate", empty.file, "--level", 6, "--out", empty.folder / "x.nc"),
            *("--results", empty.results),
        ).returncode
        == 0
    )
    other = store.read(empty.folder / "x.nc")
    assert record["theta"][:, [0, 2]].tobytes() == other["theta"].tobytes()
