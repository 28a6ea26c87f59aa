"""From a YAML file to a validated, frozen experiment; every fault of a file is reported at once, with its line.

The public names are imported on first use: a plan that is kept on disk needs neither numpy nor the validation library.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from vibsim.core.lazy import loader

if TYPE_CHECKING:
    from vibsim.experiment.collection import collection_of
    from vibsim.experiment.data import schemes_of
    from vibsim.experiment.experiment import Experiment, canonical, restore
    from vibsim.experiment.schema.checks import Check, ConvergesCheck, ValueCheck
    from vibsim.experiment.value_names import VALUES

_HOMES = {
    "data": ("schemes_of",),
    "collection": ("collection_of",),
    "experiment": ("Experiment", "canonical", "restore"),
    "schema.checks": ("Check", "ConvergesCheck", "ValueCheck"),
    "value_names": ("VALUES",),
}
_HOME = {name: f"vibsim.experiment.{module}" for module, names in _HOMES.items() for name in names}

__all__ = [
    "VALUES",
    "Check",
    "ConvergesCheck",
    "Experiment",
    "ValueCheck",
    "canonical",
    "collection_of",
    "restore",
    "schemes_of",
]


__getattr__ = loader(__name__, _HOME)


def __dir__() -> list[str]:
    return __all__
