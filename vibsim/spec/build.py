"""From a file's content to an `Experiment`: section by section, so that one fault does not hide another."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from vibsim.errors import nearest
from vibsim.models import MODELS, Model, quantities
from vibsim.schemes import FIXED_STEP, SCHEMES
from vibsim.schemes.base import EVENTS, VECTOR
from vibsim.spec import jump_rules, limits, model_rules, sweep, table_rules
from vibsim.spec.check_places import Ladder, kinds_of
from vibsim.spec.check_rules import finish_checks
from vibsim.spec.checks import ConvergesCheck
from vibsim.spec.document import Document, Every, LevelRange, Partial
from vibsim.spec.experiment import Experiment, ModelSpec, SchemeSpec, Sweep, TimeSpec
from vibsim.spec.faults import Report, plain_path
from vibsim.spec.mending import as_written, without
from vibsim.spec.published import claims
from vibsim.spec.published_rules import finish_published
from vibsim.spec.scaling import Numbers, scaled
from vibsim.spec.scheme_checks import SOLUTIONS
from vibsim.spec.scheme_section import TOLERANCE, scheme_names, specs
from vibsim.spec.source import Path_, Source
from vibsim.spec.sweep_keys import Keys, targets
from vibsim.spec.timing import time_spec
from vibsim.spec.units import plain_numbers

_LISTS = ("schemes", "checks", "published")
_OPTIONAL = [name for name, field in Document.model_fields.items() if not field.is_required()]


@dataclass(frozen=True)
class Place:
    """Names of an experiment and where it was read."""

    collection: str
    name: str
    file: Path | None = None


def build(source: Source, place: Place, report: Report) -> Experiment:
    """Validate the content of a file and fill in every default.

    Raises
    ------
    InputError
        With every fault of the file, and those already in `report`.
    """
    part = _sections(source, report)
    swept = frozenset(_keys(source.data.get("sweep")))
    folder = place.file.parent if place.file else Path()
    read = model_rules.read(part.model, _model(source), swept, folder, report)
    model, parameters = read.model, read.parameters
    levels = _levels(part, source, report)
    schemes = _schemes(part, model, report)
    time = time_spec(part.time, model, parameters, report) if part.time else None
    initial = _initial(part, model, parameters, report)
    varied = _swept(part, source, model, schemes, report)
    if time is not None and varied.is_whole:
        _check_tables(read, time, varied, report)
        _check_jumps(read, time, varied, report)
    numbers = Numbers(parameters, initial, time)
    if part.scaled:
        numbers = scaled(numbers, model, sorted(swept), report)
        time = numbers.time
    samples = part.samples.every if isinstance(part.samples, Every) else part.samples
    shape = limits.Shape(
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
    limits.check(shape, report)
    _check_output(part.output, levels, report)
    _check_extrapolated(part, model, report)
    ladder = _ladder(part, source, model, schemes, shape, time, varied)
    checks = _checks(part, model, ladder, report)
    published = finish_published(part.published, _ids(part), ladder, report)
    report.raise_any()
    assert model is not None
    assert time is not None
    experiment = Experiment(
        collection=place.collection,
        name=place.name,
        title=part.title,
        source=part.source,
        model=ModelSpec(
            kind=model.kind,
            parameters=dict(numbers.parameters),
            formulas=read.formulas,
            tables=read.tables,
            terms=read.terms,
        ),
        initial=dict(numbers.initial),
        time=time,
        levels=levels,
        schemes=tuple(schemes),
        sweep=Sweep(axes=varied.axes) if varied.axes else None,
        samples=samples,
        output=part.output,
        tolerance=part.tolerance,
        checks=(*checks, *claims(published, part.source)),
        published=published,
        units=part.units,
        scaling=numbers.scaling,
    )
    experiment._file = place.file
    return table_rules.met_again(experiment)


def _check_tables(
    read: model_rules.Read, time: TimeSpec, varied: sweep.Swept, report: Report
) -> None:
    """Check that every table is long enough for every member."""
    if read.model is None or not read.tables or not read.parameters:
        return
    runs = table_rules.Runs(read.model, read.parameters, time, varied.axes, 0)
    for name in read.tables:
        table_rules.check_length(runs, name, report)


def _check_jumps(
    read: model_rules.Read, time: TimeSpec, varied: sweep.Swept, report: Report
) -> None:
    """Check that what the equation differentiates has no jumps."""
    if read.model is None or not read.parameters:
        return
    runs = table_rules.Runs(read.model, read.parameters, time, varied.axes, 0)
    jump_rules.check_jumps(runs, read.formulas, report)


def _sections(source: Source, report: Report) -> Any:
    """Return the sections without fault as a `Partial`; faulty schemes and checks are None in their lists."""
    whole, faulty = plain_numbers(as_written(source.data, source), report)
    data = {k: v for k, v in whole.items() if v is not None or k not in _OPTIONAL}
    try:
        Document.model_validate(data)
    except ValidationError as error:
        faulty += report.add_invalid(error)
    if not faulty:
        return Partial.model_validate(data)
    mended = without(data, faulty)
    try:
        return Partial.model_validate(mended)
    except ValidationError as error:
        # what cannot be read without its faulty values is left out whole
        rows = error.errors(include_url=False, include_input=False)
        places = [plain_path(row["loc"], keep_last=False) for row in rows]
    return Partial.model_validate(_without(mended, places))


def _without(data: Mapping[str, Any], faulty: list[Path_]) -> dict[str, Any]:
    whole = {path[0] for path in faulty if path[0] not in _LISTS or len(path) == 1}
    items = {path[:2] for path in faulty if len(path) > 1}
    kept: dict[str, Any] = {}
    for key, value in data.items():
        if key in whole:
            continue
        kept[key] = value
        if key in _LISTS:
            kept[key] = [None if (key, i) in items else item for i, item in enumerate(value)]
    return kept


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
    for name, value in start.items():
        if name in (part.initial or {}) and not math.isclose(
            found[name], value, rel_tol=1e-12, abs_tol=1e-12
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


def _schemes(part: Any, model: Model | None, report: Report) -> list[SchemeSpec]:
    found: list[SchemeSpec] = []
    first: dict[str, int] = {}
    for i, section in enumerate(part.schemes):
        if isinstance(section, str) and section not in SCHEMES:
            hint = nearest(section, sorted(SCHEMES))
            report.add(("schemes", i), "unknown scheme", hint, section)
        elif section is not None:
            several = specs(section, model)
            _check_events(section, i, model, report)
            found.extend(several)
            _check_forces(several[0], i, model, report)
            _check_names(several, i, first, report)
    if _all_known(part) and all(spec.adaptive for spec in found):
        rule = "at least one scheme must take equal steps, on the levels that are compared"
        report.add(("schemes",), rule, "choose from " + ", ".join(FIXED_STEP), at_key=True)
    return found


def _check_names(several: list[SchemeSpec], i: int, first: dict[str, int], report: Report) -> None:
    """Check the names of the schemes of entry number `i`; `first` holds where each name came first."""
    for j, spec in enumerate(several):
        if spec.name in SOLUTIONS:
            rule = f"'{spec.name}' is what checks compare a scheme with, and names none"
            report.add(("schemes", i, "label"), rule, value=spec.name)
        elif spec.name in [other.name for other in several[:j]]:
            report.add(("schemes", i, TOLERANCE, j), "a tolerance must not be repeated")
        elif first.setdefault(spec.name, i) != i:
            rule = f"two schemes are named '{spec.name}'"
            report.add(("schemes", i), rule, "give one of them a label")


def _check_forces(spec: SchemeSpec, i: int, model: Model | None, report: Report) -> None:
    """Refuse a scheme that cannot treat the forces of the model."""
    if model is None or SCHEMES[spec.kind].treats(model):
        return
    able = [kind for kind, scheme in SCHEMES.items() if scheme.treats(model)]
    if model.events is not None and SCHEMES[spec.kind].adaptive:
        rule = f"cannot treat {model.kind}: it takes its own steps across events, where the motion is not smooth"
        report.add(("schemes", i), rule, "choose from " + ", ".join(able), spec.kind)
        return
    rule = f"cannot treat {model.kind}, whose acceleration depends on {model.velocity}"
    damped = [kind for kind, _ in SCHEMES[spec.kind].damped if not kind.startswith(VECTOR)]
    if damped:
        rule += f" otherwise than by {' or '.join(damped)} damping"
    hint = "choose from " + ", ".join(able) if able else "no scheme can"
    report.add(("schemes", i), rule, hint, spec.kind)


def _check_events(section: Any, i: int, model: Model | None, report: Report) -> None:
    """Refuse a treatment of events where there are none."""
    given = None if isinstance(section, str) else getattr(section, EVENTS.name, None)
    is_known = model is not None and not any(f.key.split(".")[0] == "model" for f in report.faults)
    if given is None or model is None or not is_known or model.events is not None:
        return
    able = [kind for kind, other in MODELS.items() if other.events is not None]
    hint = f"models with events are {', '.join(able)}, and oscillator with damping: {{coulomb: c}}"
    rule = f"{model.kind} has no events here: its motion is smooth"
    report.add(("schemes", i, EVENTS.name), rule, hint, given)


def _swept(
    part: Any,
    source: Source,
    model: Model | None,
    schemes: list[SchemeSpec],
    report: Report,
) -> sweep.Swept:
    """Return the sweep; not whole where something of it is malformed and was left out."""
    is_whole = not any(path[:1] == ("sweep",) for path in report.faulty)
    if part.sweep is None:
        return sweep.Swept(is_whole=is_whole)
    lacks_scheme = not _all_known(part)
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
    shape: limits.Shape,
    time: TimeSpec | None,
    varied: sweep.Swept,
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
        is_whole=_all_known(part),
        **{**kinds_of(schemes), **named},
    )


def _all_known(part: Any) -> bool:
    """Tell whether nothing is wrong with any scheme."""
    known = (s is not None and (not isinstance(s, str) or s in SCHEMES) for s in part.schemes)
    return bool(part.schemes) and all(known)


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
