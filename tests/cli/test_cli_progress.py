from __future__ import annotations

import pytest

from vibsim.cli.run.progress import Progress, describe
from vibsim.cli.run.snakemake import Job, _Reader
from vibsim.cli.sizes import amount, duration, size

TEXT = """\
Building DAG of jobs...
[Sat Nov 21 01:05:16 2026]
localrule simulate:
    output: a/x/level_07.nc
    log: a/x/logs/level_07.log
    jobid: 3
    reason: Missing output files: a/x/level_07.nc
    wildcards: experiment=a/x, level=07
[Sat Nov 21 01:05:16 2026]
Finished jobid: 2 (Rule: simulate)
1 of 4 steps (25%) done
[Sat Nov 21 01:05:16 2026]
Error in rule analyse:
    message: None
    jobid: 1
    input: a/x/level_07.nc
    output: a/x/convergence.nc, a/x/summary.json
    log: a/x/logs/analyse.log (check log file(s) for error details)
    shell:
        python -m vibsim
rule all:
    input: index.html
rule index:
    output: index.html, summary.csv
"""


def test_jobs_failures_and_steps_are_read_from_what_snakemake_writes() -> None:
    seen: list[tuple[int, int, Job | None]] = []
    reader = _Reader(lambda *told: seen.append(told))
    for line in [*TEXT.splitlines(), ""]:
        reader.take(line)
    assert [describe(job) for job in reader.jobs] == ["simulate a/x level_07.nc", "index"]
    assert reader.jobs[0].reason == "Missing output files: a/x/level_07.nc"
    (failed,) = reader.failed
    assert describe(failed) == "analyse a/x"
    assert failed.log == "a/x/logs/analyse.log"
    assert (1, 4, None) in seen


def test_a_job_with_several_files_is_told_by_its_first_and_last() -> None:
    output = "a/x/level_06.nc (update), a/x/level_07.nc (update), a/x/level_09.nc (update)"
    job = Job("simulate_3", output, "", "")
    assert describe(job) == "simulate a/x level_06.nc to level_09.nc"
    assert job.outputs == [f"a/x/level_0{n}.nc" for n in (6, 7, 9)]
    shard = Job("simulate_4", "a/x/level_06/shard_0001.nc (update)", "", "")
    assert describe(shard) == "simulate a/x level_06/shard_0001.nc"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (size(0), "0 B"),
        (size(999), "999 B"),
        (size(999.9), "1 kB"),
        (size(123_456), "123 kB"),
        (size(2.46e9), "2.46 GB"),
        (size(1e16), "1e+04 TB"),
        (amount(960), "960"),
        (amount(1.3e9), "1.3e+09"),
        (duration(0.04), "0.0 s"),
        (duration(99.94), "99.9 s"),
        (duration(186), "3.1 min"),
        (duration(9000), "2.5 h"),
        (duration(864_000), "10.0 d"),
    ],
)
def test_numbers_for_people(text: str, expected: str) -> None:
    assert text == expected


def test_progress_counts_the_jobs_without_the_target_of_all(
    capsys: pytest.CaptureFixture[str],
) -> None:
    progress = Progress()
    progress.is_terminal = False
    reader = _Reader(progress)
    for line in ["total           4", *TEXT.splitlines(), ""]:
        reader.take(line)
    assert capsys.readouterr().err.splitlines() == [
        "1 of 3: simulate a/x level_07.nc",
        "2 of 3: index",
    ]
