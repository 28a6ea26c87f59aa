"""Writing netCDF: how fast, and how small, in each way of storing an array of solutions."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np

from bench import ours
from bench.page import Section, table
from bench.timing import interleave, seconds

TITLE = "Storage"
ANSWER = (
    "Writing without compression is {0[storage.contiguous_over_compressed]:.1f} times faster than with the fastest "
    "compression."
)

WAYS: dict[str, dict[str, Any]] = {
    "contiguous": {"contiguous": True},
    "chunked": {"contiguous": False},
    "chunked, zlib 1": {"compression": "zlib", "complevel": 1},
    "chunked, zlib 4": {"compression": "zlib", "complevel": 4},
    "chunked, zstd 1": {"compression": "zstd", "complevel": 1},
    "chunked, zstd 4": {"compression": "zstd", "complevel": 4},
}


def run(small: bool) -> Section:
    """Write the same solutions in every way."""
    members, samples, rounds = (64, 64, 1) if small else (16_384, 256, 3)
    theta = np.linspace(0.1, 2.5, members)
    values = np.ascontiguousarray(ours.step(theta, 20.0, 2 * samples, samples=samples).position)
    rows: list[list[object]] = []
    reasons: list[list[object]] = []
    with tempfile.TemporaryDirectory(prefix="vibsim-bench-") as name:
        runs: dict[str, Callable[[], float]] = {}
        for way, options in WAYS.items():
            file = Path(name) / f"{way}.nc"
            try:
                write(file, values, options)
            except Exception as error:
                reasons.append([way, f"not measured: {error}", None, None])
                continue
            runs[way] = seconds(partial(write, file, values, options))
        times = interleave(runs, rounds)
        speed = {way: values.nbytes / 1e6 / took for way, took in times.items()}
        for way, rate in speed.items():
            size = (Path(name) / f"{way}.nc").stat().st_size / values.nbytes
            rows.append([way, rate, rate / speed["contiguous"], size])
    caption = (
        f"{values.nbytes / 1e6:.0f} MB of solutions to netCDF-4 in the temporary folder, {rounds} rounds; the system "
        "may still hold them in memory."
    )
    header = ["way", "MB/s", "over contiguous", "size over that of the numbers"]
    compressed = max(rate for way, rate in speed.items() if way.startswith("chunked, z"))
    figures = {"storage.contiguous_over_compressed": speed["contiguous"] / compressed}
    return Section(tuple(table(caption, header, [*rows, *reasons])), figures)


def write(path: Path, values: ours.Floats, options: dict[str, Any]) -> None:
    """Write one variable to a new file."""
    with netCDF4.Dataset(path, "w") as file:
        for name, size in zip(("case", "t"), values.shape, strict=True):
            file.createDimension(name, size)
        file.createVariable("theta", "f8", ("case", "t"), **options)[:] = values
