"""Type inference: the kind of every variable and every result.

A variable has one kind throughout its function: the smallest that holds all values assigned to it. Widening one
variable may widen others, so a function is traversed until nothing changes.
"""

from __future__ import annotations

import ast
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from vibsim.native import operations
from vibsim.native.kinds import FLOAT, NOTHING, TRUTH, WHOLE, ArrayKind, Kind, joined
from vibsim.native.source import Source, arguments_of, assigned, loaded, refusal


@dataclass
class Inference:
    """Kinds within one function, for arguments of given kinds."""

    source: Source
    results: dict[tuple[str, tuple[Kind, ...]], Inference]
    """Inferences of all functions, by name and kinds of the arguments; shared."""
    function: ast.FunctionDef
    arguments: tuple[Kind, ...]
    variables: dict[str, Kind] = field(default_factory=dict)
    result: Kind | None = None
    """Kind of the result; None until a ``return`` was seen."""

    @classmethod
    def of(
        cls,
        source: Source,
        results: dict[tuple[str, tuple[Kind, ...]], Inference],
        name: str,
        arguments: tuple[Kind, ...],
    ) -> Inference:
        """Return the inference of a function for arguments of these kinds."""
        key = (name, arguments)
        if key not in results:
            results[key] = cls(source, results, source.functions[name], arguments)
            results[key]._settle()
        return results[key]

    @cached_property
    def local(self) -> frozenset[str]:
        """Arguments, and names that are assigned in the function."""
        return frozenset(assigned(self.function)) | frozenset(arguments_of(self.function))

    def _settle(self) -> None:
        names = arguments_of(self.function)
        if len(names) != len(self.arguments):
            raise refusal(
                self.function, f"it takes {len(names)} arguments, not {len(self.arguments)}"
            )
        self.variables = dict(zip(names, self.arguments, strict=True))
        before = None
        while before != (before := (dict(self.variables), self.result)):
            self._block(self.function.body)
        if self.result is None:
            self.result = NOTHING

    def _block(self, body: Sequence[ast.stmt]) -> None:
        for statement in body:
            self._statement(statement)

    def _statement(self, node: ast.stmt) -> None:
        match node:
            case ast.Assign(targets=targets, value=value):
                kind = self.kind(value)
                for target in targets:
                    self._give(target, kind)
            case ast.AugAssign(target=target, op=op, value=value):
                changed = ast.BinOp(loaded(target), op, value)
                self._give(target, self.kind(ast.copy_location(changed, node)))
            case ast.Return(value=value):
                kind = NOTHING if value is None else self.kind(value)
                self.result = kind if self.result is None else self._join(node, self.result, kind)
            case ast.If(test=test, body=body, orelse=orelse):
                self.kind(test)
                for branch in branches(self.source, node, self.local) or (body, orelse):
                    self._block(branch)
            case ast.For(target=target, body=body):
                self._give(target, WHOLE)
                self._block(body)
            case ast.While(body=body):
                self._block(body)
            case ast.Expr(value=value):
                self.kind(value)

    def _give(self, target: ast.expr, kind: Kind) -> None:
        if isinstance(target, ast.Name):
            had = self.variables.get(target.id)
            self.variables[target.id] = kind if had is None else self._join(target, had, kind)
        elif isinstance(target, ast.Tuple):
            if not isinstance(kind, tuple) or len(kind) != len(target.elts):
                raise refusal(target, f"it cannot hold a {kind}")
            for part, of_part in zip(target.elts, kind, strict=True):
                self._give(part, of_part)

    @staticmethod
    def _join(node: ast.AST, one: Kind, other: Kind) -> Kind:
        kind = joined(one, other)
        if kind is None:
            raise refusal(node, f"it would be a {one} here and a {other} there")
        return kind

    def kind(self, node: ast.expr) -> Kind:
        """Return the kind of an expression."""
        known = self.source.constant(node, self.local)
        if known is not None:
            return kind_of_constant(known)
        match node:
            case ast.Name(id=name) if name in self.variables:
                return self.variables[name]
            case ast.Tuple(elts=parts):
                return tuple([self.kind(part) for part in parts])
            case ast.BinOp(left=left, op=op, right=right):
                return operations.kind_of_binary(node, op, self.kind(left), self.kind(right))
            case ast.UnaryOp(op=op, operand=operand):
                return operations.kind_of_unary(node, op, self.kind(operand))
            case ast.Compare():
                return TRUTH
            case ast.BoolOp(values=values):
                for value in values:
                    self.kind(value)
                return TRUTH
            case ast.IfExp(body=body, orelse=orelse):
                return self._join(node, self.kind(body), self.kind(orelse))
            case ast.Subscript():
                return self._entry(node)
            case ast.Attribute(value=value, attr="shape"):
                kind = self.kind(value)
                if isinstance(kind, ArrayKind):
                    return (WHOLE,) * kind.dims
            case ast.Call(keywords=[_, *_]):
                raise refusal(node, "a function takes arguments by their places alone")
            case ast.Call(func=func, args=arguments):
                return self._call(node, func, tuple([self.kind(value) for value in arguments]))
        raise refusal(node, "this cannot be compiled")

    def _entry(self, node: ast.Subscript) -> Kind:
        of = self.kind(node.value)
        if isinstance(of, ArrayKind):
            return ArrayKind(of.entry, 1) if row_from(node) is not None else of.entry
        if not isinstance(of, tuple) or not of:
            raise refusal(node, f"a {of} has no entries")
        place = self.source.constant(node.slice, self.local)
        if isinstance(place, int):
            if not -len(of) <= place < len(of):
                raise refusal(node, f"there are {len(of)} entries")
            kind: Kind = of[place]
            return kind
        kind = of[0]
        for part in of[1:]:
            kind = self._join(node, kind, part)
        return kind

    def _call(self, node: ast.Call, func: ast.expr, arguments: tuple[Kind, ...]) -> Kind:
        if isinstance(func, ast.Name) and func.id in self.source.functions:
            result = Inference.of(self.source, self.results, func.id, arguments).result
            if result is None:
                raise refusal(node, "a function cannot call itself")
            return result
        return operations.kind_of_call(node, ast.unparse(func), arguments)


def branches(
    source: Source, node: ast.If, local: frozenset[str]
) -> tuple[Sequence[ast.stmt]] | None:
    """Return the branch that is taken if the test is constant, otherwise None."""
    known = source.constant(node.test, local)
    if known is None:
        return None
    return (node.body if known else node.orelse,)


def kind_of_constant(value: Any) -> Kind:
    """Return the kind of a number or of a tuple of numbers."""
    if isinstance(value, tuple):
        return tuple(map(kind_of_constant, value))
    return TRUTH if isinstance(value, bool) else WHOLE if isinstance(value, int) else FLOAT


def row_from(node: ast.Subscript) -> ast.expr | None:
    """Return the start b of a slice ``array[..., b:]`` of a row; None for any other subscript."""
    last = node.slice.elts[-1] if isinstance(node.slice, ast.Tuple) else node.slice
    if isinstance(last, ast.Slice) and last.lower and not last.upper and not last.step:
        return last.lower
    return None
