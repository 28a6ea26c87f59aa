"""Long runs: a billion steps of one member, and round-off at level 24."""

from __future__ import annotations

import sys
import tempfile
from functools import partial
from pathlib import Path

import numpy as np

from bench import ours
from bench.page import Section, gather, table
from bench.timing import process

TITLE = "Large runs"
ANSWER = "A billion steps of one member take {0[deep.wall]:.0f} s."
ROOT = Path(__file__).resolve().parents[1]
CONFIGS = ROOT / "configs" / "scale"
Measured = tuple[list[str], dict[str, float]]


def run(small: bool) -> Section:
    """Measure every group."""
    with tempfile.TemporaryDirectory(prefix="vibsim-bench-") as name:
        folder = Path(name)
        return gather(
            {
                "level 30": partial(level_30, folder, small),
                "round-off": partial(round_off, 16 if small else 24),
            }
        )


def level_30(folder: Path, small: bool) -> Measured:
    """The finest level alone, by hand."""
    file = CONFIGS / "level_30.yaml"
    if small:
        file = folder / "small.yaml"
        text = (CONFIGS / "level_30.yaml").read_text()
        for name, tiny in (
            ("from: 28, to: 30", "from: 8, to: 10"),
            ("262144", "1"),
            ("level: 30", "level: 10"),
        ):
            text = text.replace(name, tiny)
        file.write_text(text)
    level = 10 if small else 30
    command = [sys.executable, "-m", "vibsim", "simulate", str(file), "--level", str(level)]
    cost = process([*command, "--out", str(folder / "deep.nc")], cwd=folder)
    rows: list[list[object]] = [
        [f"level {level}, {2**level} steps", cost.wall, cost.wall / 2**level * 1e9, cost.peak_mib]
    ]
    caption = "`configs/scale/level_30.yaml`, one job at its finest level, compensated, one run."
    header = ["job", "wall s", "ns per step, all told", "peak MiB"]
    return table(caption, header, rows), {"deep.wall": cost.wall, "deep.peak_mib": cost.peak_mib}


def round_off(level: int) -> Measured:
    """Compare what rounding leaves in the other arithmetics with the compensated one, step for step the same scheme."""
    theta, steps = np.array([1.0]), 2**level
    found = {
        name: ours.step(theta, 20.0, steps, arithmetic=name, samples=64, gather=False).position
        for name in ("compensated", "increment", "three_term")
    }
    error = {name: float(np.max(np.abs(u - found["compensated"]))) for name, u in found.items()}
    rows: list[list[object]] = [
        [name, f"{error[name]:.1e}"] for name in ("increment", "three_term")
    ]
    ratio = error["increment"] / error["three_term"]
    rows.append(["increment over three_term", f"{ratio:.1e}"])
    caption = f"Round-off at level {level} up to t = 20: largest distance from the compensated solution [rad]."
    return table(caption, ["arithmetic", "round-off"], rows), {"round_off.ratio": ratio}
