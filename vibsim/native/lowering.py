"""Functions as LLVM instructions: one function for every combination of argument kinds with which it is called.

A function takes the words of its arguments and returns a struct of the words of its result. LLVM inlines functions that
are marked so, and drops those that are no longer called.
"""

from __future__ import annotations

import ast
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import cast

from llvmlite import ir

from vibsim.native import operations
from vibsim.native.expressions import Call, Expressions
from vibsim.native.inference import Inference, branches
from vibsim.native.kinds import (
    NOTHING,
    WHOLE,
    WORD,
    Array,
    Kind,
    Number,
    Value,
    kind_of,
    types_of,
    value_of,
    words_of,
)
from vibsim.native.source import Source, is_inline, loaded, refusal

_PREFIX = "text."


@dataclass
class Program:
    """Functions as instructions, by name and kinds of the arguments with which they are called."""

    source: Source
    module: ir.Module = field(default_factory=lambda: ir.Module("kernel"))
    known: dict[tuple[str, tuple[Kind, ...]], Inference] = field(default_factory=dict)
    written: dict[tuple[str, tuple[Kind, ...]], ir.Function] = field(default_factory=dict)

    def function(self, name: str, arguments: tuple[Kind, ...]) -> tuple[ir.Function, Kind]:
        """Return a function for arguments of these kinds, and the kind of its result."""
        inference = Inference.of(self.source, self.known, name, arguments)
        result = cast(Kind, inference.result)
        key = (name, arguments)
        if key not in self.written:
            takes = [word for kind in arguments for word in types_of(kind)]
            signature = ir.FunctionType(result_type(result), takes)
            # a prefix, because LLVM would take a function called `round` or `sin` for that of the C library
            unique = self.module.get_unique_name(f"{_PREFIX}{name}")
            function = ir.Function(self.module, signature, unique)
            # dropped if it is no longer called
            function.linkage = "linkonce_odr"
            function.attributes.add("nounwind")
            if is_inline(inference.function):
                function.attributes.add("alwaysinline")
            self.written[key] = function
            _Statements(self.call, inference, function).write()
        return self.written[key], result

    def call(self, builder: ir.IRBuilder, name: str, arguments: Sequence[Value]) -> Value:
        """Call a function; return its result."""
        function, kind = self.function(name, tuple(map(kind_of, arguments)))
        result = builder.call(function, [word for value in arguments for word in words_of(value)])
        count = len(types_of(kind))
        if count < 2:
            return value_of(kind, iter([result] * count))
        return value_of(kind, iter([builder.extract_value(result, i) for i in range(count)]))


def result_type(kind: Kind) -> ir.Type:
    """Return the LLVM type of a result: void, a word, or a struct of several words."""
    types = types_of(kind)
    if not types:
        return ir.VoidType()
    return types[0] if len(types) == 1 else ir.LiteralStructType(types)


