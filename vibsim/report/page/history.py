"""What no two runs share: when the results of an experiment were made, how long it took, and what changed.

No clock time is in any result, so this stands in a file of its own. The index reads it where scripts run, and says
nothing of it where it is missing. The file is JSON behind the name of a variable, since a page that was opened from a
disk may load a script, but no data. What it holds is data: an entry of another form counts as not there.
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

FILE = ".vibsim/history.js"
"""Within the results folder."""
_BEFORE, _BEHIND = "vibsimHistory = ", ";\n"


def update(results: Path, found: Mapping[str, tuple[str, str]]) -> None:
    """Write the file anew after a run that changed any result.

    Parameters
    ----------
    results
        Folder of results; without ``.vibsim`` in it, which a run makes, nothing is written.
    found
        Status and headline number of every experiment by its key, ``<collection>/<name>``.
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
    # it is only told, so that a folder that cannot be written loses nothing
    with suppress(OSError):
        store.write_text(results / FILE, f"{_BEFORE}{text}{_BEHIND}")


def load(results: Path) -> dict[str, dict[str, Any]]:
    """Return the entries of the file by the keys of experiments; empty where it cannot be read."""
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
    """Return the entry of an experiment: when it was made [ms], its time of work [s], and what it was before."""
    made = 0
    with suppress(OSError):
        made = int((folder / "summary.json").stat().st_mtime * 1000)
    entry = {"made": made, "seconds": _seconds(folder), "status": status, "number": number}
    if before is None:
        return entry | {"new": True}
    # what has no number now, or had none, tells no change of it
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
