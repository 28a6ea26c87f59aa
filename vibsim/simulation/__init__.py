"""From an experiment and a level to the data of that level: every scheme, every member, one record.

The record holds what a level file holds: the states, the energies, their exact values where they are known, and what
was gathered over every step. Shapes are (scheme, case, t), (case, t), (scheme, case) or (case,). Where storage
is bounded (`vibsim.experiment.storage.is_lean`), of the series only those of
`vibsim.experiment.storage.lean_series`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from vibsim.core.lazy import lazy

if TYPE_CHECKING:
    from vibsim.simulation.level import simulate, simulate_record

__all__ = ["simulate", "simulate_record"]

__getattr__, __dir__ = lazy(__name__, {".level": ("simulate", "simulate_record")})
