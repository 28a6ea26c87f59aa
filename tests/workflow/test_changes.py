"""A run notices what became of the results since they were made, and removes what nobody asks for any more."""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path
from typing import Any

import pytest
from forked import vibsim

from vibsim.core.processes import started

from .conftest import TEXT, Place
from .test_attacks import IN_THE_WAY
from .test_faults import flip

END_PRODUCTS = {
    "report.html": ["report", "index"],
    "figures/thumbnail.svg": ["report", "index"],
    "tables/best_values.csv": ["report", "index"],
    "../../index.html": ["index"],
    "../../summary.csv": ["index"],
    "summary.json": ["analyse", "report", "index"],
    "convergence.nc": ["analyse", "report", "index"],
    "level_07.nc": ["level_07", "analyse", "report", "index"],
}


def same_time(path: Path, harm: Any) -> None:
    """Change a file and leave its size, its time and its inode as they were."""
    status = path.stat()
    harm(path)
    os.utime(path, ns=(status.st_atime_ns, status.st_mtime_ns))


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    [n if n.startswith("fig") else pytest.param(n, marks=pytest.mark.slow) for n in END_PRODUCTS],
)
def test_a_dry_run_tells_of_every_changed_result_and_deletes_nothing(
    place: Place, name: str
) -> None:
    place.changed()
    flip(place.tiny / name)
    before = place.content()
    ended = place.run("--dry-run", "--json")
    assert [job["rule"] for job in json.loads(ended.stdout)["jobs"]] == [
        "simulate" if job.startswith("level") else job for job in END_PRODUCTS[name]
    ]
    assert "would be deleted and made again" in ended.stderr
    assert Path(name).name in ended.stderr
    assert place.content() == before


@pytest.mark.slow
def test_every_changed_or_missing_result_comes_back_with_its_bytes(
    place: Place, finished: Place
) -> None:
    for name in END_PRODUCTS:
        flip(place.tiny / name)
    (place.tiny / "figures/thumbnail.svg").unlink()
    (place.tiny / "level_06.nc").unlink()
    ended = place.run()
    assert ended.returncode == 0, ended.stdout + ended.stderr
    assert "to be made again" in ended.stderr
    for name in ("report.html", "index.html", "summary.csv", "convergence.nc", "level_07.nc"):
        assert name in ended.stderr
    assert place.content() == finished.content()
    assert place.jobs() == []


@pytest.mark.slow
def test_a_missing_table_is_noticed(place: Place) -> None:
    next((place.tiny / "tables").glob("*.csv")).unlink()
    ended = place.run("--dry-run", "--json")
    assert "is missing" in ended.stderr
    assert [job["rule"] for job in json.loads(ended.stdout)["jobs"]] == ["report", "index"]


@pytest.mark.slow
def test_verify_compares_every_digest(place: Place) -> None:
    place.changed()
    same_time(place.tiny / "figures/thumbnail.svg", flip)
    same_time(place.tiny / "level_08.nc", flip)
    assert place.changed() == set()
    ended = place.run("--verify", "--dry-run", "-v")
    assert "thumbnail.svg" in ended.stderr
    assert "level_08.nc" in ended.stderr
    assert [line.split()[0] for line in ended.stdout.splitlines()] == [
        *("simulate", "analyse", "report", "index:"),
    ]


@pytest.mark.slow
def test_a_copy_without_its_times_is_read_and_not_computed_again(
    finished: Place, tmp_path: Path
) -> None:
    shutil.copytree(finished.folder, tmp_path / "copy", copy_function=shutil.copyfile)
    copy = Place(tmp_path / "copy")
    times = {path: path.stat().st_mtime_ns for path in finished.tiny.glob("*.nc")}
    assert copy.jobs() == []
    assert {p: (copy.tiny / p.name).stat().st_mtime_ns for p in times} == times


@pytest.mark.slow
def test_without_a_record_seals_are_compared_and_the_rest_is_made_again(
    place: Place, finished: Place
) -> None:
    """So it is after a kill between a file and its entry, and with a record that is no record."""
    for path in (place.results / ".vibsim/made").iterdir():
        path.write_text('{"../../x": [1, 2, 3, "a"]}\n[]\n{"level_06.nc": [1]}\nnull\n{')
    assert place.changed() == {"report.html", "index.html", "summary.csv"}
    assert place.run().returncode == 0
    assert place.content() == finished.content()
    assert place.changed() == set()


