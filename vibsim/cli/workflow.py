"""The entry point of the Snakefile: it loads and checks the plans before any job runs."""

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
    """Return the names for the workflow.

    `config` has ``experiments`` (files, names or collections) and the ``settings`` of all of them, each one text or a
    list, by default the default experiments without settings; the ``results`` folder; and ``cores``, ``overhead`` and
    ``here`` as in `vibsim.plan.Names`. Of ``--config`` on the command line alone, ``allow_commands=true`` lets users'
    programs run. Raises InputError where a file or the folder is refused, or a program is not allowed to run.
    """
    is_allowed = str(command_line.get("allow_commands")).lower() == "true"
    experiments, settings = (
        [words] if isinstance(words := config.get(key, []), str) else words
        for key in ("experiments", "settings")
    )
    plans = {plan.key: plan for plan in plans_of(experiments, settings, cached=True)}
    results = Path(config.get("results", default_results())).absolute()
    limits = {key: int(config[key]) for key in ("cores", "overhead", "here") if key in config}
    names = Names(plans, results, is_allowed, tuple(settings), **limits)
    results_folder.check(names.results, names.plans)
    check_allowed(names.plans.values(), is_allowed)
    return names
