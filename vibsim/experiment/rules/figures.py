"""Rules for figures of a source: they refer to quantities and members that the experiment has."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from vibsim.core.errors import nearest
from vibsim.experiment.faults import Report
from vibsim.experiment.rules.check_places import Scope
from vibsim.experiment.rules.setting import Setting
from vibsim.experiment.schema.figures import LEVEL, MEMBER, OVER_TIME
from vibsim.formula import ExpressionError, parse
from vibsim.models import quantities
from vibsim.models.base import parameter_names


def check_figures(figures: Sequence[Any], setting: Setting, report: Report) -> None:
    """Report every fault of the figures; None stands for a malformed one."""
    for i, figure in enumerate(figures):
        if figure is not None:
            _figure(figure, Scope(("figures", i), setting, report))


def _figure(figure: Any, scope: Scope) -> None:
    time = scope.setting.time
    if figure.shows == "poincare" and time is not None and time.frequency is None:
        rule = "shows the state after every period of a force, but time names no frequency"
        scope.at("shows").refuse(rule, "give time as periods, steps_per_period and frequency")
    if figure.shows not in (None, "over_time"):
        for key in OVER_TIME:
            if getattr(figure, key):
                scope.at(key).refuse("belongs to `shows: over_time`", at_key=True)
        return
    if len(figure.quantities) > 1 and figure.panels is not None:
        rule = "must be left out where several quantities have panels"
        scope.at("panels").refuse(rule, at_key=True)
    model = scope.setting.model
    if model is not None:
        known = quantities(model, own_velocity=True)
        for i, name in enumerate(figure.quantities):
            if name not in known:
                scope.at("quantities", i).refuse("unknown quantity", nearest(name, known), name)
        for name, formula in figure.beside.items():
            try:
                parse(formula, ("t", *parameter_names(model)))
            except ExpressionError as error:
                scope.at("beside", name).refuse(error.rule, error.hint, formula)
    if scope.setting.knows_sweep:
        members = (MEMBER, *scope.setting.sweep.keys) if scope.setting.sweep.keys else ()
        for key, choices in (("panels", (LEVEL, *members)), ("each", members)):
            value = getattr(figure, key)
            if value is not None and value not in choices:
                there = nearest(value, choices) if choices else "there is no sweep"
                scope.at(key).refuse("unknown part of the experiment", there, value)
