"""Which figures a report shows, the decisive ones first."""

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
"""Schemes up to which each one's figures over time stand before those that lay schemes beside each other."""
MOST_SHOWN = 6
"""Most schemes and members that get figures of their own, of more schemes half as many; the tables have them all."""

Drawn = list[Picture | None]


@dataclass(frozen=True)
class Tab:
    """Figures that stand together behind one label."""

    label: str
    pictures: tuple[Picture, ...]


@dataclass(frozen=True)
class Gallery:
    """The figures of a page below its first screen, by section."""

    motion: tuple[Picture, ...] = ()
    belief: tuple[Tab, ...] = ()
    members: tuple[View, ...] = ()
    shared: tuple[str, ...] = ()
    """What all members of a sweep share, in words."""


def pictures(
    experiment: Experiment, record: Record, shown: list[Member], lead: Lead, first: Sequence[str]
) -> Gallery:
    """Return the figures of a report, those left out that stand above already; `first` names these."""
    found = choice.quantities(experiment, record)
    case = min((member.case for member in shown), key=lambda case: (case != lead.member.case, case))
    series = [] if data.is_lean(record) else shown
    positions = experiment.model.definition.positions
    position = lead.quantity if lead.quantity in positions else positions[0]
    own = [member for member in series if member.role != "typical"]
    own.sort(key=lambda one: (one.scheme, one.case) != (lead.member.scheme, lead.member.case))
    leading, others = list[Tab](), list[Tab]()
    for quantity in found:
        is_lead = quantity == lead.quantity
        members = own[:FEW_SCHEMES] if is_lead else own[:1]
        drawn = _of_quantity(experiment, record, quantity, case, members, first)
        (leading if is_lead else others).extend(_tabs(drawn, first))
    general = _tabs(_of_every_quantity(experiment, record, case, series, own, position), first)
    working = _tabs([("work", [work.precision(experiment, record, case)])] if series else [], first)
    if working and np.isnan(data.formal_orders(record, lead.quantity)).any():
        # where a scheme chooses its own steps, the work compares it with the others
        belief = [*leading[:1], *working, *leading[1:], *general, *others]
    else:
        belief = [*leading, *general, *working, *others]
    moving = _motion(experiment, record, series, lead, position) if series else []
    views, notes = over_members(experiment, record, found, lead)
    return Gallery(_new(moving, first), tuple(belief), tuple(views), tuple(notes))


def _new(drawn: Drawn, first: Sequence[str]) -> tuple[Picture, ...]:
    """Return the pictures that do not stand above already."""
    return tuple(one for one in drawn if one is not None and one.name not in first)


def _tabs(labelled: Iterable[tuple[str, Drawn]], first: Sequence[str]) -> list[Tab]:
    """Return the figures behind each label, as far as they do not stand above already."""
    tabs = (Tab(label, _new(drawn, first)) for label, drawn in labelled)
    return [tab for tab in tabs if tab.pictures]


def _motion(
    experiment: Experiment, record: Record, series: list[Member], lead: Lead, position: str
) -> Drawn:
    """Draw the motion of the member that decides, and beside it of a typical one."""
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
    """Draw the error of a quantity against the step, and how the levels of each member agree over time.

    The latter takes longest, and stands above already for the member that decides.
    """
    has_pairs, letter = bool(data.whole(record, "pair")), words.symbol(quantity)
    is_energy = quantity == "energy_deviation" and "energy_deviation_scaled" in record
    are_compared = has_pairs and (not is_energy or quantity in checked_quantities(experiment))
    # of a sweep the map has the other members
    shared: Drawn = [order.against_step(experiment, record, quantity, case)] if has_pairs else []
    tabs = list[tuple[str, Drawn]]()
    for member in members:
        each: Drawn = [time.energy(record, member)] if is_energy else []
        if are_compared and time.name_of_differences(quantity, member) not in first:
            each.append(time.overlay(record, quantity, member))
        tabs.append((f"{letter}, {member.scheme_name}", each))
    if len(tabs) < 2:
        return [(letter, [*shared, *(one for _, each in tabs for one in each)])]
    return [(f"{letter}, order", shared), *tabs]


def _of_every_quantity(
    experiment: Experiment,
    record: Record,
    case: int,
    series: list[Member],
    own: list[Member],
    position: str,
) -> Iterator[tuple[str, Drawn]]:
    """Draw the estimated error, the energy, phase and amplitude, and what theory says of the schemes."""
    if own and data.whole(record, "pair"):
        yield "estimated error", [solution.solution(record, position, own[0])]
    equation = experiment.model.definition
    if series:
        if equation.conservative:
            yield "energy", [energy.running(record, case)]
        beside: Drawn = [extrema.local(experiment, record, series, extrema.FEWEST_PEAKS)]
        if not data.swept(record) and equation.is_alone:
            beside.append(plane.phase(experiment, record, series))
        yield "phase and amplitude", beside
    theories: Drawn = [theory.order_and_stability(experiment, record)]
    theories += [theory.growing(experiment, record)] if series else []
    yield "theory", theories


def over_members(
    experiment: Experiment, record: Record, found: list[str], lead: Lead
) -> tuple[list[View], list[str]]:
    """Return the views over the swept parameters, and what all members share: along a line, on a map, or by key."""
    keys = sweep_layout.keys(record)
    if not keys:
        return [], []
    layout = sweep_layout.layout_of(experiment, record)
    schemes = range(min(len(record["scheme"]), MOST_SHOWN))

    @cache
    def worst(quantity: str) -> Member:
        return lead.member if quantity == lead.quantity else choice.worst(record, quantity)

    if isinstance(layout, Along):
        drawn = sweep.views(experiment, record, layout, found, worst)
    elif isinstance(layout, Grid):
        grid = with_separatrix(experiment, layout)
        drawn = maps.views(experiment, record, grid, found, worst, schemes)
    else:
        drawn = members.views(experiment, record, keys, found, worst, schemes)
    shown = list(drawn)
    views = [one for one in shown if isinstance(one, View)]
    notes = [one for one in shown if isinstance(one, str)]
    for quantity in found if data.whole(record, "pair") else ():
        # the verdict that colours them is on the order
        picture = members.histograms(experiment, record, quantity)
        if picture is not None:
            views.append(View(f"histograms of {words.symbol(quantity)}", picture, panels=()))
    return views, notes


def choose(
    experiment: Experiment, record: Record, decisive: Member | None = None
) -> tuple[list[Member], str]:
    """Return what gets figures of its own, the `decisive` member first, and a sentence saying what was left out."""
    quantity = choice.first(experiment, record)
    everyone = choice.with_levels(experiment, choice.members(record, quantity, decisive))
    ranked = everyone
    if f"{quantity}_status" in record:
        status = data.flags(record, f"{quantity}_status")
        ranked = sorted(everyone, key=lambda one: -SEVERITY[status[one.scheme, one.case]])
    room = MOST_SHOWN if len(record["scheme"]) <= MOST_SHOWN else MOST_SHOWN // 2
    shown = [member for member in everyone if member in ranked[:room]]
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
    count = len(everyone) - room
    if count > 0:
        one, many = ("scheme", "schemes")
        if is_swept:
            one, many = "member with its scheme", "members with their schemes"
        who = f"1 more {one} has" if count == 1 else f"{count} more {many} have"
        parts.append(f"{who} no figures over time; the tables hold their numbers.")
    return shown, " ".join(parts)
