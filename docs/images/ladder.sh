#!/bin/sh
# Make the picture of docs/ladder.md: one pendulum of its sweep. Run it from the root of the repository.
set -eu
SOURCE_DATE_EPOCH=0 .venv/bin/python - <<'END'
import re
from pathlib import Path

import matplotlib
import numpy as np

matplotlib.use("Agg")
matplotlib.rcParams.update({"svg.fonttype": "none", "svg.hashsalt": "vibsim"})
import matplotlib.pyplot as plt
import yaml

from vibsim import Experiment, best, simulate

page = Path("docs/ladder.md").read_text("utf-8")
content = yaml.safe_load(re.findall(r"^```yaml\n(.*?)^```$", page, re.MULTILINE | re.DOTALL)[0])
del content["sweep"]
ladder = best(Experiment.from_dict(content)).squeeze()
levels = [int(level) for level in ladder.attrs["levels"]]
del content["output"], content["tolerance"]
finest = simulate(Experiment.from_dict({**content, "levels": levels}), levels[-1]).squeeze()
# at the times that both store
t, here, there = np.intersect1d(ladder.t, finest.t, return_indices=True)
exact = finest.theta_exact[there].values
figure, axes = plt.subplots(figsize=(7, 3.4), layout="constrained")
axes.semilogy(t[1:], np.abs(finest.theta[there].values - exact)[1:], label=f"error of level {levels[-1]} alone")
axes.semilogy(t[1:], ladder.theta_error[here][1:], "k--", label="bound of the ladder")
axes.semilogy(t[1:], np.maximum(np.abs(ladder.theta[here].values - exact), 1e-17)[1:], label="error of the ladder")
axes.set(xlabel="t [s]", ylabel="error of theta [rad]", xlim=(0, 100), ylim=(1e-17, 1e-2))
figure.legend(loc="outside upper center", ncols=3, frameon=False)
axes.grid(alpha=0.3)
picture = Path("docs/images/ladder.svg")
figure.savefig(picture, metadata={"Date": None})
picture.write_text(re.sub(r" +$", "", picture.read_text(), flags=re.MULTILINE))

END
