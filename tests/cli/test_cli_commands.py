from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from forked import vibsim

from vibsim.cli import main, results_folder
from vibsim.cli.jobs import extrapolate
from vibsim.cli.run import snakemake
from vibsim.cli.run.changes import changed
from vibsim.core.errors import FileError, VibsimError
from vibsim.models import MODELS
from vibsim.plan import Choice, load

from .conftest import Made

TEXT = """\
title: A tiny pendulum
model: {kind: pendulum}
initial: {theta: 1.0}
time: {end: 20.0}
levels: [5, 6, 7]
schemes: [central]
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "tiny.yaml"
    path.write_text(TEXT)
    return path


Capture = pytest.CaptureFixture[str]


def test_check_accepts_a_valid_file(file: Path, capsys: Capture) -> None:
    assert main(["check", str(file)]) == 0
    assert "valid (1 member, levels 5, 6, 7)" in capsys.readouterr().out


def test_check_tells_all_faults_of_all_files_without_a_traceback(
    file: Path, tmp_path: Path, capsys: Capture
) -> None:
    bad = tmp_path / "bad.yaml"
    bad.write_text(TEXT.replace("kind: pendulum", "kind: pendulm").replace("20.0", ".nan"))
    assert main(["check", str(bad), str(file), str(tmp_path / "none.yaml")]) == 2
    captured = capsys.readouterr()
    assert f"{bad}:2:" in captured.err
    assert "did you mean 'pendulum'" in captured.err
    assert f"{bad}:4:" in captured.err
    assert "none.yaml" in captured.err
    assert "Traceback" not in captured.err


def test_plan_shows_what_a_run_costs(file: Path, capsys: Capture) -> None:
    assert main(["plan", str(file)]) == 0
    shown = capsys.readouterr().out
    assert "adhoc/tiny: 1 member, scheme central" in shown
    assert "all: 1 simulate job, 224 member-steps" in shown
    assert main(["plan", "--json", str(file)]) == 0
    (plan,) = json.loads(capsys.readouterr().out)
    assert [level["steps"] for level in plan["levels"]] == [32, 64, 128]
    assert plan["total"]["jobs"] == 3
    for name in ("bytes", "memory", "seconds", "member_steps"):
        assert plan["total"][name] > 0


def test_several_plans_are_added_up(file: Path, tmp_path: Path, capsys: Capture) -> None:
    other = file.with_name("other.yaml")
    other.write_text(TEXT)
    assert main(["plan", str(file), str(other), "--results", str(tmp_path)]) == 0
    assert "2 experiments: 448 member-steps" in capsys.readouterr().out


SWEPT = TEXT + "sweep: {initial.theta: {linspace: [0.1, 3, 300]}}\n"


@pytest.mark.parametrize("command", ["plan", "run"])
@pytest.mark.parametrize(
    ("function", "found", "told"),
    [
        ("free_bytes", lambda _: 1500, "of disk, 1.5 kB are free"),
        (
            "psutil.virtual_memory",
            lambda: SimpleNamespace(total=1500, available=1500),
            "of memory, the machine has 1.5 kB",
        ),
    ],
)
def test_what_does_not_fit_is_refused_with_both_numbers(
    file: Path,
    tmp_path: Path,
    capsys: Capture,
    monkeypatch: pytest.MonkeyPatch,
    command: str,
    function: str,
    found: Callable[..., Any],
    told: str,
) -> None:
    monkeypatch.setattr(f"vibsim.cli.resources.{function}", found)
    results = tmp_path / "results"
    assert main([command, str(file), "--results", str(results)]) == 2
    assert told in capsys.readouterr().err
    assert not results.exists()


def test_a_member_alone_is_planned_and_checked(file: Path, capsys: Capture) -> None:
    file.write_text(SWEPT)
    assert main(["plan", f"{file}@7"]) == 0
    assert "adhoc/tiny_case_7: 1 member" in capsys.readouterr().out
    assert main(["check", f"{file}@300"]) == 2
    assert "from 0 to 299" in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.parametrize("threads", ["1", "2"])
def test_several_levels_are_made_in_one_go_at_the_places_of_the_plan(
    file: Path, tmp_path: Path, capsys: Capture, threads: str
) -> None:
    file.write_text(SWEPT)
    common = [str(file), "--results", str(tmp_path)]
    assert main(["simulate", *common, "--level", "5", "6", "7", "--threads", threads]) == 0
    assert capsys.readouterr().out.splitlines() == [
        f"adhoc/tiny, level {level}, members 0 to 299" for level in (5, 6, 7)
    ]
    for level in (5, 6, 7):
        made = tmp_path / f"adhoc/tiny/level_0{level}/shard_0000.nc"
        alone = tmp_path / "alone.nc"
        assert main(["simulate", *common, "--level", str(level), "--out", str(alone)]) == 0
        assert made.read_bytes() == alone.read_bytes()
    capsys.readouterr()
    assert main(["simulate", *common, "--level", "5", "6", "7"]) == 0
    assert "level_05/shard_0000.nc: is up to date" in capsys.readouterr().out
    assert main(["simulate", *common, "--level", "5", "6", "--out", str(alone)]) == 2


@pytest.mark.slow
def test_a_failing_shard_names_its_members_and_the_other_levels_are_made(
    file: Path, tmp_path: Path, capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    from vibsim import simulation

    file.write_text(SWEPT)
    right = simulation.simulate_record
    errors = {5: MemoryError(), 6: ZeroDivisionError("a fault in the code")}

    def fail(experiment: object, level: int, *range_: object, **options: object) -> object:
        if level in errors:
            raise errors[level]
        return right(experiment, level, *range_, **options)  # type: ignore[arg-type]

    monkeypatch.setattr(simulation, "simulate_record", fail)
    common = [str(file), "--results", str(tmp_path)]
    assert main(["simulate", *common, "--level", "5", "6", "7"]) == 1
    told = capsys.readouterr().err
    assert "adhoc/tiny, level 5, members 0 to 299: not enough memory (MemoryError)" in told
    assert (
        "adhoc/tiny, level 6, members 0 to 299: internal error, test_cli_commands.py, line" in told
    )
    assert "ZeroDivisionError: a fault in the code" in told
    assert "Traceback" not in told, "the full text is in a file of its own"
    assert (tmp_path / "adhoc/tiny/level_07/shard_0000.nc").is_file()
    out = ["--out", str(tmp_path / "x.nc")]
    assert main(["simulate", *common, "--level", "5", *out]) == 1
    assert "level 5, members 0 to 299: not enough memory" in capsys.readouterr().err


@pytest.mark.slow
def test_an_extrapolation_is_made_only_where_it_is_asked_for(
    file: Path, tmp_path: Path, capsys: Capture
) -> None:
    from vibsim import store

    assert main(["extrapolate", str(file), "--results", str(tmp_path)]) == 2
    assert "output: best" in capsys.readouterr().err
    file.write_text(SWEPT.replace("300", "30") + "output: best\n")
    common = [str(file), "--results", str(tmp_path)]
    assert main(["simulate", *common, "--level", "5", "6", "7"]) == 0
    assert main(["extrapolate", *common]) == 0
    whole = (tmp_path / "adhoc/tiny/best.nc").read_bytes()
    record = store.read(tmp_path / "adhoc/tiny/best.nc")
    assert record["theta"].shape[:2] == (1, 30)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(extrapolate, "PART_BYTES", 10_000)
        assert main(["extrapolate", *common]) == 0
    assert (tmp_path / "adhoc/tiny/best.nc").read_bytes() == whole


@pytest.mark.parametrize(
    ("what", "shown"), [("models", "pendulum"), ("schemes", "central"), ("checks", "converges")]
)
def test_lists(what: str, shown: str, capsys: Capture) -> None:
    assert main(["list", what]) == 0
    assert shown in capsys.readouterr().out


def test_list_of_models_tells_which_are_linear(capsys: Capture) -> None:
    assert main(["list", "models"]) == 0
    lines = capsys.readouterr().out.splitlines()
    shapes = {line.split()[0]: line.rpartition("; ")[2] for line in lines}
    # the file has its matrices
    assert shapes.pop("structure") == "alpha = 0, beta = 0"
    assert shapes == {
        kind: "formulas " + ", ".join(field.name for field in model.formulas)
        if model.formulas
        else "linear"
        if model.linear
        else "nonlinear"
        for kind, model in MODELS.items()
        if kind != "structure"
    }


@pytest.mark.parametrize(
    "option", [["--digest", "0" * 64], ["--discard"], ["--formats", "png"]], ids=lambda o: o[0]
)
def test_the_index_takes_no_option_of_one_report(
    tmp_path: Path, capsys: Capture, option: list[str]
) -> None:
    assert main(["report", "--results", str(tmp_path), *option]) == 2
    assert f"{option[0]}" in capsys.readouterr().err
    assert not (tmp_path / "index.html").exists()
    assert main(["report", "--results", str(tmp_path)]) == 0
    assert (tmp_path / "index.html").exists()


@pytest.mark.parametrize(
    "arguments",
    [["simulate", "FILE", "--level", "4"], ["simulate", "FILE", "--level", "5", "--shard", "1"]],
)
def test_a_job_that_does_not_exist_is_refused(
    file: Path, tmp_path: Path, capsys: Capture, arguments: list[str]
) -> None:
    out = tmp_path / "out.nc"
    named = [str(file) if word == "FILE" else word for word in arguments]
    assert main([*named, "--out", str(out), "--results", str(tmp_path)]) == 2
    assert "must be" in capsys.readouterr().err
    assert not out.exists()


def test_a_file_of_another_job_is_refused_by_name_and_kept(
    file: Path, tmp_path: Path, capsys: Capture
) -> None:
    common = ["--results", str(tmp_path)]
    for level in ("5", "6", "7"):
        out = tmp_path / f"adhoc/tiny/level_0{level}.nc"
        assert main(["simulate", str(file), "--level", level, "--out", str(out), *common]) == 0
    file.write_text(TEXT.replace("theta: 1.0", "theta: 1.1"))
    assert main(["analyse", str(file), *common]) == 1
    assert "level_05.nc" in capsys.readouterr().err
    assert (tmp_path / "adhoc/tiny/level_05.nc").exists()
    assert main(["analyse", str(file), *common, "--discard"]) == 1
    assert not (tmp_path / "adhoc/tiny/level_05.nc").exists()


@pytest.mark.parametrize(
    "arguments",
    [[], ["fly"], ["run", "--cores", "0"], ["list", "planets"], ["check"], ["judge", "study.csv"]],
)
def test_a_wrong_command_line_is_refused(arguments: list[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        main(arguments)
    assert caught.value.code == 2


def test_an_unknown_command_comes_with_the_nearest(capsys: Capture) -> None:
    with pytest.raises(SystemExit):
        main(["jugde", "study.csv"])
    assert "unknown command 'jugde': did you mean 'judge'?" in capsys.readouterr().err


def test_results_that_cannot_be_written_are_named(
    file: Path, tmp_path: Path, capsys: Capture
) -> None:
    blocked = tmp_path / "blocked"
    blocked.touch()
    for command in (
        ["run"],
        ["simulate", "--level", "5", "--out", "x.nc"],
        ["analyse"],
        ["report"],
    ):
        assert main([*command, str(file), "--results", str(blocked)]) == 2
        assert str(blocked) in capsys.readouterr().err


def test_a_closed_pipe_is_no_fault() -> None:
    command = f"{sys.executable} -m vibsim list checks | head -1"
    ended = subprocess.run(command, shell=True, capture_output=True, text=True, check=True)
    assert ended.stderr == ""


def test_the_command_starts_without_what_it_does_not_need() -> None:
    program = (
        "import sys; import vibsim.cli.run.command\n"
        "heavy = {'numpy', 'pydantic', 'yaml', 'netCDF4', 'xarray', 'llvmlite', 'snakemake'}\n"
        "assert not heavy & set(sys.modules), heavy & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", program], check=True)


def test_unknown_formats_are_refused_first(file: Path, tmp_path: Path, capsys: Capture) -> None:
    command = ["report", str(file), "--results", str(tmp_path / "none"), "--formats", "svg,gif"]
    assert main(command) == 2
    assert "gif: unknown format: choose from svg, png, pdf" in capsys.readouterr().err


@pytest.mark.slow
def test_a_dry_run_makes_no_folder(file: Path, tmp_path: Path) -> None:
    new = tmp_path / "new"
    ended = vibsim("run", file, "--results", new, "--dry-run", "--cores", "1")
    assert ended.returncode == 0
    lines = ended.stdout.splitlines()
    assert lines[0] == "adhoc/tiny: not made yet: levels 5 to 7, analysis, report"
    assert lines[1] == "  simulate adhoc/tiny level_05.nc"
    assert not new.exists()


def test_a_file_with_another_ending_is_told_so(file: Path, capsys: Capture) -> None:
    for name in ("tiny.YAML", "tiny"):
        other = file.with_name(name)
        other.write_text(TEXT)
        assert main(["check", str(other)]) == 2
        assert capsys.readouterr().err.endswith("must end in .yaml or .yml\n")


def test_a_folder_in_the_place_of_a_file_is_deleted_only_when_empty(tmp_path: Path) -> None:
    folder = tmp_path / "level_08.nc"
    (folder / "inner").mkdir(parents=True)
    with pytest.raises(VibsimError, match=r"level_08\.nc: cannot be deleted"):
        results_folder.delete(FileError(folder, "bad"), tmp_path)
    (folder / "inner").rmdir()
    results_folder.delete(FileError(folder, "bad"), tmp_path)
    assert not folder.exists()
    assert results_folder.deleted(tmp_path) == [f"{folder}: bad"]


def test_search_paths_do_not_mean_the_results_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Snakemake and its jobs work there, and an empty place in a search path means the folder that one is in."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("VIBSIM_CACHE_DIR", str(tmp_path))
    monkeypatch.setenv("PYTHONPATH", ":here:/there")
    monkeypatch.setenv("LD_LIBRARY_PATH", "/there:")
    found = snakemake._environment()
    assert found["PYTHONPATH"] == f"{tmp_path}:{tmp_path}/here:/there"
    assert found["LD_LIBRARY_PATH"] == f"/there:{tmp_path}"


def test_snakemake_keeps_its_rules_where_nobody_else_can_write(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    own, home = tmp_path / "own", tmp_path / "home"
    monkeypatch.setenv("VIBSIM_CACHE_DIR", str(own))
    monkeypatch.setenv("HOME", str(home))
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    assert snakemake._environment()["XDG_CACHE_HOME"] == str(home / ".cache")
    (home / ".cache").chmod(0o777)
    assert snakemake._environment()["XDG_CACHE_HOME"] == str(own)
    monkeypatch.setenv("HOME", "/proc/none")
    assert snakemake._environment()["XDG_CACHE_HOME"] == str(own)


@pytest.mark.parametrize(
    "arguments",
    [
        ["run", "--results", ""],
        ["run", ""],
        ["run", "--results="],
        ["run", "pendulum_lab", "  "],
        ["check", ""],
        ["plan", "pendulum_lab", "--results", ""],
        ["simulate", "", "--level", "6"],
        ["simulate", "theta_convergence", "--level", "6", "--out", ""],
        ["simulate", "theta_convergence", "--level", "6", "--results", ""],
        ["analyse", "theta_convergence", "--out", ""],
        ["extrapolate", "theta_convergence", "--out", ""],
        ["report", "theta_convergence", "--out", ""],
        ["report", "--results", ""],
        ["report", "theta_convergence", "--formats", ""],
        ["judge", "", "--h", "dt"],
        ["judge", "study.csv", "--h", " "],
        ["judge", "study.csv", "--h", "dt", "--quantity", "u", ""],
        ["judge", "study.csv", "--h", "dt", "--exact", ""],
        ["judge", "study.csv", "--h", "dt", "--report", ""],
    ],
)
def test_an_empty_name_is_refused(
    arguments: list[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as caught:
        main(arguments)
    assert caught.value.code == 2
    assert "must not be empty" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_changed_bytes_are_seen_by_another_inode_and_without_one_where_all_are_compared(
    made: Made,
) -> None:
    plan, file = load(Choice("adhoc", made.file)), made.small / "convergence.nc"
    # of a copied folder the bytes are compared once
    assert changed([plan], made.results, every=False) == []
    status, content = file.stat(), bytearray(file.read_bytes())
    content[len(content) // 2] ^= 1
    file.write_bytes(content)
    os.utime(file, ns=(status.st_atime_ns, status.st_mtime_ns))
    assert changed([plan], made.results, every=False) == []
    assert [error.path for error in changed([plan], made.results, every=True)] == [file]
    other = file.with_name("other.nc")
    shutil.copy2(file, other)
    other.replace(file)
    assert [error.path for error in changed([plan], made.results, every=False)] == [file]
