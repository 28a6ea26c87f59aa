"""Jobs that an executor of Snakemake runs: a scheduler of three scripts, which starts each in its own session."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from pathlib import Path
from shlex import quote

import pytest
from made_once import change
from torture.laboratory import processes, words

from vibsim.cli.arguments import parsed
from vibsim.cli.chosen_plans import plans_of
from vibsim.cli.run import executor, pending
from vibsim.cli.workflow import names_of
from vibsim.core.errors import InputError
from vibsim.plan.workflow_names import group_size

from .conftest import ROOT, Place, here

SCRIPTS = {
    "submit": """\
grep "^# properties" "$1" >> properties
if [ -e lost ]; then setsid sh "$1" > /dev/null 2>&1 < /dev/null & else true & echo $! > lost; fi
echo $!""",
    "status": """\
if [ "$1" = "$(cat lost)" ]; then echo failed; exit; fi
if kill -0 "$1" 2> /dev/null; then echo running; else echo success; fi""",
    "cancel": 'for job in "$@"; do kill -9 "-$job"; done; echo "$@" >> cancelled',
}


def scheduler(folder: Path, *, loses: bool = False, answers_after: int = 0) -> list[str]:
    """Return the options of a run whose jobs go to a scheduler in `folder`.

    It may lose the first job, and may answer questions after some seconds.
    """
    folder.mkdir()
    if not loses:
        (folder / "lost").touch()
    options = ["--executor", "cluster-generic", "--jobs", "4", "--"]
    for name, text in SCRIPTS.items():
        script = folder / name
        wait = f"sleep {answers_after}\n" if name == "status" else ""
        script.write_text(
            f"#!/bin/sh\ncd {quote(str(folder))}\necho >> {name}.calls\n{wait}{text}\n"
        )
        script.chmod(0o755)
        options += [f"--cluster-generic-{name}-cmd", str(script)]
    return [*options, "--seconds-between-status-checks", "1"]


@pytest.mark.slow
@pytest.mark.parametrize("here", [20, pytest.param(0, marks=pytest.mark.slow)])
def test_jobs_of_a_scheduler_give_the_same_bytes(place: Place, tmp_path: Path, here: int) -> None:
    wanted = place.content()
    other = Place(place.folder, elsewhere=tmp_path / "shared results")
    text = (ROOT / "workflow/profiles/generic/config.yaml").read_text()
    (tmp_path / "config.yaml").write_text(text.replace("here: 20", f"here: {here}"))
    profile = ["--profile", str(tmp_path)]
    ended = other.run(*profile, *scheduler(tmp_path / "scheduler", loses=True))
    assert ended.returncode == 0, ended.stdout + ended.stderr
    found = other.content()
    assert found.keys() == wanted.keys()
    assert [name for name in wanted if found[name] != wanted[name]] == []
    assert other.jobs() == []
    rows = (tmp_path / "scheduler/properties").read_text().splitlines()
    jobs = [json.loads(row.removeprefix("# properties = ")) for row in rows]
    # simulations, and analysis with page if they are not made here; the index is
    names = [job.get("groupid") or job["rule"] for job in jobs]
    assert names == ["simulate", "simulate", *["analyse"] * (not here)]
    needs = [[job["resources"][key] for key in ("mem_mb", "runtime", "disk_mb")] for job in jobs]
    assert all(memory > 500 and minutes > 2 and disk > 0 for memory, minutes, disk in needs)
    # what was lost may have needed more
    lost, again, *_ = needs
    assert again == [2 * lost[0], 2 * lost[1], lost[2]]


@pytest.mark.slow
@pytest.mark.parametrize("is_asking", [False, True])
def test_an_interrupt_cancels_what_was_submitted(
    place: Place, tmp_path: Path, is_asking: bool
) -> None:
    change(place.file, "[6, 7, 8, 9]", "[27, 28]")
    change(place.file, "schemes:", "samples: common\nschemes:")
    results = tmp_path / "results"
    command = [sys.executable, "-m", "vibsim", "run", str(place.file), "--results", str(results)]
    command += scheduler(tmp_path / "scheduler", answers_after=5 if is_asking else 0)
    asked = tmp_path / "scheduler/status.calls"
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        deadline = time.monotonic() + 60
        while not computing(results) and time.monotonic() < deadline:
            time.sleep(0.1)
        assert computing(results)
        while is_asking and not asked.exists() and time.monotonic() < deadline:
            time.sleep(0.1)
        assert asked.exists() or not is_asking
        process.send_signal(signal.SIGTERM)
        _, told = process.communicate(timeout=60)
    assert process.returncode == 128 + signal.SIGTERM
    assert "cancelling what was submitted" in told
    jobs = (tmp_path / "scheduler/cancelled").read_text().split()
    assert len(jobs) == len((tmp_path / "scheduler/submit.calls").read_text().splitlines())
    deadline = time.monotonic() + 10
    while computing(results) and time.monotonic() < deadline:
        time.sleep(0.1)
    assert not computing(results)


def computing(results: Path) -> list[int]:
    """Return the jobs that make levels of some results."""
    return [pid for pid in processes(str(results)) if " simulate " in words(pid)]


def test_memory_holds_what_the_executor_needs_and_grows_with_each_attempt(place: Place) -> None:
    config = {"experiments": str(place.file), "results": str(place.results)}
    names = names_of(config | {"overhead": 500, "cores": 3}, {})
    (simulation,) = names.simulations
    asked = names.memory(simulation.megabytes)
    assert asked(None, 1) == simulation.megabytes + 500
    assert asked(None, 3) == 3 * asked(None, 1)


def test_jobs_are_grouped_to_minutes_and_long_ones_are_not(place: Place) -> None:
    def made(levels: str) -> list[tuple[str | None, int | None]]:
        change(place.file, "levels: [6, 7, 8, 9]", f"levels: {levels}")
        names = names_of({"experiments": str(place.file), "results": str(place.results)}, {})
        change(place.file, f"levels: {levels}", "levels: [6, 7, 8, 9]")
        return [(one.group, one.minutes) for one in names.simulations]

    assert made("[6, 7]") == [("simulate", 3)]
    # 52 s at 12 ns a step, and four times as long on a slow machine
    assert made("[6, 32]") == [("simulate", 3), (None, 6)]


@pytest.mark.slow
def test_what_takes_seconds_is_finished_here(place: Place) -> None:
    def groups(here: int, *names: str) -> tuple[bool, str | None]:
        config = {"experiments": [str(place.file), *names], "here": here}
        found = names_of(config | {"results": str(place.results)}, {})
        return found.finishes_here, found.analysis_group

    assert groups(20) == (True, None)
    # each has a page, and Python starts for it
    assert groups(20, "vibration_text") == (False, "analyse")
    assert groups(0) == (False, "analyse")


def test_short_simulations_are_divided_among_jobs_as_long_as_that_saves_time() -> None:
    # two starts would take longer than the work
    assert group_size([1.0, 1.0], 16) == 2
    # two jobs that start in 4 s each and work for 6 s are done sooner than one, and than three
    assert group_size([2.5] * 5, 16) == 3
    # jobs of a minute each, and no more in one than a profile allows
    assert group_size([4.0] * 225, 16) == 15
    assert group_size([4.0] * 734, 16) == 16
    assert group_size([4.0] * 734, 1) == 1
    assert group_size([], 16) == 16


def test_a_profile_says_how_many_share_a_job_at_most(place: Place, tmp_path: Path) -> None:
    def grouped(profile: str, levels: str) -> list[str]:
        (tmp_path / "config.yaml").write_text(f"executor: cluster-generic\n{profile}")
        change(place.file, "levels: [6, 7, 8, 9]", f"levels: {levels}")
        plans = plans_of([str(place.file)])
        change(place.file, f"levels: {levels}", "levels: [6, 7, 8, 9]")
        options = parsed(["run", str(place.file), "--profile", str(tmp_path)])
        words = [*executor.chosen(options, plans, place.results).arguments]
        return words[words.index("--group-components") + 1 :] if "group" in " ".join(words) else []

    ours = "group-components: {simulate: 16, analyse: 4}"
    # levels 6 to 27 in one job, then 28, 29 and 30, of 3 to 13 s
    assert grouped(ours, "{from: 6, to: 30}") == ["simulate=2", "analyse=4"]
    assert grouped("group-components: [simulate=1]", "{from: 6, to: 30}") == ["simulate=1"]
    assert grouped("", "{from: 6, to: 30}") == []
    with pytest.raises(InputError, match="`group-components` must be whole numbers"):
        grouped("group-components: {simulate: many}", "[6, 7]")


def test_a_profile_configures_cores_and_memory_of_the_executor(
    place: Place, tmp_path: Path
) -> None:
    def words(config: str, *options: str) -> list[str]:
        file = tmp_path / "config.yaml"
        file.write_text(f"executor: cluster-generic\n{config}")
        options = ("run", str(place.file), "--profile", str(tmp_path), *options)
        chosen = executor.chosen(parsed([*options]), [], place.results)
        return [f"{key}={value}" for key, value in chosen.config.items()]

    assert words("") == ["cores=1", "overhead=500", "here=20"]
    assert words("config: {overhead: 700, here: 0}") == ["cores=1", "overhead=700", "here=0"]
    assert words("config: [cores=3]", "--cores", "2") == ["cores=2", "overhead=500", "here=20"]
    with pytest.raises(InputError, match="must be whole numbers"):
        words("config: {overhead: much}")
    with pytest.raises(InputError, match="it must be YAML"):
        words("config: {overhead: 1")


def test_a_slurm_without_accounts_is_asked_by_squeue(
    place: Place, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def arguments(status: int, *options: str) -> list[str]:
        (tmp_path / "sacct").write_text(f"#!/bin/sh\nexit {status}\n")
        (tmp_path / "sacct").chmod(0o755)
        options = ("run", str(place.file), *options)
        return [*executor.chosen(parsed([*options]), [], place.results).arguments]

    monkeypatch.setenv("PATH", str(tmp_path), prepend=":")
    followed = ["--slurm-status-command", "squeue"]
    for options in (["--executor", "slurm"], ["--profile", "slurm"]):
        assert "squeue" not in arguments(0, *options)
        words = arguments(1, *options)
        assert words[words.index(followed[0]) :][:2] == followed
    # what somebody asks for comes last, and wins
    words = arguments(1, "--executor", "slurm", "--", "--slurm-status-command", "sacct")
    assert words[-1] == "sacct"
    assert "squeue" not in arguments(1, "--executor", "cluster-generic")


@pytest.mark.parametrize("name", executor.SHIPPED)
def test_a_shipped_profile_is_found_by_its_name(
    place: Place, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    def folder(*options: str) -> str:
        chosen = executor.chosen(parsed(["run", str(place.file), *options]), [], place.results)
        return chosen.arguments[chosen.arguments.index("--profile") + 1]

    shipped = Path(__file__).parents[2] / "workflow/profiles" / name
    assert folder("--profile", name) == str(shipped)
    # a folder is taken only where it is asked for
    own = tmp_path / name
    own.mkdir()
    (own / "config.yaml").touch()
    monkeypatch.chdir(tmp_path)
    assert folder("--profile", name) == str(own)
    assert folder("--executor", "slurm" if name == "slurm" else "cluster-generic") == str(shipped)


def test_jobs_that_wait_are_told_with_the_reason(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rows = [
        "/re sults/log Resources",
        "/re sults/log Priority",
        "/re sults/log Priority",
        "/x/log a",
    ]
    pairs = [row.rsplit(" ", 1) for row in rows]
    answer = tmp_path / "answer"
    answer.write_text("".join(f"{log:4096}{reason:200}\n" for log, reason in pairs))
    (tmp_path / "squeue").write_text(f"#!/bin/sh\ncat {answer}\n")
    (tmp_path / "squeue").chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=":")
    found = pending.reasons(Path("/re sults"))
    assert pending.in_words(found) == "3 jobs are pending: Priority (2); Resources (1)"
    assert pending.in_words(pending.reasons(Path("/x"))) == "1 job is pending: a (1)"
    assert pending.in_words(pending.reasons(Path("/other"))) == ""


@pytest.mark.parametrize(
    ("options", "rule"),
    [
        (["--executor", "cluster-generik", "--jobs", "2"], "did you mean 'cluster-generic'?"),
        (["--profile", "nowhere"], "must be slurm or generic, or a folder with the file"),
        (["--jobs", "2"], "belongs to --executor"),
    ],
)
def test_what_no_executor_can_do_is_refused(
    tmp_path: Path, place: Place, options: list[str], rule: str
) -> None:
    ended = here("run", place.file, "--results", tmp_path / "none", *options)
    assert ended.returncode == 2
    assert rule in ended.stderr
    assert not (tmp_path / "none").exists()
    assert [path.name for path in tmp_path.iterdir()] == ["copy"]
