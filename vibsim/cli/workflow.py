"""What the Snakefile begins with: the names of everything that is to be made, checked before anything is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from vibsim.cli import results_folder
from vibsim.cli.chosen_plans import resolve
from vibsim.cli.jobs.solve import check_allowed
from vibsim.plan import Names


def names_of(
    experiments: Sequence[str], results: str, root: Path, command_line: Mapping[str, Any]
) -> Names:
    """Return the names for the workflow of some experiments.

    Parameters
    ----------
    experiments, results, root
        As for `vibsim.plan.Names.of`.
    command_line
        What ``--config`` says on the command line: ``allow_commands=true`` lets programs of users run.

    Raises
    ------
    InputError
        Where a file is refused, the results folder is, or a program that is not allowed to run.
    """
    is_allowed = str(command_line.get("allow_commands")).lower() == "true"
    names = Names.of(experiments, results, root, resolve, is_allowed)
    results_folder.check(names.results, names.plans)
    check_allowed(names.plans.values(), is_allowed)
    return names
