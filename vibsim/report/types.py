"""Types used only in annotations; their modules are slow to import, or unnecessary for drawing jobs."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.transforms import Bbox

    from vibsim.experiment import Experiment
    from vibsim.experiment.data import ArraySpec, SchemeSpec, StructureSpec
    from vibsim.experiment.schema.checks import (
        AccurateCheck,
        Check,
        ConservesCheck,
        ConvergesCheck,
        EqualCheck,
        Measurement,
        StableCheck,
        ValueCheck,
    )
    from vibsim.experiment.schema.published import PublishedRow, PublishedTable
    from vibsim.experiment.schema.sweep import Axis
    from vibsim.plan import Plan
else:
    Axes = Figure = Bbox = Check = Experiment = SchemeSpec = object
    AccurateCheck = ConservesCheck = ConvergesCheck = EqualCheck = object
    Measurement = StableCheck = ValueCheck = object
    PublishedRow = PublishedTable = Axis = Plan = ArraySpec = StructureSpec = object

__all__ = [
    "AccurateCheck", "ArraySpec", "Axes", "Axis", "Bbox", "Check", "ConservesCheck", "ConvergesCheck", "EqualCheck",
    "Experiment", "Figure", "Measurement", "Plan", "PublishedRow", "PublishedTable", "SchemeSpec", "StableCheck",
    "StructureSpec", "ValueCheck",
]  # fmt: skip
