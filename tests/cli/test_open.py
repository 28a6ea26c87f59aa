"""``vibsim open``: a page in the browser, or its path where there is none."""

from __future__ import annotations

import shutil
import webbrowser
from pathlib import Path

import pytest

from vibsim.cli import main
from vibsim.core.home import home

from .conftest import Made

Capture = pytest.CaptureFixture[str]


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Return the addresses that a browser was told."""
    found: list[str] = []

    def tell(address: str) -> bool:
        found.append(address)
        return True

    monkeypatch.setattr(webbrowser, "open", tell)
    return found


def test_the_page_of_an_experiment_and_the_index_are_opened(
    made: Made, capsys: Capture, opened: list[str]
) -> None:
    pages = [made.small / "report.html", made.results / "index.html"]
    for page in pages:
        page.touch()
    assert made.vibsim("open", made.file) == 0
    assert made.vibsim("open") == 0
    assert opened == [page.as_uri() for page in pages]
    assert capsys.readouterr().out == "".join(f"opened {page}\n" for page in pages)


def test_a_page_of_another_state_of_the_file_is_opened_with_a_note(
    made: Made, capsys: Capture, opened: list[str]
) -> None:
    (made.small / "report.html").touch()
    made.vibsim("open", made.file)
    assert capsys.readouterr().err == ""
    made.change("theta: 1.0", "theta: 1.1")
    assert made.vibsim("open", made.file) == 0
    assert "made before the experiment or vibsim changed" in capsys.readouterr().err
    assert len(opened) == 2


@pytest.mark.parametrize("error", [False, True])
def test_without_a_browser_the_path_is_printed_alone(
    made: Made, capsys: Capture, monkeypatch: pytest.MonkeyPatch, error: bool
) -> None:
    def no_browser(_: str) -> bool:
        if error:
            raise webbrowser.Error("could not locate runnable browser")
        return False

    monkeypatch.setattr(webbrowser, "open", no_browser)
    (made.small / "report.html").touch()
    assert made.vibsim("open", made.file) == 0
    assert capsys.readouterr().out == f"{made.small / 'report.html'}\n"


def test_without_a_report_nothing_is_opened(
    made: Made, tmp_path: Path, capsys: Capture, opened: list[str]
) -> None:
    assert made.vibsim("open", made.file) == 1
    assert f"there is no report yet: .venv/bin/vibsim run {made.file}" in capsys.readouterr().err
    heat = tmp_path / "heat.yaml"
    shutil.copytree(home() / "examples" / "heat", tmp_path, dirs_exist_ok=True)
    assert made.vibsim("open", heat) == 1
    # its program runs only where it is allowed
    told = capsys.readouterr().err
    assert f"there is no report yet: .venv/bin/vibsim run {heat} --allow-commands" in told
    assert main(["open", "--results", str(tmp_path)]) == 1
    assert made.vibsim("open", "theta_convergense") == 2
    assert "did you mean 'theta_convergence'?" in capsys.readouterr().err
    assert opened == []
