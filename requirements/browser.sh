#!/bin/sh
# Make a Chromium be there for the tests that open pages in a real browser: Debian's package, where that can be installed.
set -eu
for name in chromium chromium-browser google-chrome google-chrome-stable; do
    ! command -v "$name" >/dev/null || exit 0
done
if command -v apt-get >/dev/null && [ "$(id -u)" = 0 ]; then
    timeout 300 apt-get install --yes --no-install-recommends chromium && exit 0
fi
echo "there is no Chromium, and it cannot be installed here: tests of pages in a browser are skipped" >&2
