"""Read the sections ``time`` and ``levels``: an end, a number of steps, and increasing levels."""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import pairwise

from vibsim.core.errors import listed, nearest
from vibsim.experiment.data import TimeSpec
from vibsim.experiment.faults import MISSING, Report
from vibsim.experiment.rules.members import SLACK
from vibsim.experiment.schema.document import LevelRange, TimeSection
from vibsim.experiment.yaml.parse import Path_
from vibsim.models import Model, natural_end, table_end

ANGULAR = ("rad s-1", "1")
"""Units of an angular frequency; 1 for parameters that the user declares and for dimensionless models."""
WHOLE_NUMBER = 1e-12  # relative tolerance within which a number counts as a whole number


def time_spec(
    section: TimeSection | None,
    model: Model | None,
    parameters: Mapping[str, float],
    report: Report,
) -> TimeSpec | None:
    """Return the end and the steps at level 0; None if they cannot be determined.

    `model` is None unless all its `parameters` have values.
    """
    if section is None:
        return None
    keys = {name for name in TimeSection.model_fields if getattr(section, name) is not None}
    by_periods = ("periods", "steps_per_period")
    if section.frequency is not None and not set(by_periods) <= keys:
        rule = "says whose periods are counted, and belongs to periods and steps_per_period"
        report.add(("time", "frequency"), rule, at_key=True)
        return None
    if section.steps_per_point is not None:
        rule = "must not be given together with steps_per_point"
        _refuse(keys - {"steps_per_point"}, rule, report)
        return _by_table(section.steps_per_point, model, parameters, report)
    if section.end is not None:
        _refuse(keys & set(by_periods), "must not be given together with end", report)
        if {"base_steps", "base_dt"} <= keys:
            _refuse({"base_dt"}, "must not be given together with base_steps", report)
            return None
        steps: int | None = section.base_steps or 1
        if section.base_dt is not None:
            ratio = section.end / section.base_dt
            steps = _whole(ratio)
            if steps is None:
                hint = f"end/base_dt is {ratio:.15g}"
                report.add(("time", "base_dt"), "end must be a whole number of base_dt", hint)
        return None if steps is None else TimeSpec(end=section.end, base_steps=steps)
    if not keys & set(by_periods):
        report.add(("time", "end"), MISSING, "or periods and steps_per_period")
        return None
    _refuse(keys & {"base_steps", "base_dt"}, "must not be given together with periods", report)
    for name in by_periods:
        if name not in keys:
            report.add(("time", name), MISSING, "periods and steps_per_period")
    if section.periods is None or section.steps_per_period is None:
        return None
    product = section.periods * section.steps_per_period
    steps = _whole(product)
    if steps is None:
        rule = "periods*steps_per_period must be a whole number"
        report.add(("time", "steps_per_period"), rule, f"it is {product:.15g}")
    if steps is None or model is None:
        return None
    if section.frequency is not None:
        return _by_force(section, steps, model, parameters, report)
    end = float(natural_end(model, section.periods, parameters))
    if not (math.isfinite(end) and end > 0.0):
        report.add(("time", "periods"), "the model has no natural period with these parameters")
        return None
    return TimeSpec(end=end, base_steps=steps, periods=section.periods)


