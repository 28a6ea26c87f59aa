from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from vibsim.plan import Choice, Plan, load

TEXT = """\
title: A tiny pendulum
source: nowhere
model: {kind: pendulum, g: 1.0, L: 1.0}
initial: {theta: 1.0, omega: 0.0}
time: {end: 20.0}
levels: [5, 6, 7]
schemes: [central]
checks:
  - {converges: theta, order: scheme}
"""


@pytest.fixture
def plan_of(tmp_path: Path) -> Callable[..., Plan]:
    """Plan the tiny experiment with parts of its text replaced."""

    def build(*changes: tuple[str, str], name: str = "tiny", text: str = TEXT) -> Plan:
        for old, new in changes:
            assert old in text
            text = text.replace(old, new)
        file = tmp_path / f"{name}.yaml"
        file.write_text(text)
        return load(Choice("adhoc", file))

    return build
