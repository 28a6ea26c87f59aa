"""Experiments of the pendulum, simulated and analysed in memory, for the report to show."""

from __future__ import annotations

import json
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest

from vibsim import experiment as spec
from vibsim.analysis import analyse_records, compare_levels, summarise, verdicts
from vibsim.comparison import best_values
from vibsim.core.record import Record
from vibsim.experiment import canonical, storage
from vibsim.report import choice, style
from vibsim.report.data import Results
from vibsim.report.figures import drawing, gallery
from vibsim.simulation import simulate_record

CENTRAL = ["central"]
TRAP = [*CENTRAL, {"kind": "central", "label": "trap", "start": "first_order"}]


def experiment(*, name: str = "theta", collection: str = "pendulum_lab", **changes: Any) -> Any:
    content = {
        "title": "Nonlinear pendulum on several levels",
        "source": "pendulum lecture, section 2.5",
        "model": {"kind": "pendulum"},
        "initial": {"theta": 1.0},
        "time": {"end": 20.0},
        "levels": [6, 7, 8, 9],
        "schemes": CENTRAL,
    }
    return spec.Experiment.from_dict(content | changes, name=name, collection=collection)


RECORDS: dict[str, Record] = {}
"""What was found of experiments: many tests look at the same ones. No test can change the arrays."""
SHARED: dict[str, Any] = {}
"""Levels, and tables of the analysis, of experiments but for their checks, which change none of them."""


def record(exp: Any) -> Any:
    """Return what the analysis finds of an experiment, in tables of its own."""
    content = canonical(exp)
    key = json.dumps([exp.collection, exp.name, content, storage.LEAN])
    if key not in RECORDS:
        asked = {name: content.pop(name) for name in ("checks", "title", "source")}
        stored = [storage.stored_series(exp), storage.event_times(exp), storage.asks_for_peaks(exp)]
        alike = json.dumps([content, stored, storage.LEAN, asked if storage.LEAN == 0 else None])

        def once(name: str, make: Callable[..., Any]) -> Callable[..., Any]:
            def known(*arguments: Any) -> Any:
                if alike + name not in SHARED:
                    SHARED[alike + name] = make(*arguments)
                return SHARED[alike + name]

            return known

        levels = {
            level: once(f"level {level}", simulate_record)(exp, level) for level in exp.levels
        }
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(best_values, "table", once("numbers", best_values.table))
            if not exp.published:  # whose rows are checks
                patch.setattr(compare_levels, "motion", once("motion", compare_levels.motion))
            made = analyse_records(exp, levels)
        for variable in (*made.coords.values(), *made.variables.values()):
            variable.values.flags.writeable = False
        RECORDS[key] = made
    found = RECORDS[key]
    return Results.of(exp, Record(dict(found.coords), dict(found.variables), dict(found.attrs)))


def summary(exp: Any, rec: Any, **changes: Any) -> dict[str, Any]:
    return summarise(exp, verdicts(exp, rec), rec) | changes


def plan(exp: Any) -> Any:
    return SimpleNamespace(experiment=exp)


def views(exp: Any, rec: Any, *quantities: str) -> tuple[dict[str, Any], list[str]]:
    """Return the views over members by the names of their files, and what all members share in words."""
    decisive = choice.find_lead(rec, {"checks": []})
    with style.applied():
        found, told = gallery.over_members(list(quantities), decisive)
    return {view.picture.name: view for view in found}, told


def svg(picture: Any) -> str:
    return drawing.svg(picture.figure, picture.name)


def element(picture: Any) -> str:
    with style.applied():
        return drawing.element(picture)


def plain(**changes: Any) -> Any:
    return experiment(**changes)


def several(**changes: Any) -> Any:
    return experiment(schemes=TRAP, levels=[6, 7, 8, 9, 10], **changes)


def swept(count: int = 16, **changes: Any) -> Any:
    sweep = {"initial.theta": {"linspace": [0.1, 3.1, count]}}
    return experiment(**({"sweep": sweep, "levels": [7, 8, 9, 10]} | changes))
