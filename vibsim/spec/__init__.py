"""From a YAML file to a validated, frozen experiment; every fault of a file is reported at once, with its line.

The public names are imported on first use: a plan that is kept on disk needs neither numpy nor the validation library.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from vibsim.lazy import loader

if TYPE_CHECKING:
    from vibsim.spec.about import schemes_of
    from vibsim.spec.axes import Axis, Draw, Linspace, Logspace, Range
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
    from vibsim.spec.published import PublishedRow, PublishedTable
    from vibsim.spec.reading import from_dict, load
    from vibsim.spec.sampling import stride
    from vibsim.spec.scheme_checks import ConservesCheck, EqualCheck, StableCheck
    from vibsim.spec.values import VALUES, Value

_HOMES = {
    "about": ("schemes_of",),
    "axes": ("Axis", "Draw", "Linspace", "Logspace", "Range"),
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
    "published": ("PublishedRow", "PublishedTable"),
    "reading": ("from_dict", "load"),
    "sampling": ("stride",),
    "scheme_checks": ("ConservesCheck", "EqualCheck", "StableCheck"),
    "values": ("VALUES", "Value"),
}
_HOME = {name: f"vibsim.spec.{module}" for module, names in _HOMES.items() for name in names}

__all__ = [
    "VALUES",
    "At",
    "Axis",
    "Check",
    "ClaimCheck",
    "ConservesCheck",
    "ConvergesCheck",
    "Draw",
    "EqualCheck",
    "Expect",
    "Experiment",
    "Linspace",
    "Logspace",
    "ModelSpec",
    "PublishedRow",
    "PublishedTable",
    "Range",
    "SchemeSpec",
    "StableCheck",
    "Sweep",
    "TimeSpec",
    "Value",
    "ValueCheck",
    "canonical",
    "collection_of",
    "from_dict",
    "load",
    "restore",
    "schemes_of",
    "stride",
]


__getattr__ = loader(__name__, _HOME)


def __dir__() -> list[str]:
    return __all__
