"""Write a software bill of materials: what ``requirements/run.txt`` pins, as CycloneDX 1.6 in JSON; see ``make sbom``.

Licences are those that installed packages declare. The same pins give the same bytes.
Source: CycloneDX 1.6 (ECMA-424, 2024); package URLs of the type ``pypi``.
"""

from __future__ import annotations

import json
import re
import sys
from importlib.metadata import PackageNotFoundError, metadata
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
PINNED = re.compile(
    r"^([a-z0-9][a-z0-9._-]*)==(\S+)((?:\s+\\\n\s+--hash=sha256:[0-9a-f]{64})*)", re.M
)
VERSION = re.compile(r'^__version__ = "([^"]+)"', re.M)


def component(name: str, version: str, hashes: str) -> dict[str, Any]:
    """Return the entry of a package; of its files (a wheel for each system, a source) the digests are properties."""
    reference = f"pkg:pypi/{name}@{version}"
    digests = sorted(re.findall(r"[0-9a-f]{64}", hashes))
    return {
        "type": "library",
        "bom-ref": reference,
        "name": name,
        "version": version,
        "purl": reference,
        **licence(name),
        "properties": [{"name": "vibsim:sha256", "value": digest} for digest in digests],
    }


def licence(name: str) -> dict[str, Any]:
    """Return the licence that an installed package declares as an SPDX expression; nothing where it does not."""
    try:
        found = metadata(name).get("License-Expression")
    except PackageNotFoundError:
        return {}
    return {"licenses": [{"expression": found}]} if found else {}


def bill() -> dict[str, Any]:
    """Return the whole bill."""
    version = VERSION.search((ROOT / "vibsim/__init__.py").read_text())
    assert version
    pins = PINNED.findall((ROOT / "requirements/run.txt").read_text())
    parts = [component(*pin) for pin in sorted(pins)]
    own = {"type": "application", "name": "vibsim", "version": version[1], "bom-ref": "vibsim"}
    own["licenses"] = [{"expression": "MIT"}]
    return {
        "bomFormat": "CycloneDX",
        "specVersion": "1.6",
        "version": 1,
        "metadata": {"component": own},
        "components": parts,
        "dependencies": [{"ref": "vibsim", "dependsOn": [part["bom-ref"] for part in parts]}],
    }


if __name__ == "__main__":
    place = Path(sys.argv[1])
    place.parent.mkdir(exist_ok=True)
    place.write_text(json.dumps(bill(), indent=1) + "\n")
