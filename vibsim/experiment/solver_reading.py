"""Read an experiment with a solver of the user; all sections are read before any fault is raised."""

from __future__ import annotations

import ast
import math
import re
import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from vibsim.core.errors import nearest
from vibsim.core.modules import find
from vibsim.core.signatures import misfit_of, signature_of
from vibsim.experiment.collection import collection_of
from vibsim.experiment.data import Sweep
from vibsim.experiment.faults import Report
from vibsim.experiment.reading import KEYS, SOLVER, check_names
from vibsim.experiment.rules.checks import check_expect, check_ids, given_one
from vibsim.experiment.rules.size_limits import MAX_FILES
from vibsim.experiment.rules.sweep import SweepReader
from vibsim.experiment.rules.timing import rising_levels
from vibsim.experiment.schema.fields import Number, Text
from vibsim.experiment.schema.solver import (
    KINDS,
    MOST_LEVELS,
    RESERVED,
    QuantitySection,
    SolverCheck,
    SolverConvergesCheck,
    SolverDocument,
)
from vibsim.experiment.schema.sweep import swept_values
from vibsim.experiment.solver import NO_MODULE, OUTPUTS, SolverExperiment, SolverSpec, placeholders
from vibsim.experiment.tables.file import ENDINGS
from vibsim.experiment.validation import read_document
from vibsim.experiment.yaml.parse import Path_, Source, read
from vibsim.formula import ExpressionError, constant, evaluate, parse

_NAME = "must be a name of letters, digits and _"
_QUOTED = r"'[^']*'|\"(?:\\.|[^\"])*\"|\\."
_SHELL_SIGN = r"(?:^|\s)(>>?|<|\|\|?|&&?|;)(?=\s|\{|$)"


def from_file(path: Path) -> SolverExperiment:
    """Read the file of an experiment with a solver; raise `InputError` with all its faults."""
    return read_solver(read(path, KEYS), collection_of(path), path)


def read_solver(source: Source, collection: str, file: Path) -> SolverExperiment:
    """Validate the content of `source` and fill in defaults; raise `InputError` with all faults of the file."""
    report, name = Report(source), file.stem
    check_names(name, collection, report)
    document = read_document(report, SolverDocument)
    numbers, sizes = _sizes(document.refine, report)
    # names from the raw file: placeholders of faulty values are no further fault
    refine = source.data.get("refine")
    refined = list(refine) if isinstance(refine, Mapping) else []
    written = {str(path[-1]): raw for path, raw in swept_values(source.data.get("sweep"))}
    size_names = [name for name in refined if name != "levels"]
    swept_names = list(written)
    sweep, whole = _sweep(document.sweep, written, report)
    _check_names(size_names, swept_names, document.quantities, report)
    level_names = [*size_names, *(["level"] if "levels" in refined else [])]
    solver = _solver(document.solver, level_names, swept_names, report)
    checks = _checks(document, report)
    numeric = [name for name, values in written.items() if not _is_text(values)]
    _check_exact(document.quantities, numeric, report)
    report.raise_any()
    assert solver is not None
    step = next(iter(sizes))
    order = sorted(range(len(sizes[step])), key=lambda i: -sizes[step][i])
    experiment = SolverExperiment(
        collection=collection,
        name=name,
        title=document.title,
        source=document.source,
        solver=solver,
        sizes={name: tuple(values[i] for i in order) for name, values in sizes.items()},
        numbers=tuple(numbers[i] for i in order) if numbers else (),
        quantities=document.quantities,
        sweep=sweep,
        whole=whole,
        resources=document.resources,
        checks=checks,
    )
    experiment._file, experiment._settings = file, source.settings
    _check_files(experiment, report)
    report.raise_any()
    return experiment


