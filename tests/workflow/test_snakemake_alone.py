"""vibsim for who uses Snakemake itself: imported as a module, named on its command line, in its report."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import tarfile
from pathlib import Path

import pytest

from .conftest import ROOT, Place


def snakemake(folder: Path, *options: object) -> str:
    command = [sys.executable, "-m", "snakemake", "--cores", "2", *map(str, options)]
    ended = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stdout + ended.stderr
    return ended.stdout + ended.stderr


@pytest.mark.slow
def test_the_documented_module_makes_shipped_and_own_experiments(
    place: Place, tmp_path: Path
) -> None:
    page = (ROOT / "docs/cluster.md").read_text()
    (text,) = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    folder = tmp_path / "mine"
    folder.mkdir()
    (folder / "Snakefile").write_text(text)
    shutil.copy(place.file, folder / "my_pendulum.yaml")
    snakemake(folder)
    lines = (folder / "verdicts.txt").read_text().splitlines()
    assert lines == [
        'adhoc/my_pendulum/summary.json: "status": "PASS",',
        'pendulum_lab/linear_limit/summary.json: "status": "PASS",',
    ]


@pytest.fixture
def named(place: Place, tmp_path: Path) -> tuple[object, ...]:
    """Options that name finished results without `vibsim run`."""
    file, results = tmp_path / "tiny.yaml", tmp_path / "results"
    shutil.copy(place.file, file)
    shutil.copytree(place.results, results)
    config = (f"experiments={file}", f"results={results}")
    return ("--snakefile", ROOT / "workflow/Snakefile", "--config", *config)


@pytest.mark.slow
def test_one_experiment_is_named_as_text(named: tuple[object, ...], tmp_path: Path) -> None:
    text = snakemake(tmp_path, "--dry-run", *named, "--forcerun", "report")
    # everything else is up to date
    found = set(re.findall(r"^ *(?:local)?rule (\w+):", text, re.MULTILINE))
    assert found == {"report", "index", "default"}


@pytest.mark.slow
def test_a_report_has_results_with_captions_and_labels(
    named: tuple[object, ...], tmp_path: Path
) -> None:
    snakemake(tmp_path, *named, "--report", tmp_path / "report.html")
    page = (tmp_path / "report.html").read_text()
    for label in ("verdicts", "page", "figure: differences_theta_0_central", "table: checks"):
        assert f'"shows": "{label}"' in page
    for caption in ("A figure of adhoc/tiny", "A table of adhoc/tiny", "The page of adhoc/tiny"):
        assert caption in page


@pytest.mark.slow
def test_the_documented_archive_holds_a_checkout_that_runs(tmp_path: Path) -> None:
    (options,) = re.findall(
        r"snakemake (.* --archive )", (ROOT / "docs/cluster.md").read_text(), re.MULTILINE
    )
    checkout, unpacked = tmp_path / "checkout", tmp_path / "unpacked"
    shutil.copytree(ROOT / "workflow", checkout / "workflow")
    shutil.copytree(ROOT / "configs", checkout / "configs")
    shutil.copy(ROOT / "Snakefile", checkout)
    for words in (["init", "-q"], ["add", "."]):
        subprocess.run(["git", *words], cwd=checkout, check=True)
    snakemake(checkout, *options.split(), tmp_path / "archive.tar.gz")
    with tarfile.open(tmp_path / "archive.tar.gz") as archive:
        archive.extractall(unpacked, filter="data")
    assert (unpacked / "configs/pendulum_lab/linear_limit.yaml").exists()
    text = snakemake(unpacked, "--dry-run", "--config", "experiments=pendulum_lab/linear_limit")
    assert "rule simulate" in text
