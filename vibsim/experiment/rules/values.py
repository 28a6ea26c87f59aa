"""Rules for the quantities and numbers of checks and printed tables, and for exact solutions: the model has them."""

from __future__ import annotations

from collections.abc import Iterable

from vibsim.core.errors import nearest
from vibsim.core.vocabulary import VECTORS, plain_name
from vibsim.experiment.rules.check_places import Scope
from vibsim.experiment.rules.potential import NOT_FOUND
from vibsim.experiment.rules.setting import Setting
from vibsim.experiment.value_names import VALUES, Value
from vibsim.models import BUDGET, centred, has_budget, has_solution
from vibsim.models.base import Model, components, error_parts
from vibsim.models.structure import MOST_MODES

ENERGIES = ("energy", "energy_deviation")  # known exactly if energy is conserved


def value_named(name: str, scope: Scope) -> Value | None:
    """Return the value of this name; report a fault and return None if there is none."""
    row = VALUES.get(name)
    if row is None:
        is_known = name in scope.setting.quantities
        hint = f"for its value at the end write `value: end, quantity: {name}`" if is_known else ""
        scope.refuse("unknown value", hint or nearest(name, list(VALUES)), name)
    return row


def check_quantity_of(row: Value, quantity: str | None, best: bool, scope: Scope) -> None:
    """Check the quantity of a value (`best`: of the extrapolated solution), and that the model supports the value.

    The scope is that of the mapping with the keys ``value`` and ``quantity``.
    """
    place = scope.at("quantity")
    choices = quantities_of(row, scope.setting, best)
    if row.of == "none":
        if quantity is not None:
            rule = f"{row.name} belongs to the motion as a whole and takes no quantity"
            place.refuse(rule, at_key=True)
    elif quantity is None:
        rule = f"required key is missing: {row.name} needs a quantity"
        place.refuse(rule, "choose from " + ", ".join(choices))
    else:
        only_there = best and quantity in quantities_of(row, scope.setting, False)
        is_quantity(quantity, choices, place, row.name, is_at_best=only_there)
    check_support(row, quantity, scope.at("value"))


def quantities_of(row: Value, setting: Setting, best: bool = False) -> tuple[str, ...]:
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
    compared = (*error_parts(model), *vectors_of(model))
    return (*setting.quantities, *(compared if row.of == "convergent" else ()))


def check_support(row: Value, quantity: str | None, scope: Scope) -> None:
    """Check that the model has what a value needs: events, a potential, an exact solution, theory."""
    model = scope.setting.model
    if model is None:
        return
    if row.needs_exact and scope.setting.sweep.follow:
        refuse_followers(row.name, scope)
        return
    if row.needs_exact == "period" and model.exact_period is None:
        scope.refuse(f"the exact period of {model.kind} is not known", value=row.name)
    if row.needs_exact == "solution":
        check_exact(quantity, row.name, scope)
    if row.needs_potential and model.misses_potential:
        scope.refuse(NOT_FOUND, instead_of_energy(scope), row.name)
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
        check_theory(row.name, scope)


def instead_of_energy(scope: Scope) -> str:
    """Return a hint for models whose energy is not conserved, or not known to be."""
    budget = "the budget of energy and work is: `converges: energy_budget`"
    has_budget = "energy_budget" in scope.setting.quantities
    model = scope.setting.model
    if has_budget and model is not None and model.events_act:
        return f"its events may change it; {budget}"
    if model is not None and model.misses_potential:
        return "write its `potential`, if the forces have one that vibsim does not find"
    if any(note.key == "model.potential" for note in scope.report.notes):
        return "by the `potential` that is written: leave it out, and vibsim finds it where it can"
    return budget if has_budget else ""


def check_exact(quantity: str | None, value: str, scope: Scope) -> None:
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


def refuse_followers(value: str, scope: Scope) -> None:
    """Report that members of a chain have no exact solution."""
    rule = "the exact solution is not known for members that start from the last state of others"
    scope.refuse(rule, "leave out `follow`", value)


def check_theory(value: str, scope: Scope) -> None:
    """Check that the model is linear and undamped, as the theory of schemes requires."""
    model = scope.setting.model
    if model is not None and not (model.linear and model.conservative):
        rule = f"{value} is known only for linear models without damping, not for {model.kind}"
        scope.refuse(rule, value=value)


def vectors_of(model: Model | None) -> tuple[str, ...]:
    """Return the vectors of all coordinates; none for a single one."""
    return VECTORS if model is not None and model.coordinates > 1 else ()


def is_quantity(
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


def check_velocities(name: str, schemes: Iterable[tuple[str, Scope]]) -> None:
    """Check that schemes, each with its place in the file, have a quantity that needs a velocity of their own."""
    for scheme, scope in schemes:
        setting = scope.setting
        if setting.model is None or name not in centred(setting.model) or not setting.own_velocity:
            return
        able = setting.with_own_velocity
        if scheme in setting.names and scheme not in able:
            hint = f"choose from {', '.join(able)}" if able else ""
            scope.refuse(f"has no {name} beside its {plain_name(name)}", hint, scheme)
