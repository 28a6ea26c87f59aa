"""Run the same experiments in two checkouts and compare what they give: verdicts, reasons, and every number.

``python tests/comparison/checkouts.py OLD NEW [EXPERIMENT or COLLECTION ...]`` runs each checkout with its own
environment into a folder of its own (``--work DIR`` keeps both, and goes on with what is there). Compared are

- the status and reason of the whole, of each check, and of each result of a check, from ``summary.json``;
- the decoded values of every variable that both have, in every netCDF file that both have. NaN equals NaN.

What only one side has is listed and is no difference. Exit status 1 where something differs.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from netCDF4 import Dataset

SIDES = ("old", "new")


@dataclass
class Comparison:
    """What was found, in lines."""

    verdicts: int = 0
    values: int = 0
    differences: list[str] = field(default_factory=list)
    alone: list[str] = field(default_factory=list)
    """What only one side has."""


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("old", type=Path)
    parser.add_argument("new", type=Path)
    parser.add_argument("experiments", nargs="*")
    parser.add_argument("--work", type=Path, help="folder that keeps both results")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="vibsim-compared-") as temporary:
        work = options.work or Path(temporary)
        folders = [work.absolute() / side for side in SIDES]
        for checkout, folder in zip((options.old, options.new), folders, strict=True):
            run(checkout.absolute(), folder, options.experiments)
        found = compare(*folders)
    print(*found.alone, *found.differences, sep="\n")
    print(
        f"{found.verdicts} verdicts, {found.values} variables compared: {len(found.differences)} differ"
    )
    return 1 if found.differences else 0


def run(checkout: Path, results: Path, experiments: list[str]) -> None:
    """Run `experiments` with the vibsim of `checkout`; a check that does not pass is a result, too."""
    results.mkdir(parents=True, exist_ok=True)
    command = [checkout / ".venv/bin/vibsim", "run", *experiments, "--results", results]
    ended = subprocess.run(
        [*map(str, command), "--json"], cwd=checkout, capture_output=True, text=True, check=False
    )
    if ended.returncode not in (0, 1):
        sys.exit(f"{checkout}: {ended.stderr}")


def compare(old: Path, new: Path) -> Comparison:
    """Compare two results folders."""
    found = Comparison()
    files = [{file.relative_to(side).as_posix() for file in _results(side)} for side in (old, new)]
    found.alone += [f"{name}: only in {side}" for name, side in _only(*files)]
    for name in sorted(files[0] & files[1]):
        if name.endswith(".json"):
            _compare_summaries(name, old / name, new / name, found)
        else:
            _compare_datasets(name, old / name, new / name, found)
    return found


def _results(folder: Path) -> Iterator[Path]:
    yield from folder.glob("*/*/summary.json")
    yield from (file for file in folder.glob("*/*/**/*.nc") if not file.name.startswith("."))


def _only(old: set[str], new: set[str]) -> list[tuple[str, str]]:
    return [(name, "old") for name in sorted(old - new)] + [
        (name, "new") for name in sorted(new - old)
    ]


def _compare_summaries(name: str, old: Path, new: Path, found: Comparison) -> None:
    before, after = (verdicts(json.loads(path.read_text())) for path in (old, new))
    found.alone += [
        f"{name}: {what}: only in {side}" for what, side in _only(set(before), set(after))
    ]
    for what in sorted(set(before) & set(after)):
        found.verdicts += 1
        if before[what] != after[what]:
            found.differences.append(f"{name}: {what}: {before[what]} became {after[what]}")


def verdicts(summary: dict[str, Any]) -> dict[str, str]:
    """Return status and reason of everything in a summary that has them, by where it stands."""
    found = {"experiment": str(summary["status"])}
    for check in summary["checks"]:
        found[f"check {check['id']}"] = _judged(check)
        for row in check["results"]:
            found[f"check {check['id']}, {row['scheme']}, case {row['case']}"] = _judged(row)
    return found


def _judged(row: dict[str, Any]) -> str:
    return f"{row['status']} ({row['reason']})"


def _compare_datasets(name: str, old: Path, new: Path, found: Comparison) -> None:
    with Dataset(old) as before, Dataset(new) as after:
        for dataset in (before, after):
            dataset.set_auto_mask(False)
        sides = [dict(_variables(dataset)) for dataset in (before, after)]
        found.alone += [f"{name}: {what}: only in {side}" for what, side in _only(*map(set, sides))]
        for what in sorted(set(sides[0]) & set(sides[1])):
            found.values += 1
            if difference := unlike(*(np.asarray(side[what][...]) for side in sides)):
                found.differences.append(f"{name}: {what}: {difference}")


def _variables(group: Any) -> Iterator[tuple[str, Any]]:
    for name, variable in group.variables.items():
        yield f"{group.path}/{name}".lstrip("/"), variable
    for inner in group.groups.values():
        yield from _variables(inner)


def unlike(old: np.ndarray, new: np.ndarray) -> str:
    """Say how two arrays differ; empty where every value is the same."""
    if old.shape != new.shape:
        return f"shape {old.shape} became {new.shape}"
    is_float = old.dtype.kind == new.dtype.kind == "f"
    if np.array_equal(old, new, equal_nan=is_float):
        return ""
    text = f"{np.sum((old != new) & ~((old != old) & (new != new)))} of {old.size} values"
    finite = np.isfinite(old) & np.isfinite(new) if is_float else np.zeros(old.shape, bool)
    if not finite.any():
        return text
    return f"{text}, by {np.max(np.abs(old[finite] - new[finite])):.3g} at most"


if __name__ == "__main__":
    sys.exit(main())
