"""A plan: the jobs of one experiment with the files they make, their digests and their cost.

Paths are relative to the results folder and written with ``/``.
"""

from __future__ import annotations

import json
import re
from dataclasses import asdict, dataclass, is_dataclass, replace
from functools import cache, cached_property
from itertools import repeat
from pathlib import Path
from types import UnionType
from typing import TYPE_CHECKING, Any, get_args, get_origin, get_type_hints

from vibsim.core.errors import Fault
from vibsim.experiment.collection import ENDINGS

if TYPE_CHECKING:
    from vibsim.experiment import Experiment

DIGEST = re.compile("[0-9a-f]{64}")


@dataclass(frozen=True)
class ShardJob:
    """A range of members at one level, with every scheme: one file."""

    index: int
    start: int
    stop: int
    """Members from `start` up to, not including, `stop`."""
    path: str
    digest: str


@dataclass(frozen=True)
class LevelJob:
    """The files of one level and what they cost together."""

    level: int
    steps: int
    every: int
    """Every how many steps a sample is kept."""
    member_steps: int
    """Steps of all members and schemes."""
    bytes: int
    """Size of the files, estimated."""
    seconds: float
    """Seconds of one core that the steps and the files take, estimated."""
    shared: float
    """Those among them that a job takes once for all of its levels: of schemes that choose their own steps."""
    memory: int
    """Bytes that the largest job of the level holds at its peak, estimated."""
    shards: tuple[ShardJob, ...]


@dataclass(frozen=True)
class Batch:
    """What one simulate job makes: one shard, or the same members at several cheap levels."""

    levels: tuple[int, ...]
    shard: int
    digest: str
    seconds: float
    """Seconds of one core that the job takes, estimated, its start included."""
    memory: int
    """Bytes that the job holds at its peak, estimated."""
    is_divisible: bool
    """Whether more threads than one are worth having."""
    threads: int | None = None
    """Threads that the user asks for; None where vibsim knows how many are of use."""
    runtime: int | None = None
    """Minutes that the user expects; None where nobody says."""


SHARED_BYTES = 32 * 10**6
"""Bytes of all files from which an analysis has work for more processes than one."""


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
    batches: tuple[Batch, ...]
    """The simulate jobs."""
    analysis: str
    """Digest of the analysis."""
    analysis_memory: int
    """Bytes that the analysis holds at its peak where one process makes it, estimated."""
    process_memory: int
    """Bytes beside these for each process, where several share it."""
    analysis_bytes: int
    """Size of what the analysis writes, estimated."""
    extrapolation: str
    """Digest of the extrapolation over all levels; empty where the experiment does not ask for one."""
    report: str
    """Digest of the report."""
    content: dict[str, Any]
    """The experiment in its normal form, JSON-able."""
    versions: dict[str, str]
    """Versions of the libraries that the numbers depend on."""
    inputs: tuple[tuple[str, str], ...] = ()
    """Every other file that the experiment was read from: its path from there, and the SHA-256 of its bytes."""
    packages: tuple[tuple[str, str, str], ...] = ()
    """Group, kind and digest of the code of every model and scheme that an installed package offers."""
    settings: tuple[str, ...] = ()
    """What a command line gave in place of values of the file, as ``KEY=VALUE``; no level depends on it."""
    reference_seconds: float = 0.0
    """Seconds of one core that reference solutions take, estimated; those of the first level that needs one."""
    other_seconds: float = 0.0
    """Seconds of one core that series, the analysis and the page take, estimated."""
    notes: tuple[tuple[int, str], ...] = ()
    """What the file says and probably does not mean, each with its line, 0 without one."""
    file: str = ""
    """Where the experiment was read, as a command line names it; no digest depends on it."""

    @cached_property
    def experiment(self) -> Experiment:
        """The experiment that the digests were made of, also when its file has changed since."""
        from vibsim.experiment import restore

        return restore(self.content, self.source_file, self.settings)

    @property
    def source_file(self) -> Path | None:
        """The experiment file; one member alone is named by the file and its number."""
        named = self.file if self.file.endswith(ENDINGS) else self.file.rpartition("@")[0]
        return Path(named) if named else None

    @property
    def remarks(self) -> tuple[str, ...]:
        """The notes with their places."""
        file = str(self.source_file or "")
        return tuple(str(Fault(file, line, "", "", f"note: {text}")) for line, text in self.notes)

    @property
    def has_solver(self) -> bool:
        """Whether a solver of the user makes the levels (`vibsim.experiment.solver`)."""
        return "solver" in self.content

    @property
    def command(self) -> str:
        """The command or the function of the user that jobs run; empty where they run none."""
        solver = self.content.get("solver", {})
        return "" if solver.get("kind", "files") == "files" else str(solver["text"])

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
    def best(self) -> str | None:
        """Path of the solution extrapolated over all levels; None where the experiment does not ask for it."""
        return f"{self.key}/best.nc" if self.extrapolation else None

    @property
    def page(self) -> str:
        """Path of the report."""
        return f"{self.key}/report.html"

    @property
    def files(self) -> dict[str, str]:
        """Paths of everything that the jobs exchange, and of the report, with the digest of the job that makes each."""
        found = {shard.path: shard.digest for shard in self.shards}
        if self.best is not None:
            found[self.best] = self.extrapolation
        analysed = dict.fromkeys((self.convergence, self.summary), self.analysis)
        return {**found, **analysed, self.page: self.report}

    @property
    def shards(self) -> tuple[ShardJob, ...]:
        """The files of every level."""
        return tuple(shard for level in self.levels for shard in level.shards)

    def level(self, level: int) -> LevelJob:
        """Return the jobs of `level`; KeyError where the experiment has no such level."""
        return {job.level: job for job in self.levels}[level]

    def made_by(self, batch: Batch) -> tuple[ShardJob, ...]:
        """Return the files that a job makes, one for each of its levels."""
        return tuple(self.level(level).shards[batch.shard] for level in batch.levels)

    @property
    def seconds(self) -> float:
        """Seconds of one core that all simulate jobs take, estimated."""
        return sum(batch.seconds for batch in self.batches)

    @property
    def cpu_seconds(self) -> float:
        """Seconds of one core that everything takes but the start of the run, estimated."""
        return self.seconds + self.reference_seconds + self.other_seconds

    def wall_seconds(self, cores: int) -> float:
        """Return how long all of that takes on so many cores, estimated; one analysis and page follow the levels."""
        longest = max((b.seconds for b in self.batches if not b.is_divisible), default=0.0)
        return max(longest, self.seconds / cores) + self.reference_seconds + self.other_seconds

    @property
    def bytes(self) -> int:
        """Size of all files of numbers, estimated."""
        return sum(level.bytes for level in self.levels) + self.analysis_bytes

    def analysis_processes(self, cores: int) -> int:
        """Return how many processes share the analysis on so many cores: one where there is little to do."""
        return cores if self.bytes > SHARED_BYTES else 1

    def shared_memory(self, processes: int) -> int:
        """Return the bytes that the analysis holds at its peak where so many processes share it, estimated."""
        return self.analysis_memory + (self.process_memory * processes if processes > 1 else 0)

    @property
    def memory(self) -> int:
        """Bytes that the largest job holds at its peak on one core, estimated."""
        return max(self.analysis_memory, *(batch.memory for batch in self.batches))


