from __future__ import annotations

import random
from pathlib import Path

import numpy as np
import pytest

from vibsim import store
from vibsim.core.errors import DamagedFileError, FileError, StaleFileError
from vibsim.core.record import Record, Variable

from .conftest import DIGEST, build


@pytest.mark.slow
def test_every_flipped_bit_is_seen(file: Path) -> None:
    whole = file.read_bytes()
    places = random.Random(7).sample(range(8 * len(whole)), 600)
    # The end holds the seal itself: each of its bits is tried.
    places += range(8 * (len(whole) - 80), 8 * len(whole))
    for place in places:
        damaged = bytearray(whole)
        damaged[place // 8] ^= 1 << place % 8
        file.write_bytes(damaged)
        with pytest.raises(DamagedFileError, match=file.name):
            store.read(file, digest=DIGEST)
    file.write_bytes(whole)
    store.read(file, digest=DIGEST)


def test_every_truncation_is_seen(file: Path) -> None:
    whole = file.read_bytes()
    rng = random.Random(8)
    lengths = {0, 1, 79, 80, 81, *(len(whole) - n for n in range(1, 90))}
    for length in lengths | {rng.randrange(len(whole)) for _ in range(100)}:
        file.write_bytes(whole[:length])
        with pytest.raises(DamagedFileError):
            store.read(file)


def test_more_bytes_are_seen(file: Path) -> None:
    whole = file.read_bytes()
    for content in (whole + b"\0", b"\0" + whole, whole + whole, whole[:-80] + whole[-80:] * 2):
        file.write_bytes(content)
        with pytest.raises(DamagedFileError):
            store.read(file)


@pytest.mark.parametrize("content", [b"", b"\n", b"CDF\x01", b"\x89HDF\r\n\x1a\n", b"x" * 5000])
def test_foreign_content_is_refused(file: Path, content: bytes) -> None:
    file.write_bytes(content)
    with pytest.raises(DamagedFileError, match=file.name):
        store.read(file)


def test_a_missing_file_and_a_folder_are_named(tmp_path: Path) -> None:
    for path in (tmp_path / "none.nc", tmp_path):
        with pytest.raises(DamagedFileError, match="cannot be read"):
            store.read(path)


def test_swapped_files_are_seen(tmp_path: Path, record: Record) -> None:
    paths = {digest: tmp_path / f"{digest}.nc" for digest in ("a" * 64, "b" * 64)}
    for seed, (digest, path) in enumerate(paths.items()):
        store.write(path, build(seed), digest=digest, provenance={})
    first, second = paths.values()
    other = tmp_path / "swap"
    first.rename(other)
    second.rename(first)
    other.rename(second)
    for digest, path in paths.items():
        with pytest.raises(StaleFileError, match=path.name):
            store.read(path, digest=digest)


def test_a_file_changed_by_another_program_is_seen(file: Path) -> None:
    import netCDF4

    with netCDF4.Dataset(file, "a") as dataset:
        dataset["theta"][0, 0, 0] = 1.5
    with pytest.raises(DamagedFileError):
        store.read(file)


def test_a_sealed_file_without_members_is_damaged(tmp_path: Path) -> None:
    path = tmp_path / "level_08.nc"
    record = Record(
        {},
        {"theta": Variable(("t",), np.zeros(3), {"long_name": "angle", "units": "1"})},
        {"title": "no members"},
    )
    store.write(path, record, digest=DIGEST, provenance={})
    with (
        pytest.raises(DamagedFileError, match=r"level_08\.nc"),
        store.open_level([(path, DIGEST)]),
    ):
        pass


def test_a_seal_made_for_rubbish_does_not_reach_the_caller_as_a_crash(tmp_path: Path) -> None:
    from vibsim.store import seal

    path = tmp_path / "a.nc"
    path.write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(500))
    seal.attach(path)
    with pytest.raises(FileError, match=r"a\.nc"):
        store.read(path)