@pytest.mark.slow
@pytest.mark.parametrize("content", [b"\xc0", b"[1]", b"{}", b""])
def test_what_an_edit_makes_stale_is_made_again_also_without_records_of_the_workflow(
    place: Place, content: bytes
) -> None:
    """Snakemake does not start with such records, or takes them for results that are up to date."""
    for path in (place.results / ".snakemake/metadata").iterdir():
        path.write_bytes(content)
    place.change("A tiny", "Another")
    assert place.jobs() == ["report", "index"]
    if content == b"\xc0":
        ended = place.run()
        assert ended.returncode == 0, ended.stdout + ended.stderr
        assert "Another" in (place.tiny / "report.html").read_text()


def test_what_is_as_it_was_is_not_read(place: Place, monkeypatch: pytest.MonkeyPatch) -> None:
    from vibsim.cli import made_files

    assert place.changed() == set()
    monkeypatch.setattr(made_files, "content", None)
    assert place.changed() == set()


@pytest.mark.slow
def test_after_another_title_only_the_page_is_made_again_and_nothing_through_another_name(
    place: Place, tmp_path: Path
) -> None:
    """Files of the results that have a second name elsewhere are put in their place anew, not written."""
    place.changed()
    outside = tmp_path / "outside"
    outside.mkdir()
    written = [name for name in IN_THE_WAY if (place.results / name).exists()]
    for k, name in enumerate(written):
        os.link(place.results / name, outside / str(k))
    elsewhere = [(outside / str(k)).read_bytes() for k in range(len(written))]
    before = {p: (p.read_bytes(), p.stat()) for p in place.tiny.glob("*.nc")}
    summary = json.loads((place.tiny / "summary.json").read_text())
    place.change("A tiny pendulum", "Another")
    ended = place.run("--json")
    assert json.loads(ended.stdout)["experiments"][0]["title"] == "Another"
    for path, (content, status) in before.items():
        now = path.stat()
        assert path.read_bytes() == content
        assert (now.st_ino, now.st_mtime_ns) == (status.st_ino, status.st_mtime_ns)
    assert "Another" in (place.tiny / "report.html").read_text()
    assert "Another" in (place.results / "index.html").read_text()
    now = json.loads((place.tiny / "summary.json").read_text())
    assert now["title"] == "Another"
    assert now.keys() == summary.keys()
    assert {key for key, value in now.items() if value != summary[key]} == {"title", "integrity"}
    assert [(outside / str(k)).read_bytes() for k in range(len(written))] == elsewhere


def touch(path: Path) -> Path:
    path.parent.mkdir(exist_ok=True)
    path.write_text("x")
    return path


@pytest.mark.slow
def test_what_is_no_longer_asked_for_is_removed_and_nothing_else(place: Place) -> None:
    place.change("8, 9]", "8]")
    touch(place.tiny / "best.nc")
    shards = [touch(place.tiny / f"level_07/shard_000{n}.nc") for n in (0, 1)]
    other = touch(place.tiny / "level_09/mine.txt")
    users = [touch(place.tiny / name) for name in ("level_9.nc", "level_06.txt", "my.nc")]
    # of a writer that was killed, and of one that is at work
    half = touch(place.tiny / ".level_21.nc.1-0-ab.part")
    me = os.getpid()
    users.append(touch(place.tiny / f".level_21.nc.{me}-{started(me)}-ab.part"))
    ended = place.run("--dry-run")
    assert "would be removed" in ended.stderr
    assert half.exists()
    assert (place.tiny / "level_09.nc").is_file()
    assert (place.tiny / "best.nc").is_file()
    ended = place.run()
    assert ended.returncode == 0, ended.stderr
    assert "removed, no longer asked for: " in ended.stderr
    assert not (place.tiny / "level_09.nc").exists()
    assert not (place.tiny / "best.nc").exists()
    assert not shards[0].parent.exists()
    assert not half.exists()
    assert all(path.is_file() for path in (*users, other))


@pytest.mark.slow
def test_two_files_of_one_name_do_not_replace_each_other(place: Place) -> None:
    assert place.run().returncode == 0
    other = place.folder / "elsewhere/tiny.yaml"
    other.parent.mkdir()
    other.write_text(TEXT.replace("A tiny", "Another"))
    before = place.content()
    for options in ([], ["--dry-run"]):
        ended = place.run(*options, files=[other])
        assert ended.returncode == 2
        assert str(other) in ended.stderr
        assert str(place.file) in ended.stderr
        assert "--results" in ended.stderr
    assert place.content() == before
    place.file.unlink()
    assert place.run("--dry-run", files=[other]).returncode == 0


@pytest.mark.slow
def test_another_spelling_of_a_path_is_the_same_file(place: Place) -> None:
    assert place.run().returncode == 0
    link = place.folder / "link"
    link.symlink_to(place.file.parent)
    ended = vibsim(
        "run", "link/tiny.yaml", "--results", place.results, "--dry-run", cwd=place.folder
    )
    assert (ended.returncode, ended.stdout.strip()) == (0, "nothing to do")
