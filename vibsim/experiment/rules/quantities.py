"""Rules for the quantities that checks and printed tables name: the model and the schemes have them."""

from __future__ import annotations

from collections.abc import Iterable

from vibsim.core.errors import nearest
from vibsim.core.vocabulary import VECTORS, plain_name
from vibsim.experiment.rules.check_places import Scope
from vibsim.models import centred
from vibsim.models.base import Model, components


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
