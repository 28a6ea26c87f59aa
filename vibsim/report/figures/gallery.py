"""Which figures a report shows, the decisive ones first."""

from __future__ import annotations

from shlex import quote

from vibsim.core.record import Record
from vibsim.core.vocabulary import SEVERITY
from vibsim.experiment.storage import asked
from vibsim.report import choice, data, sweep_layout
from vibsim.report.data import Member
from vibsim.report.figures import (
    energy,
    extrema,
    maps,
    members,
    order,
    plane,
    solution,
    sweep,
    theory,
    time,
    work,
)
from vibsim.report.figures.separatrix import with_separatrix
from vibsim.report.style import Picture
from vibsim.report.types import Experiment

FEW_SCHEMES = 3
"""Schemes up to which each one's figures over time stand before those that lay schemes beside each other."""
MOST_SHOWN = 6
"""Most schemes and members that get figures of their own, of more schemes half as many; the tables have them all."""

Drawn = list[Picture | None]


def pictures(experiment: Experiment, record: Record, shown: list[Member]) -> list[Picture]:
    """Return the figures of a report in the order of the page."""
    found = choice.quantities(experiment, record)
    cases = sorted({member.case for member in shown})
    has_series, has_pairs = not data.is_lean(record), bool(data.whole(record, "pair"))
    series = shown if has_series else []
    drawn: Drawn = [theory.order_and_stability(experiment, record)]
    if has_series:
        drawn.append(theory.growing(experiment, record))
    drawn += over_members(experiment, record, found)
    alone: Drawn = []
    # of several schemes what they have in common comes first, and what each does over time behind it
    own = alone if len(record["scheme"]) > FEW_SCHEMES else drawn
    for quantity in found:
        is_energy = quantity == "energy_deviation" and "energy_deviation_scaled" in record
        if is_energy:
            own += [time.energy(record, member) for member in series]
        if has_pairs and (not is_energy or quantity in asked(experiment)):
            own += [time.overlay(record, quantity, member) for member in series]
        if has_pairs:
            drawn += [order.against_step(experiment, record, quantity, case) for case in cases]
    if series:
        drawn.append(plane.path(experiment, record, series))
        drawn += [energy.running(record, case) for case in cases]
        drawn += [work.precision(experiment, record, case) for case in cases]
        drawn.append(extrema.local(experiment, record, series))
        if not data.swept(record) and experiment.model.definition.coordinates == 1:
            drawn.append(plane.phase(experiment, record, series))
    position = choice.position(experiment)
    drawn += [*alone, *(solution.solution(record, position, member) for member in series)]
    return [picture for picture in drawn if picture is not None]


def over_members(experiment: Experiment, record: Record, found: list[str]) -> list[Picture]:
    """Return the figures over the swept parameters: along a line, on a map, or against each key."""
    keys = sweep_layout.keys(record)
    if not keys:
        return []
    along, grid = sweep_layout.along_of(keys), sweep_layout.grid_of(keys)
    schemes = range(min(len(record["scheme"]), MOST_SHOWN))
    drawn: Drawn = []
    if grid is not None:
        grid = with_separatrix(experiment, grid)
    if along is not None:
        drawn.append(sweep.period(experiment, record, along))
        drawn.append(sweep.amplitude(experiment, record, along))
    elif grid is not None:
        drawn += [maps.motion(experiment, record, grid, scheme) for scheme in schemes]
    for quantity in found:
        if along is not None and data.whole(record, "triple"):
            drawn.append(sweep.orders(experiment, record, along, quantity))
        for scheme in schemes:
            if grid is not None:
                drawn.append(maps.verdicts(experiment, record, grid, quantity, scheme))
            elif along is None:
                drawn.append(members.projections(experiment, record, keys, quantity, scheme))
        if data.whole(record, "pair"):
            # the verdict that colours them is on the order
            drawn.append(members.histograms(experiment, record, quantity))
    if grid is not None:
        drawn += [maps.numbers(experiment, record, grid, scheme) for scheme in schemes]
    return [picture for picture in drawn if picture is not None]


def choose(experiment: Experiment, record: Record) -> tuple[list[Member], str]:
    """Return what gets figures of its own, and a sentence saying what was left out."""
    quantity = choice.quantities(experiment, record)[0]
    everyone = choice.with_levels(experiment, choice.members(record, quantity))
    status = data.flags(record, f"{quantity}_status")
    severity = [SEVERITY[status[m.scheme, m.case]] for m in everyone]
    room = MOST_SHOWN if len(record["scheme"]) <= MOST_SHOWN else MOST_SHOWN // 2
    ranked = sorted(range(len(everyone)), key=lambda i: (-severity[i], i))[:room]
    shown = [everyone[i] for i in sorted(ranked)]
    parts, is_swept = [], bool(data.swept(record))
    if data.is_lean(record):
        case = int(record["case"][shown[0].case])
        command = f".venv/bin/vibsim run {quote(f'{experiment.word}@{case}')}"
        parts.append(
            "The sweep is large, so no series over time are stored, and there are no figures over time. To see the "
            f"series of one member, here the worst, run it alone: `{command}`."
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
