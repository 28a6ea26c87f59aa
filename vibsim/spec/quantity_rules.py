"""Which quantities checks may be about: those of the model, and of the schemes that are named."""

from __future__ import annotations

from collections.abc import Iterable

from vibsim.errors import nearest
from vibsim.models import BUDGET, centred, has_budget, has_solution, quantities
from vibsim.models.error_parts import error_parts
from vibsim.spec.check_places import Ladder
from vibsim.spec.faults import Report
from vibsim.spec.source import Path_
from vibsim.spec.values import Value

ENERGIES = ("energy", "energy_deviation")
"""The energies that are known exactly where they are conserved."""


def known_quantity(name: str, path: Path_, ladder: Ladder, report: Report) -> bool:
    """Check that a quantity of the experiment is named."""
    return one_of(name, all_quantities(ladder), path, ladder, report)


def all_quantities(ladder: Ladder) -> tuple[str, ...]:
    """Name every quantity that is kept over time."""
    return () if ladder.model is None else quantities(ladder.model, ladder.own_velocity)


def one_of(
    name: str, choices: tuple[str, ...], path: Path_, ladder: Ladder, report: Report, what: str = ""
) -> bool:
    """Check that a quantity is one of `choices`, those of `what`; say so where it exists, but not there."""
    if not choices or name in choices:
        return True
    if ladder.model is not None and name in centred(ladder.model) and not ladder.own_velocity:
        rule = "exists only where a scheme has another velocity than the centred difference"
        if ladder.model.events is not None:
            rule = "does not exist: across an event the centred difference is no velocity"
        report.add(path, rule, f"ask for {plain(name)}", name)
        return False
    known = name in all_quantities(ladder)
    rule = f"{what} is not known of this quantity" if known else "unknown quantity"
    hint = "choose from " + ", ".join(choices) if known else nearest(name, choices)
    report.add(path, rule, hint, name)
    return False


def plain(name: str) -> str:
    """Return the quantity of which `name` is the one by the centred difference."""
    return name.removesuffix("_d2t")


def has_quantity(
    name: str, schemes: Iterable[tuple[str, Path_]], ladder: Ladder, report: Report
) -> None:
    """Check that schemes, each named at a place, have a quantity."""
    if ladder.model is None or name not in centred(ladder.model) or not ladder.own_velocity:
        return
    for scheme, path in schemes:
        if scheme in ladder.schemes and scheme not in ladder.own:
            rule = f"has no {name} beside its {plain(name)}"
            report.add(path, rule, _list(ladder.own), scheme)


def _list(names: Iterable[str]) -> str:
    found = ", ".join(names)
    return f"choose from {found}" if found else ""


def known_exactly(
    quantity: str | None, value: str, path: Path_, ladder: Ladder, report: Report
) -> None:
    """Check that the model knows the exact solution of a quantity, with which `value` is compared."""
    model = ladder.model
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
        report.add(path, rule, hint, value)


def known_by_theory(value: str, path: Path_, ladder: Ladder, report: Report) -> None:
    """Check that the theory of schemes, which is that of linear models without damping, knows the model."""
    model = ladder.model
    if model is not None and not (model.linear and model.conservative):
        rule = f"{value} is known of linear models without damping only, not of {model.kind}"
        report.add(path, rule, value=value)


def known_in_exact_numbers(value: str, path: Path_, ladder: Ladder, report: Report) -> None:
    """Check that the acceleration of the model can be worked out in exact numbers."""
    from vibsim.theory.degrees import applies

    model = ladder.model
    if model is not None and not applies(model):
        rule = (
            "is known of one coordinate without events, with an acceleration of + - * /, whole powers and abs; "
            f"that of {model.kind} here is another one"
        )
        report.add(path, rule, value=value)


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
