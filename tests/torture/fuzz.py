"""``make fuzz``: a coverage-guided fuzzer (atheris) gives every reader of users' files what nobody would write.

A reader returns something sound or refuses with its own exception. All else is a fault: another exception, a crash,
more than 2 s or 300 MB for one input, and anything that is run or written on the way.
"""

from __future__ import annotations

import argparse
import gc
import io
import json
import os
import random
import re
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from types import FunctionType
from typing import Any

import numpy as np
import yaml

from vibsim.core.errors import InputError
from vibsim.experiment import Experiment, canonical, restore, sweep_columns
from vibsim.experiment.reading import build
from vibsim.experiment.tables import file, matrix
from vibsim.experiment.tables.content import TableError
from vibsim.experiment.yaml.parse import parse
from vibsim.formula.parser import ExpressionError
from vibsim.formula.parser import parse as parse_formula
from vibsim.formula.render import evaluate, to_formula
from vibsim.models.table import Table
from vibsim.solver import level_files, level_tables

ROOT = Path(__file__).resolve().parents[2]
SECONDS, MEGABYTES = 2, 300
OSCILLATOR = {
    "title": "fuzz",
    "model": {"kind": "oscillator", "parameters": {"k": 2.0}},
    "initial": {"u": 1.0},
    "time": {"end": 2.0, "base_steps": 8},
    "levels": [0, 1, 2],
    "schemes": ["central"],
}


def attempt(make: Callable[[], Experiment]) -> None:
    """Require an experiment that survives its normal form, or faults that say something."""
    try:
        experiment = make()
    except InputError as error:
        refused: InputError | None = error
    else:
        refused = None
    if refused is not None:
        assert refused.faults
        assert all(fault.rule for fault in refused.faults)
        return
    content = json.loads(json.dumps(canonical(experiment), allow_nan=False))
    assert restore(content) == experiment
    _members(experiment)


def _members(experiment: Experiment) -> None:
    """Require that members are what the plan says, at both ends, and that the last one that can stands alone."""
    last = experiment.members - 1
    for found in (
        sweep_columns.columns(experiment, 0, 1),
        sweep_columns.columns(experiment, last, last + 1),
    ):
        assert all(len(values) == 1 for values in found.values())
        assert all(
            values.dtype.kind == "U" or np.isfinite(values).all() for values in found.values()
        )
    # one that starts where the one before ends does not
    alone = experiment.alone(last - last % experiment.chain)
    assert restore(canonical(alone)) == alone
    if not experiment.levels:
        attempt(lambda: experiment.with_levels([6, 7]))


def experiment(data: bytes) -> None:
    """Read the bytes of an experiment file."""
    attempt(lambda: Experiment.made_of(build(parse(data, "fuzz.yaml"), "adhoc", "fuzz")))


def formula(data: bytes) -> None:
    """Read a formula: parsed, written, evaluated; and as the spring of an oscillator, with its derivatives."""
    text = data.decode(errors="replace")
    names = dict.fromkeys(("u", "v", "t", "k"), 0.5)
    try:
        tree = parse_formula(text, names)
    except ExpressionError:
        return
    assert parse_formula(to_formula(tree), names) == tree or len(to_formula(tree)) > 1000
    with suppress(ExpressionError):
        evaluate(tree, names)
    model = OSCILLATOR["model"] | {"spring": text}
    attempt(lambda: Experiment.from_dict(OSCILLATOR | {"model": model}))


def csv(data: bytes) -> None:
    """Read CSV text as a road, a study of step sizes, and a matrix."""
    path = _file(data, "a.csv")
    _road(path)
    _matrix(path)
    with suppress(InputError):
        for study in level_tables.read(path, "h", []):
            assert len(study.values) == len(study.h["h"])


def netcdf(data: bytes) -> None:
    """Read a netCDF file as a road, and as a level of another program."""
    path = _file(data, "a.nc")
    _road(path)
    with suppress(InputError):
        level_files.read([path], "h", ["x", "h"])


