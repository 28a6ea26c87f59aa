"""The documentation site: its reference names all that the code offers, its index all pages, no link is dead."""

from __future__ import annotations

import re
import runpy
import subprocess
from functools import cache
from html import unescape
from pathlib import Path

import pytest

import vibsim
from vibsim.cli.arguments import commands
from vibsim.cli.commands.listing import checks
from vibsim.core.vocabulary import REASONS
from vibsim.experiment.schema import document
from vibsim.models import MODELS
from vibsim.schemes import SCHEMES

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
REFERENCE = runpy.run_path(str(DOCS / "site/reference.py"))
STEPPED = [kind for kind, scheme in SCHEMES.items() if not scheme.adaptive]
HEADINGS: dict[str, list[str]] = {
    "models": list(MODELS),
    "schemes": list(SCHEMES),
    "checks": [name for name, _ in checks() if not name.startswith(" ")],
    "reasons": list(REASONS),
    "command-line": [f"vibsim {name}" for name, *_ in commands()],
    "python": [name for name in dir(vibsim) if not name.startswith("_")],
}
CELLS: dict[str, list[str]] = {
    "checks": [name.strip() for name, _ in checks() if name.startswith(" ")],
    "experiment-file": list(document.schema()["properties"]),
    "files": ["theta", "theta_exact", "<q>_difference", "period", "check_order_status", "checks"],
}
page = cache(REFERENCE["page"])


def test_every_page_of_the_reference_is_filled() -> None:
    assert {file.stem for file in (DOCS / "reference").iterdir()} == set(REFERENCE["PAGES"])


@pytest.mark.parametrize("name", HEADINGS)
def test_the_reference_has_a_section_for_everything_that_is_registered(name: str) -> None:
    found = re.findall(r"^## (.+)$", page(name), re.MULTILINE)
    assert [word for word in HEADINGS[name] if word not in found] == []


@pytest.mark.parametrize("name", CELLS)
def test_the_reference_has_a_row_for_every_name(name: str) -> None:
    assert [word for word in CELLS[name] if f"| `{word}` |" not in page(name)] == []


def test_every_option_of_every_command_is_in_the_reference() -> None:
    sections = dict(
        part.split("\n", 1) for part in page("command-line").split("## vibsim ")[1:] if part
    )
    for name, _, _, options in commands():
        for (*_, word), _ in options:
            assert word in sections[name] or not word.startswith("-"), f"vibsim {name} {word}"


@pytest.mark.slow
def test_the_theory_of_every_scheme_is_in_the_reference() -> None:
    parts = page("theory").split("## ")[1:]
    assert [part.split("\n")[0] for part in parts] == STEPPED
    assert all("w~/w" in part for part in parts)


def test_the_index_leads_to_every_page() -> None:
    linked = {
        (DOCS / target).resolve()
        for target in re.findall(r"\]\(([^)#]+\.md)\)", (DOCS / "index.md").read_text())
    }
    pages = {*DOCS.rglob("*.md"), *ROOT.glob("*.md"), *(ROOT / "examples").rglob("*.md")}
    assert pages - linked == {DOCS / "index.md"}


def test_every_picture_is_shown_by_a_page() -> None:
    pages = [*DOCS.glob("*.md"), ROOT / "README.md"]
    shown = {
        name
        for page in pages
        for name in re.findall(r"!\[[^\]]+\]\((?:docs/)?images/([^)]+)\)", page.read_text("utf-8"))
    }
    assert {p.name for p in (DOCS / "images").iterdir() if p.suffix in (".svg", ".png")} == shown


@pytest.mark.slow
def test_the_site_builds_without_a_warning_and_has_no_dead_link(built: Path) -> None:
    found: dict[Path, set[str]] = {}
    for file in built.rglob("*.html"):
        found[file] = set(re.findall(r'\bid="([^"]+)"', file.read_text("utf-8")))
    dead = []
    for file in found:
        for target in re.findall(r'\b(?:href|src)="([^"]+)"', file.read_text("utf-8")):
            path, _, anchor = unescape(target).partition("#")
            if re.match(r"[a-z]+:", target):
                continue
            there = (file.parent / path.partition("?")[0]).resolve() if path else file
            if not there.exists() or (anchor and there in found and anchor not in found[there]):
                dead.append(f"{file.name}: {target}")
    assert len(found) > 40
    assert dead == []


@pytest.mark.slow
def test_the_site_loads_nothing_from_a_network(built: Path) -> None:
    loaded = r'<(?:script|img|iframe)[^>]*\bsrc="(?:https?:)?//[^"]+"|<link[^>]*\bhref="(?:https?:)?//[^"]+"'
    for file in (*built.rglob("*.html"), *built.rglob("*.css")):
        text = file.read_text("utf-8")
        assert not re.search(loaded, text), file.name
        assert not re.search(r"(?:@import|url\()\s*[\"']?(?:https?:)?//", text), file.name
    assert not list(built.rglob("*.pickle"))
    assert "Kutta" in (built / "docs/reference/schemes.html").read_text("utf-8")
    assert "kutta" in (built / "searchindex.js").read_text("utf-8")


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of the site as ``make docs`` builds it."""
    done = subprocess.run(
        ["sh", "requirements/install.sh", "docs"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        pytest.skip(f"the environment of the documentation cannot be made: {done.stderr[-300:]}")
    target = tmp_path_factory.mktemp("site")
    trees = str(tmp_path_factory.mktemp("trees"))
    words = ["-q", "-W", "--keep-going", "-c", "docs/site", "-d", trees, ".", str(target)]
    command = [str(ROOT / ".venv-docs/bin/sphinx-build"), *words]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return target
