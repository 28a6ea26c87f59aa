"""Whether any ladder of levels converges, from arrays alone; `judge` is for the results of any solver."""

from __future__ import annotations

from typing import TYPE_CHECKING

from vibsim.core.lazy import loader

if TYPE_CHECKING:
    from vibsim.convergence.study.judgement import judge
    from vibsim.convergence.study.verdict import LadderVerdict

__all__ = ["LadderVerdict", "judge"]

__getattr__ = loader(
    __name__,
    {
        "LadderVerdict": "vibsim.convergence.study.verdict",
        "judge": "vibsim.convergence.study.judgement",
    },
)


def __dir__() -> list[str]:
    return __all__
