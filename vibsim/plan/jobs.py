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
from vibsim.core.set_option import command_to_run
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
    """The files of one level and their total cost."""

    level: int
    steps: int
    every: int
    """Number of steps from one stored sample to the next."""
    member_steps: int
    """Steps of all members and schemes."""
    bytes: int
    """Size of the files, estimated."""
    seconds: float
    """Estimated time of the steps and the files [core seconds]."""
    shared: float
    """The part of `seconds` that a job spends only once for all of its levels: schemes that choose their own steps."""
    memory: int
    """Estimated peak memory of the largest job of the level [bytes]."""
    shards: tuple[ShardJob, ...]


@dataclass(frozen=True)
class Batch:
    """One simulate job, which makes one shard, or the same members at several cheap levels."""

    levels: tuple[int, ...]
    shard: int
    digest: str
    seconds: float
    """Estimated time of the job, with its start [core seconds]."""
    memory: int
    """Estimated peak memory of the job [bytes]."""
    is_divisible: bool
    """Whether several threads pay."""
    threads: int | None = None
    """Threads that the user requests for a solver; None where vibsim chooses."""
    runtime: int | None = None
    """Run time that the user requests for a solver [minutes]; None for no request."""


SHARED_BYTES = 32 * 10**6
"""Total size of the files above which an analysis uses several processes [bytes]."""


@dataclass(frozen=True)
class Plan:
    """The jobs of one experiment, with their files, digests and cost."""

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
    """Estimated peak memory of an analysis in one process [bytes]."""
    process_memory: int
    """Extra memory of each process, where several share the analysis [bytes]."""
    analysis_bytes: int
    """Estimated size of the results of the analysis [bytes]."""
    extrapolation: str
    """Digest of the extrapolation over all levels; empty where the experiment does not request one."""
    report: str
    """Digest of the report."""
    content: dict[str, Any]
    """The experiment in its normal form, JSON-able."""
    versions: dict[str, str]
    """Versions of the libraries that the numbers depend on."""
    inputs: tuple[tuple[str, str], ...] = ()
    """Path, relative to the experiment file, and SHA-256 of every other file that the experiment was read from."""
    packages: tuple[tuple[str, str, str], ...] = ()
    """Group, kind and code digest of every model and scheme that an installed package offers."""
    settings: tuple[str, ...] = ()
    """Values of the command line that replace those of the file, as ``KEY=VALUE``; no level depends on this text."""
    reference_seconds: float = 0.0
    """Estimated time of the reference solutions [core seconds]: the first job that needs them computes them."""
    other_seconds: float = 0.0
    """Estimated time of series, analysis and page [core seconds]."""
    notes: tuple[tuple[int, str], ...] = ()
    """Line (0 for none) and text of every warning about what the file says but probably does not mean."""
    file: str = ""
    """The experiment as a command line names it; no digest depends on it."""

    @cached_property
    def experiment(self) -> Experiment:
        """The experiment that the digests cover, even if its file has changed since."""
        from vibsim.experiment import restore

        return restore(self.content, self.source_file, self.settings)

    @property
    def source_file(self) -> Path | None:
        """The experiment file, without ``@`` and the number of a single member; None if unknown."""
        name = self.file if self.file.endswith(ENDINGS) else self.file.rpartition("@")[0]
        return Path(name) if name else None

    @property
    def remarks(self) -> tuple[str, ...]:
        """The notes, each with file and line."""
        file = str(self.source_file or "")
        return tuple(str(Fault(file, line, "", "", f"note: {text}")) for line, text in self.notes)

    @property
    def has_solver(self) -> bool:
        """Whether the user's own solver makes the levels (`vibsim.experiment.solver`)."""
        return "solver" in self.content

    @property
    def command(self) -> str:
        """The user's command or function that the jobs run; empty if they run none."""
        solver = self.content.get("solver", {})
        return "" if solver.get("kind", "files") == "files" else str(solver["text"])

    def command_to_run(self, word: str) -> str:
        """Return the command that runs the experiment, which `word` names on a command line."""
        return command_to_run(word, has_program=bool(self.command))

    @property
    def key(self) -> str:
        """``collection/name``: the name of the experiment among all collections, and its folder in the results."""
        return f"{self.collection}/{self.name}"

    @property
    def convergence(self) -> str:
        """Path of the results of the analysis."""
        return f"{self.key}/convergence.nc"

    @property
    def summary(self) -> str:
        """Path of the verdicts."""
        return f"{self.key}/summary.json"

    @property
    def best(self) -> str | None:
        """Path of the solution extrapolated over all levels; None where the experiment does not request it."""
        return f"{self.key}/best.nc" if self.extrapolation else None

    @property
    def page(self) -> str:
        """Path of the report."""
        return f"{self.key}/report.html"

    @property
    def files(self) -> dict[str, str]:
        """Path of every file that the jobs exchange, and of the report, with the digest of the job that makes it."""
        files = {shard.path: shard.digest for shard in self.shards}
        if self.best is not None:
            files[self.best] = self.extrapolation
        analysed = dict.fromkeys((self.convergence, self.summary), self.analysis)
        return {**files, **analysed, self.page: self.report}

    @property
    def shards(self) -> tuple[ShardJob, ...]:
        """The files of every level."""
        return tuple(shard for level in self.levels for shard in level.shards)

    def level(self, level: int) -> LevelJob:
        """Return the jobs of `level`; raise KeyError where the experiment has no such level."""
        return {job.level: job for job in self.levels}[level]

    def made_by(self, batch: Batch) -> tuple[ShardJob, ...]:
        """Return the files that a job makes, one for each of its levels."""
        return tuple(self.level(level).shards[batch.shard] for level in batch.levels)

    @property
    def seconds(self) -> float:
        """Estimated time of all simulate jobs [core seconds]."""
        return sum(batch.seconds for batch in self.batches)

    @property
    def cpu_seconds(self) -> float:
        """Estimated time of the whole run except its start [core seconds]."""
        return self.seconds + self.reference_seconds + self.other_seconds

    def wall_seconds(self, cores: int) -> float:
        """Return the estimated wall time of the run except its start [s]; analysis and page follow the levels."""
        longest = max((b.seconds for b in self.batches if not b.is_divisible), default=0.0)
        return max(longest, self.seconds / cores) + self.reference_seconds + self.other_seconds

    @property
    def bytes(self) -> int:
        """Estimated size of all data files [bytes]."""
        return sum(level.bytes for level in self.levels) + self.analysis_bytes

    def analysis_processes(self, cores: int) -> int:
        """Return the number of processes that share the analysis: `cores`, or one where the data are small."""
        return cores if self.bytes > SHARED_BYTES else 1

    def shared_memory(self, processes: int) -> int:
        """Return the estimated peak memory of the analysis in `processes` processes [bytes]."""
        return self.analysis_memory + (self.process_memory * processes if processes > 1 else 0)

    @property
    def memory(self) -> int:
        """Estimated peak memory of the largest job on one core [bytes]."""
        return max(self.analysis_memory, *(batch.memory for batch in self.batches))


