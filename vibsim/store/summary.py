"""Write and read summaries as JSON: null in place of NaN, sealed by the field ``integrity``."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from vibsim.core import regular_files
from vibsim.core.errors import DamagedFileError, StaleFileError
from vibsim.core.vocabulary import FORMAT, jsonable
from vibsim.store import seal
from vibsim.store.atomic import write_text


def write_json(path: Path, content: Mapping[str, Any], *, digest: str) -> None:
    """Write `content` to `path` in one step, with the digest of its job; NaN and infinities become null."""
    whole = {"vibsim_format": FORMAT, **content, "digest": digest}
    whole.pop("integrity", None)
    write_text(path, _sealed(jsonable(whole)))


def read_json(path: Path, *, digest: str | None = None, name: str | None = None) -> dict[str, Any]:
    """Read a file that `write_json` wrote.

    Parameters
    ----------
    digest, name
        Expected digest of the job, and expected ``collection/name`` of the experiment; None accepts any.

    Raises
    ------
    DamagedFileError
        Where a single bit differs from what was written.
    StaleFileError
        Where the file is intact but belongs to another job or experiment.
    """
    try:
        with regular_files.reading(path) as file:
            text = file.read().decode()
        content = json.loads(text)
    except OSError as error:
        raise DamagedFileError(path, f"cannot be read: {error.strerror}") from error
    except (ValueError, RecursionError) as error:
        raise DamagedFileError(path, "it is not JSON") from error
    if not isinstance(content, dict) or text != _sealed(content):
        raise DamagedFileError(path, "its bytes are not those that were written")
    seal.check_job(path, content.get("vibsim_format"), str(content.get("digest")), digest)
    stored = f"{content.get('collection')}/{content.get('experiment')}"
    if name is not None and stored != name:
        raise StaleFileError(path, f"it is {stored}, wanted is {name}")
    return content


def _sealed(content: Mapping[str, Any]) -> str:
    bare = {key: value for key, value in content.items() if key != "integrity"}
    integrity = hashlib.sha256(_text(bare).encode()).hexdigest()
    return _text({**bare, "integrity": integrity})


def _text(content: Mapping[str, Any]) -> str:
    return json.dumps(content, indent=1, ensure_ascii=False) + "\n"
