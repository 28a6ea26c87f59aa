"""Which figures a report shows, the decisive ones first."""

from __future__ import annotations

from shlex import quote
from typing import TYPE_CHECKING

from vibsim.core.record import Record
from vibsim.core.vocabulary import SEVERITY
from vibsim.experiment.storage import asked
from vibsim.report import choice, data, sweep_layout
from vibsim.report.data import Member
from vibsim.report.figures import (
    cloud,
    energy,
    extrema,
    growth,
    maps,
    order,
    path,
    period,
    phase,
    solution,
    spread,
    sweep,
    theory,
    time,
    work,
)
from vibsim.report.style import Picture

if TYPE_CHECKING:
    from vibsim.experiment import Experiment

FEW = 3
"""Schemes up to which each one's figures over time stand before those that lay schemes beside each other."""
SHOWN = 6
"""Most schemes and members that get figures of their own, of more schemes half as many; the tables have them all."""


def pictures(experiment: Experiment, record: Record, shown: list[Member]) -> list[Picture]:
    """Return the figures of a report in the order of the page."""
    found = choice.quantities(experiment, record)
    levels = bool(data.whole(record, "pair"))
    over = over_members(experiment, record, found)
    cases = sorted({member.case for member in shown})
    series = [] if data.is_lean(record) else shown
    several = len(record["scheme"]) > FEW
    drawn = _theory(experiment, record) + list(over)
    beside = _of_all_schemes(experiment, record, series, cases)
    alone: list[Picture] = []
    for quantity in found:
        # of several schemes what they have in common comes first, and what each does over time behind it
        (alone if several else drawn).extend(
            _of_quantity(experiment, record, quantity, series, levels)
        )
        drawn += [
            order.against_step(experiment, record, quantity, case) for case in cases if levels
        ]
    drawn += beside + alone
    drawn += [solution.solution(record, choice.position(experiment), member) for member in series]
    return drawn


def _theory(experiment: Experiment, record: Record) -> list[Picture]:
    """Return the figures of what theory predicts: order and stability of all schemes, and the runs that grow."""
    drawn = [theory.order_and_stability(experiment, record)]
    if not data.is_lean(record):
        drawn.append(growth.growing(experiment, record))
    return [picture for picture in drawn if picture is not None]


def _of_all_schemes(
    experiment: Experiment, record: Record, series: list[Member], cases: list[int]
) -> list[Picture]:
    """Return the figures that lay schemes beside each other: energy, work, peaks, phase plane."""
    if not series:
        return []
    drawn = [energy.running(record, case) for case in cases]
    drawn += [work.precision(experiment, record, case) for case in cases]
    drawn.append(extrema.local(experiment, record, series))
    drawn.insert(0, path.path(experiment, record, series))
    if not data.swept(record) and experiment.model.definition.coordinates == 1:
        drawn.append(phase.plane(experiment, record, series))
    return [picture for picture in drawn if picture is not None]


def over_members(experiment: Experiment, record: Record, found: list[str]) -> list[Picture]:
    """Return the figures over the swept parameters: along a line, on a map, or against each key."""
    keys = sweep_layout.keys(record)
    if not keys:
        return []
    along, grid = sweep_layout.along_of(keys), sweep_layout.grid_of(keys)
    schemes = range(min(len(record["scheme"]), SHOWN))
    drawn: list[Picture | None] = []
    if along is not None:
        drawn.append(period.period(experiment, record, along))
        drawn.append(period.amplitude(experiment, record, along))
    elif grid is not None:
        drawn += [maps.motion(experiment, record, grid, scheme) for scheme in schemes]
    for quantity in found:
        if along is not None and data.whole(record, "triple"):
            drawn.append(sweep.orders(experiment, record, along, quantity))
        for scheme in schemes:
            if grid is not None:
                drawn.append(maps.verdicts(experiment, record, grid, quantity, scheme))
            elif along is None:
                drawn.append(cloud.projections(experiment, record, keys, quantity, scheme))
        if data.whole(record, "pair"):
            # the verdict that colours them is on the order
            drawn.append(spread.histograms(experiment, record, quantity))
    if grid is not None:
        drawn += [maps.numbers(experiment, record, grid, scheme) for scheme in schemes]
    return [picture for picture in drawn if picture is not None]


def _of_quantity(
    experiment: Experiment, record: Record, quantity: str, shown: list[Member], levels: bool
) -> list[Picture]:
    conserved = quantity == "energy_deviation" and "energy_deviation_scaled" in record
    drawn = [time.energy(record, member) for member in shown] if conserved else []
    if levels and (not conserved or quantity in asked(experiment)):
        drawn += [time.overlay(record, quantity, member) for member in shown]
    return drawn


def choose(experiment: Experiment, record: Record) -> tuple[list[Member], str]:
    """Return what gets figures of its own, and a sentence saying what was left out."""
    quantity = choice.quantities(experiment, record)[0]
    everyone = choice.with_levels(experiment, choice.members(record, quantity))
    status = data.flags(record, f"{quantity}_status")
    severity = [SEVERITY[status[m.scheme, m.case]] for m in everyone]
    room = SHOWN if len(record["scheme"]) <= SHOWN else SHOWN // 2
    ranked = sorted(range(len(everyone)), key=lambda i: (-severity[i], i))[:room]
    shown = [everyone[i] for i in sorted(ranked)]
    parts = []
    if data.is_lean(record):
        case = int(record["case"][shown[0].case])
        command = f".venv/bin/vibsim run {quote(f'{experiment.word}@{case}')}"
        parts.append(
            "The sweep is large, so no series over time are stored, and there are no figures over time. To see the "
            f"series of one member, here the worst, run it alone: `{command}`."
        )
    elif data.swept(record):
        parts.append("The worst and a typical member are shown over time, for every scheme.")
    if len(everyone) > room:
        parts.append(
            f"{_more(len(everyone) - room, bool(data.swept(record)))} no figures over time; the tables hold their "
            "numbers."
        )
    return shown, " ".join(parts)


def _more(count: int, is_swept: bool) -> str:
    """Say of how many schemes, or members of them, more something holds."""
    what = "member with its scheme" if is_swept else "scheme"
    many = "members with their schemes" if is_swept else "schemes"
    return f"{count} more {what} has" if count == 1 else f"{count} more {many} have"
