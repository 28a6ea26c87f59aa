"""From (model, scheme) to one function that steps members: first as source text, then in a lane.

A kernel is generated as one self-contained Python module: elementary functions, statistics of every step, the scheme's
functions, the model's formulas and a loop. The *plain* lane runs the loop over single members in Python; the *scalar*
lane compiles the same text; the *blocks* lane compiles the loop over blocks of members. `vibsim.native` compiles
strictly (no contraction, no reassociation), so all lanes give the same bits. The text is also the key of the cache: a
changed formula, scheme or loop makes another kernel.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cache
from types import FunctionType
from typing import Any

from vibsim.core.errors import SimulationError
from vibsim.elementary import primitives
from vibsim.engine import (
    block_loop,
    coordinates,
    crossings,
    events,
    gather,
    member_loop,
    rows,
)
from vibsim.engine.formulas import (
    KINDS,
    marked,
    n_between,
    n_parameters,
    put_energy_with,
    put_formulas,
    put_functions,
    put_parameters,
)
from vibsim.engine.stages import stages
from vibsim.engine.text import Module, collect, plain_code
from vibsim.models import Model, has_budget
from vibsim.models.base import Formula
from vibsim.native.kernel_cache import Kernel, load
from vibsim.schemes.base import HANDED, Stepper, handed
from vibsim.schemes.step_numbers import divided, vector

LANES = ("plain", "scalar", "blocks")

_PLAIN = """\
def compiled(function):
    return function

