"""A step cut into stages, each up to one evaluation of the force, for the loop over blocks.

Where each evaluation waits for the one before, a processor that works on a whole step of a few members at a time has
little to do meanwhile. A loop for each stage over all members of a block keeps it busy: every iteration then has one
evaluation, and the next one does not wait for it. What a later stage needs of an earlier one is kept in rows. Every
operation on a member's numbers stays the same one, in the same order.

Only a step in straight lines is cut, in which every evaluation stands for itself, ``name = acceleration(...)``, and no
name gets a second value; `vibsim.schemes.code_generation` writes such steps.
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
    """Names whose values it takes, in `kept`."""
    after: tuple[str, ...]
    """Names whose values it returns; those of the last one, which returns what the step does, are none."""


@cache
def stages(step: Callable[..., Any]) -> tuple[Stage, ...]:
    """Return the stages of a step; none where it has one evaluation of the force, or cannot be cut."""
    tree = definition(step, "step")
    parts = _parts(tree.body)
    if len(parts) < 2:
        return ()
    arguments = [argument.arg for argument in tree.args.args]
    unpacking = [line for line in parts[0] if _value_name(line) == arguments[0]]
    given = {*arguments, *_names(unpacking, ast.Store)}
    head = f"def step({', '.join((*arguments[:4], 'kept', *arguments[4:]))}):\n    pass"
    found = []
    before: tuple[str, ...] = ()
    for i, part in enumerate(parts):
        later = _names((line for lines in parts[i + 1 :] for line in lines), ast.Load)
        known = {*before, *_names(part, ast.Store)} - given
        after = tuple(sorted(known & later))
        [function] = ast.parse(head).body
        assert isinstance(function, ast.FunctionDef)
        taken = ast.parse(f"({', '.join(before)},) = kept").body if before else []
        returned = ast.parse(f"return ({', '.join(after)},)").body if after else []
        function.body = [*(unpacking if i else ()), *taken, *part, *returned]
        found.append(Stage(function, before, after))
        before = after
    return tuple(found)


def kept_names(step: Callable[..., Any]) -> tuple[str, ...]:
    """Return every name whose value is kept from one stage to a later one, each of which needs a row."""
    return tuple(sorted({name for stage in stages(step) for name in stage.after}))


def _parts(body: Sequence[ast.stmt]) -> list[list[ast.stmt]]:
    """Cut behind every evaluation of the force but the last; one part where that cannot be done."""
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
    """Return the name whose value a line assigns, with parentheses where it is called; else nothing."""
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
