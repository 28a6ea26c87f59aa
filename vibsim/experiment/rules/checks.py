"""What checks and printed tables must be besides well-formed: they name what the model and the schemes have."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import count
from typing import Any

from vibsim.core.errors import nearest
from vibsim.core.vocabulary import BY_TOLERANCE, REASONS, is_error_part, plain_name
from vibsim.experiment.faults import Report
from vibsim.experiment.rules.check_places import Scope
from vibsim.experiment.rules.potential import NOT_FOUND
from vibsim.experiment.rules.size_limits import Setting
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
from vibsim.experiment.schema.published import row_at, row_id
from vibsim.experiment.value_names import VALUES, Value
from vibsim.experiment.yaml.parse import Path_
from vibsim.models import BUDGET, centred, has_budget, has_solution
from vibsim.models.base import Model, error_parts, has_error_parts
from vibsim.models.events import Crossings
from vibsim.models.shared.free import why_not_free
from vibsim.models.structure import MOST_MODES

ENERGIES = ("energy", "energy_deviation")
"""The energies that are known exactly where they are conserved."""


def check_published(
    tables: Sequence[Any], taken: Iterable[str], setting: Setting, report: Report
) -> None:
    """Note every fault of printed tables (None stands for a malformed one, or row); `taken`: the ids of the checks."""
    own = {
        row_id(i, j)
        for i, table in enumerate(tables, 1)
        for j in range(1, 1 + len(table.rows if table else ()))
    }
    for i, id_ in enumerate(taken):
        if id_ in own:
            report.add(("checks", i, "id"), "is the id of a row of published", value=id_)
    for i, table in enumerate(tables):
        if table is not None:
            _published_table(table, Scope(("published", i), setting, report))


def _published_table(table: Any, scope: Scope) -> None:
    rows = [(row, scope.at("rows", j)) for j, row in enumerate(table.rows) if row is not None]
    row = None if table.value is None else _known_value(table.value, scope.at("value"))
    if row is not None and not scope.at("quantity").is_faulty:
        best = any(printed.level == "best" for printed, _ in rows)
        _check_value(row, table.quantity, best, scope)
    for j, name in enumerate(table.beside):
        place = scope.at("beside", j)
        other = _known_value(name, place)
        if name in table.beside[:j]:
            place.refuse("a value must not be repeated", value=name)
        if other is not None:
            # it is of the quantity of the table where it is of one
            choices = _allowed(other, scope.setting)
            if choices and table.quantity not in choices:
                rule = f"{name} is not known of the quantity of this table"
                place.refuse(rule, "it is of " + ", ".join(choices), name)
            _is_comparable(other, table.quantity, place)
    for printed, place in rows:
        if row is not None:
            place.check_place(row_at(printed), row)
        else:
            place.check_scheme_and_case(row_at(printed))
        if table.quantity is not None:
            _has_quantity(table.quantity, [(printed.scheme, place.at("scheme"))])


def finish_checks(checks: Sequence[Any], setting: Setting, report: Report) -> tuple[Any, ...]:
    """Note every fault of the checks (None stands for a malformed one); give an id to those without."""
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
    """Return the id of every check; a generated one is its place in the file."""
    ids = [check.id if check is not None else "" for check in checks]
    given: dict[str, int] = {}
    for i, id_ in enumerate(ids):
        if id_ and given.setdefault(id_, i) != i:
            report.add(("checks", i, "id"), "two checks have one id", value=id_)
        if id_ == BY_TOLERANCE and by_tolerance:
            rule = "is the id of the verdict on the tolerance itself"
            report.add(("checks", i, "id"), rule, value=id_)
    for i, id_ in enumerate(ids):
        free = (f"check_{number}" for number in count(i + 1, len(ids)))
        ids[i] = id_ or next(name for name in free if name not in given)
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
    if not isinstance(inner, ValueCheck | EqualCheck):
        scope.at("schemes").check_schemes(inner.schemes)
    match inner:
        case ConvergesCheck():
            _converges(inner, scope)
        case AccurateCheck():
            _accurate(inner, scope)
        case ValueCheck():
            _value(inner, scope)
        case ConservesCheck():
            _quantity_of_schemes(inner.conserves, "conserves", inner.schemes, scope)
            model = scope.setting.model
            if model is not None and not model.conservative:
                scope.refuse(
                    f"the energy of {model.kind} is not conserved", _instead_of_energy(scope)
                )
        case EqualCheck():
            _equal(inner, scope)


def _instead_of_energy(scope: Scope) -> str:
    """Say what to write where an energy is not conserved, or is not known to be."""
    budget = "the budget of energy and work is: `converges: energy_budget`"
    has_budget = "energy_budget" in scope.setting.quantities
    model = scope.setting.model
    if has_budget and model is not None and model.events is not None:
        return f"its events may change it; {budget}"
    if model is not None and model.misses_potential:
        return "write its `potential`, if the forces have one that vibsim does not find"
    if any(note.key == "model.potential" for note in scope.report.notes):
        return "by the `potential` that is written: leave it out, and vibsim finds it where it can"
    return budget if has_budget else ""


def _quantity_of_schemes(name: str, key: str, schemes: Sequence[str] | None, scope: Scope) -> None:
    """Check that the quantity under a key of a check exists, and that the schemes which the check names have it."""
    if _is_quantity(name, scope.setting.quantities, scope.at(key)):
        _has_quantity(name, ((s, scope.at("schemes", i)) for i, s in enumerate(schemes or ())))


def _converges(check: ConvergesCheck, scope: Scope) -> None:
    check_expect(check.expect, (*scope.path, "expect"), scope.report)
    name, model = check.converges, scope.setting.model
    _convergent(name, "converges", check.schemes, scope)
    if not is_error_part(name) or model is None or name not in error_parts(model):
        return
    if check.order == "scheme" and (reason := why_not_free(model)):
        rule = (
            f"theory knows the order of {name} on linear models without forces in time only, and "
            f"{model.kind} {reason}"
        )
        place = scope.at("order" if "order" in check.model_fields_set else "converges")
        place.refuse(rule, "give `order:` as a number")


def _accurate(check: AccurateCheck, scope: Scope) -> None:
    check_expect(check.expect, (*scope.path, "expect"), scope.report)
    _convergent(check.accurate, "accurate", check.schemes, scope)
    given = given_one(check, ("relative", "absolute"), scope.path, scope.report)
    if given == "relative" and is_error_part(check.accurate):
        rule = f"is a part of the solution, and {check.accurate} is an error itself"
        scope.at("relative").refuse(rule, "give `absolute:`", at_key=True)


def _convergent(name: str, key: str, schemes: Sequence[str] | None, scope: Scope) -> None:
    """Check that the quantity under a key is one that levels can be compared by."""
    model = scope.setting.model
    if not is_error_part(name):
        _quantity_of_schemes(name, key, schemes, scope)
    elif model is not None and name not in error_parts(model):
        rule, hint = "unknown quantity", nearest(name, error_parts(model))
        if not has_error_parts(model):
            what = "events" if model.events is not None else "a force with corners"
            rule = f"does not exist: {model.kind} has {what}, and only a smooth motion has a phase and an amplitude"
            hint = f"ask for {model.position}"
        scope.at(key).refuse(rule, hint, name)


def check_expect(expect: Expect, path: Path_, report: Report) -> None:
    """Check that the reason of an expected verdict, which stands at `path`, exists and has its status."""
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
    """Return which of some keys a section at `path` has, of which it must have exactly one; None where one is faulty.

    Of several the first is returned.
    """
    if any((*path, key) in report.faulty for key in keys):
        return None
    given = [key for key in keys if getattr(section, key) is not None]
    if len(given) != 1:
        found = " and ".join(given) or "none of them"
        report.add(path, f"must have exactly one of {', '.join(keys)}; has {found}")
    return given[0] if given else ""


def _value(check: ValueCheck, scope: Scope) -> None:
    given = given_one(check, ("equals", "below", "above"), scope.path, scope.report)
    if given is not None:
        for name in ("rtol", "atol"):
            if getattr(check, name) is not None and given != "equals":
                scope.at(name).refuse("is used with equals only", at_key=True)
    place = scope.at("at")
    _reduction(check, scope)
    row = _known_value(check.value, scope.at("value"))
    if row is None:
        place.check_scheme_and_case(check.at)
        return
    _check_value(row, check.quantity, check.at.level == "best", scope)
    if check.quantity is not None and check.at.scheme is not None:
        _has_quantity(check.quantity, [(check.at.scheme, place.at("scheme"))])
    place.check_place(check.at, row)


def _reduction(check: ValueCheck, scope: Scope) -> None:
    """Check that a number of all members is taken over one swept key, with every other one fixed."""
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
    if check.over not in keys:
        hint = nearest(check.over, keys) if keys else "there is no sweep of numbers"
        scope.at("over").refuse("is no swept key with numbers", hint, check.over)
        return
    if check.at.case is not None or check.over in check.at.swept:
        scope.at("over").refuse("is fixed by `at:`", "leave one of them out", check.over)
        return
    for axis in axes:
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


def _equal(check: EqualCheck, scope: Scope) -> None:
    if scope.at("equal").is_faulty:
        return
    first, second = scope.at("equal", 0), scope.at("equal", 1)
    if check.first in SOLUTIONS:
        first.refuse("must be a scheme: what it equals stands behind it", value=check.first)
    else:
        first.check_scheme(check.first)
    named = [(check.first, first)]
    if check.second not in SOLUTIONS:
        second.check_scheme(check.second, SOLUTIONS)
        named.append((check.second, second))
        if check.first == check.second:
            second.refuse("must be another one than the first", value=check.second)
    setting, what, choices = scope.setting, "", scope.setting.quantities
    if check.second in SOLUTIONS and setting.model is not None:
        what, choices = check.second, tuple(state.name for state in setting.model.states)
        if check.second == "exact":
            choices += ENERGIES
            if plain_name(check.quantity) in choices and setting.own_velocity:
                choices += (check.quantity,)
    if _is_quantity(check.quantity, choices, scope.at("quantity"), what):
        _has_quantity(check.quantity, named)
        if check.second == "exact" and setting.sweep.follow:
            _known_of_followers(check.second, second)
        elif check.second == "exact":
            _known_exactly(check.quantity, check.second, second)
        elif check.second == "discrete":
            _known_by_theory(check.second, second)
    if check.second == "discrete" and check.first in setting.adaptive:
        first.refuse("has no steps of its own that theory could know", value=check.first)


def _is_quantity(name: str, choices: tuple[str, ...], scope: Scope, what: str = "") -> bool:
    """Check that a quantity is one of `choices`, those of `what`; say so where it exists, but not there."""
    model = scope.setting.model
    if not choices or name in choices:
        return True
    if model is not None and name in centred(model) and not scope.setting.own_velocity:
        rule = "exists only where a scheme has another velocity than the centred difference"
        if model.events is not None:
            rule = "does not exist: across an event the centred difference is no velocity"
        scope.refuse(rule, f"ask for {plain_name(name)}", name)
        return False
    known = name in scope.setting.quantities
    rule = f"{what} is not known of this quantity" if known else "unknown quantity"
    hint = "choose from " + ", ".join(choices) if known else nearest(name, choices)
    scope.refuse(rule, hint, name)
    return False


def _has_quantity(name: str, schemes: Iterable[tuple[str, Scope]]) -> None:
    for scheme, scope in schemes:
        setting = scope.setting
        if setting.model is None or name not in centred(setting.model) or not setting.own_velocity:
            return
        if scheme in setting.names and scheme not in setting.own:
            hint = f"choose from {', '.join(setting.own)}" if setting.own else ""
            scope.refuse(f"has no {name} beside its {plain_name(name)}", hint, scheme)


def _known_value(name: str, scope: Scope) -> Value | None:
    row = VALUES.get(name)
    if row is None:
        scope.refuse("unknown value", nearest(name, list(VALUES)), name)
    return row


def _check_value(row: Value, quantity: str | None, best: bool, scope: Scope) -> None:
    """Check of which quantity a value (`best`: of the extrapolated solution) is, and what it is compared with.

    The scope is that of the mapping with the keys ``value`` and ``quantity``.
    """
    place = scope.at("quantity")
    choices = _allowed(row, scope.setting, best)
    if row.of == "none":
        if quantity is not None:
            rule = f"{row.name} is of the motion as a whole and takes no quantity"
            place.refuse(rule, at_key=True)
    elif quantity is None:
        rule = f"required key is missing: {row.name} is of a quantity"
        place.refuse(rule, "choose from " + ", ".join(choices))
    else:
        only_there = best and quantity in _allowed(row, scope.setting, False)
        what = f"{row.name} at `level: best`" if only_there else row.name
        _is_quantity(quantity, choices, place, what)
    _is_comparable(row, quantity, scope.at("value"))


def _is_comparable(row: Value, quantity: str | None, scope: Scope) -> None:
    model = scope.setting.model
    if model is None:
        return
    if row.needs_exact and scope.setting.sweep.follow:
        _known_of_followers(row.name, scope)
        return
    if row.needs_exact == "period" and model.exact_period is None:
        scope.refuse(f"the exact period of {model.kind} is not known", value=row.name)
    if row.needs_exact == "solution":
        _known_exactly(quantity, row.name, scope)
    if row.needs_potential and model.misses_potential:
        scope.refuse(NOT_FOUND, _instead_of_energy(scope), row.name)
    if row.needs_events and model.events is None:
        scope.refuse(f"{model.kind} has no events: its motion is smooth", value=row.name)
    if row.needs_rational:
        from vibsim.theory.degrees import applies

        if not applies(model):
            rule = (
                "is known of one coordinate without events, with an acceleration of + - * /, whole powers and abs; "
                f"that of {model.kind} here is another one"
            )
            scope.refuse(rule, value=row.name)
    if row.needs_linear:
        _known_by_theory(row.name, scope)


def _known_exactly(quantity: str | None, value: str, scope: Scope) -> None:
    """Check that the model knows the exact solution of a quantity, with which `value` is compared."""
    model = scope.setting.model
    if model is None:
        return
    # the energy is known where it is conserved or the motion is known; the budget is 0 always
    name = plain_name(quantity or "")
    taken, done, budget = BUDGET
    is_solved = has_solution(model) and name not in (taken, done)
    if not (is_solved or name == budget or (model.conservative and name in ENERGIES)):
        of = (*(ENERGIES if model.conservative else ()), *((budget,) if has_budget(model) else ()))
        hint = f"{' and '.join(of)} {'is' if len(of) == 1 else 'are'}" if of else ""
        rule = f"the exact {quantity or 'solution'} of {model.kind} is not known"
        scope.refuse(f"{rule}{_why_unsolved(model)}", hint, value)


def _why_unsolved(model: Model) -> str:
    """Say why there is neither an exact solution nor a reference, where one cause is sure."""
    if has_solution(model):
        return ""
    if isinstance(model.events, Crossings):
        return ", as of every motion with events of formulas or a stop"
    if model.loaded is None:
        return ""
    if not model.loaded.structure.has_all_modes:
        return f", as of every structure of more than {MOST_MODES} degrees of freedom"
    return (
        ": it is where damping does not couple the modes, and loads are sums of constants, sines and "
        "cosines"
    )


def _known_of_followers(value: str, scope: Scope) -> None:
    rule = "the exact solution is not known of members that start from the last state of others"
    scope.refuse(rule, "leave out `follow`", value)


def _known_by_theory(value: str, scope: Scope) -> None:
    """Check that the theory of schemes, which is that of linear models without damping, knows the model."""
    model = scope.setting.model
    if model is not None and not (model.linear and model.conservative):
        rule = f"{value} is known of linear models without damping only, not of {model.kind}"
        scope.refuse(rule, value=value)


def _allowed(row: Value, setting: Setting, best: bool = False) -> tuple[str, ...]:
    """Name the quantities that `row` can be of; `best`: of the extrapolated solution."""
    model = setting.model
    if model is None or row.of == "none":
        return ()
    states = tuple(state.name for state in model.states)
    more = centred(model) if setting.own_velocity else ()
    deviations = ("energy_deviation", *more[-1:])
    choices = {
        "states": states,
        "stored": (*states, *(output.name for output in model.outputs)),
        "deviation": deviations[:1],
        "running": deviations,
        "extremal": (*states, *deviations),
    }
    if row.of in choices:
        return choices[row.of]
    if best:
        return (*states, *ENERGIES, *more)
    return (*setting.quantities, *(error_parts(model) if row.of == "convergent" else ()))
