"""Measure, keep what was measured in bench/measured.json, and write docs/benchmarks.md from it.

``python bench/run.py`` runs every part; ``python bench/run.py one_member jobs`` runs those alone and leaves the others
as they were measured before. ``--small`` tries every line on tiny sizes and writes nothing.
"""

from __future__ import annotations

import argparse
import importlib
import json
import os
import platform
import sys
import time
import traceback
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from bench import native, targets  # noqa: E402

MEASURED = ROOT / "bench" / "measured.json"
PAGE = ROOT / "docs" / "benchmarks.md"
PARTS = (
    *("one_member", "many_members", "same_error", "same_error_many", "pipeline", "jobs"),
    *("work_precision", "lanes", "formulas", "systems", "cost", "scale", "storage", "plans"),
    "cluster",
)


def main() -> int:
    """Measure what was asked for and write; return 1 where a part failed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("parts", nargs="*", metavar="PART", help=", ".join(PARTS))
    parser.add_argument("--small", action="store_true", help="tiny sizes, nothing is written")
    options = parser.parse_args()
    if unknown := sorted(set(options.parts) - set(PARTS)):
        parser.error(f"no such part: {', '.join(unknown)}; there are {', '.join(PARTS)}")
    known = {} if options.small else stored()
    failed = False
    for name in options.parts or PARTS:
        entry = measure(name, options.small)
        failed |= "failed" in entry
        known[name] = entry
        # after every part: what was measured is not lost with what comes later
        if not options.small:
            MEASURED.write_text(json.dumps(known, indent=1) + "\n")
            PAGE.write_text(page(known))
    print(page(known))
    return int(failed)


def stored() -> dict[str, Any]:
    """Return what was measured before, by part."""
    found: dict[str, Any] = json.loads(MEASURED.read_text()) if MEASURED.exists() else {}
    return found


def measure(name: str, small: bool) -> dict[str, Any]:
    """Run one part; one that fails says so and stops no other."""
    print(f"bench: {name}", file=sys.stderr, flush=True)
    began = time.perf_counter()
    entry: dict[str, Any] = {"title": name, "machine": machine()}
    try:
        part = importlib.import_module(f"bench.{name}")
        entry["title"] = part.TITLE
        section = part.run(small)
    except Exception as error:
        traceback.print_exc()
        entry |= {"lines": [], "figures": {}, "failed": f"{type(error).__name__}: {error}"}
    else:
        figures = {key: value for key, value in section.figures.items() if value == value}
        entry |= {"lines": list(section.lines), "figures": figures}
        if section.problems:
            entry["failed"] = "; ".join(section.problems)
        with suppress(KeyError):  # where a figure is missing, there is no answer
            entry["answer"] = part.ANSWER.format(figures)
    entry["seconds"] = round(time.perf_counter() - began, 1)
    print(f"bench: {name}: {entry['seconds']} s", file=sys.stderr, flush=True)
    return entry


def page(known: dict[str, Any]) -> str:
    """Write everything that was measured, in the order of the parts."""
    entries = [known[name] for name in PARTS if name in known]
    machines = list(dict.fromkeys(entry["machine"] for entry in entries))
    lines = [
        "# Benchmarks",
        "",
        "`make bench` writes this page. Times are medians of interleaved runs (A B C A B C ...), and ratios those of "
        "medians, on a machine without other work, unless a part says otherwise.",
        "",
        *(f"{text}\n" for text in machines[:1]),
    ]
    for entry in entries:
        lines += [f"## {entry['title']}", ""]
        if "answer" in entry:
            lines += [entry["answer"], ""]
        if entry["machine"] != machines[0]:
            lines += [difference(entry["machine"], machines[0]), ""]
        if "failed" in entry:
            lines += [f"Failed: {entry['failed']}".replace("\n", " "), ""]
        lines += entry["lines"]
    figures = {key: value for entry in entries for key, value in entry["figures"].items()}
    lines += targets.lines(figures)
    return "\n".join(lines).rstrip() + "\n"


def difference(one: str, other: str) -> str:
    """Return what of a description of a machine is not in another one."""
    known = other.removesuffix(".").split(", ")
    parts = [part for part in one.removesuffix(".").split(", ") if part not in known]
    return f"{', '.join(parts)}; the rest as above."


def machine() -> str:
    """Name the machine and the versions, without which no figure means anything."""
    from importlib.metadata import version

    cpu = next(
        (
            line.split(":", 1)[1].strip()
            for line in Path("/proc/cpuinfo").read_text().splitlines()
            if line.startswith("model name")
        ),
        platform.machine(),
    )
    packages = ", ".join(
        f"{name} {version(name)}"
        for name in ("numpy", "numba", "llvmlite", "scipy", "netCDF4", "xarray", "snakemake")
    )
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30
    return (
        f"Measured on {datetime.now(UTC):%Y-%m-%d}: {cpu}, {len(os.sched_getaffinity(0))} cores, "
        f"{memory:.0f} GiB, {platform.system()}, Python {platform.python_version()}, {packages}, "
        f"{native.version()}."
    )


if __name__ == "__main__":
    sys.exit(main())
