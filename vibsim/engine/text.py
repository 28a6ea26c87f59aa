"""The source text of functions, collected into one flat module.

A function is taken with whatever it uses of its own module: numbers and tuples of numbers are written out, plain
functions are collected in their turn. Anything else is refused.
"""

from __future__ import annotations

import ast
import inspect
import math
import types
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from functools import cache, lru_cache
from typing import Any

from vibsim.core.errors import SimulationError
from vibsim.schemes.base import HANDED


@dataclass
class Module:
    """A flat module that is being written."""

    entry: str
    """The function that is called from outside."""
    settings: Mapping[str, object] = field(default_factory=dict)
    """Numbers that take the place of those in the modules that functions come from."""
    given: Collection[str] = ()
    """Names that the head of the module defines."""
    parts: dict[str, str] = field(default_factory=dict)
    """Text by name, each after what it uses."""

    @property
    def text(self) -> str:
        """The whole text, without a head that says what ``compiled``, ``called`` and ``entry`` are."""
        return "import math\n\n" + "\n\n".join(self.parts.values()) + "\n"

    def put(self, name: str, text: str) -> None:
        """Add a part.

        Raises `SimulationError` where the name stands for something else already.
        """
        if self.parts.setdefault(name, text) != text:
            raise SimulationError(f"{name} means two things in one kernel")

    def define(self, head: str, *lines: str) -> None:
        """Add a function with these lines, which becomes part of its callers."""
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
    """Write `function` under `name`, after whatever it uses.

    Parameters
    ----------
    renamed
        Names of the text that stand for others here.
    is_called
        Whether it is compiled for itself (`vibsim.engine.kernel_stubs.called`).

    Raises `SimulationError` where it uses something that cannot enter a kernel.
    """
    used = _names(function, name)
    answers = {k: v for k, v in module.settings.items() if isinstance(v, bool) and k in used}
    others = {old: new for old, new in renamed.items() if old in used}
    text = _text(function, name, frozenset(answers.items()), frozenset(others.items()))
    _put(module, function, text, name, renamed, is_called=is_called)


def definition(function: Callable[..., Any], name: str) -> ast.FunctionDef:
    """Return the parsed text of a function that is to stand under `name`.

    Raises `SimulationError` where it is no plain function, so that it cannot enter a kernel.
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
    """Write the text `tree`, which is that of `function` or a part of it, under `name`: see `collect`."""
    _put(module, function, _text_of(function, tree, name, module.settings, renamed), name, renamed)


@dataclass(frozen=True)
class _Text:
    """A function as it stands in a kernel."""

    body: str
    """Without a mark that says how it is compiled."""
    used: tuple[str, ...]
    """Names that are not its own, as the module has them that it comes from."""
    is_marked: bool
    has_loop: bool


# kernels have most of their functions in common, and to parse one takes milliseconds


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
    tree = _Settled(settings).visit(tree)
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
    """Put a function into a module, after whatever it uses."""
    mark = _mark(module, function, text, name, is_called)
    for other in text.used:
        if other not in function.__globals__ or other in module.given:
            continue
        value, new = function.__globals__[other], renamed.get(other, other)
        if other in module.settings:
            module.put(other, f"{other} = {module.settings[other]!r}")
        elif isinstance(value, types.FunctionType):
            # what is there already was bound by whoever makes the kernel
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
    """Say how a function is compiled: into its callers, or for itself."""
    if name == module.entry:
        return "entry"
    if known := module.parts.get(name):
        # another function that uses it has brought it already
        return known.partition("\n")[0].removeprefix("@")
    is_elementary = function.__module__.startswith("vibsim.elementary")
    is_alone = is_called or text.is_marked or (text.has_loop and is_elementary)
    return "called" if is_alone else "compiled"


def _is_constant(value: object) -> bool:
    if isinstance(value, tuple):
        return all(_is_constant(entry) for entry in value)
    return isinstance(value, int | float)


def _strip(tree: ast.FunctionDef, name: str) -> None:
    """Rename a function; drop its docstring, its annotations, and the functions it is handed."""
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
    """Keeps of ``if NAME: ... else: ...`` what a setting says, without the question."""

    def __init__(self, settings: Mapping[str, object]) -> None:
        self.settings = settings

    def visit_If(self, node: ast.If) -> ast.AST | list[ast.stmt] | None:
        self.generic_visit(node)
        answer = self.settings.get(node.test.id) if isinstance(node.test, ast.Name) else None
        if not isinstance(answer, bool):
            return node
        return (node.body if answer else node.orelse) or None


def divided(a: Any, b: Any) -> Any:
    """Return a/b as IEEE 754 has it, where Python raises at b = 0; of a vector a, too."""
    if b != 0.0 or isinstance(a, tuple):
        return a / b
    return (
        math.nan
        if a == 0.0 or math.isnan(a)
        else math.copysign(math.inf, a) * math.copysign(1.0, b)
    )


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
    """Return a module for plain Python in which division by zero is no error, as in compiled code."""
    tree: ast.Module = _Quotients().visit(ast.parse(text))
    return ast.fix_missing_locations(tree)


@lru_cache(maxsize=4096)
def plain_code(text: str) -> types.CodeType:
    """Return the code of `with_quotients`; kernels have most of their parts in common."""
    return compile(with_quotients(text), "<kernel>", "exec")
