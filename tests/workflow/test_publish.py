"""What is published is whole, describes itself as RO-Crate 1.1 asks, and needs nothing outside of its folder."""

from __future__ import annotations

import hashlib
import json
import re
import shutil
from datetime import date
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import pytest

from vibsim.cli import made_files
from vibsim.cli.chosen_plans import plans_of
from vibsim.cli.commands import publish

from .conftest import Place, here

LICENCE = "https://creativecommons.org/licenses/by/4.0/"
ROAD = """\
title: A road from a table
model: {kind: vehicle, m: 1.0, b: 0.1, spring: u, speed: 1.0, road: {table: "../roads a/road.csv"}}
initial: {u: 0.0}
time: {end: 4.0}
levels: [6, 7, 8]
schemes: [central]
"""


def published(place: Place, *more: object) -> Path:
    """Publish the results of a place, and move the folder: it must not know where it was made."""
    folder = place.folder / "to be" / "published"
    ended = here("report", place.file, "--results", place.results, "--publish", folder, *more)
    assert ended.returncode == 0, ended.stderr
    assert ended.stdout == f"published: {folder / 'index.html'}\n"
    return folder.rename(place.folder / "moved")


class Links(HTMLParser):
    """Collects what a page links to."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.found: list[str] = []
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found += [value for key, value in attrs if key in ("href", "src") and value]


def test_a_crate_has_what_the_specification_requires(place: Place) -> None:
    """Source: RO-Crate Metadata Specification 1.1, "Root Data Entity", "Data Entities", "RO-Crate JSON-LD"."""
    folder = published(place, "--license", LICENCE)
    crate = json.loads((folder / "ro-crate-metadata.json").read_text(encoding="utf-8"))
    assert crate.keys() == {"@context", "@graph"}
    assert "https://w3id.org/ro/crate/1.1/context" in crate["@context"]
    graph: list[dict[str, Any]] = crate["@graph"]
    entities = {entity["@id"]: entity for entity in graph}
    # flat and compacted: each entity once, with a type; what is nested is a reference to an entity that is there
    assert len(entities) == len(graph)
    for entity in graph:
        assert entity["@type"]
        for key, value in entity.items():
            assert not isinstance(value, list) or len(value) > 1, key
            for part in value if isinstance(value, list) else [value]:
                if isinstance(part, dict) and key != "conformsTo":
                    assert part.keys() == {"@id"}
                    assert part["@id"] in entities
    descriptor, root = entities["ro-crate-metadata.json"], entities["./"]
    assert descriptor["@type"] == "CreativeWork"
    assert descriptor["about"] == {"@id": "./"}
    assert descriptor["conformsTo"] == {"@id": "https://w3id.org/ro/crate/1.1"}
    assert root["@type"] == "Dataset"
    assert root["name"] == "A tiny pendulum"
    assert "1 of 1 checks passed: PASS" in root["description"]
    assert date.fromisoformat(root["datePublished"])
    assert root["license"] == {"@id": LICENCE}
    assert {"name", "description"} <= entities[LICENCE].keys()
    # every file is a data entity and part of the root, with a relative address that leads to it
    files = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}
    files -= {"ro-crate-metadata.json"}
    assert {unquote(part["@id"]) for part in root["hasPart"]} == files
    for name in files:
        [entity] = [found for found in graph if unquote(found["@id"]) == name]
        content = (folder / name).read_bytes()
        assert entity["@type"] == "File"
        assert not re.search(r"[ {}'$\\]", entity["@id"])
        assert entity["contentSize"] == str(len(content))
        assert entity["sha256"] == hashlib.sha256(content).hexdigest()
        assert re.fullmatch(r"[a-z]+/[a-z0-9.+-]+", entity["encodingFormat"])
    made = entities["#run"]
    assert made["object"] == {"@id": "experiment/tiny.yaml"}
    assert {"@id": "adhoc/tiny/level_06.nc"} in made["result"]
    assert {"@id": "experiment/tiny.yaml"} not in made["result"]


def test_pages_and_data_are_those_of_the_run_and_lead_nowhere_else(place: Place) -> None:
    folder = published(place)
    crate = json.loads((folder / "ro-crate-metadata.json").read_text())
    assert crate["@graph"][1]["license"] == publish.NO_LICENCE
    known = made_files.load(place.results, "adhoc/tiny")
    there = {p.relative_to(folder / "adhoc/tiny").as_posix() for p in folder.rglob("tiny/**/*.*")}
    assert there == known.keys()
    for name in known:
        assert (folder / "adhoc/tiny" / name).read_bytes() == (place.tiny / name).read_bytes()
    assert (folder / "experiment/tiny.yaml").read_bytes() == place.file.read_bytes()
    pages = list(folder.rglob("*.html"))
    assert len(pages) == 2
    for page in pages:
        for link in Links(page.read_text()).found:
            # the history of a results folder is read where there is one
            if link.startswith(("#", "data:")) or link == ".vibsim/history.js":
                continue
            target = (page.parent / unquote(link.partition("#")[0])).resolve()
            assert target.is_relative_to(folder.resolve()), link
            assert target.exists(), link


def test_tables_of_an_experiment_keep_their_places(tmp_path: Path) -> None:
    (tmp_path / "roads a").mkdir()
    (tmp_path / "roads a/road.csv").write_text("x,h\n0,0\n1,0.1\n2,0\n3,0\n4,0\n")
    file = tmp_path / "mine/deep_road.yaml"
    file.parent.mkdir()
    file.write_text(ROAD)
    [plan] = plans_of([str(file)])
    assert dict(publish.inputs(plan)) == {
        "experiment/mine/deep_road.yaml": file,
        "experiment/roads a/road.csv": tmp_path / "roads a/road.csv",
    }


@pytest.mark.parametrize(
    "kind", ["full", "file", "damaged", "edited", "missing", "mixed", "nameless"]
)
def test_what_is_not_whole_or_would_be_overwritten_is_refused(place: Place, kind: str) -> None:
    target = place.folder / "crate"
    words: list[object] = [place.file]
    status, told = 2, "must be a new or an empty folder"
    match kind:
        case "full":
            shutil.copytree(place.tiny, target)
        case "file":
            target.write_text("mine")
        case "damaged":
            (place.tiny / "figures/thumbnail.svg").write_text("x")
            status, told = 1, f"thumbnail.svg: {made_files.CHANGED}"
        case "edited":
            place.change("theta: 1.0", "theta: 1.1")
            status, told = 1, "level_06.nc: it belongs to job "
        case "missing":
            shutil.rmtree(place.tiny)
            status, told = (
                1,
                f"only whole results are published: .venv/bin/vibsim run '{place.file}'",
            )
        case "mixed":
            words += ["--formats", "png"]
            told = "does not go with --publish"
        case "nameless":
            words = []
            told = "needs the experiment"
    before = sorted(place.folder.rglob("*"))
    ended = here("report", *words, "--results", place.results, "--publish", target)
    assert (ended.returncode, told in ended.stderr) == (status, True), ended.stderr
    assert sorted(place.folder.rglob("*")) == before