def _sizes(section: Any, report: Report) -> tuple[tuple[int, ...], dict[str, tuple[Any, ...]]]:
    """Return the values of `level` (empty without them), and the sizes of all levels by name."""
    if section is None:
        return (), {}
    numbers = rising_levels(section.levels, report, ("refine", "levels"))
    sizes: dict[str, tuple[Any, ...]] = {}
    raw = report.source.data["refine"]
    if not set(raw) - {"levels"}:
        report.add(("refine",), "must name a step size", "e.g. h: [0.1, 0.05, 0.025]")
    for name, value in section.sizes.items():
        if isinstance(value, str):
            values = _by_formula(("refine", name), value, numbers, "levels" in raw, report)
        else:
            values = tuple(map(int, value)) if _is_whole(raw[name]) else value
        if values:
            sizes[name] = values
    step, steps = next(iter(sizes.items()), ("", ()))
    count = len(numbers) or len(steps)
    for name, values in sizes.items():
        if len(values) != count:
            reference = "there are levels" if numbers else f"{step} has"
            rule = f"must have as many values as {reference}, {count}, has {len(values)}"
            report.add(("refine", name), rule, at_key=True)
    if count > MOST_LEVELS:
        report.add(("refine",), f"must not have more than {MOST_LEVELS} levels, has {count}")
    for i, size in enumerate(steps):
        if not size > 0.0:
            report.add(("refine", step, i), "a step size must be greater than 0", value=size)
        elif size in steps[:i]:
            report.add(("refine", step, i), "a step size must not be repeated", value=size)
    return numbers, sizes


def _by_formula(
    path: Path_, text: str, numbers: Sequence[int], has_levels: bool, report: Report
) -> tuple[Any, ...]:
    """Return the values of a formula in `level`: ints if all are whole and the text has no "/" or "."."""
    if not has_levels:
        hint = "give a list, or `levels: {from: 4, to: 8}`"
        report.add(path, "a formula needs `levels`", hint, text)
        return ()
    try:
        tree = parse(text, ("level",))
        values = [evaluate(tree, {"level": float(number)}, text) for number in numbers]
    except ExpressionError as error:
        report.add(path, f"must be a formula in level ({error.rule})", error.hint, text)
        return ()
    if not all(map(math.isfinite, values)):
        report.add(path, "must have a finite value on every level", value=text)
        return ()
    is_whole = "/" not in text and "." not in text and all(value.is_integer() for value in values)
    return tuple(map(int, values)) if is_whole else tuple(values)


def _sweep(
    section: Any, written: Mapping[str, Any], report: Report
) -> tuple[Sweep | None, tuple[str, ...]]:
    """Return the sweep (None without one), and the names whose values in the file are all whole numbers."""
    if section is None:
        return None, ()
    types = {name: Text if _is_text(values) else Number for name, values in written.items()}
    axes = [axis for axis in SweepReader(types, report).axes(section) if axis is not None]
    if not written:
        report.add(("sweep",), "must not be empty")
    whole = tuple(name for name, values in written.items() if _is_whole(values))
    return Sweep.model_construct(axes=tuple(axes)), whole


def _is_text(raw: Any) -> bool:
    """Tell whether a list contains text that is not a constant formula."""
    for entry in raw if isinstance(raw, list) else ():
        if isinstance(entry, str):
            try:
                constant(entry)
            except ExpressionError:
                return True
    return False


def _is_whole(raw: Any) -> bool:
    """Tell whether all numbers of a list, or of a range, are ints."""
    if isinstance(raw, Mapping):
        raw = raw.get("range")
    is_list = isinstance(raw, list)
    return is_list and all(isinstance(x, int) and not isinstance(x, bool) for x in raw)


def _is_name(text: str) -> bool:
    return text.isidentifier() and text.isascii()


def _check_names(
    sizes: Sequence[str], swept: Sequence[str], quantities: Mapping[str, Any], report: Report
) -> None:
    """Check that names of sizes, parameters, quantities and coordinates are valid and distinct."""
    used: dict[str, str] = {}
    places: list[tuple[Path_, str, str]] = [
        *((("refine", name), name, "a size") for name in sizes),
        *((("sweep", name), name, "a swept parameter") for name in swept),
        *((("quantities", name), name, "a quantity") for name in quantities),
    ]
    for path, name, what in places:
        if not _is_name(name):
            report.add(path, _NAME, value=name, at_key=True)
        elif name in RESERVED:
            rule = "means something else here: " + ", ".join(RESERVED)
            report.add(path, f"'{name}' {rule}", "choose another name", at_key=True)
        elif used.setdefault(name, what) != what:
            report.add(path, f"is the name of {used[name]}, too", "choose another", at_key=True)
    for name, quantity in quantities.items():
        for i, coordinate in enumerate(quantity.coordinates or ()):
            path = ("quantities", name, "coordinates", i)
            if coordinate in quantity.coordinates[:i]:
                report.add(path, "a coordinate must not be repeated", value=coordinate)
            elif not _is_name(coordinate):
                report.add(path, _NAME, value=coordinate)
            elif coordinate in used or coordinate in RESERVED:
                what = used.get(coordinate, "something else")
                report.add(path, f"is the name of {what}, too", "choose another", coordinate)


