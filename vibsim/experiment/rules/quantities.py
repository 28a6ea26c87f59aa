"""Which quantities and values checks and printed tables may be about: those that the model and the schemes have."""

from __future__ import annotations

from collections.abc import Iterable

from vibsim.core.errors import nearest
from vibsim.experiment.rules.check_places import Ladder, Scope
from vibsim.experiment.schema.checks import ConvergesCheck
from vibsim.experiment.value_names import VALUES, Value
from vibsim.models import BUDGET, centred, has_budget, has_solution, quantities
from vibsim.models.shared.free import why_not_free
from vibsim.models.shared.phase_amplitude_names import error_parts, has_error_parts

ENERGIES = ("energy", "energy_deviation")
"""The energies that are known exactly where they are conserved."""


def known_quantity(name: str, scope: Scope) -> bool:
    """Check that a quantity of the experiment is named."""
    return one_of(name, all_quantities(scope.ladder), scope)


def all_quantities(ladder: Ladder) -> tuple[str, ...]:
    """Name every quantity that is kept over time."""
    return () if ladder.model is None else quantities(ladder.model, ladder.own_velocity)


def one_of(name: str, choices: tuple[str, ...], scope: Scope, what: str = "") -> bool:
    """Check that a quantity is one of `choices`, those of `what`; say so where it exists, but not there."""
    model, own_velocity = scope.ladder.model, scope.ladder.own_velocity
    if not choices or name in choices:
        return True
    if model is not None and name in centred(model) and not own_velocity:
        rule = "exists only where a scheme has another velocity than the centred difference"
        if model.events is not None:
            rule = "does not exist: across an event the centred difference is no velocity"
        scope.refuse(rule, f"ask for {plain(name)}", name)
        return False
    known = name in all_quantities(scope.ladder)
    rule = f"{what} is not known of this quantity" if known else "unknown quantity"
    hint = "choose from " + ", ".join(choices) if known else nearest(name, choices)
    scope.refuse(rule, hint, name)
    return False


def plain(name: str) -> str:
    """Return the quantity of which `name` is the one by the centred difference."""
    return name.removesuffix("_d2t")


def has_quantity(name: str, schemes: Iterable[tuple[str, Scope]]) -> None:
    """Check that schemes, each named in a scope, have a quantity."""
    for scheme, scope in schemes:
        ladder = scope.ladder
        if ladder.model is None or name not in centred(ladder.model) or not ladder.own_velocity:
            return
        if scheme in ladder.schemes and scheme not in ladder.own:
            hint = f"choose from {', '.join(ladder.own)}" if ladder.own else ""
            scope.refuse(f"has no {name} beside its {plain(name)}", hint, scheme)


def known_exactly(quantity: str | None, value: str, scope: Scope) -> None:
    """Check that the model knows the exact solution of a quantity, with which `value` is compared."""
    model = scope.ladder.model
    if model is None:
        return
    # the energy is known where it is conserved or the motion is known; the budget is 0 always
    name = plain(quantity or "")
    taken, done, budget = BUDGET
    is_solved = has_solution(model) and name not in (taken, done)
    known = is_solved or name == budget or (model.conservative and name in ENERGIES)
    if not known:
        of = (*(ENERGIES if model.conservative else ()), *((budget,) if has_budget(model) else ()))
        hint = f"{' and '.join(of)} {'is' if len(of) == 1 else 'are'}" if of else ""
        rule = f"the exact {quantity or 'solution'} of {model.kind} is not known"
        scope.refuse(rule, hint, value)


def known_by_theory(value: str, scope: Scope) -> None:
    """Check that the theory of schemes, which is that of linear models without damping, knows the model."""
    model = scope.ladder.model
    if model is not None and not (model.linear and model.conservative):
        rule = f"{value} is known of linear models without damping only, not of {model.kind}"
        scope.refuse(rule, value=value)


