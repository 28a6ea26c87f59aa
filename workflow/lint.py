"""Run ``snakemake --lint`` and fail on what it finds, but for one advice that does not apply.

Snakemake wants a conda environment or container for each rule. The software of every rule is the environment that
Snakemake itself runs in, pinned with hashes in ``requirements/run.txt``; another one per rule would be a second truth.
"""

from __future__ import annotations

import re
import subprocess
import sys

NOT_FOR_US = "Specify a conda environment or container for each rule."


def findings(output: str) -> list[str]:
    """Return the advice in the text that the linter prints, each with the place it is about."""
    place, found = "", []
    for line in output.splitlines():
        if heading := re.fullmatch(r"Lints for (.+):", line):
            place = heading[1]
        elif advice := re.fullmatch(r" {4}\* (.+):", line):
            found.append(f"{place}: {advice[1]}")
    return found


def main() -> int:
    """Lint the workflow; return 1 where there is something to mend."""
    command = [sys.executable, "-m", "snakemake", "--lint"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    output = done.stdout + done.stderr
    found = findings(output)
    ours = [advice for advice in found if not advice.endswith(NOT_FOR_US)]
    if done.returncode and not found:  # the workflow could not be read
        ours = [output]
    print(*ours or ["snakemake --lint: nothing to mend"], sep="\n")
    return 1 if ours else 0


if __name__ == "__main__":
    sys.exit(main())
