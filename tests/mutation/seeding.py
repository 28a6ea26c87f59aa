"""``make mutation``: seed every fault into a copy of the package, and write down which checks notice it.

Each copy runs the battery (`battery.py`). A fault is caught where a check that passes without it passes no longer, or
where the program stops. What the plain rule "the last ratio is near 2^p" would have seen stands beside it.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from battery import POLYNOMIALS, SOLUTIONS
from faults import FAULTS, Fault
from picture import matrix

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
PAGE = ROOT / "docs" / "mutation.md"
PICTURE = ROOT / "docs" / "images" / "exercises-faults.svg"
NUMERICAL = ("scheme", "damping", "start", "end")
"""Places of faults in the numerical method, as against the models, the analysis and the rest."""
SECONDS = 300
"""A battery that takes longer has a fault that does not end."""

Report = dict[str, dict[str, Any]]


@dataclass(frozen=True)
class Outcome:
    """What became of a fault."""

    fault: Fault
    caught: tuple[str, ...]
    """Kind of check and reason, the most frequent first; empty where nothing noticed it."""
    plain: bool
    """Whether the plain rule would have seen it."""
    solutions: tuple[str, ...]
    """Which of the constant, the linear and the quadratic solution are reproduced no longer."""


def seeded(fault: Fault, folder: Path) -> None:
    """Copy the package into `folder` with a fault in it.

    Raises
    ------
    ValueError
        Where its text does not stand once in its file.
    """
    shutil.copytree(
        ROOT / "vibsim", folder / "vibsim", ignore=shutil.ignore_patterns("__pycache__")
    )
    file = folder / "vibsim" / fault.file
    text = file.read_text()
    if text.count(fault.right) != 1:
        raise ValueError(f"{fault.name}: {fault.right!r} does not stand once in {fault.file}")
    file.write_text(text.replace(fault.right, fault.wrong))


def battery(folder: Path, *names: str) -> Report:
    """Run the battery, or some of its experiments, with the package in `folder`."""
    path = {"PYTHONPATH": str(folder), "PYTHONDONTWRITEBYTECODE": "1"}
    try:
        done = subprocess.run(
            [sys.executable, str(HERE / "battery.py"), *names],
            env={**os.environ, **path},
            cwd=folder,
            capture_output=True,
            text=True,
            timeout=SECONDS,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return {"all": {"error": "no end"}}
    if done.returncode:
        return {"all": {"error": done.stderr.strip().splitlines()[-1][:200]}}
    found: Report = json.loads(done.stdout)
    return found


def noticed(before: Report, after: Report) -> tuple[str, ...]:
    """Return what notices a fault: check and reason of every verdict that passed before and passes no longer."""
    seen: Counter[str] = Counter()
    for name, report in after.items():
        if "error" in report:
            seen[f"stops: {report['error'].partition(':')[0]}"] += 1
            continue
        for check, results in before[name]["verdicts"].items():
            for old, new in zip(results, report["verdicts"][check], strict=True):
                if " PASS " in old and " PASS " not in new:
                    seen[f"{check.split()[-1]}: {new.split()[-1]}"] += 1
    return tuple(what for what, _ in seen.most_common())


def seen_plainly(before: Report, after: Report) -> bool:
    """Tell whether a ratio that was near 2^p is so no longer."""
    return any(
        report.get("plain", {}).get(key) is False
        for name, found in before.items()
        for key, near in found["plain"].items()
        if near and (report := after.get(name, {}))
    )


def outcome(fault: Fault, before: Report, *names: str) -> Outcome:
    """Seed a fault, and run the battery, or some of its experiments, with it."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        seeded(fault, folder)
        after = battery(folder, *names)
    others = {name: report for name, report in after.items() if name not in POLYNOMIALS}
    return Outcome(fault, noticed(before, others), seen_plainly(before, after), lost(before, after))


def lost(before: Report, after: Report) -> tuple[str, ...]:
    """Return the solutions of `SOLUTIONS` that a fault is noticed by; all of them where the program ends early."""
    if set(after) == {"all"}:
        return tuple(SOLUTIONS)
    return tuple(
        solution
        for solution in SOLUTIONS
        if noticed(before, {n: r for n, r in after.items() if n.startswith(f"{solution},")})
    )


