"""``vibsim open``: open the report of an experiment, or the index of all results, in the browser."""

from __future__ import annotations

import sys
import webbrowser
from argparse import Namespace

from vibsim.cli.chosen_plans import one_plan_of
from vibsim.cli.jobs.common import chosen_results
from vibsim.cli.level_member import OUTDATED, are_outdated, summary_of
from vibsim.core.errors import VibsimError
from vibsim.core.home import typed


def open_(options: Namespace) -> int:
    """Open a page, or print its path where there is no browser.

    Raises VibsimError where the page does not exist yet.
    """
    results = chosen_results(options)
    word = options.experiment
    plan = None if word is None else one_plan_of(word)
    page = results / ("index.html" if plan is None else plan.page)
    if not page.is_file():
        command = typed("vibsim run" if plan is None else plan.command_to_run(str(word)))
        raise VibsimError(f"{page}: there is no report yet: {command}")
    if plan is not None:
        summary = summary_of(plan, results)
        if summary is not None and are_outdated(plan, summary):
            print(OUTDATED, file=sys.stderr)
    try:
        is_open = webbrowser.open(page.as_uri())
    except webbrowser.Error:
        is_open = False
    print(page if not is_open else f"opened {page}")
    return 0
