"""Snakemake as a child of a run: it ends with the run, and at once when it is told to.

Its own handler of SIGTERM takes a lock that the interrupted thread may hold, and then waits for ever; nothing is
lost when it is killed instead, since every file appears whole.
"""

from __future__ import annotations

import runpy
import sys

from vibsim.cli.run import supervise


def main() -> None:
    """Run Snakemake for the process that the first argument names, with the others."""
    supervise.end_at_once()
    supervise.end_with(int(sys.argv.pop(1)))
    runpy.run_module("snakemake", run_name="__main__", alter_sys=True)


if __name__ == "__main__":
    main()
