"""Digests of the code that a job runs, so that a changed module reruns what it touches and no more.

A job uses the modules it names and those they import, read from their source: nothing is executed.
The lists of all models and schemes are not followed: a job uses its own model and its own schemes. Nor is
the reading of experiment files: what comes out of it is in the digest itself. What jobs work out from an
experiment (members, samples, ends) is named by `vibsim.plan.build`.
"""

from __future__ import annotations

import ast
import hashlib
import importlib.util
from collections.abc import Iterable, Iterator
from functools import cache, lru_cache
from pathlib import Path

import vibsim

PACKAGE = Path(vibsim.__file__).parent
_NOT_FOLLOWED = ("vibsim.cli", "vibsim.errors", "vibsim.plan", "vibsim.spec")
_LISTS = ("vibsim", "vibsim.models", "vibsim.schemes", "vibsim.store")


@lru_cache
def everything() -> str:
    """Return the digest of the whole package: of every file in it that is not made by Python."""
    return _digest(p for p in PACKAGE.rglob("*") if p.is_file() and "__pycache__" not in p.parts)


def used_by(*names: str) -> str:
    """Return the digest of the modules `names` and of all that they import from this package.

    Parameters
    ----------
    names
        Modules or packages; a package counts with all its modules.
    """
    todo = {module for name in names for module in _modules(name)}
    done: set[str] = set()
    while todo:
        module = todo.pop()
        done.add(module)
        todo.update(found for found in _imports(module) if found not in done)
    return _digest(_file(module) for module in done)


def of_folder(name: str) -> str:
    """Return the digest of every file of package `name`, templates included."""
    folder = _file(name).parent
    return _digest(p for p in folder.rglob("*") if p.is_file() and "__pycache__" not in p.parts)


def home(item: object, package: str) -> str:
    """Name the module of `package` that defines `item`, an entry of its list."""
    for name in _modules(package):
        module = importlib.import_module(name)
        if name != package and any(value is item for value in vars(module).values()):
            return name
    return package


def _digest(files: Iterable[Path]) -> str:
    digest = hashlib.sha256()
    for file in sorted(files):
        content = file.read_bytes()
        name = file.relative_to(PACKAGE).as_posix()
        digest.update(f"{name} {len(content)}\n".encode())
        digest.update(content)
    return digest.hexdigest()


def _file(module: str) -> Path:
    path = PACKAGE.joinpath(*module.split(".")[1:])
    return path / "__init__.py" if path.is_dir() else path.with_suffix(".py")


def _modules(name: str) -> list[str]:
    file = _file(name)
    if file.name != "__init__.py":
        return [name]
    found = sorted(file.parent.rglob("*.py"))
    parts = (p.relative_to(PACKAGE).with_suffix("").parts for p in found)
    return [".".join(("vibsim", *part)).removesuffix(".__init__") for part in parts]


@cache
def _imports(module: str) -> frozenset[str]:
    return _imports_of(_file(module).read_bytes())


@cache
def _imports_of(source: bytes) -> frozenset[str]:
    found = {name for name in _named(ast.parse(source)) if name.split(".")[0] == "vibsim"}
    return frozenset(name for name in found if _is_followed(name))


def _is_followed(module: str) -> bool:
    return module not in _LISTS and not module.startswith(_NOT_FOLLOWED)


def _named(tree: ast.AST) -> Iterator[str]:
    """Name every module that `tree` imports when it runs."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            for alias in node.names:
                deeper = f"{node.module}.{alias.name}"
                yield deeper if _exists(deeper) else node.module
        elif isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test):
            continue
        else:
            yield from _named(node)


def _exists(module: str) -> bool:
    return module.startswith("vibsim.") and _file(module).is_file()
