"""From (model, scheme) to one function that steps members: text first, then a lane.

A kernel is written out as one Python module that holds everything it runs: the elementary functions, the gathering,
the scheme's functions, the model's formulas and a loop. The *plain* lane runs the loop over one member as it stands,
which needs no compiler; the *scalar* lane compiles the same text; the *blocks* lane compiles the loop over blocks of
members. numba compiles strictly (no contraction, no reassociation), so that all give the same bits. The text is also
the key of the cache: a changed formula, scheme or loop is another kernel.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from functools import cache
from inspect import signature
from types import FunctionType
from typing import Any

from vibsim import expression
from vibsim.elementary import ELEMENTARY, primitives
from vibsim.engine import blocks, friction, impact, loop, observe, rows
from vibsim.engine.cache import Kernel, load
from vibsim.engine.stages import stages
from vibsim.engine.text import Module, collect, divided, with_quotients
from vibsim.errors import SimulationError
from vibsim.expression import Binary, Call, Compare, Expression, Name, Number
from vibsim.models import Model, has_budget
from vibsim.models.base import Formula, parameter_names, tree
from vibsim.models.events import Friction, Impact
from vibsim.schemes.base import HANDED, Stepper, handed

LANES = ("plain", "scalar", "blocks")

_PLAIN = """\
def compiled(function):
    return function

called = entry = compiled
"""

_COMPILED = (
    """\
from numba import carray, cfunc, njit

