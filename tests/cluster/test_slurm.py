"""A sweep of 40 000 members on a real SLURM of two nodes: what is killed there costs time and no byte."""

from __future__ import annotations

import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from vibsim.cli.run import pending

from .slurm import NODES, Cluster, cluster, missing

pytestmark = pytest.mark.slow

SWEEP = """\
title: Pendulums of 200 amplitudes and 200 lengths
model: {kind: pendulum}
initial: {theta: 0.1, omega: 0.0}
time: {end: 20.0}
levels: {from: 8, to: 13}
schemes: [central]
sweep:
  initial.theta: {linspace: [0.1, 2.5, 200]}
  model.L: {linspace: [0.5, 2.0, 200]}
checks:
  - {converges: theta, order: 2}
"""
# its jobs take seconds
OPTIONS = "-- --group-components simulate=1"
KINDS = (".nc", ".json", ".html", ".csv", ".tex", ".svg")
PATIENCE = 300.0
"""Seconds for anything that is waited for; a busy machine takes its time."""


@pytest.fixture(scope="module")
def nodes() -> Iterator[Cluster]:
    if why := missing():
        pytest.skip(f"NO SLURM, so nothing of a cluster is tested: {why}")
    with (
        tempfile.TemporaryDirectory(prefix="vibsim-") as folder,
        cluster(Path(folder) / "slurm") as made,
    ):
        yield made


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "pendulums.yaml"
    path.write_text(SWEEP)
    return path


@pytest.fixture
def options(tmp_path: Path) -> str:
    """Return the options of a run all of whose jobs go to SLURM, also those that take little."""
    shipped = Path(__file__).parents[2] / "workflow/profiles/slurm/config.yaml"
    profile = tmp_path / "profile"
    profile.mkdir()
    text = shipped.read_text()
    assert "here: 20" in text
    (profile / "config.yaml").write_text(text.replace("here: 20", "here: 0"))
    return f"--profile {profile} {OPTIONS}"


def content(results: Path) -> dict[str, bytes]:
    return {
        path.relative_to(results).as_posix(): path.read_bytes()
        for path in results.rglob("*")
        if path.suffix in KINDS and not {".snakemake", ".vibsim"} & set(path.parts)
    }


@contextmanager
def run(
    nodes: Cluster, file: Path, results: Path, options: str = ""
) -> Iterator[subprocess.Popen[str]]:
    command = [sys.executable, "-m", "vibsim", "run", str(file), "--results", str(results)]
    driver = subprocess.Popen(
        [*command, *options.split()],
        env=nodes.environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    try:
        yield driver
    finally:
        driver.kill()
        driver.communicate()


def wait(found: Callable[[], list[str]], driver: subprocess.Popen[str]) -> list[str]:
    """Return what is found as soon as there is something, while a run goes on."""
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline and driver.poll() is None:
        if rows := found():
            return rows
        time.sleep(0.2)
    driver.kill()
    raise AssertionError(driver.communicate()[0])


def all_told(driver: subprocess.Popen[str]) -> str:
    """Return what a run says until it ends."""
    return driver.communicate(timeout=PATIENCE)[0]


def test_a_killed_driver_job_and_node_lose_nothing(
    nodes: Cluster, file: Path, tmp_path: Path, options: str
) -> None:
    with run(nodes, file, tmp_path / "here") as driver:
        text = all_told(driver)
        assert driver.returncode == 0, text
    results = tmp_path / "shared results"
    with run(nodes, file, results, options) as driver:
        wait(lambda: nodes.jobs("RUNNING"), driver)

    known = set(nodes.jobs("all"))

    def new() -> list[str]:
        return [job for job in nodes.jobs("RUNNING") if job not in known]

    with run(nodes, file, results, options) as driver:
        cancelled, *_ = wait(new, driver)
        nodes.ask("scancel", cancelled)
        # a job that has just begun does not end before its node fails
        known.update(nodes.jobs("all"))
        job, *_ = wait(new, driver)
        node = nodes.ask("squeue", "--noheader", "--jobs", job, "--format", "%N")
        nodes.fail(node)
        wait(lambda: nodes.jobs("NODE_FAIL"), driver)
        nodes.start_node(node)
        text = all_told(driver)
        assert driver.returncode == 0, text
    # none was killed for its memory or its time, and none failed for another reason
    assert nodes.jobs("CANCELLED,FAILED,OUT_OF_MEMORY,TIMEOUT") == [cancelled]
    wanted, found = content(tmp_path / "here"), content(results)
    assert found.keys() == wanted.keys()
    assert [name for name in wanted if found[name] != wanted[name]] == []


def test_an_interrupt_cancels_what_runs_and_what_waits(
    nodes: Cluster, file: Path, tmp_path: Path, options: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    nodes.ask("scontrol", "update", "nodename=ALL", "state=drain", "reason=test")
    monkeypatch.setenv("SLURM_CONF", nodes.environment["SLURM_CONF"])
    with run(nodes, file, tmp_path, options) as driver:
        wait(lambda: nodes.jobs("PENDING")[1:], driver)
        # which of its sentences about drained nodes SLURM gives, and to which job, depends on the moment
        wait(lambda: [reason for reason in pending.reasons(tmp_path) if "Node" in reason], driver)
        assert pending.reasons(tmp_path).total() == 2
        nodes.ask("scontrol", "update", f"nodename={NODES[0]}", "state=resume")
        wait(lambda: nodes.jobs("RUNNING"), driver)
        driver.send_signal(signal.SIGTERM)
        text = all_told(driver)
        assert driver.returncode == 128 + signal.SIGTERM, text
    assert nodes.jobs("PENDING,RUNNING,COMPLETING") == []
    nodes.ask("scontrol", "update", f"nodename={NODES[1]}", "state=resume")
