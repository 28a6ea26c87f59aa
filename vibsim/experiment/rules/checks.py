"""What checks and printed tables must be besides well-formed: they name what the experiment has."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from vibsim.core.errors import nearest
from vibsim.core.vocabulary import BY_TOLERANCE, REASONS
from vibsim.experiment.faults import Report
from vibsim.experiment.rules.check_places import (
    Ladder,
    Scope,
    check_case,
    check_level,
    check_place,
    check_scheme_and_case,
    known_scheme,
    known_schemes,
)
from vibsim.experiment.rules.quantities import (
    ENERGIES,
    allowed,
    check_value,
    has_formal_order,
    has_quantity,
    is_comparable,
    known_by_theory,
    known_error_part,
    known_exactly,
    known_quantity,
    known_value,
    one_of,
    plain,
)
from vibsim.experiment.schema.checks import (
    SOLUTIONS,
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
from vibsim.models.shared.phase_amplitude_names import is_error_part


def check_published(
    tables: Iterable[Any], taken: Iterable[str], ladder: Ladder, report: Report
) -> None:
    """Note every fault of printed tables (None stands for a malformed one, or row).

    Parameters
    ----------
    taken
        The ids of the checks, in their order in the file.
    """
    listed = list(tables)
    own = {
        row_id(i, j)
        for i, table in enumerate(listed, 1)
        for j in range(1, 1 + len(table.rows if table else ()))
    }
    for i, id_ in enumerate(taken):
        if id_ in own:
            report.add(("checks", i, "id"), "is the id of a row of published", value=id_)
    for i, table in enumerate(listed):
        if table is not None:
            _published_table(table, Scope(("published", i), ladder, report))


def _published_table(table: Any, scope: Scope) -> None:
    rows = [(row, scope.at("rows", j)) for j, row in enumerate(table.rows) if row is not None]
    row = None if table.value is None else known_value(table.value, scope.at("value"))
    if row is not None and not scope.at("quantity").is_faulty:
        best = any(printed.level == "best" for printed, _ in rows)
        check_value(row, table.quantity, best, scope)
    for j, name in enumerate(table.beside):
        _beside(name, table, table.beside[:j], scope.at("beside", j))
    for printed, place in rows:
        if row is not None:
            check_place(row_at(printed), row, place)
        else:
            check_scheme_and_case(row_at(printed), place)
        if table.quantity is not None:
            has_quantity(table.quantity, [(printed.scheme, place.at("scheme"))])


def _beside(name: str, table: Any, before: tuple[str, ...], scope: Scope) -> None:
    """Check a further value, which is of the quantity of the table where it is of one."""
    row = known_value(name, scope)
    if name in before:
        scope.refuse("a value must not be repeated", value=name)
    if row is None:
        return
    choices = allowed(row, scope.ladder)
    if choices and table.quantity not in choices:
        rule = f"{row.name} is not known of the quantity of this table"
        scope.refuse(rule, "it is of " + ", ".join(choices), row.name)
    is_comparable(row, table.quantity, scope)


def finish_checks(checks: Iterable[Any], ladder: Ladder, report: Report) -> tuple[Any, ...]:
    """Note every fault of the checks (None stands for a malformed one); give an id to those without."""
    listed = list(checks)
    ids = _ids(listed, report)
    if ladder.by_tolerance:
        _check_own(listed, report)
    finished = []
    for i, check in enumerate(listed):
        if check is None:
            continue
        _check(check, Scope(("checks", i), ladder, report))
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


def _check_own(checks: list[Any], report: Report) -> None:
    """Refuse the name of the verdict that every experiment with a tolerance has."""
    for i, check in enumerate(checks):
        if check is not None and check.id == BY_TOLERANCE:
            rule = "is the id of the verdict on the tolerance itself"
            report.add(("checks", i, "id"), rule, value=check.id)


def _check(check: Check, scope: Scope) -> None:
    if isinstance(check, ClaimCheck):
        scope = scope.at("that")
        if check.that.id:
            scope.at("id").refuse("the id belongs to the claim", at_key=True)
    match check.measured:
        case ConvergesCheck() as inner:
            _converges(inner, scope)
        case ValueCheck() as inner:
            _value(inner, scope)
        case StableCheck() as inner:
            known_schemes(inner.schemes, scope.at("schemes"))
            _level_and_case(inner, scope)
        case ConservesCheck() as inner:
            _conserves(inner, scope)
        case EqualCheck() as inner:
            _equal(inner, scope)


def _level_and_case(check: StableCheck | ConservesCheck | EqualCheck, scope: Scope) -> None:
    check_level(check.level, scope.at("level"))
    check_case(check.case, scope.at("case"))


def _quantity_of_schemes(name: str, key: str, schemes: Sequence[str] | None, scope: Scope) -> None:
    """Check that the quantity under a key of a check exists, and that the schemes which the check names have it."""
    if known_quantity(name, scope.at(key)):
        places = ((scheme, scope.at("schemes", i)) for i, scheme in enumerate(schemes or ()))
        has_quantity(name, places)


def _converges(check: ConvergesCheck, scope: Scope) -> None:
    known_schemes(check.schemes, scope.at("schemes"))
    if is_error_part(check.converges):
        known_error_part(check.converges, scope.at("converges"))
        has_formal_order(check, scope)
    else:
        _quantity_of_schemes(check.converges, "converges", check.schemes, scope)
    _expect(check.expect, scope.at("expect"))


def _expect(expect: Expect, scope: Scope) -> None:
    reason = expect.reason
    if reason is None:
        return
    if reason not in REASONS:
        hint = nearest(reason, list(REASONS))
        scope.at("reason").refuse("unknown reason", hint, reason)
    elif REASONS[reason] != expect.status and not scope.at("status").is_faulty:
        rule = f"reason of status {REASONS[reason]}, but the status is {expect.status}"
        choices = [name for name, status in REASONS.items() if status == expect.status]
        scope.at("reason").refuse(rule, "choose from " + ", ".join(choices), reason)


def _value(check: ValueCheck, scope: Scope) -> None:
    _comparison(check, scope)
    place = scope.at("at")
    row = known_value(check.value, scope.at("value"))
    if row is None:
        check_scheme_and_case(check.at, place)
        return
    check_value(row, check.quantity, check.at.level == "best", scope)
    if check.quantity is not None and check.at.scheme is not None:
        has_quantity(check.quantity, [(check.at.scheme, place.at("scheme"))])
    check_place(check.at, row, place)


def _comparison(check: ValueCheck, scope: Scope) -> None:
    names = ("equals", "below", "above")
    if any(scope.at(name).is_faulty for name in names):
        return
    given = [name for name in names if getattr(check, name) is not None]
    if len(given) != 1:
        found = " and ".join(given) or "none of them"
        scope.refuse(f"must have exactly one of equals, below, above; has {found}")
    for name in ("rtol", "atol"):
        if getattr(check, name) is not None and "equals" not in given:
            scope.at(name).refuse("is used with equals only", at_key=True)


def _conserves(check: ConservesCheck, scope: Scope) -> None:
    known_schemes(check.schemes, scope.at("schemes"))
    _quantity_of_schemes(check.conserves, "conserves", check.schemes, scope)
    model = scope.ladder.model
    if model is not None and not model.conservative:
        scope.refuse(f"the energy of {model.kind} is not conserved")
    _level_and_case(check, scope)


def _equal(check: EqualCheck, scope: Scope) -> None:
    _level_and_case(check, scope)
    if scope.at("equal").is_faulty:
        return
    first, second = scope.at("equal", 0), scope.at("equal", 1)
    if check.first in SOLUTIONS:
        first.refuse("must be a scheme: what it equals stands behind it", value=check.first)
    else:
        known_scheme(check.first, first)
    named = [(check.first, first)]
    if check.second not in SOLUTIONS:
        known_scheme(check.second, second, SOLUTIONS)
        named.append((check.second, second))
        if check.first == check.second:
            second.refuse("must be another one than the first", value=check.second)
    if _compared_quantity(check, scope.at("quantity")):
        has_quantity(check.quantity, named)
        if check.second == "exact":
            known_exactly(check.quantity, check.second, second)
        elif check.second == "discrete":
            known_by_theory(check.second, second)
    if check.second == "discrete" and check.first in scope.ladder.adaptive:
        first.refuse("has no steps of its own that theory could know", value=check.first)


def _compared_quantity(check: EqualCheck, scope: Scope) -> bool:
    """Check that a quantity exists, of the schemes or of the solution that a scheme is compared with."""
    model = scope.ladder.model
    if check.second not in SOLUTIONS or model is None:
        return known_quantity(check.quantity, scope)
    choices = tuple(state.name for state in model.states)
    if check.second == "exact":
        choices += ENERGIES
        if plain(check.quantity) in choices and scope.ladder.own_velocity:
            choices += (check.quantity,)
    return one_of(check.quantity, choices, scope, check.second)
