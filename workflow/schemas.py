"""The JSON Schemas of ``workflow/schemas``: ``python workflow/schemas.py [--check]``.

They are generated from the code that reads experiment files, writes summaries and verdicts, and prints JSON. Editors
and programs that read results use them.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from vibsim.analysis import summary_schema
from vibsim.cli import json_schemas
from vibsim.convergence.study import verdict_schema
from vibsim.experiment.schema import document, solver

SCHEMAS: Mapping[str, Callable[[], dict[str, Any]]] = {
    "experiment": document.schema,
    "plan": json_schemas.plan,
    "run": json_schemas.run,
    "solver": solver.schema,
    "summary": summary_schema.schema,
    "verdict": verdict_schema.schema,
}
FOLDER = Path(__file__).resolve().parent / "schemas"


def text(name: str) -> str:
    """Return the content of the file of a schema."""
    return json.dumps(SCHEMAS[name](), indent=2, ensure_ascii=False) + "\n"


def main(arguments: list[str], folder: Path = FOLDER) -> int:
    """Write the schemas, or with ``--check`` report which files are not current; return 1 if there are any."""
    files = {folder / f"{name}.schema.json": text(name) for name in SCHEMAS}
    if "--check" not in arguments:
        for path, content in files.items():
            path.write_text(content, encoding="utf-8")
        return 0
    stale = [
        f"{path.name} is not current"
        for path, content in files.items()
        if not path.is_file() or path.read_text("utf-8") != content
    ]
    print(*stale or ["the JSON Schemas are current"], sep="\n")
    return 1 if stale else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
