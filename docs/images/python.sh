#!/bin/sh
# Make the picture of docs/python.md by the code of the page. Run it from the root of the repository.
set -eu
SOURCE_DATE_EPOCH=0 .venv/bin/python - <<'END'
import os
import re
import tempfile
from pathlib import Path

import matplotlib

matplotlib.rcParams.update({"svg.fonttype": "none", "svg.hashsalt": "vibsim"})
picture = Path("docs/images/python-forced.svg").resolve()
text = Path("docs/python.md").read_text("utf-8")
code = "\n".join(re.findall(r"^```python\n(.*?)^```$", text, re.MULTILINE | re.DOTALL))
last = 'visualize(levels[-1], "forced.svg")'
with tempfile.TemporaryDirectory() as folder:
    os.chdir(folder)
    exec(code.partition(last)[0] + last, {})
    picture.write_text(re.sub(r" +$", "", Path("forced.svg").read_text(), flags=re.MULTILINE))
END
