"""Commands and options of the command line."""

from __future__ import annotations

import argparse
import math
import re
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

import vibsim
from vibsim.core.errors import nearest
from vibsim.core.vocabulary import RESTRICTIONS

_NAMES = "experiment (name or collection/name), one member of its sweep (NAME@CASE), collection, or FILE.yaml"
LISTS = ("models", "schemes", "checks", "experiments", "schema")
SHELLS = ("bash", "zsh", "fish", "words")
_Row = tuple[tuple[str, ...], dict[str, Any]]
"""Names of an option or of a positional argument, and its keyword arguments for `argparse`."""
Command = tuple[str, str, str, Sequence[_Row]]  # name, module of the function, description, options


def parser() -> argparse.ArgumentParser:
    """Return the parser of all commands."""
    top = argparse.ArgumentParser(prog="vibsim", description="Verify vibration simulations.")
    top.add_argument("--version", action="version", version=f"vibsim {vibsim.__version__}")
    subparsers = top.add_subparsers(required=True, metavar="COMMAND")
    for name, module, text, options in commands():
        sub = subparsers.add_parser(name, help=text, description=text)
        function = f"{name}_" if name in ("list", "open") else name
        sub.set_defaults(command=partial(_perform, f"vibsim.cli.{module}", function))
        for names, settings in options:
            sub.add_argument(*names, **settings)
    return top


def parsed(arguments: Sequence[str]) -> argparse.Namespace:
    """Return the parsed options; a command line that is refused ends the program with status 2."""
    top = parser()
    known = [name for name, *_ in commands()]
    first = next((word for word in arguments if not word.startswith("-")), None)
    if first is not None and first not in known:
        top.error(f"unknown command '{first}': {nearest(first, known)}")
    ours, for_snakemake = list(arguments), list[str]()
    if first == "run" and "--" in ours:
        border = ours.index("--")
        ours, for_snakemake = ours[:border], ours[border + 1 :]
    for i in range(len(ours) - 1, 0, -1):
        if re.match(r"-\.?[0-9]", ours[i]) and re.fullmatch("--[a-z-]+", ours[i - 1]):
            # `argparse` takes -0.1,-0.2 for an option
            ours[i - 1 : i + 1] = [f"{ours[i - 1]}={ours[i]}"]
    return top.parse_args(ours, argparse.Namespace(for_snakemake=for_snakemake))


def _perform(module: str, name: str, options: argparse.Namespace) -> int:
    status: int = getattr(import_module(module), name)(options)
    return status


def _number(bound: str, least: float) -> Callable[[str], float]:
    """Return a function that reads a finite number not less than `least`; `bound` is the limit in words."""

    def read(text: str) -> float:
        try:
            number = float(text)
        except ValueError:
            number = math.nan
        if not (math.isfinite(number) and number >= least):
            raise argparse.ArgumentTypeError(f"'{text}' is not a finite number {bound}".rstrip())
        return number

    return read


def _whole(least: int) -> Callable[[str], int]:
    """Return a function that reads a whole number not less than `least`."""

    def read(text: str) -> int:
        if not text.isdecimal() or int(text) < least:
            raise argparse.ArgumentTypeError(f"'{text}' is not a whole number from {least}")
        return int(text)

    return read


_finite = _number("", -math.inf)
_from_zero = _number("from 0", 0.0)
_above_zero = _number("above 0", math.ulp(0.0))
_index, _positive = _whole(0), _whole(1)


def _path(text: str) -> Path:
    """Return a path; an empty text is refused, since it would mean the current folder."""
    return Path(_word(text))


def _word(text: str) -> str:
    if not text.strip():
        raise argparse.ArgumentTypeError("must not be empty")
    return text


def _row(name: str, kind: Callable[[str], Any], metavar: str, text: str, **more: Any) -> _Row:
    return (name,), {"type": kind, "metavar": metavar, "help": text, **more}


def _flag(name: str, text: str) -> _Row:
    return (name,), {"action": "store_true", "help": text}


