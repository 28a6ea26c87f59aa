"""Settings of Sphinx for the documentation site: ``make docs``.

The pages are the Markdown files of the repository, with the links that they have there. The reference is filled from
the code. The site opens from its folder, without a server or a network, and so does its search.
"""

from __future__ import annotations

import os
import re
import site
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
# vibsim and what it needs are in the environment of the checkout; that of Sphinx comes first.
site.addsitedir(str(next((ROOT / ".venv" / "lib").glob("python3*/site-packages"))))
sys.path.insert(0, str(Path(__file__).parent))

import reference  # noqa: E402

project = "vibsim"
root_doc = "docs/index"
include_patterns = ["*.md", "docs/**.md", "examples/**.md", "results/README.md", "config/README.md"]
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
myst_heading_anchors = 4
myst_enable_extensions = ["html_image"]  # a picture with a width, in the README
# what pydantic adds is not ours
autodoc_default_options = {"members": True, "exclude-members": "model_config, model_post_init"}
autodoc_typehints = "none"  # the docstrings say types and shapes in words
smartquotes = False  # u'' is a second derivative
html_theme = "furo"
html_title = "vibsim"
html_copy_source = False
html_show_sphinx = False
html_extra_path = ["index.html"]
html_show_copyright = False
EXPERIMENT = re.compile(r"\]\((?:\.\./)*configs/\w+/(\w+)\.yaml\)")


def fill(app: Any, name: str, content: list[str]) -> None:
    """Put what the code says behind the pages of the reference, and the pages of the index into the side bar.

    Links to experiment files lead to their place in the reference.
    """
    folder, _, page = name.rpartition("/")
    to_experiments = os.path.relpath("docs/reference/experiments.md", folder or ".")
    content[0] = EXPERIMENT.sub(rf"]({to_experiments}#\1)", content[0])
    if folder == "docs/reference":
        content[0] += "\n" + reference.page(page)
    if name == root_doc:
        for part in content[0].split("\n## ")[1:]:
            pages = [
                f"{text} <{page}>" for text, page in re.findall(r"\[(.+?)\]\(([^)#]+\.md)\)", part)
            ]
            head = ("```{toctree}", ":hidden:", f":caption: {part.splitlines()[0]}", "")
            content[0] += "\n".join(("", *head, *pages, "```", ""))


def setup(app: Any) -> None:
    """Connect `fill`."""
    app.connect("source-read", fill)