def _by_force(
    section: TimeSection, steps: int, model: Model, parameters: Mapping[str, float], report: Report
) -> TimeSpec | None:
    """Return the time of whole periods of a forcing frequency, with whole steps in each period."""
    assert section.periods is not None
    assert section.steps_per_period is not None
    for name in ("periods", "steps_per_period"):
        value = getattr(section, name)
        if value % 1.0:
            rule = "must be a whole number where frequency is given"
            report.add(("time", name), rule, value=value)
            return None
    key = str(section.frequency).removeprefix("model.")
    units = {row.key: row.unit for row in model.parameters}
    frequencies = [name for name in parameters if units.get(name) == ANGULAR[0]]
    frequencies = frequencies or [name for name in parameters if units.get(name) in ANGULAR]
    known = [f"model.{name}" for name in frequencies]
    if f"model.{key}" != section.frequency or key not in parameters:
        rule = "must be a parameter of the model"
        report.add(("time", "frequency"), rule, nearest(str(section.frequency), known))
        return None
    if units[key] not in ANGULAR:
        rule = f"must be an angular frequency (rad s-1), but {key} is in {units[key]}"
        report.add(("time", "frequency"), rule, listed(known) if known else "")
        return None
    if not (math.isfinite(parameters[key]) and parameters[key] > 0.0):
        rule = "must be an angular frequency greater than 0"
        report.add(("time", "frequency"), rule, f"it is {parameters[key]:g}")
        return None
    end = section.periods * (2.0 * math.pi / parameters[key])
    return TimeSpec(end=end, base_steps=steps, periods=section.periods, frequency=key)


def _by_table(
    steps: int, model: Model | None, parameters: Mapping[str, float], report: Report
) -> TimeSpec | None:
    """Return the time from abscissa 0 to the end of the table, with `steps` steps per spacing."""
    if model is None:
        return None
    if model.lookup is None:
        rule = "needs a model with a table, such as a vehicle whose road is one"
        report.add(("time", "steps_per_point"), rule, "give end", at_key=True)
        return None
    table = model.lookup.table
    spacings = round(table.spacings_ahead)
    if spacings < 1 or abs(table.spacings_ahead - spacings) > SLACK:
        rule = "needs a table with a point at 0, where motions begin, and points behind it"
        hint = f"its points begin at {table.first:.10g} and are {table.spacing:.10g} apart"
        report.add(("time", "steps_per_point"), rule, hint)
        return None
    end = float(table_end(model, parameters))
    if not (math.isfinite(end) and end > 0.0):
        rule = "the vehicle never reaches the end of the table with these parameters"
        report.add(("time", "steps_per_point"), rule)
        return None
    return TimeSpec(end=end, base_steps=spacings * steps, steps_per_point=steps)


def _refuse(names: set[str], rule: str, report: Report) -> None:
    for name in names:
        report.add(("time", name), rule, at_key=True)


def _whole(value: float) -> int | None:
    """Return the whole number >= 1 that `value` equals within `WHOLE_NUMBER`; None if there is none."""
    if not math.isfinite(value):
        return None
    nearest = round(value)
    return nearest if nearest >= 1 and abs(value - nearest) <= WHOLE_NUMBER * nearest else None


def rising_levels(
    section: LevelRange | tuple[int, ...] | None, report: Report, path: Path_ = ("levels",)
) -> tuple[int, ...]:
    """Return the levels of the section at `path`; empty if it is missing or faulty."""
    if isinstance(section, LevelRange):
        if section.from_ > section.to and report.is_set((*path, "from")):
            report.add((*path, "from"), f"must be at most 'to', which is {section.to}")
        elif section.from_ > section.to:
            report.add((*path, "to"), f"must be at least 'from', which is {section.from_}")
        return tuple(range(section.from_, section.to + 1))
    levels = section or ()
    falling = [i for i, (low, high) in enumerate(pairwise(levels), 1) if low >= high]
    is_reversed = list(levels) == sorted(set(levels), reverse=True)
    for i in falling[:1] if is_reversed else falling:
        is_same = levels[i] == levels[i - 1]
        word = "must not be repeated" if is_same else "must be in increasing order"
        hint = f"write {sorted(levels)}: a higher level has smaller steps" if is_reversed else ""
        is_earlier = report.is_set((*path, i - 1)) and not report.is_set((*path, i))
        if is_earlier:
            hint = hint or f"the next one is {levels[i]}"
        faulty = i - 1 if is_earlier else i
        report.add((*path, faulty), f"levels {word}", hint, levels[faulty])
    return () if falling else levels
