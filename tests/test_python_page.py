"""What the page on Python says of memory."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import netCDF4
import numpy as np
import pytest

from vibsim import Experiment, simulate
from vibsim.plan import Choice, load

ROOT = Path(__file__).parents[1]
LONG_RUN = ROOT / "configs" / "vibration_text" / "long_run.yaml"
PROBE = r"""
import re, sys
from pathlib import Path
from vibsim.cli import main
assert main(sys.argv[1:]) == 0
print("peak", re.search(r"VmHWM:\s*(\d+) kB", Path("/proc/self/status").read_text())[1])
"""


def test_a_finer_level_stores_no_more() -> None:
    plan = load(Choice("vibration_text", LONG_RUN))
    compiled = [level for level in plan.levels if level.level >= 2]
    assert [level.steps // level.every for level in plan.levels] == [16384] * 8
    assert len({level.bytes for level in plan.levels}) == 1
    assert len({level.memory for level in compiled}) == 1


@pytest.mark.slow
def test_a_finer_level_takes_no_more_memory(tmp_path: Path) -> None:
    """Level 11 takes 512 times the steps of level 2; a solution that is kept whole would be 268 MB more."""
    text = LONG_RUN.read_text().replace("to: 7}", "to: 11}")
    file = tmp_path / "longer.yaml"
    file.write_text(text)
    peaks = {}
    for level in ("2", "11"):
        words = ["simulate", str(file), "--level", level, "--out", str(tmp_path / f"{level}.nc")]
        command = [sys.executable, "-c", PROBE, *words, "--results", str(tmp_path)]
        # the first run compiles what both use
        for _ in range(2):
            done = subprocess.run(command, capture_output=True, text=True, check=True)
        peaks[level] = int(re.findall(r"peak (\d+)", done.stdout)[0])
    assert peaks["11"] < 1.03 * peaks["2"]
    with netCDF4.Dataset(tmp_path / "11.nc") as fine, netCDF4.Dataset(tmp_path / "2.nc") as coarse:
        assert np.array_equal(fine["t"][:], coarse["t"][:])
        assert {name: fine[name].shape for name in fine.variables} == {
            name: coarse[name].shape for name in coarse.variables
        }


def test_what_is_stored_is_part_of_the_whole() -> None:
    """The stored values are those of a run that stores every step, to the last bit."""
    short = {
        "title": "t",
        "model": {"kind": "oscillator", "damping": {"linear": 0.002}},
        "initial": {"u": 1.0},
        "time": {"end": 20.0, "base_steps": 64},
        "levels": [0, 3],
        "schemes": ["central"],
    }
    whole = simulate(Experiment.from_dict({**short, "samples": "all"}), 3)
    part = simulate(Experiment.from_dict({**short, "samples": "common"}), 3)
    assert np.array_equal(part["u"].values, whole["u"].values[..., ::8])
    single = [name for name in whole if "t" not in whole[name].dims]
    assert {"period", "u_max", "energy_deviation_max_abs"} <= set(single), single
    for name in single:
        assert np.array_equal(part[name].values, whole[name].values, equal_nan=True), name
