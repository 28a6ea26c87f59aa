"""Plans of what a user names, with everything that a plan may need and the plan itself must not know."""

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

    The `settings` stand in place of values of all files.

    With `cached`, plans that were made before will do. InputError with every word that names nothing and the faults of
    all files.
    """
    return list(load_all(choose(words, home(), settings), resolve, cached=cached).values())


def tell_notes(plans: Sequence[Plan]) -> None:
    """Say on stderr what files say and probably do not mean."""
    for plan in plans:
        for remark in plan.remarks:
            print(from_here(remark), file=sys.stderr, flush=True)


def one_plan_of(word: str, settings: Sequence[str] = ()) -> Plan:
    """Return the plan of one experiment, perhaps one that was made before; InputError where `word` is a collection."""
    choices = choose([word], home(), settings)
    if len(choices) != 1:
        rule = "must be one experiment, not a collection"
        raise InputError([Fault("command line", 0, "EXPERIMENT", word, rule)])
    return load(choices[0], resolve, cached=True)
