"""What a page may run: its own scripts, named by their digests in its Content-Security-Policy, and nothing else."""

from __future__ import annotations

import base64
import hashlib
import re

_SCRIPT = re.compile(r"<script>(.*?)</script>", re.DOTALL)
_ANY = "script-src 'unsafe-inline'"


def sealed(page: str) -> str:
    """Return a page whose policy allows just the scripts that it has; `page` allows any.

    Source: Content Security Policy Level 3, section 2.3.1 (hash-source).
    """
    own = dict.fromkeys(map(digest_of, _SCRIPT.findall(page))) or {"none": None}
    return page.replace(_ANY, "script-src " + " ".join(f"'{source}'" for source in own), 1)


def digest_of(script: str) -> str:
    """Return the digest of a script as a policy writes it."""
    return f"sha256-{base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()}"
