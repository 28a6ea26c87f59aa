"""From a file's content to an experiment: section by section, so that one fault does not hide another."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

from vibsim.core.errors import nearest
from vibsim.experiment.data import AnyExperiment, ModelSpec, SchemeSpec, Sweep, TimeSpec
from vibsim.experiment.faults import Report
from vibsim.experiment.partial_validation import sections
from vibsim.experiment.rules import jumps, size_limits, tables
from vibsim.experiment.rules import schemes as scheme_rules
from vibsim.experiment.rules.check_places import Ladder, kinds_of
from vibsim.experiment.rules.checks import finish_checks
from vibsim.experiment.rules.model import Equation
from vibsim.experiment.rules.model import equation as read_equation
from vibsim.experiment.rules.published import check_published
from vibsim.experiment.rules.timing import time_spec
from vibsim.experiment.schema.checks import ConvergesCheck
from vibsim.experiment.schema.document import Every, LevelRange
from vibsim.experiment.schema.published import claims
from vibsim.experiment.schema.scheme_section import scheme_names
from vibsim.experiment.sweep import build as sweep
from vibsim.experiment.sweep.keys import Keys, targets
from vibsim.experiment.units.scaling import Numbers, characteristic
from vibsim.experiment.yaml.parse import Source
from vibsim.models import MODELS, Model, quantities

SAME_START = 1e-12
"""A state that is given and follows from the parameters agrees to this part of the largest one."""


@dataclass(frozen=True)
class Place:
    """Names of an experiment and where it was read."""

    collection: str
    name: str
    file: Path | None = None


def build(kind: type[AnyExperiment], source: Source, place: Place, report: Report) -> AnyExperiment:
    """Validate the content of a file and fill in every default; `kind` is the class of what is built.

    Raises
    ------
    InputError
        With every fault of the file, and those already in `report`.
    """
    part = sections(source, report)
    swept = frozenset(_keys(source.data.get("sweep")))
    folder = place.file.parent if place.file else Path()
    of_kind = _model(source)
    equation = read_equation(part.model, of_kind, swept, folder, report)
    model, parameters = equation.model, equation.parameters
    levels = _levels(part, source, report)
    schemes = scheme_rules.finish_schemes(part.schemes, model, report)
    time = time_spec(part.time, model, parameters, report) if part.time else None
    initial = _initial(part, model or of_kind, parameters, report)
    varied = _swept(part, source, model, schemes, report)
    if time is not None and varied.is_whole:
        _check_members(equation, time, varied, report)
    numbers = Numbers(parameters, initial, time)
    if part.scaled:
        numbers = characteristic(numbers, model, sorted(swept), report)
        time = numbers.time
    samples = part.samples.every if isinstance(part.samples, Every) else part.samples
    shape = size_limits.Shape(
        base_steps=time.base_steps if time else None,
        levels=levels,
        schemes=max(len(schemes), len(part.schemes)),
        members=varied.members,
        samples=samples,
        variables=len(quantities(model)) if model else 0,
        end=varied.least_end(time) if time else None,
        own_velocity=(model is None or model.events is None)
        and any(scheme.own_velocity for scheme in schemes),
    )
    size_limits.check(shape, report)
    _check_output(part.output, levels, report)
    _check_extrapolated(part, model, report)
    ladder = _ladder(part, source, model, schemes, shape, time, varied)
    checks = _checks(part, model, ladder, report)
    check_published(part.published, _ids(part), ladder, report)
    report.raise_any()
    assert model is not None
    assert time is not None
    experiment = kind(
        collection=place.collection,
        name=place.name,
        title=part.title,
        source=part.source,
        model=ModelSpec(
            kind=model.kind,
            parameters=dict(numbers.parameters),
            formulas=equation.formulas,
            tables=equation.tables,
            terms=equation.terms,
        ),
        initial=dict(numbers.initial),
        time=time,
        levels=levels,
        schemes=tuple(schemes),
        sweep=Sweep(axes=varied.axes) if varied.axes else None,
        samples=samples,
        output=part.output,
        tolerance=part.tolerance,
        checks=(*checks, *claims(part.published, part.source)),
        published=part.published,
        units=part.units,
        scaling=numbers.scaling,
    )
    experiment._file = place.file
    size_limits.check_files(experiment, report)
    report.raise_any()
    return tables.update_tables(experiment)


def _check_members(
    equation: Equation, time: TimeSpec, varied: sweep.SweepAxes, report: Report
) -> None:
    """Check what must hold for every member: tables are long enough, and what is differentiated has no jumps."""
    if equation.model is None or not equation.parameters:
        return
    members = tables.MemberNumbers(equation.model, equation.parameters, time, varied.axes, 0)
    for name in equation.tables:
        tables.check_length(members, name, report)
    jumps.check_jumps(members, equation.formulas, report)


def _model(source: Source) -> Model | None:
    """Return the model; a model section with a fault elsewhere still names it."""
    section = source.data.get("model")
    kind = section.get("kind") if isinstance(section, Mapping) else None
    return MODELS.get(kind) if isinstance(kind, str) else None


def _keys(section: Any) -> Iterator[str]:
    """Yield every key of a section, those inside of it too."""
    if isinstance(section, Mapping):
        for key, value in section.items():
            yield str(key)
            yield from _keys(value)


def _initial(
    part: Any, model: Model | None, parameters: Mapping[str, float], report: Report
) -> dict[str, float]:
    if model is None:
        return {}
    states = [state.name for state in model.states]
    start = model.start(parameters) if model.start and parameters else {}
    for name in part.initial or ():
        if name not in states:
            report.add(("initial", name), "unknown state", nearest(name, states), at_key=True)
    found = {name: (part.initial or {}).get(name, 0.0) for name in states}
    for state in model.states:
        if state.minimum is not None and found[state.name] < state.minimum:
            rule = f"must be at least {state.minimum:g}"
            report.add(("initial", state.name), rule, value=found[state.name])
    size = max(map(abs, start.values()), default=0.0)
    for name, value in start.items():
        if name in (part.initial or {}) and not math.isclose(
            found[name], value, rel_tol=SAME_START, abs_tol=SAME_START * size
        ):
            rule = f"must be {value:.15g}, where the motion starts, or be left out"
            report.add(("initial", name), rule)
        found[name] = float(value)
    return found


def _levels(part: Any, source: Source, report: Report) -> tuple[int, ...]:
    """Return the levels; none where the section is missing or faulty, or a tolerance stands for it."""
    given = [key for key in ("levels", "tolerance") if source.data.get(key) is not None]
    if not given:
        report.add(("levels",), "required key is missing", "or tolerance")
    elif len(given) > 1:
        report.add(("tolerance",), "must not be given together with levels", at_key=True)
    section = part.levels
    if isinstance(section, LevelRange):
        if section.from_ > section.to:
            report.add(("levels", "to"), f"must be at least 'from', which is {section.from_}")
        return tuple(range(section.from_, section.to + 1))
    levels: tuple[int, ...] = section or ()
    good = True
    for i, (low, high) in enumerate(pairwise(levels)):
        if low >= high:
            word = "must not be repeated" if low == high else "must be in increasing order"
            report.add(("levels", i + 1), f"levels {word}", value=high)
            good = False
    return levels if good else ()


def _swept(
    part: Any,
    source: Source,
    model: Model | None,
    schemes: list[SchemeSpec],
    report: Report,
) -> sweep.SweepAxes:
    """Return the sweep; not whole where something of it is malformed and was left out."""
    is_whole = not any(path[:1] == ("sweep",) for path in report.faulty)
    if part.sweep is None:
        return sweep.SweepAxes(is_whole=is_whole)
    lacks_scheme = not scheme_rules.are_known(part.schemes)
    keys = Keys(targets(model, schemes), model, part.time, lacks_scheme, report)
    found = sweep.read(part.sweep, list(source.data["sweep"]), keys)
    if is_whole and found.is_whole and not found.axes:
        report.add(("sweep",), "must not be empty")
    return found if is_whole else replace(found, is_whole=False)


def _check_output(output: str, levels: tuple[int, ...], report: Report) -> None:
    if output == "best" and len(levels) == 1:
        rule = "the best solution is extrapolated over at least 2 levels, there is 1"
        report.add(("output",), rule)


def _ladder(
    part: Any,
    source: Source,
    model: Model | None,
    schemes: list[SchemeSpec],
    shape: size_limits.Shape,
    time: TimeSpec | None,
    varied: sweep.SweepAxes,
) -> Ladder:
    """Return what checks may name."""
    named = {"schemes": tuple(dict.fromkeys(scheme_names(source.data.get("schemes"))))}
    return Ladder(
        model=model,
        shape=shape,
        # a faulty sweep may change the end: then nothing is said about times
        time=time if varied.is_whole else None,
        end=varied.fixed_end(time) if time else None,
        by_tolerance=source.data.get("tolerance") is not None,
        is_whole=scheme_rules.are_known(part.schemes),
        **{**kinds_of(schemes), **named},
    )


def _checks(part: Any, model: Model | None, ladder: Ladder, report: Report) -> tuple[Any, ...]:
    checks = list(part.checks)
    if not checks and not part.published and model is not None:
        checks = [ConvergesCheck(converges=name) for name in model.positions]
    return finish_checks(checks, ladder, report)


def _check_extrapolated(part: Any, model: Model | None, report: Report) -> None:
    """Refuse to extrapolate the whole motion of several coordinates."""
    if model is None or model.coordinates == 1:
        return
    rule = f"extrapolates a motion of one coordinate, {model.kind} has {model.coordinates}"
    if part.tolerance is not None:
        report.add(("tolerance",), rule, "give levels", part.tolerance)
    if part.output == "best":
        report.add(("output",), rule, "choose from verdict", part.output)


def _ids(part: Any) -> list[str]:
    """Return the ids that the file gives its checks; empty for those without."""
    return [check.id if check is not None else "" for check in part.checks]
