"""Large files in parts: the same bytes as in one go, read back by any range, in bounded memory."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
import pytest

from vibsim import store
from vibsim.core import netcdf
from vibsim.core.errors import DamagedFileError, StaleFileError
from vibsim.core.record import Record, Variable
from vibsim.store import writing

from .conftest import DIGEST, build
from .test_store_netcdf import same
from .test_store_shards import part

CUTS = [(0, 7), (0, 1, 7), (0, 3, 4, 7), tuple(range(8))]


def whole() -> Record:
    """Return a record with swept words beside everything else."""
    record = build(cases=7)
    words = np.array(["centred", "first_order", *["centred"] * 5])
    attrs = {"long_name": "swept value", "units": "1", "sweep_key": "schemes.central.start"}
    coords = {**record.coords, "schemes_central_start": Variable(("case",), words, attrs)}
    return replace(record, coords=coords)


def parts(record: Record, cuts: tuple[int, ...]) -> Iterator[Record]:
    return (part(record, a, b) for a, b in pairwise(cuts))


@pytest.mark.parametrize("cuts", CUTS, ids=str)
def test_parts_give_the_bytes_of_the_whole(tmp_path: Path, cuts: tuple[int, ...]) -> None:
    first, second = tmp_path / "whole.nc", tmp_path / "parts.nc"
    store.write(first, whole(), digest=DIGEST, provenance={})
    store.write_parts(second, parts(whole(), cuts), cases=7, digest=DIGEST, provenance={})
    assert second.read_bytes() == first.read_bytes()
    assert same(store.read(second, digest=DIGEST), store.read(first))


def test_what_members_share_is_that_of_the_last_part(tmp_path: Path) -> None:
    record = whole()

    def counted() -> Iterator[Record]:
        for number, one in enumerate(parts(record, (0, 3, 7))):
            scalar = replace(record.variables["scalar"], values=np.array(float(number)))
            yield replace(one, variables={**one.variables, "scalar": scalar})

    path = tmp_path / "a.nc"
    store.write_parts(path, counted(), cases=7, digest=DIGEST, provenance={})
    assert store.read(path)["scalar"] == 1.0


def longer(record: Record) -> Record:
    words = record.coords["schemes_central_start"]
    text = np.array(["something much longer"] * len(words.values))
    coords = {**record.coords, "schemes_central_start": replace(words, values=text)}
    return replace(record, coords=coords)


def narrower(record: Record) -> Record:
    theta = record.variables["theta"]
    values = theta.values.astype(np.float32)
    return replace(record, variables={**record.variables, "theta": replace(theta, values=values)})


def lacking(record: Record) -> Record:
    return replace(record, variables={"theta": record.variables["theta"]})


@pytest.mark.parametrize(
    ("change", "told"),
    [(longer, "longer"), (narrower, "theta.*types"), (lacking, "different variables")],
)
def test_parts_that_do_not_belong_together_leave_no_file(
    tmp_path: Path, change: object, told: str
) -> None:
    assert callable(change)
    first, second = parts(whole(), (0, 3, 7))
    path = tmp_path / "a.nc"
    with pytest.raises(ValueError, match=told):
        store.write_parts(path, [first, change(second)], cases=7, digest=DIGEST, provenance={})
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("cases", [6, 8])
def test_too_few_or_too_many_members_leave_no_file(tmp_path: Path, cases: int) -> None:
    given = parts(whole(), (0, 3, 7))
    with pytest.raises((ValueError, IndexError)):
        store.write_parts(tmp_path / "a.nc", given, cases=cases, digest=DIGEST, provenance={})
    assert list(tmp_path.iterdir()) == []


@pytest.fixture
def shards(tmp_path: Path) -> list[tuple[Path, str | None]]:
    files: list[tuple[Path, str | None]] = []
    for number, one in enumerate(parts(whole(), (0, 3, 4, 7))):
        digest = f"{number}" * 64
        path = tmp_path / f"shard_{number:04d}.nc"
        store.write(path, one, digest=digest, provenance={})
        files.append((path, digest))
    return files


def test_any_range_of_members_is_read_whatever_files_they_are_in(
    shards: list[tuple[Path, str | None]],
) -> None:
    with store.open_level(shards) as level:
        assert level.cases == 7
        for start in range(8):
            for stop in range(start, 8):
                assert same(level.read(start, stop), part(whole(), start, stop)), (start, stop)
        assert same(level.read(), whole())
        some = level.read(2, 5, names=["theta"])
    assert list(some.variables) == ["theta"]
    assert list(some.coords) == list(whole().coords)
    assert some["theta"].tobytes() == whole()["theta"][:, 2:5].tobytes()


def test_a_level_of_another_job_or_a_damaged_one_is_refused_by_name(
    shards: list[tuple[Path, str | None]],
) -> None:
    path, digest = shards[1]
    with pytest.raises(StaleFileError, match=path.name), store.open_level([(path, "e" * 64)]):
        pass
    store.check(path, digest=str(digest))
    with pytest.raises(StaleFileError, match=path.name):
        store.check(path, digest="e" * 64)
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)
    with pytest.raises(DamagedFileError, match=path.name):
        store.check(path, digest=str(digest))
    with pytest.raises(DamagedFileError, match=path.name), store.open_level(shards):
        pass


def test_a_level_of_one_file_is_opened_once(
    shards: list[tuple[Path, str | None]], monkeypatch: pytest.MonkeyPatch
) -> None:
    opened: list[Path] = []
    real = netcdf.opened

    def counted(path: Path) -> Any:
        opened.append(path)
        return real(path)

    monkeypatch.setattr(netcdf, "opened", counted)
    with store.open_level(shards[:1]) as level:
        level.read(0, 1)
        level.read()
    assert opened == [shards[0][0]]


MEMORY = """
import re, sys
from pathlib import Path
import numpy as np
from vibsim import store
from vibsim.core.record import Record, Variable
PARTS, CASES, TIMES = int(sys.argv[2]), 2000, 1000
number = {"long_name": "a number", "units": "1"}
def parts():
    for i in range(PARTS):
        case = Variable(("case",), np.arange(i * CASES, (i + 1) * CASES), number)
        x = Variable(("case", "t"), np.full((CASES, TIMES), float(i)), number)
        yield Record({"case": case}, {"x": x}, {"title": "large"})
