"""Expressions as LLVM instructions, and the variables that they read.

Variables are stored in stack slots, which LLVM turns into registers; variables that are assigned once need no slot.
Tuples are represented by their entries.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Sequence
from functools import partial, reduce
from typing import Any, cast

from llvmlite import ir

from vibsim.native import operations
from vibsim.native.inference import Inference, row_from
from vibsim.native.kinds import (
    FLOAT,
    TRUTH,
    WHOLE,
    Array,
    ArrayKind,
    Kind,
    Number,
    Value,
    kind_of,
    types_of,
    value_of,
    words_of,
)
from vibsim.native.source import arguments_of, assigned, refusal

_INT = ir.IntType(32)


Call = Callable[[ir.IRBuilder, str, Sequence[Value]], Value]
"""Calls a function of the module by its name, and returns its result."""


class Expressions:
    """Writer of the variables and expressions of one function."""

    def __init__(self, call: Call, inference: Inference, function: ir.Function) -> None:
        self.call = call
        self.inference = inference
        self.source = inference.source
        self.node = inference.function
        self.function = function
        self.builder = ir.IRBuilder(function.append_basic_block("entry"))
        self.values: dict[str, Value] = {}
        """Values of variables without a slot."""
        self.slots: dict[str, list[ir.Value]] = {}
        counts = assigned(self.node)
        words = iter(function.args)
        for name, kind in zip(arguments_of(self.node), inference.arguments, strict=True):
            value = value_of(kind, words)
            if name in counts:
                self._make_slot(name)
                self.store(name, value)
            else:
                self.values[name] = value
        # only at the top level: in a branch or a loop an assignment may not be executed
        at_the_top = assigned(*(line for line in self.node.body if isinstance(line, ast.Assign)))
        once = {name for name in at_the_top if counts[name] == 1}
        self.single = once - self.slots.keys()
        for name in sorted(counts.keys() - self.single - self.slots.keys()):
            self._make_slot(name)

    def blocks(self, *names: str) -> list[ir.Block]:
        """Append basic blocks."""
        return [self.function.append_basic_block(name) for name in names]

    def _make_slot(self, name: str) -> None:
        with self.builder.goto_entry_block():
            types = types_of(self.inference.variables[name])
            self.slots[name] = [self.builder.alloca(word) for word in types]

    def store(self, name: str, value: Value) -> None:
        """Store a value in the slot of a variable."""
        words = words_of(self.turned(value, self.inference.variables[name]))
        for word, slot in zip(words, self.slots[name], strict=True):
            self.builder.store(word, slot)

    def turned(self, value: Value, kind: Kind) -> Value:
        """Convert a value to a wider kind."""
        if isinstance(value, tuple):
            return tuple([self.turned(a, b) for a, b in zip(value, cast(Any, kind), strict=True)])
        if isinstance(value, Array):
            return value
        return Number(cast(str, kind), operations.turned(self.builder, value, cast(str, kind)))

    def number(self, node: ast.expr) -> Number:
        """Evaluate an expression whose value is a number."""
        value = self.value(node)
        if not isinstance(value, Number):
            raise refusal(node, f"it is a {kind_of(value)}, not a number")
        return value

    def truth(self, node: ast.expr) -> ir.Value:
        """Evaluate the truth of an expression, as a bit."""
        return operations.turned(self.builder, self.number(node), TRUTH)

    def value(self, node: ast.expr) -> Value:
        """Evaluate an expression."""
        known = self.source.constant(node, self.inference.local)
        if known is not None:
            return _literal(known)
        match node:
            case ast.Name(id=name) if name in self.values:
                return self.values[name]
            case ast.Name(id=name) if name in self.slots:
                words = [self.builder.load(slot) for slot in self.slots[name]]
                return value_of(self.inference.variables[name], iter(words))
            case ast.Name():
                raise refusal(node, "it has no value here")
            case ast.Tuple(elts=parts):
                return tuple([self.value(part) for part in parts])
            case ast.BinOp(left=left, op=op, right=right):
                a, b = self.value(left), self.value(right)
                kind = operations.kind_of_binary(node, op, kind_of(a), kind_of(b))
                return self._binary(op, kind, a, b)
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                return Number(TRUTH, self.builder.not_(self.truth(operand)))
            case ast.UnaryOp(op=op, operand=operand):
                value = self.value(operand)
                return self._negated(value, operations.kind_of_unary(node, op, kind_of(value)))
            case ast.Compare(left=left, ops=ops, comparators=others):
                sides = [self.number(part) for part in (left, *others)]
                bits = map(partial(operations.compared, self.builder), ops, sides, sides[1:])
                return Number(TRUTH, reduce(self.builder.and_, bits))
            case ast.BoolOp():
                return self._bool(node)
            case ast.IfExp(test=test, body=body, orelse=orelse):
                return self._choose(node, test, body, orelse)
            case ast.Subscript():
                return self._entry(node)
            case ast.Attribute(value=of, attr="shape"):
                array = self.value(of)
                if isinstance(array, Array):
                    return tuple([Number(WHOLE, length) for length in array.lengths])
            case ast.Call(func=func, args=arguments):
                return self._call(node, func, [self.value(value) for value in arguments])
        raise refusal(node, "this cannot be compiled")

    def _binary(self, op: ast.operator, kind: Kind, left: Value, right: Value) -> Value:
        """Evaluate ``left op right``, for vectors component by component."""
        if isinstance(kind, tuple):
            sides = (x if isinstance(x, tuple) else (x,) * len(kind) for x in (left, right))
            pairs = zip(*sides, strict=True)
            return tuple([self._binary(op, FLOAT, a, b) for a, b in pairs])
        numbers = cast(Number, left), cast(Number, right)
        name = cast(str, kind)
        return Number(name, operations.binary(self.builder, op, name, *numbers))

    def _negated(self, value: Value, kind: Kind) -> Value:
        if isinstance(value, tuple):
            return tuple([self._negated(part, FLOAT) for part in value])
        return Number(cast(str, kind), operations.negated(self.builder, cast(Number, value)))

    def _bool(self, node: ast.BoolOp) -> Value:
        """Evaluate ``and`` or ``or``, with short-circuiting."""
        [end] = self.blocks("decided")
        result: list[tuple[ir.Value, ir.Block]] = []
        for value in node.values[:-1]:
            bit = self.truth(value)
            result.append((bit, self.builder.block))
            [ahead] = self.blocks("undecided")
            is_and = isinstance(node.op, ast.And)
            self.builder.cbranch(bit, *((ahead, end) if is_and else (end, ahead)))
            self.builder.position_at_end(ahead)
        result.append((self.truth(node.values[-1]), self.builder.block))
        self.builder.branch(end)
        self.builder.position_at_end(end)
        return Number(TRUTH, self._merged(result))

    def _choose(self, node: ast.expr, test: ast.expr, body: ast.expr, orelse: ast.expr) -> Value:
        kind = self.inference.kind(node)
        bit = self.truth(test)
        if _is_plain(body) and _is_plain(orelse):
            pair = [words_of(self.turned(self.value(part), kind)) for part in (body, orelse)]
            words = [self.builder.select(bit, a, b) for a, b in zip(*pair, strict=True)]
            return value_of(kind, iter(words))
        ways: list[tuple[list[ir.Value], ir.Block]] = []
        with self.builder.if_else(bit) as branches:
            for branch, part in zip(branches, (body, orelse), strict=True):
                with branch:
                    result = words_of(self.turned(self.value(part), kind))
                    ways.append((result, self.builder.block))
        columns = zip(*[words for words, _ in ways], strict=True)
        blocks = [block for _, block in ways]
        words = [self._merged(list(zip(column, blocks, strict=True))) for column in columns]
        return value_of(kind, iter(words))

    def _merged(self, ways: Sequence[tuple[ir.Value, ir.Block]]) -> ir.Value:
        phi = self.builder.phi(ways[0][0].type)
        for word, block in ways:
            phi.add_incoming(word, block)
        return phi

    def _entry(self, node: ast.Subscript) -> Value:
        of = self.value(node.value)
        if isinstance(of, Array):
            begin = row_from(node)
            if begin is not None:
                return self._row(of, node.slice, begin)
            return Number(of.kind.entry, self.builder.load(self.pointer(of, node.slice)))
        assert isinstance(of, tuple)
        place = self.source.constant(node.slice, self.inference.local)
        if isinstance(place, int):
            value: Value = of[place]
            return value
        return self._picked(node, of)

    def _picked(self, node: ast.Subscript, of: tuple[Any, ...]) -> Value:
        """Return an entry of a tuple of numbers at an index that is only known at run time."""
        kind = self.inference.kind(node)
        if not isinstance(kind, str):
            raise refusal(node, "only of a tuple of numbers an entry is found at run time")
        words = [cast(Number, self.turned(value, kind)).word for value in of]
        type_ = ir.ArrayType(words[0].type, len(words))
        place = self.number(node.slice)
        if all(isinstance(word, ir.Constant) for word in words):
            name = self.builder.module.get_unique_name("numbers")
            table = ir.GlobalVariable(self.builder.module, type_, name)
            table.initializer = ir.Constant(type_, words)
            table.global_constant, table.linkage = True, "internal"
        else:
            with self.builder.goto_entry_block():
                table = self.builder.alloca(type_)
            for i, word in enumerate(words):
                self.builder.store(word, self.builder.gep(table, [_INT(0), _INT(i)], inbounds=True))
        pointer = self.builder.gep(table, [_INT(0), place.word], inbounds=True)
        return Number(kind, self.builder.load(pointer))

    def _row(self, array: Array, place: ast.expr, begin: ast.expr) -> Array:
        outer = place.elts[:-1] if isinstance(place, ast.Tuple) else []
        first = ast.copy_location(ast.Tuple([*outer, begin], ast.Load()), place)
        length = self.builder.sub(array.lengths[-1], self.number(begin).word)
        return Array(ArrayKind(array.kind.entry, 1), self.pointer(array, first), (length,))

    def pointer(self, array: Array, place: ast.expr) -> ir.Value:
        """Return the address of an entry of an array."""
        parts = place.elts if isinstance(place, ast.Tuple) else [place]
        numbers = [self.number(part) for part in parts]
        if len(numbers) != array.kind.dims or any(number.kind != WHOLE for number in numbers):
            raise refusal(
                place, f"an entry of an {array.kind} has as many whole numbers as it has dimensions"
            )
        index = numbers[0].word
        for length, number in zip(array.lengths[1:], numbers[1:], strict=True):
            index = self.builder.add(self.builder.mul(index, length), number.word)
        return self.builder.gep(array.pointer, [index], inbounds=True)

    def _call(self, node: ast.Call, func: ast.expr, arguments: list[Value]) -> Value:
        if isinstance(func, ast.Name) and func.id in self.source.functions:
            return self.call(self.builder, func.id, arguments)
        name = ast.unparse(func)
        kind = operations.kind_of_call(node, name, [kind_of(value) for value in arguments])
        if name == "vector":
            return self.turned(tuple(arguments), kind)
        if name == "abs" and isinstance(arguments[0], tuple):
            return Number(FLOAT, operations.norm(self.builder, arguments[0]))
        return operations.call(self.builder, name, cast(str, kind), cast(list[Number], arguments))


def _literal(value: Any) -> Value:
    return tuple(map(_literal, value)) if isinstance(value, tuple) else operations.literal(value)


def _is_plain(node: ast.expr) -> bool:
    """Tell whether an expression is free and without side effects, so that it may be evaluated unconditionally."""
    match node:
        case ast.Name() | ast.Constant() | ast.Attribute(value=ast.Name(id="math")):
            return True
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            return _is_plain(operand)
    return False
