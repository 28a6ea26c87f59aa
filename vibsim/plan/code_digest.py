"""Digests of the code that a job can run, so that a changed module reruns what it touches and no more.

The code is found from the module of the command: every import in it is followed, at any depth, those inside functions
and those of lazy names too (their twins under ``TYPE_CHECKING`` say where they stand). It is read, never executed. A
package counts with its ``__init__``, with what this uses itself, and with the modules whose names are asked of it.

Two things are no part of it, because what comes out of them is in every digest itself: the making of plans
(`_PLANNING`), whose outcome a job compares with the digest that it was given, before it starts; and the lists of all
models and schemes (`_LISTS`), of which a job uses its own entries (`vibsim.plan.build`). What only describes
types runs nothing.

To read 300 modules takes most of the time of a plan, so what each of them imports is kept in the private cache, under
the digest of the whole package.
Of a package that offers a model or a scheme (`vibsim.core.registry`) all files count, for what uses them.
"""

from __future__ import annotations

import ast
import hashlib
import importlib
import importlib.util
import json
import sys
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from functools import cache
from pathlib import Path

import vibsim
from vibsim.core import private_cache, registry
from vibsim.core.errors import VibsimError

PACKAGE = Path(vibsim.__file__).parent
_LISTS = ("vibsim.models", "vibsim.schemes")
MODULE = "module"
"""In place of a group of entry points: the module of a function of the user."""
_LOOKUP = "vibsim.core.registry"
"""By which every job finds its entries of the lists."""
_PLANNING = (
    "vibsim.cli",
    "vibsim.cli.arguments",
    "vibsim.cli.chosen_plans",
    "vibsim.plan.build",
    "vibsim.plan.cache",
    "vibsim.plan.choose",
    "vibsim.plan.workflow_names",
    "vibsim.experiment.derived",
    "vibsim.experiment.reading",
    "vibsim.experiment.solver_reading",
    "vibsim.plan.solver_plan",
)
"""From what a user writes to a plan; no job runs any of it once it has its plan (a test traces that)."""


@cache
def everything() -> str:
    """Return the digest of the whole package: of every file in it that is not made by Python."""
    return of_folder("vibsim")


_OF_SOLVERS = (
    "vibsim.cli.jobs.solve",
    "vibsim.cli.jobs.judge_levels",
    "vibsim.report.page.solver",
)
"""What jobs run in experiments with a solver of the user alone, whose digests begin there."""


def used_by(*names: str) -> str:
    """Return the digest of the modules `names` and of all that they can run of this package, templates included."""
    modules = reached(*names)
    folders = {_file(module).parent for module in modules if _is_package(module)}
    templates = (p for folder in folders for p in (folder / "templates").rglob("*") if p.is_file())
    return _digest([*map(_file, modules), *templates])


def reached(*names: str) -> set[str]:
    """Name the modules that the modules `names` can run, and themselves."""
    todo, done = {_LOOKUP, *names}, set[str]()
    while todo:
        module = todo.pop()
        done.add(module)
        imports = _of_all_modules().get(module) or _imports(module)
        others = (*_LISTS, *_PLANNING, *_OF_SOLVERS)
        todo |= {found for found in imports - done if found not in others}
    return done


def of_folder(name: str) -> str:
    """Return the digest of every file of package `name`."""
    return _digest(_files_in(_file(name).parent))


def of_offer(group: str, kind: str) -> str:
    """Return the digest of the package that offers a model or a scheme; empty where none does.

    Of all files of the outermost package that the module of the entry point stands in, or of the module alone.
    """
    point = registry.offers(group).get(kind)
    if point is None:
        return ""
    digest = hashlib.sha256(f"{registry.package_of(point)}\n{point.value}\n".encode())
    parts = point.module.split(".")
    for size in range(1, len(parts) + 1):
        # a namespace has no file
        spec = importlib.util.find_spec(".".join(parts[:size]))
        if spec is not None and spec.has_location and spec.origin is not None:
            file = Path(spec.origin)
            files = _files_in(file.parent) if spec.submodule_search_locations else [file]
            digest.update(_digest(files, file.parent).encode())
            return digest.hexdigest()
    raise VibsimError(f"the code of {registry.package_of(point)} cannot be found: {point.module}")


def of_module(name: str, folder: Path) -> str:
    """Return the digest of the outermost package of a module of the user, or of the module; empty where there is none.

    It is looked for as an import would, at last in `folder`, and not imported.
    """
    top = name.partition(".")[0]
    before = sys.path.copy()
    try:
        sys.path.append(str(folder))
        importlib.invalidate_caches()
        spec = importlib.util.find_spec(top)
    except (ImportError, ValueError):
        spec = None
    finally:
        sys.path[:] = before
    if spec is None:
        return ""
    digest = hashlib.sha256(f"{name}\n".encode())
    places = [Path(place) for place in spec.submodule_search_locations or ()]
    for place in places:
        # a folder without __init__ may hold anything
        files = _files_in(place) if spec.has_location else sorted(place.rglob("*.py"))
        digest.update(_digest(files, place).encode())
    if not places and spec.has_location and spec.origin is not None:
        digest.update(Path(spec.origin).read_bytes())
    return digest.hexdigest()


