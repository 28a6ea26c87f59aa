"""A real browser that opens a page, acts on it, and says what it found."""

from __future__ import annotations

import html
import json
import os
import re
import shutil
import subprocess
import tempfile
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from PIL import Image

from vibsim.report.page.templates import digest_of

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
MISSING = (
    "no Chromium is on the PATH, so nothing tells whether pages work in a browser: install it "
    "(`apt-get install chromium`; as root, `make test-slow` does)"
)
WATCH = """
window.found = {errors: []};
addEventListener("error", (event) => found.errors.push(String(event.message)));
addEventListener("securitypolicyviolation", (event) => found.errors.push(`refused: ${event.violatedDirective}`));
"""
TOLD = """
addEventListener("load", () => {
  try { act(); } catch (error) { found.errors.push(String(error)); }
  const told = document.createElement("pre");
  told.id = "found";
  told.textContent = JSON.stringify(found);
  document.body.append(told);
});
"""


OPTIONS = ("--headless=new", "--no-sandbox", "--disable-gpu")


def dumped(address: str, profile: Path, *options: str) -> str:
    """Return the document that a browser makes of a page."""
    return _opened(address, profile, *options, "--dump-dom")


def printed(page: Path, folder: Path) -> int:
    """Print a page, and return how many sheets that takes."""
    return len(sheets(page, folder))


def sheets(page: Path, folder: Path) -> list[bool]:
    """Print a page, and return of each sheet whether there is anything on it."""
    path = folder / "page.pdf"
    _opened(page.as_uri(), folder / "profile", f"--print-to-pdf={path}", "--no-pdf-header-footer")
    found = re.findall(rb"/Type */Page\b(.*?)endobj", path.read_bytes(), re.DOTALL)
    return [b"/Font" in resources or b"/XObject" in resources for resources in found]


def picture(page: Path, size: tuple[int, int], folder: Path, *options: str) -> Image.Image:
    """Return the picture of the first screen of a page, of so many pixels."""
    path, window = folder / "page.png", "--window-size={},{}".format(*size)
    shot = (f"--screenshot={path}", window, "--hide-scrollbars", *options)
    _opened(page.as_uri(), folder / "profile", *shot)
    with Image.open(path) as found:
        return found.convert("L")


def _opened(address: str, profile: Path, *options: str) -> str:
    """Return what a browser prints of a page; without a browser the test is skipped, or fails if needed."""
    found = _program()
    if not found.startswith("/"):
        (pytest.fail if os.environ.get("VIBSIM_NEEDS_BROWSER") else pytest.skip)(found)
    return _started(found, address, profile, *options)


@cache
def _program() -> str:
    """Return the path of a browser that starts, or a sentence saying why there is none."""
    found = next(filter(None, map(shutil.which, NAMES)), None)
    if found is None:
        return MISSING
    with tempfile.TemporaryDirectory() as folder:
        try:
            _started(found, "about:blank", Path(folder), "--dump-dom")
        except subprocess.SubprocessError as error:
            told = (getattr(error, "stderr", "") or "").strip().splitlines()[-3:]
            return (
                f"no page can be opened, because {found} does not start: {error} {' '.join(told)}"
            )
    return found


def _started(program: str, address: str, profile: Path, *options: str) -> str:
    command = [program, *OPTIONS, f"--user-data-dir={profile}", *options, address]
    # its socket lies in the temporary folder, and the name of a socket has a hundred letters at most
    environment = {**os.environ, "TMPDIR": "/tmp"}
    ended = subprocess.run(
        command, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=120, check=True, env=environment,
    )  # fmt: skip
    return ended.stdout


def run(page: Path, act: str, folder: Path, *options: str) -> dict[str, Any]:
    """Open a page offline under its own policy, run the body of a function, and return what it put into `found`."""
    text = page.read_text(encoding="utf-8")
    added = [WATCH, f"function act() {{{act}}}{TOLD}"]
    own = " ".join(f"'{digest_of(script)}'" for script in added)
    text, policies = re.subn(r"(?<=; )script-src ('none')?", f"script-src {own} ", text, count=1)
    assert policies, "the page has no policy on scripts"
    first, last = (f"<script>{script}</script>" for script in added)
    text = text.replace('<meta charset="utf-8">', f'<meta charset="utf-8">{first}', 1)
    changed = folder / "page.html"
    changed.write_text(text.replace("</body>", f"{last}</body>"), encoding="utf-8")
    document = dumped(changed.as_uri(), folder / "profile", *options)
    told = re.search(r'<pre id="found">(.*?)</pre>', document, flags=re.DOTALL)
    assert told, "the page told nothing"
    found: dict[str, Any] = json.loads(html.unescape(told[1]))
    return found
