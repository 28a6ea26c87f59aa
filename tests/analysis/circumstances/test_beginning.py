"""Orders that depend on how a motion begins: promised where theory knows of them, and seen."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from thinned import thinned
from whole import decided

from vibsim import Experiment, analyse, simulate
from vibsim.analysis import Verdict
from vibsim.apriori.formal_orders import BEGINNINGS, beginnings, formal_orders
from vibsim.experiment import sweep_columns
from vibsim.models import MODELS
from vibsim.schemes import SCHEMES

LEVELS = [6, 7, 8, 9]
STARTS = {"any": (0.8, 0.5), "rest": (0.8, 0.0), "balance": (0.0, 0.7)}
FREE: dict[str, tuple[dict[str, Any], str, str]] = {
    "pendulum": ({"kind": "pendulum", "g": 1.0, "L": 1.0}, "theta", "omega"),
    "spring": ({"kind": "spring", "w": 1.3}, "u", "v"),
    "uneven": ({"kind": "oscillator", "spring": "u + 0.2*u**2"}, "u", "v"),
}
OTHERS: dict[str, tuple[dict[str, Any], str, str]] = {
    "damped": ({"kind": "oscillator", "spring": "u", "damping": {"linear": 0.2}}, "u", "v"),
    "driven": ({"kind": "oscillator", "spring": "u", "force": "sin(2*t)"}, "u", "v"),
}
FIRST_ORDER = [
    kind
    for kind, scheme in SCHEMES.items()
    if not scheme.adaptive and scheme.formal_order("u", MODELS["spring"], scheme.defaults()) == 1.0
]
"""Schemes whose first power may vanish by the start."""


def experiment(
    model: tuple[dict[str, Any], str, str],
    kind: Any,
    start: tuple[float, float],
    **more: Any,
) -> Experiment:
    declared, position, velocity = model
    names = (position, velocity)
    return Experiment.from_dict(
        {
            "title": "beginnings",
            "model": declared,
            "initial": dict(zip(names, start, strict=True)),
            "time": {"end": 6.3, "base_steps": 3},
            "levels": LEVELS,
            "schemes": kind if isinstance(kind, list) else [kind],
            "checks": [{"converges": name} for name in (*names, *more.pop("quantities", ()))],
            **more,
        }
    )


def every_start(model: tuple[dict[str, Any], str, str], kind: Any, *quantities: str) -> Experiment:
    """Return an experiment whose members begin in every way."""
    names = (f"initial.{name}" for name in model[1:])
    values = (list(row) for row in zip(*STARTS.values(), strict=True))
    sweep = {"zip": dict(zip(names, values, strict=True))}
    return experiment(model, kind, (1.0, 1.0), quantities=quantities, sweep=sweep)


def judged(e: Experiment) -> list[Verdict]:
    return list(decided(e))


TREATED = [
    (kind, name)
    for kind in FIRST_ORDER
    for name, model in {**FREE, **OTHERS}.items()
    if name != "damped" or SCHEMES[kind].velocity_forces
]


@pytest.mark.slow
@pytest.mark.parametrize("model", thinned([*FREE, *OTHERS], 3))
def test_schemes_of_first_order_keep_their_promise_however_a_motion_begins(model: str) -> None:
    energies = ("kinetic_energy", "potential_energy", "energy") if model in FREE else ()
    kinds = [kind for kind, name in TREATED if name == model]
    e = every_start({**FREE, **OTHERS}[model], kinds, *energies)
    found = judged(e)
    # PASS is said where every member of every scheme passes
    assert [v.status for v in found] == ["PASS"] * len(e.checks)
    assert all({result.scheme for result in v.results} == set(kinds) for v in found)


GAINS = {
    **{name: [[1.0, 1.0, 2.0], [1.0, 2.0, 1.0]] for name in FREE},
    # a force of velocity takes every gain away, one of time that from rest
    "damped": [[1.0, 1.0, 1.0], [1.0, 1.0, 1.0]],
    "driven": [[1.0, 1.0, 2.0], [1.0, 1.0, 1.0]],
}
"""Orders of position and velocity by `STARTS`."""


@pytest.mark.parametrize(
    ("kind", "model"), [row for row in TREATED if row[0].startswith("euler_cromer")]
)
def test_euler_cromer_gains_an_order_from_rest_and_where_no_force_acts(
    kind: str, model: str
) -> None:
    declared, orders = {**FREE, **OTHERS}[model], GAINS[model]
    e = every_start(declared, kind)
    columns = sweep_columns.columns(e, 0, len(STARTS))
    found = [formal_orders(e, name, columns)[0] for name in declared[1:]]
    assert [np.broadcast_to(row, len(STARTS)).tolist() for row in found] == orders


@pytest.mark.slow
def test_numerovs_method_gains_two_orders_from_rest() -> None:
    """The series of its frequency has no second power, that of the velocity has one."""
    kind = {"kind": "newmark", "beta": "1/12"}
    e = every_start(FREE["spring"], kind, "u_phase_error")
    columns = sweep_columns.columns(e, 0, len(STARTS))
    orders = [formal_orders(e, name, columns)[0].tolist() for name in ("u", "v")]
    assert orders == [[2.0, 4.0, 2.0], [2.0, 2.0, 2.0]]
    position, _, phase = judged(e)
    assert [position.status, phase.status] == ["PASS", "PASS"]
    uneven = every_start(FREE["uneven"], kind)
    assert np.all(formal_orders(uneven, "u", columns) == 2.0)


@pytest.mark.parametrize("start", ["first_order", "centred"])
def test_a_swept_start_has_the_orders_of_every_choice(start: str) -> None:
    """Whatever is written where the sweep puts its own."""
    declared = {"kind": "euler_cromer", "start": start}
    sweep = {"schemes.euler_cromer.start": ["first_order", "centred"]}
    e = experiment(FREE["pendulum"], declared, STARTS["rest"], sweep=sweep)
    columns = sweep_columns.columns(e, 0, 2)
    assert formal_orders(e, "omega", columns).tolist() == [[2.0, 1.0]]
    assert formal_orders(e, "theta", columns).tolist() == [[1.0, 2.0]]


def test_a_driven_motion_may_begin_at_rest_and_in_balance() -> None:
    e = experiment(OTHERS["driven"], "euler_cromer", (0.0, 0.0))
    assert BEGINNINGS[int(beginnings(e, {})[0])] == "balance"
    assert [v.status for v in judged(e)] == ["PASS", "PASS"]


def test_members_begin_in_ways_of_their_own() -> None:
    sweep = {"initial.omega": [0.0, 0.3, 0.0], "initial.theta": [0.8, 0.0, np.pi]}
    e = experiment(
        FREE["pendulum"],
        "euler_cromer",
        (1.0, 1.0),
        sweep={"zip": sweep},
    )
    columns = {key: np.array(column) for key, column in sweep.items()}
    assert [BEGINNINGS[i] for i in beginnings(e, columns)] == ["rest", "balance", "rest"]
    # any shard of the members is told the same
    for case in range(3):
        own = {key: column[case : case + 1] for key, column in columns.items()}
        assert beginnings(e, own) == beginnings(e, columns)[case]
    record = analyse(e, _runs(e))
    assert record["omega_formal_order"].dims == ("scheme", "case")
    assert record["omega_formal_order"].values.tolist() == [[2.0, 1.0, 2.0]]
    assert record["theta_formal_order"].values.tolist() == [[1.0, 2.0, 1.0]]


def test_a_pull_that_is_rounding_is_none() -> None:
    e = experiment(FREE["pendulum"], "euler_cromer", (float(np.pi), 0.5))
    assert BEGINNINGS[int(beginnings(e, {})[0])] == "balance"


def _runs(e: Experiment) -> list[Any]:
    return [simulate(e, level) for level in e.levels]
