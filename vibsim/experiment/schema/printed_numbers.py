"""Numbers as a source prints them: the digits say how exact they are meant."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from decimal import Decimal
from typing import Annotated, Any

from pydantic import BeforeValidator, WithJsonSchema
from pydantic_core import PydanticCustomError

_POWER = r"(?:\s*(?:[x*·×]|\\cdot)?\s*10\s*\^\s*(?:\{\s*([-+]?\d{1,3})\s*\}|([-+]?\d{1,3}))|[eE]([-+]?\d{1,3}))"
_PRINTED = re.compile(rf"\s*([-+]?(?:\d+\.?\d*|\.\d+)){_POWER}?\s*", re.ASCII)
_MAX_LENGTH = 60
RULE = "must be a number as printed, such as 1.120e8, 1.120 10^8 or 4.93"


@dataclass(frozen=True)
class PrintedNumber:
    """What a printed number says."""

    number: float
    half_unit: float
    """Half a unit of its last digit."""


def read_printed(text: str) -> PrintedNumber | None:
    """Return what `text` says; None where it is no number, or none that floats hold."""
    found = _PRINTED.fullmatch(text.replace("\N{MINUS SIGN}", "-")[: _MAX_LENGTH + 1])
    if found is None or len(text) > _MAX_LENGTH:
        return None
    mantissa = Decimal(found[1])
    power = int(found[2] or found[3] or found[4] or 0)
    # a number of digits without a point ends in units
    last = int(mantissa.as_tuple().exponent) + power
    printed = PrintedNumber(float(mantissa.scaleb(power)), float(Decimal(5).scaleb(last - 1)))
    is_sound = math.isfinite(printed.number) and 0.0 < printed.half_unit < math.inf
    return printed if is_sound else None


def _as_text(value: Any) -> str:
    """Return a number as text; in a file its digits are those written (`vibsim.experiment.partial_validation`)."""
    text = repr(value) if isinstance(value, int | float) and not isinstance(value, bool) else value
    if not isinstance(text, str) or read_printed(text) is None:
        raise PydanticCustomError("printed", RULE)
    return text


PrintedText = Annotated[
    str, BeforeValidator(_as_text), WithJsonSchema({"type": ["number", "string"]})
]
