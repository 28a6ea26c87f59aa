"""Which figures a report shows, the decisive ones first."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from shlex import quote

from vibsim.core.record import Record
from vibsim.core.vocabulary import MEMBER, SEVERITY
from vibsim.experiment.storage import asked
from vibsim.report import choice, data, finest_level, sweep_layout
from vibsim.report.data import Member
from vibsim.report.figures import (
    energy,
    extrema,
    long_series,
    maps,
    members,
    motion,
    order,
    plane,
    solution,
    sweep,
    theory,
    time,
    work,
)
from vibsim.report.figures.separatrix import with_separatrix
from vibsim.report.lead import Lead
from vibsim.report.style import Picture
from vibsim.report.text import words
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
    members: tuple[Tab, ...] = ()


def tab(label: str, drawn: Iterable[Picture | None]) -> list[Tab]:
    """Return one tab with the pictures that there are; none without a picture."""
    found = tuple(
        picture for picture in drawn if picture is not None and picture.figure is not None
    )
    return [Tab(label, found)] if found else []


def pictures(
    experiment: Experiment, record: Record, shown: list[Member], lead: Lead, first: Sequence[str]
) -> Gallery:
    """Return the figures of a report, those left out that stand above already; `first` names these."""
    found = choice.quantities(experiment, record)
    cases = sorted({member.case for member in shown}, key=lambda case: case != lead.member.case)
    has_series, has_pairs = not data.is_lean(record), bool(data.whole(record, "pair"))
    series = shown if has_series else []
    position = choice.position(experiment)
    moving: Drawn = [motion.motion(record, position, lead.member)] if has_series else []
    if has_series:
        # beside the worst member a typical one
        typical = [member for member in series if member.role == "typical"]
        moving += [motion.motion(record, position, member) for member in typical[:1]]
        moving += [long_series.long_series(record, position, lead.member)]
        moving += [plane.path(experiment, record, series)]
    own = [member for member in series if member.role != "typical"]
    own.sort(
        key=lambda member: (member.scheme, member.case) != (lead.member.scheme, lead.member.case)
    )

    def of(quantity: str) -> list[Tab]:
        letter, is_lead, drawn, tabs = (
            words.symbol(quantity),
            quantity == lead.quantity,
            Drawn(),
            list[Tab](),
        )
        is_energy = quantity == "energy_deviation" and "energy_deviation_scaled" in record
        if has_pairs:
            # of a sweep the map has the rest
            drawn += [order.against_step(experiment, record, quantity, c) for c in cases[:1]]
        several = is_lead and len(own) > 1
        for member in own[:FEW_SCHEMES] if is_lead else own[:1]:
            each: Drawn = [time.energy(record, member)] if is_energy else []
            if has_pairs and (not is_energy or quantity in asked(experiment)):
                each.append(time.overlay(record, quantity, member))
            if several:
                tabs += tab(f"{letter}, {member.scheme_name}", each)
            else:
                drawn += each
        return [*tab(f"{letter}, order" if several else letter, drawn), *tabs]

    tabs = [one for quantity in found if quantity == lead.quantity for one in of(quantity)]
    if has_pairs:
        tabs += tab("estimated error", [solution.solution(record, position, m) for m in own[:1]])
    if series:
        tabs += tab("energy", [energy.running(record, case) for case in cases[:1]])
        beside: Drawn = [extrema.local(experiment, record, series)]
        if not data.swept(record) and experiment.model.definition.coordinates == 1:
            beside.append(plane.phase(experiment, record, series))
        tabs += tab("phase and amplitude", beside)
    theories: Drawn = [theory.order_and_stability(experiment, record)]
    theories += [theory.growing(experiment, record)] if has_series else []
    tabs += tab("theory", theories)
    if series:
        tabs += tab("work", [work.precision(experiment, record, case) for case in cases[:1]])
    tabs += [one for quantity in found if quantity != lead.quantity for one in of(quantity)]
    shown_below = (picture for picture in moving if picture and picture.name not in first)
    belief = tuple(
        one for one in (_without(found_tab, first) for found_tab in tabs) if one.pictures
    )
    return Gallery(tuple(shown_below), belief, tuple(over_members(experiment, record, found)))


def _without(tab: Tab, names: Sequence[str]) -> Tab:
    """Return a tab without pictures that stand elsewhere."""
    return Tab(tab.label, tuple(one for one in tab.pictures if one.name not in names))


def over_members(experiment: Experiment, record: Record, found: list[str]) -> list[Tab]:
    """Return the figures over the swept parameters, a tab for each quantity: along a line, on a map, or by key."""
    keys = sweep_layout.keys(record)
    if not keys:
        return []
    along, grid = sweep_layout.along_of(keys), sweep_layout.grid_of(keys)
    schemes = range(min(len(record["scheme"]), MOST_SHOWN))
    tabs: list[Tab] = []
    if grid is not None:
        grid = with_separatrix(experiment, grid)
    if along is not None:
        for name, draw in (("period", sweep.period), ("amplitude", sweep.amplitude)):
            # what is the same for all members is a number, no picture
            if finest_level.varies(data.known(record, name, MEMBER, level=-1)):
                tabs += tab(name, [draw(experiment, record, along)])
    elif grid is not None:
        drawn = [maps.motion(experiment, record, grid, scheme) for scheme in schemes]
        tabs += tab("period and amplitude", drawn)
    for quantity in found:
        letter, each = words.symbol(quantity), Drawn()
        if along is not None and data.whole(record, "triple"):
            each.append(sweep.orders(experiment, record, along, quantity))
        for scheme in schemes:
            if grid is not None:
                each.append(maps.verdicts(experiment, record, grid, quantity, scheme))
            elif along is None:
                each.append(members.projections(experiment, record, keys, quantity, scheme))
        if data.whole(record, "pair"):
            # the verdict that colours them is on the order
            each.append(members.histograms(experiment, record, quantity))
        tabs += tab(f"order and error of {letter}", each)
    if grid is not None:
        drawn = [maps.numbers(experiment, record, grid, scheme) for scheme in schemes]
        tabs += tab("numbers of the checks", drawn)
    return tabs


def choose(experiment: Experiment, record: Record) -> tuple[list[Member], str]:
    """Return what gets figures of its own, and a sentence saying what was left out."""
    quantity = choice.first(experiment, record)
    everyone = choice.with_levels(experiment, choice.members(record, quantity))
    severity = [0] * len(everyone)
    if f"{quantity}_status" in record:
        status = data.flags(record, f"{quantity}_status")
        severity = [SEVERITY[status[m.scheme, m.case]] for m in everyone]
    room = MOST_SHOWN if len(record["scheme"]) <= MOST_SHOWN else MOST_SHOWN // 2
    ranked = sorted(range(len(everyone)), key=lambda i: (-severity[i], i))[:room]
    shown = [everyone[i] for i in sorted(ranked)]
    parts, is_swept = [], bool(data.swept(record))
    if data.is_lean(record):
        case = int(record["case"][shown[0].case])
        which = "here the worst" if shown[0].role == "worst" else "here the first"
        command = f".venv/bin/vibsim run {quote(f'{experiment.word}@{case}')}"
        parts.append(
            "The sweep is large, so no series over time are stored, and there are no figures over time. To see the "
            f"series of one member, {which}, run it alone: `{command}`."
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