class _Statements(Expressions):
    """Writer of one function, statement by statement."""

    def __init__(self, call: Call, inference: Inference, function: ir.Function) -> None:
        super().__init__(call, inference, function)
        self.ends: list[ir.Block] = []
        """Targets of ``break``, innermost loop last."""

    def write(self) -> None:
        """Write the whole function."""
        self._block(self.node.body)
        if not self.builder.block.is_terminated:
            if self.inference.result != NOTHING:
                raise refusal(self.node, "it can end without a result")
            self.builder.ret_void()

    def _block(self, body: Sequence[ast.stmt]) -> None:
        for statement in body:
            if self.builder.block.is_terminated:
                return
            self._statement(statement)

    def _statement(self, node: ast.stmt) -> None:
        match node:
            case ast.Assign(targets=targets, value=value):
                given = self.value(value)
                for target in targets:
                    self._give(target, given)
            case ast.AugAssign():
                self._augment(node)
            case ast.Return(value=value):
                self._return(NOTHING if value is None else self.value(value))
            case ast.If():
                self._if(node)
            case ast.For(target=ast.Name(id=name), iter=ast.Call(), orelse=[]):
                self._for(node, name)
            case ast.While(test=test, body=body, orelse=[]):
                self._while(test, body)
            case ast.Break():
                self.builder.branch(self.ends[-1])
            case ast.Expr(value=value):
                self.value(value)
            case ast.Pass():
                pass
            case _:
                raise refusal(node, "there is no such statement in a kernel")

    def _give(self, target: ast.expr, value: Value) -> None:
        match target:
            case ast.Name(id=name) if name in self.single:
                self.values[name] = self.turned(value, self.inference.variables[name])
            case ast.Name(id=name):
                self.store(name, value)
            case ast.Tuple(elts=parts) if isinstance(value, tuple):
                for part, of_part in zip(parts, value, strict=True):
                    self._give(part, of_part)
            case ast.Subscript(value=of, slice=place):
                array = self.value(of)
                if not isinstance(array, Array) or not isinstance(value, Number):
                    raise refusal(target, "only an entry of an array can be given a number")
                word = operations.turned(self.builder, value, array.kind.entry)
                self.builder.store(word, self.pointer(array, place))
            case _:
                raise refusal(target, "this cannot be given a value")

    def _augment(self, node: ast.AugAssign) -> None:
        added = ast.BinOp(left=loaded(node.target), op=node.op, right=node.value)
        self._give(node.target, self.value(ast.copy_location(added, node)))

    def _return(self, value: Value) -> None:
        kind = cast(Kind, self.inference.result)
        words = words_of(self.turned(value, kind))
        if not words:
            self.builder.ret_void()
        elif len(words) == 1:
            self.builder.ret(words[0])
        else:
            result = ir.Constant(result_type(kind), ir.Undefined)
            for i, word in enumerate(words):
                result = self.builder.insert_value(result, word, i)
            self.builder.ret(result)

    def _if(self, node: ast.If) -> None:
        known = branches(self.source, node, self.inference.local)
        if known is not None:
            self._block(known[0])
            return
        goes_on = False
        with self.builder.if_else(self.truth(node.test)) as parts:
            for part, body in zip(parts, (node.body, node.orelse), strict=True):
                with part:
                    self._block(body)
                    goes_on |= not self.builder.block.is_terminated
        if not goes_on:
            self.builder.unreachable()

    def _for(self, node: ast.For, name: str) -> None:
        first, stop, step = self._range(node)
        before = self.builder.block
        head, body, ahead, end = self.blocks("head", "body", "ahead", "end")
        self.builder.branch(head)
        self.builder.position_at_end(head)
        place = self.builder.phi(WORD)
        place.add_incoming(first, before)
        self.builder.cbranch(
            self.builder.icmp_signed("<" if step > 0 else ">", place, stop), body, end
        )
        self.builder.position_at_end(body)
        self.store(name, Number(WHOLE, place))
        self._loop(node.body, ahead, end)
        self.builder.position_at_end(ahead)
        place.add_incoming(self.builder.add(place, WORD(step), flags=["nsw"]), ahead)
        self.builder.branch(head)
        self.builder.position_at_end(end)

    def _range(self, node: ast.For) -> tuple[ir.Value, ir.Value, int]:
        match node.iter:
            case ast.Call(func=ast.Name(id="range"), args=[stop]):
                bounds: list[ast.expr] = [ast.Constant(0), stop, ast.Constant(1)]
            case ast.Call(func=ast.Name(id="range"), args=[_, _] | [_, _, _] as given):
                bounds = [*given, ast.Constant(1)][:3]
            case _:
                raise refusal(node.iter, "a loop goes over a range")
        step = self.source.constant(bounds[2], self.inference.local)
        if not isinstance(step, int) or step == 0:
            raise refusal(node.iter, "the step of a range is a whole number other than 0")
        first, last = self.number(bounds[0]), self.number(bounds[1])
        if first.kind != WHOLE or last.kind != WHOLE:
            raise refusal(node.iter, "a range is between whole numbers")
        return first.word, last.word, step

    def _while(self, test: ast.expr, statements: Sequence[ast.stmt]) -> None:
        head, body, end = self.blocks("head", "body", "end")
        self.builder.branch(head)
        self.builder.position_at_end(head)
        self.builder.cbranch(self.truth(test), body, end)
        self.builder.position_at_end(body)
        self._loop(statements, head, end)
        self.builder.position_at_end(end)

    def _loop(self, body: Sequence[ast.stmt], repeat: ir.Block, end: ir.Block) -> None:
        self.ends.append(end)
        self._block(body)
        if not self.builder.block.is_terminated:
            self.builder.branch(repeat)
        self.ends.pop()
