"""The text of a new experiment file, with a comment on every key: from the kind of a model, or a shipped experiment."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator
from typing import TYPE_CHECKING

from vibsim.cli.list_entry import COORDINATES, needed, parameter_text, unit_text

if TYPE_CHECKING:
    from vibsim.models import Model

EDITOR = "# yaml-language-server: $schema="
"""Before the path of the JSON Schema, for editors that complete keys and mark faults."""
_END, _FIRST, _LAST = 6.0, 6, 9
_START = 0.5
"""End of the time, levels, and initial value of the first position, with which every model resolves its motion."""
_WIDEST = 120
"""Columns of a line at most."""


STRUCTURE = [
    ("  mass: [1.0]", "M: its diagonal, rows, or a .mtx, .npy or .csv file"),
    ("  stiffness: [[1.0]]", "K, of as many rows as M"),
    ("  # rayleigh: {alpha: 0.01, beta: 0.01}", "damping alpha M + beta K"),
    ("  # load: {1: cos(0.5*t)}", "formulas in t by degree of freedom, counted from 1"),
    ("  # observe: {tip: 1}", "names of displacements; all when left out"),
]
"""Lines of the section of a linear structure."""


def of_model(model: Model, schema: str) -> str:
    """Return a file with a model, its default parameters, four levels and two checks."""
    return "\n".join(_lines(model, schema)) + "\n"


def of_text(text: str, schema: str) -> str:
    """Return the text of an experiment file with another schema line."""
    lines = [line for line in text.splitlines() if not line.startswith(EDITOR)]
    return "\n".join([f"{EDITOR}{schema}", *lines]) + "\n"


def _lines(model: Model, schema: str) -> Iterator[str]:
    yield f"{EDITOR}{schema}"
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
    """Yield lines with their comments below each other; a long comment stands above its line."""
    width = max((len(line) for line, _ in rows), default=0)
    for line, comment in rows:
        if width + len(comment) + 4 > _WIDEST:
            yield f"{' ' * (len(line) - len(line.lstrip()))}# {comment}"
            yield line
        else:
            yield f"{line.ljust(width)}  # {comment}"
