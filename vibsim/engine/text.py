"""Source text of functions, collected into one flat module.

A function is collected together with the globals that it uses: numbers and tuples of numbers are written out, plain
functions are collected recursively. Anything else is refused.
"""

from __future__ import annotations

import ast
import copy
import inspect
import math
import types
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from functools import cache, lru_cache
from typing import Any

from vibsim.core.errors import SimulationError
from vibsim.schemes.base import HANDED
from vibsim.schemes.step_numbers import POWER_RULE, divided, small_power


@dataclass
class Module:
    """A flat module under construction."""

    entry: str
    """Name of the entry point."""
    settings: Mapping[str, object] = field(default_factory=dict)
    """Constants that override those in the modules of the collected functions."""
    given: Collection[str] = ()
    """Names that the head of the module defines."""
    parts: dict[str, str] = field(default_factory=dict)
    """Definitions by name, each after those that it uses."""

    @property
    def text(self) -> str:
        """The whole text, without the head that defines ``compiled``, ``called`` and ``entry``."""
        return "import math\n\n" + "\n\n".join(self.parts.values()) + "\n"

    def put(self, name: str, text: str) -> None:
        """Add a definition.

        Raises `SimulationError` if the name already has another definition.
        """
        if self.parts.setdefault(name, text) != text:
            raise SimulationError(f"{name} means two things in one kernel")

    def define(self, head: str, *lines: str) -> None:
        """Add a function with these lines, which is inlined into its callers."""
        body = "\n    ".join(lines)
        self.put(head.partition("(")[0], f"@compiled\ndef {head}:\n    {body}")


def collect(
    module: Module,
    function: Callable[..., Any],
    name: str,
    renamed: Mapping[str, str],
    *,
    is_called: bool = False,
) -> None:
    """Write `function` under `name`, after everything that it uses.

    Parameters
    ----------
    renamed
        New names for names in the text.
    is_called
        Whether it is compiled separately (`vibsim.engine.kernel_stubs.called`).

    Raises `SimulationError` if it uses something that cannot enter a kernel.
    """
    used = _names(function, name)
    flags = {k: v for k, v in module.settings.items() if isinstance(v, bool) and k in used}
    renamed_here = {old: new for old, new in renamed.items() if old in used}
    text = _text(function, name, frozenset(flags.items()), frozenset(renamed_here.items()))
    _put(module, function, text, name, renamed, is_called=is_called)


def definition(function: Callable[..., Any], name: str) -> ast.FunctionDef:
    """Return the syntax tree of a function that is to be written under `name`.

    Raises `SimulationError` if it is not a plain function, which cannot enter a kernel.
    """
    if not isinstance(function, types.FunctionType):
        raise SimulationError(f"{name} is no plain Python function, so it cannot enter a kernel")
    try:
        text = _source(function)
    except OSError:
        # typed into an interpreter, or made by exec
        rule = f"the text of {name} is not known: write it in a file, or in a cell of a notebook"
        raise SimulationError(rule) from None
    tree = ast.parse(text).body[0]
    if not isinstance(tree, ast.FunctionDef):
        raise SimulationError(f"{name} is no function with a name, so it cannot enter a kernel")
    return tree


def enter(
    module: Module,
    function: Callable[..., Any],
    tree: ast.FunctionDef,
    name: str,
    renamed: Mapping[str, str],
) -> None:
    """Write `tree`, the syntax tree of `function` or a part of it, under `name`: see `collect`."""
    _put(module, function, _text_of(function, tree, name, module.settings, renamed), name, renamed)


@dataclass(frozen=True)
class _Text:
    """The text of a function in a kernel."""

    body: str
    """Without the decorator that says how it is compiled."""
    used: tuple[str, ...]
    """Global names that it uses, as named in its own module."""
    is_marked: bool
    has_loop: bool


# cached, because kernels share most of their functions, and parsing one takes milliseconds


@cache
def _source(function: Callable[..., Any]) -> str:
    return inspect.cleandoc("\n" + inspect.getsource(function))


@cache
def _names(function: Callable[..., Any], name: str) -> frozenset[str]:
    """Return every name in the text of a function."""
    nodes = ast.walk(definition(function, name))
    return frozenset(node.id for node in nodes if isinstance(node, ast.Name))


@cache
def _text(
    function: Callable[..., Any],
    name: str,
    settings: frozenset[tuple[str, bool]],
    renamed: frozenset[tuple[str, str]],
) -> _Text:
    return _text_of(function, definition(function, name), name, dict(settings), dict(renamed))


