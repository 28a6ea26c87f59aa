"""``python -m vibsim`` is the command ``vibsim``."""

import sys

from vibsim.cli import main

sys.exit(main())
