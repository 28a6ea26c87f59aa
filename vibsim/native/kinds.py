"""Kinds (types) of values in compiled code, and the machine words that hold them.

A float has 64 bits, an integer 64 bits with sign, a boolean one bit. An array is a pointer with lengths, C-contiguous.
A tuple is the sequence of its entries, without an object of its own.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from llvmlite import ir

DOUBLE = ir.DoubleType()
WORD = ir.IntType(64)
BIT = ir.IntType(1)

FLOAT, WHOLE, TRUTH = "float", "whole number", "truth value"
"""Kinds of numbers."""
NOTHING: tuple[()] = ()
"""Kind and value of the result of a function that returns nothing."""

_WORDS: dict[str, ir.Type] = {FLOAT: DOUBLE, WHOLE: WORD, TRUTH: BIT}
_RANKS = (TRUTH, WHOLE, FLOAT)


@dataclass(frozen=True)
class ArrayKind:
    """An array of floats or of integers."""

    entry: str
    dims: int

    def __str__(self) -> str:
        return f"array of {self.entry}s, {self.dims} dimensions"


Kind = str | ArrayKind | tuple[Any, ...]
"""`FLOAT`, `WHOLE`, `TRUTH`, an array, or a tuple of kinds."""


@dataclass(frozen=True)
class Number:
    """A number at run time."""

    kind: str
    word: ir.Value


@dataclass(frozen=True)
class Array:
    """An array at run time."""

    kind: ArrayKind
    pointer: ir.Value
    lengths: tuple[ir.Value, ...]


Value = Number | Array | tuple[Any, ...]
"""A value at run time; a tuple of values is the value of a tuple."""


def kind_of(value: Value) -> Kind:
    """Return the kind of a value."""
    return tuple(map(kind_of, value)) if isinstance(value, tuple) else value.kind


def is_vector(kind: Kind) -> bool:
    """Tell whether a kind is a vector: a tuple of floats, which supports sums, multiples and a norm."""
    return isinstance(kind, tuple) and set(kind) == {FLOAT}


def joined(one: Kind, other: Kind) -> Kind | None:
    """Return the smallest common kind of two kinds; None if there is none."""
    if one == other:
        return one
    if isinstance(one, str) and isinstance(other, str):
        return max(one, other, key=_RANKS.index)
    if isinstance(one, tuple) and isinstance(other, tuple) and len(one) == len(other):
        parts = tuple(joined(a, b) for a, b in zip(one, other, strict=True))
        return None if None in parts else parts
    return None


def types_of(kind: Kind) -> list[ir.Type]:
    """Return the LLVM types of the words that hold a value of a kind."""
    if isinstance(kind, tuple):
        return [word for part in kind for word in types_of(part)]
    if isinstance(kind, ArrayKind):
        return [_WORDS[kind.entry].as_pointer(), *[WORD] * kind.dims]
    return [_WORDS[kind]]


def words_of(value: Value) -> list[ir.Value]:
    """Return the words that hold a value."""
    if isinstance(value, tuple):
        return [word for part in value for word in words_of(part)]
    return [value.word] if isinstance(value, Number) else [value.pointer, *value.lengths]


def value_of(kind: Kind, words: Iterator[ir.Value]) -> Value:
    """Return the value of a kind that the next words hold."""
    if isinstance(kind, tuple):
        return tuple([value_of(part, words) for part in kind])
    if isinstance(kind, ArrayKind):
        return Array(kind, next(words), tuple([next(words) for _ in range(kind.dims)]))
    return Number(kind, next(words))
