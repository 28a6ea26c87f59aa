"""The public door of vibsim: the command line, the files it writes, and the names of `import vibsim`.

Nothing here, and no test of this folder, knows a module inside the package. What a later format of the files calls
otherwise is read in this module alone.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import xarray
from forked import vibsim  # noqa: F401

from vibsim import Experiment, Verdict, analyse, simulate, verdicts

ROOT = Path(__file__).parents[2]

FORMAT = 2
"""`vibsim_format` of every file. Format 2 changes `fact` and `interval` below with it."""

REASONS = {
    "PASS": {"asymptotic", "exact", "match"},
    "FAIL": {"order_low", "order_high", "mismatch", "wrong_limit", "unstable", "non_finite"},
    "INCONCLUSIVE": {
        "pre_asymptotic",
        "round_off",
        "oscillating",
        "non_smooth",
        "too_few_levels",
        "not_applicable",
    },
}

Content = dict[str, Any]


@dataclass(frozen=True)
class Outcome:
    """What Python makes of an experiment, in memory."""

    experiment: Experiment
    levels: dict[int, xarray.Dataset]
    convergence: xarray.Dataset
    verdicts: list[Verdict]

    def reasons(self) -> list[tuple[str, str]]:
        return [(verdict.status, verdict.reason) for verdict in self.verdicts]

    def values(self, place: int = 0) -> list[Any]:
        return [result.value for result in self.verdicts[place].results]


def build(content: Content) -> Experiment:
    return Experiment.from_dict({"title": "contract", **content})


def outcome(content: Content) -> Outcome:
    """Simulate every level of an experiment and judge it."""
    experiment = build(content)
    return judged(experiment, {level: simulate(experiment, level) for level in experiment.levels})


def judged(experiment: Experiment, levels: dict[int, xarray.Dataset]) -> Outcome:
    convergence = analyse(experiment, list(levels.values()))
    return Outcome(experiment, levels, convergence, verdicts(experiment, convergence))


def started(*arguments: object) -> subprocess.CompletedProcess[str]:
    """Run a command as a user does; `vibsim` is the same in a fork, which need not import anything."""
    command = [sys.executable, "-m", "vibsim", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=300)


def strict_json(text: str) -> Any:
    """JSON as the standard has it, without NaN and Infinity."""

    def refuse(word: str) -> None:
        raise AssertionError(f"{word} is no JSON")

    return json.loads(text, parse_constant=refuse)


def fact(result: dict[str, Any], name: str) -> Any:
    """A number of one result in ``summary.json``: `order` or `levels`."""
    return (result if FORMAT == 1 else result["facts"])[name]


def interval(result: dict[str, Any]) -> tuple[float, float] | None:
    """Between which orders the order of one result in ``summary.json`` lies."""
    if FORMAT == 1:
        return None if result["interval"] is None else tuple(result["interval"])
    low, high = fact(result, "order_low"), fact(result, "order_high")
    return None if low is None else (low, high)


def counts(verdict: Verdict) -> dict[str, int]:
    """How many results of a check have each status."""
    return {status: int(verdict.counts[status]) for status in REASONS}


def of_a_check(name: str, dims: Sequence[object]) -> bool:
    """Whether a variable of ``convergence.nc`` belongs to single checks: their names and fields may change."""
    own = {"window", "place"}
    return (
        name == "check"
        or name.startswith("check_")
        or any(str(dim).endswith("check") or dim in own for dim in dims)
    )
