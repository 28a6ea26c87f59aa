"""Verdicts on synthetic ladders, through the public way in: datasets of levels, `analyse`, `verdicts`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray
from synthetic import END, Group, Ladder

import vibsim

ORDERS = (0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0)
"""Every ladder is judged by each of these expectations."""

EXPERIMENT = """
title: synthetic ladders
model: {{kind: spring, w: 1.0}}
initial: {{u: 1.0}}
time: {{end: {end}}}
levels: {levels}
schemes: [{{kind: central, arithmetic: {arithmetic}}}]
sweep: {{initial.v: {{linspace: [0.0, 1e-12, {count}]}}}}
checks:
{checks}
"""


@dataclass(frozen=True)
class Finding:
    """One ladder judged by one expectation."""

    ladder: Ladder
    group: Group
    formal: float
    status: str
    reason: str
    order: float
    low: float
    high: float
    levels: tuple[int, int] | None


def experiment_of(group: Group, folder: Path, orders: tuple[float, ...]) -> vibsim.Experiment:
    """Return an experiment whose members are the ladders of a group."""
    text = EXPERIMENT.format(
        end=END,
        levels=list(group.levels),
        arithmetic=group.arithmetic,
        count=len(group.ladders),
        checks="\n".join(f"  - {{converges: u, order: {p}}}" for p in orders),
    )
    path = folder / "synthetic.yaml"
    path.write_text(text)
    return vibsim.Experiment.from_yaml(path)


def datasets_of(group: Group) -> list[xarray.Dataset]:
    """Return what an outside program would make of its own results: states, and the numbers of a level."""
    t = np.linspace(0.0, END, group.points + 1)
    count = len(group.ladders)
    exact = {"u": np.cos(t), "v": -np.sin(t)}
    member: dict[str, Any] = {
        "case": np.arange(count),
        "initial_v": ("case", np.linspace(0.0, 1e-12, count), {"sweep_key": "initial.v"}),
    }
    rows = []
    for i, level in enumerate(group.levels):
        errors = np.stack([ladder.errors[i] for ladder in group.ladders])
        series = ("scheme", "case", "t")
        data: dict[str, Any] = {
            "u": (series, (exact["u"] - errors)[None]),
            "v": (series, np.broadcast_to(exact["v"], errors.shape)[None]),
            "omega_dt": ("case", np.full(count, END * 2.0**-level)),
            "natural_frequency": ("case", np.ones(count)),
        }
        if group.known:
            data |= {
                f"{k}_exact": (("case", "t"), np.broadcast_to(x, errors.shape))
                for k, x in exact.items()
            }
        single = {"u_min": -1.0, "u_max": 1.0, "energy_initial": 0.5, "period": np.nan}
        single |= {"first_peak": np.nan, "last_peak": np.nan}
        counts = {"status": 0, "period_count": 0}
        for name, value in (single | counts).items():
            data[name] = (("scheme", "case"), np.full((1, count), value))
        coords = {"scheme": ["central"], "t": t, **member}
        attrs = {"model": "spring", "level": level, "steps": 2**level, "storage": "series"}
        attrs["every"] = 2**level // group.points
        rows.append(xarray.Dataset(data, coords, attrs))
    return rows


def findings(group: Group, folder: Path, orders: tuple[float, ...] = ORDERS) -> list[Finding]:
    """Judge every ladder of a group by every expectation."""
    experiment = experiment_of(group, folder, orders)
    convergence = vibsim.analyse(experiment, datasets_of(group))
    found = []
    for formal, verdict in zip(orders, vibsim.verdicts(experiment, convergence), strict=True):
        for r in verdict.results:
            low, high = r.interval or (np.nan, np.nan)
            order = np.nan if r.order is None else r.order
            ladder = group.ladders[r.case]
            found.append(
                Finding(ladder, group, formal, r.status, r.reason, order, low, high, r.levels)
            )
    return found
