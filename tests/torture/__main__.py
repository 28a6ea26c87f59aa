"""Run cases at random until the time is over; see ``make torture``."""

from __future__ import annotations

import argparse
import random
import sys
import tempfile
import time
import traceback
from collections.abc import Callable
from pathlib import Path

from torture import edits, harm, kills
from torture.laboratory import Laboratory

Case = Callable[[Laboratory, random.Random], str]
CASES: dict[str, tuple[Case, int]] = {
    "kill": (kills.kill, 6),
    "together": (kills.together, 1),
    "damage": (harm.damage, 3),
    "limit": (harm.limited, 1),
    "full": (harm.full, 1),
    "edit": (edits.edited, 2),
    "surroundings": (harm.surrounded, 1),
}
"""Each kind of case, and how often it is chosen."""


def main() -> int:
    """Return 0 where nothing was lost and nothing was wrong in silence."""
    parser = argparse.ArgumentParser(prog="make torture", description=__doc__)
    parser.add_argument("--minutes", type=float, default=5)
    parser.add_argument("--seed", type=int, default=random.randrange(10**6))
    parser.add_argument("--only", choices=CASES, nargs="+", default=list(CASES))
    parser.add_argument("--case", type=int, help="this one alone, of the same seed and kinds")
    given = parser.parse_args()
    print(f"seed {given.seed}", flush=True)
    faults = 0
    end = time.monotonic() + 60 * given.minutes
    with tempfile.TemporaryDirectory(prefix="torture-") as folder:
        lab = Laboratory(Path(folder))
        has_disk = "full" not in given.only or harm.can_mount(lab.folder)
        if not has_disk:
            print("no disk can be mounted here: limits of files stand for full disks", flush=True)
        number = given.case or 0
        while time.monotonic() < end:
            choose = random.Random(f"{given.seed} {number}")
            kind = choose.choices(given.only, [CASES[kind][1] for kind in given.only])[0]
            kind = kind if has_disk or kind != "full" else "limit"
            start = time.monotonic()
            try:
                told = CASES[kind][0](lab, choose)
            except Exception:
                faults += 1
                told = f"FAULT (--seed {given.seed} --case {number})\n{traceback.format_exc()}"
            print(f"{number}: {kind}: {told} ({time.monotonic() - start:.1f} s)", flush=True)
            if given.case is not None:
                break
            number += 1
    print(f"seed {given.seed}: {dict(lab.counts)}, {faults} faults")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
