"""vibsim: a verification laboratory for vibration problems.

The public names are imported on first use: a quick command must not pay for what it does not need.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from vibsim.core.lazy import lazy

if TYPE_CHECKING:
    from vibsim.analysis import Verdict, analyse, verdicts
    from vibsim.convergence import LadderVerdict, judge
    from vibsim.core.errors import InputError, VibsimError
    from vibsim.experiment import Experiment
    from vibsim.ladder import best
    from vibsim.simulation import simulate
    from vibsim.store.tree import open as open  # noqa: A004

__version__ = "0.1.0"

__all__ = [
    "Experiment",
    "InputError",
    "LadderVerdict",
    "Verdict",
    "VibsimError",
    "__version__",
    "analyse",
    "best",
    "judge",
    "simulate",
    "verdicts",
]

__getattr__, _ = lazy(
    __name__,
    {
        "vibsim.analysis": ("Verdict", "analyse", "verdicts"),
        "vibsim.convergence": ("LadderVerdict", "judge"),
        "vibsim.core.errors": ("InputError", "VibsimError"),
        "vibsim.experiment": ("Experiment",),
        "vibsim.ladder": ("best",),
        "vibsim.simulation": ("simulate",),
        "vibsim.store.tree": ("open",),
    },
)


def __dir__() -> list[str]:
    # `import *` must not hide the open of Python
    return [*__all__, "open"]
