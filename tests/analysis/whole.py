"""All levels of an experiment, and their analysis, without the change into datasets and back for every level."""

from __future__ import annotations

import xarray

from vibsim import Experiment, Verdict, verdicts
from vibsim.analysis import analyse_records
from vibsim.core.record import Record
from vibsim.simulation import simulate_record


def simulated(experiment: Experiment) -> dict[int, Record]:
    return {level: simulate_record(experiment, level) for level in experiment.levels}


def analysed(experiment: Experiment) -> xarray.Dataset:
    """Return what `analyse` finds of the levels that `simulate` returns (`test_record`)."""
    return analyse_records(experiment, simulated(experiment)).to_xarray()


def decided(experiment: Experiment) -> list[Verdict]:
    """Return the verdicts on it; as records the analysis need not become a dataset either."""
    return verdicts(experiment, analyse_records(experiment, simulated(experiment)))