_WHERE = (
    "results folder (default: results/ of the checkout, or where vibsim is installed ./results)"
)
_SET = "replace a value of the file, such as model.g=1.62; may be repeated"
_TRUST = "run commands and functions that experiment files name (`solver:`); trust the files first"
_CHANGED = "refuse to run unless the experiment and the code have this digest"
_DISCARDED = "delete a damaged or outdated input, so that the next run makes it again"
RESULTS = _row("--results", _path, "DIR", _WHERE)
SETTINGS = _row("--set", _word, "KEY=VALUE", _SET, dest="settings", action="append", default=[])
FILES = _row("experiments", _word, "FILE", _NAMES, nargs="+")
CORES = _row("--cores", _positive, "N", "jobs at once (default: all cores)")
ALLOW = _flag("--allow-commands", _TRUST)
THREADS = _row(
    "--threads", _positive, "N", "threads to use (default: 1); no number depends on it", default=1
)
ONE = _row("experiment", _word, "EXPERIMENT", "experiment or FILE.yaml")
FOLDER = _row("--out", _path, "DIR", "folder to write to")
DIGEST = _row("--digest", _word, "SHA256", _CHANGED)
JOB_OPTIONS = (RESULTS, SETTINGS, DIGEST, _flag("--discard", _DISCARDED))
"""Options of every job of the workflow."""


def commands() -> Iterator[Command]:
    """Yield all commands: those for users, and then the jobs of the workflow."""
    yield "run", "run.command", "Run experiments and show every verdict.", tuple(_run())
    text = "Compare every file with the manifest of its run; recompute, and compare bit for bit."
    yield "verify", "commands.verify", text, tuple(_verify())
    text = "Run an experiment file, and again whenever it is saved."
    file = _row("file", _path, "FILE", "experiment file")
    yield "watch", "commands.watch", text, (RESULTS, file, SETTINGS, CORES, ALLOW, *_detail())
    text = "Validate experiment files, without running them."
    yield "check", "commands.plan", text, (FILES, SETTINGS)
    text = "Show members, jobs, steps, memory, disk space and time of experiments before they run."
    as_json = _flag("--json", "print the plans as JSON")
    yield "plan", "commands.plan", text, (RESULTS, FILES, SETTINGS, as_json)
    text = "Show verdicts, and the solution of the finest level as a text plot."
    yield "show", "commands.show", text, (RESULTS, SETTINGS, *_show())
    text = "Judge whether the results of any solver converge."
    yield "judge", "commands.judge", text, tuple(_judge())
    text = (
        "List models, schemes, checks or experiments, or print the JSON Schema of experiment files."
    )
    name = _row("name", _word, "NAME", "a model or a scheme, in full", nargs="?")
    yield "list", "commands.listing", text, ((("what",), {"choices": LISTS}), name)
    text = "Write a commented experiment file to begin with, and the JSON Schema for editors."
    yield "new", "commands.new", text, tuple(_new())
    text = "Show which settings, verdicts and numbers of two experiments or two results differ."
    what = "experiment, FILE.yaml, or a folder of results"
    sides = [_row(*side, what) for side in (("first", _word, "A"), ("second", _word, "B"))]
    yield "diff", "commands.diff", text, (RESULTS, *sides)
    text = "Explain the reason of a verdict: what it means and what would settle the question."
    what = "the reason of a verdict, such as order_low (default: list all of them)"
    reason = _row("reason", _word, "REASON", what, nargs="?")
    yield "explain", "commands.explain", text, (reason,)
    text = "Print the theory of a scheme on u'' + w^2 u = 0 as formulas in w dt."
    yield "theory", "commands.theory", text, tuple(_theory())
    text = "Open a report in the browser; print its path if there is no browser."
    what = "experiment whose report is opened (default: the index over all results)"
    page = _row("experiment", _word, "EXPERIMENT", what, nargs="?")
    yield "open", "commands.open", text, (RESULTS, page)
    text = "Write the movie of an experiment that has been run: MP4, WebM or GIF, or numbered PNG frames."
    yield "movie", "commands.movie", text, (RESULTS, SETTINGS, *_movie())
    text = "Print the script with which a shell completes commands, options and names."
    what = "the shell; `words` is for its script"
    words = _row("words", str, "WORD", "the command line so far", nargs="*")
    shell = ("shell",), {"choices": SHELLS, "help": what}
    yield "completion", "commands.completion", text, (shell, words)
    text = "Simulate levels of an experiment."
    yield "simulate", "jobs.simulate", text, (ONE, THREADS, *JOB_OPTIONS, *_simulate(), ALLOW)
    text = "Compare the levels of an experiment: convergence.nc and summary.json."
    yield "analyse", "jobs.analyse", text, (ONE, THREADS, *JOB_OPTIONS, FOLDER)
    text = "Extrapolate the solution of an experiment over all its levels: best.nc."
    best = _row("--out", _path, "FILE", "netCDF file to write")
    yield "extrapolate", "jobs.extrapolate", text, (ONE, *JOB_OPTIONS, best)
    text = "Write the report of an experiment; without one, the index over all results."
    yield "report", "commands.report", text, (*JOB_OPTIONS, *_report())


