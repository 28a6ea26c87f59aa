"""Rules for checks and printed tables: they refer to quantities that the model and the schemes have."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import count
from typing import Any

from vibsim.core.errors import nearest
from vibsim.core.vocabulary import BY_TOLERANCE, REASONS, VECTORS, is_error_part, plain_name
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
from vibsim.experiment.value_names import CASES, OF_THE_SAME_KIND, VALUES, Value
from vibsim.experiment.yaml.parse import Path_
from vibsim.models import BUDGET, centred, has_budget, has_solution
from vibsim.models.base import Model, components, error_parts, has_error_parts
from vibsim.models.shared.free import why_not_free
from vibsim.models.structure import MOST_MODES

ENERGIES = ("energy", "energy_deviation")
"""The energies that are known exactly if energy is conserved."""


def check_published(
    tables: Sequence[Any], ids: Iterable[str], setting: Setting, report: Report
) -> None:
    """Report every fault of printed tables (None: a malformed table or row); `ids` holds the ids of the checks."""
    row_ids = {
        row_id(i, j)
        for i, table in enumerate(tables, 1)
        for j in range(1, 1 + len(table.rows if table else ()))
    }
    for i, id_ in enumerate(ids):
        if id_ in row_ids:
            report.add(("checks", i, "id"), "is the id of a row of published", value=id_)
    for i, table in enumerate(tables):
        if table is not None:
            _check_table(table, Scope(("published", i), setting, report))


def _check_table(table: Any, scope: Scope) -> None:
    rows = [(row, scope.at("rows", j)) for j, row in enumerate(table.rows) if row is not None]
    row = None if table.value is None else _value_named(table.value, scope.at("value"))
    if row is not None and not scope.at("quantity").is_faulty:
        best = any(printed.level == "best" for printed, _ in rows)
        _check_value(row, table.quantity, best, scope)
    for j, name in enumerate(table.beside):
        place = scope.at("beside", j)
        other = _value_named(name, place)
        if name in table.beside[:j]:
            place.refuse("a value must not be repeated", value=name)
        if other is not None:
            # a value that needs a quantity has that of the table
            choices = _allowed(other, scope.setting)
            if choices and table.quantity not in choices:
                rule = f"{name} is not defined for the quantity of this table"
                place.refuse(rule, "it is defined for " + ", ".join(choices), name)
            _check_support(other, table.quantity, place)
    for printed, place in rows:
        if row is not None:
            place.check_place(row_at(printed), row)
        else:
            place.check_scheme_and_case(row_at(printed))
        if table.quantity is not None:
            _must_have(table.quantity, [(printed.scheme, place.at("scheme"))])


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
                    f"the energy of {model.kind} is not conserved", _instead_of_energy(scope)
                )
        case EqualCheck():
            _check_equal(inner, scope)


def _instead_of_energy(scope: Scope) -> str:
    """Return a hint for models whose energy is not conserved, or not known to be."""
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


def _check_quantity(
    name: str, key: str, schemes: Sequence[str] | None, scope: Scope, more: tuple[str, ...] = ()
) -> None:
    """Check that the quantity under a key of a check exists, and that the schemes named by the check have it.

    It may also be one of `more`.
    """
    if _is_quantity(name, (*scope.setting.quantities, *more), scope.at(key)):
        _must_have(name, ((s, scope.at("schemes", i)) for i, s in enumerate(schemes or ())))


def _check_converges(check: ConvergesCheck, scope: Scope) -> None:
    check_expect(check.expect, (*scope.path, "expect"), scope.report)
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
    check_expect(check.expect, (*scope.path, "expect"), scope.report)
    _check_convergent(check.accurate, "accurate", check.schemes, scope)
    key = given_one(check, ("relative", "absolute"), scope.path, scope.report)
    if key == "relative" and is_error_part(check.accurate):
        rule = f"is a part of the solution, and {check.accurate} is an error itself"
        scope.at("relative").refuse(rule, "give `absolute:`", at_key=True)


def _check_convergent(name: str, key: str, schemes: Sequence[str] | None, scope: Scope) -> None:
    """Check that levels can be compared by the quantity under a key."""
    model = scope.setting.model
    if not is_error_part(name):
        _check_quantity(name, key, schemes, scope, _vectors(model))
    elif model is not None and name not in error_parts(model):
        rule, hint = "unknown quantity", nearest(name, error_parts(model))
        if not has_error_parts(model):
            what = "events" if model.events is not None else "a force with corners"
            rule = f"does not exist: {model.kind} has {what}, and only a smooth motion has a phase and an amplitude"
            hint = f"ask for {model.position}"
        scope.at(key).refuse(rule, hint, name)


def _vectors(model: Model | None) -> tuple[str, ...]:
    """Return the vectors of all coordinates; none for a single one."""
    return VECTORS if model is not None and model.coordinates > 1 else ()


def _is_vector(name: str, model: Model, place: Scope) -> bool:
    """Tell whether a model has several coordinates to take together, in one unit; report a fault otherwise."""
    states = [state for state in model.states if state.name in components(model, name)]
    if len(states) == 1:
        rule = f"takes several coordinates together, and {model.kind} has one here"
        place.refuse(rule, f"ask for {states[0].name}", name)
        return False
    if len({state.unit for state in states}) > 1:
        listed = ", ".join(f"{state.name} [{state.unit}]" for state in states)
        rule = f"is a sum over coordinates of one unit, and these have several: {listed}"
        place.refuse(rule, "give each coordinate a check of its own", name)
        return False
    return True


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
    row = _value_named(check.value, scope.at("value"))
    if row is None:
        place.check_scheme_and_case(check.at)
        return
    _check_value(row, check.quantity, check.at.level == "best", scope)
    if check.quantity is not None and check.at.scheme is not None:
        _must_have(check.quantity, [(check.at.scheme, place.at("scheme"))])
    place.check_place(check.at, row)


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
            choices += ENERGIES
            if plain_name(check.quantity) in choices and setting.own_velocity:
                choices += (check.quantity,)
    if _is_quantity(check.quantity, choices, scope.at("quantity"), what):
        _must_have(check.quantity, named)
        if check.second == "exact" and setting.sweep.follow:
            _refuse_followers(check.second, second)
        elif check.second == "exact":
            _check_exact(check.quantity, check.second, second)
        elif check.second == "discrete":
            _check_theory(check.second, second)
    if check.second == "discrete" and check.first in setting.adaptive:
        first.refuse("chooses its own steps, for which theory knows no solution", value=check.first)


def _is_quantity(
    name: str, choices: tuple[str, ...], scope: Scope, what: str = "", *, is_at_best: bool = False
) -> bool:
    """Tell whether a quantity is one of `choices`, those of `what`; report a fault otherwise.

    With `is_at_best` the value exists at single levels, but not in their limit.
    """
    model = scope.setting.model
    if name in VECTORS and model is not None and not _is_vector(name, model, scope):
        return False
    if not choices or name in choices:
        return True
    if model is not None and name in centred(model) and not scope.setting.own_velocity:
        rule = "exists only where a scheme has another velocity than the centred difference"
        if model.events is not None:
            rule = "does not exist: across an event the centred difference is no velocity"
        scope.refuse(rule, f"ask for {plain_name(name)}", name)
        return False
    known = name in (*scope.setting.quantities, *VECTORS)
    where = " at `level: best`" if is_at_best else ""
    rule = f"{what}{where} is not defined for this quantity" if known else "unknown quantity"
    hints = ["choose from " + ", ".join(choices) if known else nearest(name, choices)]
    if is_at_best and scope.setting.levels:
        hints.append(f"or take one level: `at: {{level: {max(scope.setting.levels)}}}`")
    scope.refuse(rule, ", ".join(filter(None, hints)), name)
    return False


def _must_have(name: str, schemes: Iterable[tuple[str, Scope]]) -> None:
    for scheme, scope in schemes:
        setting = scope.setting
        if setting.model is None or name not in centred(setting.model) or not setting.own_velocity:
            return
        able = setting.with_own_velocity
        if scheme in setting.names and scheme not in able:
            hint = f"choose from {', '.join(able)}" if able else ""
            scope.refuse(f"has no {name} beside its {plain_name(name)}", hint, scheme)


def _value_named(name: str, scope: Scope) -> Value | None:
    row = VALUES.get(name)
    if row is None:
        is_quantity = name in scope.setting.quantities
        hint = (
            f"for its value at the end write `value: end, quantity: {name}`" if is_quantity else ""
        )
        scope.refuse("unknown value", hint or nearest(name, list(VALUES)), name)
    return row


def _check_value(row: Value, quantity: str | None, best: bool, scope: Scope) -> None:
    """Check the quantity of a value (`best`: of the extrapolated solution), and that the model supports the value.

    The scope is that of the mapping with the keys ``value`` and ``quantity``.
    """
    place = scope.at("quantity")
    choices = _allowed(row, scope.setting, best)
    if row.of == "none":
        if quantity is not None:
            rule = f"{row.name} belongs to the motion as a whole and takes no quantity"
            place.refuse(rule, at_key=True)
    elif quantity is None:
        rule = f"required key is missing: {row.name} needs a quantity"
        place.refuse(rule, "choose from " + ", ".join(choices))
    else:
        only_there = best and quantity in _allowed(row, scope.setting, False)
        _is_quantity(quantity, choices, place, row.name, is_at_best=only_there)
    _check_support(row, quantity, scope.at("value"))


def _check_support(row: Value, quantity: str | None, scope: Scope) -> None:
    model = scope.setting.model
    if model is None:
        return
    if row.needs_exact and scope.setting.sweep.follow:
        _refuse_followers(row.name, scope)
        return
    if row.needs_exact == "period" and model.exact_period is None:
        scope.refuse(f"the exact period of {model.kind} is not known", value=row.name)
    if row.needs_exact == "solution":
        _check_exact(quantity, row.name, scope)
    if row.needs_potential and model.misses_potential:
        scope.refuse(NOT_FOUND, _instead_of_energy(scope), row.name)
    if row.needs_events and model.events is None:
        scope.refuse(f"{model.kind} has no events: its motion is smooth", value=row.name)
    if row.needs_rational:
        from vibsim.theory.degrees import applies

        if not applies(model):
            rule = (
                "is known for one coordinate without events whose acceleration has only + - * /, whole powers and abs; "
                f"that of {model.kind} here has others"
            )
            scope.refuse(rule, value=row.name)
    if row.needs_linear:
        _check_theory(row.name, scope)


def _check_exact(quantity: str | None, value: str, scope: Scope) -> None:
    """Check that the model has the exact solution of a quantity, which `value` is compared with."""
    model = scope.setting.model
    if model is None:
        return
    # energy is exact if it is conserved or the motion is; the budget is always 0
    name = plain_name(quantity or "")
    dissipated, work, budget = BUDGET
    is_solved = has_solution(model) and name not in (dissipated, work)
    if not (is_solved or name == budget or (model.conservative and name in ENERGIES)):
        exact: tuple[str, ...] = ENERGIES if model.conservative else ()
        exact += (budget,) if has_budget(model) else ()
        hint = f"{' and '.join(exact)} {'is' if len(exact) == 1 else 'are'}" if exact else ""
        rule = f"the exact {quantity or 'solution'} of {model.kind} is not known"
        scope.refuse(f"{rule}{_why_unsolved(model)}", hint, value)


def _why_unsolved(model: Model) -> str:
    """Return why there is neither an exact solution nor a reference; empty if the cause is uncertain."""
    if has_solution(model):
        return ""
    if model.events and model.events.rows:
        return ", as for every motion with events of formulas or a stop"
    if model.loaded is None:
        return ""
    if not model.loaded.structure.has_all_modes:
        return f", as for every structure of more than {MOST_MODES} degrees of freedom"
    return (
        ": it is where damping does not couple the modes, and loads are sums of constants, sines and "
        "cosines"
    )


def _refuse_followers(value: str, scope: Scope) -> None:
    rule = "the exact solution is not known for members that start from the last state of others"
    scope.refuse(rule, "leave out `follow`", value)


def _check_theory(value: str, scope: Scope) -> None:
    """Check that the model is linear and undamped, as the theory of schemes requires."""
    model = scope.setting.model
    if model is not None and not (model.linear and model.conservative):
        rule = f"{value} is known only for linear models without damping, not for {model.kind}"
        scope.refuse(rule, value=value)


def _allowed(row: Value, setting: Setting, best: bool = False) -> tuple[str, ...]:
    """Return the quantities that the value `row` is defined for; `best`: for the extrapolated solution."""
    model = setting.model
    if model is None or row.of == "none":
        return ()
    states = tuple(state.name for state in model.states)
    centred_names = centred(model) if setting.own_velocity else ()
    deviations = ("energy_deviation", *centred_names[-1:])
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
        return (*states, *ENERGIES, *centred_names)
    compared = (*error_parts(model), *_vectors(model))
    return (*setting.quantities, *(compared if row.of == "convergent" else ()))