called = entry = compiled
"""

_ENTRY = """\
@entry
def kernel(
    parameters, table, initial, dt, first, stop, steps, every, variant, end_rule, turn,
    samples, stats, counts, kept, rows
):
    members, settings = (parameters, table, initial, dt), (steps, every, variant, end_rule, turn)
    run(members, (first, stop), settings, (samples, stats, counts, kept), rows)"""
"""Entry point of a kernel; it calls `run` of `vibsim.engine.member_loop` or `vibsim.engine.block_loop`."""
_STEPPING = "f2 f2 f2 f1 i i i i i i f f3 f2 i2 f3 f1"
"""Argument types of the entry point, as in `vibsim.native.linking.link`."""
_OBSERVING = "f2 f2 f1 i i f3 f3"
"""Argument types of `vibsim.engine.member_loop.observe`."""


@cache
def kernel(
    model: Model,
    stepper: Stepper,
    lane: str,
    with_gathered: bool = True,
    with_series: bool = False,
    with_peaks: bool = False,
) -> Kernel:
    """Return the function that steps members of `model` by `stepper` (`vibsim.engine.member_loop.run`).

    Parameters
    ----------
    lane
        One of `LANES`: the same bits at different speeds.
    with_gathered
        Whether energies (also with ``[D_2t u]`` as velocity), extrema, norms, peaks and turns are gathered.
    with_series, with_peaks
        Whether, if anything is gathered, samples have further rows (`vibsim.engine.gather`), and whether local extrema
        are kept (`vibsim.engine.extrema`).

    Raises
    ------
    SimulationError
        If the kernel cannot be compiled, or the model cannot be stepped in blocks.
    """
    if lane == "blocks":
        for reason, holds in (
            ("looks a table up, at places of each member's own", model.lookup is not None),
            ("has events, at times of each member's own", model.events is not None),
            ("has several coordinates", model.coordinates > 1),
        ):
            if holds:
                raise SimulationError(f"{model.kind} {reason}: it is not stepped in blocks")
    module = _written(model, stepper, lane, with_gathered, with_series, with_peaks)
    return _in_lane(module, lane, _STEPPING)


@cache
def observer(model: Model, formulas: tuple[Formula, ...], lane: str) -> Kernel:
    """Return the function that evaluates formulas at samples (`vibsim.engine.member_loop.observe`)."""
    count = model.coordinates
    module = _module(lane, {})
    coordinates.put_moves(module, count)
    put = marked(model)
    results = {f"_value_{i}": put(formula) for i, formula in enumerate(formulas)}
    put_functions(module, model, "", {"observed": results}, always_tuple=True)
    put_parameters(module, model)
    collect(module, member_loop.observe, "kernel", {})
    return _in_lane(module, lane, _OBSERVING)


def source(
    model: Model,
    stepper: Stepper,
    lane: str = "scalar",
    with_gathered: bool = True,
    with_series: bool = False,
    with_peaks: bool = False,
) -> str:
    """Return the text of the kernel of `model` and `stepper`, without the head that binds the compiler."""
    return _written(model, stepper, lane, with_gathered, with_series, with_peaks).text


def _written(
    model: Model,
    stepper: Stepper,
    lane: str,
    with_gathered: bool,
    with_series: bool,
    with_peaks: bool,
) -> Module:
    count = model.coordinates
    states = carried(stepper, model) if count == 1 else 0
    settings = _settings(model, stepper, states, with_gathered, with_series, with_peaks)
    module = _module(lane, settings)
    again = lane != "blocks" and bool(settings["D2T"])
    with_work = bool(settings["WORK"])
    # with events a step occurs at several places, and inlining it would take long to compile
    rare = lane == "blocks" or model.events is not None
    put_formulas(module, model, "", stepper, is_rare=rare, with_kinetic=again, with_work=with_work)
    if again:
        put_energy_with(module, model)
    if lane != "blocks":
        coordinates.put_moves(module, count)
        coordinates.put_further(module, count)
    if count > 1:
        coordinates.put_vectors(module, stepper, count)
    if stepper.scaling is None:
        collect(module, stepper.start, "start", {})
    else:
        collect(module, stepper.start, "start_unscaled", {})
        line = "return start_unscaled(variant, u, v * p[-1], dt, p)"
        module.define("start(variant, u, v, dt, p)", line)
    if model.events is not None:
        _put_events(module, model, stepper)
    collect(module, stepper.step, "step", {})
    if "backward" not in module.parts:
        collect(module, stepper.backward, "backward", {})
    if lane == "blocks":
        _put_step_of_blocks(module, model, stepper, settings)
        rows.put_rows(module, states, n_parameters(stepper, model), settings)
    collect(module, block_loop.run if lane == "blocks" else member_loop.run, "run", {})
    module.put("kernel", _ENTRY)
    return module


def _settings(
    model: Model,
    stepper: Stepper,
    states: int,
    with_gathered: bool,
    with_series: bool,
    with_peaks: bool,
) -> dict[str, object]:
    """Return the constants of a kernel by name: its settings, and the positions of its rows and columns."""
    count, parameters = model.coordinates, n_parameters(stepper, model)
    with_peaks = with_peaks and with_gathered
    settings: dict[str, object] = {
        "GATHER": with_gathered,
        "D2T": with_gathered and stepper.own_velocity,
        "SERIES": with_gathered and with_series,
        "KEEP": with_peaks,
        "STAGGERED": with_gathered and stepper.staggered,
        "WORK": with_gathered and with_series and has_budget(model),
        "STAGED": bool(stages(stepper.step)),
        "EVENTS": model.events is not None,
        "LOCATED": stepper.events != "mesh",
        "ACT": model.events_act,
        "PARAMETERS": parameters,
        **block_loop.row_places(states, parameters, with_peaks),
        **gather.sample_rows(count),
        **events.columns(count),
    }
    if count > 1:
        settings["ZERO"] = vector(*[0.0] * count)
    return settings


def _put_step_of_blocks(
    module: Module, model: Model, stepper: Stepper, settings: Mapping[str, object]
) -> None:
    """Write the step of a block of members, with fast elementary functions."""
    put_formulas(module, model, "_fast", stepper, with_work=bool(settings["WORK"]))
    functions = (n for n, v in stepper.step.__globals__.items() if isinstance(v, FunctionType))
    renamed = {name: f"{name}_fast" for name in (*HANDED, *functions)}
    if stepper.implicit:
        # the convergence test would hide the NaN of a fast function outside its range
        module.define("step_fast(state, t, dt, p)", "return step(state, t, dt, p)")
    elif settings["STAGED"]:
        rows.put_stages(module, stepper, renamed, settings)
    else:
        collect(module, stepper.step, "step_fast", renamed)


def carried(stepper: Stepper, model: Model) -> int:
    """Return the number of floats in the state of a scheme, by computing one."""
    p: tuple[Any, ...] = (1.0,) * (n_parameters(stepper, model) + n_between(model))
    p += ((0.0,) * 4,) if stepper.tabulated else ()
    start = handed(stepper.start, lambda u, v, t, p: 0.0, lambda u, v, t, p: (0.0, 0.0))
    return len(start(stepper.variant, 0.0, 0.0, 1.0, p))


def _put_events(module: Module, model: Model, stepper: Stepper) -> None:
    """Write the functions of the mode and the events of the model."""
    first = len(model.parameters)
    places = [f"p[{i}]" for i in range(n_parameters(stepper, model) + n_between(model))]
    places[first : first + 2] = ["mode", "start"]
    module.define("mode_of(p)", f"return p[{first}]")
    module.define("start_of(p)", f"return p[{first + 1}]")
    module.define("with_mode(p, mode, start)", f"return ({', '.join(places)},)")
    kind = KINDS[type(model.events)]
    if kind is crossings:
        kind.put_rows(module, model, model.events, is_located=stepper.events != "mesh")
    for name in (
        *("first_mode", "guard", "guard_on_mesh", "landed", "settled", "followed", "held"),
        *("counts_as_event", "turning", "spent", "lost"),
    ):
        collect(module, getattr(kind, name), name, {})
    if kind is not crossings:
        collect(module, kind.is_at_rest, "is_at_rest", {})


def _module(lane: str, settings: Mapping[str, object]) -> Module:
    return Module("kernel", settings, () if lane == "plain" else primitives.NAMES)


def _in_lane(module: Module, lane: str, kinds: str) -> Kernel:
    if lane == "plain":
        namespace: dict[str, Any] = {"divided": divided, "math": math, "vector": vector}
        for part in (_PLAIN, *module.parts.values()):
            exec(plain_code(part), namespace)
        plain: Kernel = namespace[module.entry]
        return plain
    return load(module.text, kinds)