path = Path(sys.argv[1])
store.write_parts(path, parts(), cases=PARTS * CASES, digest="d" * 64, provenance={})
store.check(path, digest="d" * 64)
with store.open_level([(path, "d" * 64)]) as level:
    total = sum(
        level.read(i * CASES, (i + 1) * CASES)["x"].sum() for i in range(PARTS)
    )
assert total == CASES * TIMES * sum(range(PARTS))
print(re.search(r"VmHWM:\\s*(\\d+) kB", Path("/proc/self/status").read_text())[1])
"""


@pytest.mark.slow
def test_memory_is_that_of_a_part_and_not_of_the_file(tmp_path: Path) -> None:
    def peak(number: int) -> int:
        command = [sys.executable, "-c", MEMORY, str(tmp_path / "large.nc"), str(number)]
        return int(json.loads(subprocess.run(command, capture_output=True, check=True).stdout))

    # A part has 16 MB; the file of ten would add 128 MB to that of two.
    assert peak(10) - peak(2) < 24_000


def series(cases: int = 40, points: int = 801, **attrs: str) -> Record:
    """Return a record with smooth series, large enough to be compressed."""
    record = build(cases=cases, points=points)
    theta = record.variables["theta"]
    t, case = record.coords["t"].values, record.coords["case"].values
    smooth = np.cos(t * (1 + 0.01 * case[:, None])) * np.ones((2, 1, 1))
    variables = {**record.variables, "theta": replace(theta, values=smooth)}
    return replace(record, variables=variables, attrs={**record.attrs, **attrs})


def filters(path: Path) -> dict[str, bool]:
    with netCDF4.Dataset(path) as data:
        return {name: bool(v.filters()["zlib"]) for name, v in data.variables.items() if v.shape}


@pytest.mark.parametrize("cuts", [(0, 40), (0, 1, 40), (0, 13, 14, 29, 40), tuple(range(41))])
def test_compressed_parts_give_the_bytes_of_the_whole(
    tmp_path: Path, cuts: tuple[int, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Chunks of several members, some of them in two parts."""
    monkeypatch.setattr(writing, "_CHUNK", 2**16)
    first, second = tmp_path / "whole.nc", tmp_path / "parts.nc"
    store.write(first, series(), digest=DIGEST, provenance={})
    store.write_parts(second, parts(series(), cuts), cases=40, digest=DIGEST, provenance={})
    with netCDF4.Dataset(second) as data:
        assert data["theta"].chunking() == [2, 5, 801]
    assert second.read_bytes() == first.read_bytes()
    assert same(store.read(second, digest=DIGEST), series())
    with store.open_level([(second, DIGEST)]) as level:
        assert same(level.read(3, 12), part(series(), 3, 12))


def test_only_large_series_are_compressed(tmp_path: Path) -> None:
    path = tmp_path / "a.nc"
    store.write(path, series(), digest=DIGEST, provenance={})
    assert {name for name, is_packed in filters(path).items() if is_packed} == {"theta"}
    assert path.stat().st_size < 0.8 * series().variables["theta"].values.nbytes


def test_lean_and_large_files_are_not_compressed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.nc"
    store.write(path, series(storage="lean"), digest=DIGEST, provenance={})
    assert not any(filters(path).values())
    monkeypatch.setattr(writing, "PACKED_UP_TO", 2**18)
    store.write(path, series(), digest=DIGEST, provenance={})
    assert not any(filters(path).values())
