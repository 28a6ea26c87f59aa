"""Which figures a report shows, the decisive ones first."""

from __future__ import annotations

from collections.abc import Sequence
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
    cases = sorted({member.case for member in shown}, key=lambda case: case != lead.member.case)
    has_series, has_pairs = not data.is_lean(record), bool(data.whole(record, "pair"))
    series = shown if has_series else []
    position = choice.position(experiment)
    moving = Drawn()
    if has_series:
        # beside the worst member a typical one
        typical = [member for member in series if member.role == "typical"]
        shown_in_motion = [lead.member, *typical[:1]]
        moving += [solution.motion(record, position, member) for member in shown_in_motion]
        moving += [long_series.long_series(record, position, lead.member)]
        moving += [plane.path(experiment, record, series)]
    own = [member for member in series if member.role != "typical"]
    own.sort(key=lambda one: (one.scheme, one.case) != (lead.member.scheme, lead.member.case))

    def tab(label: str, drawn: Drawn) -> list[Tab]:
        found = tuple(one for one in drawn if one is not None and one.name not in first)
        return [Tab(label, found)] if found else []

    def of(quantity: str) -> list[Tab]:
        letter, is_lead = words.symbol(quantity), quantity == lead.quantity
        drawn, tabs = Drawn(), list[Tab]()
        is_energy = quantity == "energy_deviation" and "energy_deviation_scaled" in record
        if has_pairs:
            # of a sweep the map has the rest
            drawn += [order.against_step(experiment, record, quantity, c) for c in cases[:1]]
        several = is_lead and len(own) > 1
        for member in own[:FEW_SCHEMES] if is_lead else own[:1]:
            each: Drawn = [time.energy(record, member)] if is_energy else []
            is_wanted = not is_energy or quantity in checked_quantities(experiment)
            if has_pairs and is_wanted and time.name_of_differences(quantity, member) not in first:
                each.append(time.overlay(record, quantity, member))
            if several:
                tabs += tab(f"{letter}, {member.scheme_name}", each)
            else:
                drawn += each
        return [*tab(f"{letter}, order" if several else letter, drawn), *tabs]

    tabs = [one for quantity in found if quantity == lead.quantity for one in of(quantity)]
    if series:
        working = tab("work", [work.precision(experiment, record, case) for case in cases[:1]])
        # where a scheme chooses its own steps, the work compares it with the others
        has_own_steps = bool(np.isnan(data.formal_orders(record, lead.quantity)).any())
        tabs[1:1] = working * has_own_steps
    if has_pairs:
        tabs += tab("estimated error", [solution.solution(record, position, m) for m in own[:1]])
    if series:
        if experiment.model.definition.conservative:
            tabs += tab("energy", [energy.running(record, case) for case in cases[:1]])
        beside: Drawn = [extrema.local(experiment, record, series, extrema.FEWEST)]
        if not data.swept(record) and experiment.model.definition.is_alone:
            beside.append(plane.phase(experiment, record, series))
        tabs += tab("phase and amplitude", beside)
    theories: Drawn = [theory.order_and_stability(experiment, record)]
    theories += [theory.growing(experiment, record)] if has_series else []
    tabs += tab("theory", theories)
    if series and not has_own_steps:
        tabs += working
    tabs += [one for quantity in found if quantity != lead.quantity for one in of(quantity)]
    motion = tuple(picture for picture in moving if picture and picture.name not in first)
    views, told = over_members(experiment, record, found, lead)
    return Gallery(motion, tuple(tabs), tuple(views), tuple(told))


def over_members(
    experiment: Experiment, record: Record, found: list[str], lead: Lead
) -> tuple[list[View], list[str]]:
    """Return the views over the swept parameters, and what all members share: along a line, on a map, or by key."""
    keys = sweep_layout.keys(record)
    if not keys:
        return [], []
    layout = sweep_layout.layout_of(keys)
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
    told = [one for one in shown if isinstance(one, str)]
    for quantity in found if data.whole(record, "pair") else ():
        # the verdict that colours them is on the order
        picture = members.histograms(experiment, record, quantity)
        if picture is not None:
            views.append(View(f"histograms of {words.symbol(quantity)}", picture, panels=()))
    return views, told


def choose(experiment: Experiment, record: Record) -> tuple[list[Member], str]:
    """Return what gets figures of its own, and a sentence saying what was left out."""
    quantity = choice.first(experiment, record)
    everyone = choice.with_levels(experiment, choice.members(record, quantity))
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
        parts.append("The worst and a typical member are shown over time, for every scheme.")
    count = len(everyone) - room
    if count > 0:
        one, many = ("scheme", "schemes")
        if is_swept:
            one, many = "member with its scheme", "members with their schemes"
        who = f"1 more {one} has" if count == 1 else f"{count} more {many} have"
        parts.append(f"{who} no figures over time; the tables hold their numbers.")
    return shown, " ".join(parts)
