#!/bin/sh
# Make the pictures of the tutorial, of docs/verdicts.md and of docs/judge.md from the files and the code of the pages. Run
# it from the root of the repository.
set -eu
results=$(mktemp -d)
trap 'rm -rf "$results"' EXIT
for name in my_pendulum.yaml sweep.yaml own.yaml solver.py; do
    sed "1,/to \`$name\`/d" docs/tutorial.md | sed '1,/^```[a-z]*$/d; /^```$/,$d' >"$results/$name"
done
.venv/bin/vibsim run "$results/my_pendulum.yaml" -q --results "$results"
cp "$results/adhoc/my_pendulum/figures/differences_theta_0_central.svg" docs/images/verdicts-differences.svg
.venv/bin/vibsim run "$results/my_pendulum.yaml" --set 'schemes[0].start=first_order' -q --results "$results" || [ $? = 1 ]
.venv/bin/vibsim run "$results/sweep.yaml" -q --results "$results"
.venv/bin/vibsim run "$results/own.yaml" -q --results "$results"
cp "$results/adhoc/my_pendulum/figures/hero_differences.svg" docs/images/tutorial-trap.svg
cp "$results/adhoc/sweep/figures/sweep_error_theta.svg" docs/images/tutorial-sweep.svg
cp "$results/adhoc/own/figures/phase_plane_0.svg" docs/images/tutorial-own.svg
.venv/bin/python "$results/solver.py" >"$results/angle.csv"
SOURCE_DATE_EPOCH=0 .venv/bin/python - "$results/angle.csv" <<'END'
import re
import sys
from pathlib import Path

import matplotlib
import numpy as np

from vibsim import judge

matplotlib.rcParams.update({"svg.fonttype": "none", "svg.hashsalt": "vibsim"})
steps, angles = np.loadtxt(sys.argv[1], delimiter=",", skiprows=1).T
judge(steps, angles, order=2).plot("docs/images/tutorial-solver.svg")
page = Path("docs/judge.md").read_text()
blocks = re.findall(r"^```python\n(.*?)^```", page, re.DOTALL | re.MULTILINE)
(code,) = (block for block in blocks if "heat.svg" in block)
exec(code.replace("heat.svg", "docs/images/judge.svg"))
END
