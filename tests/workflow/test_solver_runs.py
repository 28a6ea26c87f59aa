"""Experiments with a solver of the user, from the file to the page: commands, functions, files, failures, restarts."""

from __future__ import annotations

import csv
import json
import os
import shutil
import signal
import subprocess
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jsonschema
import netCDF4
import pytest
from forked import vibsim
from made_once import made_once

from vibsim.cli import main

from .conftest import ROOT, here, short
from .test_snakemake import snakemake

SOLVER = """\
import sys
mode, h, rate, output = sys.argv[1], float(sys.argv[2]), float(sys.argv[3]), sys.argv[4]
n, text = round(1 / h), "u\\n"
u = ((1 - rate * h / 2) / (1 + rate * h / 2)) ** n
print("solved with", h)
if h < 0.05 and mode != "well":
    {
        "fails": lambda: sys.exit("the matrix is singular"),
        "nothing": lambda: sys.exit(0),
        "killed": lambda: __import__("os").kill(__import__("os").getpid(), 9),
        "nan": lambda: globals().update(u=float("nan")),
        "empty": lambda: globals().update(text="", u=""),
        "column": lambda: globals().update(text="v\\n"),
        "shape": lambda: globals().update(text="u\\n1.0\\n"),
        "hangs": lambda: __import__("time").sleep(100),
    }[mode]()
open(output, "w").write(f"{text}{u}\\n" if text else "")
"""
COMMAND = """\
title: Decay by a program
solver: {command: "python solver.py well {h} {rate} {output.csv}", inputs: [solver.py]}
refine: {h: [1/8, 1/16, 1/32]}
quantities: {u: {}}
checks: [{converges: u, order: 2}]
sweep: {rate: [0.5, 1]}
"""
MODULE = """\
import os
import numpy as np
import xarray

def solve(h, rate=1.0):
    assert os.path.exists("function.yaml"), "runs in the folder of the file"
    t = np.linspace(0.0, 1.0, round(1 / h) + 1)
    u = ((1 - rate * h / 2) / (1 + rate * h / 2)) ** np.arange(len(t))
    return xarray.Dataset({"u": ("t", u), "end": u[-1]}, {"t": t})
"""
FUNCTION = """\
title: Decay by a function
solver: {python: "solver_in_a_module:solve"}
refine: {levels: {from: 2, to: 5}, h: 1/2**level}
quantities: {u: {coordinates: [t]}, end: {}}
checks:
  - {id: order, converges: u, order: 2}
  - {id: trap, converges: end, order: 1, expect: {status: FAIL, reason: order_high}}
  - {id: enough, accurate: u, relative: 1e-2}
  - {id: too_much, accurate: u, relative: 1e-9, expect: {status: FAIL}}
resources: {mem_mb: 300, threads: 2, runtime: 5}
"""
FILES = """\
title: Decay from files
solver: {files: "runs/dt_{h}.csv"}
refine: {h: [0.25, 0.125, 0.0625]}
quantities: {u: {}}
"""
BROKEN = (
    COMMAND.replace("well", "fails").replace("sweep: {rate: [0.5, 1]}\n", "").replace("{rate}", "1")
)


@dataclass(frozen=True)
class Study:
    """Experiment files with their solvers, and a results folder, under names that a shell would trip over."""

    folder: Path

    @property
    def results(self) -> Path:
        return self.folder / "re sults {x} 'y' $z"

    def file(self, name: str) -> Path:
        return self.folder / "my files" / f"{name}.yaml"

    def write(self, name: str, text: str) -> Path:
        self.file(name).write_text(text)
        return self.file(name)

    def of(self, name: str) -> Path:
        return self.results / "adhoc" / name

    def summary(self, name: str) -> dict[str, Any]:
        found: dict[str, Any] = json.loads((self.of(name) / "summary.json").read_text())
        return found

    def run(self, *names: str, options: tuple[str, ...] = ("--allow-commands",)) -> Any:
        files = [self.file(name) for name in names]
        return vibsim("run", *files, "--results", self.results, "--cores", "2", *options)

    def jobs(self, name: str) -> list[str]:
        """Return what a run would do."""
        ended = self.run(name, options=("--allow-commands", "--dry-run", "--json"))
        assert ended.returncode == 0, ended.stderr
        return sorted(short(entry["job"]) for entry in json.loads(ended.stdout)["jobs"])

    def make(self, name: str, level: int) -> tuple[int, str]:
        """Make one level by hand; return the exit status and what was refused."""
        common = ("--results", self.results, "--allow-commands")
        ended = here("simulate", self.file(name), "--level", level, *common)
        return ended.returncode, ended.stderr


