"""From a YAML file to a validated, frozen experiment; every fault of a file is reported at once, with its line.

The public names are imported on first use: a plan that is kept on disk needs neither numpy nor the validation library.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from vibsim.core.lazy import lazy

if TYPE_CHECKING:
    from vibsim.experiment.experiment import Experiment, canonical, restore

__all__ = ["Experiment", "canonical", "restore"]

__getattr__, __dir__ = lazy(__name__, {".experiment": ("Experiment", "canonical", "restore")})
