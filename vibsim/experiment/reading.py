"""Read an experiment from a file or from a mapping; all sections are read before any fault is raised."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from numbers import Integral, Real
from pathlib import Path
from typing import Any

from vibsim.core.errors import Fault, InputError, nearest
from vibsim.experiment.chain import write_out_chain
from vibsim.experiment.collection import collection_of
from vibsim.experiment.data import ExperimentSpec, Sweep, TimeSpec
from vibsim.experiment.faults import MISSING, Report, shorten
from vibsim.experiment.kinds import Kinds
from vibsim.experiment.repeat import write_out_repeats
from vibsim.experiment.rules import continuation, members, size_limits, timing, unlikely
from vibsim.experiment.rules import schemes as scheme_rules
from vibsim.experiment.rules.checks import finish_checks
from vibsim.experiment.rules.figures import check_figures
from vibsim.experiment.rules.model import Equation
from vibsim.experiment.rules.model import equation as read_equation
from vibsim.experiment.rules.potential import note_potential
from vibsim.experiment.rules.published import check_published
from vibsim.experiment.rules.scaling import Numbers, characteristic
from vibsim.experiment.rules.setting import Setting
from vibsim.experiment.rules.structure import check_histories
from vibsim.experiment.rules.sweep import read_sweep
from vibsim.experiment.rules.timing import rising_levels
from vibsim.experiment.schema.checks import Check, ConvergesCheck
from vibsim.experiment.schema.document import Document, Every
from vibsim.experiment.schema.fields import IDENTIFIER
from vibsim.experiment.schema.model_and_schemes import scheme_names
from vibsim.experiment.schema.published import claims
from vibsim.experiment.settings import with_settings
from vibsim.experiment.shorthand import write_usual_form
from vibsim.experiment.validation import read_document
from vibsim.experiment.yaml.parse import MAX_DEPTH, Source, read
from vibsim.models import MODELS, Model
from vibsim.models.structure import STRUCTURE
from vibsim.schemes import SCHEMES, Scheme

SOLVER = "solver"  # key that only the files of `vibsim.experiment.solver_reading` have
KEYS = (*Document.model_fields, SOLVER, "refine", "quantities")  # top-level keys of both kinds
MAX_NAME = 100
MAX_REPEATS = 20  # Snakemake takes a name with so many at its end for a rule that feeds itself
AS_WRITTEN = ("title", "source", "output", "tolerance", "published", "figures", "units")
"""Sections that are copied unchanged into the experiment."""
SAME_START = 1e-12
"""Tolerance, relative to the largest state, of a given initial state that also follows from the parameters."""

_PERIODIC = re.compile(rf"(.+)\1{{{MAX_REPEATS - 1}}}$")


def from_file(
    path: Path, collection: str | None, configs: Path | None, settings: Sequence[str]
) -> ExperimentSpec:
    """Read the experiment file at `path`; see `vibsim.experiment.Experiment.from_yaml`."""
    source = with_settings(read(path, list(Document.model_fields)), settings)
    if (place := source.place((SOLVER,))) is not None:
        rule = "belongs to an experiment with a solver of the user, which vibsim run makes"
        hint = "in Python, vibsim.judge compares levels"
        raise InputError([Fault(str(path), place.key_line, SOLVER, "", rule, hint)])
    return build(source, collection or collection_of(path, configs), path.stem, path)


def from_content(data: Mapping[str, Any], name: str, collection: str) -> ExperimentSpec:
    """Build an experiment from `data`; see `vibsim.experiment.Experiment.from_dict`."""
    if not isinstance(data, Mapping):
        raise InputError([Fault(name, 0, "", "", "must be a mapping of keys to values")])
    return build(Source(name, _plain(data, name)), collection, name)


def from_objects(data: Mapping[str, Any], name: str, collection: str) -> ExperimentSpec:
    """Build an experiment from a mapping that may contain model and scheme objects in place of their kinds."""
    objects: dict[type[Model | Scheme], list[Any]] = {Model: [], Scheme: []}

    def named(section: Any) -> Any:
        """Replace an object in a section by its kind, and record the object."""
        if isinstance(section, Mapping):
            return {**section, "kind": named(section.get("kind"))} if "kind" in section else section
        for type_, of_type in objects.items():
            if isinstance(section, type_):
                of_type.append(section)
                return section.kind
        return section

    schemes = data["schemes"]
    are_listed = isinstance(schemes, list | tuple)
    content = {
        **data,
        "model": named(data["model"]),
        "schemes": [named(scheme) for scheme in schemes] if are_listed else schemes,
    }
    kinds = Kinds(MODELS.own(objects[Model]), SCHEMES.own(objects[Scheme]))
    return build(Source(name, _plain(content, name)), collection, name, kinds=kinds)


def _plain(data: Any, name: str, depth: int = 0) -> Any:
    """Return `data` converted to built-in numbers, lists and dictionaries."""
    if depth > MAX_DEPTH:
        rule = f"must not nest deeper than {MAX_DEPTH} levels"
        raise InputError([Fault(name, 0, "", "", rule)])
    if isinstance(data, Mapping):
        return {str(key): _plain(value, name, depth + 1) for key, value in data.items()}
    if isinstance(data, list | tuple):
        return [_plain(value, name, depth + 1) for value in data]
    if hasattr(data, "tolist"):
        return _plain(data.tolist(), name, depth + 1)
    if isinstance(data, bool):
        return data
    if isinstance(data, Integral):
        return int(data)
    return float(data) if isinstance(data, Real) else data


def build(
    source: Source, collection: str, name: str, file: Path | None = None, kinds: Kinds | None = None
) -> ExperimentSpec:
    """Validate the content of `source` and fill in every default.

    `kinds` holds the models and schemes that may be named, by default the registered ones.

    Raises `InputError` with every fault of the file.
    """
    report = Report(source, kinds)
    check_names(name, collection, report)
    # the order matters: each step writes the form that the next one reads
    write_out_chain(report)
    write_out_repeats(report)
    write_usual_form(report)
    document = read_document(report)
    folder = file.parent if file else Path()
    equation, numbers, setting = _equation_and_setting(document, folder, report)
    size_limits.check(setting, report)
    _check_output(document, setting, report)
    checks = _checks(document, setting, report)
    check_figures(document.figures, setting, report)
    report.raise_any()
    assert setting.time is not None
    experiment = ExperimentSpec(
        collection=collection,
        name=name,
        **{key: getattr(document, key) for key in AS_WRITTEN},
        model=equation.spec(numbers.parameters),
        initial=dict(numbers.initial),
        time=setting.time,
        levels=setting.levels,
        schemes=setting.schemes,
        sweep=setting.sweep if setting.sweep.axes else None,
        samples=setting.samples,
        checks=checks,
        scaling=numbers.scaling,
    )
    if (own := report.kinds.own_models.get(experiment.model.kind)) is not None:
        experiment.model.hold(own)
    experiment._file, experiment._settings = file, source.settings
    size_limits.check_costs(experiment, report)
    report.raise_any()
    model = experiment.model.definition
    every = members.MemberNumbers(
        model, numbers.parameters, numbers.initial, setting.time, setting.sweep.axes
    )
    unlikely.note_unlikely(document.checks, setting.levels, every, report)
    experiment._notes = report.note_lines
    return members.update_tables(experiment)


def _equation_and_setting(
    document: Any, folder: Path, report: Report
) -> tuple[Equation, Numbers, Setting]:
    """Return the equation, its (scaled) numbers, and the setting that checks and size limits are validated against."""
    data = report.source.data
    swept = sorted(set(_dotted_keys(data.get("sweep"))))
    # a faulty model section may still name its model
    registered = report.kinds.model_of(data.get("model"))
    equation = read_equation(document.model, registered, swept, folder, report)
    model, parameters = equation.model, equation.parameters
    levels = _levels(document, report)
    schemes = tuple(scheme_rules.finish_schemes(document.schemes, model, report))
    knows_schemes = scheme_rules.are_known(document.schemes, report.kinds)
    time = timing.time_spec(document.time, equation.valued, parameters, report)
    initial = _initial(document.initial, equation, registered, report)
    if equation.valued and any(name.startswith("potential.") for name in equation.formulas):
        note_potential(equation.valued, parameters, initial, report)
    sweep, is_whole = read_sweep(document, model, schemes, not knows_schemes, report)
    if is_whole:
        _check_members(equation, initial, time, sweep, report)
    numbers = Numbers(parameters, initial, time)
    if document.scaled:
        numbers = characteristic(numbers, model, swept, report)
    setting = Setting(
        model=model,
        time=numbers.time,
        levels=levels,
        schemes=schemes,
        names=tuple(dict.fromkeys(scheme_names(data.get("schemes")))),
        sweep=sweep,
        knows_sweep=is_whole,
        samples=document.samples.every if isinstance(document.samples, Every) else document.samples,
        by_tolerance=data.get("tolerance") is not None,
        knows_schemes=knows_schemes,
    )
    return equation, numbers, setting


def _check_members(
    equation: Equation,
    initial: Mapping[str, float],
    time: TimeSpec | None,
    sweep: Sweep,
    report: Report,
) -> None:
    """Check the rules that every member of a sweep must satisfy, if all of its numbers are known."""
    model = equation.valued
    if time is None or model is None:
        return
    numbers = members.MemberNumbers(model, equation.parameters, initial, time, sweep.axes)
    members.check_ends(numbers, report)
    for table in equation.tables:
        members.check_table_length(numbers, table, report)
    if equation.structure is not None and equation.structure.structure.histories:
        latest = max(float(max(end)) for _, end in numbers.blocks())
        check_histories(equation.structure, latest, report)
    members.check_jumps(numbers, equation.formulas, report)
    if sweep.follow is not None:
        continuation.check_equation(model, numbers, report)
    members.check_starts(numbers, equation.formulas, report)


def check_names(experiment: str, collection: str, report: Report) -> None:
    """Report faults in the names of an experiment and its collection."""
    for what, name in (("experiment", experiment), ("collection", collection)):
        who = f"the name of the {what}, '{shorten(name)}',"
        if not re.fullmatch(IDENTIFIER, name):
            report.add((), f"{who} must consist of a to z, 0 to 9 and _")
        elif len(name) > MAX_NAME:
            report.add((), f"{who} must not be longer than {MAX_NAME} characters")
        elif _PERIODIC.search(name):
            report.add((), f"{who} must not end with the same text {MAX_REPEATS} times")


def _dotted_keys(section: Any) -> Iterator[str]:
    """Yield the keys of a sweep at any depth: one at the wrong place is meant to vary, too."""
    if isinstance(section, Mapping):
        for key, value in section.items():
            yield from [key] if "." in key else ()
            yield from _dotted_keys(value)


def _levels(document: Any, report: Report) -> tuple[int, ...]:
    """Return the levels; empty if the section is missing or faulty, or replaced by a tolerance."""
    data = report.source.data
    present = [key for key in ("levels", "tolerance") if data.get(key) is not None]
    if not present:
        report.add(("levels",), MISSING, "e.g. {from: 6, to: 9}, or tolerance in its place")
    elif len(present) > 1:
        report.add(("tolerance",), "must not be given together with levels", at_key=True)
    return rising_levels(document.levels, report)


def _initial(
    given: Mapping[str, float], equation: Equation, registered: Model | None, report: Report
) -> dict[str, float]:
    """Return the initial value of every state, 0 by default; with a faulty equation those of the registered model."""
    # the states of a structure are known only once its matrices are
    model = equation.model or (None if registered is STRUCTURE else registered)
    if model is None:
        return {}
    states = [state.name for state in model.states]
    for name in given:
        if name not in states:
            report.add(("initial", name), "unknown state", nearest(name, states), at_key=True)
    initial = {name: given.get(name, 0.0) for name in states}
    for state in model.states:
        if state.minimum is not None and initial[state.name] < state.minimum:
            rule = f"must be at least {state.minimum:g}"
            report.add(("initial", state.name), rule, value=initial[state.name])
    start = model.start(equation.parameters) if equation.valued and model.start else {}
    scale = max(map(abs, start.values()), default=0.0)
    for name, value in start.items():
        agrees = math.isclose(initial[name], value, rel_tol=SAME_START, abs_tol=SAME_START * scale)
        if name in given and not agrees:
            rule = f"must be {value:.15g}, where the motion starts, or be left out"
            hint = "with `observe` or `start`, model.start gives the start"
            report.add(("initial", name), rule, hint if model.kind == "structure" else "")
        initial[name] = float(value)
    return initial


def _checks(document: Any, setting: Setting, report: Report) -> tuple[Check, ...]:
    """Return the checks of the file (default: every position converges), and the claims of its printed tables."""
    given, model = document.checks, setting.model
    if not given and not document.published and model is not None:
        given = [ConvergesCheck(converges=position) for position in model.positions]
    checks = finish_checks(given, setting, report)
    ids = [check.id if check is not None else "" for check in document.checks]
    check_published(document.published, ids, setting, report)
    rows = [] if report.faults else claims(document.published)
    return (*checks, *rows)


def _check_output(document: Any, setting: Setting, report: Report) -> None:
    """Refuse extrapolation over one level, of several coordinates, or with `follow`."""
    model = setting.model
    if document.output == "best" and len(setting.levels) == 1:
        rule = "the best solution is extrapolated over at least 2 levels, there is 1"
        report.add(("output",), rule)
    if model is not None and not model.is_alone:
        rule = f"extrapolates a motion of one coordinate, {model.kind} has {model.coordinates}"
        if model.loaded is not None:
            rule = "extrapolates a motion whose energies follow from its states, unlike those of a structure"
        if document.tolerance is not None:
            report.add(("tolerance",), rule, "give levels", document.tolerance)
        if document.output == "best":
            report.add(("output",), rule, "choose from verdict", document.output)
    is_extrapolated = document.tolerance is not None or document.output == "best"
    if setting.sweep.follow is not None and is_extrapolated:
        key = "tolerance" if document.tolerance is not None else "output"
        rule = "extrapolates members that start as the file says, not those of `follow`"
        report.add((key,), rule, "leave it out, and give levels")
