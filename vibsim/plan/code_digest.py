"""Digests of the code that a job can run, so that a changed module reruns only the jobs that can run it.

The search starts at the module of the command and follows every import, at any depth, also imports inside functions and
of lazily loaded names (their imports under ``TYPE_CHECKING`` say which module defines them). Code is parsed, never
executed. Of a package the digest covers ``__init__``, what ``__init__`` itself uses, and the modules that define the
names imported from the package. Imports for type checking alone are ignored.

Two parts are excluded, because their results are in the digest anyway: the making of plans (`_PLANNING`), since a job
compares the digest of its plan with the one that it was started for; and the registries of all models and schemes
(`_LISTS`), of which a job uses a few entries (`vibsim.plan.build`).

Parsing 300 modules takes most of the time of a plan, so the imports of each module are stored in the private cache,
under the digest of the whole package.
The digest of a package that offers a model or a scheme (`vibsim.core.registry`) covers all files of that package.
"""

from __future__ import annotations

import ast
import hashlib
import importlib
import importlib.util
import json
import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from functools import cache
from pathlib import Path

import vibsim
from vibsim.core import private_cache, registry
from vibsim.core.errors import VibsimError
from vibsim.core.modules import find

PACKAGE = Path(vibsim.__file__).parent
_LISTS = ("vibsim.models", "vibsim.schemes")
MODULE = "module"
"""Takes the place of an entry-point group where the code is the module of a user's function."""
_LOOKUP = "vibsim.core.registry"
"""Every job looks up its models and schemes with this module."""
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
"""Modules that turn an experiment file into a plan; a job that has its plan runs none of them (a test traces this)."""


@cache
def everything() -> str:
    """Return the digest of the whole package: of every file except Python's bytecode."""
    return of_folder("vibsim")


_SOLVER_ONLY = (
    "vibsim.cli.jobs.solve",
    "vibsim.cli.jobs.judge_levels",
    "vibsim.report.page.solver",
)
"""Modules that only experiments with a user's own solver run; the search for their digests starts at these modules."""


def used_by(*names: str) -> str:
    """Return the digest of the modules `names` and of all code of this package that they can run, with templates."""
    modules = reached(*names)
    folders = {_file(module).parent for module in modules if _is_package(module)}
    templates = (p for folder in folders for p in _files_in(folder / "templates"))
    return _digest([*map(_file, modules), *templates])


def reached(*names: str) -> set[str]:
    """Return the modules `names` and all modules that they can run."""
    todo, done = {_LOOKUP, *names}, set[str]()
    while todo:
        module = todo.pop()
        done.add(module)
        imports = _all_imports().get(module) or _imports(module)
        todo |= imports - done - {*_LISTS, *_PLANNING, *_SOLVER_ONLY}
    return done


def of_folder(name: str) -> str:
    """Return the digest of all files of package `name`."""
    return _digest(_files_in(_file(name).parent))


def of_offer(group: str, kind: str) -> str:
    """Return the digest of the package that offers a model or a scheme; empty if no installed package does.

    It covers all files of the outermost package that contains the module of the entry point, or a single module.
    """
    point = registry.offers(group).get(kind)
    if point is None:
        return ""
    digest = hashlib.sha256(f"{registry.package_of(point)}\n{point.value}\n".encode())
    parts = point.module.split(".")
    for size in range(1, len(parts) + 1):
        # a namespace package has no file
        spec = importlib.util.find_spec(".".join(parts[:size]))
        if spec is not None and spec.has_location and spec.origin is not None:
            file = Path(spec.origin)
            files = _files_in(file.parent) if spec.submodule_search_locations else [file]
            digest.update(_digest(files, file.parent).encode())
            return digest.hexdigest()
    raise VibsimError(f"the code of {registry.package_of(point)} cannot be found: {point.module}")


def of_module(name: str, folder: Path) -> str:
    """Return the digest of the outermost package of a user's module, or of the module itself; empty if not found.

    The module is searched for on `sys.path` and then in `folder`, but not imported.
    """
    spec = find(name, folder)
    if spec is None:
        return ""
    digest = hashlib.sha256(f"{name}\n".encode())
    places = [Path(place) for place in spec.submodule_search_locations or ()]
    for place in places:
        # a folder without __init__ may contain any other files
        files = _files_in(place) if spec.has_location else sorted(place.rglob("*.py"))
        digest.update(_digest(files, place).encode())
    if not places and spec.has_location and spec.origin is not None:
        digest.update(Path(spec.origin).read_bytes())
    return digest.hexdigest()


def home(item: object, package: str) -> tuple[str, str]:
    """Return the module of `package` that defines `item`, an entry of its registry, and the name of `item` there."""
    for path in sorted(_file(package).parent.glob("[!_]*.py")):
        module = f"{package}.{path.stem}"
        for name, value in vars(importlib.import_module(module)).items():
            if value is item:
                return module, name
    return package, ""


