"""`vibsim verify` notices any bit of any file, and says why a file that is made again differs."""

from __future__ import annotations

import random
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from forked import vibsim
from torture.laboratory import problems, vouched_for

from vibsim import store
from vibsim.cli import made_files
from vibsim.cli.chosen_plans import plans_of
from vibsim.cli.commands import verify
from vibsim.store.reading import read_provenance

from .conftest import Place, here

FLIPS = 1000


def flips(place: Place, number: int) -> Iterator[tuple[Path, int]]:
    """Yield files, each kind in turn, with a bit flipped; it is flipped back afterwards."""
    chosen = random.Random(23)
    kinds: dict[str, list[Path]] = {}
    for path in vouched_for(place):
        kinds.setdefault(f"{path.parent.name}{path.suffix}", []).append(path)
    for k in range(number):
        path = chosen.choice(list(kinds.values())[k % len(kinds)])
        content = path.read_bytes()
        bit = chosen.randrange(8 * len(content))
        changed = bytearray(content)
        changed[bit // 8] ^= 1 << bit % 8
        path.write_bytes(changed)
        yield path, bit
        path.write_bytes(content)


@pytest.mark.parametrize("number", [30, pytest.param(FLIPS, marks=pytest.mark.slow)])
def test_every_flipped_bit_is_noticed_and_its_file_is_named(place: Place, number: int) -> None:
    assert problems(place) == {}
    for path, bit in flips(place, number):
        assert path.relative_to(place.results).as_posix() in problems(place), bit
    assert problems(place) == {}


def test_the_documentation_is_no_result(place: Place) -> None:
    """As ``make docs`` leaves it, with folders where a collection has its experiments."""
    pages = [place.results / "docs" / name for name in ("index.html", "docs/tutorial.html")]
    try:
        for path in pages:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text("a page")
        assert problems(place) == {}
        (other := place.results / "doc").mkdir()
        (other / "index.html").write_text("a page")
        assert list(problems(place)) == ["doc/index.html"]
    finally:
        for name in ("docs", "doc"):
            shutil.rmtree(place.results / name, ignore_errors=True)


def cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-1])


@pytest.mark.parametrize("harm", [cut, Path.unlink, lambda path: path.write_bytes(b"")])
def test_what_is_truncated_missing_or_empty_is_noticed(
    place: Place, harm: Callable[[Path], None]
) -> None:
    files = vouched_for(place)
    # one of each kind; a manifest without its last line end says the same
    named = {f"{path.parent.name}{path.suffix}": path for path in files}.values()
    assert len(named) == 9
    for path in named:
        before = path.read_bytes()
        harm(path)
        told = problems(place)
        is_end = harm is cut and path.suffix == ".jsonl"
        assert bool(told) is not is_end, path
        if path.suffix != ".jsonl":
            assert list(told) == [path.relative_to(place.results).as_posix()]
        path.write_bytes(before)


@pytest.mark.parametrize(
    "name",
    ["adhoc/tiny/figures/mine.svg", "adhoc/tiny/level_03.nc", "adhoc/tiny/.x", "a.txt", "adhoc/b"],
)
def test_what_no_run_made_is_noticed(place: Place, name: str) -> None:
    (place.results / name).write_text("x")
    assert list(problems(place)) == [name]
    ended = here("verify", "--results", place.results)
    assert ended.returncode == 1
    assert f"{name}: is not in the manifest" in ended.stdout


def test_a_foreign_folder_and_a_lost_one_are_noticed(place: Place) -> None:
    for name in ("..etc", ".", "a..b"):
        (place.results / f".vibsim/made/{name}.jsonl").touch()
    assert problems(place) == {}
    shutil.copytree(place.tiny, place.results / "other/copy")
    assert list(problems(place)) == [".vibsim/made/other.copy.jsonl"]
    shutil.rmtree(place.results / "other")
    shutil.rmtree(place.tiny)
    told = problems(place)
    assert "adhoc/tiny/level_06.nc" in told
    assert set(told.values()) == {"is missing"}


@pytest.mark.slow
def test_a_damaged_manifest_is_named_and_the_next_run_mends_it(
    place: Place, finished: Place
) -> None:
    manifest = made_files.path(place.results, "adhoc/tiny")
    text = manifest.read_text()
    manifest.write_text(text.replace(".svg", ".svh", 1))
    told = problems(place)
    assert list(told) == [".vibsim/made/adhoc.tiny.jsonl"]
    assert "is damaged, so 41 files cannot be compared" in told[".vibsim/made/adhoc.tiny.jsonl"]
    assert place.run().returncode == 0
    assert problems(place) == {}
    assert place.content() == finished.content()


@pytest.mark.slow
def test_manifests_of_two_experiments_that_changed_places_are_damaged(
    place: Place, finished: Place
) -> None:
    manifests = made_files.path(place.results, "adhoc/tiny"), made_files.path(place.results, "")
    texts = [manifest.read_text() for manifest in manifests]
    for manifest, text in zip(manifests, reversed(texts), strict=True):
        manifest.write_text(text)
    told = problems(place)
    assert sorted(told) == [".vibsim/made/adhoc.tiny.jsonl", ".vibsim/made/index.jsonl"]
    assert place.run().returncode == 0
    assert problems(place) == {}
    assert place.content() == finished.content()