@pytest.fixture(scope="session")
def made(tmp_path_factory: pytest.TempPathFactory, worker_id: str) -> Study:
    """One run of all kinds of solvers."""

    def make(folder: Path) -> None:
        study = Study(folder)
        (folder / "my files/runs").mkdir(parents=True)
        texts = {"command": COMMAND, "function": FUNCTION, "files": FILES, "broken": BROKEN}
        for name, text in texts.items():
            study.write(name, text)
        (folder / "my files/solver.py").write_text(SOLVER)
        (folder / "my files/solver_in_a_module.py").write_text(MODULE)
        for h in (0.25, 0.125, 0.0625):
            (folder / f"my files/runs/dt_{h}.csv").write_text(f"u\n{1 + h * h!r}\n")
        ended = study.run(*texts, options=("--allow-commands", "--json"))
        (folder / "run.json").write_text(ended.stdout)
        (folder / "run.err").write_text(ended.stderr)
        (folder / "exit").write_text(str(ended.returncode))

    return Study(made_once(tmp_path_factory, worker_id, "solvers", make))


@pytest.fixture
def study(made: Study, tmp_path: Path) -> Study:
    """A copy of the finished run, at another place."""
    shutil.copytree(made.folder, tmp_path / "copy")
    return Study(tmp_path / "copy")


def statuses(summary: dict[str, Any]) -> dict[str, tuple[str, str]]:
    return {check["id"]: (check["status"], check["reason"]) for check in summary["checks"]}


def test_a_run_has_the_verdicts_of_all_kinds_and_the_failure_of_one(made: Study) -> None:
    told = json.loads((made.folder / "run.json").read_text())
    assert (made.folder / "exit").read_text() == "1"
    found = {entry["experiment"]: entry for entry in told["experiments"]}
    passed = ("PASS", "asymptotic")
    assert statuses(found["command"]) == {"check_1": passed}
    assert statuses(found["files"]) == {"check_1": passed}
    assert statuses(found["function"]) == {
        "order": passed,
        "trap": ("PASS", "match"),
        "enough": ("PASS", "match"),
        "too_much": ("PASS", "match"),
    }
    (failed,) = told["failed_jobs"]
    assert failed["job"] == "simulate adhoc/broken level_02.nc"
    assert failed["log"].endswith("adhoc/broken/logs/level_02.log")
    assert "the matrix is singular" in failed["tail"]
    assert failed["tail"][-1].endswith(
        "adhoc/broken, level 2 (h = 0.03125): the command ended with exit status 1"
    )
    # the other levels are kept
    assert sorted(path.name for path in made.of("broken").glob("*.nc")) == [
        "level_00.nc",
        "level_01.nc",
    ]


def test_a_summary_states_facts_of_every_result(made: Study) -> None:
    schema = json.loads((ROOT / "workflow/schemas/summary.schema.json").read_text())
    for name in ("command", "function", "files"):
        jsonschema.validate(made.summary(name), schema)
    order, trap, enough, _ = made.summary("function")["checks"]
    facts = order["results"][0]["facts"]
    assert facts["order"] == pytest.approx(2.0, abs=0.02)
    assert (facts["levels"], facts["promised"], facts["best"]) == ([0, 3], 2.0, None)
    assert 0.0 < facts["error"] < facts["error_bound"]
    facts = trap["results"][0]["facts"]
    assert facts["best"] == pytest.approx(0.36787944, abs=facts["best_bound"])
    assert enough["results"][0]["facts"]["relative_error"] < 1e-3
    (check,) = made.summary("command")["checks"]
    assert check["counts"] == {"PASS": 2, "FAIL": 0, "INCONCLUSIVE": 0}
    assert check["text"].startswith("Both members passed. The hardest is member 1 (rate = 1.0).")
    worst = check["results"][0]
    assert (worst["case"], worst["values"]) == (1, {"rate": 1.0})
    assert worst["command"] == "vibsim run command.yaml@1 --allow-commands"


