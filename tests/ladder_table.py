"""The table of docs/ladder.md: bounds beside true errors. ``python tests/ladder_table.py`` writes it anew."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from vibsim import ladder
from vibsim.experiment import Experiment
from vibsim.models import MODELS

PAGE = Path(__file__).parents[1] / "docs" / "ladder.md"
HEAD = "| theta_0 | arithmetic | tolerance | levels | steps | largest bound | largest error |"
ROWS = [
    (theta, arithmetic, tolerance)
    for theta in (0.1, 1.0, 2.5, 3.1)
    for arithmetic, tolerance in (
        ("compensated", 1e-6), ("compensated", 1e-10), ("increment", 1e-9), ("three_term", 1e-6),
    )
]  # fmt: skip


def measured(theta: float, arithmetic: str, tolerance: float) -> tuple[str, int, float, float]:
    """Return the levels that were chosen, their steps, the largest bound and the largest error of both states."""
    experiment = ladder.resolve(
        Experiment.from_dict(
            {
                "title": "t",
                "model": {"kind": "pendulum"},
                "initial": {"theta": theta, "omega": 0.0},
                "time": {"end": 100.0},
                "schemes": [{"kind": "central", "end_velocity": "kick", "arithmetic": arithmetic}],
                "output": "best",
                "tolerance": tolerance,
            }
        )
    )
    found = ladder.best(experiment)
    exact = MODELS["pendulum"].exact
    assert exact is not None
    true = exact(found["t"].values, experiment.initial, experiment.model.parameters)
    bound = max(float(found[f"{state}_error"].max()) for state in true)
    error = max(float(abs(found[state].values - values).max()) for state, values in true.items())
    levels = f"{experiment.levels[0]} to {experiment.levels[-1]}"
    return levels, sum(experiment.steps(lv) for lv in experiment.levels), bound, error


def lines() -> Iterator[str]:
    """Yield the table."""
    yield HEAD
    yield "|---|---|---|---|---|---|---|"
    for theta, arithmetic, tolerance in ROWS:
        levels, steps, bound, error = measured(theta, arithmetic, tolerance)
        numbers = f"{steps} | {bound:.1e} | {error:.1e}"
        yield f"| {theta} | {arithmetic} | {tolerance:.0e} | {levels} | {numbers} |"


def rows() -> list[list[str]]:
    """Return the cells of the table as it stands on the page."""
    text = PAGE.read_text().split(HEAD)[1].split("\n\n")[0]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in text.splitlines()[2:]]


if __name__ == "__main__":
    before, after = PAGE.read_text().split(HEAD)
    PAGE.write_text(before + "\n".join(lines()) + "\n\n" + after.split("\n\n", 1)[1])
