"""Plans of the experiments that a user names; supplies what the package `vibsim.plan` may not import itself."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING

from vibsim.cli.failure import from_here
from vibsim.core.errors import Fault, InputError
from vibsim.core.home import home
from vibsim.plan import Plan, choose, load, load_all

if TYPE_CHECKING:
    from vibsim.experiment import Experiment


def resolve(experiment: Experiment) -> Experiment:
    """Choose the levels of an experiment that names a tolerance."""
    from vibsim import ladder

    resolved: Experiment = ladder.resolve(experiment)
    return resolved


def plans_of(
    words: Sequence[str], settings: Sequence[str] = (), *, cached: bool = False
) -> list[Plan]:
    """Return the plans of files, experiments or collections; without `words` those of the default collections.

    The `settings` replace values of all files. With `cached`, plans may come from the cache. Raises one InputError with
    every word that names nothing, or with the faults of all files.
    """
    return list(load_all(choose(words, home(), settings), resolve, cached=cached).values())


def tell_notes(plans: Sequence[Plan]) -> None:
    """Print the notes on experiment files to stderr."""
    for plan in plans:
        for remark in plan.remarks:
            print(from_here(remark), file=sys.stderr, flush=True)


def one_plan_of(word: str, settings: Sequence[str] = ()) -> Plan:
    """Return the plan of one experiment, possibly from the cache; raise InputError where `word` is a collection."""
    choices = choose([word], home(), settings)
    if len(choices) != 1:
        rule = "must be one experiment, not a collection"
        raise InputError([Fault("command line", 0, "EXPERIMENT", word, rule)])
    return load(choices[0], resolve, cached=True)
