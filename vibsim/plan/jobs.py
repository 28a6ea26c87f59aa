"""A plan: the jobs of one experiment with the files they make, their digests and their cost.

Paths are relative to the results folder and written with ``/``.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from vibsim.spec import Experiment


@dataclass(frozen=True)
class ShardJob:
    """One simulate job: a range of members at one level, with every scheme."""

    index: int
    start: int
    stop: int
    """Members from `start` up to, not including, `stop`."""
    path: str
    digest: str


@dataclass(frozen=True)
class LevelJob:
    """The jobs of one level and what they cost together."""

    level: int
    steps: int
    every: int
    """Every how many steps a sample is kept."""
    member_steps: int
    """Steps of all members and schemes."""
    bytes: int
    """Size of the files, estimated."""
    seconds: float
    """Processor time, estimated."""
    shards: tuple[ShardJob, ...]


@dataclass(frozen=True)
class Plan:
    """What there is to do for one experiment."""

    collection: str
    name: str
    title: str
    source: str | None
    cases: int
    schemes: tuple[str, ...]
    levels: tuple[LevelJob, ...]
    analysis: str
    """Digest of the analysis."""
    report: str
    """Digest of the report."""
    content: dict[str, Any]
    """The experiment in its normal form, JSON-able."""
    versions: dict[str, str]
    """Versions of the libraries that the numbers depend on."""
    file: str = ""
    """Where the experiment was read; no digest depends on it."""

    @cached_property
    def experiment(self) -> Experiment:
        """The experiment that the digests were made of, also when its file has changed since."""
        from vibsim.spec import restore

        return restore(self.content)

    @property
    def key(self) -> str:
        """The name of the experiment over all collections, also its folder within the results."""
        return f"{self.collection}/{self.name}"

    @property
    def convergence(self) -> str:
        """Path of the result of the analysis."""
        return f"{self.key}/convergence.nc"

    @property
    def summary(self) -> str:
        """Path of the verdicts."""
        return f"{self.key}/summary.json"

    @property
    def page(self) -> str:
        """Path of the report."""
        return f"{self.key}/report.html"

    @property
    def files(self) -> tuple[str, ...]:
        """Paths of everything that the jobs exchange, and of the report."""
        shards = (shard.path for shard in self.shards)
        return (*shards, self.convergence, self.summary, self.page)

    @property
    def shards(self) -> tuple[ShardJob, ...]:
        """The simulate jobs of every level."""
        return tuple(shard for level in self.levels for shard in level.shards)

    def level(self, level: int) -> LevelJob:
        """Return the jobs of `level`; KeyError where the experiment has no such level."""
        for job in self.levels:
            if job.level == level:
                return job
        raise KeyError(level)


def shard_path(key: str, level: int, shard: int | None) -> str:
    """Return the path of a level file, or of shard number `shard` of it."""
    if shard is None:
        return f"{key}/level_{level:02d}.nc"
    return f"{key}/level_{level:02d}/shard_{shard:04d}.nc"


def to_json(plan: Plan) -> str:
    """Write `plan` as JSON text, without the place where the experiment was read."""
    return json.dumps(asdict(replace(plan, file="")), allow_nan=False)


def from_json(text: str, file: Path) -> Plan:
    """Read what `to_json` wrote."""
    data = json.loads(text)
    levels = tuple(
        LevelJob(**{**level, "shards": tuple(ShardJob(**shard) for shard in level["shards"])})
        for level in data["levels"]
    )
    schemes = tuple(data["schemes"])
    return Plan(**{**data, "levels": levels, "schemes": schemes, "file": str(file)})
