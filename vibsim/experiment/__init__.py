"""From a YAML file to a validated, frozen experiment; every fault of a file is reported at once, with its line.

The public names are imported on first use: a plan that is kept on disk needs neither numpy nor the validation library.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from vibsim.core.lazy import lazy

if TYPE_CHECKING:
    from vibsim.experiment.collection import collection_of
    from vibsim.experiment.data import schemes_of
    from vibsim.experiment.experiment import Experiment, canonical, restore
    from vibsim.experiment.schema.checks import Check, ConvergesCheck, ValueCheck
    from vibsim.experiment.value_names import VALUES

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

__getattr__, __dir__ = lazy(
    __name__,
    {
        ".data": ("schemes_of",),
        ".collection": ("collection_of",),
        ".experiment": ("Experiment", "canonical", "restore"),
        ".schema.checks": ("Check", "ConvergesCheck", "ValueCheck"),
        ".value_names": ("VALUES",),
    },
)
