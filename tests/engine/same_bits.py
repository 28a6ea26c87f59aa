"""Every array of a run by its name, and whether two runs have the same bits."""

import dataclasses

import numpy as np


def arrays(run):
    """Yield every array of a run with its name; members come first in each."""
    for field in dataclasses.fields(run):
        value = getattr(run, field.name)
        if dataclasses.is_dataclass(value):
            yield from arrays(value)
        elif value is not None:
            members_first = np.moveaxis(value, 1, 0) if field.name == "states" else value
            yield field.name, np.ascontiguousarray(members_first)


def assert_same_bits(one, other):
    for (name, a), (_, b) in zip(arrays(one), arrays(other), strict=True):
        assert a.tobytes() == b.tobytes(), name
