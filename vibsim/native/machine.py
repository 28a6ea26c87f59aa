"""From a module of text to an object file for this machine."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from typing import Any

from llvmlite import binding, ir

from vibsim.native.kinds import FLOAT, WHOLE, ArrayKind, Kind, types_of, value_of
from vibsim.native.linking import make_ready
from vibsim.native.lowering import Program
from vibsim.native.source import Source

_LETTERS = {"f": FLOAT, "i": WHOLE}


LONG = 11_000
"""Length of a text, in characters, above which superword-level (SLP) vectorisation is used; it gives the same bits.

Kernels for 8 coordinates are longer and become two to three times as fast; those for one coordinate are shorter and
would become 10 % slower. [measured]
"""


def machine_code(text: str, function: str, kinds: str) -> bytes:
    """Compile a function and what it calls.

    Parameters
    ----------
    text
        A module: functions marked ``@compiled`` (inlined into their callers) or ``@called``, numbers, tuples of
        numbers.
    function
        The entry point, which returns nothing. In the object file it has the same name, and takes arrays as a pointer
        and lengths.
    kinds
        A word for each of its arguments: ``f3`` is a three-dimensional array of floats, ``i2`` a two-dimensional array
        of integers, ``f`` a float and ``i`` an integer.

    Raises
    ------
    NativeError
        If the text cannot be compiled.
    """
    code: bytes = _target().emit_object(optimised(text, function, kinds))
    return code


def optimised(text: str, function: str, kinds: str) -> Any:
    """Return the optimised LLVM module from which `machine_code` makes an object file; ``str`` shows it."""
    program = Program(Source.read(text))
    _write_entry(program, function, tuple(map(_kind, kinds.split())))
    module = binding.parse_assembly(str(program.module))
    target = _target()
    module.triple, module.data_layout = target.triple, str(target.target_data)
    module.verify()
    _optimise(module, target, len(text) > LONG)
    return module


def _kind(word: str) -> Kind:
    letter, dims = word[0], int(word[1:] or 0)
    return ArrayKind(_LETTERS[letter], dims) if dims else _LETTERS[letter]


def _write_entry(program: Program, name: str, kinds: tuple[Kind, ...]) -> None:
    types = [word for kind in kinds for word in types_of(kind)]
    entry = ir.Function(program.module, ir.FunctionType(ir.VoidType(), types), name)
    builder = ir.IRBuilder(entry.append_basic_block("entry"))
    words: Iterator[ir.Value] = iter(entry.args)
    program.call(builder, name, [value_of(kind, words) for kind in kinds])
    builder.ret_void()


def _optimise(module: Any, target: Any, has_many_alike: bool) -> None:
    options = binding.create_pipeline_tuning_options(speed_level=3)
    options.loop_vectorization = True
    options.slp_vectorization = has_many_alike
    builder = binding.create_pass_builder(target, options)
    builder.getModulePassManager().run(module, builder)


@cache
def _target() -> Any:
    """Return the target machine: this processor with all its features."""
    make_ready()
    return binding.Target.from_default_triple().create_target_machine(
        opt=3,
        cpu=binding.get_host_cpu_name(),
        features=binding.get_host_cpu_features().flatten(),
        reloc="static" if binding.get_default_triple().startswith("x86") else "default",
        codemodel="jitdefault",
        jit=True,
    )
