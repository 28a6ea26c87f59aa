"""Make one level of an experiment with a solver of the user: run its command, call its function, or read its file."""

from __future__ import annotations

import importlib
import os
import signal
import subprocess
import sys
import traceback
from contextlib import chdir
from functools import partial
from pathlib import Path
from typing import Any

from vibsim.convergence.study.grid_values import GridValues
from vibsim.core.errors import VibsimError, nearest
from vibsim.core.processes import end_with
from vibsim.core.signatures import misfit
from vibsim.experiment.solver import OUTPUTS, SolverExperiment
from vibsim.solver import level_output


def make(
    experiment: SolverExperiment,
    level: int,
    member: int,
    place: Path,
    threads: int = 1,
) -> dict[str, GridValues]:
    """Return the quantities of one level of one member.

    Parameters
    ----------
    place
        An empty folder for the output of a command.
    threads
        What stands for ``{threads}``.

    Raises
    ------
    VibsimError
        Where the solver fails, or its output is not as the experiment says; where it cannot be read, InputError.
    """
    kind, quantities = experiment.solver.kind, experiment.quantities
    if kind == "files":
        path = experiment.folder / experiment.path(level, member)
        # nobody has looked at the file, which may be a link to anything
        return level_output.read(path, quantities, is_shown=False)
    if kind == "python":
        return level_output.from_dataset(_called(experiment, level, member), quantities)
    files = {name: str(place / (name if "." in name else f"{name}.nc")) for name in OUTPUTS}
    command = experiment.arguments(level, member, {**files, "threads": str(threads)})
    _run(command, experiment.folder)
    written = [path for path in map(Path, dict.fromkeys(files.values())) if path.exists()]
    if not written:
        raise VibsimError("the command ended well, but did not write the file that {output} names")
    if written[0].is_dir():
        raise VibsimError(f"the command made a folder of {written[0]}, and must write a file")
    if not written[0].is_file() or not written[0].stat().st_size:
        raise VibsimError(f"the command wrote an empty file to {written[0]}")
    return level_output.read(written[0], quantities)


def _run(command: list[str], folder: Path) -> None:
    """Run a program without a shell, which ends with this process; what it prints goes where this process prints."""
    sys.stdout.flush()
    prepare = partial(end_with, os.getpid())
    # the programs beside this Python come first, as in jobs of the workflow
    places = (str(Path(sys.executable).parent), os.environ.get("PATH", os.defpath))
    try:
        ended = subprocess.run(
            command,
            cwd=folder,
            env=os.environ | {"PATH": os.pathsep.join(places)},
            stdin=subprocess.DEVNULL,
            preexec_fn=prepare,
            check=False,
        )
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise VibsimError(f"{command[0]}: the program cannot be started ({reason})") from None
    status = ended.returncode
    if status < 0:
        names = {number.value: number.name for number in signal.Signals}
        raise VibsimError(f"the command was killed by {names.get(-status, -status)}")
    if status:
        raise VibsimError(f"the command ended with exit status {status}")


def _called(experiment: SolverExperiment, level: int, member: int) -> Any:
    """Return what the function of the user returns; its module may stand beside the experiment file."""
    text = experiment.solver.text
    module, _, name = text.partition(":")
    arguments = {**experiment.sizes_of(level), **experiment.parameters_of(member)}
    folder = str(experiment.folder.absolute())
    if folder not in sys.path:
        # behind everything that is installed
        sys.path.append(folder)
    with chdir(folder):
        try:
            found = importlib.import_module(module)
            if not callable(getattr(found, name, None)):
                raise VibsimError(f"{module} has no function {name}: {nearest(name, dir(found))}")
            function = getattr(found, name)
            if misfits := misfit(function, **arguments):
                takes, why = misfits
                rule = "it gets sizes and parameters by name, and returns an xarray.Dataset"
                called = f"{text} is called with {', '.join(arguments)}, but takes {takes} ({why})"
                raise VibsimError(f"{called}: {rule}")
            return function(**arguments)
        except VibsimError:
            raise
        except (Exception, SystemExit) as error:
            traceback.print_exc(file=sys.stdout)
            raise VibsimError(f"{text} raised {type(error).__name__}: {error}") from None
