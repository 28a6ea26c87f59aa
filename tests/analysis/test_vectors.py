"""All coordinates together: norms, orders and errors of a chain, whose exact motion is known from its modes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from sweeps import assert_same_bytes, in_parts
from whole import simulated

from vibsim import Experiment, Verdict, analyse, verdicts
from vibsim.analysis import analyse_records
from vibsim.core.record import Record, Variable

Floats = NDArray[np.float64]
POSITION, VELOCITY = "position_vector", "velocity_vector"
START = np.array([1.0, 0.0, 0.0, -0.3, 0.0])
SIZE = len(START)


def chain(*checks: dict[str, Any], **changes: Any) -> Experiment:
    """Return a chain of equal masses and springs between two walls."""
    content: dict[str, Any] = {
        "title": "chain",
        "model": {
            "kind": "system",
            "repeat": {"i": [1, SIZE]},
            "coordinates": ["x{i}"],
            "acceleration": {"x{i}": "k*(x{i+1} - 2*x{i} + x{i-1})"},
            "parameters": {"k": 1.0, "x0": 0, f"x{SIZE + 1}": 0},
        },
        "initial": {f"x{i}": float(x) for i, x in enumerate(START, 1)},
        "time": {"end": 20.0, "base_steps": 100},
        "levels": [0, 1, 2, 3, 4],
        "schemes": ["velocity_verlet"],
        "checks": list(checks),
    }
    return Experiment.from_dict({**content, **changes})


def motion(t: Floats) -> tuple[Floats, Floats]:
    """Return positions and velocities of the chain, shape (coordinate, t), as sums of its modes."""
    stiffness = 2 * np.eye(SIZE) - np.eye(SIZE, k=1) - np.eye(SIZE, k=-1)
    squares, shapes = np.linalg.eigh(stiffness)
    w, sizes = np.sqrt(squares), shapes * (shapes.T @ START)
    return sizes @ np.cos(np.outer(w, t)), -(sizes * w) @ np.sin(np.outer(w, t))


def error_of(found: Any, scheme: int = 0) -> tuple[Floats, Floats]:
    """Return the errors of the finest level against `motion`, shape (coordinate, t)."""
    exact = motion(np.asarray(found["t"]))
    return tuple(
        np.stack([found[f"{word}x{i}_finest"][scheme, 0] for i in range(1, SIZE + 1)]) - truth
        for word, truth in zip(("", "v"), exact, strict=True)
    )  # type: ignore[return-value]


def facts(found: list[Verdict]) -> list[dict[str, Any]]:
    return [dict(verdict.results[0].facts) for verdict in found]


def without_exact(records: dict[int, Record]) -> dict[int, Record]:
    return {
        level: Record(
            row.coords, {n: v for n, v in row.variables.items() if "_exact" not in n}, row.attrs
        )
        for level, row in records.items()
    }


def test_norms_and_orders_are_those_of_the_whole_error() -> None:
    schemes = ["velocity_verlet", "newmark", "rk4"]
    experiment = chain(
        {"converges": POSITION, "order": 2, "schemes": schemes[:2]},
        {"converges": VELOCITY, "order": 2, "schemes": schemes[:2], "norm": "linf_interior"},
        {"converges": POSITION, "order": 4, "schemes": schemes[2:], "norm": "l1"},
        {"value": "error_linf", "quantity": POSITION, "at": {"scheme": "rk4"}, "below": 1e-7},
        schemes=schemes,
    )
    found = analyse(experiment, list_of(experiment))
    assert [verdict.status for verdict in verdicts(experiment, found)] == ["PASS"] * 4
    dt = float(found["t"][1])
    for s in range(len(schemes)):
        for name, e in zip((POSITION, VELOCITY), error_of(found, s), strict=True):
            expected = {
                "l1": dt * np.sum(np.abs(e)),
                "l2": np.sqrt(dt * np.sum(e * e)),
                "linf": np.max(np.abs(e)),
                "linf_interior": np.max(np.abs(e[:, :-1])),
            }
            norms = found[f"{name}_error_norm"][s, 0, -1]
            for norm, value in expected.items():
                assert float(norms.sel(norm=norm)) == pytest.approx(value, rel=1e-5)


def list_of(experiment: Experiment) -> list[Any]:
    return [record.to_xarray() for record in simulated(experiment).values()]


def test_only_checks_that_ask_for_a_vector_bring_one() -> None:
    experiment = chain({"converges": "x1"}, levels=[0, 1, 2])
    found = analyse_records(experiment, simulated(experiment))
    assert not [name for name in found.variables if "_vector" in name]


@pytest.mark.parametrize("is_known", [True, False])
def test_the_error_is_that_of_the_whole_state(is_known: bool) -> None:
    """With its reference, or without, where the extrapolated solution takes its place."""
    checks = ({"accurate": name, "relative": 1e-3} for name in (POSITION, VELOCITY))
    experiment = chain(*checks)
    records = simulated(experiment)
    found = analyse_records(experiment, records if is_known else without_exact(records))
    judged = verdicts(experiment, found)
    dt = float(found["t"][1])
    for fact, verdict, e in zip(facts(judged), judged, error_of(found), strict=True):
        truth = float(np.sqrt(dt * np.sum(e * e)))
        assert verdict.status == "PASS"
        assert fact["error"] == pytest.approx(truth, rel=1e-9 if is_known else 1e-3)
        assert truth <= fact["error_bound"] <= 1.02 * truth


def with_fault(records: dict[int, Record], size: float) -> dict[int, Record]:
    """Add an error of first order to the second coordinate."""

    def add(row: Record, level: int) -> Record:
        x = row.variable("x2")
        fault = size * 0.2 / 2**level * np.sin(0.7 * row["t"])
        return Record(
            row.coords,
            row.variables | {"x2": Variable(x.dims, x.values + fault, x.attrs)},
            row.attrs,
        )

    return {level: add(row, level) for level, row in records.items()}


@pytest.mark.parametrize(
    ("size", "whole"), [(2.0, "order_low"), (0.02, "pre_asymptotic"), (0.001, "asymptotic")]
)
def test_a_fault_of_one_coordinate_shows_as_far_as_it_is_a_part_of_the_error(
    size: float, whole: str
) -> None:
    """A large one is the order of all; a small one is left to a check of the coordinate."""
    checks = [{"converges": name, "order": 2} for name in (POSITION, "x2", "x5")]
    experiment = chain(*checks)
    found = analyse_records(experiment, with_fault(simulated(experiment), size))
    vector, faulty, sound = verdicts(experiment, found)
    assert vector.reason == whole
    assert faulty.status != "PASS"
    assert sound.status == "PASS"
    # other coordinates have the expected order, but it is not a matter of how the vector is computed
    assert facts([vector])[0]["cause"] == "none"
    names = [f"x{i}" for i in range(1, SIZE + 1)]
    last = [found[f"{name}_difference_norm"][0, 0, -1] for name in names]
    norms = np.array(last)[:, found.words("norm").index("l2")]
    share = 100.0 * norms[1] ** 2 / np.sum(norms**2)
    sentence = f"x2 has the largest share of the error: {share:.2g} % of its square."
    assert (sentence in vector.text) == (whole == "order_low")


@pytest.mark.parametrize("lean", [False, True])
def test_a_sweep_has_the_same_bits_in_parts(lean: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    if lean:
        monkeypatch.setattr("vibsim.experiment.storage.LEAN", 0)
    experiment = chain(
        {"converges": POSITION, "norm": "linf"},
        {"accurate": VELOCITY, "relative": 0.1},
        {"value": "richardson_error", "quantity": POSITION, "below": 1.0},
        levels=[0, 1, 2, 3],
        samples="common",
        sweep={"model.parameters.k": [0.3, 1.0, 2.0], "initial.x2": [0.0, 0.5]},
    )
    records = simulated(experiment)
    whole = analyse_records(experiment, records)
    assert_same_bytes(in_parts(experiment, records, size=4), whole)
    assert whole.attrs["storage"] == ("lean" if lean else "series")
    assert [verdict.status for verdict in verdicts(experiment, whole)] == ["PASS"] * 3


def test_coordinates_at_rest_in_different_places_do_not_move() -> None:
    """What a vector moves is what its coordinates move, not how far apart they are."""
    experiment = Experiment.from_dict(
        {
            "title": "rest",
            "model": {
                "kind": "system",
                "coordinates": ["x", "y"],
                "acceleration": {"x": "1 - x", "y": "2 - y"},
            },
            "initial": {"x": 1.0, "y": 2.0},
            "time": {"end": 10.0, "base_steps": 50},
            "levels": [0, 1, 2],
            "schemes": ["velocity_verlet"],
            "checks": [{"converges": POSITION}, {"converges": "x"}],
        }
    )
    judged = verdicts(experiment, analyse_records(experiment, simulated(experiment)))
    assert [verdict.reason for verdict in judged] == ["not_applicable"] * 2


def test_levels_of_a_chaotic_motion_part() -> None:
    """Finer levels do not help: the advice is that of the coordinates."""
    experiment = Experiment.from_dict(
        {
            "title": "chaos",
            "model": {
                "kind": "system",
                "coordinates": ["x", "y"],
                "acceleration": {"x": "-x*y*y - x*x*x/10", "y": "-x*x*y - y*y*y/10"},
            },
            "initial": {"x": 3.0, "y": 1.0, "vx": 0.5, "vy": 1.0},
            "time": {"end": 60.0, "base_steps": 2400},
            "levels": [0, 1, 2],
            "samples": "common",
            "schemes": ["rk4"],
            "checks": [{"converges": name} for name in (POSITION, "x", "y")],
        }
    )
    judged = verdicts(experiment, analyse_records(experiment, simulated(experiment)))
    assert [verdict.reason for verdict in judged] == ["pre_asymptotic"] * 3
    vector, *coordinates = facts(judged)
    assert vector["parting_time"] == pytest.approx(coordinates[0]["parting_time"], rel=0.1)
    assert "End the time interval" in judged[0].advice
