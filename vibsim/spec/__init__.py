"""From a YAML file to a validated, frozen experiment; every fault of a file is reported at once, with its line.

The public names are imported on first use: a plan that is kept on disk needs neither numpy nor the validation library.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from vibsim.spec.checks import (
        At,
        Check,
        ClaimCheck,
        ConvergesCheck,
        Expect,
        ValueCheck,
    )
    from vibsim.spec.collection import collection_of
    from vibsim.spec.experiment import (
        Experiment,
        ModelSpec,
        SchemeSpec,
        Sweep,
        TimeSpec,
        canonical,
        restore,
    )
    from vibsim.spec.reading import from_dict, load
    from vibsim.spec.sampling import stride
    from vibsim.spec.values import VALUES, Value

_HOMES = {
    "checks": (
        "At",
        "Check",
        "ClaimCheck",
        "ConvergesCheck",
        "Expect",
        "ValueCheck",
    ),
    "collection": ("collection_of",),
    "experiment": (
        "Experiment",
        "ModelSpec",
        "SchemeSpec",
        "Sweep",
        "TimeSpec",
        "canonical",
        "restore",
    ),
    "reading": ("from_dict", "load"),
    "sampling": ("stride",),
    "values": ("VALUES", "Value"),
}
_HOME = {name: f"vibsim.spec.{module}" for module, names in _HOMES.items() for name in names}

__all__ = [
    "VALUES",
    "At",
    "Check",
    "ClaimCheck",
    "ConvergesCheck",
    "Expect",
    "Experiment",
    "ModelSpec",
    "SchemeSpec",
    "Sweep",
    "TimeSpec",
    "Value",
    "ValueCheck",
    "canonical",
    "collection_of",
    "from_dict",
    "load",
    "restore",
    "stride",
]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'vibsim.spec' has no attribute {name!r}")
    return getattr(import_module(_HOME[name]), name)


def __dir__() -> list[str]:
    return __all__
