"""The catalogue of the two texts: every row has its place, what it names exists, no false sentence passes as true."""

from __future__ import annotations

import copy
import json
import re
import runpy
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from vibsim.cli.arguments import commands
from vibsim.experiment import Experiment, citation

ROOT = Path(__file__).parents[1]
CATALOGUE = runpy.run_path(str(ROOT / "workflow/catalogue.py"))
LISTED = CATALOGUE["data"]()
ROWS = [row for kind in ("things", "errata") for row in LISTED[kind].values()]
PAGE = (ROOT / "docs/catalogue.md").read_text("utf-8")
THINGS, ERRATA = 207, 58
"""What was counted in the texts: things that they describe, and places where they are wrong."""
SECTIONS = {
    "pendulum lecture": "1.1 1.2 1.3 2.1 2.2 2.3 2.4 2.5 2.6 3",
    "vibration text": (
        "1.1 1.2 2.1 2.2 2.3 3 3.1 3.2 3.3 3.4 3.5 4.1 4.2 4.3 4.4 4.5 4.6 5.1 5.2 5.3 5.4 5.5 5.6 6.1 6.2 7 7.1 7.2 "
        "7.3 7.4 8 8.1 8.2 8.3 8.4 8.5 8.6 8.7 8.8 10.1 10.2 10.3 10.4 10.5 10.6 10.7 10.8 10.9 10.10"
    ),
}
"""The sections of both texts that have a content of their own."""


@cache
def known() -> dict[str, Experiment]:
    """Return the shipped experiments by ``collection/name``."""
    found: dict[str, Experiment] = CATALOGUE["experiments"]()
    return found


# the files are read once for all tests
CATALOGUE["main"].__globals__["experiments"] = known


def changed(kind: str, number: int, **content: Any) -> dict[str, Any]:
    found = copy.deepcopy(LISTED)
    found[kind][number] = {"source": "vibration text, section 1.2", "says": "it holds", **content}
    return found


def test_the_page_is_current_and_its_lists_are_sound(capsys: pytest.CaptureFixture[str]) -> None:
    assert CATALOGUE["main"](["--check"]) == 0, (
        f"run python workflow/catalogue.py: {capsys.readouterr().out}"
    )


def test_another_page_is_not_current(tmp_path: Path) -> None:
    page = tmp_path / "catalogue.md"
    assert CATALOGUE["main"](["--check"], page) == 1
    page.write_text(PAGE.replace("CONFIRMED", "OPEN", 1), "utf-8")
    assert CATALOGUE["main"](["--check"], page) == 1
    assert CATALOGUE["main"]([], page) == 0
    assert page.read_text("utf-8") == PAGE


def test_no_row_is_missing() -> None:
    assert sorted(LISTED["things"]) == list(range(1, THINGS + 1))
    assert sorted(LISTED["errata"]) == list(range(1, ERRATA + 1))
    marks = re.findall(r"^\| (E?\d+) \|", PAGE, re.MULTILINE)
    wanted = {*map(str, range(1, THINGS + 1)), *(f"E{i}" for i in range(1, ERRATA + 1))}
    assert set(marks) == wanted


@pytest.mark.parametrize(
    ("found", "word"),
    [
        (changed("things", 1, shown_by=["vibration_text/nothing"]), "nothing does not exist"),
        (changed("things", 1, shown_by=["vibration_text/resonance#no"]), "#no does not exist"),
        (changed("things", 1, shown_by=["vibration_text/resonance#about_unity"]), "refutes it"),
        (changed("things", 1), "things, 1: has none of shown_by, see, open"),
        (changed("errata", 1, truth="x", open="it"), "errata, 1: has none of shown_by, not_run"),
        (changed("errata", 36, truth="x", not_run="y"), "no erratum names the check"),
        (changed("errata", 1, not_run="y"), "errata, 1: has not one of truth, confirmed"),
        (
            changed("errata", 36, confirmed="x", shown_by=["vibration_text/resonance#about_unity"]),
            "about_unity refutes it",
        ),
    ],
)
def test_a_faulty_row_is_told(found: dict[str, Any], word: str) -> None:
    (told, *_) = CATALOGUE["faults"](found, known())
    assert word in told


