"""What the rules of the workflow ask: names of files, digests of jobs; nothing else."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import chain, count
from pathlib import Path
from typing import Any

from vibsim.core.processes import usable_cores
from vibsim.core.set_option import OPTION
from vibsim.plan import code_digest
from vibsim.plan.digests import digest_of
from vibsim.plan.jobs import Batch, Plan

UNKNOWN_DISK = 1000
"""Megabytes of a job whose files have no estimate, a solver of the user: as Snakemake assumes."""
PAGE_SECONDS = 30.0
"""Seconds of a job that makes a page: several times of what those of the default run take."""
ANALYSED_SECONDS = 20e-9
"""Seconds of one core that an analysis takes for each byte of level files."""
FINISHED_SECONDS = 4.0
"""Seconds of one core that the start of an analysis and a page take, as in the default run."""
START_MINUTES = 2
"""Minutes that a job of an executor may take to start and to end."""
SLOWNESS = 4.0
"""How many times longer a job may take than is estimated, on a slower machine or one that others use as well."""
GROUP = "simulate"
"""The group of short jobs, several of which an executor may be given as one (``--group-components``)."""
GROUPED_SECONDS = 10.0
"""Seconds of one core that such a job takes at most: more than a shard holds."""
START_SECONDS = 4.0
"""Seconds that each job of an executor takes to start and to end."""


def together(seconds: Sequence[float], most: int) -> int:
    """Return how many simulations that take so many seconds share a job of an executor, `most` at most.

    So many jobs are made that their starts, one after the other, and the work of one, all at the same time, take the
    least time together. Long ones, which have a job of their own, do not count.
    """
    short = [one for one in seconds if 0.0 < one <= GROUPED_SECONDS]
    jobs = math.ceil(math.sqrt(sum(short) / START_SECONDS))
    return min(most, math.ceil(len(short) / jobs)) if jobs else most


@dataclass(frozen=True)
class Simulation:
    """A rule: some levels; where they have several shards, a job for each, told apart by the wildcard ``shard``."""

    rule: str
    """Name of the rule."""
    levels: list[int]
    paths: list[str]
    """The files of one job."""
    log: str
    benchmark: str
    """Paths of the log, and of the measured time and memory."""
    threads: int
    megabytes: int
    """Memory of a job, without the overhead of an executor."""
    minutes: int | None
    """Minutes of a job at most; None where nobody says."""
    disk: int
    """Megabytes that a job writes."""
    group: str | None
    """The group of Snakemake that a job may share with others; None where it is long enough alone."""
    digests: list[str]
    """Of every job."""
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
    """Return the megabytes of files of so many bytes, 0 where there is no estimate."""
    return math.ceil(size / 10**6) or UNKNOWN_DISK


def _minutes(seconds: float) -> int | None:
    """Return the minutes that a job may take whose work is estimated; None where it is not."""
    return START_MINUTES + math.ceil(SLOWNESS * seconds / 60.0) if seconds else None


def _of_plan(field: str) -> Callable[[Names, Any], str]:

    def ask(self: Names, wildcards: Any) -> str:
        found: str = getattr(self.plans[wildcards.experiment], field)
        return found

    return ask


@dataclass(frozen=True)
class Names:
    """The plans of the chosen experiments, asked by wildcard."""

    plans: Mapping[str, Plan]
    results: Path
    allows_commands: bool = False
    """Whether programs of the user may run."""
    settings: tuple[str, ...] = ()
    """What stands in place of values of the files."""
    cores: int = field(default_factory=usable_cores)
    """Cores that a job may use at most."""
    overhead: int = 0
    """Megabytes that a job needs for the processes of its executor, beside its own."""
    here: float = 0.0
    """Seconds of analyses and pages that are no jobs of an executor, but made where the workflow runs."""

    def level_flags(self, wildcards: Any, input: Any) -> str:  # noqa: A002
        """Return further options of jobs that make levels, which Snakemake does not compare; see `file`."""
        return "--allow-commands" if self.allows_commands else ""

    def given(self, wildcards: Any, input: Any) -> list[str]:  # noqa: A002
        """Return the options that give every job the settings, which Snakemake does not compare; see `file`."""
        return [word for text in self.settings for word in (OPTION, text)]

    @property
    def experiment_pattern(self) -> str:
        """Regular expression for exactly the chosen experiments."""
        return "|".join(map(re.escape, self.plans))

    def file(self, wildcards: Any, input: Any) -> str:  # noqa: A002
        """Return the experiment file.

        Snakemake compares no parameter that is derived from the input, so that an experiment that
        moved to another folder is not run again.
        """
        return self.plans[wildcards.experiment].file

    @property
    def simulations(self) -> list[Simulation]:
        """The rules that make the level files."""
        groups: dict[tuple[str, tuple[int, ...]], list[Batch]] = {}
        for key, plan in self.plans.items():
            for batch in plan.batches:
                groups.setdefault((key, batch.levels), []).append(batch)
        names = _different(_rule(key, levels) for key, levels in groups)
        return [
            _simulation(self.plans[key], found, name, self.cores)
            for name, ((key, _), found) in zip(names, groups.items(), strict=True)
        ]

    def shards(self, wildcards: Any) -> list[str]:
        """Return the level files of an experiment."""
        return [shard.path for shard in self.plans[wildcards.experiment].shards]

    @property
    def best_pattern(self) -> str:
        """Regular expression for the experiments with an extrapolated solution; it may match nothing."""
        return "|".join(re.escape(key) for key, plan in self.plans.items() if plan.best) or "(?!)"

    @property
    def finishes_here(self) -> bool:
        """Whether analyses, extrapolations and pages are made where the workflow runs: together they take little."""
        readings = sum(plan.bytes * (1 if plan.best is None else 2) for plan in self.plans.values())
        return ANALYSED_SECONDS * readings + FINISHED_SECONDS * len(self.plans) <= self.here

    @property
    def analysis_group(self) -> str | None:
        """The group of Snakemake of an analysis and its page, which share a job of an executor; None for jobs here."""
        return None if self.finishes_here else "analyse"

    analysis_digest = _of_plan("analysis")
    extrapolation_digest = _of_plan("extrapolation")
    report_digest = _of_plan("report")

    def analysis_threads(self, wildcards: Any) -> int:
        """Return the threads of an analysis, which are processes."""
        return self.plans[wildcards.experiment].analysis_processes(self.cores)

    def analysis_memory(self, wildcards: Any, attempt: int) -> int:
        """Return the megabytes of an analysis; see `memory`."""
        own = self.plans[wildcards.experiment].shared_memory(self.analysis_threads(wildcards))
        return self.memory(math.ceil(own / 10**6))(wildcards, attempt)

    def analysis_minutes(self, wildcards: Any, attempt: int) -> int | None:
        """Return the minutes of an analysis, or of an extrapolation; see `runtime`."""
        seconds = 1.0 + ANALYSED_SECONDS * self.plans[wildcards.experiment].bytes
        return self.runtime(_minutes(seconds))(wildcards, attempt)

    def analysis_disk(self, wildcards: Any) -> int:
        """Return the megabytes that an analysis writes."""
        return _disk(self.plans[wildcards.experiment].analysis_bytes)

    def best_disk(self, wildcards: Any) -> int:
        """Return the megabytes that an extrapolation writes: it has the size of a level."""
        return _disk(self.plans[wildcards.experiment].levels[-1].bytes)

    page_memory = 300
    """Megabytes of a job that makes a page: twice of what those of the default run take."""
    page_minutes = _minutes(PAGE_SECONDS)
    page_disk = 100
    """Megabytes that such a job writes at most: ten times of what those of the default run write."""

    def memory(self, megabytes: int) -> Callable[[Any, int], int]:
        """Return what gives the memory of a job: with that of its executor, and more where it was not enough before."""

        def of_attempt(wildcards: Any, attempt: int) -> int:
            return (megabytes + self.overhead) * attempt

        return of_attempt

    def runtime(self, minutes: int | None) -> Callable[[Any, int], int | None]:
        """Return what gives the minutes of a job: more where they were not enough before."""

        def of_attempt(wildcards: Any, attempt: int) -> int | None:
            return minutes and minutes * attempt

        return of_attempt

    @property
    def files(self) -> list[str]:
        """Every file of the chosen experiments: also one that only others are made from is kept."""
        return [path for plan in self.plans.values() for path in plan.files]

    @property
    def indexed(self) -> list[str]:
        """What the index shows: the chosen experiments, and the others found among the results."""
        chosen = {path for plan in self.plans.values() for path in (plan.summary, plan.page)}
        shown = (self.results.glob(f"*/*/{name}") for name in ("summary.json", "report.html"))
        files = (path for paths in shown for path in paths if path.is_file())
        return sorted(chosen | {path.relative_to(self.results).as_posix() for path in files})

    @property
    def index_digest(self) -> str:
        """Digest of the page over all experiments."""
        return digest_of({"job": "index", "code": code_digest.everything()})


def _rule(key: str, levels: Sequence[int]) -> str:
    """Return a name such as ``simulate_pendulum_lab__period_map__levels_06_09``: an identifier, as its parts are."""
    ends = [f"{level:02d}" for level in dict.fromkeys((levels[0], levels[-1]))]
    made = "_".join(["level" if len(ends) == 1 else "levels", *ends])
    return "__".join([f"simulate_{key.replace('/', '__')}", made])


def _different(names: Iterable[str]) -> list[str]:
    """Number names that are there already: ``a__b/c`` and ``a/b__c`` give one."""
    found: dict[str, None] = {}
    for name in names:
        numbered = (f"{name}__{number}" for number in count(2))
        found[next(one for one in chain([name], numbered) if one not in found)] = None
    return list(found)
