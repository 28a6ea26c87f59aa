"""What the checks of how schemes behave must be besides well-formed."""

from __future__ import annotations

from vibsim.spec.check_places import (
    Ladder,
    check_case,
    check_level,
    is_faulty,
    known_scheme,
    known_schemes,
)
from vibsim.spec.faults import Report
from vibsim.spec.quantity_rules import (
    ENERGIES,
    has_quantity,
    known_by_theory,
    known_exactly,
    known_quantity,
    one_of,
    plain,
)
from vibsim.spec.scheme_checks import SOLUTIONS, ConservesCheck, EqualCheck, StableCheck
from vibsim.spec.source import Path_


def stable(check: StableCheck, path: Path_, ladder: Ladder, report: Report) -> None:
    """Note what is wrong with a check of stability."""
    known_schemes(check.schemes, path, ladder, report)
    check_level(check.level, path, ladder, report)
    check_case(check.case, (*path, "case"), ladder, report)


def conserves(check: ConservesCheck, path: Path_, ladder: Ladder, report: Report) -> None:
    """Note what is wrong with a check of the energy."""
    known_schemes(check.schemes, path, ladder, report)
    if known_quantity(check.conserves, (*path, "conserves"), ladder, report):
        named = enumerate(check.schemes or ())
        places = ((name, (*path, "schemes", i)) for i, name in named)
        has_quantity(check.conserves, places, ladder, report)
    if ladder.model is not None and not ladder.model.conservative:
        report.add(path, f"the energy of {ladder.model.kind} is not conserved")
    check_level(check.level, path, ladder, report)
    check_case(check.case, (*path, "case"), ladder, report)


def equal(check: EqualCheck, path: Path_, ladder: Ladder, report: Report) -> None:
    """Note what is wrong with a comparison of a scheme."""
    check_level(check.level, path, ladder, report)
    check_case(check.case, (*path, "case"), ladder, report)
    place = (*path, "equal")
    if is_faulty(place, report):
        return
    first, second = (*place, 0), (*place, 1)
    if check.first in SOLUTIONS:
        report.add(first, "must be a scheme: what it equals stands behind it", value=check.first)
    else:
        known_scheme(check.first, first, ladder, report)
    named = [(check.first, first)]
    if check.second not in SOLUTIONS:
        known_scheme(check.second, second, ladder, report, SOLUTIONS)
        named.append((check.second, second))
        if check.first == check.second:
            report.add(second, "must be another one than the first", value=check.second)
    if _quantity(check, path, ladder, report):
        has_quantity(check.quantity, named, ladder, report)
        _solution(check, second, ladder, report)
    if check.second == "discrete" and check.first in ladder.adaptive:
        report.add(first, "has no steps of its own that theory could know", value=check.first)


def _quantity(check: EqualCheck, path: Path_, ladder: Ladder, report: Report) -> bool:
    place = (*path, "quantity")
    if check.second == "discrete" and ladder.model is not None:
        states = tuple(state.name for state in ladder.model.states)
        return one_of(check.quantity, states, place, ladder, report, "discrete")
    if check.second == "exact" and ladder.model is not None:
        states = tuple(state.name for state in ladder.model.states)
        exact = plain(check.quantity) in (*states, *ENERGIES)
        choices = (*states, *ENERGIES, *([check.quantity] if exact and ladder.own_velocity else ()))
        return one_of(check.quantity, choices, place, ladder, report, "exact")
    return known_quantity(check.quantity, place, ladder, report)


def _solution(check: EqualCheck, place: Path_, ladder: Ladder, report: Report) -> None:
    """Check that the solution is known that a scheme is compared with."""
    if check.second == "exact":
        known_exactly(check.quantity, check.second, place, ladder, report)
    elif check.second == "discrete":
        known_by_theory(check.second, place, ladder, report)
