"""What runs again after a change, and what does not."""

from __future__ import annotations

import html
import json
from dataclasses import replace

import pytest
from thinned import thinned

from vibsim.cli.chosen_plans import plans_of
from vibsim.cli.run import command, reasons
from vibsim.store.reading import read_provenance

from .conftest import TEXT, Place

EVERYTHING = {"level_06", "level_07", "level_08", "level_09", "analyse", "report", "index"}


@pytest.mark.slow
def test_a_finished_experiment_at_another_place_has_nothing_to_do(place: Place) -> None:
    ended = place.run()
    assert ended.returncode == 0
    assert "nothing to do" in ended.stdout
    assert "PASS  adhoc/tiny  theta: order 2.0" in ended.stdout
    assert f"report: {place.tiny / 'report.html'}\n" in ended.stdout
    full = place.run("-v")
    assert "adhoc/tiny  PASS\n  PASS  asymptotic  order  theta converges" in full.stdout
    report = place.folder / "report.xml"
    quiet = place.run("-q", "--junit", str(report))
    assert (quiet.returncode, quiet.stdout, quiet.stderr) == (0, "", "")
    assert '<testsuite name="adhoc/tiny" tests="1" failures="0" errors="0">' in report.read_text()


WORDS = {
    "parameter": ("g: 1.0", "g: 1.5", "model.g: 1.0 -> 1.5: levels 6 to 9, analysis, report"),
    "level": ("8, 9]", "8, 9, 10]", "levels: 6 to 9 -> 6 to 10: level 10, analysis, report"),
    "title": ("A tiny", "Another", "title: A tiny pendulum -> Another pendulum: report"),
    "check": (
        "order: scheme",
        "order: 2.1",
        "checks.order.order: scheme -> 2.1: analysis, report",
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize(("old", "new", "told"), thinned(WORDS.values(), 4), ids=WORDS)
def test_a_dry_run_says_in_words_what_changed(place: Place, old: str, new: str, told: str) -> None:
    place.change(old, new)
    assert place.run("--dry-run").stdout.splitlines()[0] == f"adhoc/tiny: {told}"


@pytest.mark.slow
def test_a_dry_run_says_what_else_there_is_to_say(place: Place) -> None:
    (place.tiny / "report.html").unlink()
    lines = place.run("--dry-run").stdout.splitlines()
    assert lines[0] == "adhoc/tiny: files are missing or out of date: report"
    (place.tiny / "summary.json").unlink()
    lines = place.run("--dry-run").stdout.splitlines()
    assert lines[0] == "adhoc/tiny: not finished yet: analysis, report"
    # what the results were made from is gone: nothing else is known of the change
    place.change("g: 1.0", "g: 1.5")
    (place.tiny / "convergence.nc").write_bytes(b"damaged")
    lines = place.run("--dry-run").stdout.splitlines()
    assert lines[0].startswith("adhoc/tiny: not finished yet: levels 6 to 9")


def test_only_a_change_of_the_code_is_left_where_the_settings_are_the_same(
    place: Place,
) -> None:
    (plan,) = plans_of([str(place.file)])
    other = replace(plan, analysis="0" * 64)
    assert reasons.why(plan, place.results) == ""
    assert reasons.why(other, place.results) == "the code of vibsim changed"
    offered = replace(other, packages=(("vibsim.schemes", "lab", "0" * 64),))
    assert reasons.why(offered, place.results) == "the code of lab or of vibsim changed"
    newer = replace(other, versions={**other.versions, "numpy": "99.0"})
    assert reasons.why(newer, place.results).endswith(" -> 99.0")


@pytest.mark.slow
def test_a_run_says_first_what_changed(place: Place, capsys: pytest.CaptureFixture[str]) -> None:
    command._tell_changes(plans_of([str(place.file)]), place.results)
    assert capsys.readouterr().err == ""
    place.change("g: 1.0", "g: 1.5")
    plans = plans_of([str(place.file)])
    command._tell_changes(plans, place.results)
    assert capsys.readouterr().err == "adhoc/tiny: model.g: 1.0 -> 1.5\n"
    command._tell_changes(plans * 6, place.results)
    assert capsys.readouterr().err == "6 experiments: model.g: 1.0 -> 1.5\n"
    # what was never made has no reason to be made again
    command._tell_changes(plans, place.folder / "new")
    assert capsys.readouterr().err == ""


@pytest.mark.slow
def test_a_setting_is_told_recorded_and_taken_back(place: Place) -> None:
    given = ("--set", "model.g=1.5", "--set", "title=On 'the' moon {x}")
    whole = ["level_06", "level_07", "level_08", "level_09", "analyse", "report", "index"]
    first = place.run("--dry-run", *given).stdout.splitlines()[0]
    assert first == "adhoc/tiny: model.g: 1.0 -> 1.5: levels 6 to 9, analysis, report"
    ended = place.run(*given)
    assert ended.returncode == 0, ended.stderr
    assert "adhoc/tiny: model.g: 1.0 -> 1.5\n" in ended.stderr
    words = "--set model.g=1.5 --set 'title=On '\"'\"'the'\"'\"' moon {x}'"
    assert f"PASS  adhoc/tiny {words}  theta: order" in ended.stdout
    summary = json.loads((place.tiny / "summary.json").read_text())
    assert summary["settings"] == list(given[1::2])
    assert summary["title"] == "On 'the' moon {x}"
    page = html.unescape((place.tiny / "report.html").read_text())
    assert f".venv/bin/vibsim run tiny.yaml {words}</code>" in page
    assert f"the run had {words}</dd>" in page
    assert 'from_yaml("tiny.yaml", settings=["model.g=1.5", "title=' in page
    made = read_provenance(place.tiny / "convergence.nc")
    assert made["settings"] == list(given[1::2])
    # the file without the settings is another experiment again, and that is said
    assert place.jobs() == whole
    back = place.run("--dry-run").stdout.splitlines()[0]
    assert back == "adhoc/tiny: model.g: 1.5 -> 1.0: levels 6 to 9, analysis, report"
    # an edit to the same value simulates nothing again, and has the same bytes
    levels = {name: found for name, found in place.content().items() if "level_" in name}
    place.change("g: 1.0", "g: 1.5")
    place.change("A tiny pendulum", "On 'the' moon {x}")
    assert place.jobs() == whole[4:]
    told = place.run("--dry-run").stdout.splitlines()[0]
    assert told.startswith("adhoc/tiny: --set model.g=1.5: removed; --set ")
    assert place.run().returncode == 0
    now = place.content()
    assert {name: now[name] for name in levels} == levels
    assert "settings" not in json.loads((place.tiny / "summary.json").read_text())


@pytest.mark.slow
def test_a_second_experiment_leaves_the_first_alone(place: Place) -> None:
    other = place.file.with_name("other.yaml")
    other.write_text(TEXT)
    found = place.jobs(files=[place.file, other])
    assert sorted(found) == sorted(EVERYTHING)
    assert place.run(files=[other]).returncode == 0
    index = (place.results / "index.html").read_text()
    assert "tiny" in index
    assert "other" in index
    assert place.jobs(files=[place.file, other]) == []
    # The index covers all that is there, whichever experiments are chosen.
    assert place.jobs() == []
