"""Rules for checks: they refer to quantities, numbers, schemes and members that the experiment has."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import count
from typing import Any

from vibsim.core.errors import nearest
from vibsim.core.vocabulary import BY_TOLERANCE, REASONS, is_error_part, plain_name
from vibsim.experiment.faults import Report
from vibsim.experiment.rules import values
from vibsim.experiment.rules.check_places import Scope
from vibsim.experiment.rules.setting import Setting
from vibsim.experiment.schema.checks import (
    SOLUTIONS,
    AccurateCheck,
    Check,
    ClaimCheck,
    ConservesCheck,
    ConvergesCheck,
    EqualCheck,
    Expect,
    StableCheck,
    ValueCheck,
)
from vibsim.experiment.value_names import CASES, OF_THE_SAME_KIND
from vibsim.experiment.yaml.parse import Path_
from vibsim.models.base import error_parts, has_error_parts
from vibsim.models.shared.free import why_not_free


def finish_checks(checks: Sequence[Any], setting: Setting, report: Report) -> tuple[Any, ...]:
    """Report every fault of the checks (None stands for a malformed one); return them, each with an id."""
    ids = check_ids(checks, setting.by_tolerance, report)
    finished = []
    for i, check in enumerate(checks):
        if check is None:
            continue
        _check(check, Scope(("checks", i), setting, report))
        update: dict[str, Any] = {"id": ids[i]}
        if isinstance(check, ClaimCheck):
            update["that"] = check.that.model_copy(update={"id": ids[i]})
        finished.append(check.model_copy(update=update))
    return tuple(finished)


def check_ids(checks: Sequence[Any], by_tolerance: bool, report: Report) -> list[str]:
    """Return the id of every check; a generated id is the position in the file."""
    ids = [check.id if check is not None else "" for check in checks]
    first: dict[str, int] = {}
    for i, id_ in enumerate(ids):
        if id_ and first.setdefault(id_, i) != i:
            report.add(("checks", i, "id"), "two checks have one id", value=id_)
        if id_ == BY_TOLERANCE and by_tolerance:
            rule = "is the id of the verdict on the tolerance itself"
            report.add(("checks", i, "id"), rule, value=id_)
    for i, id_ in enumerate(ids):
        unused = (f"check_{number}" for number in count(i + 1, len(ids)))
        ids[i] = id_ or next(name for name in unused if name not in first)
    return ids


def _check(check: Check, scope: Scope) -> None:
    if isinstance(check, ClaimCheck):
        scope = scope.at("that")
        if check.that.id:
            scope.at("id").refuse("the id belongs to the claim", at_key=True)
    inner = check.measured
    if isinstance(inner, StableCheck | ConservesCheck | EqualCheck):
        scope.at("level").check_level(inner.level)
        scope.at("case").check_case(inner.case)
        scope.at("at").check_members(inner.at, inner.case)
    if isinstance(inner, ConvergesCheck | AccurateCheck):
        scope.at("at").check_members(inner.at, None)
        check_expect(inner.expect, (*scope.path, "expect"), scope.report)
    if not isinstance(inner, ValueCheck | EqualCheck):
        scope.at("schemes").check_schemes(inner.schemes)
    match inner:
        case ConvergesCheck():
            _check_converges(inner, scope)
        case AccurateCheck():
            _check_accurate(inner, scope)
        case ValueCheck():
            _check_value_check(inner, scope)
        case ConservesCheck():
            _check_quantity(inner.conserves, "conserves", inner.schemes, scope)
            model = scope.setting.model
            if model is not None and not model.conservative:
                scope.refuse(
                    f"the energy of {model.kind} is not conserved", values.instead_of_energy(scope)
                )
        case EqualCheck():
            _check_equal(inner, scope)


def _check_quantity(
    name: str, key: str, schemes: Sequence[str] | None, scope: Scope, more: tuple[str, ...] = ()
) -> None:
    """Check that the quantity under a key of a check exists, and that the schemes named by the check have it.

    It may also be one of `more`.
    """
    if values.is_quantity(name, (*scope.setting.quantities, *more), scope.at(key)):
        values.check_velocities(
            name, ((s, scope.at("schemes", i)) for i, s in enumerate(schemes or ()))
        )


def _check_converges(check: ConvergesCheck, scope: Scope) -> None:
    name, model = check.converges, scope.setting.model
    _check_convergent(name, "converges", check.schemes, scope)
    if not is_error_part(name) or model is None or name not in error_parts(model):
        return
    if check.order == "scheme" and (reason := why_not_free(model)):
        rule = (
            f"theory knows the order of {name} on linear models without forces in time only, and "
            f"{model.kind} {reason}"
        )
        place = scope.at("order" if "order" in check.model_fields_set else "converges")
        place.refuse(rule, "give `order:` as a number")


def _check_accurate(check: AccurateCheck, scope: Scope) -> None:
    _check_convergent(check.accurate, "accurate", check.schemes, scope)
    key = given_one(check, ("relative", "absolute"), scope.path, scope.report)
    if key == "relative" and is_error_part(check.accurate):
        rule = f"is a part of the solution, and {check.accurate} is an error itself"
        scope.at("relative").refuse(rule, "give `absolute:`", at_key=True)


def _check_convergent(name: str, key: str, schemes: Sequence[str] | None, scope: Scope) -> None:
    """Check that levels can be compared by the quantity under a key."""
    model = scope.setting.model
    if not is_error_part(name):
        _check_quantity(name, key, schemes, scope, values.vectors_of(model))
    elif model is not None and name not in error_parts(model):
        rule, hint = "unknown quantity", nearest(name, error_parts(model))
        if not has_error_parts(model):
            what = "events" if model.events is not None else "a force with corners"
            rule = f"does not exist: {model.kind} has {what}, and only a smooth motion has a phase and an amplitude"
            hint = f"ask for {model.position}"
        scope.at(key).refuse(rule, hint, name)


def check_expect(expect: Expect, path: Path_, report: Report) -> None:
    """Check that the reason of the expected verdict at `path` exists and belongs to its status."""
    reason = expect.reason
    if reason is None:
        return
    if reason not in REASONS:
        hint = nearest(reason, list(REASONS))
        report.add((*path, "reason"), "unknown reason", hint, reason)
    elif REASONS[reason] != expect.status and (*path, "status") not in report.faulty:
        rule = f"reason of status {REASONS[reason]}, but the status is {expect.status}"
        choices = [name for name, status in REASONS.items() if status == expect.status]
        report.add((*path, "reason"), rule, "choose from " + ", ".join(choices), reason)


def given_one(section: Any, keys: Sequence[str], path: Path_, report: Report) -> str | None:
    """Check that a section at `path` has exactly one of `keys`, and return the first one it has.

    The result is empty if it has none of them, and None if one of them is faulty.
    """
    if any((*path, key) in report.faulty for key in keys):
        return None
    present = [key for key in keys if getattr(section, key) is not None]
    if len(present) != 1:
        listed = " and ".join(present) or "none of them"
        report.add(path, f"must have exactly one of {', '.join(keys)}; has {listed}")
    return present[0] if present else ""


def _check_value_check(check: ValueCheck, scope: Scope) -> None:
    key = given_one(check, ("equals", "below", "above"), scope.path, scope.report)
    if key is not None:
        for name in ("rtol", "atol"):
            if getattr(check, name) is not None and key != "equals":
                scope.at(name).refuse("is used with equals only", at_key=True)
    place = scope.at("at")
    _check_reduction(check, scope)
    row = values.value_named(check.value, scope.at("value"))
    if row is None:
        place.check_scheme_and_case(check.at)
        return
    if row.is_angle and check.take in OF_THE_SAME_KIND:
        _check_angle(check, scope)
    values.check_quantity_of(row, check.quantity, check.at.level == "best", scope)
    if check.quantity is not None and check.at.scheme is not None:
        values.check_velocities(check.quantity, [(check.at.scheme, place.at("scheme"))])
    place.check_place(check.at, row)


def _check_angle(check: ValueCheck, scope: Scope) -> None:
    """Refuse bounds that every angle meets, or none."""
    for key, bound in (("below", check.below), ("above", check.above)):
        if bound is not None and abs(bound) >= math.pi:
            rule = "must be between -pi and pi, where every phase lies, or it decides nothing"
            scope.at(key).refuse(rule, "phases are in radians")
    if check.allowed >= math.pi:
        rule = "allows every phase, because two of them differ by at most pi"
        scope.at("atol" if check.atol else "rtol").refuse(rule, "phases are in radians")


def _check_reduction(check: ValueCheck, scope: Scope) -> None:
    """Check that a reduction over members is over one swept key, and that all other swept keys are fixed."""
    if any(scope.at(key).is_faulty for key in ("over", "take", "at")):
        return
    if check.take is None or check.over is None:
        if (check.take is None) != (check.over is None):
            missing = "take" if check.take is None else "over"
            scope.at(missing).refuse("required key is missing: over and take belong together")
        return
    if check.take == "monotone" and check.equals not in (1.0, -1.0, 0.0):
        rule = "takes `equals: 1` (it rises), `equals: -1` (it falls) or `equals: 0` (neither)"
        scope.at("take").refuse(rule, value=check.take)
    if not scope.setting.knows_sweep:
        return
    axes = scope.setting.sweep.axes
    keys = [key for axis in axes for key in axis.keys if not key.startswith("schemes.")]
    is_of_all = check.over == CASES and check.take in OF_THE_SAME_KIND and bool(axes)
    if check.over not in keys and not is_of_all:
        rule = "is not a swept key with numbers"
        hint = nearest(check.over, keys) if keys else "there is no sweep of numbers"
        if check.over == CASES and keys:
            rule, hint = "needs a swept key with this `take`", f"choose from {', '.join(keys)}"
        scope.at("over").refuse(rule, hint, check.over)
        return
    if check.at.case is not None or check.over in check.at.swept:
        scope.at("over").refuse("is fixed by `at:`", "leave one of them out", check.over)
        return
    for axis in () if is_of_all else axes:
        fixed = set(axis.keys) & set(check.at.swept)
        if check.over in axis.keys:
            if fixed:
                hint = "leave it out of `at:`"
                scope.at("over").refuse(f"moves together with {min(fixed)}", hint, check.over)
            elif axis.count == 1:
                scope.at("over").refuse("has one value only", value=check.over)
        elif axis.count > 1 and not fixed:
            hint = f"name its value, as in `at: {{{axis.keys[0]}: ...}}`"
            scope.at("over").refuse(f"{axis.keys[0]} varies, too", hint, check.over)


def _check_equal(check: EqualCheck, scope: Scope) -> None:
    if scope.at("equal").is_faulty:
        return
    first, second = scope.at("equal", 0), scope.at("equal", 1)
    if check.first in SOLUTIONS:
        first.refuse("must be a scheme: what it must equal comes second", value=check.first)
    else:
        first.check_scheme(check.first)
    named = [(check.first, first)]
    if check.second not in SOLUTIONS:
        second.check_scheme(check.second, SOLUTIONS)
        named.append((check.second, second))
        if check.first == check.second:
            second.refuse("must differ from the first", value=check.second)
    setting, what, choices = scope.setting, "equal", scope.setting.quantities
    if check.second in SOLUTIONS and setting.model is not None:
        what, choices = check.second, tuple(state.name for state in setting.model.states)
        if check.second == "exact":
            choices += values.ENERGIES
            if plain_name(check.quantity) in choices and setting.own_velocity:
                choices += (check.quantity,)
    if values.is_quantity(check.quantity, choices, scope.at("quantity"), what):
        values.check_velocities(check.quantity, named)
        if check.second == "exact" and setting.sweep.follow:
            values.refuse_followers(check.second, second)
        elif check.second == "exact":
            values.check_exact(check.quantity, check.second, second)
        elif check.second == "discrete":
            values.check_theory(check.second, second)
    if check.second == "discrete" and check.first in setting.adaptive:
        first.refuse("chooses its own steps, for which theory knows no solution", value=check.first)
