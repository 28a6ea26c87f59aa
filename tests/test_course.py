"""The course: edits fit their files, every question has an answer, and the numbers of the key are those of runs."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

from examples.course import answers

ROOT = Path(__file__).parents[1]
COURSE = ROOT / "examples" / "course"


def test_every_question_has_an_answer_and_every_edit_a_line_to_change() -> None:
    key = answers.KEY.read_text("utf-8")
    asked = []
    for sheet in answers.SHEETS:
        text = (COURSE / f"sheet_{sheet}.md").read_text("utf-8")
        asked += re.findall(r"^\*\*Question (\d+\.\d+)\.\*\*", text, re.MULTILINE)
        found = answers.edits(sheet)
        assert len(found) == text.count("```diff"), f"sheet {sheet}: an edit without number or file"
        for number, edit in found.items():
            before = ("5.1",) if number == "5.2" else ()
            assert edit.new in answers.edited(edit.file, *before, number).splitlines()
            assert f'"{number}"' in answers.TEMPLATE.read_text("utf-8"), f"edit {number} is not run"
    assert re.findall(r"^\*\*(\d+\.\d+)\.\*\*", key, re.MULTILINE) == asked
    assert len(asked) > 30


def test_an_edit_that_does_not_fit_is_refused() -> None:
    with pytest.raises(ValueError, match=r"edit 5\.2: .* stands 0 times"):
        answers.edited(answers.SCHEME, "5.2")


def test_the_scheme_has_the_name_that_the_experiment_asks_for() -> None:
    project = tomllib.loads((COURSE / "lab_scheme/pyproject.toml").read_text("utf-8"))
    (point,) = project["project"]["entry-points"]["vibsim.schemes"].items()
    assert point == ("lab", "lab_scheme.scheme:LAB")
    assert answers.scheme(COURSE / answers.SCHEME).kind == "lab"


def test_the_verdict_leads_to_the_bug() -> None:
    steps = [(), ("5.1",), ("5.1", "5.2")]
    reasons = [answers.run("find_the_bug.yaml", *edits)["theta_order"].reason for edits in steps]
    assert reasons == ["wrong_limit", "order_low", "asymptotic"]


@pytest.mark.parametrize(
    "sheet", [1, *(pytest.param(i, marks=pytest.mark.slow) for i in answers.SHEETS[1:])]
)
def test_the_key_is_current(sheet: int, capsys: pytest.CaptureFixture[str]) -> None:
    assert answers.main(["--check", str(sheet)]) == 0, capsys.readouterr().out


def test_another_number_is_not_current(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    other = tmp_path / "answers.md"
    other.write_text(answers.KEY.read_text("utf-8").replace("0.9996678", "0.9996679"), "utf-8")
    monkeypatch.setattr(answers, "KEY", other)
    assert answers.main(["--check", "1"]) == 1
