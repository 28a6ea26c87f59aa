"""Whether any ladder of levels converges, from arrays alone; `judge` is for the results of any solver.

From a ladder to its verdict:

1. `differences`: norms and angles of the differences of successive levels, or in `study` their Gram matrix;
2. `error_model`: the probability of each power, window of levels and limit, from that matrix and the noise alone;
3. `assessment`: the verdict by these probabilities, on the ladder of any solver (`study.outcomes`);
4. `verdict`: the verdict on an experiment, where facts that no ladder shows (`ladder_facts`) come first, and a promised
   order may hide behind a higher one (`hidden_order`).

`thresholds` and `error_model.priors` hold all numbers that decide. `extrapolation` decides nothing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from vibsim.core.lazy import lazy

if TYPE_CHECKING:
    from vibsim.convergence.study.judge import judge
    from vibsim.convergence.study.verdict import LadderVerdict

__all__ = ["LadderVerdict", "judge"]

__getattr__, __dir__ = lazy(
    __name__, {".study.verdict": ("LadderVerdict",), ".study.judge": ("judge",)}
)
