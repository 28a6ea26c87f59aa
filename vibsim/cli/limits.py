"""Limits that are set for a process (``ulimit``) and leave vibsim no way to work."""

from __future__ import annotations

import resource

from vibsim.core.errors import VibsimError

LEAST_BYTES = 600 * 10**6
"""Address space that a run needs. Measured with 2 cores: 450 MB are sometimes too little, 500 MB were enough."""


def check() -> None:
    """Refuse to start with too little address space: libraries fail in many ways then, and some without a word.

    Raises
    ------
    VibsimError
        With the limit and what is needed.
    """
    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    if limit != resource.RLIM_INFINITY and limit < LEAST_BYTES:
        found, needed = limit // 10**6, LEAST_BYTES // 10**6
        text = f"not enough memory: the limit is {found} MB (ulimit -v), {needed} MB are needed"
        raise VibsimError(text)
