from __future__ import annotations

import json
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray

from vibsim import store
from vibsim.core.errors import StaleFileError
from vibsim.core.record import Record, Variable

from .conftest import DIGEST, build


def same(a: Record, b: Record) -> bool:
    for table, other in ((a.coords, b.coords), (a.variables, b.variables)):
        if list(table) != list(other):
            return False
        for name, variable in table.items():
            found = other[name]
            if variable.dims != found.dims or np.shape(variable.values) != np.shape(found.values):
                return False
            if variable.values.dtype.kind == "U":
                if not np.array_equal(variable.values, found.values):
                    return False
            elif np.asarray(variable.values).tobytes() != np.asarray(found.values).tobytes():
                return False
    return True


def test_what_is_read_is_what_was_written_bit_for_bit(file: Path, record: Record) -> None:
    found = store.read(file, digest=DIGEST)
    assert same(record, found)
    assert found.attrs["level"] == 6
    assert found.attrs["list"] == [1, 2, 3]
    assert found.variables["theta"].attrs == {"long_name": "angle", "units": "rad"}
    assert found.coords["initial_theta"].attrs["sweep_key"] == "initial.theta"


def test_the_comparison_of_records_sees_one_bit(record: Record) -> None:
    values = record["theta"].copy()
    values.view(np.uint64)[1, 2, 5] ^= 1
    changed = {**record.variables, "theta": Variable(("scheme", "case", "t"), values)}
    assert not same(record, replace(record, variables=changed))


def test_identity_and_provenance_stand_in_the_file(file: Path) -> None:
    found = store.read(file)
    assert found.attrs["vibsim_format"] == 2
    assert found.attrs["digest"] == DIGEST
    assert json.loads(str(found.attrs["provenance"])) == {"experiment": {"model": "pendulum"}}


def test_xarray_opens_the_file_by_itself(file: Path, record: Record) -> None:
    with xarray.open_dataset(file) as dataset:
        assert dataset.sel(scheme="größer", case=1).theta.dims == ("t",)
        assert "initial_theta" in dataset.coords
        assert "steps" in dataset.coords
        np.testing.assert_array_equal(dataset.theta.values, record["theta"])
        assert dataset.t.dtype == np.float64
        for name, variable in dataset.variables.items():
            assert variable.attrs["long_name"], name
            assert variable.attrs["units"], name


def test_the_same_content_gives_the_same_bytes(tmp_path: Path, file: Path) -> None:
    before = file.read_bytes()
    time.sleep(1.1)  # a time stamp inside would have a resolution of one second
    other = tmp_path / "elsewhere" / "other.nc"
    store.write(other, build(), digest=DIGEST, provenance={"experiment": {"model": "pendulum"}})
    assert other.read_bytes() == before


def test_another_process_writes_the_same_bytes(tmp_path: Path, file: Path) -> None:
    program = (
        "import sys; sys.path.insert(0, sys.argv[2]); from pathlib import Path\n"
        "from vibsim import store; from tests.store.conftest import build, DIGEST\n"
        "store.write(Path(sys.argv[1]), build(), digest=DIGEST,"
        " provenance={'experiment': {'model': 'pendulum'}})"
    )
    other = tmp_path / "other.nc"
    root = Path(__file__).parents[2]
    subprocess.run([sys.executable, "-c", program, str(other), str(root)], check=True)
    assert other.read_bytes() == file.read_bytes()


def test_small_data_are_contiguous_and_uncompressed(file: Path) -> None:
    import netCDF4

    with netCDF4.Dataset(file) as dataset:
        assert dataset["theta"].chunking() == "contiguous"
        assert not any(dataset["theta"].filters().values())


def test_another_jobs_file_is_refused_by_name(file: Path) -> None:
    with pytest.raises(
        StaleFileError, match=r"level_06\.nc.*another|level_06\.nc.*job dddddddddddd"
    ):
        store.read(file, digest="e" * 64)


@pytest.mark.parametrize("missing", ["long_name", "units"])
def test_a_variable_without_name_or_unit_is_refused(
    tmp_path: Path, record: Record, missing: str
) -> None:
    theta = record.variables["theta"]
    attrs = {key: value for key, value in theta.attrs.items() if key != missing}
    variables = {**record.variables, "theta": replace(theta, attrs=attrs)}
    path = tmp_path / "a.nc"
    with pytest.raises(ValueError, match=f"theta.*{missing}"):
        store.write(path, replace(record, variables=variables), digest=DIGEST, provenance={})
    assert list(tmp_path.iterdir()) == []


def test_a_record_without_title_is_refused(tmp_path: Path, record: Record) -> None:
    with pytest.raises(ValueError, match="title"):
        store.write(tmp_path / "a.nc", replace(record, attrs={}), digest=DIGEST, provenance={})


def test_values_without_a_type_for_files_are_refused(tmp_path: Path, record: Record) -> None:
    attrs = {"long_name": "x", "units": "1"}
    variables = {"x": Variable(("case",), np.zeros(3, dtype=complex), attrs)}
    with pytest.raises(ValueError, match=r"x.*complex"):
        store.write(
            tmp_path / "a.nc", replace(record, variables=variables), digest=DIGEST, provenance={}
        )


@pytest.mark.parametrize("folder", ["a b", "a#b", "x'{y}", "http:", "[mode]=1", "a%20b", "ü"])
def test_paths_may_hold_any_character(tmp_path: Path, record: Record, folder: str) -> None:
    path = tmp_path / folder / "f#mode=nczarr,file.nc"
    store.write(path, record, digest=DIGEST, provenance={})
    assert same(record, store.read(path))
    assert [p.name for p in path.parent.iterdir()] == [path.name]


def test_large_provenance_fits(tmp_path: Path, record: Record) -> None:
    path = tmp_path / "a.nc"
    values = list(range(200_000))
    store.write(path, record, digest=DIGEST, provenance={"sweep": values})
    assert json.loads(str(store.read(path).attrs["provenance"])) == {"sweep": values}


@pytest.mark.slow
def test_cf_checker_finds_nothing(file: Path) -> None:
    checker = Path(sys.executable).with_name("compliance-checker")
    ended = subprocess.run(
        [checker, "--test", "cf:1.11", "--criteria", "strict", str(file)],
        capture_output=True,
        text=True,
        check=False,
    )
    text = ended.stdout + ended.stderr
    assert "All tests passed!" in ended.stdout, text
    assert "exceptions occurred" not in text
    assert ended.returncode == 0
