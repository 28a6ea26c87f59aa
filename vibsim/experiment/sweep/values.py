"""The values of one swept key: words of an option, flags, or numbers that a bound allows."""

from __future__ import annotations

import math
from collections.abc import Iterable

from pydantic_core import PydanticCustomError

from vibsim.core.errors import nearest
from vibsim.experiment.faults import Report
from vibsim.experiment.schema.axes import Linspace, Logspace, Range, Rule
from vibsim.experiment.schema.fields import number
from vibsim.experiment.schema.options import FLAGS
from vibsim.experiment.schema.sweep_section import Written
from vibsim.experiment.sweep.keys import Bound
from vibsim.experiment.yaml.parse import Path_

MOST = 2.0**53
"""Values of a range, at most: beyond it, their numbers are no floats."""


def words(
    written: Written, choices: tuple[str, ...], path: Path_, report: Report
) -> tuple[str, ...] | None:
    """Return the words of an option; None where one of them is none of its `choices`."""
    if not isinstance(written, tuple):
        report.add(path, "must be a list of words", "choose from " + ", ".join(choices))
        return None
    words = [word for word in written if isinstance(word, str) and word in choices]
    for i, word in enumerate(written):
        if not isinstance(word, str) or word not in choices:
            report.add((*path, i), "unknown choice", nearest(str(word), choices), word)
    return tuple(words) if len(words) == len(written) else None


def flags(written: Written, path: Path_, report: Report) -> tuple[str, ...] | None:
    """Return flags as words (`vibsim.experiment.schema.options`); None where one of them is neither true nor false."""
    if not isinstance(written, tuple):
        report.add(path, "must be a list of true and false")
        return None
    for i, value in enumerate(written):
        if not isinstance(value, bool):
            report.add((*path, i), "must be true or false", value=value)
    found = tuple(FLAGS[value] for value in written if isinstance(value, bool))
    return found if len(found) == len(written) else None


def numbers(
    written: tuple[bool | float | str, ...], path: Path_, report: Report
) -> tuple[float, ...] | None:
    """Return a list of numbers; None where one of them is a formula without a value."""
    found: list[float] = []
    for i, value in enumerate(written):
        try:
            found.append(value if isinstance(value, float) else number(value))
        except PydanticCustomError as error:
            hint = (error.context or {}).get("hint", "")
            report.add((*path, i), error.message(), hint, value)
    return tuple(found) if len(found) == len(written) else None


def ruled(rule: Rule, path: Path_, report: Report) -> Rule | None:
    """Return a rule that gives values; None, and a fault, where it does not."""
    if isinstance(rule, Range):
        return rule if _leads(rule, path, report) else None
    values = rule.linspace if isinstance(rule, Linspace) else rule.logspace
    is_sound = spans(values[0], values[1], path, report)
    if values[2] < 2:
        report.add(
            (*path, 2), f"{path[-1]} needs at least 2 values", "give a single value as a list"
        )
        is_sound = False
    for i, end in enumerate(rule.logspace[:2] if isinstance(rule, Logspace) else ()):
        if end <= 0.0:
            hint = "the ends are values, not exponents"
            report.add((*path, i), "must be greater than 0 for logspace", hint, end)
            is_sound = False
    return rule if is_sound else None


def _leads(rule: Range, path: Path_, report: Report) -> bool:
    """Check that the step of a range leads from its first value to its end."""
    first, last, step = rule.range
    if step == 0.0:
        report.add((*path, 2), "the step must not be 0", value=step)
    elif (last > first and step < 0.0) or (last < first and step > 0.0):
        report.add((*path, 2), f"the step must lead from {first:g} to {last:g}", f"{-step:g}", step)
    elif spans(first, last, path, report):
        if (last - first) / step < MOST:
            return True
        report.add((*path, 2), f"the step gives more than {MOST:g} values", value=step)
    return False


def spans(low: float, high: float, path: Path_, report: Report) -> bool:
    """Check that two ends have a difference."""
    if math.isfinite(high - low):
        return True
    report.add((*path, 1), f"is too far from {low:g}: the difference has no finite value")
    return False


def bounded(ends: Iterable[float], bound: Bound, path: Path_, report: Report) -> bool:
    """Check values against the bound of what they are for; a rule goes nowhere beyond its ends."""
    is_sound = True
    word = "greater than" if bound.exclusive else "at least"
    for i, value in enumerate(ends):
        rule = ""
        if value < bound.least or (bound.exclusive and value == bound.least):
            rule = f"must be {word} {bound.least:g}"
        elif value > bound.most:
            rule = f"must be at most {bound.most:g}"
        if rule:
            report.add((*path, i), rule, value=value)
            is_sound = False
    return is_sound
