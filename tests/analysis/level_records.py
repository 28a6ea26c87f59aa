"""Level Records made from formulas: solutions whose errors are known exactly."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from vibsim.core.record import Record, Variable
from vibsim.experiment import Experiment, sweep_columns

Floats = np.ndarray


def experiment(**changes: Any) -> Experiment:
    """Return an experiment on the linear pendulum; keys of the file may be changed."""
    data: dict[str, Any] = {
        "title": "test",
        "model": {"kind": "linear_pendulum"},
        "initial": {"theta": 1.0},
        "time": {"end": 8.0},
        "levels": [4, 5, 6, 7],
        "schemes": ["central"],
        "samples": "all",
    }
    return Experiment.from_dict({**data, **changes})


def standard_error(t: Floats, h: float, scheme: int, case: int) -> tuple[Floats, Floats]:
    """Errors (exact - computed) of theta and omega: h^2 e2 + h^4 e4."""
    size = 0.02 * (1 + scheme) * (1 + 0.1 * case)
    shape = t * np.sin(t) * size, t * np.cos(t + 0.3) * size
    return h**2 * shape[0] + h**4 * size * np.sin(2 * t), h**2 * shape[1]


def level_records(
    exp: Experiment,
    error: Callable[[Floats, float, int, int], tuple[Floats, Floats]] = standard_error,
    *,
    ends: Floats | None = None,
    every: Mapping[int, int] | None = None,
    failed: tuple[tuple[int, int, int], ...] = (),
) -> dict[int, Record]:
    """Return Records per level; `failed` lists (level, scheme, case) that broke down half-way."""
    members = exp.sweep.count if exp.sweep else 1
    return {
        level: _record(exp, level, members, error, ends, (every or {}).get(level, 1), failed)
        for level in exp.levels
    }


def _record(
    exp: Experiment,
    level: int,
    members: int,
    error: Callable[..., tuple[Floats, Floats]],
    ends: Floats | None,
    every: int,
    failed: tuple[tuple[int, int, int], ...],
) -> Record:
    steps = exp.steps(level)
    fraction = np.arange(0, steps + 1, every) / steps
    end = np.full(members, exp.time.end) if ends is None else ends
    theta, omega = (np.empty((len(exp.schemes), members, len(fraction))) for _ in range(2))
    exact = np.cos(fraction * end[:, None]), -np.sin(fraction * end[:, None])
    for s in range(len(exp.schemes)):
        for c in range(members):
            wrong = error(fraction * end[c], 2.0**-level, s, c)
            theta[s, c], omega[s, c] = exact[0][c] - wrong[0], exact[1][c] - wrong[1]
            # every level starts from the same values
            theta[s, c, 0], omega[s, c, 0] = exact[0][c, 0], exact[1][c, 0]
    status = np.zeros(theta.shape[:2], dtype=np.int8)
    failure_time = np.full(status.shape, np.nan)
    last_step = np.full(status.shape, steps)
    for lv, s, c in failed:
        if lv == level:
            half = len(fraction) // 2
            theta[s, c, half:], omega[s, c, half:] = np.nan, np.nan
            status[s, c], failure_time[s, c] = 1, float(end[c] * fraction[half])
            last_step[s, c] = half * every - 1
    kinetic, potential = 0.5 * omega**2, 0.5 * theta**2
    energy = kinetic + potential
    deviation = energy - energy[..., :1]
    series = {
        "theta": theta,
        "omega": omega,
        "kinetic_energy": kinetic,
        "potential_energy": potential,
        "energy": energy,
        "energy_deviation": deviation,
    }
    member: dict[str, Floats] = {
        "theta_min": np.nanmin(theta, axis=-1),
        "theta_max": np.nanmax(theta, axis=-1),
        "omega_min": np.nanmin(omega, axis=-1),
        "omega_max": np.nanmax(omega, axis=-1),
        "energy_deviation_max_abs": np.nanmax(np.abs(deviation), axis=-1),
        "energy_deviation_max_abs_interior": np.nanmax(np.abs(deviation[..., :-1]), axis=-1),
        "energy_initial": energy[..., 0],
        "amplitude": np.nanmax(np.abs(theta), axis=-1),
        "period_count": np.full(status.shape, 2),
        "first_peak": np.full(status.shape, 1.0),
        "last_peak": np.full(status.shape, 1.5),
        "period": np.full(status.shape, 2 * np.pi * (1 + 4.0**-level)),
        "period_grid": np.full(status.shape, np.nan),
        "last_step": last_step,
        "failure_time": failure_time,
    }
    flags = {"flag_values": np.arange(2, dtype=np.int8), "flag_meanings": "ok non_finite"}
    whole = {
        "exact_period": np.full(members, 2 * np.pi),
        "natural_frequency": np.ones(members),
        "omega_dt": end / steps,
    }
    exacts = {"theta_exact": exact[0], "omega_exact": exact[1]}
    variables = {
        **_table(series, ("scheme", "case", "t")),
        **_table(member, ("scheme", "case")),
        **_table(exacts, ("case", "t")),
        **_table(whole, ("case",)),
        "status": Variable(("scheme", "case"), status, {**_attrs("status"), **flags}),
    }
    t = fraction * (exp.time.end if ends is None else 1.0)
    coords = {
        "scheme": Variable(("scheme",), np.array([s.name for s in exp.schemes])),
        "case": Variable(("case",), np.arange(members)),
        "t": Variable(("t",), t, {"units": "s", "long_name": "time"}),
    }
    if ends is not None:
        coords["end"] = Variable(("case",), end, {"units": "s"})
    for key, values in sweep_columns.columns(exp, 0, members).items():
        coords[key.replace(".", "_")] = Variable(("case",), values, {"sweep_key": key})
    return Record(coords, variables, {"level": level, "steps": steps, "every": every})


def _attrs(name: str) -> dict[str, Any]:
    return {"units": "1", "long_name": name}


def _table(arrays: Mapping[str, Floats], dims: tuple[str, ...]) -> dict[str, Variable]:
    return {name: Variable(dims, values, _attrs(name)) for name, values in arrays.items()}
