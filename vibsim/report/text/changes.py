"""The change of the experiment file that mends what did not pass, as YAML to copy: made from facts."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from vibsim.report.text import experiment_file
from vibsim.report.types import Experiment, Measurement

MOST_LEVELS = 6
"""So many finer levels are worth a line to copy; more need another problem, not more levels."""
WINDOW = 3  # levels below the finest readable one that show an order


def change(experiment: Experiment, measured: Measurement | None, check: Mapping[str, Any]) -> str:
    """Return lines of YAML to put into the file; empty where no fact tells them."""
    if check["status"] == "PASS" or measured is None or experiment.tolerance is not None:
        return ""
    result = check["results"][0]
    facts, reason = result.get("facts") or {}, result.get("reason")
    spec = next((spec for spec in experiment.schemes if spec.name == result["scheme"]), None)
    if reason == "order_low" and spec is not None and spec.options.get("start") == "first_order":
        return "\n".join(experiment_file.schemes(experiment, spec.name, start="centred"))
    levels = list(experiment.levels)
    if levels != list(range(levels[0], levels[-1] + 1)):
        return ""
    # of a check of a value that fact is a code, not a count
    more = (facts.get("levels_needed") or 0) if measured.kind == "converges" else 0
    return _levels(next(iter(_ends(levels, reason, facts, more)), None))


def _ends(
    levels: list[int], reason: str | None, facts: Mapping[str, Any], more: int
) -> Iterator[tuple[int, int]]:
    """Yield the first and the last level that would settle the question."""
    if 0 < more <= MOST_LEVELS:
        yield levels[0], levels[-1] + more
    finer = facts.get("level_needed") or -1
    if levels[-1] < finer <= levels[-1] + MOST_LEVELS:
        yield levels[0], finer
    readable = facts.get("readable_level") or -1
    if reason == "round_off" and WINDOW - 1 <= readable < levels[-1]:
        yield max(readable - WINDOW, 0), readable


def _levels(ends: tuple[int, int] | None) -> str:
    return "" if ends is None else f"levels: {{from: {ends[0]}, to: {ends[1]}}}"
