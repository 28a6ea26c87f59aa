"""``vibsim check``: validate, quickly, without Snakemake."""

from __future__ import annotations

from argparse import Namespace

from vibsim.plan import checkout, choose, load_all


def check(options: Namespace) -> int:
    """Validate experiment files and say that they are sound."""
    plans = load_all(choose(options.experiments, checkout()))
    for plan in plans.values():
        levels = ", ".join(str(level.level) for level in plan.levels)
        members = "1 member" if plan.cases == 1 else f"{plan.cases} members"
        print(f"{plan.file}: sound ({members}, levels {levels})")
    return 0