def matrices(data: bytes) -> None:
    """Read a Matrix Market or a NumPy file."""
    _matrix(_file(data, "a.npy" if data.startswith(b"\x93") else "a.mtx"))


TARGETS = {f.__name__: f for f in (experiment, formula, csv, netcdf, matrices)}


def _file(data: bytes, name: str) -> Path:
    path = Path(tempfile.gettempdir()) / name
    path.write_bytes(data)
    return path


def _road(path: Path) -> None:
    with suppress(TableError):
        table, _ = file.read(path, ("x", "h"), ("x", "h"))
        assert isinstance(table, Table)
        assert np.isfinite(table.rows).all()


def _matrix(path: Path) -> None:
    with suppress(TableError):
        found, _ = matrix.read(path)
        matrix.square(found)


def seeds(target: str) -> Iterator[bytes]:
    """Yield small sound inputs, from the shipped experiments and tables where there are any."""
    files = sorted((ROOT / "configs").rglob("*.yaml"))
    if target == "experiment":
        yield from (path.read_bytes() for path in files)
    elif target == "formula":
        texts = {text for path in files for text in _texts(yaml.safe_load(path.read_text()))}
        yield from (text.encode() for text in sorted(texts) if re.search(r"\w *[*/+(-]", text))
    elif target == "csv":
        yield (ROOT / "configs/vibration_text/bumpy_road.csv").read_bytes()[:3000]
        yield b"h;a;b\n0,1;1,25;2\n0,05;1,06;2\n0,025;1,015;2\n"
        yield b"# a\n1,2\n2,5\n"
        yield b"row,column,value\n1,1,2.5\n2,2,1e3\n"
        yield b'\xef\xbb\xbf"x"\t"h"\r\n0\t1\r\n1\t2\r\n2\t3\r\n3\t4\r\n'
    elif target == "matrices":
        for name in ("mass", "stiffness"):
            yield (ROOT / f"configs/showcase/cantilever_{name}.mtx").read_bytes()
        yield b"%%MatrixMarket matrix array real symmetric\n2 2\n1\n0.5\n1\n"
        yield b"%%MatrixMarket matrix coordinate pattern general\n2 2 2\n1 1\n2 1\n"
        for array in (np.eye(3), np.arange(4), np.ones(2, dtype="c8")):
            stream = io.BytesIO()
            np.save(stream, array)
            yield stream.getvalue()
    else:
        yield from map(_dataset, ("NETCDF4", "NETCDF3_CLASSIC", "NETCDF3_64BIT_OFFSET"))


def _texts(content: Any) -> Iterator[str]:
    if isinstance(content, dict | list):
        for part in content.values() if isinstance(content, dict) else content:
            yield from _texts(part)
    elif isinstance(content, str):
        yield content


def _dataset(kind: str) -> bytes:
    import netCDF4

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.nc"
        with netCDF4.Dataset(path, "w", format=kind) as dataset:
            dataset.createDimension("x", 8)
            for name in ("x", "h"):
                dataset.createVariable(name, "f8", ("x",))[:] = np.arange(8.0)
                dataset[name].units = "m"
        return path.read_bytes()


class Executed(BaseException):
    """Input was run, or had something imported or written."""


def watch(event: str, arguments: tuple[Any, ...]) -> None:
    """Refuse, as an audit hook, what no reader does."""
    if event in ("os.system", "os.exec", "os.posix_spawn", "pickle.find_class"):
        raise Executed(event, arguments)
    if event.startswith(("subprocess.", "socket.", "ctypes.", "shutil.", "os.remove", "os.rename")):
        raise Executed(event, arguments)
    # steps are written out from templates, into which nothing of a file goes but numbers by name
    if event == "exec" and not (
        Path(file := arguments[0].co_filename).is_file() or file.startswith("<vibsim scheme ")
    ):
        raise Executed(event, arguments)
    if event == "open" and isinstance(arguments[2], int) and isinstance(arguments[0], str):
        writes = arguments[2] & (os.O_WRONLY | os.O_RDWR)
        if writes and not arguments[0].startswith((tempfile.gettempdir(), os.devnull)):
            raise Executed(event, arguments)


