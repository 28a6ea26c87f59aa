"""The registry of schemes; a family is one file of this package and one line here, or that of an installed package."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from vibsim.core.registry import Registry
from vibsim.schemes.acceptance import fault_of
from vibsim.schemes.adaptive import ADAPTIVE
from vibsim.schemes.base import (
    AnyOption,
    Flag,
    NumberOption,
    Option,
    Options,
    Scheme,
    Stepper,
)
from vibsim.schemes.central import CENTRED
from vibsim.schemes.composition import COMPOSITIONS
from vibsim.schemes.implicit import GAUSS4, IMPLICIT
from vibsim.schemes.multistep import ADAMS_BASHFORTH
from vibsim.schemes.newmark import NEWMARK
from vibsim.schemes.runge_kutta import RKN4, RUNGE_KUTTA

_ALL = (
    *CENTRED,
    *RUNGE_KUTTA,
    *ADAMS_BASHFORTH,
    *COMPOSITIONS,
    RKN4,
    *IMPLICIT,
    *NEWMARK,
    GAUSS4,
    *ADAPTIVE,
)
SCHEMES = Registry("vibsim.schemes", Scheme, _ALL, fault_of)

FIXED_STEP: Mapping[str, Scheme] = MappingProxyType(
    {scheme.kind: scheme for scheme in _ALL if not scheme.adaptive}
)
"""Schemes of vibsim that take equal steps, and so have levels and orders."""

__all__ = [
    "FIXED_STEP",
    "SCHEMES",
    "AnyOption",
    "Flag",
    "NumberOption",
    "Option",
    "Options",
    "Scheme",
    "Stepper",
]