def shard_path(key: str, level: int, shard: int | None) -> str:
    """Return the path of a level file, or of shard number `shard` of it."""
    if shard is None:
        return f"{key}/level_{level:02d}.nc"
    return f"{key}/level_{level:02d}/shard_{shard:04d}.nc"


def to_json(plan: Plan) -> str:
    """Write `plan` as JSON text, without the place where the experiment was read."""
    return json.dumps(asdict(replace(plan, file="")), allow_nan=False)


def from_json(text: str, file: str, key: str) -> Plan:
    """Read what `to_json` wrote for the experiment named `key`, which was read at `file`.

    Raises
    ------
    ValueError
        Where it is no plan of that experiment: names and digests go into commands, and paths are written to.
    """
    plan: Plan = replace(_typed(Plan, json.loads(text)), file=file)
    digests = [plan.analysis, plan.report, *([plan.extrapolation] if plan.extrapolation else [])]
    digests += [shard.digest for shard in plan.shards] + [batch.digest for batch in plan.batches]
    if plan.key != key or not all(map(DIGEST.fullmatch, digests)):
        raise ValueError(f"{plan.key:.100}: not a plan of {key}")
    is_swept = plan.content.get("sweep") is not None
    for level in plan.levels:
        count = len(level.shards) if is_swept else 1
        wanted = [(k, shard_path(key, level.level, k if is_swept else None)) for k in range(count)]
        if [(shard.index, shard.path) for shard in level.shards] != wanted:
            raise ValueError(f"{key}, level {level.level}: other files than its own")
    shards = {level.level: len(level.shards) for level in plan.levels}
    for batch in plan.batches:
        if any(not 0 <= batch.shard < shards.get(level, 0) for level in batch.levels):
            raise ValueError(f"{plan.key}: a job for files that no level has")
    return plan


@cache
def _parts(kind: Any) -> tuple[Any, tuple[Any, ...], dict[str, Any]]:
    """Return the origin of a type with its arguments, and the fields of a record; a plain type is its own union."""
    if is_dataclass(kind):
        return None, (), get_type_hints(kind)
    origin, inner = get_origin(kind), get_args(kind)
    if origin in (tuple, dict):
        return origin, inner, {}
    inner = inner if isinstance(kind, UnionType) else (kind,)
    # a whole number is written as one
    return None, (*inner, int) if float in inner else inner, {}


def _typed(kind: Any, value: Any) -> Any:
    """Return the record of type `kind` that plain data describe; ValueError where a value is of another type."""
    # types are compared, not tested by isinstance: for Python True is a number
    origin, inner, fields = _parts(kind)
    if fields:
        if type(value) is not dict or value.keys() != fields.keys():
            raise ValueError(f"{kind.__name__}: other fields than expected")
        return kind(**{name: _typed(field, value[name]) for name, field in fields.items()})
    if origin is tuple:
        is_open = inner[-1] is ...
        if type(value) is not list or not (is_open or len(value) == len(inner)):
            raise ValueError(f"{value!r:.40}: no list of the length expected")
        return tuple(map(_typed, repeat(inner[0]) if is_open else inner, value))
    if origin is dict:
        if type(value) is not dict:
            raise ValueError(f"{value!r:.40}: no mapping")
        return {key: _typed(inner[1], item) for key, item in value.items()}
    if kind is not Any and type(value) not in inner:
        raise ValueError(f"{value!r:.40}: another type than expected")
    return value
