"""The figures of a report, the decisive ones first."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from vibsim.core.record import Record
from vibsim.core.vocabulary import SEVERITY
from vibsim.experiment.storage import checked_quantities
from vibsim.report import choice, data, sweep_layout, words
from vibsim.report.choice import Lead
from vibsim.report.data import Member
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
from vibsim.report.types import Experiment

FEW_SCHEMES = 3
"""Most schemes whose figures over time are shown for the decisive quantity."""
MOST_SHOWN = 6
"""Most schemes and members with figures of their own, half as many if there are more schemes; tables have them all."""

Drawn = list[Picture | None]
Tab = tuple[str, tuple[Picture, ...]]
"""Figures under one label."""


@dataclass(frozen=True)
class Gallery:
    """The figures of a page below its first screen, by section."""

    motion: tuple[Picture, ...] = ()
    belief: tuple[Tab, ...] = ()
    members: tuple[View, ...] = ()
    shared: tuple[str, ...] = ()
    """Sentences on what all members of a sweep share."""


def pictures(
    experiment: Experiment, record: Record, shown: list[Member], lead: Lead, first: Sequence[str]
) -> Gallery:
    """Return the figures of a report, without those of the first screen; `first` are the names of these."""
    quantities = choice.quantities(experiment, record)
    case = min((member.case for member in shown), key=lambda case: (case != lead.member.case, case))
    series = [] if data.is_lean(record) else shown
    positions = experiment.model.definition.positions
    position = lead.quantity if lead.quantity in positions else positions[0]
    worst = [member for member in series if member.role != "typical"]
    worst.sort(key=lambda one: (one.scheme, one.case) != (lead.member.scheme, lead.member.case))
    leading, others = list[Tab](), list[Tab]()
    for quantity in quantities:
        is_lead = quantity == lead.quantity
        members = worst[:FEW_SCHEMES] if is_lead else worst[:1]
        drawn = _of_quantity(experiment, record, quantity, case, members, first)
        (leading if is_lead else others).extend(_tabs(drawn, first))
    general = _tabs(_general(experiment, record, case, series, worst, position), first)
    efforts = _tabs([("work", [work.precision(experiment, record, case)])] if series else [], first)
    if efforts and np.isnan(data.formal_orders(record, lead.quantity)).any():
        # only work compares an adaptive scheme with the others
        belief = [*leading[:1], *efforts, *leading[1:], *general, *others]
    else:
        belief = [*leading, *general, *efforts, *others]
    motion = _motion(experiment, record, series, lead, position) if series else []
    views, notes = over_members(experiment, record, quantities, lead)
    return Gallery(_new(motion, first), tuple(belief), tuple(views), tuple(notes))


def _new(drawn: Drawn, first: Sequence[str]) -> tuple[Picture, ...]:
    """Return the pictures that the first screen does not have."""
    return tuple(p for p in drawn if p is not None and p.name not in first)


def _tabs(labelled: Iterable[tuple[str, Drawn]], first: Sequence[str]) -> list[Tab]:
    """Return the figures under each label that the first screen does not have."""
    tabs = ((label, _new(drawn, first)) for label, drawn in labelled)
    return [(label, pictures) for label, pictures in tabs if pictures]


def _motion(
    experiment: Experiment, record: Record, series: list[Member], lead: Lead, position: str
) -> Drawn:
    """Draw the motion of the decisive member and of a typical one."""
    typical = [member for member in series if member.role == "typical"]
    return [
        *(
            solution.motion(experiment, record, position, member)
            for member in [lead.member, *typical[:1]]
        ),
        long_series.long_series(experiment, record, position, lead.member),
        plane.path(experiment, record, series),
    ]


def _of_quantity(
    experiment: Experiment,
    record: Record,
    quantity: str,
    case: int,
    members: list[Member],
    first: Sequence[str],
) -> list[tuple[str, Drawn]]:
    """Draw the error of a quantity against the step, and the agreement of the levels over time for each member.

    The latter takes longest; the first screen may have it already for the decisive member.
    """
    has_pairs, letter = bool(data.whole(record, "pair")), words.symbol(quantity)
    is_energy = quantity == "energy_deviation" and "energy_deviation_scaled" in record
    has_series = f"{quantity}_difference" in record
    are_compared = has_series and (not is_energy or quantity in checked_quantities(experiment))
    # maps and curves of a sweep show the other members
    shared: Drawn = [order.against_step(experiment, record, quantity, case)] if has_pairs else []
    tabs = list[tuple[str, Drawn]]()
    for member in members:
        drawn: Drawn = [time.energy(record, member)] if is_energy else []
        if are_compared and time.name_of_differences(quantity, member) not in first:
            drawn.append(time.overlay(record, quantity, member))
        tabs.append((f"{letter}, {member.scheme_name}", drawn))
    if len(tabs) < 2:
        return [(letter, [*shared, *(picture for _, drawn in tabs for picture in drawn)])]
    return [(f"{letter}, order", shared), *tabs]


def _general(
    experiment: Experiment,
    record: Record,
    case: int,
    series: list[Member],
    worst: list[Member],
    position: str,
) -> Iterator[tuple[str, Drawn]]:
    """Draw the figures that belong to no quantity: estimated error, energy, phase and amplitude, and theory."""
    first = worst[0] if worst else None
    if (
        first
        and data.whole(record, "pair")
        and not data.is_undecided(record, position)[first.scheme, first.case]
    ):
        yield "estimated error", [solution.solution(experiment, record, position, first)]
    equation = experiment.model.definition
    if series:
        if equation.conservative:
            yield "energy", [energy.running(record, case)]
        phases: Drawn = [extrema.local(experiment, record, series, extrema.FEWEST_PEAKS)]
        if not data.swept(record) and equation.is_alone:
            phases.append(plane.phase(experiment, record, series))
        yield "phase and amplitude", phases
    theories: Drawn = [theory.order_and_stability(experiment, record)]
    theories += [theory.growing(experiment, record)] if series else []
    yield "theory", theories


def over_members(
    experiment: Experiment, record: Record, quantities: list[str], lead: Lead
) -> tuple[list[View], list[str]]:
    """Return the views over the swept parameters (along a line, on a map, or by key), and what all members share."""
    keys = sweep_layout.keys(record)
    if not keys:
        return [], []
    layout = sweep_layout.layout_of(experiment, record)
    schemes = range(min(len(record["scheme"]), MOST_SHOWN))

    @cache
    def worst(quantity: str) -> Member:
        return lead.member if quantity == lead.quantity else choice.worst(record, quantity)

    if isinstance(layout, Along):
        drawn = sweep.views(experiment, record, layout, quantities, worst)
    elif isinstance(layout, Grid):
        grid = with_separatrix(experiment, layout)
        drawn = maps.views(experiment, record, grid, quantities, worst, schemes)
    else:
        drawn = members.views(experiment, record, keys, quantities, worst, schemes)
    shown = list(drawn)
    views = [item for item in shown if isinstance(item, View)]
    notes = [item for item in shown if isinstance(item, str)]
    return views, notes


def choose(
    experiment: Experiment, record: Record, decisive: Member | None = None
) -> tuple[list[Member], str]:
    """Return the members with figures of their own, the `decisive` one first, and sentences on what was left out."""
    quantity = choice.first(experiment, record)
    candidates = choice.with_levels(experiment, choice.members(record, quantity, decisive))
    ranked = candidates
    if f"{quantity}_status" in record:
        status = data.flags(record, f"{quantity}_status")
        ranked = sorted(candidates, key=lambda m: -SEVERITY[status[m.scheme, m.case]])
    room = MOST_SHOWN if len(record["scheme"]) <= MOST_SHOWN else MOST_SHOWN // 2
    shown = [member for member in candidates if member in ranked[:room]]
    parts, is_swept = [], bool(data.swept(record))
    if data.is_lean(record):
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