def _solver(
    section: Any, level_names: Sequence[str], swept: Sequence[str], report: Report
) -> SolverSpec | None:
    """Return the solver; None if it is faulty. Its placeholders are `level_names` and `swept` names."""
    kind: Any = section and given_one(section, KINDS, (SOLVER,), report)
    if not kind:
        return None
    text = getattr(section, kind)
    if kind == "files" and section.inputs:
        rule = "belong to a command or a function: a file that is there is an input itself"
        report.add((SOLVER, "inputs"), rule, at_key=True)
    if kind != "python":
        _check_template(kind, text, level_names, swept, report)
    return SolverSpec.model_construct(kind=kind, text=text, inputs=section.inputs)


def _check_template(
    kind: str, text: str, level_names: Sequence[str], swept: Sequence[str], report: Report
) -> None:
    """Check the placeholders of a command or a file path."""
    path = (SOLVER, kind)
    try:
        used = list(placeholders(text))
    except ValueError:
        hint = "a brace of the program's own is written twice, {{ or }}"
        report.add(path, "must have a name alone between braces, such as {h}", hint, text)
        return
    try:
        is_empty = kind == "command" and not shlex.split(text)
    except ValueError as error:
        report.add(path, f"cannot be split into arguments ({error})", value=text)
        return
    if is_empty:
        report.add(path, "must name a program", value=text)
    unquoted = re.sub(_QUOTED, "", text) if kind == "command" else ""
    if sign := re.search(_SHELL_SIGN, unquoted):
        rule = f"no shell reads a command, so {sign[1]} would be an argument of the program"
        report.add(path, rule, "write a script and run that, or quote it", text)
    if kind == "files" and not text.lower().endswith(ENDINGS):
        report.add(path, f"must end with {' or '.join(ENDINGS)}", value=text)
    known = [*level_names, *swept]
    known += [*OUTPUTS, "threads"] if kind == "command" else []
    # missing sizes are reported elsewhere; then no name is known
    unknown = [name for name in dict.fromkeys(used) if level_names and name not in known]
    for name in unknown:
        report.add(path, f"unknown placeholder {{{name}}}", nearest(name, known), text)
    if not set(used) & set(level_names) and level_names and not unknown:
        hint = "e.g. {" + level_names[0] + "}"
        report.add(path, "has no placeholder that differs between levels", hint, text)
    if kind == "command" and not set(used) & set(OUTPUTS) and not unknown:
        report.add(path, "has no placeholder for the file that it writes", "{output}", text)
    for name in swept:
        if name not in used:
            rule = f"is not a placeholder of `{kind}:`, so it would change nothing"
            report.add(("sweep", name), rule, f"write {{{name}}} where it belongs", at_key=True)


def _check_exact(
    quantities: Mapping[str, QuantitySection], swept: Sequence[str], report: Report
) -> None:
    """Check that exact values are formulas in coordinates of their quantity and swept numbers."""
    for name, quantity in quantities.items():
        path: Path_ = ("quantities", name, "exact")
        known = (*(quantity.coordinates or ()), *swept)
        if quantity.exact is None:
            continue
        try:
            if not parse(quantity.exact, known).names:
                constant(quantity.exact)
        except ExpressionError as error:
            variables = f" in {', '.join(known)}" if known else ", here without names"
            hint = error.hint or ("" if quantity.coordinates else "name its coordinates as well")
            report.add(path, f"must be a formula{variables} ({error.rule})", hint, quantity.exact)


def _checks(document: Any, report: Report) -> tuple[SolverCheck, ...]:
    """Return the checks of a file; by default every quantity converges."""
    known = list(document.quantities)
    checks = document.checks or [SolverConvergesCheck(converges=name) for name in known]
    ids = check_ids(checks, False, report)
    finished = []
    for i, check in enumerate(checks):
        if check is None:
            continue
        path: Path_ = ("checks", i)
        check_expect(check.expect, (*path, "expect"), report)
        if known and check.about not in known and (*path, check.kind) not in report.faulty:
            hint = nearest(check.about, known)
            report.add((*path, check.kind), "is none of the quantities", hint, check.about)
        if isinstance(check, SolverConvergesCheck):
            if check.order is not None and check.at_least is not None:
                rule = "must not be given together with order"
                report.add((*path, "at_least"), rule, at_key=True)
        else:
            given_one(check, ("relative", "absolute"), path, report)
        finished.append(check.model_copy(update={"id": ids[i]}))
    return tuple(finished)


