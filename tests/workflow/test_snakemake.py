"""The workflow by hand, its style, and its cost."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest
from forked import vibsim

from .conftest import ROOT, TEXT, Place
from .test_faults import flip

BIN = Path(sys.executable).parent


def snakemake(*arguments: object) -> subprocess.CompletedProcess[str]:
    command = [str(BIN / "snakemake"), "--snakefile", str(ROOT / "Snakefile"), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=300)


def by_hand(place: Place, *options: str) -> subprocess.CompletedProcess[str]:
    config = place.folder / "config.json"
    config.write_text(json.dumps({"experiments": [str(place.file)], "results": str(place.results)}))
    return snakemake("--configfile", config, "--cores", 2, *options)


@pytest.mark.slow
def test_snakemake_by_hand_has_nothing_to_do_after_a_run(place: Place) -> None:
    ended = by_hand(place)
    assert ended.returncode == 0, ended.stderr
    assert "Nothing to be done" in ended.stdout + ended.stderr


@pytest.mark.slow
def test_every_kind_of_job_works_by_hand_and_is_on_record(place: Place) -> None:
    place.change("8, 9]", "8, 9, 10]")
    assert by_hand(place).returncode == 0
    ended = place.run("--dry-run")
    assert ended.stdout.strip() == "nothing to do"
    assert ended.stderr == ""
    flip(place.tiny / "report.html")
    assert place.changed() == {"report.html"}


@pytest.mark.slow
def test_snakemake_by_hand_rebuilds_a_damaged_file_at_the_second_try(place: Place) -> None:
    path = place.tiny / "level_07.nc"
    path.write_bytes(path.read_bytes()[:-1])
    assert by_hand(place).returncode == 1
    assert not path.exists()
    assert by_hand(place).returncode == 0


def test_rules_are_in_style() -> None:
    files = [ROOT / "Snakefile", *sorted((ROOT / "workflow/rules").glob("*.smk"))]
    assert len((ROOT / "Snakefile").read_text().splitlines()) <= 50
    subprocess.run([BIN / "snakefmt", "--check", *files], check=True, capture_output=True)


@pytest.mark.slow
def test_a_job_imports_what_it_uses_and_no_more(place: Place, tmp_path: Path) -> None:
    command = ["simulate", str(place.file), "--level", "6", "--out", str(tmp_path / "x.nc")]
    program = (
        "import sys; from vibsim.cli import main\n"
        f"assert main({[*command, '--results', str(place.results)]!r}) == 0\n"
        "heavy = {'xarray', 'matplotlib', 'pandas', 'snakemake', 'jinja2', 'rich'}\n"
        "assert not heavy & set(sys.modules), heavy & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", program], check=True)


def test_refusals_run_nothing(tmp_path: Path) -> None:
    place = Place(tmp_path)
    place.file.parent.mkdir()
    place.file.write_text(TEXT)
    bad = place.file.with_name("bad.yaml")
    bad.write_text(TEXT.replace("end: 20.0", "end: -20.0"))
    ended = place.run(files=[place.file, bad])
    assert ended.returncode == 2
    assert f"{bad}:5: time.end" in ended.stderr
    assert "Traceback" not in ended.stderr
    assert not place.results.exists()


@pytest.mark.slow
def test_jobs_are_usable_by_hand(place: Place, tmp_path: Path, finished: Place) -> None:
    common = ["--results", place.results]
    out = tmp_path / "out"
    for arguments in (
        ["simulate", place.file, "--level", 6, "--out", out / "level_06.nc"],
        ["analyse", place.file, "--out", out],
        ["report", place.file, "--out", out, "--formats", "svg,png"],
    ):
        ended = vibsim(*arguments, *common)
        assert ended.returncode == 0, ended.stderr
    for name in ("level_06.nc", "convergence.nc", "summary.json"):
        assert (out / name).read_bytes() == (finished.tiny / name).read_bytes()
    assert list((out / "figures").glob("*.png"))
    assert (out / "report.html").is_file()
