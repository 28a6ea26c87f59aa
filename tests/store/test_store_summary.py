from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from vibsim import store
from vibsim.core.errors import DamagedFileError, StaleFileError

from .conftest import DIGEST

CONTENT = {
    "title": "Größe",
    "values": [1.0, float("nan"), float("inf"), np.float64("nan"), np.int64(3)],
    "checks": ({"interval": (1.5, float("-inf"))},),
    "array": np.array([1.0, np.nan]),
}


@pytest.fixture
def summary(tmp_path: Path) -> Path:
    path = tmp_path / "summary.json"
    store.write_json(path, CONTENT, digest=DIGEST)
    return path


def test_numbers_that_json_lacks_are_null(summary: Path) -> None:
    found = store.read_json(summary, digest=DIGEST)
    assert found["values"] == [1.0, None, None, None, 3]
    assert found["checks"] == [{"interval": [1.5, None]}]
    assert found["array"] == [1.0, None]
    assert found["vibsim_format"] == 2
    assert next(iter(found)) == "vibsim_format"

    def refuse(name: str) -> None:
        raise AssertionError(name)

    json.loads(summary.read_text(), parse_constant=refuse)


@pytest.mark.slow
def test_every_flipped_bit_and_truncation_is_seen(summary: Path) -> None:
    whole = summary.read_bytes()
    for place in range(8 * len(whole)):
        damaged = bytearray(whole)
        damaged[place // 8] ^= 1 << place % 8
        summary.write_bytes(damaged)
        with pytest.raises(DamagedFileError, match=r"summary\.json"):
            store.read_json(summary)
    for length in range(len(whole)):
        summary.write_bytes(whole[:length])
        with pytest.raises(DamagedFileError):
            store.read_json(summary)
    summary.write_bytes(whole)
    assert store.read_json(summary)["title"] == "Größe"


def test_another_jobs_summary_is_refused(summary: Path) -> None:
    with pytest.raises(StaleFileError, match=r"summary\.json"):
        store.read_json(summary, digest="e" * 64)


@pytest.mark.parametrize("text", ["", "[]", "null", "{}", "[" * 100_000, '{"a": NaN}'])
def test_foreign_json_is_refused(summary: Path, text: str) -> None:
    summary.write_text(text)
    with pytest.raises(DamagedFileError):
        store.read_json(summary)


def test_reading_a_summary_imports_no_numerical_library() -> None:
    import subprocess
    import sys

    program = (
        "import sys; from vibsim import store; store.read_json; store.write_text\n"
        "assert not {'numpy', 'netCDF4', 'xarray'} & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", program], check=True)
