"""``vibsim diff``: the differences between two experiments or two results in settings, verdicts and numbers."""

from __future__ import annotations

import math
from argparse import Namespace
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from vibsim.cli.chosen_plans import one_plan_of
from vibsim.cli.jobs.common import chosen_results
from vibsim.cli.level_member import are_outdated, summary_of
from vibsim.cli.setting_changes import Change, differences
from vibsim.cli.terminal import clean, painted
from vibsim.core.home import typed
from vibsim.plan.digests import analysed
from vibsim.store import read_json

_DIGITS = 6
_RESULTS = ("summary.json", "convergence.nc", "report.html")  # each may name its results folder


class Side(NamedTuple):
    """One of two experiments."""

    content: Mapping[str, Any]  # the settings that its results depend on, in normal form
    title: str
    summary: Mapping[str, Any] | None  # its verdicts; None if there are none for these settings
    command: str = ""  # the command that makes them


def diff(options: Namespace) -> int:
    """Print the differences; return 1 if there are any, else 0."""
    results = chosen_results(options)
    words = (options.first, options.second)
    first, second = sides = [_side(word, results) for word in words]
    missing = [pair for pair in zip(words, sides, strict=True) if pair[1].summary is None]
    changes = differences(*({"title": side.title} for side in sides))
    parts = {"settings": changes + differences(first.content, second.content)}
    if first.summary is not None and second.summary is not None:
        pairs = _pairs(first.summary, second.summary)
        parts["verdicts"] = list(_verdicts(pairs))
        parts["numbers"] = list(_numbers(pairs))
    for name, changes in parts.items():
        if changes:
            print(painted(name, "bold"))
            print(*(f"  {change}" for change in changes), sep="\n")
    for word, side in missing:
        print(f"{word}: there are no verdicts of these settings yet: {typed(side.command)}")
    if any(parts.values()):
        return 1
    if not missing:
        print("no difference")
    return 0


def _side(word: str, results: Path) -> Side:
    """Return the side that a word names: a folder of results, or an experiment with its current results, if any.

    Raises FileError where results are damaged.
    """
    path = Path(word)
    folder = path.parent if path.name in _RESULTS else path
    if (folder / "summary.json").exists():
        from vibsim.store.reading import read_provenance

        summary = read_json(folder / "summary.json")
        made = read_provenance(folder / "convergence.nc")
        return Side(made["experiment"], str(summary["title"]), summary)
    plan = one_plan_of(word)
    current = summary_of(plan, results)
    if current is not None and are_outdated(plan, current):
        current = None
    return Side(analysed(plan.content), plan.title, current, plan.command_to_run(word))


Pair = tuple[str, Mapping[str, Any] | None, Mapping[str, Any] | None]
"""Name of a check, and the check on both sides; None where a side has no such check."""


def _pairs(first: Mapping[str, Any], second: Mapping[str, Any]) -> list[Pair]:
    before, after = ({row["id"]: row for row in side["checks"]} for side in (first, second))
    return [(name, before.get(name), after.get(name)) for name in dict.fromkeys([*before, *after])]


def _verdicts(pairs: Sequence[Pair]) -> Iterator[Change]:
    for name, *sides in pairs:
        old, new = ("" if row is None else f"{row['status']} ({row['reason']})" for row in sides)
        if old != new:
            yield Change(clean(name), old, new)


def _numbers(pairs: Sequence[Pair]) -> Iterator[Change]:
    """Compare the numbers of those results that both sides list."""
    for name, *sides in pairs:
        old, new = ({} if row is None else _facts(row) for row in sides)
        for key in (key for key in old if key in new):
            if old[key] != new[key]:
                yield Change(clean(f"{name}.{key}"), *_written(old[key], new[key]))


def _facts(check: Mapping[str, Any]) -> dict[str, float]:
    """Return the numbers of a check by name, preceded by scheme and member where there are several."""
    rows = check["results"]
    several = len({row["scheme"] for row in rows}) > 1, len({row["case"] for row in rows}) > 1
    facts = {}
    for row in rows:
        place = [row["scheme"]] * several[0] + [f"case {row['case']}"] * several[1]
        for name, value in row["facts"].items():
            if isinstance(value, float) and math.isfinite(value):
                facts[".".join([*place, name])] = value
    return facts


def _written(old: float, new: float) -> tuple[str, str]:
    """Return two different numbers as text, with enough digits to tell them apart."""
    texts = ((f"{old:.{digits}g}", f"{new:.{digits}g}") for digits in range(_DIGITS, 18))
    return next(pair for pair in texts if pair[0] != pair[1])
