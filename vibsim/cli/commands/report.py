"""``vibsim report``: write a report or the index (the job of the workflow), or publish results."""

from __future__ import annotations

from argparse import Namespace

from vibsim.cli.jobs.common import refusal


def report(options: Namespace) -> int:
    """Write a report or the index; or publish existing results.

    Raises InputError where the options of both are mixed.
    """
    if options.publish is None:
        if options.license:
            raise refusal("--license", options.license, "belongs to --publish")
        from vibsim.cli.jobs import report as job

        return job.report(options)
    for name in ("digest", "discard", "formats", "out"):
        if getattr(options, name):
            raise refusal(f"--{name}", "", "does not go with --publish")
    if options.experiment is None:
        raise refusal("--publish", options.publish, "needs the experiment: name it")
    from vibsim.cli.commands.publish import publish

    return publish(options)