def shard_path(key: str, level: int, shard: int | None) -> str:
    """Return the path of a level file, or of shard number `shard` of it."""
    if shard is None:
        return f"{key}/level_{level:02d}.nc"
    return f"{key}/level_{level:02d}/shard_{shard:04d}.nc"


def to_json(plan: Plan) -> str:
    """Return `plan` as JSON text, without `Plan.file`."""
    return json.dumps(asdict(replace(plan, file="")), allow_nan=False)


def from_json(text: str, file: str, key: str) -> Plan:
    """Read the plan of the experiment named `key` from the text of `to_json`, and set `Plan.file` to `file`.

    Raises
    ------
    ValueError
        Where the text is not a valid plan of that experiment. It is checked because names and digests go into commands,
        and jobs write to the paths.
    """
    plan: Plan = replace(_typed(Plan, json.loads(text)), file=file)
    digests = [plan.analysis, plan.report, *([plan.extrapolation] if plan.extrapolation else [])]
    digests += [shard.digest for shard in plan.shards] + [batch.digest for batch in plan.batches]
    if plan.key != key or not all(map(DIGEST.fullmatch, digests)):
        raise ValueError(f"{plan.key:.100}: not a plan of {key}")
    is_swept = plan.content.get("sweep") is not None
    for level in plan.levels:
        count = len(level.shards) if is_swept else 1
        valid = [(k, shard_path(key, level.level, k if is_swept else None)) for k in range(count)]
        if [(shard.index, shard.path) for shard in level.shards] != valid:
            raise ValueError(f"{key}, level {level.level}: other files than its own")
    shards = {level.level: len(level.shards) for level in plan.levels}
    for batch in plan.batches:
        if any(not 0 <= batch.shard < shards.get(level, 0) for level in batch.levels):
            raise ValueError(f"{plan.key}: a job for files that no level has")
    return plan


@cache
def _parts(kind: Any) -> tuple[Any, tuple[Any, ...], dict[str, Any]]:
    """Return the origin of a type, its arguments, and the fields of a dataclass; a plain type is its own union."""
    if is_dataclass(kind):
        return None, (), get_type_hints(kind)
    origin, inner = get_origin(kind), get_args(kind)
    if origin in (tuple, dict):
        return origin, inner, {}
    inner = inner if isinstance(kind, UnionType) else (kind,)
    # JSON may hold an integer where a float is expected
    return None, (*inner, int) if float in inner else inner, {}


def _typed(kind: Any, value: Any) -> Any:
    """Return the object of type `kind` that plain JSON data describe; raise ValueError for a value of another type."""
    # exact types, not isinstance: True is an int for Python
    origin, inner, fields = _parts(kind)
    if fields:
        if type(value) is not dict or value.keys() != fields.keys():
            raise ValueError(f"{kind.__name__}: other fields than expected")
        return kind(**{name: _typed(field, value[name]) for name, field in fields.items()})
    if origin is tuple:
        is_open = inner[-1] is ...
        if type(value) is not list or not (is_open or len(value) == len(inner)):
            raise ValueError(f"{value!r:.40}: not a list of the expected length")
        return tuple(map(_typed, repeat(inner[0]) if is_open else inner, value))
    if origin is dict:
        if type(value) is not dict:
            raise ValueError(f"{value!r:.40}: not a mapping")
        return {key: _typed(inner[1], item) for key, item in value.items()}
    if kind is not Any and type(value) not in inner:
        raise ValueError(f"{value!r:.40}: another type than expected")
    return value
