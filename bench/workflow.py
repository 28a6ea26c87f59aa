"""Whole runs by Snakemake, without the command line around it: what is asked for is made, and no page."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from bench.timing import Process, process

ROOT = Path(__file__).resolve().parents[1]
CORES = len(os.sched_getaffinity(0))


def command(files: Sequence[Path], results: Path, *targets: str, cores: int = CORES) -> list[str]:
    """Return the call of Snakemake that makes `targets` of experiments, or everything."""
    results.mkdir(parents=True, exist_ok=True)
    config = results.with_name(f"{results.name}.json")
    content = {"experiments": [str(file) for file in files], "results": str(results)}
    config.write_text(json.dumps(content))
    call = [sys.executable, "-P", "-m", "snakemake", "--cores", str(cores)]
    call += ["--snakefile", str(ROOT / "Snakefile")]
    call += ["--workflow-profile", str(ROOT / "workflow/profiles/default")]
    return [*call, "--configfile", str(config), "--", *targets]


def compare(
    file: Path,
    collection: str,
    results: Path,
    cores: int = CORES,
    environment: Mapping[str, str] | None = None,
) -> Process:
    """Simulate and analyse one experiment, without its page."""
    key = f"{collection}/{file.stem}"
    targets = (f"{key}/convergence.nc", f"{key}/summary.json")
    call = command([file], results, *targets, cores=cores)
    return process(call, cwd=results, environment=environment)
