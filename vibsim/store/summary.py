"""The summary as JSON text: null and never NaN, and sealed by its field ``integrity``."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from vibsim.errors import DamagedFileError, StaleFileError
from vibsim.store.atomic import write_text

FORMAT = 1
"""Version of the file format, ``vibsim_format`` in every file."""


def write_json(path: Path, content: Mapping[str, Any], *, digest: str) -> None:
    """Write `content` to `path` in one step.

    Parameters
    ----------
    path
        The target.
    content
        JSON-able; numbers that JSON lacks (NaN, infinities) become null.
    digest
        Digest of the job that made it.
    """
    whole = {"vibsim_format": FORMAT, **content, "digest": digest}
    whole.pop("integrity", None)
    write_text(path, _sealed(_finite(whole)))


def read_json(path: Path, *, digest: str | None = None) -> dict[str, Any]:
    """Read what `write_json` wrote.

    Parameters
    ----------
    path
        The file.
    digest
        Digest of the job whose result is wanted; None takes any.

    Raises
    ------
    DamagedFileError
        When a single bit differs from what was written.
    StaleFileError
        When the file is whole but another job's.
    """
    try:
        text = path.read_bytes().decode()
        content = json.loads(text)
    except OSError as error:
        raise DamagedFileError(path, f"cannot be read: {error.strerror}") from error
    except (ValueError, RecursionError) as error:
        raise DamagedFileError(path, "it is not JSON") from error
    if not isinstance(content, dict) or text != _sealed(content):
        raise DamagedFileError(path, "its bytes are not those that were written")
    if content.get("vibsim_format") != FORMAT:
        raise StaleFileError(path, f"it is not in vibsim format {FORMAT}")
    if digest is not None and content.get("digest") != digest:
        found = str(content.get("digest"))
        raise StaleFileError(path, f"it belongs to job {found[:12]}, wanted is {digest[:12]}")
    return content


def _sealed(content: Mapping[str, Any]) -> str:
    bare = {key: value for key, value in content.items() if key != "integrity"}
    integrity = hashlib.sha256(_text(bare).encode()).hexdigest()
    return _text({**bare, "integrity": integrity})


def _text(content: Mapping[str, Any]) -> str:
    return json.dumps(content, indent=1, ensure_ascii=False) + "\n"


def _finite(value: Any) -> Any:
    if hasattr(value, "tolist"):  # numbers and arrays of numpy, which quick readers do not import
        value = value.tolist()
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {str(key): _finite(item) for key, item in value.items()}
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [_finite(item) for item in value]
    return value
