"""Facts of some experiments, recorded once and compared by `test_contract_golden.py`.

Record them again, after a change that is meant to change them, with ``python tests/contract/golden.py`` from the
checkout, and look at the difference before you commit it.
"""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path
from typing import Any

FILE = Path(__file__).with_name("golden.json")
EXPERIMENTS = (
    "theta_convergence",
    "first_order_start",
    "linear_limit",
    "energy_conservation",
    "one_sided_velocity",
)
"""Of the collection `pendulum_lab`."""

NETCDF = (
    "tiny/level_06.nc",
    "tiny/convergence.nc",
    "tiny/best.nc",
    "swept/level_06/shard_0000.nc",
    "swept/convergence.nc",
)
"""Files of the shared run whose variables are recorded."""


def number(value: Any) -> float | None:
    return None if value is None or not math.isfinite(value) else float(value)


def numbers(found: Any, quantity: str | None) -> dict[str, list[float | None]]:
    """Orders of a quantity and their intervals, and its norms at the finest pair, of every scheme and member."""
    if quantity is None or f"{quantity}_order" not in found.convergence:
        return {}
    data = found.convergence.sel(norm="l2").isel(pair=-1)
    return {
        name: [number(one) for one in data[f"{quantity}_{name}"].values.ravel()]
        for name in ("order", "order_low", "order_high", "difference_norm")
    }


def facts(name: str) -> list[dict[str, Any]]:
    from contract.door import ROOT, counts, judged
    from vibsim import Experiment, simulate

    experiment = Experiment.from_yaml(ROOT / "configs" / "pendulum_lab" / f"{name}.yaml")
    found = judged(experiment, {level: simulate(experiment, level) for level in experiment.levels})
    return [
        {
            "id": verdict.id,
            "status": verdict.status,
            "reason": verdict.reason,
            "counts": counts(verdict),
            "values": {one.scheme: number(one.value) for one in verdict.results},
            "numbers": numbers(found, verdict.quantity if verdict.kind == "converges" else None),
        }
        for verdict in found.verdicts
    ]


def variables(path: Path) -> dict[str, str]:
    import xarray

    from contract.door import of_a_check

    with xarray.open_dataset(path, engine="netcdf4") as data:
        return {
            name: " ".join(map(str, data[name].dims))
            for name in sorted(map(str, data.variables))
            if not of_a_check(name, data[name].dims)
        }


QUANTITIES = {
    "u": "end at min max max_abs max_abs_ratio error_l1 error_l2 error_linf error_linf_interior error_rate "
    "discrete_error error_estimate_defect observed_order ratio coincidence richardson_error",
    "energy_deviation": "max_abs_interior max_abs_interior_ratio running_max relative_running_max",
    None: "period period_grid exact_period period_error frequency error_of_frequency predicted_frequency "
    "phase_error_per_period predicted_phase_error phase_error_slope amplitude amplitude_error growth_factor "
    "growth_per_period predicted_growth_per_period relative_energy_error relative_energy_error_d2t "
    "accepted_steps force_evaluations stability_limit exact_degree second_difference_fraction",
}
"""Names of values on a spring, by the quantity that they are asked of."""

EVENTS = "event_count first_event_time last_event_time rest_time"
SPRING = {"model": {"kind": "spring"}, "initial": {"u": 1.0, "v": 0.3}, "time": {"end": 40.0}}
BALL = {
    "model": {"kind": "bouncing_ball", "restitution": 0.3, "eps_v": 0.1},
    "initial": {"h": 1.0},
    "time": {"end": 5.0},
}


def values() -> dict[str, float | None]:
    """Every number that a `value` check may name, of the centred scheme on a spring and of a ball."""
    from contract.door import outcome

    asked = [
        {"id": name, "value": name, "below": 1e300, **({"quantity": of} if of else {})}
        for of, names in QUANTITIES.items()
        for name in names.split()
    ]
    for check in asked:
        if check["id"] == "at":
            check["at"] = {"t": 10.0}
    more = [{"id": name, "value": name, "below": 1e300} for name in EVENTS.split()]
    common = {"levels": [7, 8, 9], "samples": "all"}
    spring = outcome({**SPRING, **common, "schemes": ["central"], "checks": asked})
    ball = outcome({**BALL, **common, "schemes": ["rk4"], "checks": more})
    return {
        verdict.id: number(verdict.results[0].value)
        for found in (spring, ball)
        for verdict in found.verdicts
    }


def record(folder: Path) -> dict[str, Any]:
    from contract.conftest import FILES, Runs

    runs = Runs(folder)
    for name, text in FILES.items():
        runs.file(name).write_text(text)
    runs.run("mixed", 1, *FILES)
    return {
        "experiments": {name: facts(name) for name in EXPERIMENTS},
        "values": values(),
        "variables": {name: variables(runs.mixed / "adhoc" / name) for name in NETCDF},
    }


if __name__ == "__main__":
    import tempfile

    sys.path.insert(0, str(Path(__file__).parents[1]))
    with tempfile.TemporaryDirectory() as made:
        recorded = record(Path(made))
    FILE.write_text(json.dumps(recorded, indent=1, sort_keys=True) + "\n")
