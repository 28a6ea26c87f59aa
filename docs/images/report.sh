#!/bin/sh
# Take the pictures of the README and of docs/solver.md: first screens of reports in a headless browser. Run it from the
# root of the repository.
set -eu
browser=$(command -v chromium || command -v chromium-browser || command -v google-chrome)
results=$(mktemp -d)
trap 'rm -rf "$results"' EXIT
picture() { # NAME SIZE EXPERIMENT
    "$browser" --headless=new --no-sandbox --disable-gpu --hide-scrollbars --window-size="$2" \
        --screenshot="docs/images/$1.png" "file://$results/$3/report.html" 2>/dev/null
}
.venv/bin/vibsim run theta_convergence -q --results "$results"
picture report 1100,632 pendulum_lab/theta_convergence
.venv/bin/vibsim run examples/heat/heat.yaml --allow-commands -q --results "$results"
picture solver 1100,745 adhoc/heat