def home(item: object, package: str) -> tuple[str, str]:
    """Name a module of `package` that has `item`, an entry of its list, and the name that it has there."""
    for path in sorted(_file(package).parent.glob("[!_]*.py")):
        module = f"{package}.{path.stem}"
        for name, value in vars(importlib.import_module(module)).items():
            if value is item:
                return module, name
    return package, ""


def _files_in(folder: Path) -> Iterator[Path]:
    """Yield every file in a folder that is not made by Python."""
    return (p for p in folder.rglob("*") if p.is_file() and "__pycache__" not in p.parts)


def _digest(files: Iterable[Path], folder: Path | None = None) -> str:
    """Return the digest of files with their places in `folder`, by default that of this package."""
    digest = hashlib.sha256()
    for file in sorted(files):
        content = file.read_bytes()
        name = file.relative_to(folder or PACKAGE).as_posix()
        digest.update(f"{name} {len(content)}\n".encode())
        digest.update(content)
    return digest.hexdigest()


@cache
def _file(module: str) -> Path:
    path = PACKAGE.joinpath(*module.split(".")[1:])
    # a folder that is left over from a package that became a module is none
    return package if (package := path / "__init__.py").is_file() else path.with_suffix(".py")


def _is_package(module: str) -> bool:
    return _file(module).name == "__init__.py"


def _exists(module: str) -> bool:
    return module.split(".")[0] == "vibsim" and _file(module).is_file()


def _tree(module: str) -> ast.Module:
    return ast.parse(_file(module).read_bytes())


@cache
def _of_all_modules() -> Mapping[str, frozenset[str]]:
    """Return `_imports` of every module of the package that can be read."""

    def make() -> Mapping[str, frozenset[str]]:
        found = {}
        for file in PACKAGE.rglob("*.py"):
            parts = file.relative_to(PACKAGE.parent).with_suffix("").parts
            module = ".".join(parts).removesuffix(".__init__")
            # a file that nothing uses may be half written
            with suppress(SyntaxError):
                found[module] = _imports(module)
        return found

    def dump(found: Mapping[str, frozenset[str]]) -> bytes:
        return json.dumps({module: sorted(names) for module, names in found.items()}).encode()

    def load_cached(content: bytes) -> Mapping[str, frozenset[str]] | None:
        try:
            return {module: frozenset(names) for module, names in json.loads(content).items()}
        except (ValueError, TypeError, AttributeError):
            return None

    return private_cache.cached("imports", everything(), make, dump, load_cached)


@cache
def _imports(module: str) -> frozenset[str]:
    """Name the modules that `module` hands work to, and the packages that Python runs before it."""
    parts = module.split(".")
    found = {".".join(parts[:size]) for size in range(1, len(parts))}
    nodes = list(_run(_tree(module)))
    used = {node.id for node in nodes if isinstance(node, ast.Name)}
    bound = {as_: place for node in nodes for as_, place in _bound(node)}
    for name, place in bound.items():
        if not _is_package(module) or name in used:
            found |= _homes(*place)
    for node in nodes:
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            package, name = bound.get(node.value.id, ("", ""))
            if package and _exists(whole := f"{package}.{name}".rstrip(".")):
                found |= _homes(whole, node.attr)
    return frozenset(found)


def _run(tree: ast.AST, types: bool = False) -> Iterator[ast.AST]:
    """Yield every node that runs; those that only describe types, too, where `types` are wanted."""
    todo = [tree]
    while todo:
        node = todo.pop()
        yield node
        match node:
            case ast.If(test=ast.Name(id="TYPE_CHECKING")) if not types:
                todo.extend(node.orelse)
            case _:
                todo.extend(ast.iter_child_nodes(node))


def _bound(node: ast.AST) -> Iterator[tuple[str, tuple[str, str]]]:
    """Yield the names that an import of this package binds, each with the module and the name in it."""
    if isinstance(node, ast.Import):
        for alias in node.names:
            if _exists(alias.name):
                yield alias.asname or alias.name.split(".")[0], (alias.name, "")
    elif isinstance(node, ast.ImportFrom) and node.module and _exists(node.module):
        for alias in node.names:
            yield alias.asname or alias.name, (node.module, alias.name)


def _homes(module: str, name: str) -> set[str]:
    """Name the modules behind a name: where a package hands it on, that from which it comes."""
    if name and _exists(deeper := f"{module}.{name}"):
        return {deeper}
    if not name or not _is_package(module):
        return {module}
    handed_on = _handed_on(module)
    return {module} | (_homes(*handed_on[name]) if name in handed_on else set())


@cache
def _handed_on(package: str) -> dict[str, tuple[str, str]]:
    """Return the names that a package has from elsewhere, those that it loads on first use too."""
    return dict(bound for node in _run(_tree(package), types=True) for bound in _bound(node))