def test_levels_are_stored_with_sizes_parameters_and_provenance(made: Study) -> None:
    with netCDF4.Dataset(made.of("command") / "level_02/shard_0001.nc") as level:
        assert level["u"][...] == pytest.approx((63 / 65) ** 32)
        scalars = {name: level[name][...].item() for name in ("level", "h", "rate")}
        assert scalars == {"level": 2, "h": 0.03125, "rate": 1.0}
        uses = json.loads(level.provenance)["experiment"]
    assert uses["command"] == ["python", "solver.py", "well", "0.03125", "1.0", "{output.csv}"]
    with netCDF4.Dataset(made.of("function") / "level_00.nc") as level:
        assert level["u"].dimensions == ("t",)
        assert level["t"][:].tolist() == [0.0, 0.25, 0.5, 0.75, 1.0]
    with netCDF4.Dataset(made.of("command") / "convergence.nc") as found:
        checks = found["checks"]
        assert checks["check_check_1_order"][:].tolist() == pytest.approx([2.0, 2.0], abs=0.02)
        assert checks["check_check_1_level_value"].dimensions == ("case", "level")


def test_pages_and_the_index_show_the_verdicts(made: Study) -> None:
    page = (made.of("function") / "report.html").read_text()
    for text in ("Decay by a function", "solver_in_a_module:solve", "trap", "0.25, 0.125"):
        assert text in page
    assert "http://" not in page.replace("http://www.w3.org", "")
    swept = (made.of("command") / "report.html").read_text()
    assert "Members, the worst first: 2 of 2" in swept
    with (made.of("command") / "tables/members_check_1.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["rate"] for row in rows] == ["1.0", "0.5"]
    assert "Decay by a program" in (made.results / "index.html").read_text()
    lines = (made.results / "summary.csv").read_text().splitlines()
    assert sum(line.startswith("adhoc,function,") for line in lines) == 4


@pytest.mark.slow
def test_what_is_up_to_date_is_not_run_again(study: Study) -> None:
    assert study.jobs("command") == []
    assert study.jobs("function") == []


EVERY = ["analyse", "report", "index"]
CHANGES: dict[str, tuple[str, str, str, list[str]]] = {
    "a title": ("command", "Decay", "The decay", ["report", "index"]),
    "a check": ("command", "order: 2", "at_least: 1", EVERY),
    "a finer level": (
        *("command", "1/32]", "1/32, 1/64]"),
        ["level_03/shard_0000", "level_03/shard_0001", *EVERY],
    ),
    "a member": (
        *("command", "[0.5, 1]", "[0.5, 1, 3]"),
        [*(f"level_0{level}/shard_0002" for level in range(3)), *EVERY],
    ),
    "resources": ("function", "threads: 2", "threads: 1", ["report", "index"]),
    "a way of writing": ("function", "1/2**level", "1.0/2**level", []),
}


@pytest.mark.slow
@pytest.mark.parametrize("change", CHANGES)
def test_a_change_runs_what_depends_on_it(study: Study, change: str) -> None:
    name, old, new, wanted = CHANGES[change]
    text = study.file(name).read_text()
    assert old in text
    study.write(name, text.replace(old, new))
    assert study.jobs(name) == sorted(wanted)


@pytest.mark.slow
def test_a_change_of_an_input_runs_again_what_depends_on_it(study: Study) -> None:
    folder = study.folder / "my files"
    everything = {f"level_0{level}/shard_000{member}" for level in range(3) for member in range(2)}
    (folder / "solver.py").write_text(SOLVER + "# changed\n")
    assert {*everything, "analyse"} <= set(study.jobs("command"))
    (folder / "solver_in_a_module.py").write_text(MODULE + "# changed\n")
    assert {f"level_0{level}" for level in range(4)} <= set(study.jobs("function"))
    (folder / "runs/dt_0.125.csv").write_text("u\n1.0156\n")
    assert study.jobs("files") == ["analyse", "index", "level_01", "report"]
    assert study.make("files", 1) == (0, "")
    with netCDF4.Dataset(study.of("files") / "level_01.nc") as level:
        assert level["u"][...] == 1.0156


@pytest.mark.slow
def test_programs_run_only_where_the_command_line_allows_it(study: Study, tmp_path: Path) -> None:
    for name in ("command", "function"):
        for options in ((), ("--dry-run",)):
            ended = study.run(name, options=options)
            assert ended.returncode == 2
            assert "solver: " in ended.stderr
            assert "--allow-commands" in ended.stderr
        assert here("check", study.file(name)).returncode == 0
        assert here("plan", study.file(name), "--results", study.results).returncode == 0
        common = ("--level", 0, "--results", tmp_path / "new")
        ended = here("simulate", study.file(name), *common)
        assert (ended.returncode, (tmp_path / "new").exists()) == (2, False)
        assert "--allow-commands" in ended.stderr
    # neither a file nor the results folder can allow it
    config = {"experiments": [str(study.file("command"))], "allow_commands": True}
    config |= {"results": str(study.results)}
    file = tmp_path / "config.json"
    file.write_text(json.dumps(config))
    (study.results / ".vibsim/run.json").write_text(json.dumps(config))
    assert study.run("command", options=()).returncode == 2
    ended = snakemake("--configfile", file, "--cores", 1, "-n")
    assert ended.returncode == 1
    assert "--allow-commands" in ended.stdout + ended.stderr
    allowed = ("--config", "allow_commands=true")
    ended = snakemake("--configfile", file, "--cores", 1, "-n", *allowed)
    assert ended.returncode == 0, ended.stderr
    assert "Nothing to be done" in ended.stdout + ended.stderr


@pytest.mark.parametrize(
    ("mode", "told"),
    [
        ("nothing", "the command ended well, but did not write the file that {output} names"),
        ("killed", "the command was killed by SIGKILL"),
        ("empty", "the command wrote an empty file to output.csv"),
        ("column", "output.csv: u: the table has no such column: choose from v"),
    ],
)
def test_a_level_that_fails_is_named_with_its_sizes(study: Study, mode: str, told: str) -> None:
    study.write(mode, BROKEN.replace("fails", mode))
    assert study.make(mode, 0)[0] == 0
    status, error = study.make(mode, 2)
    assert (status, error) == (1, f"vibsim: adhoc/{mode}, level 2 (h = 0.03125): {told}\n")
    assert [path.name for path in study.of(mode).iterdir()] == ["level_00.nc"]


def test_a_program_that_is_not_there_is_named(study: Study) -> None:
    study.write("absent", BROKEN.replace("python solver.py", "no_such_program"))
    status, error = study.make("absent", 0)
    assert status == 1
    assert "no_such_program: the program cannot be started (No such file or dir" in error


def made_by(study: Study, module: str, text: str) -> subprocess.CompletedProcess[str]:
    """Make a level by a function of a module with this text."""
    (study.folder / f"my files/{module}.py").write_text(text)
    study.write(module, FUNCTION.replace("solver_in_a_module", module))
    options = ("--level", 1, "--results", study.results, "--allow-commands")
    return here("simulate", study.file(module), *options)


def test_a_function_that_raises_is_named_with_its_traceback(study: Study) -> None:
    text = "def solve(h, rate=1):\n    raise ArithmeticError('no step')\n"
    ended = made_by(study, "raises_in_a_module", text)
    assert ended.returncode == 1
    assert ended.stderr.endswith("raises_in_a_module:solve raised ArithmeticError: no step\n")
    assert "Traceback" in ended.stdout


@pytest.mark.parametrize(
    ("module", "text", "told"),
    [
        (
            "has_another",
            "def solved(h, rate=1):\n    def solve(): return None\n",
            "has_another has no function solve: did you mean 'solved'?\n",
        ),
        (
            "writes_a_file",
            # only Python knows what a decorator makes of it
            "def same(f): return f\n\n@same\ndef solve(h, output):\n    return None\n",
            "writes_a_file:solve is called with h, but takes (h, output) (missing a required argument: "
            "'output'): it gets sizes and parameters by name, and returns an xarray.Dataset\n",
        ),
    ],
)
def test_a_function_that_cannot_be_called_is_told_without_a_traceback(
    study: Study, module: str, text: str, told: str
) -> None:
    ended = made_by(study, module, text)
    assert ended.returncode == 1
    assert ended.stderr.endswith(told)
    assert "Traceback" not in ended.stdout


def analysed(study: Study, name: str) -> tuple[int, str]:
    for level in range(3):
        assert study.make(name, level)[0] == 0
    ended = here("analyse", study.file(name), "--results", study.results)
    return ended.returncode, ended.stderr


@pytest.mark.slow
def test_numbers_that_are_not_finite_are_data(study: Study) -> None:
    study.write("nan", BROKEN.replace("fails", "nan"))
    assert analysed(study, "nan") == (0, "")
    (check,) = study.summary("nan")["checks"]
    assert (check["status"], check["reason"]) == ("FAIL", "non_finite")
    assert check["text"] == "u is not finite at h = 0.03125."
    assert here("report", study.file("nan"), "--results", study.results).returncode == 0


@pytest.mark.slow
def test_levels_of_other_shapes_are_named(study: Study) -> None:
    study.write("shape", BROKEN.replace("fails", "shape"))
    status, error = analysed(study, "shape")
    assert status == 1
    assert error.startswith("vibsim: u: level 2 (from the coarsest): has the dimensions row")


@pytest.mark.slow
def test_a_damaged_level_is_made_again(study: Study) -> None:
    path = study.of("command") / "level_01/shard_0000.nc"
    path.write_bytes(path.read_bytes()[:-1])
    assert set(study.jobs("command")) == {"level_01/shard_0000", "analyse", "report", "index"}


def test_a_member_runs_alone(study: Study) -> None:
    word = f"{study.file('command')}@1"
    for level in range(3):
        common = ("--results", study.results, "--allow-commands")
        assert here("simulate", word, "--level", level, *common).returncode == 0
    with netCDF4.Dataset(study.of("command_case_1") / "level_02.nc") as level:
        assert level["u"][...] == pytest.approx((63 / 65) ** 32)
    assert here("check", f"{study.file('command')}@2").returncode == 2


@pytest.mark.slow
def test_a_solver_ends_with_the_run_that_started_it(study: Study) -> None:
    study.write("hangs", BROKEN.replace("fails", "hangs"))
    child = os.fork()
    if not child:
        os.setsid()
        study.run("hangs")
        os._exit(0)
    marker = f"{study.of('hangs')}/.level_02.nc.work".encode()

    def solvers() -> list[int]:
        found = []
        for path in Path("/proc").glob("[0-9]*/cmdline"):
            try:
                words = path.read_bytes().split(b"\0")
            except OSError:
                continue
            if b"solver.py" in words and any(word.startswith(marker) for word in words):
                found.append(int(path.parent.name))
        return found

    def wait_until(wanted: bool) -> None:
        deadline = time.monotonic() + 60
        while bool(solvers()) != wanted and time.monotonic() < deadline:
            time.sleep(0.1)
        assert bool(solvers()) == wanted

    wait_until(True)
    os.killpg(child, signal.SIGKILL)
    os.waitpid(child, 0)
    wait_until(False)


def test_a_plan_shows_sizes_and_resources(made: Study, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["plan", str(made.file("function")), "--results", str(made.results)]) == 0
    shown = capsys.readouterr().out
    assert "1 member, 4 jobs of solver_in_a_module:solve" in shown
    assert "2 threads, 300 MB of memory, 5 min" in shown
