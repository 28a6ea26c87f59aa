"""A process of `bench.peers`: reads one request in JSON per line, answers in one line."""

from __future__ import annotations

import importlib
import json
import math
import os
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np

Solve = Callable[[], Any]


def main() -> None:
    """Answer until there is no request any more."""
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    # a library that prints must not disturb the answers
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    state: dict[str, Any] = {}
    for line in sys.stdin:
        request = json.loads(line)
        try:
            answer = DO[request.pop("do")](state, **request)
        except Exception as error:
            answer = {"reason": f"{type(error).__name__}: {error}"}
        answers.write(json.dumps(answer) + "\n")
        answers.flush()


def load(state: dict[str, Any], method: str, arrays: str, **rest: Any) -> dict[str, Any]:
    """Import the method and read the problem."""
    module, name = method.split(":")
    with np.load(arrays) as found:
        state |= {"theta": found["theta"], "exact": found["exact"], **rest}
    state["make"] = getattr(importlib.import_module(f"bench.{module}"), name)
    return {}


def set_(state: dict[str, Any], setting: Any, members: int) -> dict[str, Any]:
    """Prepare to solve with a setting, and return the largest error; compiling and preparing are no part of the time.

    Where not all members are solved, those that are spread over all of them, with the first and the last.
    """
    count = len(state["theta"])
    chosen = np.unique(np.linspace(0, count - 1, members or count).round().astype(int))
    state["solve"] = state["make"](state["theta"][chosen], state["end"], setting)
    state["members"] = len(chosen)
    error = float(np.max(np.abs(state["solve"]() - state["exact"][chosen])))
    return {"error": error if math.isfinite(error) else 1e300}


def time_(state: dict[str, Any]) -> dict[str, Any]:
    """Return the seconds that one solution of one member takes."""
    solve: Solve = state["solve"]
    repeats, passed, began = 0, 0.0, time.perf_counter()
    while passed < state["enough"]:
        solve()
        repeats += 1
        passed = time.perf_counter() - began
    return {"seconds": passed / repeats / state["members"]}


DO: dict[str, Callable[..., dict[str, Any]]] = {"load": load, "set": set_, "time": time_}

if __name__ == "__main__":
    main()