def _picture(outcomes: list[Outcome]) -> str:
    """Draw which tests catch which faults in the numerical method."""
    numerical = [o for o in outcomes if o.fault.place in NUMERICAL]
    caught = {f"{name} solution": [name in o.solutions for o in numerical] for name in SOLUTIONS}
    caught["other checks"] = [bool(o.caught) for o in numerical]
    return matrix([f"{o.fault.name} ({o.fault.place})" for o in numerical], caught)


def _row(o: Outcome) -> str:
    told = "; ".join(o.caught[:3]) or "**nothing**"
    plain = "sees it" if o.plain else "misses it"
    return f"| {o.fault.name} | {o.fault.place} | {told} | {plain} |"


def page(outcomes: list[Outcome]) -> str:
    """Write the page about all faults."""
    caught = [o for o in outcomes if o.caught]
    missed = [o for o in caught if not o.plain]
    nothing = [o for o in outcomes if not o.caught]
    rows = [_row(o) for o in outcomes]
    unseen = "\n".join(f"- {o.fault.name} ({o.fault.place})" for o in nothing)
    numerical = [o for o in outcomes if o.fault.place in NUMERICAL]
    solutions = [
        *(_counts(name, outcomes, lambda o, name=name: name in o.solutions) for name in SOLUTIONS),
        _counts("any of them", outcomes, lambda o: bool(o.solutions)),
        _counts("the checks above", outcomes, lambda o: bool(o.caught)),
    ]
    escaped = "\n".join(f"- {o.fault.name} ({o.fault.place})" for o in numerical if not o.solutions)
    counts = f"{len(outcomes)} faults; caught: {len(caught)}; of these the plain rule misses {len(missed)}"
    return f"""# Mutation test

`make mutation` seeds one fault at a time into a copy of the package and runs a battery of small experiments with it
(`tests/mutation`). A fault is caught where a check that passes without it passes no longer. The last column says what
the plain rule "the last ratio of differences is within half an order of 2^p" would have said of the same runs.

{counts}; nothing catches {len(nothing)}.

| fault | in | caught by, and how (the three most frequent) | plain ratio |
|---|---|---|---|
{chr(10).join(rows)}

## What nothing catches

{unseen or "Every fault was caught."}

## Constant, linear and quadratic solutions

Note [hpl 3] of the vibration text asks how many faults the tests of its section 8.5 catch: a constant, a linear and a
quadratic solution, made by a force, that must be reproduced to 1e-12. Here they are those of an oscillator with a cubic
spring, with linear damping, quadratic damping and none, by the schemes that reproduce them. The last column counts the
faults in schemes, damping, starts and end points, which are what such a test is for.

| solution | faults caught | of those in the numerical method |
|---|---|---|
{chr(10).join(solutions)}

Faults in the numerical method that none of the three solutions catches:

{escaped or "None."}
"""


def _counts(name: str, outcomes: list[Outcome], caught: Callable[[Outcome], bool]) -> str:
    numerical = [o for o in outcomes if o.fault.place in NUMERICAL]
    cells = [f"{sum(map(caught, group))} of {len(group)}" for group in (outcomes, numerical)]
    return f"| {name} | {' | '.join(cells)} |"


def main() -> int:
    """Run all faults, or those whose names have a word, and write the page and the picture."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "word", nargs="?", default="", help="only faults whose name has it; writes no page"
    )
    parser.add_argument("--cores", type=int, default=os.cpu_count() or 1)
    given = parser.parse_args()
    before = battery(ROOT)
    wrong = [f"{n}: {r['error']}" for n, r in before.items() if "error" in r]
    wrong += [
        f"{name}, {check}: {result}"
        for name, report in before.items()
        for check, results in report.get("verdicts", {}).items()
        for result in results
        if " PASS " not in result
    ]
    if wrong:
        print("the battery does not pass without a fault:", *wrong, sep="\n  ", file=sys.stderr)
        return 1
    chosen = [fault for fault in FAULTS if given.word in fault.name]
    with ThreadPoolExecutor(given.cores) as pool:
        outcomes = []
        for found in pool.map(lambda fault: outcome(fault, before), chosen):
            outcomes.append(found)
            told = "; ".join(found.caught[:2]) or "NOTHING"
            print(f"{found.fault.name:50} {told:60} plain: {found.plain}", flush=True)
    if not given.word:
        PAGE.write_text(page(outcomes))
        PICTURE.write_text(_picture(outcomes))
        print(f"written: {PAGE.relative_to(ROOT)} and {PICTURE.relative_to(ROOT)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
