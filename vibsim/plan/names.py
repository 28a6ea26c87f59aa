"""What the rules of the workflow ask: names of files, digests of jobs; nothing else."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from vibsim.plan.build import digest_of, report_code
from vibsim.plan.cache import load_all
from vibsim.plan.choose import choose
from vibsim.plan.jobs import Plan


@dataclass(frozen=True)
class Names:
    """The plans of the chosen experiments, asked by wildcard."""

    plans: Mapping[str, Plan]
    results: Path

    @staticmethod
    def of(experiments: Sequence[str], results: str, root: Path) -> Names:
        """Load the plans of `experiments` (files, names, collections; none means the default)."""
        folder = Path(results).absolute()
        return Names(load_all(choose(experiments, root), folder), folder)

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

    def shard_digest(self, wildcards: Any) -> str:
        """Return the digest of a simulate job."""
        shards = self.plans[wildcards.experiment].level(int(wildcards.level)).shards
        return shards[int(getattr(wildcards, "shard", 0))].digest

    def shards(self, wildcards: Any) -> list[str]:
        """Return the level files of an experiment."""
        return [shard.path for shard in self.plans[wildcards.experiment].shards]

    def analysis_digest(self, wildcards: Any) -> str:
        """Return the digest of an analysis."""
        return self.plans[wildcards.experiment].analysis

    def report_digest(self, wildcards: Any) -> str:
        """Return the digest of a report."""
        return self.plans[wildcards.experiment].report

    @property
    def files(self) -> list[str]:
        """Every file of the chosen experiments: also one that only others are made from is kept."""
        return [path for plan in self.plans.values() for path in plan.files]

    @property
    def indexed(self) -> list[str]:
        """What the index shows: the chosen experiments, and the others found among the results."""
        chosen = {path for plan in self.plans.values() for path in (plan.summary, plan.page)}
        shown = (self.results.glob(f"*/*/{name}") for name in ("summary.json", "report.html"))
        found = {path.relative_to(self.results).as_posix() for paths in shown for path in paths}
        return sorted(chosen | found)

    @property
    def index_digest(self) -> str:
        """Digest of the page over all experiments."""
        return digest_of({"job": "index", "code": report_code()})
