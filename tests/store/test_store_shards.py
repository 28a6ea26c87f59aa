from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from vibsim import store
from vibsim.core.record import Record, Variable

from .conftest import build


def part(record: Record, start: int, stop: int) -> Record:
    def cut(variable: Variable) -> Variable:
        if "case" not in variable.dims:
            return variable
        index = [slice(start, stop) if d == "case" else slice(None) for d in variable.dims]
        return replace(variable, values=variable.values[tuple(index)])

    return Record(
        {name: cut(v) for name, v in record.coords.items()},
        {name: cut(v) for name, v in record.variables.items()},
        record.attrs,
    )


@pytest.mark.parametrize("cuts", [(0, 7), (0, 1, 7), (0, 3, 4, 7)])
def test_joined_shards_are_the_whole(cuts: tuple[int, ...]) -> None:
    whole = build(cases=7)
    joined = store.join([part(whole, a, b) for a, b in pairwise(cuts)])
    for name in (*whole.coords, *whole.variables):
        assert joined[name].tobytes() == whole[name].tobytes()


def test_shards_that_do_not_belong_together_are_refused() -> None:
    first, second = part(build(), 0, 1), part(build(), 1, 3)
    times = Variable(("t",), np.linspace(0, 21, 9), second.coords["t"].attrs)
    with pytest.raises(ValueError, match=r"^t: "):
        store.join([first, replace(second, coords={**second.coords, "t": times})])
    with pytest.raises(ValueError, match="different variables"):
        store.join([first, replace(second, variables={})])