@pytest.mark.parametrize("number", [15, 30, 55])
def test_an_erratum_that_the_text_has_right_is_not_called_corrected(number: int) -> None:
    (row,) = re.findall(rf"^\| E{number} \|.*$", PAGE, re.MULTILINE)
    assert "| CONFIRMED |" in row
    assert "Correct:" not in row


def test_a_statement_of_nobody_is_not_refuted() -> None:
    name = "vibration_text/resonance"
    (check,) = [c for c in known()[name].checks if c.id == "about_unity"]
    ours = known()[name].model_copy(
        update={"checks": (check.model_copy(update={"source": "beside the text"}),)}
    )
    found = CATALOGUE["faults"](
        LISTED, known() | {"own/one": ours.model_copy(update={"name": "one"})}
    )
    assert found == ["own/one#about_unity: a statement of no text is refuted: say what is true"]


def test_what_a_row_refers_to_is_there() -> None:
    known = {name for name, *_ in commands()}
    for row in ROWS:
        see = row.get("see", "")
        if see.startswith("vibsim "):
            assert see.split()[1] in known, see
        elif see:
            path, _, anchor = see.partition("#")
            text = (ROOT / path).read_text("utf-8")
            headings = re.findall(r"^#+ (.+)$", text, re.MULTILINE)
            anchors = {re.sub(r"[^\w -]", "", h).lower().replace(" ", "-") for h in headings}
            assert not anchor or anchor in anchors, see


def test_every_row_has_a_place_in_a_text() -> None:
    for row in ROWS:
        found = citation.fields(row["source"])
        assert found is not None
        assert found["text"] in SECTIONS, row
        assert found["section"] or found["exercise"], row


@pytest.mark.parametrize("text", SECTIONS)
def test_every_section_leads_to_what_shows_it(text: str) -> None:
    part = PAGE.partition(f"## {text.capitalize()}\n")[2].partition("\n## ")[0]
    for section in SECTIONS[text].split():
        lines = part.partition(f"\n### {section} ")[2].partition("\n### ")[0]
        assert re.search(r"\| (CONFIRMED|CORRECTED|OPEN|PROVIDED) \|", lines), section


def test_the_index_knows_an_experiment_or_a_page_for_every_section_and_exercise() -> None:
    listed = json.loads(CATALOGUE["SECTIONS"].read_text("utf-8"))
    places = {(one["text"], one["place"]) for one in listed}
    assert places >= {(t, f"section {s}") for t, named in SECTIONS.items() for s in named.split()}
    assert places >= {("vibration text", f"exercise {number}") for number in range(1, 24)}
    for one in listed:
        parts = any(place.startswith(f"{one['place']}.") for _, place in places)
        assert one["experiments"] or one["see"] or parts, one
        assert set(one["experiments"]) <= known().keys()


@pytest.mark.parametrize(("text", "count"), [("pendulum lecture", 15), ("vibration text", 118)])
def test_every_equation_is_named_by_a_row_of_its_section(text: str, count: int) -> None:
    part = PAGE.partition(f"## {text.capitalize()}\n")[2].partition("\n## ")[0]
    found = []
    for section, (first, last) in LISTED["equations"][text].items():
        lines = part.partition(f"\n### {section} ")[2].partition("\n### ")[0]
        places = " ".join(re.findall(r"^\|[^|]*\|([^|]*)\|", lines, re.MULTILINE))
        found += [n for n in range(first, last + 1) if f"({n})" in places]
    assert found == [*range(1, count + 1)]


@pytest.mark.parametrize("text", SECTIONS)
def test_every_section_is_linked_at_the_head_of_its_text(text: str) -> None:
    part = PAGE.partition(f"## {text.capitalize()}\n")[2].partition("\n## ")[0]
    (head,) = re.findall(r"^Sections: (.*)$", part, re.MULTILINE)
    headings = re.findall(r"^### ([\d.]+|Exercises)", part, re.MULTILINE)
    assert re.findall(r"\[([\w.]+)\]\(#", head) == headings


