#!/bin/sh
# Take the picture of the README: the first screen of a report in a headless browser. Run it from the root of the repository.
set -eu
browser=$(command -v chromium || command -v chromium-browser || command -v google-chrome)
results=$(mktemp -d)
trap 'rm -rf "$results"' EXIT
.venv/bin/vibsim run theta_convergence -q --results "$results"
"$browser" --headless=new --no-sandbox --disable-gpu --hide-scrollbars --window-size=1400,636 --screenshot=docs/images/report.png \
    "file://$results/pendulum_lab/theta_convergence/report.html" 2>/dev/null
