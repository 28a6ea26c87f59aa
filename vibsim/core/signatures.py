"""Whether a function of a user can be called with some arguments, without calling it."""

from __future__ import annotations

import ast
import inspect
from collections.abc import Callable, Sequence
from typing import Any


def misfit(function: Callable[..., Any], *args: Any, **named: Any) -> tuple[str, str] | None:
    """Return what a function takes and why it cannot be called so; None where it can, or does not tell."""
    try:
        takes = inspect.signature(function)
    except (TypeError, ValueError):
        return None  # functions of extension modules may not tell
    return misfit_of(takes, *args, **named)


def misfit_of(takes: inspect.Signature, *args: Any, **named: Any) -> tuple[str, str] | None:
    """Return the same of a function that is known by its signature alone."""
    try:
        takes.bind(*args, **named)
    except TypeError as error:
        return str(takes), str(error)
    return None


def signature_of(node: ast.FunctionDef) -> inspect.Signature:
    """Return the signature of a function that is read, and not run: its default values are texts."""
    kinds, given = inspect.Parameter, node.args
    plain = [*given.posonlyargs, *given.args]
    texts: list[ast.expr | None] = [None] * (len(plain) - len(given.defaults))
    texts += given.defaults
    rows: list[tuple[ast.arg | None, Any, ast.expr | None]] = [
        *((one, kinds.POSITIONAL_OR_KEYWORD, text) for one, text in zip(plain, texts, strict=True)),
        (given.vararg, kinds.VAR_POSITIONAL, None),
        *(
            (one, kinds.KEYWORD_ONLY, text)
            for one, text in zip(given.kwonlyargs, given.kw_defaults, strict=True)
        ),
        (given.kwarg, kinds.VAR_KEYWORD, None),
    ]
    found = [
        kinds(one.arg, kind, default=kinds.empty if text is None else ast.unparse(text))
        for one, kind, text in rows
        if one is not None
    ]
    only = len(given.posonlyargs)
    found[:only] = [one.replace(kind=kinds.POSITIONAL_ONLY) for one in found[:only]]
    return inspect.Signature(found)


def takes_by_name(function: Callable[..., Any], names: Sequence[str]) -> bool:
    """Say whether a function has parameters of all these names, and needs no others."""
    try:
        known = inspect.signature(function).parameters
    except (TypeError, ValueError):
        return False
    return set(names) <= set(known) and misfit(function, **dict.fromkeys(names)) is None
