#!/bin/sh
# Take the pictures of docs/results.md: parts of reports in a headless browser. Run it from the root of the repository.
set -eu
browser=$(command -v chromium || command -v chromium-browser || command -v google-chrome)
results=$(mktemp -d)
trap 'rm -rf "$results"' EXIT
.venv/bin/vibsim run simple_pendulum excited_oscillator period_map -q --results "$results"
picture() { # NAME EXPERIMENT SECTION SIZE HIDDEN: of a section without what is hidden
    page=$results/$2/report.html
    sed "s|</head>|<style>header, main > :not($3), $5 { display: none !important }</style></head>|" "$page" >"$page.part.html"
    "$browser" --headless=new --no-sandbox --disable-gpu --hide-scrollbars --virtual-time-budget=1500 --window-size="$4" \
        --screenshot="docs/images/results-$1.png" "file://$page.part.html" 2>/dev/null
}
picture player vibration_text/simple_pendulum '#player' 900,650 'h3'
picture long vibration_text/excited_oscillator '#motion' 1100,620 'h2, details, p, #motion > figure:not([id^=long])'
picture members pendulum_lab/period_map '#members' 900,640 'h2'
