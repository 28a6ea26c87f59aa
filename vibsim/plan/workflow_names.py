"""What the rules of the workflow ask: names of files, digests of jobs; nothing else."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import chain, count
from pathlib import Path
from typing import Any

from vibsim.core.set_option import OPTION
from vibsim.plan import code_digest
from vibsim.plan.cache import Resolver, load_all
from vibsim.plan.choose import choose
from vibsim.plan.digests import digest_of
from vibsim.plan.jobs import Batch, Plan

PAGE_MEMORY = 300
"""Megabytes of a job that makes a page: twice of what those of the default run take."""
_LARGE = 32 * 10**6
"""Bytes of level files from which an analysis has work for more threads than one."""


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
    runtime: int | None
    """Minutes of a job; None where nobody says."""
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
        megabytes=-(-max(batch.memory for batch in batches) // 10**6),
        runtime=first.runtime,
        digests=[batch.digest for batch in batches],
        source=plan.file,
    )


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
    cores: int = field(default_factory=lambda: len(os.sched_getaffinity(0)))
    """Cores that a job may use at most."""
    overhead: int = 0
    """Megabytes that a job needs for the processes of its executor, beside its own."""

    @staticmethod
    def of(
        experiments: Sequence[str],
        results: str,
        root: Path,
        resolve: Resolver | None = None,
        allows_commands: bool = False,
        settings: Sequence[str] = (),
        **more: int,
    ) -> Names:
        """Load the plans of `experiments` (files, names, collections; none means the default), all with `settings`.

        Further fields, such as `cores`, go by their names.
        """
        plans = load_all(choose(experiments, root, settings), resolve, cached=True)
        return Names(plans, Path(results).absolute(), allows_commands, tuple(settings), **more)

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

    analysis_digest = _of_plan("analysis")
    extrapolation_digest = _of_plan("extrapolation")
    report_digest = _of_plan("report")

    def analysis_threads(self, wildcards: Any) -> int:
        """Return the threads of an analysis."""
        return self.cores if self.plans[wildcards.experiment].bytes > _LARGE else 1

    def analysis_memory(self, wildcards: Any, attempt: int) -> int:
        """Return the megabytes of an analysis; see `memory`."""
        own = -(-self.plans[wildcards.experiment].analysis_memory // 10**6)
        return self.memory(own)(wildcards, attempt)

    @property
    def page_memory(self) -> int:
        """Megabytes of a job that makes a page, without the overhead of an executor."""
        return PAGE_MEMORY

    def memory(self, megabytes: int) -> Callable[[Any, int], int]:
        """Return what gives the memory of a job: with that of its executor, and more where it was not enough before."""

        def asked(wildcards: Any, attempt: int) -> int:
            return (megabytes + self.overhead) * attempt

        return asked

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
