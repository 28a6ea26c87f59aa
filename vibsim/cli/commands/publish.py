"""``vibsim report NAME --publish DIR``: copy pages, data, experiment file and metadata to a self-contained folder.

The metadata are an RO-Crate 1.1 (https://w3id.org/ro/crate/1.1): JSON-LD on every file and its provenance.
"""

from __future__ import annotations

import json
import mimetypes
import os
import shutil
from argparse import Namespace
from collections.abc import Callable, Iterable, Iterator, Sequence
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from urllib.parse import quote

from vibsim import store
from vibsim.cli.commands import verify
from vibsim.cli.jobs.common import one_plan, read_all, refusal
from vibsim.core import regular_files
from vibsim.core.errors import VibsimError
from vibsim.core.home import typed
from vibsim.plan import Plan
from vibsim.store.reading import read_provenance

METADATA = "ro-crate-metadata.json"
INPUT = Path("experiment")  # folder of the experiment file and of the files that it names
NO_LICENCE = "No licence is given: ask the authors before you use or share these results."
_CONTEXT = ["https://w3id.org/ro/crate/1.1/context", {"sha256": "http://schema.org/sha256"}]
_TYPES = {
    **{".nc": "application/x-netcdf", ".tex": "application/x-tex", ".csv": "text/csv"},
    **{".yaml": "application/yaml", ".yml": "application/yaml"},
}


def publish(options: Namespace) -> int:
    """Copy complete and current results of one experiment to a new folder, with an index and metadata.

    Raises InputError where the folder is not empty, and VibsimError where a file is damaged, missing, or older than a
    change of the experiment file.
    """
    target: Path = options.publish.absolute()
    if target.exists() and not (target.is_dir() and not any(target.iterdir())):
        raise refusal("--publish", options.publish, "must be a new or an empty folder")
    plan, results = one_plan(options)
    with verify.locked(results):
        _check(plan, options, results)
        target.parent.mkdir(parents=True, exist_ok=True)
        with TemporaryDirectory(prefix=f".{target.name}.", dir=target.parent) as temporary:
            folder = Path(temporary) / "crate"
            _fill(folder, plan, results, options.license)
            folder.replace(target)
    print(f"published: {target / 'index.html'}")
    return 0


def _check(plan: Plan, options: Namespace, results: Path) -> None:
    _, problems = verify.compare(results, plan.key)
    if problems:
        text = "\n".join(f"{path}: {problem}" for path, problem in problems.items())
        command = typed(plan.command_to_run(str(plan.file)))
        raise VibsimError(f"{text}\nonly whole results are published: {command}")
    current: dict[str, Callable[[Path], Any]] = {
        shard.path: partial(store.check, digest=shard.digest) for shard in plan.shards
    }
    current[plan.convergence] = partial(store.check, digest=plan.analysis)
    current[plan.summary] = partial(store.read_json, digest=plan.analysis, name=plan.key)
    read_all(options, results, current)


def _fill(folder: Path, plan: Plan, results: Path, licence: str | None) -> None:
    from vibsim.report import write_index

    skipped = shutil.ignore_patterns(*verify.NO_RESULTS, verify.TIMESTAMP)
    shutil.copytree(results / plan.key, folder / plan.key, ignore=skipped)
    write_index(folder)
    sources = dict(inputs(plan))
    for name, file in sources.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(file, folder / name)
    crate = metadata(folder, plan, list(sources), licence)
    text = json.dumps(crate, indent=1, ensure_ascii=False)
    store.write_text(folder / METADATA, f"{text}\n")


def inputs(plan: Plan) -> Iterator[tuple[str, Path]]:
    """Yield the experiment file and all files that it names, by paths in the crate; relative paths stay valid."""
    main = plan.source_file
    if main is None:
        return
    files = [main, *(main.parent / name for name, _ in plan.inputs)]
    paths = [Path(os.path.normpath(file.absolute())) for file in files]
    top = os.path.commonpath([path.parent for path in paths])
    for path in dict.fromkeys(paths):
        yield (INPUT / path.relative_to(top)).as_posix(), path


def metadata(
    folder: Path, plan: Plan, inputs: Sequence[str], licence: str | None = None
) -> dict[str, Any]:
    """Return the JSON-LD metadata of a folder with results; `inputs` are the experiment file and its tables.

    Source: RO-Crate Metadata Specification 1.1: the metadata descriptor and the root (section "Root Data Entity"),
    files ("Data Entities"), the licence ("Contextual Entities") and the run that made them ("Provenance of entities").
    """
    paths = filter(Path.is_file, sorted(folder.rglob("*")))
    files = [path.relative_to(folder).as_posix() for path in paths]
    versions = dict(read_provenance(folder / plan.convergence)["versions"])
    own_version = versions.pop("vibsim")
    is_address = licence is not None and licence.startswith(("https://", "http://"))
    graph: list[dict[str, Any]] = [
        {
            "@id": METADATA,
            "@type": "CreativeWork",
            "conformsTo": {"@id": "https://w3id.org/ro/crate/1.1"},
            "about": {"@id": "./"},
        },
        {
            "@id": "./",
            "@type": "Dataset",
            "name": plan.title,
            "description": _description(folder, plan),
            "datePublished": datetime.now(UTC).date().isoformat(),
            "license": {"@id": licence} if is_address else licence or NO_LICENCE,
            "hasPart": _references(files),
            "mentions": {"@id": "#run"},
        },
        *(_file(folder, name) for name in files),
        {
            "@id": "#run",
            "@type": "CreateAction",
            "name": plan.command_to_run(plan.name),
            "instrument": {"@id": "#vibsim"},
            "object": _references(inputs),
            "result": _references(name for name in files if name not in inputs),
        },
        {
            "@id": "#vibsim",
            "@type": "SoftwareApplication",
            "name": "vibsim",
            "version": own_version,
            "softwareRequirements": [f"{name} {text}" for name, text in sorted(versions.items())],
        },
    ]
    if is_address:
        description = {"name": licence, "description": "The licence of these results."}
        graph.append({"@id": licence, "@type": "CreativeWork", **description})
    return {"@context": _CONTEXT, "@graph": graph}


def _description(folder: Path, plan: Plan) -> str:
    summary = store.read_json(folder / plan.summary)
    passed = sum(check["status"] == "PASS" for check in summary["checks"])
    sentences = [f"Results of the vibsim experiment {plan.key}."]
    sentences += [f"{passed} of {len(summary['checks'])} checks passed: {summary['status']}."]
    sentences += [f"Source: {plan.source}."] if plan.source else []
    sentences += [f"Settings: {', '.join(plan.settings)}."] if plan.settings else []
    return " ".join(sentences)


def _references(names: Iterable[str]) -> Any:
    """Return references to files; a single one is not a list in compacted JSON-LD."""
    references = [{"@id": _address(name)} for name in names]
    return references[0] if len(references) == 1 else references


def _address(name: str) -> str:
    """Return a path as a relative IRI, which keeps non-ASCII letters."""
    return "".join(char if ord(char) > 127 else quote(char) for char in name)


def _file(folder: Path, name: str) -> dict[str, str]:
    path = folder / name
    kind = _TYPES.get(path.suffix) or mimetypes.guess_type(name)[0] or "application/octet-stream"
    return {
        "@id": _address(name),
        "@type": "File",
        "name": path.name,
        "encodingFormat": kind,
        "contentSize": str(path.stat().st_size),
        "sha256": regular_files.digest(path),
    }
