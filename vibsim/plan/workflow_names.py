"""What the Snakemake rules need to know: file names, digests and resources of the jobs."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import chain, count
from pathlib import Path
from typing import Any

from vibsim.core.processes import usable_cores
from vibsim.core.set_option import ALLOW, OPTION
from vibsim.plan import code_digest
from vibsim.plan.digests import digest_of
from vibsim.plan.jobs import Batch, Plan

UNKNOWN_DISK = 1000
"""Disk of a job whose files have no size estimate, such as a user's solver [MB]; Snakemake's own default."""
PAGE_SECONDS = 30.0
"""Time of a job that makes a page [s]: several times that of the default run."""
ANALYSED_SECONDS = 20e-9
"""Time of an analysis per byte of level files [core seconds]."""
FINISHED_SECONDS = 4.0
"""Time of one analysis and page besides that, as in the default run [core seconds]."""
START_MINUTES = 2
"""Time limit for start and end of an executor's job [minutes]."""
SLOWNESS = 4.0
"""Safety factor of a job's time limit, for slower or shared machines."""
GROUP = "simulate"
"""Snakemake group of short jobs; an executor may submit several as one (``--group-components``)."""
GROUPED_SECONDS = 10.0
"""Longest job of this group [core seconds]; a shard takes less."""
START_SECONDS = 4.0
"""Time of start and end of an executor's job [s]."""


def group_size(seconds: Sequence[float], most: int) -> int:
    """Return how many simulations, with the given times [s], an executor submits as one job: `most` or fewer.

    The number of jobs minimises the total time, if jobs start one after the other and then work in parallel. Long
    simulations do not count: each is a job of its own.
    """
    short = [time for time in seconds if 0.0 < time <= GROUPED_SECONDS]
    jobs = math.ceil(math.sqrt(sum(short) / START_SECONDS))
    return min(most, math.ceil(len(short) / jobs)) if jobs else most


@dataclass(frozen=True)
class Simulation:
    """A rule that makes one or more levels: one job, or one for each shard, which is the wildcard ``shard``."""

    rule: str
    """Name of the rule."""
    levels: list[int]
    paths: list[str]
    """The files of one job."""
    log: str
    benchmark: str
    """Path of the measured time and memory."""
    threads: int
    megabytes: int
    """Memory of a job without the overhead of an executor [MB]."""
    minutes: int | None
    """Time limit of a job; None for no limit."""
    disk: int
    """Size of the files of a job [MB]."""
    group: str | None
    """Snakemake group of short jobs; None for a long job."""
    digests: list[str]
    """Digest of each job, by shard."""
    source: str
    """The experiment file."""

    def shard(self, wildcards: Any) -> int:
        """Return the number of the shard."""
        return int(getattr(wildcards, "shard", 0))

    def digest(self, wildcards: Any) -> str:
        """Return the digest of a job."""
        return self.digests[self.shard(wildcards)]

    def file(self, wildcards: Any, input: Any) -> str:  # noqa: A002
        """Return the experiment file; see `Names.file`."""
        return self.source


def _simulation(plan: Plan, batches: Sequence[Batch], rule: str, cores: int) -> Simulation:
    first = batches[0]
    paths, levels = [shard.path for shard in plan.made_by(first)], list(first.levels)
    seconds = max(batch.seconds for batch in batches)
    share = plan.level(levels[0]).shards[0].stop / plan.cases
    stem = f"level_{levels[0]:02d}" + (f"_to_{levels[-1]:02d}" if len(levels) > 1 else "")
    if len(batches) > 1:
        paths = [f"{Path(path).parent.as_posix()}/shard_{{shard}}.nc" for path in paths]
        stem += "_shard_{shard}"
    return Simulation(
        rule=rule,
        levels=levels,
        paths=paths,
        log=f"{plan.key}/logs/{stem}.log",
        benchmark=f"{plan.key}/benchmarks/{stem}.tsv",
        threads=first.threads or (cores if first.is_divisible else 1),
        megabytes=math.ceil(max(batch.memory for batch in batches) / 10**6),
        minutes=first.runtime or _minutes(seconds),
        disk=_disk(share * sum(plan.level(level).bytes for level in levels)),
        group=GROUP if 0.0 < seconds <= GROUPED_SECONDS else None,
        digests=[batch.digest for batch in batches],
        source=plan.file,
    )


