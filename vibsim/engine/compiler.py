"""``compiler.py TEXT ENTRY``: compile a kernel with numba and write machine code to the standard output.

It runs in a process of its own, so that numba is in the memory of no job: of a kernel that is kept, a job needs the
object file alone. The first line is the name that the entry has in the object file.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any


def machine_code(text: str, name: str, entry: str) -> bytes:
    """Compile the module `text` and return the name of `entry` in the object file, a line feed, and the file."""
    namespace: dict[str, Any] = {}
    exec(compile(text, name, "exec"), namespace)
    library = namespace[entry]._library
    # numba has no public way to the object file of a callback
    code: bytes = library._codegen._tm.emit_object(library._final_module)
    return f"{namespace[entry].native_name}\n".encode() + code


if __name__ == "__main__":
    path, entry = sys.argv[1:]
    sys.stdout.buffer.write(machine_code(Path(path).read_text(encoding="utf-8"), path, entry))
