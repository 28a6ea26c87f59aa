"""What the Snakefile begins with: the names of everything that is to be made, checked before anything is."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from vibsim.cli import results_folder
from vibsim.cli.chosen_plans import plans_of
from vibsim.cli.jobs.solve import check_allowed
from vibsim.core.home import default_results
from vibsim.plan import Names


def names_of(config: Mapping[str, Any], command_line: Mapping[str, Any]) -> Names:
    """Return the names for the workflow of some experiments.

    Parameters
    ----------
    config
        The ``experiments`` (files, names, collections) with the ``settings`` of all of them, one as text or several in
        a list, and the ``results`` folder; without any the default experiments as they are, and
        `vibsim.core.home.default_results`. ``cores`` and ``overhead`` (megabytes) of a job that runs elsewhere, and the
        seconds of work that is done ``here``.
    command_line
        What ``--config`` says on the command line: ``allow_commands=true`` lets programs of users run.

    Raises
    ------
    InputError
        Where a file is refused, the results folder is, or a program that is not allowed to run.
    """
    is_allowed = str(command_line.get("allow_commands")).lower() == "true"
    experiments, settings = (
        [words] if isinstance(words := config.get(key, []), str) else words
        for key in ("experiments", "settings")
    )
    plans = {plan.key: plan for plan in plans_of(experiments, settings, cached=True)}
    results = Path(config.get("results", default_results())).absolute()
    more = {key: int(config[key]) for key in ("cores", "overhead", "here") if key in config}
    names = Names(plans, results, is_allowed, tuple(settings), **more)
    results_folder.check(names.results, names.plans)
    check_allowed(names.plans.values(), is_allowed)
    return names