def test_a_statement_is_understood_alone() -> None:
    """The page puts statements of an experiment under several sections, so none may go on with the one before."""
    started = re.compile(
        r"(and|nor|so|but|while|its?|they|their|that of|those of|the same|there is|these|then)\b"
    )
    found = [
        f"{name}#{check.id}"
        for name, experiment in known().items()
        for check in experiment.checks
        if check.kind == "claim" and started.match(check.claim)
    ]
    assert found == []


def test_every_exercise_leads_to_what_answers_it() -> None:
    part = PAGE.rpartition("### Exercises (sections 9 and 11)\n")[2]
    answered = re.findall(
        r"\| exercise (\d+) \|[^|]*\|[^|]*(?:configs|python\.md)[^|]*\| (?:CONFIRMED|PROVIDED) \|",
        part,
    )
    assert {*map(int, answered)} >= {*range(1, 24)}


def test_every_figure_of_the_vibration_text_leads_to_its_experiment() -> None:
    found = re.findall(r"\| figure (\d+) \|[^|]*\|[^|]*configs[^|]*\| CONFIRMED \|", PAGE)
    assert {*map(int, found)} >= {*range(1, 18)}


def test_an_open_row_says_why_and_a_false_statement_what_is_true() -> None:
    lines = [line.split(" | ") for line in PAGE.splitlines() if re.match(r"\| E?\d* \|", line)]
    cells = [(line[4], line[5].rstrip(" |"), line[1:]) for line in lines if len(line) > 5]
    assert len(cells) > THINGS + ERRATA
    for badge, told, line in cells:
        if badge in ("OPEN", "CORRECTED"):
            assert len(told) > 10, line
    for name, experiment in known().items():
        for check in experiment.checks:
            if check.kind == "claim" and not check.holds:
                assert check.note, f"{name}#{check.id}: a refuted claim says what is true"


def test_every_experiment_on_the_texts_is_in_the_catalogue() -> None:
    missing = [name for name in known() if f"../configs/{name}.yaml" not in PAGE]
    ours = [
        name
        for name in missing
        if known()[name].source and known()[name].source.startswith(tuple(SECTIONS))
    ]
    assert ours == []


@cache
def by_name() -> dict[str, str]:
    return {name.partition("/")[2]: name for name in known()}


EXERCISES = (ROOT / "docs/exercises.md").read_text("utf-8").split("\n## ")[1:]


def test_every_exercise_has_an_answer_that_runs_and_passes_through_checks_that_exist() -> None:
    notes = [f"Note [hpl {i}]" for i in range(1, 6)]
    assert [part.split(".")[0] for part in EXERCISES] == [*map(str, range(1, 24)), *notes]
    checks = {f"{name}#{c.id}" for name, experiment in known().items() for c in experiment.checks}
    for part in EXERCISES:
        named = re.findall(r"`([a-z_0-9]+)(#[a-z_0-9]+)?`", part)
        assert named or "(python.md#" in part, part
        for name, check in named:
            full = f"{by_name().get(name)}{check}"
            assert full in (checks if check else known()), f"{name}{check}"


@pytest.mark.parametrize(
    "head",
    [
        *(f"Note [hpl {i}]" for i in range(1, 6)),
        *(f"{number}." for number in (6, 7, 12, 18, 19, 20, 21, 22, 23)),
    ],
)
def test_what_asks_for_a_picture_has_one(head: str) -> None:
    (text,) = (part for part in EXERCISES if part.startswith(head))
    assert re.search(r"^!\[.+\]\(images/exercises-.+\.svg\)$", text, re.MULTILINE)


def test_numbers_of_answers_are_those_that_checks_ask_for() -> None:
    """A number beside a check with a bound on a value agrees with it to the digits that it has."""
    checked = 0
    for part in EXERCISES:
        for number, name, id_ in re.findall(r"(\d[\d.e-]*\d)\D{0,40}\(`(\w+)#(\w+)`", part):
            experiment = known()[by_name()[name]]
            (check,) = [c for c in experiment.checks if c.id == id_]
            value = check.measured
            if value.kind == "value" and value.equals is None:
                told = float(number)
                assert value.below is None or told < value.below, (name, id_, told)
                assert value.above is None or told > value.above, (name, id_, told)
                checked += 1
    assert checked >= 8
