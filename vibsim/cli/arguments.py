"""What the command line takes."""

from __future__ import annotations

import argparse
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import TypeAlias

import vibsim

_NAMES = "experiment (name or collection/name), one member of its sweep (NAME@CASE), collection, or FILE.yaml"
LISTS = ("models", "schemes", "checks", "experiments")
_Commands: TypeAlias = "argparse._SubParsersAction[argparse.ArgumentParser]"


def parser() -> argparse.ArgumentParser:
    """Return the parser of all commands."""
    top = argparse.ArgumentParser(prog="vibsim", description="Verify vibration simulations.")
    top.add_argument("--version", action="version", version=f"vibsim {vibsim.__version__}")
    commands = top.add_subparsers(required=True, metavar="COMMAND")
    results = argparse.ArgumentParser(add_help=False)
    text = "results folder (default: results/ of the checkout)"
    results.add_argument("--results", type=_path, metavar="DIR", help=text)
    _add_plain(commands, results)
    _add_jobs(commands, results)
    return top


def _add(
    commands: _Commands, name: str, module: str, text: str, *shared: argparse.ArgumentParser
) -> argparse.ArgumentParser:
    """Add a command, a function of its name in a module that is imported when it is called."""
    sub = commands.add_parser(name, help=text, description=text, parents=shared)
    function = "list_" if name == "list" else name
    sub.set_defaults(command=partial(_perform, f"vibsim.cli.{module}", function))
    return sub


def _perform(module: str, name: str, options: argparse.Namespace) -> int:
    status: int = getattr(import_module(module), name)(options)
    return status


def _add_plain(commands: _Commands, results: argparse.ArgumentParser) -> None:
    sub = _add(commands, "run", "run.command", "Run experiments and show every verdict.", results)
    sub.add_argument("experiments", type=_word, nargs="*", metavar="EXPERIMENT", help=_NAMES)
    text = "jobs at once (default: all cores)"
    sub.add_argument("--cores", type=_positive, metavar="N", help=text)
    sub.add_argument("--dry-run", action="store_true", help="show what would run and why")
    text = "compare every result with its digest, also where size, time and inode are as they were"
    sub.add_argument("--verify", action="store_true", help=text)
    sub.add_argument("--json", action="store_true", help="print the outcome as JSON")
    sub = _add(commands, "check", "check", "Validate experiment files, without running them.")
    sub.add_argument("experiments", type=_word, nargs="+", metavar="FILE", help=_NAMES)
    text = "Show members, jobs, steps, memory, disk space and time of experiments before they run."
    sub = _add(commands, "plan", "plan", text, results)
    sub.add_argument("experiments", type=_word, nargs="+", metavar="FILE", help=_NAMES)
    sub.add_argument("--json", action="store_true", help="print the plans as JSON")
    sub = _add(commands, "list", "listing", "List what there is to choose from.")
    sub.add_argument("what", choices=LISTS)


def _add_jobs(commands: _Commands, results: argparse.ArgumentParser) -> None:
    job = argparse.ArgumentParser(add_help=False, parents=[results])
    text = "refuse when the experiment or the code is not the one with this digest"
    job.add_argument("--digest", type=_word, metavar="SHA256", help=text)
    text = "delete a damaged or outdated input, so that the next run makes it again"
    job.add_argument("--discard", action="store_true", help=text)
    one = argparse.ArgumentParser(add_help=False)
    text = "experiment or FILE.yaml"
    one.add_argument("experiment", type=_word, metavar="EXPERIMENT", help=text)
    threads = argparse.ArgumentParser(add_help=False)
    text = "threads to use (default: 1); no number depends on it"
    threads.add_argument("--threads", type=_positive, default=1, metavar="N", help=text)

    text = "Simulate levels of an experiment."
    sub = _add(commands, "simulate", "jobs.simulate", text, one, threads, job)
    text = "one level, or several to the places of the plan"
    sub.add_argument("--level", type=int, nargs="+", required=True, metavar="L", help=text)
    sub.add_argument("--shard", type=int, default=0, metavar="K", help="range of members (from 0)")
    text = "netCDF file to write (default: the place of the plan, unless it is made already)"
    sub.add_argument("--out", type=_path, metavar="FILE", help=text)
    text = "Compare the levels of an experiment: convergence.nc and summary.json."
    sub = _add(commands, "analyse", "jobs.analyse", text, one, threads, job)
    sub.add_argument("--out", type=_path, metavar="DIR", help="folder to write to")
    text = "Extrapolate the solution of an experiment over all its levels: best.nc."
    sub = _add(commands, "extrapolate", "jobs.extrapolate", text, one, job)
    sub.add_argument("--out", type=_path, metavar="FILE", help="netCDF file to write")
    text = "Write the report of an experiment; without one, the index over all results."
    sub = _add(commands, "report", "jobs.report", text, job)
    text = "experiment or FILE.yaml"
    sub.add_argument("experiment", type=_word, nargs="?", metavar="EXPERIMENT", help=text)
    sub.add_argument("--out", type=_path, metavar="DIR", help="folder to write to")
    text = "formats of the figure files: svg, png, pdf; several with commas (default: svg)"
    sub.add_argument("--formats", type=_word, metavar="LIST", help=text)


def _path(text: str) -> Path:
    """Return a path; an empty one would be the current folder, which nobody named."""
    return Path(_word(text))


def _word(text: str) -> str:
    if not text.strip():
        raise argparse.ArgumentTypeError("must not be empty")
    return text


def _positive(text: str) -> int:
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"'{text}' is not a whole number from 1")
    return int(text)