def _text_of(
    function: Callable[..., Any],
    tree: ast.FunctionDef,
    name: str,
    settings: Mapping[str, object],
    renamed: Mapping[str, str],
) -> _Text:
    _strip(tree, name)
    is_marked, tree.decorator_list = bool(tree.decorator_list), []
    tree = _Powers(name).visit(_Settled(settings).visit(tree))
    arguments = {argument.arg for argument in tree.args.args}
    local = (arguments | set(function.__code__.co_varnames)) - set(HANDED)
    names = [node for node in ast.walk(tree) if isinstance(node, ast.Name) and node.id not in local]
    used = tuple(sorted({node.id for node in names}))
    has_loop = any(isinstance(node, ast.For | ast.While) for node in ast.walk(tree))
    for node in names:
        node.id = renamed.get(node.id, node.id)
    return _Text(ast.unparse(tree), used, is_marked, has_loop)


def _put(
    module: Module,
    function: Callable[..., Any],
    text: _Text,
    name: str,
    renamed: Mapping[str, str],
    *,
    is_called: bool = False,
) -> None:
    """Put a function into a module, after everything that it uses."""
    mark = _mark(module, function, text, name, is_called)
    for other in text.used:
        if other not in function.__globals__ or other in module.given:
            continue
        value, new = function.__globals__[other], renamed.get(other, other)
        if other in module.settings:
            module.put(other, f"{other} = {module.settings[other]!r}")
        elif isinstance(value, types.FunctionType):
            # a name that is already defined was bound by `vibsim.engine.kernel`
            if new not in module.parts:
                collect(module, value, new, renamed)
        elif _is_constant(value):
            module.put(other, f"{other} = {value!r}")
        elif value is not math:
            raise SimulationError(
                f"{name} uses {other}, which is no number, tuple of numbers or plain function"
            )
    module.put(name, f"@{mark}\n{text.body}")


def _mark(
    module: Module, function: Callable[..., Any], text: _Text, name: str, is_called: bool
) -> str:
    """Return the decorator of a function: inlined into its callers, or compiled separately."""
    if name == module.entry:
        return "entry"
    if known := module.parts.get(name):
        # it was already collected for another function
        return known.partition("\n")[0].removeprefix("@")
    is_elementary = function.__module__.startswith("vibsim.elementary")
    is_alone = is_called or text.is_marked or (text.has_loop and is_elementary)
    return "called" if is_alone else "compiled"


def _is_constant(value: object) -> bool:
    if isinstance(value, tuple):
        return all(_is_constant(entry) for entry in value)
    return isinstance(value, int | float)


def _strip(tree: ast.FunctionDef, name: str) -> None:
    """Rename a function; drop its docstring, its annotations, and the arguments of `HANDED`."""
    tree.name = name
    tree.returns = None
    tree.args.args = [argument for argument in tree.args.args if argument.arg not in HANDED]
    for argument in tree.args.args:
        argument.annotation = None
    if ast.get_docstring(tree) is not None:
        tree.body = tree.body[1:]
    for call in (node for node in ast.walk(tree) if isinstance(node, ast.Call)):
        call.args = [
            argument for argument in call.args if getattr(argument, "id", None) not in HANDED
        ]


class _Settled(ast.NodeTransformer):
    """Replaces ``if NAME: ... else: ...`` by the branch that the setting NAME selects."""

    def __init__(self, settings: Mapping[str, object]) -> None:
        self.settings = settings

    def visit_If(self, node: ast.If) -> ast.AST | list[ast.stmt] | None:
        self.generic_visit(node)
        value = self.settings.get(node.test.id) if isinstance(node.test, ast.Name) else None
        if not isinstance(value, bool):
            return node
        return (node.body if value else node.orelse) or None


class _Powers(ast.NodeTransformer):
    """Multiplies out a power with a small whole exponent, for the same bits in every lane."""

    def __init__(self, name: str) -> None:
        self.name = name

    def visit_BinOp(self, node: ast.BinOp) -> ast.AST:
        self.generic_visit(node)
        if not isinstance(node.op, ast.Pow):
            return node
        exponent = small_power(node)
        if not exponent:
            raise SimulationError(f"{self.name}: {POWER_RULE}, not {ast.unparse(node)}")
        result = node.left
        for _ in range(exponent - 1):
            result = ast.BinOp(left=result, op=ast.Mult(), right=copy.deepcopy(node.left))
        return result


class _Quotients(ast.NodeTransformer):
    """Writes ``divided(a, b)`` for ``a / b``."""

    def visit_BinOp(self, node: ast.BinOp) -> ast.AST:
        self.generic_visit(node)
        if not isinstance(node.op, ast.Div) or (
            isinstance(node.right, ast.Constant) and node.right.value
        ):
            return node
        name = ast.Name(id=divided.__name__, ctx=ast.Load())
        return ast.Call(func=name, args=[node.left, node.right], keywords=[])


def with_quotients(text: str) -> ast.Module:
    """Return a module for plain Python in which division by zero does not raise, as in compiled code."""
    tree: ast.Module = _Quotients().visit(ast.parse(text))
    return ast.fix_missing_locations(tree)


@lru_cache(maxsize=4096)
def plain_code(text: str) -> types.CodeType:
    """Return the code of `with_quotients`, cached because kernels share most of their parts."""
    return compile(with_quotients(text), "<kernel>", "exec")
