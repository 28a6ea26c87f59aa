"""The registry of schemes; a family of schemes is one file of this package and one line here."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from vibsim.schemes.base import Option, Scheme, Stepper
from vibsim.schemes.central import CENTRAL

SCHEMES: Mapping[str, Scheme] = MappingProxyType({scheme.kind: scheme for scheme in (CENTRAL,)})

__all__ = ["SCHEMES", "Option", "Scheme", "Stepper"]