def _files_in(folder: Path) -> Iterator[str]:
    """Yield the path of every file in a folder except Python's bytecode."""
    # as text: every process of a run reads the whole package, and with Path this would take three times as long
    for place, folders, names in os.walk(folder):
        if "__pycache__" in folders:
            folders.remove("__pycache__")
        yield from filter(os.path.isfile, (f"{place}/{name}" for name in names))


def _digest(files: Iterable[str | Path], folder: Path | None = None) -> str:
    """Return the digest of files and of their paths relative to `folder`, by default the folder of this package."""
    digest = hashlib.sha256()
    for file in sorted(map(str, files), key=lambda path: path.split("/")):
        content = Path(file).read_bytes()
        name = file.removeprefix(f"{folder or PACKAGE}/")
        digest.update(f"{name} {len(content)}\n".encode())
        digest.update(content)
    return digest.hexdigest()


@cache
def _file(module: str) -> Path:
    path = PACKAGE.joinpath(*module.split(".")[1:])
    # a folder without __init__ may be left over from a package that became a module
    return package if (package := path / "__init__.py").is_file() else path.with_suffix(".py")


def _is_package(module: str) -> bool:
    return _file(module).name == "__init__.py"


def _exists(module: str) -> bool:
    return module.split(".")[0] == "vibsim" and _file(module).is_file()


def _tree(module: str) -> ast.Module:
    return ast.parse(_file(module).read_bytes())


@cache
def _all_imports() -> Mapping[str, frozenset[str]]:
    """Return `_imports` of every module of the package that can be parsed."""

    def make() -> Mapping[str, frozenset[str]]:
        imports = {}
        for file in PACKAGE.rglob("*.py"):
            parts = file.relative_to(PACKAGE.parent).with_suffix("").parts
            module = ".".join(parts).removesuffix(".__init__")
            # an unused file may have syntax errors, such as one that is being edited
            with suppress(SyntaxError):
                imports[module] = _imports(module)
        return imports

    def dump(imports: Mapping[str, frozenset[str]]) -> bytes:
        return json.dumps({module: sorted(names) for module, names in imports.items()}).encode()

    def load_cached(content: bytes) -> Mapping[str, frozenset[str]] | None:
        try:
            return {module: frozenset(names) for module, names in json.loads(content).items()}
        except (ValueError, TypeError, AttributeError):
            return None

    return private_cache.cached("imports", everything(), make, dump, load_cached)


@cache
def _imports(module: str) -> frozenset[str]:
    """Return the modules that `module` imports, and its parent packages, which Python runs first."""
    parts = module.split(".")
    imports = {".".join(parts[:size]) for size in range(1, len(parts))}
    nodes = list(_nodes(_tree(module)))
    used = {node.id for node in nodes if isinstance(node, ast.Name)}
    imported = {alias: origin for node in nodes for alias, origin in _imported_names(node)}
    for alias, origin in imported.items():
        if not _is_package(module) or alias in used:
            imports |= _origins(*origin)
    for node in nodes:
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            package, name = imported.get(node.value.id, ("", ""))
            if package and _exists(whole := f"{package}.{name}".rstrip(".")):
                imports |= _origins(whole, node.attr)
    return frozenset(imports)


def _nodes(tree: ast.AST, types: bool = False) -> Iterator[ast.AST]:
    """Yield every node of a syntax tree; nodes under ``if TYPE_CHECKING`` only where `types` is true."""
    todo = [tree]
    while todo:
        node = todo.pop()
        yield node
        match node:
            case ast.If(test=ast.Name(id="TYPE_CHECKING")) if not types:
                todo.extend(node.orelse)
            case _:
                todo.extend(ast.iter_child_nodes(node))


def _imported_names(node: ast.AST) -> Iterator[tuple[str, tuple[str, str]]]:
    """Yield each name that an import from this package binds, with the module and the name in that module."""
    if isinstance(node, ast.Import):
        for alias in node.names:
            if _exists(alias.name):
                yield alias.asname or alias.name.split(".")[0], (alias.name, "")
    elif isinstance(node, ast.ImportFrom) and node.module and _exists(node.module):
        for alias in node.names:
            yield alias.asname or alias.name, (node.module, alias.name)


def _origins(module: str, name: str) -> set[str]:
    """Return the modules that an import of `name` from `module` runs: for a re-exported name also the defining one."""
    if name and _exists(submodule := f"{module}.{name}"):
        return {submodule}
    if not name or not _is_package(module):
        return {module}
    reexports = _reexports(module)
    return {module} | (_origins(*reexports[name]) if name in reexports else set())


@cache
def _reexports(package: str) -> dict[str, tuple[str, str]]:
    """Return module and name of every name that a package imports, also of lazily loaded names."""
    return dict(row for node in _nodes(_tree(package), types=True) for row in _imported_names(node))