def _run() -> Iterator[_Row]:
    yield RESULTS
    yield _row("experiments", _word, "EXPERIMENT", _NAMES, nargs="*")
    yield from (SETTINGS, CORES)
    yield _row("--executor", _word, "NAME", "where jobs run: an executor plug-in of Snakemake")
    yield _row("--jobs", _positive, "N", "limit on the jobs that an executor has at once")
    yield _row("--profile", _path, "DIR", "a profile of Snakemake: slurm, generic, or a folder")
    yield _flag("--dry-run", "show what would run and why")
    text = "compare every result with its digest, even if size, time and inode are unchanged"
    yield _flag("--verify", text)
    yield ALLOW
    yield _flag("--json", "print the outcome as JSON")
    yield _row("--junit", _path, "FILE", "write the verdicts as a JUnit report (XML)")
    yield from _detail()


def _verify() -> Iterator[_Row]:
    yield RESULTS
    text = "experiment, collection or FILE.yaml (default: compare the files of all, recompute none)"
    yield _row("experiments", _word, "EXPERIMENT", text, nargs="*")
    yield SETTINGS
    yield _flag("--files", "compare files with the manifest, and recompute nothing")
    yield from (CORES, ALLOW)


def _simulate() -> Iterator[_Row]:
    text = "one level, or several, written to the paths in the plan"
    yield _row("--level", _index, "L", text, nargs="+", required=True)
    yield _row(
        "--shard", _index, "K", "number of the shard, a range of members (from 0)", default=0
    )
    text = "netCDF file to write (default: the path in the plan, unless that file is up to date)"
    yield _row("--out", _path, "FILE", text)


def _report() -> Iterator[_Row]:
    yield _row("experiment", _word, "EXPERIMENT", "experiment or FILE.yaml", nargs="?")
    yield FOLDER
    text = "formats of the figure files: svg, png, pdf; several with commas (default: svg)"
    yield _row("--formats", _word, "LIST", text)
    text = "copy pages, data, experiment file and metadata (RO-Crate) to a new folder"
    yield _row("--publish", _path, "DIR", text)
    yield _row("--license", _word, "TEXT", "licence of the published files: address or sentence")


def _detail() -> Iterator[_Row]:
    """Yield the options for the amount of output; the last one on the command line counts."""
    for names, value, text in (
        (("-v", "--verbose"), "full", "show every check, also those that passed"),
        (("-q", "--quiet"), "quiet", "print errors only; the exit status has the result"),
    ):
        yield names, {"action": "store_const", "const": value, "dest": "detail", "help": text}


def _new() -> Iterator[_Row]:
    yield _row("file", _path, "FILE", "new experiment file; an existing one is kept")
    yield _row("--model", _word, "KIND", "kind of the model (default: pendulum)")
    yield _row("--like", _word, "EXPERIMENT", "begin with the text of a shipped experiment")


