"""Every block of code of every page is tried, in the order of the page, in a folder of its own.

======== ========================================================================================================
`yaml`   must be accepted as an experiment, what it leaves out being that of the README
`sh`     must run; status 1 is for what prints FAIL or INCONCLUSIVE, and for `vibsim diff`
`python` must run, with the names of the blocks before it
`text`   must have been printed by the block before it, line by line
none     must be written to a file that the page names before it ("to `study.csv`"); `yaml` and `python` may be
`diff`   must take lines out that stand beside the page; `test_course.py` tries each
others   must be well-formed
======== ========================================================================================================

A comment above a block says otherwise: ``<!-- not run: WHY -->``, ``<!-- slow -->`` (tried by ``make test-slow`` alone,
as are all lines with `vibsim run`), or ``<!-- from FILE -->`` (a part of that file).
"""

from __future__ import annotations

import io
import json
import re
import shlex
import subprocess
import sys
import tomllib
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import forked
import pytest
import yaml

from vibsim.cli import main
from vibsim.cli.arguments import commands

ROOT = Path(__file__).resolve().parents[2]
BLOCK = re.compile(r"^```(\w*)\n(.*?)^```", re.DOTALL | re.MULTILINE)
MARK = re.compile(r"<!-- (not run: .+|slow|from \S+) -->\s*\Z")
OPTIONS = {name: {n for names, _ in rows for n in names} for name, _, _, rows in commands()}
FILE = re.compile(r"(?:to|into) `(\w+\.(?:yaml|py|csv))`")


@dataclass(frozen=True)
class Block:
    """A fenced block, with what stands between the block before it and this one."""

    place: str
    language: str
    content: str
    before: str

    @property
    def mark(self) -> str:
        """What the comment above it says."""
        found = MARK.search(self.before)
        return found[1] if found else ""

    @property
    def file(self) -> str:
        """The file that the page tells the reader to write it to."""
        named = FILE.findall(self.before)
        return named[-1] if named else ""


def tracked() -> list[str]:
    """Return the pages of the repository."""
    folders = ("docs", "examples", "results")
    found = [*ROOT.glob("*.md"), *(p for name in folders for p in (ROOT / name).rglob("*.md"))]
    return sorted(p.relative_to(ROOT).as_posix() for p in found if "adhoc" not in p.parts)


@cache
def blocks(page: str) -> tuple[Block, ...]:
    """Return the blocks of a page."""
    text, end, found = (ROOT / page).read_text("utf-8"), 0, []
    for match in BLOCK.finditer(text):
        place = f"{page}:{text[: match.start()].count(chr(10)) + 1}"
        found.append(Block(place, match[1], match[2], text[end : match.start()]))
        end = match.end()
    return tuple(found)


@cache
def base() -> dict[str, Any]:
    """Return the experiment of the README."""
    (text,) = (block.content for block in blocks("README.md") if block.language == "yaml")
    found: dict[str, Any] = yaml.safe_load(text)
    return {key: value for key, value in found.items() if key != "checks"}


def accepted(block: Block) -> None:
    """Have a whole experiment, or a part, checked."""
    part = yaml.safe_load(block.content)
    if part is None:  # the line for editors alone
        return
    whole = {"title": "A solver", **part} if "solver" in part else {**base(), **part}
    if "tolerance" in part:
        del whole["levels"]
    file = Path("documented.yaml")
    file.write_text(yaml.safe_dump(whole))
    called(f"vibsim check {file}")


def matching(word: str) -> list[str]:
    """Return the files that a word of a command stands for, or the word."""
    return ("*" in word and sorted(map(str, Path().glob(word)))) or [word]


def called(line: str) -> str:
    """Run one command; return what it prints."""
    words = [name for word in shlex.split(line, comments=True) for name in matching(word)]
    program, *rest = words
    target = rest.pop(rest.index(">") + 1) if ">" in rest else None
    rest = [word for word in rest if word != ">"]
    vibsim = program in (".venv/bin/vibsim", "vibsim")
    assert vibsim or program in ("python3", "python", ".venv/bin/python"), line
    if vibsim and "--results" in OPTIONS[rest[0]]:
        rest[1:1] = ["--results", "results"]
    if vibsim and rest[0] != "run":
        with redirect_stdout(out := io.StringIO()), redirect_stderr(out):
            status = main(rest)
        printed = out.getvalue()
    else:
        if vibsim:
            done = forked.vibsim(*rest)
        else:
            command = [sys.executable, *rest]
            done = subprocess.run(command, capture_output=True, text=True, timeout=500, check=False)
        status, printed = done.returncode, done.stdout + done.stderr
    failed = re.search(r"FAIL|INCONCLUSIVE", printed) is not None or rest[:1] == ["diff"]
    assert status == 0 or (status == 1 and failed), f"{line}: status {status}\n{printed}"
    if target:
        Path(target).write_text(printed)
    return printed


