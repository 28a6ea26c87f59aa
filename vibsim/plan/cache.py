"""Cache of plans on disk, so that a hundred experiment files do not slow the start.

The key of an entry in the private cache (`vibsim.core.private_cache`) is a digest of the experiment file and of the
code of the whole package. The entry also holds the digest of every table that the file names. An entry that is stale or
damaged is built again. No plan is stored in a results folder: the folder may come from somebody else, and the content
of a plan goes into commands.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import TYPE_CHECKING

from vibsim.core import private_cache, regular_files
from vibsim.core.errors import Fault, InputError, VibsimError
from vibsim.experiment.yaml.file_content import read_bytes
from vibsim.plan import code_digest
from vibsim.plan.choose import Choice
from vibsim.plan.jobs import Plan, from_json, to_json
from vibsim.plan.versions import DRAWING, NUMERICAL, versions

if TYPE_CHECKING:
    from vibsim.experiment import Experiment

Resolver = Callable[["Experiment"], "Experiment"]
"""Chooses the levels of an experiment that names a tolerance instead; needs a pilot run, which a plan cannot do."""


def load(choice: Choice, resolve: Resolver | None = None, *, cached: bool = False) -> Plan:
    """Return the plan of an experiment file, or of one member of its sweep.

    Parameters
    ----------
    choice
        The file, its collection, and the member if only one is wanted.
    resolve
        Chooses the levels of an experiment with a tolerance.
    cached
        Whether to read the plan from the cache, and to store it there.

    Raises
    ------
    InputError
        When the file is refused.
    """

    def build() -> Plan:
        return replace(_built(choice, resolve), file=choice.word, settings=choice.settings)

    def dump(plan: Plan) -> bytes | None:
        # a file that changed while it was read must not be stored under the digest of its old bytes
        is_same = key == _key(choice) and _has_inputs(plan, choice)
        return to_json(plan).encode() if is_same else None

    def load_cached(content: bytes) -> Plan | None:
        try:
            plan = from_json(content.decode(), choice.word, choice.key)
        except (ValueError, RecursionError):
            return None
        return plan if _has_inputs(plan, choice) else None

    key = _key(choice) if cached else ""
    return private_cache.cached("plans", key, build, dump, load_cached) if key else build()


def _built(choice: Choice, resolve: Resolver | None) -> Plan:
    from vibsim.experiment import Experiment, reading
    from vibsim.experiment.settings import with_settings
    from vibsim.experiment.yaml.parse import read

    source = with_settings(read(choice.file, reading.KEYS), choice.settings)
    if reading.SOLVER in source.data:
        from vibsim.experiment.solver_reading import read_solver
        from vibsim.plan import solver_plan

        solved = read_solver(source, choice.collection, choice.file)
        return solver_plan.build(solved if choice.case is None else solved.alone(choice.case))
    from vibsim.plan import build

    spec = reading.build(source, choice.collection, choice.file.stem, choice.file)
    return build.build(_resolved(Experiment.made_of(spec), choice, resolve))


def _resolved(experiment: Experiment, choice: Choice, resolve: Resolver | None) -> Experiment:
    """Return the experiment, or the chosen member, with its levels filled in."""
    chosen = experiment if choice.case is None else experiment.alone(choice.case)
    if experiment.levels:
        return chosen
    if resolve is None:
        raise VibsimError(f"{choice.file}: nothing is there to choose levels for a tolerance")
    # The levels are chosen for the whole sweep, so that a member alone has the same numbers as in the sweep.
    return chosen.with_levels(resolve(experiment).levels)


def load_all(
    choices: Iterable[Choice], resolve: Resolver | None = None, *, cached: bool = False
) -> dict[str, Plan]:
    """Return the plans of several experiment files by key; raise one InputError with the faults of all files."""
    plans: dict[str, Plan] = {}
    faults: list[Fault] = []
    for choice in choices:
        try:
            plan = load(choice, resolve, cached=cached)
        except InputError as error:
            faults.extend(error.faults)
        else:
            plans[plan.key] = plan
    if faults:
        raise InputError(faults)
    return plans


def _key(choice: Choice) -> str:
    """Return the key of the cache entry; empty when the file cannot be read."""
    try:
        content = read_bytes(choice.file)
    except InputError:
        return ""
    libraries = repr(versions(NUMERICAL + DRAWING))
    words = [choice.collection, choice.name, str(choice.case), code_digest.everything(), libraries]
    words.append(json.dumps(choice.settings))
    return hashlib.sha256(b"\0".join([*(word.encode() for word in words), content])).hexdigest()


def _has_inputs(plan: Plan, choice: Choice) -> bool:
    """Tell whether tables and packages are still those that the plan was made from."""
    folder = choice.file.parent
    for group, name, digest in plan.packages:
        current = (
            code_digest.of_module(name, folder)
            if group == code_digest.MODULE
            else code_digest.of_offer(group, name)
        )
        if current != digest:
            return False
    for path, digest in plan.inputs:
        try:
            if regular_files.digest(folder / path) != digest:
                return False
        except (OSError, ValueError):
            return False
    return True
