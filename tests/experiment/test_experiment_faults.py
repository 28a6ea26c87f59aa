"""Every class of fault: where it is, which rule it breaks, what would have been right."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from experiment_files import GOOD, build, content, faults_of, file_faults, only_fault

from vibsim.analysis import analyse_records
from vibsim.core.errors import InputError
from vibsim.experiment import Experiment, kinds
from vibsim.experiment.rules import values as value_rules
from vibsim.experiment.value_names import VALUES
from vibsim.models import MODELS, quantities
from vibsim.schemes import SCHEMES
from vibsim.simulation import simulate_record


def check(**fields: Any) -> dict[str, Any]:
    return {"checks": [fields]}


def value(**fields: Any) -> dict[str, Any]:
    return check(**({"value": "max", "quantity": "theta", "below": 1} | fields))


def at(**fields: Any) -> dict[str, Any]:
    return value(value="end", at=fields)


def swept(**rule: Any) -> dict[str, Any]:
    return {"sweep": {"model.g": rule}}


def sample(**fields: Any) -> dict[str, Any]:
    section = {"method": "sobol", "n": 4, "seed": 1, "over": {"model.g": [1, 2]}} | fields
    return {"sweep": {"sample": {k: v for k, v in section.items() if v is not None}}}


def by_tolerance(tolerance: object, **changes: Any) -> dict[str, Any]:
    return {"levels": None, "tolerance": tolerance, **changes}


G, OVER, START = "sweep.model.g", "sweep.sample.over.model", "schemes.central.start"

CASES: list[tuple[dict[str, Any], str, str, str]] = [
    # sections
    ({"title": None}, "title", "required key is missing", ""),
    ({"title": 3}, "title", "must be text", ""),
    ({"title": ""}, "title", "must not be empty", ""),
    ({"modle": 1}, "modle", "unknown key", "did you mean 'model'?"),
    ({"time": None}, "time", "required key is missing", ""),
    ({"time": 3}, "time", "must be a mapping", ""),
    ({"schemes": []}, "schemes", "must not be empty", ""),
    ({"schemes": "central"}, "schemes", "must be a list", ""),
    ({"checks": {}}, "checks", "must be a list", ""),
    ({"sweep": {}}, "sweep", "must not be empty", ""),
    # model
    (
        {"model": "pendulum"},
        "model",
        "must be a mapping with the key kind",
        "write {kind: pendulum}",
    ),
    ({"model": "a"}, "model", "must be a mapping with the key kind", "e.g. {kind:"),
    ({"time": {"end": 2, 5: None}}, "time.5", "unknown key", "between braces a comma ends a value"),
    (
        {"model": {}},
        "model.kind",
        "required key is missing",
        "choose from " + ", ".join(sorted(MODELS)[:3]),
    ),
    ({"model": {"kind": "pendulun"}}, "model.kind", "unknown model", "did you mean 'pendulum'?"),
    ({"model": {"kind": 3}}, "model.kind", "unknown model", "choose from"),
    (
        {"model": {"kind": "mathieu"}},
        "model.kind",
        "unknown model",
        "`vibsim new FILE --like showcase/mathieu` begins with a shipped experiment of this name",
    ),
    (
        {"model": {"kind": "structure", "stiffness": [[1]], "rayleigh": 0.1}},
        "model.rayleigh",
        "must be a mapping",
        "e.g. {alpha: 0.1, beta: 0.001}",
    ),
    (
        {"checks": [{"value": "period", "equals": 6.7, "tolerance": 0.1}]},
        "checks[0].tolerance",
        "unknown key",
        "did you mean 'atol'?",
    ),
    (
        {"model": {"kind": "pendulum", "x": 1}},
        "model.x",
        "unknown key",
        "choose from kind, g, L, m",
    ),
    ({"model": {"kind": "pendulum", "l": 1}}, "model.l", "unknown key", "did you mean 'L'?"),
    ({"model": {"kind": "pendulum", "g": 0}}, "model.g", "must be greater than 0", ""),
    ({"model": {"kind": "pendulum", "g": -1}}, "model.g", "must be greater than 0", ""),
    ({"model": {"kind": "pendulum", "g": True}}, "model.g", "must be a number", ""),
    ({"model": {"kind": "pendulum", "g": None}}, "model.g", "must be a number", ""),
    ({"model": {"kind": "pendulum", "g": [1]}}, "model.g", "must be a number", ""),
    ({"model": {"kind": "pendulum", "g": float("nan")}}, "model.g", "must be a finite number", ""),
    ({"model": {"kind": "pendulum", "g": 10**400}}, "model.g", "must be a finite number", ""),
    ({"model": {"kind": "pendulum", "g": "2*q"}}, "model.g", "unknown name 'q'", "e, pi"),
    ({"model": {"kind": "pendulum", "g": "yes"}}, "model.g", "unknown name 'yes'", ""),
    ({"model": {"kind": "pendulum", "g": "1/0"}}, "model.g", "no finite value", ""),
    # initial
    ({"initial": {"theta": float("inf")}}, "initial.theta", "must be a finite number", ""),
    ({"initial": {"thetaa": 1}}, "initial.thetaa", "unknown state", "did you mean 'theta'?"),
    ({"initial": [1]}, "initial", "must be a mapping", ""),
    # time
    ({"time": {}}, "time.end", "required key is missing", "or periods"),
    ({"time": {"end": 0}}, "time.end", "must be greater than 0", ""),
    ({"time": {"end": 1, "base_steps": 0}}, "time.base_steps", "must be at least 1", ""),
    ({"time": {"end": 1, "base_steps": 1.5}}, "time.base_steps", "must be a whole number", ""),
    ({"time": {"end": 1, "base_steps": "2"}}, "time.base_steps", "must be a whole number", ""),
    ({"time": {"end": 1, "base_steps": True}}, "time.base_steps", "must be a whole number", ""),
    ({"time": {"end": 1, "base_dt": 0.3}}, "time.base_dt", "whole number of base_dt", "3.333"),
    ({"time": {"end": 1, "base_dt": 3}}, "time.base_dt", "whole number of base_dt", ""),
    ({"time": {"end": 1, "base_dt": 1 + 1e-11}}, "time.base_dt", "whole number", ""),
    ({"time": {"end": 1, "base_dt": 1, "base_steps": 1}}, "time.base_dt", "together", ""),
    ({"time": {"end": 1, "periods": 1}}, "time.periods", "together with end", ""),
    ({"time": {"periods": 1}}, "time.steps_per_period", "required key is missing", ""),
    ({"time": {"steps_per_period": 4}}, "time.periods", "required key is missing", ""),
    (
        {
            "model": {"kind": "oscillator", "spring": "k*u", "parameters": {"k": 1.0}},
            "initial": {"u": 1.0},
            "checks": [],
            "time": {"periods": 1, "steps_per_period": 4},
            "sweep": {"model.parameters.k": [1.0, 0.0]},
        },
        "time.periods",
        "no natural period where model.parameters.k = 0",
        "leave that member out",
    ),
    ({"time": {"periods": 1.1, "steps_per_period": 4}}, "time.steps_per_period", "whole", "4.4"),
    (
        {"time": {"periods": 2, "steps_per_period": 4, "base_steps": 2}},
        "time.base_steps",
        "together with periods",
        "",
    ),
    # levels
    ({"levels": []}, "levels", "must not be empty", ""),
    ({"levels": 6}, "levels", "must be a list", ""),
    ({"levels": [6, 6]}, "levels[1]", "must not be repeated", ""),
    ({"levels": [7, 6]}, "levels[1]", "increasing order", ""),
    ({"levels": [6, 7.5]}, "levels[1]", "must be a whole number", ""),
    ({"levels": [6, 41]}, "levels[1]", "must be at most 40", ""),
    ({"levels": [-1, 6]}, "levels[0]", "must be at least 0", ""),
    ({"levels": {"from": 9, "to": 6}}, "levels.to", "must be at least 'from', which is 9", ""),
    ({"levels": {"from": 6}}, "levels.to", "required key is missing", ""),
    ({"levels": {"from": 6, "to": 10**12}}, "levels.to", "must be at most 40", ""),
    ({"levels": {"from": 6, "to": 7, "step": 2}}, "levels.step", "unknown key", "from, to"),
    ({"levels": [0, 1]}, "levels", "at least 2 steps, has 1", ""),
    # schemes
    ({"schemes": ["centrall"]}, "schemes[0]", "unknown scheme", "did you mean 'central'?"),
    ({"schemes": [{"kind": "cntral"}]}, "schemes[0].kind", "unknown scheme", "'central'"),
    ({"schemes": [{"label": "x"}]}, "schemes[0].kind", "required key is missing", "central"),
    ({"schemes": [3]}, "schemes[0]", "must be a mapping with the key kind", ""),
    (
        {"schemes": [{"kind": "central", "start": "centered"}]},
        "schemes[0].start",
        "unknown",
        "centred",
    ),
    (
        {"schemes": [{"kind": "central", "strt": "centred"}]},
        "schemes[0].strt",
        "unknown key",
        "start",
    ),
    ({"schemes": [{"kind": "central", "label": 3}]}, "schemes[0].label", "must be text", ""),
    ({"schemes": ["central", "central"]}, "schemes[1]", "two schemes are named 'central'", "label"),
    # sweep
    ({"sweep": {"initial.thta": [1]}}, "sweep.initial.thta", "cannot be swept", "initial.theta"),
    ({"sweep": {"g": [1]}}, "sweep.g", "cannot be swept", "did you mean 'model.g'?"),
    ({"sweep": {"model.kind": [1]}}, "sweep.model.kind", "cannot be swept", ""),
    ({"sweep": {"levels": [1]}}, "sweep.levels", "levels cannot be swept", ""),
    ({"sweep": {"levels.from": [1]}}, "sweep.levels.from", "levels cannot be swept", ""),
    ({"sweep": {"time.base_steps": [1]}}, "sweep.time.base_steps", "step counts cannot be", ""),
    ({"sweep": {"time.base_dt": [1]}}, "sweep.time.base_dt", "step counts cannot be", ""),
    ({"sweep": {"model.g": []}}, "sweep.model.g", "must not be empty", ""),
    ({"sweep": {"model.g": 3}}, "sweep.model.g", "must be a list", ""),
    ({"sweep": {"model.g": [1, 0]}}, "sweep.model.g[1]", "must be greater than 0", ""),
    ({"sweep": {"model.g": [1, True]}}, "sweep.model.g[1]", "must be a number", ""),
    ({"sweep": {"time.end": [1, -1]}}, "sweep.time.end[1]", "must be greater than 0", ""),
    (
        {"sweep": {"time.end": [1]}, "time": {"end": 1, "base_dt": 1}},
        "sweep.time.end",
        "the end can be swept only",
        "",
    ),
    (
        {"sweep": {"time.end": [1]}, "time": {"periods": 1, "steps_per_period": 4}},
        "sweep.time.end",
        "the end can be swept only",
        "",
    ),
    ({"sweep": {"model.g": {"linspace": [-1, 1, 3]}}}, "sweep.model.g.linspace[0]", "greater", ""),
    ({"sweep": {"model.g": {"linspace": [1, 2, 1]}}}, "sweep.model.g.linspace[2]", "least 2", ""),
    ({"sweep": {"model.g": {"linspace": [1, 2]}}}, "sweep.model.g.linspace", "[first, last,", ""),
    ({"sweep": {"model.g": {"linspace": [1, 2, 3, 4]}}}, "sweep.model.g.linspace", "[first,", ""),
    ({"sweep": {"model.g": {"linspace": 3}}}, "sweep.model.g.linspace", "[first, last,", ""),
    ({"sweep": {"model.g": {"linspace": [1, 2, 2.5]}}}, "sweep.model.g.linspace[2]", "whole", ""),
    (swept(linspce=[1, 2, 3]), f"{G}.linspce", "unknown key", "did you mean 'linspace'?"),
    (swept(linspace=[1, 2, 3], foo=1), f"{G}.foo", "unknown key", "linspace, logspace, range"),
    (swept(linspace=[1, 2, 3], range=[1, 2, 1]), f"{G}.range", "has one rule", ""),
    ({"sweep": {"model.g": {}}}, G, "must be a list, or a mapping with one of linspace", ""),
    ({"sweep": {"model.g": "pi"}}, G, "must be a list, or a mapping", ""),
    ({"sweep": {"model.g": ["2*q"]}}, f"{G}[0]", "unknown name 'q'", "e, pi"),
    ({"sweep": {"model.g": [1, float("nan")]}}, f"{G}[1]", "must be a finite number", ""),
    ({"sweep": {"initial.theta": [10**400]}}, "sweep.initial.theta[0]", "finite number", ""),
    (
        {"sweep": {"initial.theta": {"linspace": [-1e308, 1e308, 3]}}},
        "sweep.initial.theta.linspace[1]",
        "the difference has no finite value",
        "",
    ),
    (swept(logspace=[1, 2]), f"{G}.logspace", "must be [first, last, count]", ""),
    (swept(logspace=[0, 2, 3]), f"{G}.logspace[0]", "greater than 0", "not exponents"),
    (swept(logspace=[1, -2, 3]), f"{G}.logspace[1]", "greater than 0", "not exponents"),
    (swept(logspace=[1, 2, 1]), f"{G}.logspace[2]", "at least 2 values", "as a list"),
    (swept(logspace=[1, float("inf"), 3]), f"{G}.logspace[1]", "finite number", ""),
    (swept(range=[1, 2]), f"{G}.range", "must be [first, end, step]", ""),
    (swept(range=[1, 2, 0]), f"{G}.range[2]", "the step must not be 0", ""),
    (swept(range=[1, 2, -0.1]), f"{G}.range[2]", "the step must lead from 1 to 2", "0.1"),
    (swept(range=[2, 1, 0.1]), f"{G}.range[2]", "the step must lead from 2 to 1", "-0.1"),
    (swept(range=[1, 2, 1e-300]), f"{G}.range[2]", "more than 9", ""),
    (swept(range=[1, 0, -0.5]), f"{G}.range[1]", "must be greater than 0", ""),
    # several keys that move together
    ({"sweep": {"zip": [1]}}, "sweep.zip", "must be a mapping", ""),
    ({"sweep": {"zip": {}}}, "sweep.zip", "must not be empty", ""),
    ({"sweep": {"zip": None}}, "sweep", "must not be empty", ""),
    ({"sweep": {"zip": {"model.g": 3}}}, "sweep.zip.model.g", "must be a list, or", ""),
    ({"sweep": {"zip": {"model.g": [0]}}}, "sweep.zip.model.g[0]", "greater than 0", ""),
    ({"sweep": {"zip": {"model.G": [1]}}}, "sweep.zip.model.G", "cannot be swept", "'model.g'"),
    ({"sweep": {"zip": {"zip": [1]}}}, "sweep.zip.zip", "cannot be swept", "choose from"),
    (
        {"sweep": {"zip": {"model.g": [1, 2], "model.L": {"linspace": [1, 2, 3]}}}},
        "sweep.zip.model.L",
        "must have as many values as model.g, 2, has 3",
        "",
    ),
    (
        {"sweep": {"model.g": [1], "zip": {"model.g": [1]}}},
        "sweep.zip.model.g",
        "is swept twice, first on its own",
        "",
    ),
    (
        {"sweep": {"zip": {"model.g": [1]}, **sample(over={"model.g": [1, 2]})["sweep"]}},
        "sweep.sample.over.model.g",
        "is swept twice, first in zip",
        "",
    ),
    # points scattered over several keys
    ({"sweep": {"sample": 3}}, "sweep.sample", "must be a mapping", ""),
    (sample(method="sobl"), "sweep.sample.method", "unknown choice", "did you mean 'sobol'?"),
    (sample(n=0), "sweep.sample.n", "must be at least 1", ""),
    (sample(n=2.5), "sweep.sample.n", "must be a whole number", ""),
    (sample(method="latin_hypercube", n=10**6 + 1), "sweep.sample.n", "at most 1000000", "sobol"),
    (sample(seed=None), "sweep.sample.seed", "required key is missing", ""),
    (sample(seed=-1), "sweep.sample.seed", "must be at least 0", ""),
    (sample(seed=1.5), "sweep.sample.seed", "must be a whole number", ""),
    (sample(seed=2**63), "sweep.sample.seed", "must be at most", ""),
    (sample(over=None), "sweep.sample.over", "required key is missing", ""),
    (sample(over={}), "sweep.sample.over", "must not be empty", ""),
    (sample(sed=1), "sweep.sample.sed", "unknown key", "did you mean 'seed'?"),
    (sample(over={"model.l": [1, 2]}), f"{OVER}.l", "cannot be swept", "model.L"),
    (sample(over={"model.g": [1]}), f"{OVER}.g", "must be [least, largest]", ""),
    (sample(over={"model.g": 3}), f"{OVER}.g", "must be [least, largest]", ""),
    (sample(over={"model.g": [1, "x"]}), f"{OVER}.g[1]", "unknown name 'x'", ""),
    (sample(over={"model.g": [2, 2]}), f"{OVER}.g[1]", "greater than the least value, 2", ""),
    (sample(over={"model.g": [0, 2]}), f"{OVER}.g[0]", "must be greater than 0", ""),
    (
        sample(over={"schemes.central.start": [0, 1]}),
        "sweep.sample.over.schemes.central.start",
        "takes words",
        "by a list",
    ),
    # options of schemes
    (
        {"sweep": {"schemes.centrl.start": ["centred"]}},
        "sweep.schemes.centrl.start",
        "cannot be swept",
        "did you mean 'schemes.central.start'?",
    ),
    (
        {"sweep": {"schemes.central.strt": ["centred"]}},
        "sweep.schemes.central.strt",
        "cannot be swept",
        "did you mean 'schemes.central.start'?",
    ),
    ({"sweep": {START: ["centered"]}}, f"sweep.{START}[0]", "unknown choice", "'centred'"),
    ({"sweep": {START: ["centred", 1]}}, f"sweep.{START}[1]", "unknown choice", "choose from"),
    ({"sweep": {START: {"linspace": [1, 2, 3]}}}, f"sweep.{START}", "must be a list of", "centred"),
    # output and tolerance
    ({"output": "bst"}, "output", "unknown choice", "did you mean 'best'?"),
    ({"output": "best", "levels": [6]}, "output", "at least 2 levels, there is 1", ""),
    ({"levels": None}, "levels", "required key is missing", "or tolerance"),
    ({"levels": [8, 7, 6]}, "levels[1]", "increasing order", "write [6, 7, 8]"),
    ({"checks": {"converges": "theta"}}, "checks", "must be a list", "begin each one with `- `"),
    ({"tolerance": 1e-10}, "tolerance", "must not be given together with levels", ""),
    (by_tolerance(0), "tolerance", "must be greater than 0", ""),
    (by_tolerance(1), "tolerance", "must be less than 1", ""),
    (by_tolerance("1e-10x"), "tolerance", "must be a number", ""),
    (
        by_tolerance(1e-10, **value(at={"level": 6})),
        "checks[0].at.level",
        "cannot be named",
        "best",
    ),
    (by_tolerance(1e-10, **at(step=0)), "checks[0].at.step", "cannot be named", "t can"),
    (by_tolerance(1e-10, **at(t=21)), "checks[0].at.t", "must be between 0 and the end 20", ""),
    (
        by_tolerance(
            1e-10, **value(value="max_abs_interior", quantity="energy_deviation", at={"best": True})
        ),
        "checks[0].at.level",
        "extrapolated",
        "",
    ),
    # samples
    ({"samples": "some"}, "samples", "unknown choice", "choose from auto, common, all"),
    ({"samples": {"every": 0}}, "samples.every", "must be at least 1", ""),
    ({"samples": {"every": 3}}, "samples.every", "must divide the 64 steps", ""),
    ({"samples": {"evry": 2, "every": 2}}, "samples.evry", "unknown key", "every"),
    # checks
    (
        check(foo=1),
        "checks[0]",
        "must be a mapping with the key converges, accurate, value, stable, conserves, equal or claim",
        "",
    ),
    ({"checks": ["theta"]}, "checks[0]", "must be a mapping with the key converges", ""),
    (check(converges="thta"), "checks[0].converges", "unknown quantity", "did you mean 'theta'?"),
    (check(converges="theta", id="A"), "checks[0].id", "a to z, 0 to 9", ""),
    (check(converges="theta", id=""), "checks[0].id", "a to z, 0 to 9", ""),
    (check(converges="theta", order="schem"), "checks[0].order", "must be scheme (", "'scheme'?"),
    (check(converges="theta", order=-2), "checks[0].order", "greater than 0", ""),
    (check(converges="theta", tolerance=0), "checks[0].tolerance", "greater than 0", ""),
    (check(converges="theta", norm="l3"), "checks[0].norm", "unknown choice", "l2"),
    (check(converges="theta", schemes=[]), "checks[0].schemes", "must not be empty", ""),
    (
        check(converges="theta", schemes=["rk4"]),
        "checks[0].schemes[0]",
        "not a scheme of",
        "central",
    ),
    (
        check(converges="theta", schemes=["central", "central"]),
        "checks[0].schemes[1]",
        "must not be repeated",
        "",
    ),
    (check(converges="theta", quantity="x"), "checks[0].quantity", "unknown key", ""),
    (
        check(converges="theta", expect={"status": "FAILED"}),
        "checks[0].expect.status",
        "unknown choice",
        "did you mean 'FAIL'?",
    ),
    (
        check(converges="theta", expect={"status": "FAIL", "reason": "order_lo"}),
        "checks[0].expect.reason",
        "unknown reason",
        "did you mean 'order_low'?",
    ),
    (
        check(converges="theta", expect={"status": "INCONCLUSIVE", "reason": "order_low"}),
        "checks[0].expect.reason",
        "reason of status FAIL",
        "round_off",
    ),
    (value(value="maxx"), "checks[0].value", "unknown value", "did you mean 'max'?"),
    (
        value(value="energy_deviation"),
        "checks[0].value",
        "unknown value",
        "for its value at the end write `value: end, quantity: energy_deviation`",
    ),
    (
        value(value="end", quantity="wire_force", at={"level": "best"}),
        "checks[0].quantity",
        "end at `level: best` is not defined for this quantity",
        "or take one level: `at: {level: 9}`",
    ),
    (value(quantity="thta"), "checks[0].quantity", "unknown quantity", "did you mean 'theta'?"),
    (value(quantity="energy"), "checks[0].quantity", "is not defined for this quantity", "theta"),
    (value(quantity="energy_deviation"), "checks[0].quantity", "not defined", "from theta, omega"),
    (
        value(value="max_abs", quantity="energy"),
        "checks[0].quantity",
        "max_abs is not defined for this quantity",
        "choose from theta, omega, energy_deviation",
    ),
    (
        value(value="max_abs_interior"),
        "checks[0].quantity",
        "max_abs_interior is not defined for this quantity",
        "choose from energy_deviation",
    ),
    (
        value(value="max_abs_interior_ratio"),
        "checks[0].quantity",
        "max_abs_interior_ratio is not defined for this quantity",
        "choose from energy_deviation",
    ),
    (value(quantity=None), "checks[0].quantity", "required key is missing", "theta"),
    (value(value="period"), "checks[0].quantity", "takes no quantity", ""),
    (value(above=0), "checks[0]", "exactly one of equals, below, above", ""),
    (check(value="period"), "checks[0]", "exactly one of equals, below, above", ""),
    (value(rtol=0.1), "checks[0].rtol", "used with equals only", ""),
    (value(atol=0.1), "checks[0].atol", "used with equals only", ""),
    (check(value="period", equals=6, rtol=-1), "checks[0].rtol", "must be at least 0", ""),
    (value(below=float("nan")), "checks[0].below", "finite", ""),
    (value(at={"level": 10}), "checks[0].at.level", "not a level of this", "nearest is 9"),
    (value(at={"level": "bset"}), "checks[0].at.level", "from 0 to 40, or best", "'best'"),
    (value(at={"level": 41}), "checks[0].at.level", "from 0 to 40", ""),
    (
        value(value="max_abs_interior", quantity="energy_deviation", at={"level": "best"}),
        "checks[0].at.level",
        "extrapolated",
        "",
    ),
    (value(at={"best": False}), "checks[0].at", "best must be true", ""),
    (value(at={"best": True, "level": 6}), "checks[0].at", "not both", ""),
    (value(at={"case": 1}), "checks[0].at.case", "must be at most 0", ""),
    (value(at={"case": -1}), "checks[0].at.case", "must be at least 0", ""),
    (value(at={"scheme": "rk4"}), "checks[0].at.scheme", "not a scheme of", "central"),
    (value(at={"t": 1}), "checks[0].at.t", "max takes no t", "level, scheme, case"),
    (value(at={"shceme": "x"}), "checks[0].at.shceme", "unknown key", "scheme"),
    (value(at=3), "checks[0].at", "must be a mapping", ""),
    (at(t=0.1), "checks[0].at.t", "not a stored sample time", "nearest are 0.078125 and 0.1171875"),
    (at(t=21), "checks[0].at.t", "must be between 0 and the end 20", ""),
    (at(t=-1), "checks[0].at.t", "must be between 0", ""),
    (at(step=513), "checks[0].at.step", "must be at most 512", ""),
    (at(step=1, t=0), "checks[0].at.step", "together with t", ""),
    (value(value="at"), "checks[0].at", "at needs t or step", ""),
    (
        value(value="error_estimate_defect", at={"level": 9}),
        "checks[0].at.level",
        "needs 1 finer level beside",
        "",
    ),
    (
        value(value="ratio", at={"level": 8}),
        "checks[0].at.level",
        "needs 2 finer levels beside",
        "",
    ),
    (value(value="richardson_error", at={"level": 6}), "checks[0].at.level", "takes no level", ""),
    (check(claim="x"), "checks[0].that", "required key is missing", ""),
    (check(claim="x", that={"claim": "y"}), "checks[0].that", "stable, conserves or equal", ""),
    (check(claim="x", that={"converges": "x"}), "checks[0].that.converges", "unknown quantity", ""),
    (
        check(claim="x", holds="yes", that={"converges": "theta"}),
        "checks[0].holds",
        "must be true or false",
        "",
    ),
    (
        check(claim="x", that={"converges": "theta", "id": "y"}),
        "checks[0].that.id",
        "belongs to the claim",
        "",
    ),
]


@pytest.mark.parametrize(("changes", "key", "rule", "hint"), CASES)
def test_one_fault(changes: dict[str, Any], key: str, rule: str, hint: str) -> None:
    fault = only_fault(**changes)
    assert fault.key == key
    assert rule in fault.rule
    assert hint in fault.hint


@pytest.mark.parametrize("name", ["min", "max", "max_abs", "max_abs_interior"])
@pytest.mark.parametrize("quantity", quantities(MODELS["pendulum"]))
def test_an_extremum_that_is_accepted_is_measured(name: str, quantity: str) -> None:
    """Samples are few here, so that nothing but what was gathered over every step can give it."""
    changes = value(value=name, quantity=quantity)
    try:
        experiment = build(**changes, samples="common")
    except InputError:
        return
    records = {level: simulate_record(experiment, level) for level in experiment.levels}
    found = analyse_records(experiment, records)
    assert all(
        np.isfinite(found[f"check_{check.id}_value"]).all()
        for check in experiment.checks
        if check.kind == "value"
    )


def change_model(monkeypatch: pytest.MonkeyPatch, kind: str = "pendulum", **changes: Any) -> None:
    models = {**MODELS, kind: replace(MODELS[kind], variant=None, **changes)}
    monkeypatch.setattr(kinds, "MODELS", models)


@pytest.mark.parametrize("name", [name for name, row in VALUES.items() if row.needs_exact])
@pytest.mark.parametrize("lost", ["exact", "exact_period"])
def test_nothing_is_compared_with_an_exact_value_that_is_not_known(
    monkeypatch: pytest.MonkeyPatch, name: str, lost: str
) -> None:
    of = {} if VALUES[name].of == "none" else {"quantity": "theta"}
    kind = "linear_pendulum" if VALUES[name].needs_linear else "pendulum"
    changes = check(value=name, below=1, **of) | {"model": {"kind": kind}}
    build(**changes)
    # a motion without events would be computed where it is not known exactly
    monkeypatch.setattr(value_rules, "has_solution", lambda model: model.exact is not None)
    change_model(monkeypatch, kind, **{lost: None})
    if (VALUES[name].needs_exact == "period") != (lost == "exact_period"):
        build(**changes)
        return
    fault = only_fault(**changes)
    assert fault.key == "checks[0].value"
    assert f"of {kind} is not known" in fault.rule


@pytest.mark.parametrize(
    ("model", "why"),
    [
        ({"kind": "oscillator", "stop": "u < -3"}, "not known, as for every motion with events of"),
        (
            {"kind": "structure", "stiffness": [2], "load": {"1": "exp(-t)"}},
            "not known: it is where damping does not couple the modes, and loads are sums of",
        ),
    ],
)
def test_why_an_exact_value_is_not_known_is_said(model: dict[str, Any], why: str) -> None:
    position = "u1" if model["kind"] == "structure" else "u"
    checks = [{"value": "error_linf", "quantity": position, "below": 1}]
    schemes = ["newmark"]
    fault = only_fault(model=model, initial={position: 1.0}, checks=checks, schemes=schemes)
    assert why in fault.rule


def test_the_energy_is_known_exactly_where_it_is_conserved(monkeypatch: pytest.MonkeyPatch) -> None:
    changes = value(value="error_l2", quantity="energy")
    monkeypatch.setattr(value_rules, "has_solution", lambda model: model.exact is not None)
    change_model(monkeypatch, exact=None)
    build(**changes)
    change_model(monkeypatch, conservative=False, exact=None)
    assert only_fault(**changes).rule == "the exact energy of pendulum is not known"


def test_a_scheme_that_cannot_treat_the_model_is_refused(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    central = SCHEMES["central"]
    schemes = {"central": replace(central, velocity_forces=False, damped=())}
    monkeypatch.setattr(kinds, "SCHEMES", schemes)
    build()
    change_model(monkeypatch, acceleration="-(g/L)*sin(theta) - m*omega")
    (fault,) = file_faults(tmp_path, GOOD)
    assert (fault.line, fault.key, fault.value) == (6, "schemes[0]", "central")
    assert fault.rule == "cannot treat pendulum, whose acceleration depends on omega"
    assert fault.hint == "no scheme can"
    schemes["other"] = replace(central, kind="other", velocity_forces=True)
    schemes["third"] = replace(central, kind="third", velocity_forces=True)
    labelled = only_fault(schemes=[{"kind": "central", "label": "mine"}])
    assert labelled.hint == "choose from other, third"
    schemes["central"] = replace(central, velocity_forces=True)
    build()


def test_two_checks_with_one_id() -> None:
    two = [{"id": "a", "converges": "theta"}, {"id": "a", "converges": "omega"}]
    assert only_fault(checks=two).key == "checks[1].id"


def test_stored_times_follow_the_samples() -> None:
    """Level 6 of 20 s: 64 steps of 0.3125 s; at level 9 only every 8th is stored with `common`."""
    ends = [20.0, 0.3125, 40 * 0.3125, 0.0]
    for t in ends:
        build(samples="common", **at(t=t))
    fault = only_fault(samples="common", **at(t=0.0390625))
    assert "nearest are 0 and 0.3125" in fault.hint
    build(samples="all", **at(t=0.0390625))
    build(samples="common", **at(step=16))
    assert "nearest are 0 and 8" in only_fault(samples="common", **at(step=7)).hint
    # 512 steps at level 9, every 16th of them stored; the extrapolated solution has every 16th of the 64 of level 6
    every = {"every": 16}
    build(samples=every, **at(step=16))
    build(samples=every, **at(t=0.625))
    assert "nearest are 0 and 16" in only_fault(samples=every, **at(step=8)).hint
    assert "nearest are 0 and 0.625" in only_fault(samples=every, **at(t=0.3125)).hint
    assert "nearest are 0 and 5" in only_fault(samples=every, **at(t=0.625, best=True)).hint


def test_time_is_a_fraction_where_the_end_varies() -> None:
    sweep = {"time.end": [10, 20]}
    build(sweep=sweep, **at(t=0.5))
    build(sweep=sweep, **at(t=1))
    assert "fraction" in only_fault(sweep=sweep, **at(t=20)).rule
    build(sweep={"time.end": [10, 10]}, **at(t=10))
    assert "the end 10" in only_fault(sweep={"time.end": [10]}, **at(t=20)).rule
    time = {"periods": 2, "steps_per_period": 4}
    assert "fraction" in only_fault(sweep={"model.g": [1, 2]}, time=time, **at(t=2)).rule


def test_case_in_range_of_the_sweep() -> None:
    sweep = {"model.g": [1, 2, 3], "initial.theta": {"linspace": [0, 1, 4]}}
    build(sweep=sweep, **value(at={"case": 11}))
    assert "at most 11" in only_fault(sweep=sweep, **value(at={"case": 12})).rule


FAULTY = """\
title: A pendulum
titel: again
model:
  kind: pendulum
  g: -1.0
