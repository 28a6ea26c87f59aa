"""``vibsim new``: write a commented experiment file to start from, and the JSON Schema that its first line names."""

from __future__ import annotations

import json
import os
import re
import textwrap
from argparse import Namespace
from collections.abc import Iterator
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING

from vibsim.cli.jobs.common import refusal
from vibsim.cli.list_entry import COORDINATES, model_named, needed, parameter_text, unit_text
from vibsim.core.home import home, typed
from vibsim.experiment.collection import ENDINGS
from vibsim.store import write_bytes, write_text

if TYPE_CHECKING:
    from vibsim.models import Model

SCHEMA = "vibsim.schema.json"  # name of the schema beside a file outside of the checkout
_NAME = re.compile("[a-z0-9_]+")
EDITOR = "# yaml-language-server: $schema="
"""Start of the line with the path of the JSON Schema, for editors that complete keys and mark faults."""
_END, _FIRST, _LAST = 6.0, 6, 9
_START = 0.5
"""End time, levels, and initial value of the first position: these levels resolve the motion of every model."""
_WIDEST = 120  # longest line [characters]
STRUCTURE = [
    ("  mass: [1.0]", "M: its diagonal, rows, or a .mtx, .npy or .csv file"),
    ("  stiffness: [[1.0]]", "K, of as many rows as M"),
    ("  # rayleigh: {alpha: 0.01, beta: 0.01}", "damping alpha M + beta K"),
    ("  # load: {1: cos(0.5*t)}", "formulas in t by degree of freedom, counted from 1"),
    ("  # observe: {tip: 1}", "names of displacements; all when left out"),
]
"""Lines of the model section of a linear structure, with comments."""


def new(options: Namespace) -> int:
    """Write a new file for a model, or a copy of a shipped experiment; existing files are not overwritten."""
    file: Path = options.file
    if options.model and options.like:
        raise refusal("--like", options.like, "must not be given together with --model")
    if file.suffix not in ENDINGS or not _NAME.fullmatch(file.stem):
        rule = "a file of an experiment must have a name of a to z, 0 to 9 and _, and end in .yaml"
        raise refusal("FILE", file, rule)
    if not file.parent.is_dir():
        raise refusal("FILE", file, f"there is no folder {file.parent}")
    schema = _schema_of(file)
    if options.like:
        lines, written = _like(options.like)
    else:
        lines, written = list(_lines(model_named(options.model or "pendulum", "--model"))), {}
    written[file.name] = "\n".join([f"{EDITOR}{schema}", *lines, ""]).encode()
    for name in written:
        if os.path.lexists(file.parent / name):
            raise refusal("FILE", file.parent / name, "exists already, and is not overwritten")
    if schema == SCHEMA:
        _write_schema(file.parent / SCHEMA)
    for name, content in written.items():
        write_bytes(file.parent / name, content)
        print(f"wrote {file.parent / name}")
    word = quote(str(file))
    print(f"check it: {typed(f'vibsim check {word}')}\nrun it:   {typed(f'vibsim run {word}')}")
    return 0


def _like(word: str) -> tuple[list[str], dict[str, bytes]]:
    """Return the lines of an experiment without that of its schema, and the tables that it names."""
    from vibsim.cli.chosen_plans import one_plan_of

    plan = one_plan_of(word)
    source = plan.source_file
    if source is None or plan.file != str(source):
        raise refusal("--like", word, "must be a whole experiment, not one member of it")
    if plan.has_solver:
        rule = "has a solver of its own, whose programs and files are not copied; copy its folder"
        raise refusal("--like", word, rule)
    tables = {}
    for path, _ in plan.inputs:
        if Path(path).name != path:
            raise refusal("--like", word, f"it reads {path}, which is not in its own folder")
        tables[path] = (source.parent / path).read_bytes()
    lines = source.read_text("utf-8").splitlines()
    return [line for line in lines if not line.startswith(EDITOR)], tables