@pytest.mark.slow
def test_changes_of_runs_are_no_damage(place: Place) -> None:
    """Another title, fewer levels, a second experiment with the index made again, a job by hand, a copy."""
    other = place.file.with_name("other.yaml")
    shutil.copy(place.file, other)
    place.change("A tiny", "Another")
    place.change("8, 9]", "8]")
    place.change("order: scheme", "order: 2")
    assert place.run(files=[other, place.file]).returncode == 0
    assert problems(place) == {}
    assert not (place.tiny / "level_09.nc").exists()
    assert here("report", other, "--results", place.results).returncode == 0
    assert problems(place) == {}
    copy = place.folder / "copy"
    shutil.copytree(place.results, copy, copy_function=shutil.copyfile)
    assert here("verify", "--results", copy).returncode == 0
    # the manifest of a run that ended is one line, in order
    for key in ("adhoc/tiny", ""):
        known = made_files.load(place.results, key)
        assert list(known) == sorted(known)
        assert made_files.path(place.results, key).read_text().count("\n") == 1


@pytest.mark.slow
def test_a_job_that_is_killed_before_its_files_are_on_record_damages_nothing(
    place: Place, monkeypatch: pytest.MonkeyPatch
) -> None:
    place.change("A tiny", "Another")
    place.change("order: scheme", "order: 2")

    def killed(*_: object) -> None:
        raise SystemExit(137)

    monkeypatch.setattr(made_files, "add", killed)
    for words in (["analyse", place.file], ["report", place.file], ["report"]):
        with pytest.raises(SystemExit):
            here(*words, "--results", place.results)
        assert made_files.CHANGED not in problems(place).values()
    assert "adhoc/tiny/report.html" in problems(place)
    monkeypatch.undo()
    assert place.run().returncode == 0
    assert problems(place) == {}


@pytest.mark.slow
def test_an_interrupted_run_is_no_damage_and_not_whole(place: Place) -> None:
    # a report begins with its figures, when its page is deleted already
    (place.tiny / "report.html").unlink()
    cut(place.tiny / "figures/thumbnail.svg")
    assert problems(place) == {
        "adhoc/tiny/figures/thumbnail.svg": "is of a report that was not finished",
        "adhoc/tiny/report.html": "is missing",
    }
    shutil.rmtree(place.results)
    done = here("simulate", place.file, "--level", 6, 7, "--results", place.results)
    assert done.returncode == 0, done.stderr
    told = problems(place)
    assert told.pop("index.html") == "there are no results yet: run it first"
    assert set(told) == {f"adhoc/tiny/{name}" for name in verify.LAST}
    assert set(told.values()) == {"is not made yet: the last run did not end"}
    assert place.run().returncode == 0
    assert problems(place) == {}


@pytest.mark.slow
def test_what_is_made_again_has_the_same_bytes(place: Place) -> None:
    ended = vibsim("verify", place.file, "--results", place.results, "--cores", 2)
    assert ended.stdout.splitlines() == [
        "adhoc/tiny: all 41 files are as they were written",
        "adhoc/tiny: recomputed, all 41 files have the same bytes",
    ]
    assert ended.returncode == 0


@pytest.mark.slow
def test_what_is_made_again_of_another_input_differs(place: Place) -> None:
    place.change("theta: 1.0", "theta: 1.1")
    ended = vibsim("verify", place.file, "--results", place.results)
    assert ended.returncode == 1
    whole, differs = ended.stdout.splitlines()
    assert whole.endswith("all 41 files are as they were written")
    assert "recomputed, other bytes (initial.theta: 1.0 -> 1.1): convergence.nc, " in differs


def put(place: Place, name: str, **parts: str) -> None:
    """Make the manifest tell something else of a file."""
    known = made_files.load(place.results, "adhoc/tiny")
    entry = known[name]._replace(digest=made_files.content(place.tiny / name), **parts)
    made_files.replace(place.results, "adhoc/tiny", known | {name: entry})


def other_version(place: Place) -> None:
    """Give the comparison of levels the provenance of an older numpy."""
    path = place.tiny / "convergence.nc"
    record, made = store.read(path), read_provenance(path)
    made["versions"]["numpy"] = "1.0"
    digest = str(record.attrs["digest"])
    store.write(path, record, digest=digest, provenance=made)
    put(place, path.name)


CAUSES: dict[str, Callable[[Place], object]] = {
    "initial.theta: 1.0 -> 1.1": lambda place: place.change("theta: 1.0", "theta: 1.1"),
    "title: A tiny pendulum -> Other": lambda place: place.change("A tiny pendulum", "Other"),
    "numpy: 1.0 -> ": other_version,
    "the title, or the code or the": lambda place: put(place, "report.html", job="0" * 64),
    "made on another machine (abacus; this is ": lambda place: put(
        place, "report.html", machine="abacus"
    ),
    "input, versions, code and machine are the same": lambda place: None,
    "its bytes are not those that were written": lambda place: (
        place.tiny / "report.html"
    ).write_text("x"),
    "is missing": lambda place: (place.tiny / "report.html").unlink(),
}


@pytest.mark.parametrize("cause", CAUSES)
def test_the_cause_of_a_difference_is_named(place: Place, finished: Place, cause: str) -> None:
    page = place.tiny / "report.html"
    page.write_text(page.read_text() + " ")
    put(place, page.name)
    CAUSES[cause](place)
    [plan] = plans_of([str(place.file)])
    told = verify.differences(plan, place.results, finished.results)
    assert [words for words in told if words.startswith(cause)], told
    assert page.name in next(iter(told.values()))


def test_what_was_never_run_is_not_recomputed(place: Place) -> None:
    shutil.rmtree(place.results)
    place.results.mkdir()
    ended = vibsim("verify", place.file, "--results", place.results)
    assert ended.stdout == "adhoc/tiny: there are no results yet: run it first\n"
    assert ended.returncode == 1
