"""The figures of a report, the decisive ones first."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from vibsim.core.vocabulary import SEVERITY
from vibsim.experiment.storage import checked_quantities
from vibsim.report import choice, sweep_layout, words
from vibsim.report.choice import CheckedLadder
from vibsim.report.data import Ladder, Member, Results
from vibsim.report.figures import (
    energy,
    extrema,
    long_series,
    order,
    plane,
    solution,
    theory,
    time,
    work,
)
from vibsim.report.figures.sweeps import maps, members, sweep
from vibsim.report.figures.sweeps.separatrix import with_separatrix
from vibsim.report.figures.sweeps.view import View
from vibsim.report.style import Picture
from vibsim.report.sweep_layout import Along, Grid

FEW_SCHEMES = 3  # most schemes whose figures over time are shown for the decisive quantity
MOST_SHOWN = 6
"""Most schemes and members with figures of their own, half as many if there are more schemes; tables have them all."""

Drawn = list[Picture | None]
Tab = tuple[str, tuple[Picture, ...]]  # figures under one label


@dataclass(frozen=True)
class Gallery:
    """The figures of a page below its first screen, by section."""

    motion: tuple[Picture, ...] = ()
    belief: tuple[Tab, ...] = ()
    members: tuple[View, ...] = ()
    shared: tuple[str, ...] = ()  # sentences on what all members of a sweep share


def pictures(shown: list[Member], lead: CheckedLadder, first: Sequence[str]) -> Gallery:
    """Return the figures of a report, without those of the first screen; `first` are the names of these."""
    record = lead.record
    quantities = choice.quantities(record)
    case = min((member.case for member in shown), key=lambda case: (case != lead.case, case))
    series = [] if record.is_lean else shown
    positions = record.model.positions
    position = lead.quantity if lead.quantity in positions else positions[0]
    worst = [member for member in series if member.role != "typical"]
    worst.sort(key=lambda one: one.place != lead.member.place)
    leading, others = list[Tab](), list[Tab]()
    for quantity in quantities:
        is_lead = quantity == lead.quantity
        members = worst[:FEW_SCHEMES] if is_lead else worst[:1]
        drawn = _of_quantity(record, quantity, case, members, first)
        (leading if is_lead else others).extend(_tabs(drawn, first))
    general = _tabs(_general(record, case, series, worst, position), first)
    efforts = _tabs([("work", [work.precision(record, case)])] if series else [], first)
    if efforts and np.isnan(record.formal_orders(lead.quantity)).any():
        # only work compares an adaptive scheme with the others
        belief = [*leading[:1], *efforts, *leading[1:], *general, *others]
    else:
        belief = [*leading, *general, *efforts, *others]
    motion = _motion(series, lead, position) if series else []
    views, notes = over_members(quantities, lead)
    return Gallery(_new(motion, first), tuple(belief), tuple(views), tuple(notes))


def _new(drawn: Drawn, first: Sequence[str]) -> tuple[Picture, ...]:
    """Return the pictures that the first screen does not have."""
    return tuple(p for p in drawn if p is not None and p.name not in first)


def _tabs(labelled: Iterable[tuple[str, Drawn]], first: Sequence[str]) -> list[Tab]:
    """Return the figures under each label that the first screen does not have."""
    tabs = ((label, _new(drawn, first)) for label, drawn in labelled)
    return [(label, pictures) for label, pictures in tabs if pictures]


def _motion(series: list[Member], lead: CheckedLadder, position: str) -> Drawn:
    """Draw the motion of the decisive member and of a typical one."""
    ladder, typical = lead.of(position), [one for one in series if one.role == "typical"]
    return [
        solution.motion(ladder),
        *(solution.motion(ladder.with_member(one)) for one in typical[:1]),
        long_series.long_series(ladder),
        plane.path(lead.record, series),
    ]


def _of_quantity(
    record: Results, quantity: str, case: int, members: list[Member], first: Sequence[str]
) -> list[tuple[str, Drawn]]:
    """Draw the error of a quantity against the step, and the agreement of the levels over time for each member.

    The latter takes longest; the first screen may have it already for the decisive member.
    """
    has_pairs, letter = bool(record.pairs), words.symbol(quantity)
    is_energy = quantity == "energy_deviation" and "energy_deviation_scaled" in record
    has_series = f"{quantity}_difference" in record
    are_compared = has_series and (
        not is_energy or quantity in checked_quantities(record.experiment)
    )
    # maps and curves of a sweep show the other members
    shared: Drawn = [order.against_step(record, quantity, case)] if has_pairs else []
    tabs = list[tuple[str, Drawn]]()
    for member in members:
        drawn: Drawn = [time.energy(record, member)] if is_energy else []
        ladder = Ladder(record, quantity, member)
        if are_compared and time.name_of_differences(ladder) not in first:
            drawn.append(time.overlay(ladder))
        tabs.append((f"{letter}, {member.scheme_name}", drawn))
    if len(tabs) < 2:
        return [(letter, [*shared, *(picture for _, drawn in tabs for picture in drawn)])]
    return [(f"{letter}, order", shared), *tabs]


def _general(
    record: Results, case: int, series: list[Member], worst: list[Member], position: str
) -> Iterator[tuple[str, Drawn]]:
    """Draw the figures that belong to no quantity: estimated error, energy, phase and amplitude, and theory."""
    for member in worst[:1] if record.pairs else []:
        ladder = Ladder(record, position, member)
        if not ladder.is_undecided:
            yield "estimated error", [solution.solution(ladder)]
    equation = record.model
    if series:
        if equation.conservative:
            yield "energy", [energy.running(record, case)]
        phases: Drawn = [extrema.local(record, series, extrema.FEWEST_PEAKS)]
        if not record.swept and equation.is_alone:
            phases.append(plane.phase(record, series))
        yield "phase and amplitude", phases
    theories: Drawn = [theory.order_and_stability(record)]
    theories += [theory.growing(record)] if series else []
    yield "theory", theories


def over_members(quantities: list[str], lead: CheckedLadder) -> tuple[list[View], list[str]]:
    """Return the views over the swept parameters (along a line, on a map, or by key), and what all members share."""
    record = lead.record
    keys = sweep_layout.keys(record)
    if not keys:
        return [], []
    layout = sweep_layout.layout_of(record)
    schemes = range(min(len(record.schemes), MOST_SHOWN))

    @cache
    def worst(quantity: str) -> Member:
        return lead.member if quantity == lead.quantity else choice.worst(record, quantity)

    if isinstance(layout, Along):
        drawn = sweep.views(record, layout, quantities, worst)
    elif isinstance(layout, Grid):
        grid = with_separatrix(record.experiment, layout)
        drawn = maps.views(record, grid, quantities, worst, schemes)
    else:
        drawn = members.views(record, keys, quantities, worst, schemes)
    shown = list(drawn)
    views = [item for item in shown if isinstance(item, View)]
    notes = [item for item in shown if isinstance(item, str)]
    return views, notes


def choose(record: Results, decisive: Member | None = None) -> tuple[list[Member], str]:
    """Return the members with figures of their own, the `decisive` one first, and sentences on what was left out."""
    quantity = choice.first(record)
    candidates = choice.with_levels(record, choice.members(record, quantity, decisive))
    ranked = candidates
    if f"{quantity}_status" in record:
        status = record.flags(f"{quantity}_status")
        ranked = sorted(candidates, key=lambda m: -SEVERITY[status[m.scheme, m.case]])
    room = MOST_SHOWN if len(record.schemes) <= MOST_SHOWN else MOST_SHOWN // 2
    shown = [member for member in candidates if member in ranked[:room]]
    parts, is_swept = [], bool(record.swept)
    if record.is_lean:
        parts.append(
            "The sweep is large, so no series over time are stored, and there are no figures over time. A member that "
            "runs alone has them."
        )
    elif is_swept:
        parts.append(
            "The member that decides and a typical one are shown over time, for every scheme."
        )
    count = len(candidates) - room
    if count > 0:
        singular, plural = ("scheme", "schemes")
        if is_swept:
            singular, plural = "member with its scheme", "members with their schemes"
        subject = f"1 more {singular} has" if count == 1 else f"{count} more {plural} have"
        parts.append(f"{subject} no figures over time; the tables hold their numbers.")
    return shown, " ".join(parts)
