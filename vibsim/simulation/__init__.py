"""From an experiment and a level to the data of that level: every scheme, every member, one record.

The record has the content of a level file: states, energies, exact values if they are known, and statistics over all
steps. Shapes are (scheme, case, t), (case, t), (scheme, case) or (case,). If storage is bounded
(`vibsim.experiment.storage.is_bounded`), it has only the series that are needed.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from vibsim.core.lazy import lazy

if TYPE_CHECKING:
    from vibsim.simulation.level import simulate, simulate_record

__all__ = ["simulate", "simulate_record"]

__getattr__, __dir__ = lazy(__name__, {".level": ("simulate", "simulate_record")})
