"""``vibsim plan``: what a run would cost, without running it."""

from __future__ import annotations

import json
from argparse import Namespace
from collections.abc import Iterator
from dataclasses import asdict

from vibsim.plan import Plan, checkout, choose, load_all


def plan(options: Namespace) -> int:
    """Show members, jobs, steps, disk space and time."""
    plans = load_all(choose(options.experiments, checkout())).values()
    if options.json:
        print(json.dumps([asdict(item) for item in plans], indent=1))
        return 0
    for item in plans:
        for line in _lines(item):
            print(line)
    return 0


def _lines(item: Plan) -> Iterator[str]:
    members = "1 member" if item.cases == 1 else f"{item.cases} members"
    schemes = "scheme" if len(item.schemes) == 1 else "schemes"
    yield f"{item.key}: {members}, {schemes} {', '.join(item.schemes)}"
    yield f"{'level':>7}{'steps':>14}{'kept every':>12}{'jobs':>6}{'member-steps':>16}{'MB':>10}{'s':>8}"
    for level in item.levels:
        yield (
            f"{level.level:>7}{level.steps:>14}{level.every:>12}{len(level.shards):>6}"
            f"{level.member_steps:>16}{level.bytes / 1e6:>10.2f}{level.seconds:>8.1f}"
        )
    total = (
        sum(level.member_steps for level in item.levels),
        sum(level.bytes for level in item.levels) / 1e6,
        sum(level.seconds for level in item.levels),
    )
    yield f"{'all':>7}{'':>32}{total[0]:>16}{total[1]:>10.2f}{total[2]:>8.1f}"
    yield ""