initial:
  theta: .nan
  omga: 0
time: {end: 20.0, base_steps: 0}
levels: [6, 7,
  55]
schemes:
  - centrall
  - kind: central
    start: late
  - central
sweep:
  model.L: [1, 2,
    0]
  levels: [6]
checks:
  - converges: thta
  - value: maximum
    below: 1
  - claim: x
    that:
      value: max
      quantity: theta
      rtol: 1
      above: 2
"""


def test_all_faults_of_a_file_at_once_with_their_lines(tmp_path: Path) -> None:
    found = [(f.line, f.key, f.value) for f in file_faults(tmp_path, FAULTY)]
    assert found == [
        (2, "titel", "again"),
        (5, "model.g", "-1.0"),
        (7, "initial.theta", ".nan"),
        (8, "initial.omga", "0"),
        (9, "time.base_steps", "0"),
        (11, "levels[2]", "55"),
        (13, "schemes[0]", "centrall"),
        (15, "schemes[1].start", "late"),
        (19, "sweep.model.L[2]", "0"),
        (20, "sweep.levels", ""),
        (22, "checks[0].converges", "thta"),
        (23, "checks[1].value", "maximum"),
        (29, "checks[2].that.rtol", "1"),
    ]


def test_missing_keys_are_reported_at_their_section(tmp_path: Path) -> None:
    text = "title: x\nmodel:\n  g: 1\nlevels:\n  from: 6\ntime: {}\nchecks:\n  - claim: x\n"
    found = {(f.line, f.key) for f in file_faults(tmp_path, text)}
    assert found == {
        (1, "schemes"),
        (2, "model.kind"),
        (4, "levels.to"),
        (6, "time.end"),
        (8, "checks[0].that"),
    }


def test_message_reads_as_the_issue_asks(tmp_path: Path) -> None:
    (fault,) = file_faults(tmp_path, GOOD.replace("kind: pendulum", "kind: pendulun"))
    expected = "case.yaml:2: model.kind: pendulun: unknown model: did you mean 'pendulum'?"
    assert str(fault) == f"{tmp_path}/{expected}"


def test_no_jargon_in_any_message() -> None:
    """The words of the validation library, of its types and of unions stay out of messages."""
    words = ("Input", "input", "pydantic", "\0", "Field", "tag", "float", "int ", "str", "dict")
    for changes, *_ in CASES:
        for fault in faults_of(**changes):
            text = f"{fault.rule} {fault.hint}".replace("stride", "").replace("structure", "")
            assert not [word for word in words if word in text], fault


def test_a_broken_list_does_not_hide_other_checks() -> None:
    faults = faults_of(
        schemes=["centrall"],
        checks=[{"foo": 1}, {"converges": "thta", "schemes": ["central"]}, {"id": "x"}],
    )
    assert [f.key for f in faults] == [
        "checks[0]",
        "checks[1].converges",
        "checks[2]",
        "schemes[0]",
    ]


CHECKED = {"value": "end", "quantity": "theta", "equals": 1}


@pytest.mark.parametrize(
    ("check", "keys"),
    [
        (
            {**CHECKED, "quantity": "thet", "at": {"level": 77, "scheme": "foo", "case": 4}},
            ["at.case", "at.level", "at.scheme", "quantity"],
        ),
        ({**CHECKED, "equals": [1], "rtol": 0.1, "quantity": "x"}, ["equals", "quantity"]),
        ({**CHECKED, "value": 3, "at": {"scheme": "foo"}}, ["at.scheme", "value"]),
        ({**CHECKED, "at": {"best": 1, "scheme": "foo"}}, ["at", "at.scheme"]),
        ({**CHECKED, "value": "at", "at": {"t": "x", "case": 9}}, ["at.case", "at.t"]),
        (
            {"converges": 3, "schemes": [1, "foo"], "expect": {"status": "X", "reason": "match"}},
            ["converges", "expect.status", "schemes[0]", "schemes[1]"],
        ),
        ({"claim": 1, "that": {**CHECKED, "quantity": "x"}}, ["claim", "that.quantity"]),
    ],
)
def test_a_malformed_value_hides_no_fault_of_its_check(
    check: dict[str, Any], keys: list[str]
) -> None:
    found = faults_of(checks=[check])
    assert sorted(fault.key for fault in found) == [f"checks[0].{key}" for key in keys]


def test_a_malformed_value_hides_no_fault_of_its_sweep() -> None:
    found = faults_of(
        sweep={
            "zip": {"model.g": 3, "model.k": [1], "initial.theta": ["x"]},
            "model.L": {"rnge": [1, 2, 3]},
            "sample": {
                "method": "sobl",
                "n": 0,
                "over": {"time.end": [1], "model.m": [0, 1], "omega": [1, 2], "model.g": [1, 2]},
            },
            "schemes.central.start": ["late"],
        },
        checks=[{**CHECKED, "at": {"t": 77.7, "case": 5}}],
    )
    assert sorted(fault.key for fault in found) == [
        "sweep.model.L.rnge",
        "sweep.sample.method",
        "sweep.sample.n",
        "sweep.sample.over.model.m[0]",
        "sweep.sample.over.omega",
        "sweep.sample.over.time.end",
        "sweep.sample.seed",
        "sweep.schemes.central.start[0]",
        "sweep.zip.initial.theta[0]",
        "sweep.zip.model.g",
        "sweep.zip.model.k",
    ]


def test_of_a_malformed_sweep_no_case_is_out_of_range() -> None:
    check = {**CHECKED, "at": {"t": 77.7, "case": 5}}
    sweep = {"model.g": [1, 2], "time.end": [1, [2]]}
    assert only_fault(sweep=sweep, checks=[check]).key == "sweep.time.end[1]"
    del sweep["time.end"]
    assert len(faults_of(sweep=sweep, checks=[check])) == 2


def test_the_step_of_no_member_may_vanish() -> None:
    build(sweep={"time.end": [1, 1e-97]})
    assert "time step" in only_fault(sweep={"time.end": [1, 1e-98]}).rule


def test_an_option_of_a_faulty_scheme_is_not_called_unknown() -> None:
    found = faults_of(schemes=["centrl"], sweep={START: ["centred"], "schemes.foo": [1]})
    assert [fault.key for fault in found] == ["schemes[0]"]
    assert only_fault(model={"kind": "x"}, sweep={"model.foo": [1]}).key == "model.kind"


def test_a_malformed_value_hides_no_fault_of_its_section() -> None:
    found = faults_of(
        sweep={"initial.theta": 3, "model.k": [1], "time.end": "x"},
        initial={"theta": "x", "omga": 1},
        checks=[{**CHECKED, "at": {"t": 77.7, "case": 5}}],
    )
    assert sorted(fault.key for fault in found) == [
        "initial.omga",
        "initial.theta",
        "sweep.initial.theta",
        "sweep.model.k",
        "sweep.time.end",
    ]


@pytest.mark.parametrize(
    ("changes", "key"),
    [
        ({"title": "a\x07b"}, "title"),
        ({"source": "a\x1bb"}, "source"),
        ({"schemes": [{"kind": "central", "label": "a\x00"}]}, "schemes[0].label"),
        ({"schemes": [{"kind": "central", "label": "a\nb"}]}, "schemes[0].label"),
        ({"checks": [{"claim": "a\x85b", "that": CHECKED}]}, "checks[0].claim"),
        ({"checks": [{**CHECKED, "id": "a\x01"}]}, "checks[0].id"),
        ({"checks": [{**CHECKED, "id": "a\n"}]}, "checks[0].id"),
    ],
)
def test_control_characters_are_refused(changes: dict[str, Any], key: str) -> None:
    fault = only_fault(**changes)
    assert fault.key == key
    assert str(fault).isprintable()


@pytest.mark.parametrize(
    "name", ["run_" + "0" * 25, "x" * 26, "ab" * 20, "a_" + "abc" * 20, "abcdefghijk" * 10]
)
def test_names_that_the_workflow_cannot_take_are_refused(name: str) -> None:
    with pytest.raises(InputError, match="the name of the experiment"):
        Experiment.from_dict(content(), name=name)
    assert Experiment.from_dict(content(), name="x" * 19).name == "x" * 19


@pytest.mark.parametrize(
    ("name", "rule", "hint"),
    [
        ("w", "must be a parameter of the model", "did you mean 'model.omega'?"),
        ("beta", "(rad s-1), but beta is in m-2 s-2", "choose from model.omega"),
    ],
)
def test_the_frequency_of_a_force_is_a_parameter_in_radians_per_second(
    name: str, rule: str, hint: str
) -> None:
    time = {"periods": 20, "steps_per_period": 16, "frequency": f"model.{name}"}
    with pytest.raises(InputError) as error:
        build(model={"kind": "duffing"}, initial={}, time=time, schemes=["rk4"], checks=[])
    (fault,) = error.value.faults
    assert rule in fault.rule
    assert hint in fault.hint


@pytest.mark.parametrize(
    ("bound", "key"),
    [
        ({"below": 3.2}, "below"),
        ({"below": "pi"}, "below"),
        ({"below": -4}, "below"),
        ({"above": -3.2}, "above"),
        ({"above": "-pi"}, "above"),
        ({"above": 4}, "above"),
        ({"equals": 3.0, "atol": 3.2}, "atol"),
        ({"equals": 3.0, "rtol": 1.1}, "rtol"),
    ],
)
def test_a_bound_that_every_phase_meets_or_none_is_refused(bound: dict[str, Any], key: str) -> None:
    driven = {
        "model": {"kind": "duffing"},
        "initial": {"u": 1},
        "time": {"periods": 4, "steps_per_period": 16, "frequency": "model.omega"},
        "levels": [0, 1, 2],
        "sweep": {"model.omega": [1.0, 1.1]},
    }
    for more in ({}, {"over": "model.omega", "take": "largest"}):
        [fault] = faults_of(
            **driven, checks=[{"value": "steady_phase", "quantity": "u", **bound, **more}]
        )
        assert fault.key == f"checks[0].{key}"
        assert "phase" in fault.rule
    # these are bounds of a swept value, and one that phases may miss
    where = {"over": "model.omega", "take": "where", "below": 4}
    for claim in (where, {"below": 3.1}, {"above": -3.1}, {"equals": 4.0, "atol": 1.0}):
        build(**driven, checks=[{"value": "steady_phase", "quantity": "u", **claim}])
