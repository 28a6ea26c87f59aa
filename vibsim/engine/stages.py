"""A step cut into stages for the loop over blocks, each with one evaluation of the force.

Evaluations within a step depend on each other, so a processor that does whole steps of a few members stalls. A loop for
each stage over all members of a block has independent iterations instead. Values that later stages need are kept in
rows. The operations on a member's numbers stay the same, in the same order.

A step is cut only if it is straight-line code in which every evaluation is an assignment, ``name = acceleration(...)``,
and no name is assigned twice, as `vibsim.schemes.code_generation` writes it.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

from vibsim.engine.text import definition

FORCE = "acceleration"


@dataclass(frozen=True)
class Stage:
    """A part of a step: a function of ``(state, t, dt, p, kept)``."""

    tree: ast.FunctionDef
    before: tuple[str, ...]
    """Names of its inputs from earlier stages, in `kept`."""
    after: tuple[str, ...]
    """Names of its outputs; empty for the last stage, which returns the result of the step."""


@cache
def stages(step: Callable[..., Any]) -> tuple[Stage, ...]:
    """Return the stages of a step; empty if it has a single evaluation of the force, or cannot be cut."""
    tree = definition(step, "step")
    parts = _parts(tree.body)
    if len(parts) < 2:
        return ()
    arguments = [argument.arg for argument in tree.args.args]
    unpacking = [line for line in parts[0] if _value_name(line) == arguments[0]]
    given = {*arguments, *_names(unpacking, ast.Store)}
    head = f"def step({', '.join((*arguments[:4], 'kept', *arguments[4:]))}):\n    pass"
    result = []
    before: tuple[str, ...] = ()
    for i, part in enumerate(parts):
        later = _names((line for lines in parts[i + 1 :] for line in lines), ast.Load)
        known = {*before, *_names(part, ast.Store)} - given
        after = tuple(sorted(known & later))
        [function] = ast.parse(head).body
        assert isinstance(function, ast.FunctionDef)
        inputs = ast.parse(f"({', '.join(before)},) = kept").body if before else []
        outputs = ast.parse(f"return ({', '.join(after)},)").body if after else []
        function.body = [*(unpacking if i else ()), *inputs, *part, *outputs]
        result.append(Stage(function, before, after))
        before = after
    return tuple(result)


def kept_names(step: Callable[..., Any]) -> tuple[str, ...]:
    """Return every name whose value is kept for a later stage, each in a row of its own."""
    return tuple(sorted({name for stage in stages(step) for name in stage.after}))


def _parts(body: Sequence[ast.stmt]) -> list[list[ast.stmt]]:
    """Cut after every evaluation of the force but the last; return a single part if that cannot be done."""
    *lines, end = body
    straight = isinstance(end, ast.Return) and all(isinstance(line, ast.Assign) for line in lines)
    stored = [node.id for node in _nodes(lines) if isinstance(node.ctx, ast.Store)]
    evaluations = [line for line in lines if _value_name(line) == f"{FORCE}()"]
    mentions = [node for node in _nodes(body) if node.id == FORCE]
    if not straight or len(set(stored)) < len(stored) or len(mentions) > len(evaluations):
        return [list(body)]
    parts: list[list[ast.stmt]] = [[]]
    for line in body:
        parts[-1].append(line)
        if line in evaluations[:-1]:
            parts.append([])
    return parts


def _value_name(line: ast.stmt) -> str:
    """Return the name that a line assigns from, with ``()`` if it is called; empty for any other line."""
    match line:
        case ast.Assign(value=ast.Name(id=name)):
            return name
        case ast.Assign(value=ast.Call(func=ast.Name(id=name))):
            return f"{name}()"
    return ""


def _nodes(lines: Iterable[ast.stmt]) -> list[ast.Name]:
    return [node for line in lines for node in ast.walk(line) if isinstance(node, ast.Name)]


def _names(lines: Iterable[ast.stmt], context: type[ast.expr_context]) -> set[str]:
    return {node.id for node in _nodes(lines) if isinstance(node.ctx, context)}