inner = {"error_model": "numpy", "nogil": True, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
compiled = njit(forceinline=True, **inner)
called = entry = njit(**inner)

"""
    + primitives.COMPILED
)

_MODE = "mode"
_MARK = "_"
"""Behind the names of parameters in a kernel."""
_FULL_STEP = """\
@compiled
def step_fast(state, t, dt, p):
    return step(state, t, dt, p)"""

_STEPPING = "f2 f2 f1 i i i i i i f f3 f2 i2 f3 f1"
"""Arguments of `vibsim.engine.loop.run`, as `vibsim.engine.entry` writes them."""
_OBSERVING = "f2 f1 i i f3 f3"
"""Arguments of `vibsim.engine.observe.run`."""


@cache
def kernel(
    model: Model,
    stepper: Stepper,
    lane: str,
    with_gathered: bool = True,
    with_series: bool = False,
    with_peaks: bool = False,
) -> Kernel:
    """Return the function that steps members of `model` by `stepper` (`vibsim.engine.loop.run`).

    Parameters
    ----------
    lane
        One of `LANES`: the same bits at different speeds.
    with_gathered
        Whether energies, extrema, norms, peaks and turns are gathered, and beside the energy by the scheme's own
        velocity that by ``[D_2t u]``.
    with_series, with_peaks
        Whether samples have more rows than position and velocity (`vibsim.engine.gather`), and whether local extrema
        are kept (`vibsim.engine.extrema`), where anything is gathered.

    Raises
    ------
    SimulationError
        Where the kernel cannot be compiled, or a model with events is to be stepped in blocks.
    """
    if lane == "blocks" and model.events is not None:
        raise SimulationError(
            f"{model.kind} has events, at times of each member's own: no block of members has them"
        )
    text = source(model, stepper, lane, with_gathered, with_series, with_peaks)
    return _in_lane(text, lane, _STEPPING)


@cache
def observer(model: Model, formulas: tuple[Formula, ...], lane: str) -> Kernel:
    """Return the function that works out formulas of samples (`vibsim.engine.observe.run`)."""
    module = _module(lane, {})
    marked = _marked(model)
    results = {f"_{i}": marked(formula) for i, formula in enumerate(formulas)}
    _put_functions(module, model, "", {"observed": results}, always_tuple=True)
    _put_parameters(module, model)
    collect(module, observe.run, "kernel", {})
    return _in_lane(module.text, lane, _OBSERVING)


def source(
    model: Model,
    stepper: Stepper,
    lane: str = "scalar",
    with_gathered: bool = True,
    with_series: bool = False,
    with_peaks: bool = False,
) -> str:
    """Return the text of the kernel of `model` and `stepper`, without the head that says what compiles it."""
    states, parameters = carried(stepper, model), n_parameters(stepper, model)
    with_peaks = with_peaks and with_gathered
    settings = {
        "GATHER": with_gathered,
        "D2T": with_gathered and stepper.own_velocity,
        "SERIES": with_gathered and with_series,
        "KEEP": with_peaks,
        "STAGGERED": with_gathered and stepper.staggered,
        "WORK": with_gathered and with_series and has_budget(model),
        "STAGED": bool(stages(stepper.step)),
        "EVENTS": model.events is not None,
        "LOCATED": stepper.events != "mesh",
        "STATES": states,
        "SET": blocks.set_of(states, with_peaks),
        "PARAMETERS": parameters,
        **blocks.row_numbers(states, parameters, with_peaks),
    }
    module = _module(lane, settings)
    again = lane != "blocks" and bool(settings["D2T"])
    with_work = bool(settings["WORK"])
    # with events a step stands at several places, and would take long to compile
    rare = lane == "blocks" or model.events is not None
    _put_formulas(module, model, "", stepper, is_rare=rare, with_kinetic=again, with_work=with_work)
    if again:
        _put_energy_with(module, model)
    _put_start(module, stepper)
    if model.events is not None:
        _put_events(module, model, stepper)
    for name in ("step", "backward"):
        collect(module, getattr(stepper, name), name, {})
    if lane == "blocks":
        _put_formulas(module, model, "_fast", stepper, with_work=with_work)
        functions = (n for n, v in stepper.step.__globals__.items() if isinstance(v, FunctionType))
        renamed = {name: f"{name}_fast" for name in (*HANDED, *functions)}
        if stepper.implicit:
            # where an iteration ends is a comparison, which would hide the NaN of a fast function out of its range
            module.put("step_fast", _FULL_STEP)
        elif settings["STAGED"]:
            rows.put_stages(module, stepper, renamed, settings)
        else:
            collect(module, stepper.step, "step_fast", renamed)
        for name, text in rows.texts(states, parameters, settings).items():
            module.put(name, text)
    collect(module, blocks.run if lane == "blocks" else loop.run, "kernel", {})
    return module.text


def carried(stepper: Stepper, model: Model) -> int:
    """Return how many floats the state of a scheme has, by asking for one."""
    p: tuple[Any, ...] = (1.0,) * (n_parameters(stepper, model) + n_event_numbers(model))
    p += ((0.0,) * 4,) if stepper.tabulated else ()
    start = handed(stepper.start, lambda u, v, t, p: 0.0, lambda u, v, t, p: (0.0, 0.0))
    return len(start(stepper.variant, 0.0, 0.0, 1.0, p))


def n_parameters(stepper: Stepper, model: Model) -> int:
    """Return how many parameters a member has: those of the model, and the factors of `Stepper.scaling` behind them."""
    return len(model.parameters) + (2 if stepper.scaling else 0)


def n_event_numbers(model: Model) -> int:
    """Return how many numbers stand between the parameters of a member and the factors behind them: mode and start."""
    return 2 if model.events is not None else 0


def _put_events(module: Module, model: Model, stepper: Stepper) -> None:
    """Write what tells modes apart, and the events of the model."""
    first = len(model.parameters)
    count = n_parameters(stepper, model) + n_event_numbers(model)
    places = [f"p[{i}]" for i in range(count)]
    places[first : first + 2] = ["mode", "start"]
    module.put("mode_of", f"@compiled\ndef mode_of(p):\n    return p[{first}]")
    module.put("start_of", f"@compiled\ndef start_of(p):\n    return p[{first + 1}]")
    text = f"@compiled\ndef with_mode(p, mode, start):\n    return ({', '.join(places)},)"
    module.put("with_mode", text)
    collect(module, stepper.step, "step", {})
    kind = friction if isinstance(model.events, Friction) else impact
    for name in ("first_mode", "guard", "guard_on_mesh", "landed", "settled", "turning"):
        collect(module, getattr(kind, name), name, {})


def _put_energy_with(module: Module, model: Model) -> None:
    """Write the energy at another velocity, for which a potential energy is known unless it depends on that.

    Uncompiled, nobody else would see that it is the same again.
    """
    potential = tree(model, model.potential_energy)
    line = "kinetic = kinetic_energy(u, v, t, p)"
    if model.velocity in expression.names_in(potential):
        line = "kinetic, potential = energies(u, v, t, p)"
    head = "@compiled\ndef energy_with(u, v, t, p, potential):"
    module.put("energy_with", f"{head}\n    {line}\n    return kinetic + potential")


def _put_start(module: Module, stepper: Stepper) -> None:
    """Write the start, for which `Stepper.scaling` multiplies the initial velocity."""
    if stepper.scaling is None:
        collect(module, stepper.start, "start", {})
        return
    collect(module, stepper.start, "start_unscaled", {})
    module.put(
        "start",
        "@compiled\ndef start(variant, u, v, dt, p):\n"
        "    return start_unscaled(variant, u, v * p[-1], dt, p)",
    )


def _module(lane: str, settings: Mapping[str, object]) -> Module:
    return Module("kernel", settings, () if lane == "plain" else primitives.NAMES)


def _in_lane(text: str, lane: str, kinds: str) -> Kernel:
    if lane == "plain":
        namespace: dict[str, Any] = {"divided": divided}
        exec(compile(with_quotients(_PLAIN + text), "<kernel>", "exec"), namespace)
        plain: Kernel = namespace["kernel"]
        return plain
    return load(_COMPILED + text, kinds)


def _put_formulas(
    module: Module,
    model: Model,
    suffix: str,
    stepper: Stepper,
    *,
    is_rare: bool = False,
    with_kinetic: bool = False,
    with_work: bool = False,
) -> None:
    """Write the model's acceleration and energies as functions of ``(u, v, t, p)``, and what they call.

    Parameters
    ----------
    suffix
        ``_fast`` for formulas without branches.
    is_rare
        Whether they are seldom needed, so that elementary functions are not compiled into them.
    stepper
        For whom: an implicit one needs derivatives too, one with `Stepper.scaling` a factor.
    with_kinetic
        Whether the kinetic energy is needed for itself.
    with_work
        Whether the powers of damping and of driving forces are needed.
    """
    put = _marked(model)
    acceleration = put(model.acceleration)
    parts = _of_events(model, put)
    if "drive" in parts:
        held = Binary("*", Name(_MODE), parts["limit"]["_limit"])
        acceleration = Binary("-", parts["drive"]["_drive"], held)
    formulas = {
        "acceleration": {"_result": acceleration},
        **parts,
        "energies": {
            "_kinetic": put(model.kinetic_energy),
            "_potential": put(model.potential_energy),
        },
    }
    if stepper.implicit:
        formulas["slopes"] = {
            "_by_position": expression.derivative(acceleration, model.position),
            "_by_velocity": expression.derivative(acceleration, model.velocity),
        }
    if "damping_rate" in signature(stepper.step).parameters:
        rate = put(model.damping.rate) if model.damping else Number(0.0)
        formulas["damping_rate"] = {"_rate": rate}
    if with_kinetic:
        formulas["kinetic_energy"] = {"_kinetic": formulas["energies"]["_kinetic"]}
    if with_work:
        formulas["powers"] = {
            "_dissipation": put(model.dissipation or "0.0"),
            "_driving": put(model.driving or "0.0"),
        }
    is_scaled = stepper.scaling is not None
    scaled = ("acceleration", "slopes") if is_scaled else ()
    _put_functions(module, model, suffix, formulas, is_rare=is_rare, scaled=scaled)
    _put_parameters(module, model, 2 if is_scaled else 0, tabulated=stepper.tabulated)


def _marked(model: Model) -> Callable[[Formula], Expression]:
    """Return what reads a formula, its parameters marked so that no name of a user is one of the kernel's text."""
    marked: dict[Expression, Expression] = {
        Name(name): Name(name + _MARK) for name in parameter_names(model)
    }

    def put(formula: Formula) -> Expression:
        return expression.rebuilt(tree(model, formula), lambda node: marked.get(node, node))

    return put


def _put_functions(
    module: Module,
    model: Model,
    suffix: str,
    formulas: Mapping[str, Mapping[str, Expression]],
    *,
    is_rare: bool = False,
    scaled: Collection[str] = (),
    always_tuple: bool = False,
) -> None:
    """Write functions of ``(u, v, t, p)``, each with the formulas of its results by their names.

    Parameters
    ----------
    scaled
        Functions whose results are multiplied by a factor that stands behind the parameters.
    always_tuple
        Whether a function with one result returns a tuple too.
    """
    names = parameter_names(model)
    unpack = [f"{name}{_MARK} = p[{i}]" for i, name in enumerate(names)]
    for function, results in formulas.items():
        lines = list(unpack)
        if model.events is not None and function in ("acceleration", "slopes"):
            lines += [f"{_MODE} = p[{len(names)}]", f"t = t + p[{len(names) + 1}]"]
        for result, formula in results.items():
            ready = _with_functions(module, formula, suffix, is_rare)
            lines += expression.to_statements(ready, result)
            if function in scaled:
                lines.append(f"{result} = {result} * p[{len(names) + n_event_numbers(model)}]")
        returned = ", ".join(results)
        lines.append(f"return ({returned},)" if always_tuple else f"return {returned}")
        head = f"@compiled\ndef {function}{suffix}({model.position}, {model.velocity}, t, p):\n    "
        module.put(function + suffix, head + "\n    ".join(lines))


def _put_parameters(
    module: Module, model: Model, more: int = 0, *, tabulated: bool = False
) -> None:
    """Write what makes the parameters of a member a tuple, with `more` numbers and a table behind them."""
    first = len(model.parameters)
    count = first + more
    places = [f"float(parameters[case, {i}])" for i in range(count)]
    places[first:first] = ["0.0"] * n_event_numbers(model)
    values = ", ".join(places) or "0.0"
    if tabulated:
        values += f", parameters[case, {count}:]"
    text = f"@compiled\ndef parameters_of(parameters, case):\n    return ({values},)"
    module.put("parameters_of", text)


def _of_events(
    model: Model, put: Callable[[Formula], Expression]
) -> dict[str, dict[str, Expression]]:
    """Return the formulas of the events of a model, by function and result."""
    match model.events:
        case None:
            return {}
        case Friction(drive, limit):
            return {"drive": {"_drive": put(drive)}, "limit": {"_limit": put(limit)}}
        case Impact(restitution, near, slow):
            results = {"_restitution": restitution, "_near": near, "_slow": slow}
            return {"impact_of": {name: put(formula) for name, formula in results.items()}}


def _with_functions(module: Module, formula: Expression, suffix: str, is_rare: bool) -> Expression:
    """Collect the functions that a formula calls, and call them by their names in the kernel."""

    def bind(node: Expression) -> Expression:
        match node:
            case Binary("**", base, exponent) if not _is_whole(exponent):
                return bind(Call("power", (base, exponent)))
            case Compare(_, left, right) if suffix:
                # a comparison would hide the NaN of a fast function out of its range
                return Binary("+", node, _nothing(Binary("+", _nothing(left), _nothing(right))))
            case Compare():
                # as a number: a truth value knows no -0, which the fast text would give
                return Binary("*", Number(1.0), node)
            case Call(function, arguments):
                if function not in ELEMENTARY:
                    raise SimulationError(
                        f"the engine has no function {function}; it has " + ", ".join(ELEMENTARY)
                    )
                texts = ELEMENTARY[function]
                text = texts.fast if suffix else texts.full
                collect(module, text, function + suffix, {}, is_called=is_rare)
                return Call(function + suffix, arguments)
            case _:
                return node

    return expression.rebuilt(formula, bind)


def _is_whole(exponent: Expression) -> bool:
    value = expression.literal(exponent)
    return value is not None and value.is_integer()


def _nothing(node: Expression) -> Expression:
    """Return an expression that is 0, or NaN where `node` is not finite."""
    return Binary("-", node, node)
