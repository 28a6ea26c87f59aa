"""Make one level with the user's own solver: run its command, call its function, or read its file."""

from __future__ import annotations

import importlib
import os
import pickle
import signal
import subprocess
import sys
import traceback
from collections.abc import Callable
from contextlib import chdir
from functools import partial
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO, Any, NoReturn

from vibsim.convergence.study.grid_values import GridValues
from vibsim.core.errors import VibsimError, nearest
from vibsim.core.processes import end_with
from vibsim.core.signatures import misfit
from vibsim.experiment.solver import OUTPUTS, SolverExperiment
from vibsim.solver import level_output

_Answer = dict[str, GridValues] | tuple[str, str]
"""The quantities, or the sentence of an error and the traceback of what the user's function raised."""


def make(
    experiment: SolverExperiment,
    level: int,
    member: int,
    work: Path,
    threads: int = 1,
) -> dict[str, GridValues]:
    """Return the quantities of one member at one level.

    Parameters
    ----------
    work
        An empty folder for the output of a command or a function.
    threads
        The value of ``{threads}`` in the command.

    Raises
    ------
    VibsimError
        Where the solver fails, or its output is not as the experiment says; InputError where it cannot be read.
    """
    kind, quantities = experiment.solver.kind, experiment.quantities
    if kind == "files":
        path = experiment.folder / experiment.path(level, member)
        # the file is untrusted: it may be a link to any file of the user, so messages must not show its content
        return level_output.read(path, quantities, is_shown=False)
    if kind == "python":
        called = partial(_called, experiment, level, member)
        return _in_a_child(lambda: level_output.from_dataset(called(), quantities), work)
    files = {name: str(work / (name if "." in name else f"{name}.nc")) for name in OUTPUTS}
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
    """Run a program without a shell; it ends with this process, and shares its stdout and stderr."""
    sys.stdout.flush()
    prepare = partial(end_with, os.getpid())
    # programs in the folder of this Python come first, as in jobs of the workflow
    folders = (str(Path(sys.executable).parent), os.environ.get("PATH", os.defpath))
    try:
        ended = subprocess.run(
            command,
            cwd=folder,
            env=os.environ | {"PATH": os.pathsep.join(folders)},
            stdin=subprocess.DEVNULL,
            preexec_fn=prepare,
            check=False,
        )
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise VibsimError(f"{command[0]}: the program cannot be started ({reason})") from None
    if ended.returncode:
        raise VibsimError(f"the command {_end(ended.returncode)}")


def _end(status: int) -> str:
    """Say how a process ended, from its exit status, or from a signal as a negative number."""
    if status < 0:
        names = {number.value: number.name for number in signal.Signals}
        return f"was killed by {names.get(-status, -status)}"
    return f"ended with exit status {status}"


def _in_a_child(values: Callable[[], dict[str, GridValues]], work: Path) -> dict[str, GridValues]:
    """Return what `values` returns in a child process, which a library may end or crash; it ends with this process.

    The child hands them over in a file of `work` that has no name.
    """
    sys.stdout.flush()
    sys.stderr.flush()
    parent = os.getpid()
    with TemporaryFile(dir=work) as result:
        child = os.fork()
        if not child:
            _write(values, result, parent)
        status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        if status or not result.seek(0, os.SEEK_END):
            rule = f"{_end(status)} before the function returned"
            raise VibsimError(f"the process of the function {rule}")
        result.seek(0)
        # the child alone can have written it
        answer: _Answer = pickle.load(result)
    if isinstance(answer, dict):
        return answer
    sentence, traced = answer
    print(traced, end="", flush=True)
    raise VibsimError(sentence)


def _write(values: Callable[[], dict[str, GridValues]], result: IO[bytes], parent: int) -> NoReturn:
    """Write the values, or why there are none, to the file `result`, and end this process."""
    status = 1
    try:
        end_with(parent)
        answer: _Answer
        try:
            answer = values()
        except VibsimError as error:
            cause = error.__cause__
            answer = str(error), "".join(traceback.format_exception(cause)) if cause else ""
        pickle.dump(answer, result)
        result.flush()
        status = 0
    except BaseException:
        traceback.print_exc(file=sys.stdout)
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)


def _called(experiment: SolverExperiment, level: int, member: int) -> Any:
    """Call the user's function and return its result; its module may be in the folder of the experiment file."""
    text = experiment.solver.text
    module_name, _, name = text.partition(":")
    arguments = {**experiment.sizes_of(level), **experiment.parameters_of(member)}
    folder = str(experiment.folder.absolute())
    if folder not in sys.path:
        # last, so that installed packages come first
        sys.path.append(folder)
    with chdir(folder):
        try:
            module = importlib.import_module(module_name)
            function = getattr(module, name, None)
            if not callable(function):
                hint = nearest(name, dir(module))
                raise VibsimError(f"{module_name} has no function {name}: {hint}")
            if misfits := misfit(function, **arguments):
                takes, why = misfits
                rule = "it gets sizes and parameters by name, and returns an xarray.Dataset"
                called = f"{text} is called with {', '.join(arguments)}, but takes {takes} ({why})"
                raise VibsimError(f"{called}: {rule}")
            return function(**arguments)
        except VibsimError:
            raise
        except (Exception, SystemExit) as error:
            raise VibsimError(f"{text} raised {type(error).__name__}: {error}") from error
