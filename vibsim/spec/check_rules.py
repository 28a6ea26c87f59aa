"""What a check must be besides well-formed: it names what the experiment has."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from vibsim.errors import nearest
from vibsim.models import Model, quantities
from vibsim.schemes import SCHEMES
from vibsim.spec.checks import At, Check, ClaimCheck, ConvergesCheck, ValueCheck
from vibsim.spec.experiment import TimeSpec
from vibsim.spec.faults import Report
from vibsim.spec.limits import Shape
from vibsim.spec.source import Path_
from vibsim.spec.values import VALUES, Value
from vibsim.vocabulary import REASONS


@dataclass(frozen=True)
class Ladder:
    """What checks may name; None or empty where a section is faulty, and then nothing is said about it."""

    model: Model | None
    schemes: tuple[str, ...]
    shape: Shape
    time: TimeSpec | None
    end: float | None
    """The last time of every member, None where it varies; then `t` is a fraction."""


def finish_checks(checks: Iterable[Any], ladder: Ladder, report: Report) -> tuple[Any, ...]:
    """Note every fault of the checks (None stands for a malformed one); give an id to those without."""
    listed = list(checks)
    ids = _ids(listed, report)
    finished = []
    for i, check in enumerate(listed):
        if check is None:
            continue
        path: Path_ = ("checks", i)
        _check(check, path, ladder, report)
        update: dict[str, Any] = {"id": ids[i]}
        if isinstance(check, ClaimCheck):
            update["that"] = check.that.model_copy(update={"id": ids[i]})
        finished.append(check.model_copy(update=update))
    return tuple(finished)


def _ids(checks: list[Any], report: Report) -> list[str]:
    """Return the id of every check; a generated one is its place in the file."""
    given: dict[str, int] = {}
    for i, check in enumerate(checks):
        if check is not None and check.id and given.setdefault(check.id, i) != i:
            report.add(("checks", i, "id"), "two checks have one id", value=check.id)
    ids = []
    for i, check in enumerate(checks):
        name = check.id if check is not None else ""
        number = i + 1
        while not name:
            candidate = f"check_{number}"
            name = candidate if candidate not in given else ""
            number += len(checks)
        ids.append(name)
    return ids


def _check(check: Check, path: Path_, ladder: Ladder, report: Report) -> None:
    if isinstance(check, ClaimCheck):
        path = (*path, "that")
        if check.that.id:
            report.add((*path, "id"), "the id belongs to the claim", at_key=True)
    measured = check.measured
    if isinstance(measured, ConvergesCheck):
        _converges(measured, path, ladder, report)
    else:
        _value(measured, path, ladder, report)


def _converges(check: ConvergesCheck, path: Path_, ladder: Ladder, report: Report) -> None:
    _quantity(check.converges, (*path, "converges"), ladder, report)
    for i, name in enumerate(check.schemes or ()):
        _scheme(name, (*path, "schemes", i), ladder, report)
        if name in (check.schemes or ())[:i]:
            report.add((*path, "schemes", i), "a scheme must not be repeated", value=name)
    reason = check.expect.reason
    if reason is None:
        return
    place = (*path, "expect", "reason")
    if reason not in REASONS:
        report.add(place, "unknown reason", nearest(reason, list(REASONS)), reason)
    elif REASONS[reason] != check.expect.status and not _is_faulty(
        (*path, "expect", "status"), report
    ):
        rule = f"reason of status {REASONS[reason]}, but the status is {check.expect.status}"
        choices = [name for name, status in REASONS.items() if status == check.expect.status]
        report.add(place, rule, "choose from " + ", ".join(choices), reason)


def _is_faulty(path: Path_, report: Report) -> bool:
    """Tell whether the value at `path` is malformed and was left out."""
    return path in report.faulty


def _quantity(name: str, path: Path_, ladder: Ladder, report: Report) -> None:
    if ladder.model is not None and name not in quantities(ladder.model):
        report.add(path, "unknown quantity", nearest(name, quantities(ladder.model)), name)


def _scheme(name: str, path: Path_, ladder: Ladder, report: Report) -> None:
    # where a scheme of the list is itself unknown, its right name may be meant
    broken = any(known not in SCHEMES for known in ladder.schemes) and name in SCHEMES
    if ladder.schemes and name not in ladder.schemes and not broken:
        report.add(path, "not a scheme of this experiment", nearest(name, ladder.schemes), name)


def _value(check: ValueCheck, path: Path_, ladder: Ladder, report: Report) -> None:
    _comparison(check, path, report)
    row = VALUES.get(check.value)
    if row is None:
        report.add(
            (*path, "value"), "unknown value", nearest(check.value, list(VALUES)), check.value
        )
        _anywhere(check.at, (*path, "at"), ladder, report)
        return
    _of(check, row, path, ladder, report)
    _exact(check, row, path, ladder, report)
    _at(check.at, row, (*path, "at"), ladder, report)


def _comparison(check: ValueCheck, path: Path_, report: Report) -> None:
    given = [name for name in ("equals", "below", "above") if getattr(check, name) is not None]
    if any(_is_faulty((*path, name), report) for name in ("equals", "below", "above")):
        return
    if len(given) != 1:
        found = " and ".join(given) or "none of them"
        report.add(path, f"must have exactly one of equals, below, above; has {found}")
    for name in ("rtol", "atol"):
        if getattr(check, name) is not None and "equals" not in given:
            report.add((*path, name), "is used with equals only", at_key=True)


def _of(check: ValueCheck, row: Value, path: Path_, ladder: Ladder, report: Report) -> None:
    """Check which quantity a value is of."""
    if row.of == "none":
        if check.quantity is not None:
            rule = f"{row.name} is of the motion as a whole and takes no quantity"
            report.add((*path, "quantity"), rule, at_key=True)
        return
    choices = allowed(row, ladder.model, check.at.level == "best")
    if check.quantity is None:
        rule = f"required key is missing: {row.name} is of a quantity"
        report.add((*path, "quantity"), rule, "choose from " + ", ".join(choices))
    elif choices and check.quantity not in choices:
        known = ladder.model is not None and check.quantity in quantities(ladder.model)
        rule = f"{row.name} is not known of this quantity" if known else "unknown quantity"
        hint = "choose from " + ", ".join(choices) if known else nearest(check.quantity, choices)
        report.add((*path, "quantity"), rule, hint, check.quantity)


def _exact(check: ValueCheck, row: Value, path: Path_, ladder: Ladder, report: Report) -> None:
    """Check that the model knows exactly what the value is compared with."""
    model = ladder.model
    if model is None or row.needs_exact is None:
        return
    if row.needs_exact == "period" and model.exact_period is None:
        report.add((*path, "value"), f"the exact period of {model.kind} is not known")
    # the energy is known where it is conserved, and nowhere else
    energies = ("energy", "energy_deviation")
    known = model.conservative if check.quantity in energies else model.exact is not None
    if row.needs_exact == "solution" and not known:
        hint = f"{' and '.join(energies)} are" if model.conservative else ""
        rule = f"the exact {check.quantity or 'solution'} of {model.kind} is not known"
        report.add((*path, "value"), rule, hint)


def allowed(row: Value, model: Model | None, best: bool = False) -> tuple[str, ...]:
    """Name the quantities of `model` that `row` can be of; `best`: of the extrapolated solution."""
    if model is None or row.of == "none":
        return ()
    states = tuple(state.name for state in model.states)
    if row.of == "states":
        return states
    if row.of == "deviation":
        return ("energy_deviation",)
    if row.of == "extremal":
        return (*states, "energy_deviation")
    if row.of == "convergent" or best:
        return (*states, "energy", "energy_deviation")
    return quantities(model)


def _at(at: At, row: Value, path: Path_, ladder: Ladder, report: Report) -> None:
    given = [
        name
        for name in At.model_fields
        if getattr(at, name) is not None or _is_faulty((*path, name), report)
    ]
    for name in given:
        if name not in row.at:
            rule = f"{row.name} takes no {name}"
            report.add((*path, name), rule, "it takes " + ", ".join(row.at), at_key=True)
    if row.needs_time and "t" not in given and "step" not in given:
        report.add(path, f"{row.name} needs t or step")
    if "t" in given and "step" in given:
        report.add((*path, "step"), "must not be given together with t", at_key=True)
    _anywhere(at, path, ladder, report)
    level = _level(at, row, path, ladder, report)
    if level is not None and "t" in row.at:
        _sample(at, level, path, ladder, report)


def _anywhere(at: At, path: Path_, ladder: Ladder, report: Report) -> None:
    """Check what is the same for every value: the scheme and the case."""
    if at.scheme is not None:
        _scheme(at.scheme, (*path, "scheme"), ladder, report)
    members = ladder.shape.members
    if at.case is not None and members is not None and at.case >= members:
        there = "there is 1 case" if members == 1 else f"there are {members} cases"
        report.add((*path, "case"), f"must be at most {members - 1}", there)


def _level(at: At, row: Value, path: Path_, ladder: Ladder, report: Report) -> int | None:
    """Check the level; return it where it is one of the ladder, the finest by default."""
    levels = ladder.shape.levels
    if _is_faulty((*path, "level"), report) or _is_faulty(path, report):
        return None
    if at.level is None or not levels or "level" not in row.at:
        return levels[-1] if levels else None
    place = (*path, "level")
    if at.level == "best":
        if not row.best:
            report.add(place, f"{row.name} does not exist of the extrapolated solution")
        # that solution has the times of the coarsest level
        return levels[0]
    if at.level not in levels:
        closest = min(levels, key=lambda level: abs(level - int(at.level or 0)))
        hint = f"nearest is {closest}; levels are {', '.join(map(str, levels))}"
        report.add(place, "not a level of this experiment", hint, at.level)
        return None
    finer = len(levels) - 1 - levels.index(at.level)
    if finer < row.finer_levels:
        word = "level" if row.finer_levels == 1 else "levels"
        there = "there is 1" if finer == 1 else f"there are {finer or 'none'}"
        rule = f"{row.name} needs {row.finer_levels} finer {word} beside it, {there}"
        report.add(place, rule, value=at.level)
    return at.level


def _sample(at: At, level: int, path: Path_, ladder: Ladder, report: Report) -> None:
    """Check that a time or a step is among the samples of `level`."""
    steps = ladder.shape.steps(level)
    if steps is None or ladder.time is None:
        return
    every = ladder.shape.stride(level)
    if at.step is not None:
        if at.step > steps:
            report.add((*path, "step"), f"must be at most {steps}, the steps of level {level}")
        elif at.step % every:
            low = at.step - at.step % every
            rule = f"not a stored step of level {level}, where every {every}th is stored"
            report.add((*path, "step"), rule, f"nearest are {low} and {low + every}")
    if at.t is not None:
        _time(at.t, steps, every, path, ladder, report)


def _time(t: float, steps: int, every: int, path: Path_, ladder: Ladder, report: Report) -> None:
    end = 1.0 if ladder.end is None else ladder.end
    if not 0.0 <= t <= end:
        word = "the fraction 1 of the end" if ladder.end is None else f"the end {end:g}"
        report.add((*path, "t"), f"must be between 0 and {word}", value=t)
        return
    dt = end / (steps // every)
    index = min(round(t / dt), steps // every)
    if abs(t - index * dt) > 1e-9 * dt:
        low = min(int(t / dt), steps // every - 1)
        rule = "not a stored sample time"
        report.add((*path, "t"), rule, f"nearest are {low * dt:.12g} and {(low + 1) * dt:.12g}", t)