def timed(target: Callable[[bytes], None]) -> Callable[[bytes], None]:
    """Return a target that refuses to take longer than `SECONDS`, however busy the machine is."""

    def run(data: bytes) -> None:
        start = time.process_time()
        target(data)
        took = time.process_time() - start
        assert took < SECONDS, f"took {took:.1f} s"

    return run


def mutated(data: bytes, choose: random.Random) -> bytes:
    """Change a few bytes, for a look without the fuzzer."""
    content = bytearray(data)
    for _ in range(choose.randint(1, 6)):
        start = choose.randrange(len(content) + 1)
        end = min(len(content), start + choose.choice((0, 1, 1, 4, 40)))
        content[start:end] = choose.choice((b"", b"9", choose.randbytes(2), content[start:end] * 3))
    return bytes(content)


def _fuzz(target: str, seconds: int, seed: int, folder: Path) -> None:
    """Fuzz in this process, which the fuzzer ends."""
    import atheris

    corpus = folder / "corpus"
    corpus.mkdir()
    for number, data in enumerate(seeds(target)):
        (corpus / str(number)).write_bytes(data)
    for data in seeds(target):
        # imports what readers import late
        TARGETS[target](data)
    for function in gc.get_objects():
        # not isinstance: some objects of libraries answer it with an exception
        if type(function) is FunctionType and str(function.__module__).startswith("vibsim"):
            atheris.instrument_func(function)
    sys.addaudithook(watch)
    megabytes = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024 + MEGABYTES
    options = [
        f"-timeout={20 * SECONDS}",
        f"-rss_limit_mb={megabytes}",
        f"-max_total_time={seconds}",
    ]
    options += [f"-seed={seed}", f"-artifact_prefix={folder}/", "-max_len=20000"]
    atheris.Setup(["fuzz", *options, str(corpus)], timed(TARGETS[target]))
    atheris.Fuzz()


def main() -> int:
    """Fuzz all targets, or those that are named, each for its part of the time; return 1 where one had a fault."""
    parser = argparse.ArgumentParser(prog="make fuzz", description=__doc__)
    parser.add_argument("--minutes", type=float, default=5)
    parser.add_argument("--seed", type=int, default=random.randrange(1, 10**6))
    parser.add_argument("--only", choices=TARGETS, nargs="+", default=list(TARGETS))
    parser.add_argument("--here", type=Path, help=argparse.SUPPRESS)
    given = parser.parse_args()
    seconds = max(1, int(60 * given.minutes / len(given.only)))
    if given.here:
        _fuzz(given.only[0], seconds, given.seed, given.here)
    status = 0
    for target in given.only:
        folder = Path(tempfile.mkdtemp(prefix=f"fuzz-{target}-"))
        command = [sys.executable, "-m", "torture.fuzz", "--here", str(folder), "--only", target]
        command += ["--minutes", str(seconds / 60), "--seed", str(given.seed)]
        environment = {**os.environ, "TMPDIR": str(folder)}
        done = subprocess.run(
            command, env=environment, stderr=subprocess.PIPE, text=True, check=False
        )
        lines = done.stderr.splitlines()
        counts = [line for line in lines if re.match(r"#[0-9]+\s", line)][-1:]
        print(f"{target}: {' '.join(' '.join(counts).split())}", flush=True)
        if done.returncode:
            status = 1
            print(f"FAULT, kept in {folder}:", *lines[-60:], sep="\n", flush=True)
    return status


if __name__ == "__main__":
    sys.exit(main())
