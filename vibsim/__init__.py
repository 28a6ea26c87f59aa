"""vibsim: a verification laboratory for vibration problems.

The public names are imported on first use: a quick command must not pay for what it does not need.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from vibsim.analysis import Verdict, analyse, verdicts
    from vibsim.errors import InputError, VibsimError
    from vibsim.simulation import simulate
    from vibsim.spec import Experiment

__version__ = "0.1.0"

_HOME = {
    "Experiment": "vibsim.spec",
    "InputError": "vibsim.errors",
    "Verdict": "vibsim.analysis",
    "VibsimError": "vibsim.errors",
    "analyse": "vibsim.analysis",
    "simulate": "vibsim.simulation",
    "verdicts": "vibsim.analysis",
}

__all__ = [
    "Experiment",
    "InputError",
    "Verdict",
    "VibsimError",
    "__version__",
    "analyse",
    "simulate",
    "verdicts",
]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'vibsim' has no attribute {name!r}")
    return getattr(import_module(_HOME[name]), name)


def __dir__() -> list[str]:
    return __all__
