"""Every file, command and printed line of the tutorial, from the first lesson to the last."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

PAGE = Path(__file__).parents[1] / "docs" / "tutorial.md"
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```", re.DOTALL | re.MULTILINE)


def called(line: str, results: Path) -> str:
    """Run one line of the page; return what it prints."""
    words = shlex.split(line)
    if words[0] == "python3":
        program, arrow, file = words[1:]
        assert arrow == ">"
        done = subprocess.run([sys.executable, program], capture_output=True, text=True, check=True)
        Path(file).write_text(done.stdout)
        return ""
    assert words[0] == ".venv/bin/vibsim"
    more = ["--results", str(results)] if words[1] == "run" else []
    command = [sys.executable, "-m", "vibsim", *words[1:], *more]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    failed = re.search(r"passed: FAIL$", done.stdout, re.MULTILINE) is not None
    assert done.returncode == int(failed), done.stderr
    return done.stdout


def follow(text: str, folder: Path, *, runs: bool) -> int:
    """Do what a text says, in order, but `vibsim run` only with `runs`; return how many outputs were compared."""
    printed, compared, end = "", 0, 0
    for block in BLOCK.finditer(text):
        language, content = block.groups()
        before, end = text[end : block.start()], block.end()
        if language in ("yaml", "python"):
            if files := re.findall(r"(?:to) `(\w+\.(?:yaml|py))`", before):
                Path(files[-1]).write_text(content)
        elif language == "sh":
            lines = [x for x in content.splitlines() if runs or " run " not in x]
            printed = "".join(called(line, folder / "results") for line in lines)
        elif printed:
            found = [line.rstrip() for line in printed.splitlines()]
            for line in content.splitlines():
                if line:
                    places = [i for i, one in enumerate(found) if one.endswith(line.rstrip())]
                    assert places, f"not printed, or not in this order: {line}"
                    found = found[places[0] + 1 :]
            printed, compared = "", compared + 1
    return compared


def test_quick_commands_of_the_tutorial_print_what_it_shows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert follow(PAGE.read_text(), tmp_path, runs=False) == 5


@pytest.mark.slow
def test_the_tutorial_from_first_to_last(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert follow(PAGE.read_text(), tmp_path, runs=True) == 12
