"""Whose results are in a folder of a file's name."""

from __future__ import annotations

import shutil
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from vibsim.cli.run.lock import claim
from vibsim.core.errors import InputError
from vibsim.experiment.collection import ADHOC


def plan(folder: Path) -> Any:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "tiny.yaml").touch()
    return SimpleNamespace(key="adhoc/tiny", collection=ADHOC, file=str(folder / "tiny.yaml"))


def test_results_of_another_file_of_the_same_name_are_refused(tmp_path: Path) -> None:
    results = tmp_path / "results"
    claim([plan(tmp_path / "first")], results)
    claim([plan(tmp_path / "first")], results)
    with pytest.raises(InputError, match=f"another file of this name, {tmp_path}/first/tiny.yaml"):
        claim([plan(tmp_path / "second")], results)
    (tmp_path / "first/tiny.yaml").unlink()
    claim([plan(tmp_path / "second")], results)


def test_a_file_that_moves_with_its_results_is_the_same(tmp_path: Path) -> None:
    claim([plan(tmp_path / "here/mine")], tmp_path / "here/results")
    (tmp_path / "here").rename(tmp_path / "there")
    plan(tmp_path / "here/mine")
    claim([plan(tmp_path / "there/mine")], tmp_path / "there/results")


def test_a_damaged_record_blames_nobody(tmp_path: Path) -> None:
    claim([plan(tmp_path / "here/mine")], tmp_path / "here/results")
    shutil.copytree(tmp_path / "here", tmp_path / "copy")
    results, mine = tmp_path / "copy/results", plan(tmp_path / "copy/mine")
    record = results / ".vibsim/sources.json"
    whole = record.read_bytes()
    for place in range(len(whole)):
        record.write_bytes(whole[:place] + bytes([whole[place] ^ 1]) + whole[place + 1 :])
        claim([mine], results)
