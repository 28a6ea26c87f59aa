"""Read a YAML file as a validated, immutable experiment; all faults of a file are reported at once, with lines.

Public names are imported on first use, because a plan stored on disk needs neither numpy nor pydantic.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from vibsim.core.lazy import lazy

if TYPE_CHECKING:
    from vibsim.experiment.experiment import Experiment, canonical, restore

__all__ = ["Experiment", "canonical", "restore"]

__getattr__, __dir__ = lazy(__name__, {".experiment": ("Experiment", "canonical", "restore")})