def _known_in_exact_numbers(value: str, scope: Scope) -> None:
    """Check that the acceleration of the model can be worked out in exact numbers."""
    from vibsim.theory.degrees import applies

    model = scope.ladder.model
    if model is not None and not applies(model):
        rule = (
            "is known of one coordinate without events, with an acceleration of + - * /, whole powers and abs; "
            f"that of {model.kind} here is another one"
        )
        scope.refuse(rule, value=value)


def known_error_part(name: str, scope: Scope) -> None:
    """Check that a part of a position's error (phase or amplitude) exists."""
    model = scope.ladder.model
    if model is None or name in error_parts(model):
        return
    if has_error_parts(model):
        scope.refuse("unknown quantity", nearest(name, error_parts(model)), name)
        return
    what = "events" if model.events is not None else "a force with corners"
    rule = f"does not exist: {model.kind} has {what}, and only a smooth motion has a phase and an amplitude"
    scope.refuse(rule, f"ask for {model.position}", name)


def has_formal_order(check: ConvergesCheck, scope: Scope) -> None:
    """Check that the order of a part of an error is given as a number where theory knows none."""
    model = scope.ladder.model
    if model is None or check.order != "scheme" or check.converges not in error_parts(model):
        return
    reason = why_not_free(model)
    if reason:
        rule = (
            f"theory knows the order of {check.converges} on linear models without forces in time only, and "
            f"{model.kind} {reason}"
        )
        place = scope.at("order" if "order" in check.model_fields_set else "converges")
        place.refuse(rule, "give `order:` as a number")


def known_value(name: str, scope: Scope) -> Value | None:
    """Return the value of a name; None, and a fault, where there is none."""
    row = VALUES.get(name)
    if row is None:
        scope.refuse("unknown value", nearest(name, list(VALUES)), name)
    return row


def check_value(row: Value, quantity: str | None, best: bool, scope: Scope) -> None:
    """Check of which quantity a value is, and that the model knows what it is compared with.

    Parameters
    ----------
    best
        Whether it is of the extrapolated solution.
    scope
        Of the mapping with the keys ``value`` and ``quantity``.
    """
    place = scope.at("quantity")
    choices = allowed(row, scope.ladder, best)
    if row.of == "none":
        if quantity is not None:
            rule = f"{row.name} is of the motion as a whole and takes no quantity"
            place.refuse(rule, at_key=True)
    elif quantity is None:
        rule = f"required key is missing: {row.name} is of a quantity"
        place.refuse(rule, "choose from " + ", ".join(choices))
    else:
        one_of(quantity, choices, place, row.name)
    is_comparable(row, quantity, scope.at("value"))


def is_comparable(row: Value, quantity: str | None, scope: Scope) -> None:
    """Check that the model knows exactly what a value is compared with."""
    model = scope.ladder.model
    if model is None:
        return
    if row.needs_exact == "period" and model.exact_period is None:
        scope.refuse(f"the exact period of {model.kind} is not known", value=row.name)
    if row.needs_exact == "solution":
        known_exactly(quantity, row.name, scope)
    if row.needs_events and model.events is None:
        scope.refuse(f"{model.kind} has no events: its motion is smooth", value=row.name)
    if row.needs_rational:
        _known_in_exact_numbers(row.name, scope)
    if row.needs_linear:
        known_by_theory(row.name, scope)


def allowed(row: Value, ladder: Ladder, best: bool = False) -> tuple[str, ...]:
    """Name the quantities that `row` can be of; `best`: of the extrapolated solution."""
    model = ladder.model
    if model is None or row.of == "none":
        return ()
    states = tuple(state.name for state in model.states)
    more = centred(model) if ladder.own_velocity else ()
    deviations = ("energy_deviation", *more[2:])
    match row.of:
        case "states":
            return states
        case "stored":
            return (*states, *(output.name for output in model.outputs))
        case "deviation":
            return deviations[:1]
        case "running":
            return deviations
        case "extremal":
            return (*states, *deviations)
        case "convergent" if not best:
            return (*all_quantities(ladder), *error_parts(model))
    if best:
        return (*states, *ENERGIES, *more)
    return all_quantities(ladder)
