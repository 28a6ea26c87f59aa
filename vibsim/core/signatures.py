"""Check whether a user's function accepts given arguments, without calling it."""

from __future__ import annotations

import ast
import inspect
from collections.abc import Callable, Sequence
from typing import Any


def misfit(function: Callable[..., Any], *args: Any, **named: Any) -> tuple[str, str] | None:
    """Return the signature and the reason why a call with these arguments fails; None if it fits or is unknown."""
    try:
        signature = inspect.signature(function)
    except (TypeError, ValueError):
        return None  # functions of extension modules may have no signature
    return misfit_of(signature, *args, **named)


def misfit_of(signature: inspect.Signature, *args: Any, **named: Any) -> tuple[str, str] | None:
    """Return the same as `misfit`, from a signature."""
    try:
        signature.bind(*args, **named)
    except TypeError as error:
        return str(signature), str(error)
    return None


def signature_of(node: ast.FunctionDef) -> inspect.Signature:
    """Return the signature of a parsed function, which is not executed: default values are source text."""
    kinds, args = inspect.Parameter, node.args
    plain = [*args.posonlyargs, *args.args]
    texts: list[ast.expr | None] = [None] * (len(plain) - len(args.defaults))
    texts += args.defaults
    rows: list[tuple[ast.arg | None, Any, ast.expr | None]] = [
        *((arg, kinds.POSITIONAL_OR_KEYWORD, text) for arg, text in zip(plain, texts, strict=True)),
        (args.vararg, kinds.VAR_POSITIONAL, None),
        *(
            (arg, kinds.KEYWORD_ONLY, text)
            for arg, text in zip(args.kwonlyargs, args.kw_defaults, strict=True)
        ),
        (args.kwarg, kinds.VAR_KEYWORD, None),
    ]
    parameters = [
        kinds(arg.arg, kind, default=kinds.empty if text is None else ast.unparse(text))
        for arg, kind, text in rows
        if arg is not None
    ]
    only = len(args.posonlyargs)
    parameters[:only] = [row.replace(kind=kinds.POSITIONAL_ONLY) for row in parameters[:only]]
    return inspect.Signature(parameters)


def takes_by_name(function: Callable[..., Any], names: Sequence[str]) -> bool:
    """Tell whether a function has parameters of all these names, and requires no others."""
    try:
        known = inspect.signature(function).parameters
    except (TypeError, ValueError):
        return False
    return set(names) <= set(known) and misfit(function, **dict.fromkeys(names)) is None
