r"""The general oscillator, ``m u'' + f(u') + s(u) = F(t)``, from formulas that a user writes.

Source: vibration text (B), section 8, equation (59), and exercises 1, 9 and 10.2. Units: m [kg], u [m], v [m s-1], f, s
and F [N]; energy ``m v^2/2 + V(u)`` [J] with V the integral of s from 0. With m = 1 and numbers without units, all of
these are dimensionless.

The damping f is a formula in v. If it is linear (``b v``) or quadratic (``b |v| v``, B section 8.2), however it is
written, schemes with a special treatment of these two recognise it. Coulomb friction, ``{coulomb: b}``, holds the body
where ``|F - s| <= b`` (`vibsim.models.events`; B, section 10.3); as a formula, ``b sign(v)``, it is a force like any
other. A user may also write events and a stop (`vibsim.models.shared.crossings`); there is then no exact solution.

Instead of the force, an exact solution u_e(t) may be written (manufactured solution; B, section 2.2 and exercise 9):
the force is then ``F = m u_e'' + f(u_e') + s(u_e)``, and the initial values are those of u_e.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache, cached_property, partial
from typing import Any

import numpy as np

from vibsim.core.array_types import Floats
from vibsim.formula import (
    ONE,
    Compare,
    Expression,
    Name,
    is_zero,
    parse,
    put,
    to_formula,
    values,
)
from vibsim.models.base import (
    FormulaField,
    Model,
    Numbers,
    Parameter,
    by_name,
    declared_parameters,
)
from vibsim.models.events import Crossings, Friction
from vibsim.models.shared.crossings import crossings, described
from vibsim.models.shared.linear_motion import friction_motion
from vibsim.models.shared.manufactured import Manufactured
from vibsim.models.shared.mechanical import Forces, mechanical

MASS = Parameter("m", 1.0, "kg", "mass", minimum=0.0, exclusive=True, neutral=1.0)
COULOMB = "coulomb"
TERMS = {"linear": "b*v", "quadratic": "b*abs(v)*v", COULOMB: "b*sign(v)"}
UNITS = {"linear": "kg s-1", "quadratic": "kg m-1", COULOMB: "N"}

PULLS = "force s(u) of the spring [N], positive where it pulls back"
OPPOSES = "damping force f(v) [N], positive where it opposes v > 0"
EXACT = "exact solution u(t) [m], from which the force then follows"
POTENTIAL = "potential energy V(u) [J], where it cannot be found from the spring"
FORMULAS = (
    FormulaField("spring", ("u",), "u", PULLS),
    FormulaField("damping", ("v",), "0", OPPOSES, terms=TERMS, term_units=UNITS),
    FormulaField("force", ("t",), "0", "driving force F(t) [N]"),
    FormulaField("exact", ("t",), "", EXACT, derivatives=2),
    FormulaField("potential", ("u",), "", POTENTIAL),
)


@dataclass(frozen=True)
class Written:
    """The parsed formulas of a user."""

    formulas: Mapping[str, str]
    declared: tuple[str, ...]
    with_mass: bool = True
    """Whether the mass is a parameter of the equation; otherwise it is the number 1."""

    @cached_property
    def term(self) -> str:
        """Kind of the damping if it is written as a term with the coefficient b; otherwise empty."""
        kinds = {text: kind for kind, text in TERMS.items()} if "b" not in self.declared else {}
        return kinds.get(self.formulas.get("damping", ""), "")

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """Every parameter, in the order of the engine."""
        rows = [MASS]
        if kind := self.term:
            words, least = f"coefficient of the {kind} damping", 0.0 if kind == COULOMB else None
            rows.append(Parameter("b", 0.0, UNITS[kind], words, least, path=f"damping.{kind}"))
        return (*rows, *declared_parameters(self.declared))

    def read(self, name: str) -> Expression:
        """Return the formula of a field, or its default if the user wrote none."""
        field = next(field for field in FORMULAS if field.name == name)
        known = (*field.names, *(row.name for row in self.parameters))
        return parse(self.formulas.get(name, field.default), known)

    @property
    def mass(self) -> Expression:
        """The mass in the equation."""
        return Name(MASS.name) if self.with_mass else ONE

    @cached_property
    def spring(self) -> Expression:
        """The force s(u)."""
        return self.read("spring")

    @cached_property
    def damping(self) -> Expression:
        """The force f(v)."""
        return self.read("damping")

    @cached_property
    def crossings(self) -> Crossings | None:
        """The events, if any are written."""
        return crossings(self.formulas, ("u", "v", "t", *(row.name for row in self.parameters)))

    @cached_property
    def manufactured(self) -> Manufactured | None:
        """The exact solution u(t), if it is written."""
        if "exact" not in self.formulas:
            return None
        texts = (self.formulas["exact"],)
        return Manufactured((self.read("exact"),), texts, ("u", "v"), self.parameters)

    @cached_property
    def force(self) -> Expression:
        """The force F(t), as written or from the exact solution."""
        motion = self.manufactured
        if motion is None:
            return self.read("force")
        return self.mass * motion.accelerations[0] + motion.along(self.damping + self.spring)


def written(formulas: Mapping[str, str], declared: tuple[str, ...]) -> Model:
    """Return the model with formulas by the names of `FORMULAS` and declared parameters.

    Equal formulas give the same object. Its equation contains the mass; its variant without that term is for mass 1:
    the same bits in fewer operations.

    Raises ExpressionError if a formula uses a name that its field does not allow.
    """
    return oscillator(tuple(sorted(formulas.items())), declared, frozenset({MASS.name}))


@cache
def oscillator(
    formulas: tuple[tuple[str, str], ...], declared: tuple[str, ...], terms: frozenset[str]
) -> Model:
    """Return the model with given formulas, and with a mass in the equation if `terms` contains ``m``."""
    user = Written(dict(formulas), declared, MASS.name in terms)
    forces = Forces(
        spring=user.spring,
        damping=user.damping,
        force=user.force,
        mass=user.mass,
        potential=user.read("potential") if "potential" in user.formulas else None,
    )
    more: dict[str, Any] = {}
    if user.term == COULOMB:
        more = _friction(user, forces)
    elif user.crossings is not None:
        more = {"scales": lambda forces: None, "events": user.crossings}
        if user.crossings.act:
            unknown = {"exact": None, "exact_period": None}
            more |= {"linear": False, "conservative": False, **unknown}
    elif user.manufactured is not None:
        more = {"exact": user.manufactured.exact, "start": user.manufactured.start}
    return mechanical(
        forces,
        user.parameters,
        kind="oscillator",
        title="Oscillator",
        source="vibration text, section 8, equation (59)",
        equation=_equation(user),
        formulas=FORMULAS,
        takes_events=True,
        written=written,
        optional=(MASS.name,),
        variant=partial(oscillator, formulas, declared),
        **more,
    )


def _friction(user: Written, forces: Forces) -> dict[str, Any]:
    """Return the fields of the model that differ with Coulomb friction.

    The energy that friction takes is summed along the path (`vibsim.engine.events`), so there is no power of damping.
    """

    def held(t: Floats, initial: Numbers, parameters: Numbers) -> dict[str, Floats]:
        numbers = by_name(user.parameters, parameters)
        stiffness = values(forces.stiffness, numbers)
        # the motion is not known where the spring does not pull back
        stiffness = np.where(stiffness > 0.0, stiffness, np.nan)
        w = np.sqrt(stiffness / numbers["m"])
        u, v = friction_motion(t, w, numbers["b"] / stiffness, initial["u"], initial["v"])
        return {"u": u, "v": v}

    return {
        "linear": False,
        "dissipation": None,
        "exact": held if forces.is_linear and not forces.is_driven else None,
        "events": Friction(
            drive=forces.over_mass(forces.force - forces.spring),
            limit=forces.over_mass(Name("b")),
            cost=Name("b"),
        ),
    }


def _equation(user: Written) -> str:
    """Return the equation of motion as a user would write it."""
    terms = ["m u''" if user.with_mass else "u''"]
    if not is_zero(user.damping):
        terms.append(_term(put(user.damping, "v", Name("u'"))))
    terms.append(_term(user.spring))
    sides = " + ".join(terms).replace("+ -", "- ")
    if user.manufactured is None:
        events = described(user.crossings, user.formulas) if user.crossings else ""
        return f"{sides} = {to_formula(user.force)}{events}"
    return f"{sides} = F(t), with F such that u = {to_formula(user.read('exact'))}"


def _term(node: Expression) -> str:
    return f"({to_formula(node)})" if isinstance(node, Compare) else to_formula(node)


OSCILLATOR = replace(written({}, ()), equation="m u'' + f(u') + s(u) = F(t)")
"""The model without formulas, shown with the general equation."""