def compare(shown: str, printed: str) -> None:
    """Find every line that is shown among those that were printed, in order; the beginnings of lines may differ."""
    found = [line.rstrip() for line in printed.splitlines()]
    for line in filter(None, map(str.rstrip, shown.splitlines())):
        places = [i for i, one in enumerate(found) if one.endswith(line)]
        assert places, f"not printed, or not in this order: {line}\n{printed}"
        found = found[places[0] + 1 :]


def follow(page: str, *, slow: bool) -> int:
    """Do what a page says; without `slow` only what takes no time. Return how many blocks were tried."""
    names: dict[str, Any] = {"__name__": "page"}
    printed: str | None = None
    tried = 0
    for number, block in enumerate(blocks(page)):
        kind, _, detail = block.mark.partition(" ")
        if kind == "not":
            assert len(detail.split()) > 2, f"{block.place}: say why it is not run"
            printed = None
            continue
        if kind == "from":
            assert block.content in (ROOT / detail).read_text("utf-8"), (
                f"{block.place}: not in {detail}"
            )
            continue
        if kind == "slow" and not slow:
            printed = None
            continue
        if block.file:
            Path(block.file).write_text(block.content)
        try:
            if block.language == "sh":
                lines = block.content.replace("\\\n", " ").splitlines()
                chosen = [line for line in lines if line and (slow or " run " not in line)]
                printed = "".join(map(called, chosen)) if len(chosen) == len(lines) else None
            elif block.language == "python" and not block.file:
                file = Path(f"block_{number}.py").resolve()
                file.write_text(block.content)
                with redirect_stdout(out := io.StringIO()):
                    exec(compile(block.content, str(file), "exec"), names)
                printed = out.getvalue()
            elif block.language == "text":
                if printed is not None:
                    compare(block.content, printed)
                else:
                    assert not slow, "follows no block that prints: mark it"
            else:
                form(block)
        except Exception as error:
            raise AssertionError(f"{block.place}: {error}") from error
        tried += 1
    return tried


def form(block: Block) -> None:
    """Look at a block that is neither run nor printed."""
    if block.language == "yaml":
        accepted(block)
    elif block.language == "diff":
        beside = [
            p.read_text("utf-8")
            for p in (ROOT / block.place).parent.rglob("*.[pym]*")
            if p.suffix in (".py", ".yaml", ".md")
        ]
        for line in block.content.splitlines():
            assert line[0] in "+-", line
            assert any(line[1:] in text for text in beside), line
    elif block.language == "toml":
        tomllib.loads(block.content)
    elif block.language == "json":
        json.loads(block.content)
    else:
        assert block.file, f"nobody tries ```{block.language}"


PAGES = [page for page in tracked() if blocks(page)]


def is_slow(page: str) -> bool:
    return any(
        b.mark == "slow" or (b.language == "sh" and " run " in b.content) for b in blocks(page)
    )


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Stand in a folder with what a reader has: the examples, and the experiment of the README."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("BROWSER", "true")
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    for name in ("configs/vibration_text/bumpy_road.csv", "examples/heat/heat.py"):
        (tmp_path / Path(name).name).write_bytes((ROOT / name).read_bytes())
    (text,) = (block.content for block in blocks("README.md") if block.language == "yaml")
    (tmp_path / "my_pendulum.yaml").write_text(text)


@pytest.mark.parametrize("page", PAGES)
def test_what_a_page_shows_is_so(page: str) -> None:
    follow(page, slow=False)


@pytest.mark.slow
@pytest.mark.parametrize("page", [page for page in PAGES if is_slow(page)])
def test_what_a_page_runs_comes_out_as_it_says(page: str) -> None:
    follow(page, slow=True)


def test_every_row_of_a_table_has_the_cells_of_its_head() -> None:
    """A bar in a cell is written with a backslash, also in code; a row after an empty line is no row."""
    text = "\n".join((ROOT / page).read_text("utf-8") for page in tracked())
    text = re.sub(r"^```.*?^```", "", text, flags=re.DOTALL | re.MULTILINE)
    for rows in re.findall(r"(?:^\|.*\n)+", text, re.MULTILINE):
        head, *others = (re.split(r"(?<!\\)\|", row.strip())[1:-1] for row in rows.splitlines())
        assert others, rows
        assert all(re.fullmatch(r":?-+:?", cell.strip()) for cell in others[0]), rows[:200]
        assert {len(row) for row in others} == {len(head)}, rows[:200]
