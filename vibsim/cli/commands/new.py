"""``vibsim new``: a commented experiment file to begin with, and the JSON Schema that its first line names."""

from __future__ import annotations

import json
import os
import re
from argparse import Namespace
from pathlib import Path
from shlex import quote

from vibsim.cli.jobs.common import refusal
from vibsim.core.errors import nearest
from vibsim.core.home import called, home
from vibsim.experiment.collection import ENDINGS
from vibsim.store import write_bytes, write_text

SCHEMA = "vibsim.schema.json"
"""Name of the schema beside a file outside of the checkout."""
_NAME = re.compile("[a-z0-9_]+")


def new(options: Namespace) -> int:
    """Write a file of a model, or one like a shipped experiment; what is there already is not overwritten."""
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
        text, written = _like(options.like, schema)
    else:
        text, written = _of_model(options.model or "pendulum", schema), {}
    written[file.name] = text.encode()
    for name in written:
        if os.path.lexists(file.parent / name):
            raise refusal("FILE", file.parent / name, "is there already, and is not overwritten")
    if schema == SCHEMA:
        _write_schema(file.parent / SCHEMA)
    for name, content in written.items():
        write_bytes(file.parent / name, content)
        print(f"wrote {file.parent / name}")
    word = quote(str(file))
    print(f"check it: {called(f'vibsim check {word}')}\nrun it:   {called(f'vibsim run {word}')}")
    return 0


def _of_model(kind: str, schema: str) -> str:
    from vibsim.cli import template
    from vibsim.models import MODELS

    if kind not in MODELS:
        raise refusal("--model", kind, "is no model", nearest(kind, sorted(MODELS)))
    return template.of_model(MODELS[kind], schema)


def _like(word: str, schema: str) -> tuple[str, dict[str, bytes]]:
    """Return the text of an experiment, and the tables that it names."""
    from vibsim.cli import template
    from vibsim.cli.chosen_plans import one_plan_of

    plan = one_plan_of(word)
    source = plan.source_file
    if source is None or plan.file != str(source):
        raise refusal("--like", word, "must be a whole experiment, not one member of it")
    if plan.has_solver:
        rule = "has a solver of its own, whose programs and files are not copied; copy its folder"
        raise refusal("--like", word, rule)
    found = {}
    for path, _ in plan.inputs:
        if Path(path).name != path:
            raise refusal("--like", word, f"it reads {path}, which is not in its own folder")
        found[path] = (source.parent / path).read_bytes()
    return template.of_text(source.read_text("utf-8"), schema), found


def _schema_of(file: Path) -> str:
    """Return the path of the schema as the file names it: that of the checkout within it, else one beside the file."""
    root, folder = home(), file.parent.resolve()
    if folder.is_relative_to(root):
        return os.path.relpath(root / "workflow/schemas/experiment.schema.json", folder)
    return SCHEMA


def _write_schema(path: Path) -> None:
    """Write the schema of what is installed; one of an earlier vibsim is replaced, anything else is left alone."""
    from vibsim.experiment.schema.document import installed_schema

    content = installed_schema()
    if os.path.lexists(path):
        try:
            title = json.loads(path.read_bytes()).get("title")
        except (OSError, ValueError, AttributeError, RecursionError):
            title = None
        if title != content["title"]:
            raise refusal("FILE", path, "is there already, and is no schema of vibsim")
    write_text(path, json.dumps(content, indent=2, ensure_ascii=False) + "\n")
