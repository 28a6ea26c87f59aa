"""What a folder that others can write to, or a results folder that somebody else made, can do: nothing."""

from __future__ import annotations

import hashlib
import json
import os
import pickle
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from forked import vibsim

from vibsim.cli.chosen_plans import plans_of

from .conftest import TEXT, Place, here

SPRING = """\
title: A spring
model: {{kind: oscillator, spring: {spring}}}
initial: {{u: 1.0}}
time: {{end: 20.0}}
levels: [17]
samples: {{every: 8192}}
schemes: [rk4]
"""
FORMULAS = ("u", "4*u")
ATTACKER = 12345
"""Id of another user, whom root can become."""
SECONDS = 120
"""A run that waits longer than this waits for ever."""


def run(*arguments: object, cwd: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-P", "-m", "vibsim", *map(str, arguments)]
    return subprocess.run(
        command,
        capture_output=True,
        text=True,
        check=False,
        cwd=cwd,
        timeout=SECONDS,
        env=os.environ | environment,
    )


def spring(folder: Path, formula: str) -> Path:
    file = folder / f"spring_{len(formula)}.yaml"
    file.write_text(SPRING.format(spring=formula))
    return file


def solution(file: Path, cache: Path) -> bytes:
    """Return the bytes of a simulated level, with kernels from a cache."""
    out = file.with_suffix(".nc")
    ended = run(
        *("simulate", file, "--level", 17, "--out", out, "--results", file.parent / "none"),
        cwd=file.parent,
        VIBSIM_CACHE_DIR=str(cache),
    )
    assert ended.returncode == 0, ended.stdout + ended.stderr
    return out.read_bytes()


def objects(folder: Path) -> set[Path]:
    """Return the kernels of the steps."""
    found = folder.rglob("*.o")
    return {path for path in found if "samples" in path.with_suffix(".py").read_text()}


@pytest.fixture
def folder() -> Iterator[Path]:
    """Yield a folder that other users can look into."""
    with TemporaryDirectory() as name:
        Path(name).chmod(0o755)
        yield Path(name)


@pytest.fixture(scope="module")
def compiled() -> Iterator[tuple[Path, list[bytes]]]:
    """Yield a cache with the kernels of two springs, and their solutions."""
    with TemporaryDirectory() as name:
        cache = Path(name) / "own"
        files = [spring(Path(name), formula) for formula in FORMULAS]
        yield cache, [solution(file, cache) for file in files]


@pytest.mark.slow
def test_exchanged_kernels_are_not_taken(folder: Path, compiled: tuple[Path, list[bytes]]) -> None:
    own, before = compiled
    cache = folder / "cache"
    shutil.copytree(own, cache)
    first, second = objects(cache)
    content = first.read_bytes()
    first.write_bytes(second.read_bytes())
    second.write_bytes(content)
    assert solution(spring(folder, FORMULAS[0]), cache) == before[0]


@pytest.mark.slow
def test_no_code_is_kept_in_or_taken_from_a_shared_folder(
    folder: Path, compiled: tuple[Path, list[bytes]]
) -> None:
    own, before = compiled
    shared = folder / "shared"
    first, second = objects(own)
    # with a right seal, since anybody can make one
    shutil.copytree(own, shared)
    for one, other in ((first, second), (second, first)):
        planted = shared / one.relative_to(own)
        code = other.read_bytes()[:-32]
        label = f"kernels/{one.name}\0".encode()
        planted.write_bytes(code + hashlib.sha256(label + code).digest())
    content = {path: path.read_bytes() for path in shared.rglob("*.o")}
    for path in (shared, *shared.rglob("*")):
        path.chmod(0o1777 if path.is_dir() else 0o666)
    assert solution(spring(folder, FORMULAS[0]), shared) == before[0]
    assert {path: path.read_bytes() for path in shared.rglob("*.o")} == content


PLANT = """
import os, sys
from pathlib import Path
os.setgroups([])
os.setgid(int(sys.argv[1]))
os.setuid(int(sys.argv[1]))
for top in map(Path, sys.argv[2:]):
    for attack in (
        lambda: os.listdir(top),
        lambda: (top / "planted").write_bytes(b"x"),
        lambda: os.rename(top, top.with_name("moved")),
    ):
        try:
            attack()
        except PermissionError:
            continue
        sys.exit(f"{top} is open")
"""


@pytest.mark.slow
def test_another_user_cannot_reach_what_is_kept(
    folder: Path, compiled: tuple[Path, list[bytes]]
) -> None:
    cache, _ = compiled
    # what keeps others out is the cache's own folder, not the one above it
    cache.parent.chmod(0o755)
    places = [path for path in (cache, *cache.iterdir()) if path.is_dir()]
    assert all(path.stat().st_mode & 0o077 == 0 for path in places)
    if os.geteuid() == 0:
        command = [sys.executable, "-I", "-c", PLANT, str(ATTACKER), *map(str, places)]
        ended = subprocess.run(command, capture_output=True, text=True, check=False)
        assert ended.returncode == 0, ended.stderr


@pytest.mark.slow
def test_kernels_of_another_user_are_not_taken(
    folder: Path, compiled: tuple[Path, list[bytes]]
) -> None:
    """The attacker made the whole cache, before its user came to it."""
    own, before = compiled
    theirs = folder / "theirs"
    theirs.mkdir(mode=0o777)
    theirs.chmod(0o777)
    planted = [theirs / path.relative_to(own) for path in objects(own)]
    planted[0].parent.mkdir()
    planted[0].parent.chmod(0o755)
    for path, other in zip(planted, sorted(objects(own), reverse=True), strict=True):
        path.write_bytes(other.read_bytes())
    if os.geteuid() == 0:
        for path in (theirs, planted[0].parent, *planted):
            os.chown(path, ATTACKER, ATTACKER)
    content = {path: path.read_bytes() for path in planted}
    assert solution(spring(folder, FORMULAS[0]), theirs) == before[0]
    assert {path: path.read_bytes() for path in theirs.rglob("*") if path.is_file()} == content


NOWHERE = {"HOME": "/proc/none", "XDG_CACHE_HOME": "", "VIBSIM_CACHE_DIR": ""}


def without_cache(kind: str, folder: Path) -> dict[str, str]:
    """Return an environment without a private cache."""
    shared = folder / "shared"
    shared.mkdir()
    shared.chmod(0o1777)
    # with a home: the index of fonts, which takes seconds, need not be made again
    return {"no home": NOWHERE, "shared": {"VIBSIM_CACHE_DIR": str(shared)}}[kind]


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["no home", "shared"])
def test_a_run_without_a_private_cache_says_so_and_leaves_no_code(
    tmp_path: Path, finished: Place, kind: str
) -> None:
    place, temporary = Place(tmp_path), tmp_path / "temporary"
    temporary.mkdir()
    place.file.parent.mkdir()
    place.file.write_text(TEXT)
    environment = without_cache(kind, tmp_path) | {"TMPDIR": str(temporary)}
    ended = run("run", place.file, "--results", place.results, cwd=tmp_path, **environment)
    assert ended.returncode == 0, ended.stdout + ended.stderr
    assert ended.stderr.count("the cache is not used") == 1
    assert place.content() == finished.content()
    assert not [*place.results.rglob("*.o"), *place.results.rglob("*.pkl")]
    assert not list(temporary.glob("vibsim-*"))
    assert not [*tmp_path.rglob("shared/*")]


