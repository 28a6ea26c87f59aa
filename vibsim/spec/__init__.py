"""From a YAML file to a validated, frozen experiment; every fault of a file is reported at once, with its line."""

from vibsim.spec.checks import (
    REASONS,
    At,
    Check,
    ClaimCheck,
    ConvergesCheck,
    Expect,
    ValueCheck,
)
from vibsim.spec.experiment import (
    Experiment,
    ModelSpec,
    SchemeSpec,
    Sweep,
    TimeSpec,
    canonical,
    restore,
)
from vibsim.spec.load import collection_of, from_dict, load
from vibsim.spec.sampling import stride
from vibsim.spec.values import VALUES, Value

__all__ = [
    "REASONS",
    "VALUES",
    "At",
    "Check",
    "ClaimCheck",
    "ConvergesCheck",
    "Expect",
    "Experiment",
    "ModelSpec",
    "SchemeSpec",
    "Sweep",
    "TimeSpec",
    "Value",
    "ValueCheck",
    "canonical",
    "collection_of",
    "from_dict",
    "load",
    "restore",
    "stride",
]