def _disk(size: float) -> int:
    """Return the size of files [MB] from their size in bytes; `UNKNOWN_DISK` for an unknown size (0)."""
    return math.ceil(size / 10**6) or UNKNOWN_DISK


def _minutes(seconds: float) -> int | None:
    """Return the time limit of a job from its estimated time; None without an estimate (0)."""
    return START_MINUTES + math.ceil(SLOWNESS * seconds / 60.0) if seconds else None


def _plan_field(field: str) -> Callable[[Names, Any], str]:

    def get(self: Names, wildcards: Any) -> str:
        value: str = getattr(self.plans[wildcards.experiment], field)
        return value

    return get


@dataclass(frozen=True)
class Names:
    """The plans of the chosen experiments, looked up by wildcard."""

    plans: Mapping[str, Plan]
    results: Path
    allows_commands: bool = False
    """Whether the user's programs may run."""
    settings: tuple[str, ...] = ()
    """Values that replace those of the files, as ``KEY=VALUE``."""
    cores: int = field(default_factory=usable_cores)
    """Most cores of one job."""
    overhead: int = 0
    """Memory that an executor's own processes need in each job [MB]."""
    here: float = 0.0
    """Analyses and pages run where the workflow runs, not as jobs of an executor, if they take less [core seconds]."""

    def level_flags(self, wildcards: Any, input: Any) -> str:  # noqa: A002
        """Return further options of jobs that make levels; Snakemake does not compare them, see `file`."""
        return ALLOW if self.allows_commands else ""

    def setting_flags(self, wildcards: Any, input: Any) -> list[str]:  # noqa: A002
        """Return the options that pass the settings to every job; Snakemake does not compare them, see `file`."""
        return [word for text in self.settings for word in (OPTION, text)]

    @property
    def experiment_pattern(self) -> str:
        """Regular expression that matches exactly the chosen experiments."""
        return "|".join(map(re.escape, self.plans))

    def file(self, wildcards: Any, input: Any) -> str:  # noqa: A002
        """Return the experiment file.

        Snakemake does not compare parameters from functions that take `input`, so an experiment file that moved to
        another folder is not run again.
        """
        return self.plans[wildcards.experiment].file

    @property
    def simulations(self) -> list[Simulation]:
        """The rules that make the level files."""
        groups: dict[tuple[str, tuple[int, ...]], list[Batch]] = {}
        for key, plan in self.plans.items():
            for batch in plan.batches:
                groups.setdefault((key, batch.levels), []).append(batch)
        names = _numbered(_rule(key, levels) for key, levels in groups)
        return [
            _simulation(self.plans[key], batches, name, self.cores)
            for name, ((key, _), batches) in zip(names, groups.items(), strict=True)
        ]

    def shards(self, wildcards: Any) -> list[str]:
        """Return the level files of an experiment."""
        return [shard.path for shard in self.plans[wildcards.experiment].shards]

    @property
    def best_pattern(self) -> str:
        """Regular expression that matches exactly the experiments with an extrapolated solution, possibly none."""
        return "|".join(re.escape(key) for key, plan in self.plans.items() if plan.best) or "(?!)"

    @property
    def finishes_here(self) -> bool:
        """Whether analyses, extrapolations and pages run where the workflow runs: they take less than `here`."""
        readings = sum(plan.bytes * (1 if plan.best is None else 2) for plan in self.plans.values())
        return ANALYSED_SECONDS * readings + FINISHED_SECONDS * len(self.plans) <= self.here

    @property
    def analysis_group(self) -> str | None:
        """Snakemake group of an analysis and its page, which an executor submits as one job; None if they run here."""
        return None if self.finishes_here else "analyse"

    analysis_digest = _plan_field("analysis")
    extrapolation_digest = _plan_field("extrapolation")
    report_digest = _plan_field("report")

    def analysis_threads(self, wildcards: Any) -> int:
        """Return the number of processes of an analysis, which Snakemake calls threads."""
        return self.plans[wildcards.experiment].analysis_processes(self.cores)

    def analysis_memory(self, wildcards: Any, attempt: int) -> int:
        """Return the memory of an analysis [MB]; see `memory`."""
        size = self.plans[wildcards.experiment].shared_memory(self.analysis_threads(wildcards))
        return self.memory(math.ceil(size / 10**6))(wildcards, attempt)

    def analysis_minutes(self, wildcards: Any, attempt: int) -> int | None:
        """Return the time limit of an analysis or an extrapolation; see `runtime`."""
        seconds = 1.0 + ANALYSED_SECONDS * self.plans[wildcards.experiment].bytes
        return self.runtime(_minutes(seconds))(wildcards, attempt)

    def analysis_disk(self, wildcards: Any) -> int:
        """Return the size of the files of an analysis [MB]."""
        return _disk(self.plans[wildcards.experiment].analysis_bytes)

    def best_disk(self, wildcards: Any) -> int:
        """Return the size of an extrapolated solution [MB]: that of the finest level."""
        return _disk(self.plans[wildcards.experiment].levels[-1].bytes)

    page_memory = 300
    """Memory of a job that makes a page [MB]: twice that of the default run."""
    page_minutes = _minutes(PAGE_SECONDS)
    page_disk = 100
    """Limit on the files of such a job [MB]: ten times those of the default run."""

    def memory(self, megabytes: int) -> Callable[[Any, int], int]:
        """Return a function that gives the memory of a job [MB], for ``resources``; it grows with each attempt."""
        return lambda wildcards, attempt: (megabytes + self.overhead) * attempt

    def runtime(self, minutes: int | None) -> Callable[[Any, int], int | None]:
        """Return a function that gives the time limit of a job [minutes]; it grows with each attempt."""
        return lambda wildcards, attempt: minutes and minutes * attempt

    @property
    def files(self) -> list[str]:
        """Every file of the chosen experiments; intermediate ones are targets too, so that they are kept."""
        return [path for plan in self.plans.values() for path in plan.files]

    @property
    def indexed(self) -> list[str]:
        """Summary and page of every experiment in the index: the chosen ones and all others in the results folder."""
        chosen = {path for plan in self.plans.values() for path in (plan.summary, plan.page)}
        stored = (self.results.glob(f"*/*/{name}") for name in ("summary.json", "report.html"))
        files = (path for paths in stored for path in paths if path.is_file())
        return sorted(chosen | {path.relative_to(self.results).as_posix() for path in files})

    @property
    def index_digest(self) -> str:
        """Digest of the index of all experiments."""
        return digest_of({"job": "index", "code": code_digest.everything()})


def _rule(key: str, levels: Sequence[int]) -> str:
    """Return a rule name that is a Python identifier, such as ``simulate_pendulum_lab__period_map__levels_06_09``."""
    ends = [f"{level:02d}" for level in dict.fromkeys((levels[0], levels[-1]))]
    suffix = "_".join(["level" if len(ends) == 1 else "levels", *ends])
    return "__".join([f"simulate_{key.replace('/', '__')}", suffix])


def _numbered(names: Iterable[str]) -> list[str]:
    """Append a number to each repeated name: the experiments ``a__b/c`` and ``a/b__c`` have the same rule name."""
    unique: dict[str, None] = {}
    for name in names:
        numbered = (f"{name}__{number}" for number in count(2))
        unique[next(new for new in chain([name], numbered) if new not in unique)] = None
    return list(unique)
