"""What the README and the page on judging any solver show."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from vibsim.cli import main
from vibsim.convergence.study.verdict import KEYS

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs/judge.md"
README = ROOT / "README.md"
Capture = pytest.CaptureFixture[str]


def blocks(text: str, language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", text, re.DOTALL | re.MULTILINE)


def test_the_page_names_every_key_and_every_option() -> None:
    text = PAGE.read_text()
    assert [key for key in KEYS if f"`{key}`" not in text] == []
    options = ("--order", "--at-least", "--exact", "--noise", "--restrict", "--report", "--json")
    assert [option for option in options if f"`{option}" not in text] == []


def test_the_study_of_the_readme_has_the_verdicts_that_it_tells(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    monkeypatch.chdir(tmp_path)
    text = README.read_text().partition("## Judge your own solver")[2].partition("\n## ")[0]
    (tmp_path / "study.csv").write_text(blocks(text, "")[0])
    commands = [line.partition("#")[0].split()[1:] for line in blocks(text, "sh")[0].splitlines()]
    for command, status in zip(commands, ("PASS", "FAIL"), strict=True):
        assert main([*command, "--json"]) == (0 if status == "PASS" else 1)
        (verdict,) = json.loads(capsys.readouterr().out)["verdicts"]
        assert verdict["status"] == status
        assert verdict["order"] == pytest.approx(2.0, abs=0.005)
        assert verdict["best"] == pytest.approx(1.718282, abs=6e-7)
    assert verdict["reason"] == "order_low"
    assert (tmp_path / "study/report.html").is_file()
