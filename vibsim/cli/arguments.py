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

LISTS = ("models", "schemes", "checks", "experiments", "schema")
SHELLS = ("bash", "zsh", "fish", "words")
Row = tuple[tuple[str, ...], dict[str, Any]]
"""Names of an option or of a positional argument, and its keyword arguments for `argparse`."""
Command = tuple[str, str, str, Sequence[Row]]
"""Name of a command, module of its function, description, and options."""

_SHARED = """
experiments FILE + | experiment (name or collection/name), one member of its sweep (NAME@CASE), collection, or \
FILE.yaml
experiment EXPERIMENT | experiment or FILE.yaml
--results DIR | results folder (default: results/ of the checkout, or where vibsim is installed ./results)
--set KEY=VALUE | replace a value of the file, such as model.g=1.62; may be repeated
--cores N | jobs at once (default: all cores)
--allow-commands | run commands and functions that experiment files name (`solver:`); trust the files first
--threads N | threads to use (default: 1); no number depends on it
-v --verbose | show every check, also those that passed
-q --quiet | print errors only; the exit status has the result
--digest SHA256 | refuse to run unless the experiment and the code have this digest
--discard | delete a damaged or outdated input, so that the next run makes it again
"""
"""Options of several commands, in the notation of `_COMMANDS`."""
_COMMANDS = """
> run | run.command | Run experiments and show every verdict.
--results
experiments EXPERIMENT * | experiment (name or collection/name), one member of its sweep (NAME@CASE), collection, or \
FILE.yaml
--set --cores
--executor NAME | where jobs run: an executor plug-in of Snakemake
--jobs N | limit on the jobs that an executor has at once
--profile DIR | a profile of Snakemake: slurm, generic, or a folder
--dry-run | show what would run and why
--verify | compare every result with its digest, even if size, time and inode are unchanged
--allow-commands
--json | print the outcome as JSON
--junit FILE | write the verdicts as a JUnit report (XML)
--verbose --quiet
> verify | commands.verify | Compare every file with the manifest of its run; recompute, and compare bit for bit.
--results
experiments EXPERIMENT * | experiment, collection or FILE.yaml (default: compare the files of all, recompute none)
--set
--files | compare files with the manifest, and recompute nothing
--cores --allow-commands
> watch | commands.watch | Run an experiment file, and again whenever it is saved.
--results
file FILE | experiment file
--set --cores --allow-commands --verbose --quiet
> check | commands.plan | Validate experiment files, without running them.
experiments --set
> plan | commands.plan | Show members, jobs, steps, memory, disk space and time of experiments before they run.
--results experiments --set
--json | print the plans as JSON
> show | commands.show | Show verdicts, and the solution of the finest level as a text plot.
--results --set
what EXPERIMENT | experiment, one member of its sweep (NAME@CASE), FILE.yaml, or a level file (FILE.nc)
--quantity NAME | what to draw (default: the first position)
--scheme NAME | scheme to draw (default: the first)
--level L | level to draw (default: the finest that was made)
--case K | member of a sweep to draw (default: 0)
--rows N | lines of the plot (default: 40)
--from T | time at which the plot begins
--no-plot | show the verdicts alone
> judge | commands.judge | Judge whether the results of any solver converge.
files FILE + | a table (CSV or TSV) with a row for each level, or a netCDF file for each level
--h NAME required | step size: a column of the table; an attribute or variable of each netCDF file, or h1,h2,... in \
their order
--quantity NAME + | columns (default: all others) or netCDF variables to judge
--restrict | how netCDF fields are restricted to common points (default: subset)
--order P | the expected order
--at-least P | the lowest acceptable order
--exact QUANTITY=VALUE | the exact value of a quantity, if known; may be repeated
--noise X | noise of the values of each level (root mean square; default: round-off)
--report DIR | write report.html and verdict.json to this folder
--json | print the verdicts as JSON, and nothing else
> list | commands.listing | List models, schemes, checks or experiments, or print the JSON Schema of experiment files.
what |
name NAME ? | one entry, in full
> new | commands.new | Write a commented experiment file to begin with, and the JSON Schema for editors.
file FILE | new experiment file; an existing one is kept
--model KIND | kind of the model (default: pendulum)
--like EXPERIMENT | begin with the text of a shipped experiment
> diff | commands.diff | Show which settings, verdicts and numbers of two experiments or two results differ.
--results
first A | experiment, FILE.yaml, or a folder of results
second B | experiment, FILE.yaml, or a folder of results
> explain | commands.explain | Explain the reason of a verdict: what it means and what would settle the question.
reason REASON ? | the reason of a verdict, such as order_low (default: list all of them)
> theory | commands.theory | Print the theory of a scheme on u'' + w^2 u = 0 as formulas in w dt.
scheme SCHEME | scheme, such as rk4
options NAME=VALUE * | option of the scheme, such as beta=1/6
--terms N | terms of each series (default: 4)
--latex | write the formulas as LaTeX
> open | commands.open | Open a report in the browser; print its path if there is no browser.
--results
experiment EXPERIMENT ? | experiment whose report is opened (default: the index over all results)
> movie | commands.movie | Write the movie of an experiment that has been run: MP4, WebM or GIF, or numbered PNG frames.
--results --set
experiment EXPERIMENT | experiment, one member of its sweep (NAME@CASE), or FILE.yaml
--output FILE | movie to write: .mp4, .webm or .gif (default: the name of the experiment, .mp4)
--frames-to DIR | folder for the frames, as frame_0000.png and so on; no movie is written unless --output names one
--scheme NAME + | one scheme, or two side by side (default: the first, and another that differs visibly)
--level L + | one level, or two side by side (default: the finest, and the coarsest beside it)
--case K | member of a sweep (default: 0)
--quantity NAME | quantity over time (default: the first position)
--from T | time at which the movie begins
--to T | time at which the movie ends
--window PERIODS | periods in the moving window (default: 6 of a run of more than 9)
--fps N | frames a second (default: 25, of a GIF 10)
--frames N | number of frames over the whole time (default: what the motion needs, up to 1500)
> completion | commands.completion | Print the script with which a shell completes commands, options and names.
shell | the shell; `words` is for its script
words WORD * | the command line so far
> simulate | jobs.simulate | Simulate levels of an experiment.
experiment --threads --results --set --digest --discard
--level L + required | one level, or several, written to the paths in the plan
--shard K | number of the shard, a range of members (from 0)
--out FILE | netCDF file to write (default: the path in the plan, unless that file is up to date)
--allow-commands
> analyse | jobs.analyse | Compare the levels of an experiment: convergence.nc and summary.json.
experiment --threads --results --set --digest --discard
--out DIR | folder to write to
> extrapolate | jobs.extrapolate | Extrapolate the solution of an experiment over all its levels: best.nc.
experiment --results --set --digest --discard
--out FILE | netCDF file to write
> report | commands.report | Write the report of an experiment; without one, the index over all results.
--results --set --digest --discard
experiment EXPERIMENT ? | experiment or FILE.yaml
--out DIR | folder to write to
--formats LIST | formats of the figure files: svg, png, pdf; several with commas (default: svg)
--publish DIR | copy pages, data, experiment file and metadata (RO-Crate) to a new folder
--license TEXT | licence of the published files: address or sentence
"""
"""All commands, those of the workflow last: after ``>`` name, module and description, and then the options.

A line of an option holds its names, its metavar, a count as in `argparse` or ``required``, and its meaning, whose
``(default: N)`` is the default. A line without a meaning lists options of `_SHARED`.
"""
_CHOICES = {"what": LISTS, "shell": SHELLS, "--restrict": RESTRICTIONS}
"""Values of the arguments that have neither a metavar nor are flags."""
_MORE: dict[str, dict[str, Any]] = {
    "--set": {"dest": "settings", "action": "append", "default": []},
    "--exact": {"action": "append"},
    "--verbose": {"action": "store_const", "const": "full", "dest": "detail"},
    "--quiet": {"action": "store_const", "const": "quiet", "dest": "detail"},
    "--from": {"dest": "start"},
    "--to": {"dest": "end"},
    "--shard": {"default": 0},
}
"""Further keyword arguments for `argparse`, by name."""


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
    """Import the module of a command and call its function."""
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


