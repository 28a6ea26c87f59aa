"""Machine code from plain Python functions over floats, whole numbers, truth values, tuples and arrays.

The text of a module is read with `ast`, its kinds are inferred, and LLVM makes machine code of it: strictly, operation
by operation as it is written, so that compiled code gives the bits that the same text gives in Python. Nothing here
knows what the functions are for.

`vibsim.native.machine.machine_code` compiles; `vibsim.native.linking.link` makes what was compiled callable, which
needs no more than LLVM.
"""