def _check_files(experiment: SolverExperiment, report: Report) -> None:
    """Check that required files exist, and that the levels do not have too many files."""
    count = len(experiment.levels) * experiment.members
    if count > MAX_FILES:
        rule = f"the levels must not have more than {MAX_FILES} files, they have {count}"
        report.add(("sweep",), rule, at_key=True)
        return
    for i, name in enumerate(experiment.solver.inputs):
        _check_file(experiment.folder / name, (SOLVER, "inputs", i), "", report)
    if experiment.solver.kind == "python":
        _check_function(experiment, report)
    elif experiment.solver.kind == "command":
        program = shlex.split(experiment.solver.text)[0]
        # a program without a folder is searched where it runs, maybe on another machine
        if "/" in program and not list(placeholders(program)):
            place = (SOLVER, "command")
            _check_file(experiment.folder / program, place, f"{program}: ", report)
    if experiment.solver.kind != "files":
        return
    seen: dict[str, str] = {}
    for member in range(experiment.members):
        for level in experiment.levels:
            path = experiment.path(level, member)
            words = experiment.words(level, member)
            where = ", ".join(f"{name} = {word}" for name, word in words.items())
            if seen.setdefault(path, where) != where:
                rule = f"is the file of {seen[path]}, too"
                report.add((SOLVER, "files"), f"{path} {rule}", f"of {where}")
                continue
            _check_file(experiment.folder / path, (SOLVER, "files"), f"{path}: ", report)


def _check_function(experiment: SolverExperiment, report: Report) -> None:
    """Check, by reading and not running it, that a module next to the file has the function with these arguments."""
    module, _, name = experiment.solver.text.partition(":")
    file = experiment.folder.joinpath(*module.split(".")).with_suffix(".py")
    try:
        tree = ast.parse(file.read_bytes())
    except OSError:
        if not _is_found(module, experiment.folder.absolute()):
            report.add((SOLVER, "python"), NO_MODULE, value=experiment.solver.text)
        return
    except (SyntaxError, ValueError):
        return  # Python reports it with its line
    nodes = list(ast.walk(tree))
    functions = [node.name for node in nodes if isinstance(node, ast.FunctionDef | ast.ClassDef)]
    assigned = {node.id for node in nodes if isinstance(node, ast.Name)}
    imported = {
        alias.asname or alias.name
        for node in nodes
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    if not {name, "*"} & {*functions, *assigned, *imported}:
        rule, hint = f"{file.name} has no function {name}", nearest(name, functions)
        report.add((SOLVER, "python"), rule, hint, experiment.solver.text)
    defined = [node for node in tree.body if getattr(node, "name", "") == name]
    # a decorator may change the arguments
    if defined and isinstance(last := defined[-1], ast.FunctionDef) and not last.decorator_list:
        _check_arguments(last, experiment, report)


def _is_found(module: str, folder: Path) -> bool:
    """Tell whether a module without a file in the folder is installed, or a package there."""
    top, *inner = module.split(".")
    spec = find(module, folder)
    is_here = spec is not None and str(folder / top) in (spec.submodule_search_locations or ())
    return spec is not None and not (is_here and not folder.joinpath(top, *inner).is_dir())


def _check_arguments(node: ast.FunctionDef, experiment: SolverExperiment, report: Report) -> None:
    """Check that a function takes the sizes and the parameters of the experiment by name."""
    arguments = {**experiment.sizes_of(experiment.levels[0]), **experiment.parameters_of(0)}
    if misfits := misfit_of(signature_of(node), **arguments):
        takes, why = misfits
        rule = f"is called with {', '.join(arguments)}, but takes {takes} ({why})"
        hint = "it gets sizes and parameters by their names"
        report.add((SOLVER, "python"), rule, hint, experiment.solver.text)


def _check_file(path: Path, place: Path_, subject: str, report: Report) -> None:
    try:
        is_file, is_there = path.is_file(), path.exists()
    except (OSError, ValueError):
        is_file = is_there = False
    if not is_file:
        rule = "must be a file" if is_there else "there is no such file"
        report.add(place, f"{subject}{rule}")
