"""What every test process does first."""

from __future__ import annotations

import os
import sys

# Without compiled modules beside the sources every worker rewrites the assertions of 200 files, and every job of a
# workflow compiles 300 modules: 20 s and 0.5 s. Copies of the package that tests change are in folders of their own.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False
