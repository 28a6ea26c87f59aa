"""What to change in the YAML where a number is not what a check asks for: finer levels only where they help."""

from __future__ import annotations

from typing import TYPE_CHECKING

from vibsim.checks.costs import cost_in_words
from vibsim.checks.value import criteria
from vibsim.checks.value.by_level import SETTLED
from vibsim.experiment.value_names import VALUES

if TYPE_CHECKING:
    from vibsim.experiment import Experiment
    from vibsim.experiment.schema.checks import ValueCheck

_ADVICE = {
    "non_finite": "Start `levels:` at a finer level, or shorten `time: end`.",
    "not_applicable": (
        "Ask for a level, a step and a time that are stored (`at:`, `samples: all`), and choose `time: end` so that "
        "the number exists."
    ),
}
FINER = 2
"""So many finer levels are advised."""
COUNTED = frozenset({"accepted_steps", "force_evaluations"})
"""Numbers that finer levels make larger, and no more accurate."""


def advise(
    experiment: Experiment,
    check: ValueCheck,
    reason: str,
    on_the_mesh: str,
    more: int,
    first: int,
) -> str:
    """Say what to change in the YAML; finer levels only where they change the number enough.

    Parameters
    ----------
    on_the_mesh
        Name of the scheme that decides where it leaves events to the mesh, else empty.
    more, first
        What finer levels do to the number, and which of them has it as asked (`vibsim.checks.value.by_level`).
    """
    if reason in _ADVICE:
        return _ADVICE[reason]
    if reason == "too_few_levels" and lacks_levels(experiment, check):
        return f"Add finer `levels:`, so that there are {VALUES[check.value].finer_levels + 1} of them."
    finest = experiment.levels[-1]
    finer = [finest + 1 + i for i in range(FINER)]
    cost = cost_in_words(experiment, finer)
    if reason != "mismatch":
        return (
            f"Add levels {finer[0]} and {finer[1]} to `levels:` ({cost}), so that the bound of the error shrinks, or "
            "ask for the number of one level (`at: {level: ...}`)."
        )
    correct = f"orrect `{criteria.border(check)}:`, the number that the check asks for"
    if check.value in COUNTED or not depends_on_level(check.value):
        return f"C{correct}."
    if VALUES[check.value].needs_events and on_the_mesh:
        return f"Set `events: located` for scheme {on_the_mesh}, or c{correct}."
    if first > 0:
        return f"Ask for a finer level (`at: {_at(check, first)}`), where the number is as asked, or c{correct}."
    if more == SETTLED:
        return f"C{correct}, or what is computed (`model:`, `initial:`): finer levels change the number too little."
    ask = (
        ""
        if check.at.level in (None, finest, "best")
        else f" and ask for one (`at: {_at(check, finer[-1])}`)"
    )
    return f"Add finer `levels:` ({finer[0]} and {finer[1]} cost {cost}){ask}, or c{correct}."


def _at(check: ValueCheck, level: int) -> str:
    """Write where a number is taken, at a finer level: a step there is the same time."""
    found = {"level": level}
    if check.at.step is not None and isinstance(check.at.level, int):
        found["step"] = check.at.step * 2 ** (level - check.at.level)
    told = {
        key: value
        for key in ("t", "scheme", "case")
        if (value := getattr(check.at, key)) is not None
    }
    return "{" + ", ".join(f"{key}: {value}" for key, value in {**found, **told}.items()) + "}"


def depends_on_level(name: str) -> bool:
    """Say whether a number is another at another level, or rests on the whole ladder."""
    return "level" in VALUES[name].at or sees_several_levels(name)


def lacks_levels(experiment: Experiment, check: ValueCheck) -> bool:
    """Say whether a number rests on more levels than the experiment has."""
    return VALUES[check.value].finer_levels >= len(experiment.levels)


def sees_several_levels(name: str) -> bool:
    """Say whether a number rests on more than one level: on finer ones, or on the whole ladder."""
    row = VALUES[name]
    return row.finer_levels > 0 or (row.of == "convergent" and "level" not in row.at)
