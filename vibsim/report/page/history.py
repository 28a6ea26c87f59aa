"""The data that differ between runs: when the results of an experiment were made, how long it took, and what changed.

Results hold no clock times, so these have their own file. The index reads it if scripts run and it exists. The file
is JSON after the name of a variable, since a page opened from a disk may load scripts, but no data. Its content is
treated as data: entries of another form are ignored.
"""

from __future__ import annotations

import csv
import json
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from vibsim import store
from vibsim.core import regular_files

FILE = ".vibsim/history.js"  # path within the results folder
_BEFORE, _BEHIND = "vibsimHistory = ", ";\n"


def update(results: Path, found: Mapping[str, tuple[str, str]]) -> None:
    """Write the file anew after a run that changed any result; without ``.vibsim``, which a run makes, do nothing.

    `found` has status and headline number of every experiment by its key, ``<collection>/<name>``.
    """
    if not (results / ".vibsim").is_dir():
        return
    known = load(results)
    entries = {key: _entry(results / key, *of, known.get(key)) for key, of in found.items()}
    if {key: entry["made"] for key, entry in entries.items()} == {
        key: entry["made"] for key, entry in known.items()
    }:
        return
    text = json.dumps(entries, ensure_ascii=True, sort_keys=True, separators=(",", ":"))
    # the file is optional, so a folder that cannot be written is no error
    with suppress(OSError):
        store.write_text(results / FILE, f"{_BEFORE}{text}{_BEHIND}")


def load(results: Path) -> dict[str, dict[str, Any]]:
    """Return the entries of the file by the keys of experiments; empty if it cannot be read."""
    try:
        with regular_files.reading(results / FILE) as stream:
            text = stream.read().decode()
        found = json.loads(text.removeprefix(_BEFORE).removesuffix(_BEHIND))
    except (OSError, ValueError, RecursionError):
        return {}
    if not isinstance(found, dict):
        return {}
    return {key: entry for key, entry in found.items() if _is_entry(entry)}


def _entry(
    folder: Path, status: str, number: str, before: Mapping[str, Any] | None
) -> dict[str, Any]:
    """Return the entry of an experiment: when it was made [ms], its run time [s], and its earlier status and number."""
    made = 0
    with suppress(OSError):
        made = int((folder / "summary.json").stat().st_mtime * 1000)
    entry = {"made": made, "seconds": _seconds(folder), "status": status, "number": number}
    if before is None:
        return entry | {"new": True}
    # a missing number is not a change
    was = {
        key: before[key]
        for key in ("status", "number")
        if before[key] and entry[key] and before[key] != entry[key]
    }
    return entry | ({"was": was} if was else {})


def _seconds(folder: Path) -> float:
    """Return the time that the jobs of an experiment took, as Snakemake measured it."""
    total = 0.0
    for file in folder.glob("benchmarks/*.tsv"):
        with suppress(OSError, ValueError, KeyError), regular_files.reading(file) as stream:
            lines = stream.read().decode().splitlines()
            total += sum(float(row["s"]) for row in csv.DictReader(lines, delimiter="\t"))
    return round(total, 1)


def _is_entry(entry: Any) -> bool:
    if not isinstance(entry, dict) or not isinstance(entry.get("made"), int):
        return False
    return all(isinstance(entry.get(key), str) for key in ("status", "number"))
