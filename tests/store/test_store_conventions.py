"""The files that jobs write, with all that they may hold, keep to the CF conventions."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from vibsim import store
from vibsim.cli import main
from vibsim.core.record import Record, Variable

TEXT = """\
title: A spring
source: nowhere
model: {kind: spring, w: 2*pi}
initial: {u: 1.0}
time: {end: 5.0, base_steps: 10}
levels: [3, 4, 5]
schemes: [central, rk4, {kind: dop853, tolerance: [1e-4, 1e-8]}]
samples: SAMPLES
sweep: {model.w: [6.0, 6.5]}
checks:
  - {converges: u, order: scheme, schemes: [central, rk4]}
  - {stable: true, schemes: [rk4]}
  - {conserves: energy, drift: bounded, schemes: [central]}
  - {equal: [central, discrete], quantity: u}
published:
  - title: A table
    source: nowhere
    value: relative_energy_error_d2t
    beside: [relative_energy_error, growth_per_period]
    rows:
      - {scheme: rk4, level: 4, printed: "1.0e-3", holds: false, note: another one}
      - {scheme: dop853_1e-08, level: 4, printed: "2e-9", holds: false}
"""
EXTREMA = {
    f"{kind}{end}"
    for kind in ("peak", "trough")
    for end in ("", "_time", "_time_grid", "_grid", "_count")
}
LEVEL = EXTREMA | {"v_d2t", "energy_d2t", "energy_deviation_d2t_running_max", "accepted_steps"}
CONVERGENCE = {
    "theory_growth",
    "measured_growth",
    "stability_limit",
    "energy_drift_kind",
    "force_evaluations_total",
}
PART = 50
"""Variables that the checker is given at a time."""


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Write the files of a run, with series and without them."""
    found = {}
    for storage, samples in (("series", "all"), ("lean", "auto")):
        folder = tmp_path_factory.mktemp(storage)
        file = folder / "spring.yaml"
        file.write_text(TEXT.replace("SAMPLES", samples))
        with pytest.MonkeyPatch.context() as patch:
            if storage == "lean":
                patch.setattr("vibsim.experiment.storage.LEAN", 0)
            common = [str(file), "--results", str(folder)]
            assert main(["simulate", *common, "--level", "3", "4", "5"]) == 0
            assert main(["analyse", *common]) == 0
        found[storage] = folder
    return found


@pytest.mark.parametrize(
    ("storage", "name"),
    [
        ("series", "level_05/*.nc"),
        ("lean", "level_05/*.nc"),
        ("lean", "convergence.nc"),
        pytest.param("series", "convergence.nc", marks=pytest.mark.slow),
    ],
)
def test_cf_checker_finds_nothing_in_what_jobs_write(
    results: dict[str, Path], tmp_path: Path, storage: str, name: str
) -> None:
    (file,) = results[storage].rglob(name)
    variables = store.read(file).variables
    dims = {dim for variable in variables.values() for dim in variable.dims}
    assert dims >= ({"extremum"} if (storage, name[:5]) == ("series", "level") else set())
    assert dims >= ({"beside"} if (storage, name) == ("series", "convergence.nc") else set())
    if storage == "series":
        assert set(variables) >= (CONVERGENCE if name == "convergence.nc" else LEVEL)
    is_large = (storage, name) == ("series", "convergence.nc")
    check(*(parts(file, tmp_path) if is_large else [file]))


def test_cf_checker_finds_nothing_in_tables_and_theory(
    results: dict[str, Path], tmp_path: Path
) -> None:
    """What `convergence.nc` has of these, without its hundreds of other variables."""
    (file,) = results["series"].rglob("convergence.nc")
    whole = store.read(file)
    kept = {
        name: variable
        for name, variable in whole.variables.items()
        if name in CONVERGENCE or {"beside", "check"} & set(variable.dims)
    }
    assert any("beside" in variable.dims for variable in kept.values())
    check(written(tmp_path / "part.nc", whole, kept))


def parts(file: Path, folder: Path) -> list[Path]:
    """Write a file in parts, each with all coordinates: the checker's time grows with the square of the variables."""
    whole = store.read(file)
    names = list(whole.variables)
    found = []
    for start in range(0, len(names), PART):
        some = {name: whole.variables[name] for name in names[start : start + PART]}
        found.append(written(folder / f"part_{start}.nc", whole, some))
    assert {name for part in found for name in store.read(part).variables} == set(names)
    return found


def written(file: Path, whole: Record, variables: dict[str, Variable]) -> Path:
    kept = replace(whole, variables=variables)
    store.write(file, kept, digest="d" * 64, provenance={})
    return file


def check(*files: Path) -> None:
    checker = Path(sys.executable).with_name("compliance-checker")
    ended = subprocess.run(
        [checker, "--test", "cf:1.11", "--criteria", "strict", *map(str, files)],
        capture_output=True,
        text=True,
        check=False,
    )
    text = ended.stdout + ended.stderr
    assert ended.stdout.count("All tests passed!") == len(files), text
    assert "exceptions occurred" not in text
    assert ended.returncode == 0
