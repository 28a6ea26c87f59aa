"""An installed vibsim, far from any checkout: shipped experiments and a user's own, in an empty folder."""

from __future__ import annotations

import os
import subprocess
import sys
import sysconfig
import tarfile
import venv
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
OWN = """\
title: Nonlinear pendulum on four levels
model: {kind: pendulum, g: 1.0, L: 1.0}
initial: {theta: 1.0, omega: 0.0}
time: {end: 20.0}
levels: {from: 6, to: 9}
schemes: [central]
checks:
  - {converges: theta, order: 2}
"""
BUILD = "import sys; from setuptools import build_meta; build_meta.{}(sys.argv[1])"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return an empty folder; beside it lies an environment with the wheel of the source archive."""
    base = tmp_path_factory.mktemp("installed")
    listed = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    names = subprocess.run(listed, cwd=ROOT, capture_output=True, check=True).stdout.split(b"\0")
    source = base / "source"
    for name in filter(None, map(os.fsdecode, names)):
        (source / name).parent.mkdir(parents=True, exist_ok=True)
        if (ROOT / name).is_file():
            (source / name).write_bytes((ROOT / name).read_bytes())
    build(source, "build_sdist", base)
    (archive,) = base.glob("*.tar.gz")
    with tarfile.open(archive) as file:
        file.extractall(base / "unpacked", filter="data")
    (unpacked,) = (base / "unpacked").iterdir()
    build(unpacked, "build_wheel", base)
    (wheel,) = base.glob("*.whl")
    venv.create(base / "environment", symlinks=True)
    # what vibsim needs is that of this environment; only vibsim itself is installed
    site = next((base / "environment/lib").iterdir()) / "site-packages"
    (site / "needed.pth").write_text(sysconfig.get_path("purelib") + "\n")
    install = [sys.executable, "-m", "pip", "--python", str(base / "environment/bin/python")]
    install += ["install", "--quiet", "--no-deps", "--no-index", str(wheel)]
    subprocess.run(install, check=True)
    (base / "empty").mkdir()
    return base / "empty"


def build(source: Path, what: str, target: Path) -> None:
    program = [sys.executable, "-c", BUILD.format(what), str(target)]
    subprocess.run(program, cwd=source, check=True, capture_output=True)


def vibsim(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    program = folder.parent / "environment/bin/vibsim"
    return subprocess.run([program, *words], cwd=folder, capture_output=True, text=True)


@pytest.mark.slow
def test_a_wheel_runs_a_file_of_the_user_and_a_shipped_experiment_in_an_empty_folder(
    folder: Path,
) -> None:
    (folder / "own.yaml").write_text(OWN)
    for words in (["check", "own.yaml"], ["plan", "own.yaml"], ["list", "experiments"]):
        found = vibsim(folder, *words)
        assert found.returncode == 0, found.stderr
    found = vibsim(folder, "run", "-q", "own.yaml", "pendulum_lab/linear_limit")
    assert found.returncode == 0, found.stdout + found.stderr
    for name in ("adhoc/own", "pendulum_lab/linear_limit"):
        page = (folder / "results" / name / "report.html").read_text()
        # the command and the file that a reader can use here
        assert f"<code>vibsim run {'own.yaml' if 'own' in name else name}" in page
        assert ".venv/bin" not in page
    shipped = next(folder.parent.glob("environment/lib/*/site-packages/vibsim/shipped"))
    assert f"{shipped}/configs/pendulum_lab/linear_limit.yaml" in page
    assert {path.name for path in folder.iterdir()} == {"own.yaml", "results"}
    assert (shipped / "workflow/profiles/slurm/config.yaml").is_file()
    other = ["--executor", "cluster-generic", "--", "--cluster-generic-submit-cmd", "sh"]
    found = vibsim(folder, "run", "--dry-run", "own.yaml", *other)
    assert found.stdout == "nothing to do\n", found.stderr


@pytest.mark.slow
def test_a_new_file_of_an_installed_vibsim_has_its_schema_beside_it(folder: Path) -> None:
    found = vibsim(folder, "new", "mine.yaml", "--like", "pendulum_lab/theta_convergence")
    assert found.returncode == 0, found.stderr
    assert (folder / "vibsim.schema.json").is_file()
    assert vibsim(folder, "check", "mine.yaml").returncode == 0
