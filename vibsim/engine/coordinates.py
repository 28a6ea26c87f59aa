"""A scheme that is written for one coordinate, written out for several.

In the text of a scheme every position, velocity and acceleration is one number. For a model with several coordinates
the same text stands for vectors: a sum of vectors, a number times a vector, and ``abs`` of a vector, which is its
Euclidean norm. Here that text is written out: a vector is a tuple, and an expression of vectors a tuple of the same
expression of their components, so that uncoupled coordinates move as each would alone, to the last bit.

Which names are vectors follows from the arguments of a function: each expression is a number, a vector, or a tuple of
such kinds. What is not an operation of linear algebra (a product of two vectors, a comparison) is refused.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Mapping, Sequence
from copy import deepcopy
from types import FunctionType
from typing import Any, Literal

from vibsim.core.errors import SimulationError
from vibsim.elementary import ELEMENTARY
from vibsim.engine import gather
from vibsim.engine.text import Module, collect, definition, enter
from vibsim.schemes import newton
from vibsim.schemes.base import HANDED, Stepper, no_backward
from vibsim.schemes.newton_system import solver

Kind = Literal["number", "vector", "zero"] | tuple["Kind", ...]

NUMBER: Kind = "number"
VECTOR: Kind = "vector"
ZERO: Kind = "zero"
"""The number 0, which is that of vectors too."""
NORM = "norm_of"

_SOLVERS: Mapping[Any, tuple[int, Kind]] = {
    newton.solved: (1, VECTOR),
    newton.solved_together: (2, (VECTOR, VECTOR)),
}
"""Functions with another text for several coordinates: the stages that they solve for, and the kind of the result."""


def collect_system(
    module: Module,
    function: Callable[..., Any],
    name: str,
    kinds: Sequence[Kind],
    count: int,
    *,
    returns: Kind | None = None,
) -> Kind:
    """Write `function` under `name` for `count` coordinates, after whatever it uses; return the kind of its result.

    Parameters
    ----------
    kinds
        Of its arguments, those that are functions of the model left out.
    returns
        What it has to return, so that a number may stand for a vector of equal components.

    Raises
    ------
    SimulationError
        Where its text has no meaning for vectors.
    """
    tree = definition(function, name)
    arguments = [row.arg for row in tree.args.args if row.arg not in HANDED]
    writer = _Writer(module, function, name, count, returns)
    writer.kinds.update(zip(arguments, kinds, strict=True))
    tree.body = writer.block(tree.body)
    enter(module, function, ast.fix_missing_locations(tree), name, {})
    if writer.result is None:
        raise SimulationError(f"{name} returns nothing")
    return writer.result


def put_scheme(module: Module, stepper: Stepper, count: int) -> None:
    """Write start, step and velocities of a scheme for `count` coordinates, and what is gathered of each.

    Raises
    ------
    SimulationError
        Where a function of the scheme has no meaning for vectors.
    """
    state: Kind = NUMBER
    if stepper.whole:
        for name in ("start", "step"):
            collect(module, getattr(stepper, name), name, {})
    else:
        name = "start" if stepper.scaling is None else "start_unscaled"
        kinds = (NUMBER, VECTOR, VECTOR, NUMBER, NUMBER)
        state = collect_system(module, stepper.start, name, kinds, count)
        if stepper.scaling is not None:
            scaled = ", ".join(f"v[{k}] * p[-1]" for k in range(count))
            line = f"return start_unscaled(variant, u, ({scaled},), dt, p)"
            module.define("start(variant, u, v, dt, p)", line)
        found = collect_system(module, stepper.step, "step", (state, NUMBER, NUMBER, NUMBER), count)
        if found != (state, VECTOR):
            raise SimulationError("a step returns another state than the start")
    backward = no_backward if stepper.whole else stepper.backward
    collect_system(module, backward, "backward", (state, NUMBER), count, returns=VECTOR)
    velocities = (NUMBER, VECTOR, VECTOR, VECTOR, VECTOR)
    collect_system(module, gather.end_velocity, "end_velocity", velocities, count)
    difference = gather.centred_difference
    collect_system(module, difference, difference.__name__, (VECTOR, VECTOR, NUMBER), count)
    put_moves(module, count)
    for text in (gather.first_extrema, gather.next_extrema, gather.note_extrema):
        collect(module, text, text.__name__, {})
    further = range(1, count)
    sizes = " + ".join(f"abs({name}[{k}])" for k in range(count) for name in ("u", "v"))
    module.define("size_of(u, v)", f"return {sizes}")
    first = ", ".join(f"first_extrema(u[{k}], v[{k}])" for k in further)
    module.define("first_further(u, v)", f"return ({first},)")
    ahead = ", ".join(f"next_extrema(further[{k - 1}], u[{k}], v[{k}], 0.0)" for k in further)
    module.define("next_further(further, u, v)", f"return ({ahead},)")
    notes = (
        f"note_extrema(stats, case, {k * gather.N_STATS}, further[{k - 1}], 0.0)" for k in further
    )
    module.define("note_further(stats, case, further)", *notes)


def put_moves(module: Module, count: int) -> None:
    """Write what reads positions and velocities from arrays with a row of each."""
    for head, place in (
        ("initial_of(values, k)", "values[k, {}]"),
        ("point_of(values, case, k)", "values[{}, case, k]"),
    ):
        rows = [f"float({place.format(row)})" for row in range(2 * count)]
        halves = f"({', '.join(rows[:count])},), ({', '.join(rows[count:])},)"
        module.define(head, f"return {halves}")


class _Writer:
    """Writes out the text of one function."""

    def __init__(
        self,
        module: Module,
        function: Callable[..., Any],
        name: str,
        count: int,
        returns: Kind | None,
    ) -> None:
        self.module, self.name, self.count = module, name, count
        self.names: Mapping[str, Any] = function.__globals__
        self.kinds: dict[str, Kind] = {}
        self.wanted = returns
        self.result: Kind | None = None
        self.before: list[ast.stmt] = []
        self.hoisted: dict[ast.Call, str] = {}
        self.of_calls: dict[ast.AST, Kind] = {}

    def block(self, lines: Sequence[ast.stmt]) -> list[ast.stmt]:
        """Return statements for vectors; what has to be worked out before one of them stands before it."""
        found: list[ast.stmt] = []
        for line in lines:
            self.before = []
            after = self.statement(line)
            found += [*self.before, after]
            self.before = []
        return found

    def statement(self, line: ast.stmt) -> ast.stmt:
        match line:
            case ast.Assign(targets=[target], value=value):
                kind = self.kind(value)
                found = self.written(value)
                self.bind(target, kind)
                return ast.Assign([target], found, lineno=line.lineno)
            case ast.Return(value=ast.expr() as value):
                kind = self.kind(value)
                found = self.written(value)
                if kind in (NUMBER, ZERO) and self.wanted == VECTOR:
                    kind, found = VECTOR, self.repeated(found)
                self.result = kind if self.result is None else self.same(self.result, kind, line)
                return ast.Return(found)
            case ast.If(test, body, orelse):
                test = self.number(test)
                before = self.before
                changed = ast.If(test, self.block(body), self.block(orelse))
                self.before = before
                return changed
            case ast.For(ast.Name(id=name) as target, iterated, body, orelse):
                self.kinds[name] = NUMBER
                return ast.For(
                    target, iterated, self.block(body), self.block(orelse), lineno=line.lineno
                )
            case ast.Expr() | ast.Pass() | ast.Break() | ast.Continue():
                return line
            case _:
                raise self.refused(line)

    def bind(self, target: ast.expr, kind: Kind) -> None:
        match target:
            case ast.Name(id=name):
                self.kinds[name] = self.same(self.kinds.get(name, kind), kind, target)
            case ast.Tuple(elts=targets) if isinstance(kind, tuple) and len(kind) == len(targets):
                for one, of in zip(targets, kind, strict=True):
                    self.bind(one, of)
            case _:
                raise self.refused(target)

    def kind(self, node: ast.expr) -> Kind:
        match node:
            case ast.Constant(value=value):
                return ZERO if value == 0.0 else NUMBER
            case ast.Name(id=name):
                return self.kinds.get(name, NUMBER)
            case ast.Tuple(elts=parts):
                return tuple(self.kind(part) for part in parts)
            case ast.Subscript(value=value, slice=place):
                whole = self.kind(value)
                if isinstance(whole, tuple) and isinstance(place, ast.Constant):
                    return whole[int(str(place.value))]
                return self.refuse(node) if whole == VECTOR else NUMBER
            case ast.UnaryOp(operand=operand):
                return self.kind(operand)
            case ast.BinOp(left, operator, right):
                return self.of_operation(node, self.kind(left), operator, self.kind(right))
            case ast.IfExp(body=body, orelse=orelse):
                return VECTOR if VECTOR in (self.kind(body), self.kind(orelse)) else NUMBER
            case ast.Compare() | ast.BoolOp() | ast.Attribute():
                return NUMBER
            case ast.Call(ast.Name(id=name), arguments):
                if node not in self.of_calls:
                    self.of_calls[node] = self.of_call(name, arguments)
                return self.of_calls[node]
            case _:
                return self.refuse(node)

    def of_operation(self, node: ast.expr, left: Kind, operator: ast.operator, right: Kind) -> Kind:
        """Return the kind of a sum, a product with a number, or a quotient by one."""
        kinds = (left, right)
        if VECTOR not in kinds:
            is_zero = ZERO in kinds if isinstance(operator, ast.Mult) else left == right == ZERO
            return ZERO if is_zero else NUMBER
        match operator:
            case ast.Add() | ast.Sub() if NUMBER not in kinds:
                return VECTOR
            case ast.Mult() if kinds != (VECTOR, VECTOR):
                return VECTOR
            case ast.Div() if right == NUMBER:
                return VECTOR
            case _:
                return self.refuse(node)

    def of_call(self, name: str, arguments: Sequence[ast.expr]) -> Kind:
        """Return the kind of what a function returns, which is written out for vectors if it takes any."""
        if name in HANDED:
            return VECTOR if name == "acceleration" else NUMBER
        function = self.names.get(name)
        if function in _SOLVERS:
            return _SOLVERS[function][1]
        given = [row for row in arguments if getattr(row, "id", None) not in HANDED]
        kinds = [self.kind(row) for row in given]
        if name == "abs" or set(kinds) <= {NUMBER, ZERO}:
            return NUMBER
        if not isinstance(function, FunctionType):
            raise SimulationError(f"{self.name} calls {name} with a vector, which it cannot take")
        return collect_system(self.module, function, name, kinds, self.count)

    def written(self, node: ast.expr) -> ast.expr:
        """Return what works out a number, a vector as one tuple, or a tuple."""
        kind = self.kind(node)
        if kind == VECTOR and isinstance(node, ast.BinOp | ast.UnaryOp | ast.IfExp):
            parts = [self.component(node, k) for k in range(self.count)]
            return ast.Tuple(parts, ast.Load())
        match node:
            case ast.Tuple(elts=parts):
                return ast.Tuple([self.written(part) for part in parts], ast.Load())
            case ast.Call(ast.Name(id=name), arguments):
                return self.call(name, arguments)
            case ast.BinOp(left, operator, right):
                return ast.BinOp(self.written(left), operator, self.written(right))
            case ast.UnaryOp(operator, operand):
                return ast.UnaryOp(operator, self.written(operand))
            case ast.Compare(left, operators, others):
                return ast.Compare(self.number(left), operators, [self.number(o) for o in others])
            case ast.BoolOp(operator, values):
                return ast.BoolOp(operator, [self.number(value) for value in values])
            case ast.IfExp(test, body, orelse):
                return ast.IfExp(self.number(test), self.written(body), self.written(orelse))
            case _:
                return node

    def call(self, name: str, arguments: Sequence[ast.expr]) -> ast.expr:
        """Return a call of the function that stands for `name` here."""
        given = [
            self.vector(row) if name in HANDED and i < 2 else self.written(row)
            for i, row in enumerate(arguments)
        ]
        function = self.names.get(name)
        if name == "abs" and self.kind(arguments[0]) == VECTOR:
            collect(self.module, ELEMENTARY["sqrt"].full, "sqrt", {})
            squares = " + ".join(f"vector[{k}] * vector[{k}]" for k in range(self.count))
            self.module.define(f"{NORM}(vector)", f"return sqrt({squares})")
            name = NORM
        elif function in _SOLVERS:
            text = solver(self.count, _SOLVERS[function][0])
            collect(self.module, text, text.__name__, {})
            name = text.__name__
        return ast.Call(ast.Name(name, ast.Load()), given, [])

    def component(self, node: ast.expr, k: int) -> ast.expr:
        """Return what works out a component of a vector, or a number that stands for one."""
        if self.kind(node) != VECTOR:
            return self.written(node)
        match node:
            case ast.Name() | ast.Subscript():
                return ast.Subscript(node, ast.Constant(k), ast.Load())
            case ast.BinOp(left, operator, right):
                return ast.BinOp(self.component(left, k), operator, self.component(right, k))
            case ast.UnaryOp(operator, operand):
                return ast.UnaryOp(operator, self.component(operand, k))
            case ast.IfExp(test, body, orelse):
                return ast.IfExp(
                    self.number(test), self.component(body, k), self.component(orelse, k)
                )
            case ast.Call():
                return ast.Subscript(self.once(node), ast.Constant(k), ast.Load())
            case _:
                raise self.refused(node)

    def once(self, call: ast.Call) -> ast.expr:
        """Work out a call before the statement in which its components stand; return the name of its result."""
        name = self.hoisted.get(call)
        if name is None:
            name = self.hoisted[call] = f"vector_{len(self.hoisted)}"
            found = self.written(call)
            self.before.append(ast.Assign([ast.Name(name, ast.Store())], found, lineno=call.lineno))
        return ast.Name(name, ast.Load())

    def vector(self, node: ast.expr) -> ast.expr:
        """Return what works out a vector; a number stands for one of equal components."""
        found = self.written(node)
        return found if self.kind(node) == VECTOR else self.repeated(found)

    def number(self, node: ast.expr) -> ast.expr:
        if self.kind(node) == VECTOR:
            raise self.refused(node)
        return self.written(node)

    def repeated(self, node: ast.expr) -> ast.expr:
        return ast.Tuple([deepcopy(node) for _ in range(self.count)], ast.Load())

    def same(self, known: Kind, kind: Kind, node: ast.AST) -> Kind:
        if known != kind:
            raise self.refused(node)
        return kind

    def refuse(self, node: ast.AST) -> Kind:
        raise self.refused(node)

    def refused(self, node: ast.AST) -> SimulationError:
        return SimulationError(
            f"{self.name} cannot be written out for {self.count} coordinates: "
            f"{ast.unparse(node)!r} has no meaning for vectors"
        )
