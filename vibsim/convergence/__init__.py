"""Whether any ladder of levels converges, from arrays alone; `judge` is for the results of any solver."""

from __future__ import annotations

from typing import TYPE_CHECKING

from vibsim.core.lazy import lazy

if TYPE_CHECKING:
    from vibsim.convergence.study.judgement import judge
    from vibsim.convergence.study.verdict import LadderVerdict

__all__ = ["LadderVerdict", "judge"]

__getattr__, __dir__ = lazy(
    __name__, {".study.verdict": ("LadderVerdict",), ".study.judgement": ("judge",)}
)
