"""``vibsim check``: validate, quickly, without Snakemake."""

from __future__ import annotations

from argparse import Namespace

from vibsim.cli.chosen_plans import plans_of


def check(options: Namespace) -> int:
    """Validate experiment files and say that they are valid."""
    for plan in plans_of(options.experiments):
        levels = ", ".join(str(level.level) for level in plan.levels)
        members = "1 member" if plan.cases == 1 else f"{plan.cases} members"
        print(f"{plan.file}: valid ({members}, levels {levels})")
    return 0
