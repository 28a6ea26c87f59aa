"""Run every benchmark and write docs/benchmarks.md."""

from __future__ import annotations

import platform
import shutil
import subprocess
import sys
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from bench import jobs, one_member  # noqa: E402


def machine() -> list[str]:
    """Name the machine and the versions, without which no figure means anything."""
    cpu = next(
        (
            line.split(":", 1)[1].strip()
            for line in Path("/proc/cpuinfo").read_text().splitlines()
            if line.startswith("model name")
        ),
        platform.machine(),
    )
    compiler = "none"
    if shutil.which("gcc"):
        done = subprocess.run(["gcc", "--version"], capture_output=True, text=True, check=True)
        compiler = done.stdout.splitlines()[0]
    packages = ", ".join(
        f"{name} {version(name)}" for name in ("numpy", "numba", "netCDF4", "snakemake")
    )
    return [
        f"Measured on {datetime.now(UTC):%Y-%m-%d}: {cpu}, {platform.system()}, Python "
        f"{platform.python_version()}, {packages}, {compiler}.",
    ]


def main() -> None:
    """Measure and write."""
    lines = [
        "# Benchmarks",
        "",
        "Written by `make bench`; medians of interleaved runs.",
        "",
        *machine(),
        "",
    ]
    for part in (one_member, jobs):
        lines += [*part.run(), ""]
    text = "\n".join(lines)
    (ROOT / "docs" / "benchmarks.md").write_text(text)
    print(text)


if __name__ == "__main__":
    main()
