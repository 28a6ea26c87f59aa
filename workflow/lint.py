"""Run ``snakemake --lint`` and fail on its advice, except one piece that does not apply.

Snakemake advises a conda environment or container for each rule. Here all rules use the environment that Snakemake
itself runs in, pinned with hashes in ``requirements/run.txt``; an environment per rule would duplicate that.
"""

from __future__ import annotations

import re
import subprocess
import sys

NOT_FOR_US = "Specify a conda environment or container for each rule."


def findings(output: str) -> list[str]:
    """Return the pieces of advice in the output of the linter, each with its place."""
    place, advices = "", []
    for line in output.splitlines():
        if heading := re.fullmatch(r"Lints for (.+):", line):
            place = heading[1]
        elif advice := re.fullmatch(r" {4}\* (.+):", line):
            advices.append(f"{place}: {advice[1]}")
    return advices


def main() -> int:
    """Lint the workflow; return 1 if there is something to correct."""
    command = [sys.executable, "-m", "snakemake", "--lint"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    output = done.stdout + done.stderr
    advices = findings(output)
    ours = [advice for advice in advices if not advice.endswith(NOT_FOR_US)]
    if done.returncode and not advices:  # the workflow could not be read
        ours = [output]
    print(*ours or ["snakemake --lint: nothing to correct"], sep="\n")
    return 1 if ours else 0


if __name__ == "__main__":
    sys.exit(main())
