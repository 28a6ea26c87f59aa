"""The time section: from the four ways of writing it to an end and a number of steps."""

from __future__ import annotations

import math
from collections.abc import Mapping

from vibsim.experiment.data import TimeSpec
from vibsim.experiment.faults import Report
from vibsim.experiment.schema.document import TimeSection
from vibsim.models import Model, natural_end

WHOLE = 1e-12
"""How far, relative to it, a number may be from a whole number that is meant."""


def time_spec(
    section: TimeSection | None,
    model: Model | None,
    parameters: Mapping[str, float],
    report: Report,
) -> TimeSpec | None:
    """Return the end and the steps at level 0; None where they cannot be told."""
    if section is None:
        return None
    given = [name for name in TimeSection.model_fields if getattr(section, name) is not None]
    if "end" in given:
        return _by_end(section, given, report)
    if "periods" in given or "steps_per_period" in given:
        return _by_periods(section, given, model, parameters, report)
    report.add(("time", "end"), "required key is missing", "or periods and steps_per_period")
    return None


def _by_end(section: TimeSection, given: list[str], report: Report) -> TimeSpec | None:
    for name in ("periods", "steps_per_period"):
        if name in given:
            report.add(("time", name), "must not be given together with end", at_key=True)
    if "base_steps" in given and "base_dt" in given:
        report.add(("time", "base_dt"), "must not be given together with base_steps", at_key=True)
        return None
    assert section.end is not None
    steps = section.base_steps or 1
    if section.base_dt is not None:
        found = whole(section.end / section.base_dt)
        if found is None:
            ratio = f"end/base_dt is {section.end / section.base_dt:.15g}"
            report.add(("time", "base_dt"), "end must be a whole number of base_dt", ratio)
            return None
        steps = found
    return TimeSpec(end=section.end, base_steps=steps)


def _by_periods(
    section: TimeSection,
    given: list[str],
    model: Model | None,
    parameters: Mapping[str, float],
    report: Report,
) -> TimeSpec | None:
    for name in ("base_steps", "base_dt"):
        if name in given:
            report.add(("time", name), "must not be given together with periods", at_key=True)
    for name in ("periods", "steps_per_period"):
        if name not in given:
            report.add(("time", name), "required key is missing", "periods and steps_per_period")
    if section.periods is None or section.steps_per_period is None:
        return None
    product = section.periods * section.steps_per_period
    steps = whole(product)
    if steps is None:
        rule = "periods*steps_per_period must be a whole number"
        report.add(("time", "steps_per_period"), rule, f"it is {product:.15g}")
        return None
    if model is None or not parameters:
        return None
    end = float(natural_end(model, section.periods, parameters))
    if not (math.isfinite(end) and end > 0.0):
        report.add(("time", "periods"), "the model has no natural period with these parameters")
        return None
    return TimeSpec(end=end, base_steps=steps, periods=section.periods)


def whole(value: float) -> int | None:
    """Return the whole number, at least 1, that `value` is to `WHOLE`; None where there is none."""
    if not math.isfinite(value):
        return None
    nearest = round(value)
    return nearest if nearest >= 1 and abs(value - nearest) <= WHOLE * nearest else None
