"""One thing is broken in a sound file, and one fault is told: that one, and nothing that follows from it."""

from __future__ import annotations

import copy
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from thinned import thinned

from vibsim.core.errors import Fault, InputError
from vibsim.experiment import Experiment
from vibsim.experiment.yaml.parse import dotted, read

CONFIGS = Path(__file__).parents[2] / "configs"
FILES = [
    "pendulum_lab/period_map",
    "pendulum_lab/three_arithmetics",
    "pendulum_lab/rod_and_tick",
    "showcase/coupled_pendulums",
    "showcase/double_pendulum",
    "showcase/duffing_response",
    "showcase/resonance_curves",
    "showcase/van_der_pol",
    "showcase/vehicle_over_speed",
    "showcase/washing_machine_over_speed",
    "vibration_text/adaptive_against_equal_points",
    "vibration_text/bouncing_ball",
    "vibration_text/circuit",
    "vibration_text/coulomb_on_the_mesh",
    "vibration_text/elastic_pendulum_verified",
    "vibration_text/energy_tables",
    "vibration_text/excited_oscillator",
    "vibration_text/linear_solution_linear_damping",
    "vibration_text/order_and_stability_map",
    "vibration_text/phase_and_amplitude",
    "vibration_text/scaled_forced_oscillator",
    "vibration_text/sliding_box",
]
Where = tuple[str | int, ...]
Broken = tuple[str, Where, dict[str, Any]]
"""What was done, the place of the one fault, and the content."""


def places(data: Any, where: Where = ()) -> Iterator[tuple[Where, Any]]:
    """Yield every value of a file with its place; of a long list the first two."""
    yield where, data
    if isinstance(data, dict):
        for key, value in data.items():
            yield from places(value, (*where, key))
    elif isinstance(data, list):
        for i, value in enumerate(data[:2]):
            yield from places(value, (*where, i))


def changed(data: dict[str, Any], where: Where, value: Any) -> dict[str, Any]:
    found = copy.deepcopy(data)
    holder: Any = found
    for part in where[:-1]:
        holder = holder[part]
    holder[where[-1]] = value
    return found


def breakings(data: dict[str, Any]) -> Iterator[Broken]:
    """Yield contents with one thing broken."""
    for where, value in places(data):
        top = where[0] if where else ""
        is_open = top in ("initial", "sweep", "units")
        is_open |= where[:2] in (("model", "parameters"), ("model", "outputs"))
        if isinstance(value, dict) and not is_open:
            yield "unknown key", (*where, "nonsense"), changed(data, (*where, "nonsense"), 1)
        if not where or top in ("title", "source", "units"):
            continue
        if where[-1] in ("claim", "source", "id", "text"):
            continue
        if where[-1] == "kind":
            yield "unknown kind", where, changed(data, where, str(value) + "x")
        elif isinstance(value, bool):
            yield "no truth value", where, changed(data, where, "perhaps")
        elif isinstance(value, int | float):
            yield "text for a number", where, changed(data, where, "much")
            yield "a list for a number", where, changed(data, where, {"a": 1})
            yield "not finite", where, changed(data, where, float("nan"))
            yield "an unknown unit", where, changed(data, where, f"{value} furlongs")
        elif isinstance(value, str) and where[0] == "model":
            yield "a formula that ends", where, changed(data, where, value + " +")
            yield "an unknown name", where, changed(data, where, value + " + nonsense")
    for key in ("model", "time", "schemes"):
        yield "a section is missing", (key,), {k: v for k, v in data.items() if k != key}
        yield "a section of another type", (key,), changed(data, (key,), 3)
    if "initial" in data:
        yield "an unknown state", ("initial", "q"), changed(data, ("initial", "q"), 1.0)
        yield "a section of another type", ("initial",), changed(data, ("initial",), [1])
    if "levels" in data:
        yield "a section of another type", ("levels",), changed(data, ("levels",), "many")
        rest = {k: v for k, v in data.items() if k != "levels"}
        yield "a section is missing", ("levels",), rest


def broken(name: str) -> list[Broken]:
    return list(breakings(read(CONFIGS / f"{name}.yaml").data))


def faults_of(data: dict[str, Any], path: Path) -> tuple[Fault, ...]:
    try:
        Experiment.from_dict(data)
    except InputError as error:
        return error.faults
    return ()


def is_there(fault: Fault, where: Where) -> bool:
    """Tell whether a fault is at a place, or at a value that is written there as a whole."""
    wanted = dotted(where)
    return fault.key == wanted or wanted.startswith((f"{fault.key}.", f"{fault.key}["))


@pytest.mark.parametrize("name", thinned(FILES, 5))
def test_one_broken_thing_is_one_fault(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(CONFIGS / name.partition("/")[0])
    wrong = []
    for what, where, data in broken(name):
        faults = faults_of(data, tmp_path)
        if len(faults) != 1 or not is_there(faults[0], where):
            wrong.append(
                f"{what} at {dotted(where)}: "
                + ("accepted" if not faults else "; ".join(map(str, faults)))
            )
    assert not wrong, "\n".join(wrong)
