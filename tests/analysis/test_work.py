"""The data of work-precision diagrams."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from vibsim.analysis.compare_levels import analyse_records
from vibsim.comparison.compare_quantities import comparisons
from vibsim.comparison.quantity_comparison import Comparison
from vibsim.comparison.work_precision import reference_of, work_precision
from vibsim.experiment import Experiment
from vibsim.observe.member_block import block_of
from vibsim.schemes import SCHEMES
from vibsim.simulation import simulate_record

EXPERIMENT = Experiment.from_dict(
    {
        "title": "work",
        "model": {"kind": "pendulum"},
        "initial": {"theta": 1.0},
        "time": {"end": 20.0},
        "levels": [7, 8, 9, 10],
        "schemes": ["central", "rk4", {"kind": "dop853", "tolerance": [1e-4, 1e-12]}],
        "sweep": {"initial.theta": [0.5, 1.0]},
        "samples": "common",
    }
)
FIXED, ADAPTIVE = [0, 1], [2, 3]


@pytest.fixture(scope="module")
def records() -> dict[int, Any]:
    """Return the records of all levels."""
    return {level: simulate_record(EXPERIMENT, level) for level in EXPERIMENT.levels}


@pytest.fixture(scope="module")
def found(records: dict[int, Any]) -> Comparison:
    """Return the comparison of the position."""
    return comparisons(block_of(EXPERIMENT, records), ("theta",))["theta"]


def test_every_scheme_has_its_work_beside_its_error(records: dict[int, Any]) -> None:
    record = analyse_records(EXPERIMENT, records)
    steps = np.array([2**level for level in EXPERIMENT.levels], dtype=float)
    for i in FIXED:
        evaluations = SCHEMES[EXPERIMENT.schemes[i].kind].evaluations
        assert np.array_equal(record["work_steps"][i], [steps, steps])
        assert np.array_equal(
            record["work_force_evaluations"][i], evaluations * record["work_steps"][i]
        )
    for k, level in enumerate(EXPERIMENT.levels):
        row = records[level]
        stride = (len(row["t"]) - 1) // (len(record["t"]) - 1)
        errors = np.abs(row["theta"] - row["theta_exact"])[..., ::stride].max(axis=-1)
        assert np.array_equal(record["work_error"][FIXED, :, k], errors[FIXED])
    assert record.variable("work_error").attrs["reference"] == "exact"
    assert not record["work_reference_error"].any()


def test_an_adaptive_scheme_has_one_point(records: dict[int, Any]) -> None:
    record, finest = analyse_records(EXPERIMENT, records), records[EXPERIMENT.levels[-1]]
    for name, own in (
        ("work_steps", "accepted_steps"),
        ("work_force_evaluations", "force_evaluations_total"),
    ):
        assert np.isnan(record[name][ADAPTIVE, :, :-1]).all()
        assert np.array_equal(record[name][ADAPTIVE, :, -1], finest[own][ADAPTIVE])
    errors = record["work_error"][ADAPTIVE]
    assert np.isnan(errors[..., :-1]).all()
    # a tolerance smaller by 1e8 leaves an error that is smaller by more than 1e6
    assert (errors[1, :, -1] < 1e-6 * errors[0, :, -1]).all()


def test_without_an_exact_solution_the_best_extrapolation_is_the_reference(
    found: Comparison,
) -> None:
    assert found.exact is not None
    unknown = replace(found, exact=None)
    reference, bound = reference_of(unknown)
    assert reference.shape == found.exact[0].shape
    error = np.abs(reference - found.exact[0]).max(axis=-1)
    assert (error <= bound).all()
    # no other extrapolation has a smaller bound, those of adaptive schemes apart, which have no ladder
    assert np.array_equal(bound, found.extrapolation[1][FIXED][..., -1].min(axis=0))
    table = work_precision(found.block, {"theta": unknown})
    exact = work_precision(found.block, {"theta": found})
    assert table["work_error"].attrs["reference"] == "Richardson"
    difference = np.abs(table["work_error"].values - exact["work_error"].values)
    assert np.nanmax(difference / bound[:, None]) <= 1.0


def test_without_any_reference_nothing_is_known(found: Comparison) -> None:
    alone = replace(
        found,
        exact=None,
        block=replace(found.block, adaptive=np.ones(len(EXPERIMENT.schemes), dtype=bool)),
    )
    reference, bound = reference_of(alone)
    assert np.isnan(reference).all()
    assert np.isnan(bound).all()
