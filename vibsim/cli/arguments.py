"""What the command line takes."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from importlib import import_module
from pathlib import Path

import vibsim

Command = Callable[[argparse.Namespace], int]
_NAMES = "experiment (name or collection/name), one member of its sweep (NAME@CASE), collection, or FILE.yaml"
LISTS = ("models", "schemes", "checks", "experiments")


def parser() -> argparse.ArgumentParser:
    """Return the parser of all commands."""
    top = argparse.ArgumentParser(prog="vibsim", description="Verify vibration simulations.")
    top.add_argument("--version", action="version", version=f"vibsim {vibsim.__version__}")
    commands = top.add_subparsers(required=True, metavar="COMMAND")
    _add_run(commands)
    _add_plain(commands)
    _add_jobs(commands)
    return top


def _later(module: str, name: str) -> Command:
    def command(options: argparse.Namespace) -> int:
        status: int = getattr(import_module(f"vibsim.cli.{module}"), name)(options)
        return status

    return command


def _command(
    commands: argparse._SubParsersAction[argparse.ArgumentParser], name: str, module: str, text: str
) -> argparse.ArgumentParser:
    sub = commands.add_parser(name, help=text, description=text)
    sub.set_defaults(command=_later(module, name if name != "list" else "list_"))
    return sub


def _results(sub: argparse.ArgumentParser) -> None:
    text = "results folder (default: results/ of the checkout)"
    sub.add_argument("--results", type=_path, metavar="DIR", help=text)


def _digest(sub: argparse.ArgumentParser) -> None:
    text = "refuse when the experiment or the code is not the one with this digest"
    sub.add_argument("--digest", type=_word, metavar="SHA256", help=text)
    text = "delete a damaged or outdated input, so that the next run makes it again"
    sub.add_argument("--discard", action="store_true", help=text)


def _add_run(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    sub = _command(commands, "run", "run.command", "Run experiments and show every verdict.")
    sub.add_argument("experiments", type=_word, nargs="*", metavar="EXPERIMENT", help=_NAMES)
    _results(sub)
    sub.add_argument(
        "--cores", type=_positive, metavar="N", help="jobs at once (default: all cores)"
    )
    sub.add_argument("--dry-run", action="store_true", help="show what would run and why")
    text = "compare every result with its digest, also where size, time and inode are as they were"
    sub.add_argument("--verify", action="store_true", help=text)
    sub.add_argument("--json", action="store_true", help="print the outcome as JSON")


def _add_plain(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    sub = _command(commands, "check", "check", "Validate experiment files, without running them.")
    sub.add_argument("experiments", type=_word, nargs="+", metavar="FILE", help=_NAMES)
    text = "Show members, jobs, steps, memory, disk space and time of experiments before they run."
    sub = _command(commands, "plan", "plan", text)
    sub.add_argument("experiments", type=_word, nargs="+", metavar="FILE", help=_NAMES)
    _results(sub)
    sub.add_argument("--json", action="store_true", help="print the plans as JSON")
    sub = _command(commands, "list", "listing", "List what there is to choose from.")
    sub.add_argument("what", choices=LISTS)


def _add_jobs(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    _add_simulate(commands)
    text = "Compare the levels of an experiment: convergence.nc and summary.json."
    sub = _command(commands, "analyse", "jobs.analyse", text)
    sub.add_argument("experiment", type=_word, metavar="EXPERIMENT", help="experiment or FILE.yaml")
    sub.add_argument("--out", type=_path, metavar="DIR", help="folder to write to")
    _threads(sub)
    _results(sub)
    _digest(sub)
    text = "Extrapolate the solution of an experiment over all its levels: best.nc."
    sub = _command(commands, "extrapolate", "jobs.extrapolate", text)
    sub.add_argument("experiment", type=_word, metavar="EXPERIMENT", help="experiment or FILE.yaml")
    sub.add_argument("--out", type=_path, metavar="FILE", help="netCDF file to write")
    _results(sub)
    _digest(sub)
    text = "Write the report of an experiment; without one, the index over all results."
    sub = _command(commands, "report", "jobs.report", text)
    sub.add_argument(
        "experiment", type=_word, nargs="?", metavar="EXPERIMENT", help="experiment or FILE.yaml"
    )
    sub.add_argument("--out", type=_path, metavar="DIR", help="folder to write to")
    text = "formats of the figure files: svg, png, pdf; several with commas (default: svg)"
    sub.add_argument("--formats", type=_word, metavar="LIST", help=text)
    _results(sub)
    _digest(sub)


def _add_simulate(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    sub = _command(commands, "simulate", "jobs.simulate", "Simulate levels of an experiment.")
    sub.add_argument("experiment", type=_word, metavar="EXPERIMENT", help="experiment or FILE.yaml")
    text = "one level, or several to the places of the plan"
    sub.add_argument("--level", type=int, nargs="+", required=True, metavar="L", help=text)
    sub.add_argument("--shard", type=int, default=0, metavar="K", help="range of members (from 0)")
    text = "netCDF file to write (default: the place of the plan, unless it is made already)"
    sub.add_argument("--out", type=_path, metavar="FILE", help=text)
    _threads(sub)
    _results(sub)
    _digest(sub)


def _threads(sub: argparse.ArgumentParser) -> None:
    text = "threads to use (default: 1); no number depends on it"
    sub.add_argument("--threads", type=_positive, default=1, metavar="N", help=text)


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