def test_a_results_folder_holds_no_plan(finished: Place) -> None:
    for path in finished.results.rglob("*"):
        if path.is_file() and path.suffix not in {".nc", ".html"}:
            assert b'"batches"' not in path.read_bytes(), path


@pytest.mark.slow
def test_a_changed_plan_is_not_taken(
    place: Place, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    cache = tmp_path / "cache"
    monkeypatch.setenv("VIBSIM_CACHE_DIR", str(cache))
    plans_of([str(place.file)], cached=True)
    (entry,) = (path for path in (cache / "plans").iterdir() if "lock" not in path.name)
    before = entry.read_bytes()
    # what else no plan may hold: `tests/plan/test_plan_digests.py`
    plan = json.loads(before[:-32])
    plan["batches"][0].update(digest="; touch planted; true")
    content = json.dumps(plan).encode()
    # with a right seal, since anybody can make one
    seal = hashlib.sha256(f"plans/{entry.name}\0".encode() + content).digest()
    entry.write_bytes(content + seal)
    ended = place.run("--dry-run")
    assert ended.returncode == 0, ended.stdout + ended.stderr
    assert ended.stdout.strip() == "nothing to do"
    assert entry.read_bytes() == before


IN_THE_WAY = [
    ".vibsim/lock",
    ".vibsim/run.json",
    ".vibsim/deleted.txt",
    ".vibsim/history.js",
    ".vibsim/logs/index.log",
    ".snakemake/metadata/planted",
    "index.html",
    "summary.csv",
    "adhoc/tiny/logs/report.log",
    "adhoc/tiny/benchmarks/report.tsv",
    "adhoc/tiny/figures/.snakemake_timestamp",
    "adhoc/tiny/summary.json",
    "adhoc/tiny/level_06.nc",
]
FOLDERS = [
    ".vibsim",
    ".snakemake",
    ".snakemake/metadata",
    "adhoc",
    "adhoc/tiny",
    "adhoc/tiny/logs",
    "adhoc/tiny/tables",
]


def refused(place: Place, name: str, kind: str) -> None:
    place.change("A tiny", "Another")
    for command in ([], ["--dry-run"]):
        ended = here("run", place.file, "--results", place.results, *command)
        assert ended.returncode == 2, ended.stdout + ended.stderr
        assert f"{place.results / name}: is {kind}, and vibsim writes to real files" in ended.stderr
        assert "remove it, or choose another folder with --results" in ended.stderr


@pytest.mark.parametrize("name", IN_THE_WAY)
def test_a_link_or_a_pipe_in_the_place_of_a_file_is_refused(
    place: Place, tmp_path: Path, name: str
) -> None:
    path, outside = place.results / name, tmp_path / "outside"
    outside.write_text("precious")
    path.unlink(missing_ok=True)
    path.symlink_to(outside)
    refused(place, name, "a symbolic link")
    assert outside.read_text() == "precious"
    path.unlink()
    os.mkfifo(path)
    place.change("Another", "A tiny")
    refused(place, name, "a pipe")


@pytest.mark.parametrize("name", FOLDERS)
def test_a_link_in_the_place_of_a_folder_is_refused(
    place: Place, tmp_path: Path, name: str
) -> None:
    path, outside = place.results / name, tmp_path / "outside"
    path.replace(outside)
    path.symlink_to(outside)
    before = {p: p.stat().st_mtime_ns for p in outside.rglob("*")}
    refused(place, name, "a symbolic link")
    assert {p: p.stat().st_mtime_ns for p in outside.rglob("*")} == before


def test_a_job_by_hand_does_not_write_through_a_link(place: Place, tmp_path: Path) -> None:
    outside = tmp_path / "outside"
    place.tiny.replace(outside)
    place.tiny.symlink_to(outside)
    before = {p: p.read_bytes() for p in outside.rglob("*") if p.is_file()}
    for job in (["simulate", "--level", 6], ["analyse"], ["report"]):
        ended = here(job[0], place.file, *job[1:], "--results", place.results)
        assert ended.returncode == 2, ended.stdout + ended.stderr
    assert {p: p.read_bytes() for p in outside.rglob("*") if p.is_file()} == before


def test_a_results_folder_that_is_a_link_is_used(place: Place, tmp_path: Path) -> None:
    link = tmp_path / "link"
    link.symlink_to(place.results)
    ended = vibsim("run", place.file, "--results", link)
    assert ended.returncode == 0, ended.stdout + ended.stderr
    assert "nothing to do" in ended.stdout


class Payload:
    """What leaves a trace when it is unpickled."""

    def __init__(self, trace: Path) -> None:
        self.trace = trace

    def __reduce__(self) -> tuple[object, tuple[str]]:
        return os.system, (f"touch '{self.trace}'",)


@pytest.mark.slow
def test_nothing_in_a_results_folder_is_loaded_as_code(place: Place, tmp_path: Path) -> None:
    trace, results = tmp_path / "trace", place.results
    code = f"open({str(trace)!r}, 'a').write(__name__)\n"
    planted = [
        ".snakemake/pip-deployments/snakemake_executor_plugin_planted/__init__.py",
        ".snakemake/pip-deployments/snakemake_logger_plugin_planted/__init__.py",
        "sitecustomize.py",
        "usercustomize.py",
        "numpy.py",
        "vibsim.py",
        "Snakefile",
        "workflow/rules/report.smk",
    ]
    for name in planted:
        (results / name).parent.mkdir(parents=True, exist_ok=True)
        (results / name).write_text(code)
    for name in ("bash", "vibsim", "git"):
        (results / name).write_text(f"#!/bin/sh\ntouch '{trace}'\n")
        (results / name).chmod(0o755)
    (results / ".snakemake/iocache").mkdir(exist_ok=True)
    (results / ".snakemake/iocache/latest.pkl").write_bytes(pickle.dumps(Payload(trace)))
    profile = results / "default/config.yaml"
    for path in (profile, results / "profiles/default/config.yaml"):
        path.parent.mkdir(parents=True)
        path.write_text("trust-io-cache: true\n")
    (results / "matplotlibrc").write_text("svg.fonttype: path\nlines.linewidth: 9\n")
    place.change("end: 20.0", "end: 20.0 ")
    shutil.rmtree(place.tiny / "figures")
    before = {name: content for name, content in place.content().items() if "tiny/" in name}
    # an empty place in these means the folder that one is in
    environment = {name: f":{os.environ.get(name, '')}" for name in ("PATH", "PYTHONPATH")}
    ended = run(
        *("run", place.file, "--results", results),
        cwd=tmp_path,
        **environment,
    )
    assert ended.returncode == 0, ended.stdout + ended.stderr
    assert not trace.exists(), trace.read_text()
    assert before.items() <= place.content().items()
    assert (place.tiny / "figures").is_dir()


@pytest.mark.slow
def test_exchanged_results_are_not_taken(place: Place) -> None:
    """Two experiments that differ by their names alone have files of the same numbers, but not the same files."""
    twin = place.file.with_name("twin.yaml")
    twin.write_text(place.file.read_text())
    for job in (["simulate", "--level", "6", "7", "8", "9"], ["analyse"], ["report"]):
        ended = vibsim(job[0], twin, *job[1:], "--results", place.results)
        assert ended.returncode == 0, ended.stderr
    folders = place.tiny, place.tiny.with_name("twin")
    for name in ("level_06.nc", "convergence.nc", "summary.json"):
        exchange(*(folder / name for folder in folders))
    jobs = {"analyse": ["level_06.nc"], "report": ["convergence.nc", "summary.json"]}
    for job, names in jobs.items():
        ended = vibsim(job, place.file, "--results", place.results)
        assert ended.returncode == 1, ended.stdout + ended.stderr
        assert all(f"{place.tiny / name}: it " in ended.stderr for name in names)
    assert vibsim("report", "--results", place.results).returncode == 0
    assert (place.results / "index.html").read_text().count("it is adhoc/t") == 2


def exchange(one: Path, other: Path) -> None:
    content = one.read_bytes()
    one.write_bytes(other.read_bytes())
    other.write_bytes(content)
