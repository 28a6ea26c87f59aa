"""Which figures a report shows, the decisive ones first."""

from __future__ import annotations

from typing import TYPE_CHECKING

from vibsim.analysis.assemble import asked
from vibsim.record import Record
from vibsim.report import (
    contents,
    data,
    figures_grid,
    figures_order,
    figures_solution,
    figures_sweep,
    figures_time,
)
from vibsim.report.data import Member
from vibsim.report.style import Picture
from vibsim.vocabulary import SEVERITY

if TYPE_CHECKING:
    from vibsim.spec import Experiment

SHOWN = 6
"""Most schemes and members that get figures of their own; the tables have all of them."""


def pictures(experiment: Experiment, record: Record, shown: list[Member]) -> list[Picture]:
    """Return the figures of a report in the order of the page."""
    found = data.quantities(experiment, record)
    levels = bool(data.whole(record, "pair"))
    over = [p for quantity in found for p in _over_members(experiment, record, quantity)]
    cases = sorted({member.case for member in shown})
    drawn = list(over)
    for quantity in found:
        drawn += _of_quantity(experiment, record, quantity, shown, levels)
        drawn += [
            figures_order.against_step(experiment, record, quantity, case)
            for case in cases
            if levels
        ]
    drawn += [
        figures_solution.solution(record, data.position(experiment), member) for member in shown
    ]
    return drawn


def _over_members(experiment: Experiment, record: Record, quantity: str) -> list[Picture]:
    if not data.swept(record):
        return []
    first = figures_sweep.period(record) if quantity == data.position(experiment) else None
    order = (
        figures_sweep.orders(experiment, record, quantity) if data.whole(record, "triple") else None
    )
    return [p for p in (first, order, figures_grid.grid(record, quantity)) if p is not None]


def _of_quantity(
    experiment: Experiment, record: Record, quantity: str, shown: list[Member], levels: bool
) -> list[Picture]:
    conserved = quantity == "energy_deviation" and "energy_deviation_scaled" in record
    drawn = [figures_time.energy(record, member) for member in shown] if conserved else []
    if levels and (not conserved or quantity in asked(experiment)):
        drawn += [figures_time.overlay(record, quantity, member) for member in shown]
    return drawn


def choose(experiment: Experiment, record: Record) -> tuple[list[Member], str]:
    """Return what gets figures of its own, and a sentence saying what was left out."""
    quantity = data.quantities(experiment, record)[0]
    everyone = data.members(record, quantity)
    status = data.flags(record, f"{quantity}_status")
    severity = [SEVERITY[status[m.scheme, m.case]] for m in everyone]
    ranked = sorted(range(len(everyone)), key=lambda i: (-severity[i], i))[:SHOWN]
    shown = [everyone[i] for i in sorted(ranked)]
    parts = []
    if data.swept(record):
        parts.append("The worst and a typical member are shown over time, for every scheme.")
    if len(everyone) > SHOWN:
        parts.append(
            f"{len(everyone) - SHOWN} more have no figures over time; the tables hold their numbers."
        )
    if len(record["case"]) > contents.LISTED:
        parts.append(
            "The members are too many to be listed one by one: `convergence.nc` holds their numbers."
        )
    return shown, " ".join(parts)