def _path(text: str) -> Path:
    """Return a path; an empty text is refused, since it would mean the current folder."""
    return Path(_word(text))


def _word(text: str) -> str:
    if not text.strip():
        raise argparse.ArgumentTypeError("must not be empty")
    return text


_TYPES: dict[str, Callable[[str], Any]] = {
    **dict.fromkeys(("DIR", "FILE"), _path),
    **dict.fromkeys(("K", "L"), _whole(0)),
    **dict.fromkeys(("P", "PERIODS", "--fps"), _number("above 0", math.ulp(0.0))),
    **{"N": _whole(1), "T": _number("", -math.inf), "X": _number("from 0", 0.0)},
    **{"experiments": _word, "words": str},
}
"""What reads a value, by name or metavar; any other value is a text that is not empty."""


def _row(line: str) -> Row:
    """Return the option or positional argument that a line of `_COMMANDS` describes."""
    head, text = line.split(" |", 1)
    words = head.split()
    count = 2 if words[1:] and words[1].startswith("-") else 1
    names, marks = tuple(words[:count]), words[count:]
    name, settings = names[-1], {"help": text.strip(), **_MORE.get(names[-1], {})}
    if not marks and name in _CHOICES:
        settings["choices"] = _CHOICES[name]
    elif not marks:
        settings.setdefault("action", "store_true")
    else:
        settings |= {"metavar": marks[0], "type": _TYPES.get(name) or _TYPES.get(marks[0], _word)}
    for mark in marks[1:]:
        settings |= {"required": True} if mark == "required" else {"nargs": mark}
    if "+" in marks and name.startswith("-"):
        settings["action"] = "extend"
    if default := re.search(r"\(default: (\d+)\)", text):
        settings["default"] = int(default[1])
    return names, settings


def commands() -> Iterator[Command]:
    """Yield all commands: those for users, and then the jobs of the workflow."""
    shared = {row[0][-1]: row for row in map(_row, _SHARED.strip().splitlines())}
    for section in _COMMANDS.split("\n> ")[1:]:
        head, *lines = section.strip().splitlines()
        name, module, text = head.split(" | ")
        rows: list[Row] = []
        for line in lines:
            rows += [_row(line)] if "|" in line else [shared[known] for known in line.split()]
        yield name, module, text, rows