def _schema_of(file: Path) -> str:
    """Return the path of the schema relative to the file: within the checkout the shipped one, else one beside it."""
    root, folder = home(), file.parent.resolve()
    if folder.is_relative_to(root):
        return os.path.relpath(root / "workflow/schemas/experiment.schema.json", folder)
    return SCHEMA


def _write_schema(path: Path) -> None:
    """Write the schema of the installed models and schemes; replace only a schema of vibsim."""
    from vibsim.experiment.schema.document import installed_schema

    content = installed_schema()
    if os.path.lexists(path):
        try:
            title = json.loads(path.read_bytes()).get("title")
        except (OSError, ValueError, AttributeError, RecursionError):
            title = None
        if title != content["title"]:
            raise refusal("FILE", path, "exists already, and is not a schema of vibsim")
    write_text(path, json.dumps(content, indent=2, ensure_ascii=False) + "\n")


def _lines(model: Model) -> Iterator[str]:
    """Yield the lines of a file with a model, its default parameters, four levels and two checks, after its schema."""
    yield "# Check this file with `vibsim check FILE`, run it with `vibsim run FILE`, and see what it costs with"
    yield '# `vibsim plan FILE`. Numbers may have units: "50 cm".'
    yield f"title: {model.title} on four levels"
    yield ""
    scheme = "rk4" if model.loaded is None else "newmark"
    yield from textwrap.wrap(model.equation, 100, initial_indent="# ", subsequent_indent="# ")
    yield "model:"
    yield f"  kind: {model.kind}"
    numbers = [(f"  {row.key}: {row.default!r}", parameter_text(row)) for row in model.parameters]
    yield from _column(numbers if model.loaded is None else STRUCTURE)
    if model.named is not None:
        yield from _column([(f"  coordinates: [{', '.join(model.positions)}]", COORDINATES)])
    required = needed(model)
    formulas = [
        (f"  {'' if row in required else '# '}{row.name}: {row.default}".rstrip(), row.description)
        for row in model.formulas
    ]
    yield from _column(formulas)
    yield ""
    if model.start is None:
        yield "initial:"
        start = {model.position: _START}
        states = [
            (f"  {row.name}: {start.get(row.name, 0.0)!r}", row.long_name + unit_text(row.unit))
            for row in model.states
        ]
        yield from _column(states)
        yield ""
    yield from _column(
        [
            ("time:", "the same for every level"),
            (f"  end: {_END!r}", "or {periods: 10, steps_per_period: 4}"),
            (
                f"levels: {{from: {_FIRST}, to: {_LAST}}}",
                f"level l has 2^l steps: {2**_FIRST} to {2**_LAST}",
            ),
            ("schemes:", "all of them: vibsim list schemes"),
            (f"  - {scheme}", f"one in full: vibsim list schemes {scheme}"),
        ]
    )
    yield ""
    yield "checks:                       # all kinds and all numbers: vibsim list checks"
    position = model.position
    yield f"  # the error of {position} vanishes with the order that the scheme promises"
    yield f"  - {{converges: {position}, order: scheme}}"
    yield "  # the error of the finest level is small enough"
    yield f"  - {{accurate: {position}, relative: 1e-2}}"
    yield ""
    yield "# A sweep makes a member for each value:"
    yield "# sweep:"
    if model.start is None:
        yield f"#   initial.{position}: {{linspace: [0.1, 1.0, 10]}}"
    else:
        first = model.parameters[0]
        yield f"#   model.{first.key}: [{0.9 * first.default:.3g}, {first.default:g}]"


def _column(rows: list[tuple[str, str]]) -> Iterator[str]:
    """Yield lines with their comments in one column; a long comment goes above its line."""
    width = max((len(line) for line, _ in rows), default=0)
    for line, comment in rows:
        if width + len(comment) + 4 > _WIDEST:
            yield f"{' ' * (len(line) - len(line.lstrip()))}# {comment}"
            yield line
        else:
            yield f"{line.ljust(width)}  # {comment}"