def _theory() -> Iterator[_Row]:
    yield _row("scheme", _word, "SCHEME", "scheme, such as rk4")
    text = "option of the scheme, such as beta=1/6"
    yield _row("options", _word, "NAME=VALUE", text, nargs="*")
    yield _row("--terms", _positive, "N", "terms of each series (default: 4)", default=4)


def _show() -> Iterator[_Row]:
    text = "experiment, one member of its sweep (NAME@CASE), FILE.yaml, or a level file (FILE.nc)"
    yield _row("what", _word, "EXPERIMENT", text)
    yield _row("--quantity", _word, "NAME", "what to draw (default: the first position)")
    yield _row("--scheme", _word, "NAME", "scheme to draw (default: that of the verdict)")
    yield _row("--level", _index, "L", "level to draw (default: the finest that was made)")
    yield _row(
        "--case", _index, "K", "member to draw (default: the hardest, which the verdict names)"
    )
    yield _row(
        "--rows", _positive, "N", "lines of the plot (default: as many as the screen has room for)"
    )
    yield _row("--from", _finite, "T", "time at which the plot begins", dest="start")
    yield _flag("--no-plot", "show the verdicts alone")


def _movie() -> Iterator[_Row]:
    text = "experiment, one member of its sweep (NAME@CASE), or FILE.yaml"
    yield _row("experiment", _word, "EXPERIMENT", text)
    text = "movie to write: .mp4, .webm or .gif (default: the name of the experiment, .mp4)"
    yield _row("--output", _path, "FILE", text)
    text = "folder for the frames, as frame_0000.png and so on; no movie is written unless --output names one"
    yield _row("--frames-to", _path, "DIR", text)
    text = "one scheme, or two side by side (default: the first, and another that differs visibly)"
    yield _row("--scheme", _word, "NAME", text, nargs="+", action="extend")
    text = "one level, or two side by side (default: the finest, and the coarsest beside it)"
    yield _row("--level", _index, "L", text, nargs="+", action="extend")
    yield _row("--case", _index, "K", "member of a sweep (default: the hardest)")
    yield _row("--quantity", _word, "NAME", "quantity over time (default: the first position)")
    yield _row("--from", _finite, "T", "time at which the movie begins", dest="start")
    yield _row("--to", _finite, "T", "time at which the movie ends", dest="end")
    text = "periods in the moving window (default: 6 of a run of more than 9)"
    yield _row("--window", _above_zero, "PERIODS", text)
    yield _row("--fps", _above_zero, "N", "frames a second (default: 25, of a GIF 10)")
    text = "number of frames over the whole time (default: what the motion needs, up to 1500)"
    yield _row("--frames", _positive, "N", text)


def _judge() -> Iterator[_Row]:
    text = "a table (CSV or TSV) with a row for each level, or a netCDF file for each level"
    yield _row("files", _path, "FILE", text, nargs="+")
    text = "step size: a column of the table; an attribute or variable of each netCDF file, or h1,h2,... in their order"
    yield _row("--h", _word, "NAME", text, required=True)
    text = "columns (default: all others) or netCDF variables to judge"
    yield _row("--quantity", _word, "NAME", text, nargs="+", action="extend")
    text = "how netCDF fields are restricted to common points (default: subset)"
    yield ("--restrict",), {"choices": RESTRICTIONS, "help": text}
    yield _row("--order", _above_zero, "P", "the expected order")
    yield _row("--at-least", _above_zero, "P", "the lowest acceptable order")
    text = "the exact value of a quantity, if known; may be repeated"
    yield _row("--exact", _word, "QUANTITY=VALUE", text, action="append")
    text = "noise of the values of each level (root mean square; default: round-off)"
    yield _row("--noise", _from_zero, "X", text)
    yield _row("--report", _path, "DIR", "write report.html and verdict.json to this folder")
    yield _flag("--json", "print the verdicts as JSON, and nothing else")
