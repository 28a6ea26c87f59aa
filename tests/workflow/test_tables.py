"""What runs again after a table beside an experiment file has changed."""

from __future__ import annotations

import pytest

from .conftest import Place

TEXT = """\
title: A tiny road
model: {kind: vehicle, speed: 5, road: {table: road.csv}}
time: {end: 2, base_steps: 100}
levels: [0, 1, 2]
schemes: [central]
"""


@pytest.mark.slow
def test_other_heights_run_everything_again_and_a_comment_nothing(place: Place) -> None:
    file = place.file.with_name("bumpy.yaml")
    file.write_text(TEXT)
    table = file.with_name("road.csv")
    rows = [f"{i / 10:g},{(i * i) % 7 / 100:g}" for i in range(101)]
    table.write_text("\n".join(["x,h", *rows]) + "\n")
    assert place.run(files=[file]).returncode == 0
    assert place.jobs(files=[file]) == []
    table.write_text("# measured again\n" + table.read_text())
    assert place.jobs(files=[file]) == []
    table.write_text(table.read_text().replace("\n5,", "\n5,1"))
    found = place.jobs(files=[file])
    assert set(found) == {"level_00", "level_01", "level_02", "analyse", "report", "index"}
    table.unlink()
    ended = place.run("--dry-run", files=[file])
    assert ended.returncode == 2
    assert "road.csv: there is no such file" in ended.stderr
