"""A compiler for plain Python functions on floats, integers, booleans, tuples and arrays.

The text of a module is parsed with `ast`, its types ("kinds") are inferred, and LLVM generates machine code: strictly,
operation by operation as written, so that compiled code gives the same bits as the text in Python. This package does
not depend on what the functions compute.

`vibsim.native.machine.machine_code` compiles; `vibsim.native.linking.link` makes an object file callable, with LLVM
alone.
"""
