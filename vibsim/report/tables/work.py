"""What an error costs: steps, evaluations of the force and estimated time of every scheme, as points and as a table.

Source: E. Hairer, S. P. Norsett and G. Wanner, Solving Ordinary Differential Equations I, section II.10 (diagrams of
error against work); vibration text, exercise 4.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from vibsim.core.array_types import Floats
from vibsim.core.record import Record
from vibsim.experiment.cost import ONE_SECONDS
from vibsim.report import data
from vibsim.report.choice import position
from vibsim.report.data import Member, at, case_name, unit, whole
from vibsim.report.tables.table import Cell, Column, Table
from vibsim.report.text import words
from vibsim.report.types import Experiment


@dataclass(frozen=True)
class Line:
    """The points of one scheme over its levels, or of one adaptive method over its tolerances, coarse to fine."""

    name: str
    labels: tuple[str, ...]  # level or tolerance of every point
    work: tuple[Floats, Floats, Floats]  # steps, evaluations of the force, estimated seconds
    error: Floats
    is_adaptive: bool = False


def lines(experiment: Experiment, record: Record, case: int) -> list[Line]:
    """Return what is drawn of a member; empty where the analysis has no data of the kind."""
    if "work_error" not in record:
        return []
    found, families = [], dict[str, list[int]]()
    for s, spec in enumerate(experiment.schemes):
        if spec.adaptive:
            families.setdefault(spec.kind, []).append(s)
        else:
            found.append(_of_levels(experiment, record, s, case))
    found += [_of_tolerances(experiment, record, kind, s, case) for kind, s in families.items()]
    return [line for line in found if line.error.size]


def _of_levels(experiment: Experiment, record: Record, s: int, case: int) -> Line:
    member = Member(s, case, experiment.schemes[s].name)
    steps, forces, error = _numbers(record, member)
    keep = np.isfinite(error) & np.isfinite(steps)
    labels = tuple(f"level {level}" for level in np.array(whole(record, "level"))[keep])
    forces = forces[keep]
    return Line(
        member.scheme_name, labels, (steps[keep], forces, forces * ONE_SECONDS), error[keep]
    )


def _of_tolerances(
    experiment: Experiment, record: Record, kind: str, members: list[int], case: int
) -> Line:
    """Return the points of the schemes of one adaptive kind, from the loosest tolerance to the tightest."""
    from vibsim.schemes.adaptive import seconds

    w, ends = data.natural_frequency(record, case), data.ends_of(record)
    periods = w * float(ends[min(case, ends.size - 1)]) / (2.0 * math.pi)
    rows = []
    for s in members:
        tolerance = float(experiment.schemes[s].options["tolerance"])
        steps, forces, error = (part[-1] for part in _numbers(record, Member(s, case, "")))
        rows.append((-tolerance, steps, forces, seconds(kind, tolerance, periods), error))
    table = np.array(sorted(row for row in rows if np.isfinite(row).all())).reshape(-1, 5)
    labels = tuple(f"tolerance {-float(value):g}" for value in table[:, 0])
    return Line(kind, labels, (table[:, 1], table[:, 2], table[:, 3]), table[:, 4], True)


def _numbers(record: Record, member: Member) -> tuple[Floats, Floats, Floats]:
    names = "work_steps", "work_force_evaluations", "work_error"
    steps, forces, error = (at(record, name, member) for name in names)
    return steps, forces, error


def table(experiment: Experiment, record: Record) -> Table | None:
    """Return error and work of every scheme and level, or tolerance, of the first member; None without such data."""
    found = lines(experiment, record, 0)
    if len(found) < 2:
        return None
    columns = (
        Column("scheme"), Column("level or tolerance"), Column("steps", form="integer"),
        Column("force evaluations", form="integer"), Column("estimated time", "s", "small"),
        Column("largest error", unit(record, "work_error"), "small"),
    )  # fmt: skip
    rows: list[tuple[Cell, ...]] = [
        (line.name, label, *(float(part[i]) for part in line.work), float(line.error[i]))
        for line in found
        for i, label in enumerate(line.labels)
    ]
    name = case_name(record, 0)
    caption = (
        f"Work and precision of {words.symbol(position(experiment))}{f', {name}' if name else ''}"
        "; force evaluations of an implicit scheme are those of one iteration per step"
    )
    return Table("work_precision", caption, columns, tuple(rows))
